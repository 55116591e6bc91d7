"""How a song is danced and directed: methods, wishes, refusals, licences, characters. Knows no Dagster."""
