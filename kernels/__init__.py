"""How: pure array code."""
