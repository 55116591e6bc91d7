"""Poses of one skeleton, and of another."""
