"""Made-up dances, songs and studios with known answers."""
