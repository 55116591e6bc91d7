"""Where every step of a dance comes from, read straight from the Parquet tables with Polars.

``python examples/where_from.py STUDIO SONG`` after ``odori dance SONG --studio STUDIO``.
"""

import sys
from pathlib import Path

import polars as pl


def steps(studio: Path, song: str, method: str = "graph") -> pl.DataFrame:
    """List the stretches of a dance: when, which clip, from where in it, how fast, and whose licence."""
    lake = studio / "lake"
    frames = pl.read_parquet(lake / "frame_lineage" / f"{song}|{method}.parquet", glob=False)
    clips = pl.read_parquet(sorted((lake / "clip").glob("*.parquet"))).select("clip_id", "label", "licence")
    return (
        frames.with_columns(pl.col("clip_id").rle_id().alias("stretch"))
        .group_by("stretch", maintain_order=True)
        .agg(
            pl.col("time_s").first().alias("from_s"),
            pl.col("clip_id").first(),
            pl.col("clip_time_s").first().alias("clip_from_s"),
            pl.col("warp_ratio").mean().round(3).alias("mean_warp"),
        )
        .join(clips, on="clip_id", how="left", maintain_order="left")
        .drop("stretch")
    )


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    with pl.Config(tbl_rows=-1, tbl_cols=-1, fmt_str_lengths=60):
        print(steps(Path(sys.argv[1]), sys.argv[2]))
