"""What a clip does."""
