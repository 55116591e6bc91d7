"""How the asset graph is cut: by capture session, by song, by song and method."""

import dagster as dg

from schemas import settings

SESSION = dg.DynamicPartitionsDefinition(name="session")
SONG = dg.DynamicPartitionsDefinition(name="song")
METHODS = settings.METHODS
MOST_ALTERNATIVES = 5
ALTERNATIVES = tuple(f"graph_{number}" for number in range(2, MOST_ALTERNATIVES + 1))
"""The graph method's second to fifth dance of a song, each unlike those before it."""
METHOD = dg.StaticPartitionsDefinition([*METHODS, *ALTERNATIVES])
DANCE = dg.MultiPartitionsDefinition({"song": SONG, "method": METHOD})
EVERY = dg.AllPartitionMapping()


def dance_key(song: str, method: str) -> str:
    """Partition key of a song danced with a method.

    Parameters
    ----------
    song : key
    method : of :data:`METHOD`
    """
    return str(dg.MultiPartitionKey({"song": song, "method": method}))


def base_method(method: str) -> str:
    """Find the method an alternative is one of."""
    return method.partition("_")[0]


def alternative_number(method: str) -> int:
    """Which dance of its method: 1 for the best, 2 and on for alternatives."""
    return int(method.partition("_")[2] or 1)


def song_and_method(key: str) -> tuple[str, str]:
    """Song and method of a dance's partition key; Dagster joins them in the order of the dimensions' names."""
    method, song = key.split("|")
    return song, method


def lake_key(key: str) -> str:
    """Name of a partition's file: a dance's names the song first."""
    return "|".join(song_and_method(key)) if "|" in key else key


def dagster_key(key: str) -> str:
    """Invert :func:`lake_key`."""
    return dance_key(*key.split("|")) if "|" in key else key
