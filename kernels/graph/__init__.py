"""Which pose may follow which, and the best way through."""
