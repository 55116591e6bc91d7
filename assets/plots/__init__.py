"""Pictures of what is made, one file an area."""
