"""Dancing by a model of a dancer: basic motions as states, the music as their emissions [Kameda2009]."""
