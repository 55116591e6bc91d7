"""What a song does."""
