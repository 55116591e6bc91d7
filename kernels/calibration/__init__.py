"""From the sensors of a suit to a skeleton and its poses."""
