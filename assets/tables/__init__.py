"""Arrays to Arrow tables and back, one file an area of the schemas."""
