"""Music-motion matching (S1)."""
