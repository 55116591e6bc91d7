"""How the asset graph is cut: by capture session, by song, by song and method."""

import dagster as dg

from assets.dancing.methods import ALTERNATIVES, METHODS

SESSION = dg.DynamicPartitionsDefinition(name="session")
SONG = dg.DynamicPartitionsDefinition(name="song")
METHOD = dg.StaticPartitionsDefinition([*METHODS, *ALTERNATIVES])
DANCE = dg.MultiPartitionsDefinition({"song": SONG, "method": METHOD})
EVERY = dg.AllPartitionMapping()
SESSION_TABLES = (
    "clip",
    "clip_fault",
    "skeleton",
    "pose",
    "calibration",
    "canonical_pose",
    "motion_feature",
    "motion_beat",
    "motion_tempo",
    "motion_turn",
    "key_pose",
    "motion_embedding",
)
"""Tables cut by session: what is made of every clip reads all their partitions."""


def dance_key(song: str, method: str) -> str:
    """Partition key of a song danced with a method.

    Parameters
    ----------
    song : key
    method : of :data:`METHOD`
    """
    return str(dg.MultiPartitionKey({"song": song, "method": method}))


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
