"""What the dancer would do: basic motions as states, the music as what they emit [Kameda2009]."""
