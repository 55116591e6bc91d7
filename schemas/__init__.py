"""Shape: tables and files, and nothing else."""
