"""The dances of a built studio, made in memory: what the benchmarks of dances share.

A studio is named by its folder, built by ``odori build``; without one, every motion file and song of the real test data
(ODORI_TEST_DATA, else ``../shared/data``) is gathered in a temporary studio and built first.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from upath import UPath

from assets.dancing.asked import Direction
from assets.dancing.by_graph import GraphCatalogue, by_graph, catalogue
from assets.reading.clips import load_clips, read_clips
from assets.reading.songs import PlayedSong, played_song
from assets.tables.graph import to_motion_graph
from assets.tables.music import to_music_beat
from kernels.types import Choreography, Clip, Float
from pipelines.studio.lake import Lake
from pipelines.studio.stored import StoredTable
from schemas.settings import Settings

REPOSITORY = Path(__file__).parents[1]
DATA = Path(os.environ.get("ODORI_TEST_DATA", REPOSITORY.parent / "shared" / "data"))
MOTION, MUSIC = ("bvh_dance", "bvh_labelled", "bvh_idle", "bvh_varied"), ("audio_beats", "audio_plain")


@dataclass(frozen=True, eq=False)
class Danced:
    """One song and its steps; ``heard_s`` are its own beats, not those added to cover it, as ``grid_s`` has.

    ``strength`` is the music's in each interval of the grid, ``stay_beats`` what the settings say of stays.
    """

    song_id: str
    duration_s: float
    heard_s: Float
    steps: Choreography
    cost: dict[str, Float]
    grid_s: Float
    strength: Float
    stay_beats: int


class BuiltStudio:
    """What the benchmarks read of a built studio: its graph, its clips, its songs."""

    def __init__(self, root: Path, settings: Settings) -> None:
        self.settings, self._lake = settings, Lake(UPath(root.resolve() / "lake"))

    def stored(self, asset: str) -> StoredTable:
        """Handle on all partitions of a table."""
        return StoredTable(self._lake, asset, self._lake.keys(asset))

    @property
    def songs(self) -> list[str]:
        """Songs with at least two beats, by name."""
        beats = self.stored("music_beat")
        return [key for key in beats.keys if beats.read(key).num_rows > 1]

    def catalogue(self) -> GraphCatalogue:
        """Read the motion graph and what is known of its clips."""
        graph, clip_ids = to_motion_graph(self._lake.table("motion_graph_node"), self._lake.table("motion_graph_edge"))
        clip = self.stored("clip")
        return catalogue(graph, clip_ids, read_clips(clip), ())

    def song(self, key: str) -> PlayedSong:
        """Read the beats of a song."""
        grid = to_music_beat(self._lake.table("music_beat", key))
        duration_s = float(max(self._lake.table("song", key)["duration_s"].to_pylist()))
        feature, repeat = (self._lake.table(name, key) for name in ("music_feature", "music_repeat"))
        return played_song(grid, duration_s, feature=feature, repeat=repeat)

    def dance(self, known: GraphCatalogue, key: str) -> Danced:
        """Choose the steps of a song by the graph method."""
        song = self.song(key)
        found = by_graph(known, song, self.settings, Direction())
        strength = np.zeros(len(song.grid_s) - 1) if song.intensity is None else song.intensity
        return Danced(
            key,
            song.duration_s,
            song.beats.time_s,
            found.steps,
            dict(found.costs),
            song.grid_s,
            strength,
            self.settings.path.stay_beats,
        )

    def clips(self, steps: Choreography) -> dict[str, Clip]:
        """Read the clips that are danced."""
        return load_clips(self.stored("canonical_pose"), steps)


@contextmanager
def built(root: Path | None) -> Iterator[Path]:
    """Give the folder of a built studio: the one named, or one of the real test data."""
    if root is not None:
        yield root
        return
    if not (DATA / "README.md").is_file():
        raise SystemExit(f"no test data in {DATA}; name a built studio with --studio, or a folder in ODORI_TEST_DATA")
    with tempfile.TemporaryDirectory() as folder:
        studio = Path(folder) / "studio"
        for kind, names in (("clips", MOTION), ("songs", MUSIC)):
            (studio / kind).mkdir(parents=True)
            for name in names:
                _gather(DATA / name, studio / kind / name if kind == "clips" else studio / kind)
        command = [sys.executable, "-m", "pipelines.cli", "build", "--studio", str(studio)]
        done = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True, check=False)
        if done.returncode not in (0, 1):
            raise SystemExit(done.stderr)
        yield studio


def _gather(source: Path, target: Path) -> None:
    target.mkdir(exist_ok=True)
    for path in sorted(source.rglob("*")):
        if path.suffix.lower() in (".bvh", ".wav", ".ogg", ".mp3", ".flac", ".mid"):
            (target / path.name).symlink_to(path.resolve())


def percentile(values: Float, share: float) -> float:
    """Percentile that is 0 for no values."""
    return float(np.percentile(values, share)) if len(values) else 0.0
