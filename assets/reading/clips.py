"""Rows of clips, read once for whatever dances."""

from __future__ import annotations

import polars as pl

from assets.stamps import Stored


def read_clips(clip: Stored) -> pl.DataFrame:
    """Gather the rows of all sessions' clips that were read.

    Parameters
    ----------
    clip : Stored, rows of clips by session
    """
    return pl.concat([pl.DataFrame(clip.read(key)) for key in clip.keys]).filter(pl.col("state") == "read")
