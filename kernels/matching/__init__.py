"""Music-motion matching [Yagi2009]: which piece of which clip has the rhythm of a stretch of music."""
