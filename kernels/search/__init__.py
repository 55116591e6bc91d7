"""Clips like this one (S4): normalisation, encoders and their training, nearest windows."""
