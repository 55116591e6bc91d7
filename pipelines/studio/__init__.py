"""The studio on disk: folder, lake, files. Knows no Dagster."""
