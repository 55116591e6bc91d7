"""Stored rows to records, each read in one place."""
