"""Clips like this one: normalisation, encoders and their training, nearest windows."""
