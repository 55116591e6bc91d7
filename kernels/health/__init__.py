"""What is wrong with a clip, found on its own skeleton before it is retargeted."""
