"""From choreography to poses, and how good they are."""
