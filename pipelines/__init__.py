"""When and where: what Dagster loads, and the command."""
