"""A studio on disk: where what lies, what is asked of it, whether it is there. The only reader of its variables."""

import json
import os
from dataclasses import asdict
from functools import cached_property
from pathlib import Path

from upath import UPath

from assets.formats.file_names import WINDOWS, file_name, key_of
from assets.formats.settings_file import read_settings
from assets.formats.tree import HashCache
from assets.sources import scan, sources
from assets.sources.sources import Request, SongFile, Sources
from pipelines.studio.files import StudioError, why, write_beside
from pipelines.studio.lake import Lake
from schemas.settings import Brief, Settings


class StudioFolder:
    """A studio on disk; see :class:`assets.sources.sources.Studio`.

    Parameters
    ----------
    root : the folder with ``clips/`` and ``songs/``
    windows : whether files are named as Windows wants them
    """

    def __init__(self, root: Path, *, windows: bool = WINDOWS) -> None:
        self.root = root.absolute()
        self.lake = Lake(UPath(self.root / "lake"), windows=windows)
        self._windows = windows

    def frozen(self) -> "StudioFolder":
        """Give the studio as one run sees it: what was read once stays so, whatever is edited meanwhile."""
        return _FrozenStudio(self.root, windows=self._windows)

    def sources(self) -> Sources:
        """List what is there, hashed; files that did not change are not read again."""
        cache = HashCache(self.root / "lake" / "hashes.json")
        return scan.scan(self.root, self.settings(), sessions_in_use=self.lake.keys("clip"), cache=cache)

    def settings(self) -> Settings:
        """Read ``odori.toml``."""
        return read_settings(self.root / "odori.toml")

    def brief(self, song: SongFile) -> Brief:
        """Read a song's brief; every default where it has none."""
        return sources.read_brief(self, song)

    def file(self, path: str) -> Path:
        """Place of a source on disk."""
        return self.root / path

    def requests(self) -> dict[str, Request]:
        """List what was asked of dances, by ``<song>|<method>``."""
        folder = self.root / "lake" / "request"
        found = {}
        for path in sorted(folder.glob("*.json")) if folder.is_dir() else []:
            try:
                said = json.loads(path.read_bytes())
                key = key_of(path.stem, windows=self._windows)
                found[key] = Request(**{**said, "pins": tuple(said.get("pins", ()))})
            except (ValueError, TypeError, OSError):
                continue  # not ours, or of another version: as if nobody had asked
        return found

    def remember(self, key: str, request: Request | None) -> None:
        """Keep what was asked of a dance; None forgets it."""
        place = self.root / "lake" / "request" / f"{file_name(key, windows=self._windows)}.json"
        if request is None:
            place.unlink(missing_ok=True)
            return
        text = json.dumps(asdict(request), sort_keys=True)
        write_beside(place, lambda file: file.write(text.encode()))

    def lost_stages(self, song: str, method: str) -> list[str]:
        """Names of a finished dance's files that are not there any more."""
        folder = self.dances_of(song)
        names = ("song.wav", f"{method}.usdc", f"{method}.usdz", f"{method}.json", *self._cast_files(folder, method))
        return [name for name in names if not (folder / name).is_file()]

    @staticmethod
    def _cast_files(folder: Path, method: str) -> list[str]:
        """Names of what a dance by a character of another file consists of besides."""
        try:
            told = json.loads((folder / f"{method}.json").read_bytes())
            return [f"{method}_character/character.usdc"] if "file" in told["provenance"].get("character", {}) else []
        except (OSError, ValueError, KeyError, AttributeError):
            return []

    @property
    def dagster_home(self) -> Path:
        """Folder of Dagster's own storage: ``$DAGSTER_HOME``, else inside the studio."""
        return Path(os.environ.get("DAGSTER_HOME", self.root / ".dagster"))

    @property
    def dances(self) -> Path:
        """Folder of the finished stages."""
        return self.root / "dances"

    def dances_of(self, song: str) -> Path:
        """Folder of the finished stages of a song, by its key."""
        return self.dances / file_name(song, windows=self._windows)


class _FrozenStudio(StudioFolder):
    """A studio whose settings, sources and requests are read once."""

    @cached_property
    def _settings(self) -> Settings:
        return super().settings()

    @cached_property
    def _sources(self) -> Sources:
        return super().sources()

    @cached_property
    def _requests(self) -> dict[str, Request]:
        return super().requests()

    def settings(self) -> Settings:
        return self._settings

    def sources(self) -> Sources:
        return self._sources

    def requests(self) -> dict[str, Request]:
        return self._requests


def studio_from_environment() -> StudioFolder:
    """Find the studio Dagster works on: ``$ODORI_STUDIO``, else ``./studio``."""
    return StudioFolder(Path(os.environ.get("ODORI_STUDIO", "studio")))


def existing(root: Path) -> StudioFolder:
    """Open a studio folder that is there.

    Raises
    ------
    StudioError
        If it is missing or cannot be listed.
    """
    try:
        if not root.is_dir():
            raise StudioError(
                f"{root}: want a studio folder with clips/ and songs/ in it, got nothing there; "
                "name one with --studio or ODORI_STUDIO, or try 'odori demo'"
            )
    except OSError as error:
        raise StudioError(f"{root}: cannot be read: {why(error)}") from error
    return StudioFolder(root)
