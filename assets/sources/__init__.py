"""What lies in a studio: files, folders, performances, recordings of suits."""
