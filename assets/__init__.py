"""What: the asset graph, one file an area."""
