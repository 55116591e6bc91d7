"""Resources that build plain objects: the studio, the lake, the OpenCL device, progress.

The only place that reads the environment.
"""

import os
from pathlib import Path

from upath import UPath

from assets import sources
from assets.formats.settings import read_settings
from assets.formats.tree import HashCache
from assets.sources import Song, Sources
from pipelines.lake import Lake
from schemas.settings import Brief, Settings


class StudioError(Exception):
    """The studio folder cannot be used; the message says which, why, and what to do."""


class StudioFolder:
    """A studio on disk; see :class:`assets.sources.Studio`.

    Parameters
    ----------
    root : the folder with ``clips/`` and ``songs/``
    """

    def __init__(self, root: Path) -> None:
        self.root = root.absolute()
        self.lake = Lake(UPath(self.root / "lake"))

    def sources(self) -> Sources:
        """List what is there, hashed; files that did not change are not read again."""
        cache = HashCache(self.root / "lake" / "hashes.json")
        return sources.scan(self.root, self.settings(), sessions_in_use=self.lake.keys("clip"), cache=cache)

    def settings(self) -> Settings:
        """Read ``odori.toml``."""
        return read_settings(self.root / "odori.toml")

    def brief(self, song: Song) -> Brief:
        """Read a song's brief; every default where it has none."""
        return sources.read_brief(self, song)

    def file(self, path: str) -> Path:
        """Place of a source on disk."""
        return self.root / path

    @property
    def dances(self) -> Path:
        """Folder of the finished stages."""
        return self.root / "dances"


def studio_from_environment() -> StudioFolder:
    """Find the studio Dagster works on: ``$ODORI_STUDIO``, else ``./studio``."""
    return StudioFolder(Path(os.environ.get("ODORI_STUDIO", "studio")))


class NoProgress:
    """Progress that nobody watches."""

    def begin(self, what: str, total: int) -> None:
        """Start counting."""

    def step(self) -> None:
        """One more is done."""
