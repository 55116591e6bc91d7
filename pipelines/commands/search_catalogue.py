"""What `odori search` searches: the index of a studio as it lies on disk, and the motions that a wish names."""

import difflib
import json
import os
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray
from upath import UPath

from assets.formats import bvh, motion_index
from assets.formats.errors import FormatError
from assets.formats.settings_file import read_settings
from assets.tables import pack
from assets.tables import search as search_tables
from kernels.search.encoder import Encoder, from_arrays
from kernels.search.windows import windows
from kernels.skeleton.naming import map_joints
from kernels.skeleton.retarget import retarget
from kernels.types import Float
from pipelines.studio.files import StudioError, write_beside
from pipelines.studio.lake import Lake
from schemas.search import MOTION_EMBEDDING, MOTION_ENCODER, MOTION_INDEX

_RANGE = re.compile(r"(?P<name>.+)@(?P<start>\d+(?:\.\d*)?|\.\d+)-(?P<end>\d+(?:\.\d*)?|\.\d+)")
_SEEN = "seen.json"
_MADE_FROM = ("clip", "canonical_pose", MOTION_ENCODER.name, MOTION_EMBEDDING.name)


@dataclass(frozen=True, eq=False)
class NamedMotion:
    """One motion named in a wish.

    Parameters
    ----------
    text : as it was written
    clip_id : of the catalogue; empty for a file outside it
    start_s, end_s : the stretch of it that counts
    vector : (W, D) float32 of its windows
    poses : canonical positions, (F, 22, 3) metres, and their rate in Hz, where they were read; else None
    """

    text: str
    clip_id: str
    start_s: float
    end_s: float
    vector: NDArray[np.float32]
    poses: tuple[Float, float] | None = field(default=None)


def parse(text: str) -> tuple[str, float, float]:
    """Split ``NAME@START-END``; a whole clip is from 0 to infinity.

    Raises
    ------
    StudioError
        If the end is not after the start.
    """
    ranged = _RANGE.fullmatch(text)
    if not ranged:
        return text, 0.0, float("inf")
    start_s, end_s = float(ranged["start"]), float(ranged["end"])
    if end_s <= start_s:
        raise StudioError(f"{text}: want an end after its start, got {start_s:g} to {end_s:g} s")
    return ranged["name"], start_s, end_s


class SearchCatalogue:
    """The search index of a studio, and what it takes to embed a query."""

    def __init__(self, root: Path) -> None:
        if not root.is_dir():
            raise StudioError(
                f"{root}: want a studio folder with clips/ in it, got nothing there; name one with --studio or "
                "ODORI_STUDIO, or try 'odori demo'"
            )
        self.root = root.absolute()
        self.lake = self.root / "lake"
        self.tables = Lake(UPath(self.lake))
        self.index = motion_index.read(self.lake / MOTION_INDEX.name)

    def is_current(self) -> bool:
        """Whether the index was made of the tables that there are now."""
        try:
            seen = json.loads((self.lake / MOTION_INDEX.name / _SEEN).read_bytes())
        except (OSError, ValueError):
            return False
        return self.index is not None and bool(seen == self._state())

    def remember(self) -> None:
        """Keep which tables the index was found to be up to date with."""
        text = json.dumps(self._state(), sort_keys=True)
        if self.index is not None:
            write_beside(self.lake / MOTION_INDEX.name / _SEEN, lambda file: file.write(text.encode()))

    def _state(self) -> dict[str, list[int]]:
        stored = [(name, key) for name in _MADE_FROM for key in self.tables.keys(name)]
        versions = {f"{name}/{key}": list(self.tables.version(name, key) or ()) for name, key in stored}
        odori = self.root / "odori.toml"
        if odori.is_file():
            found = odori.stat()
            versions["odori.toml"] = [found.st_size, found.st_mtime_ns]
        return versions

    def knows(self, text: str) -> bool:
        """Whether a motion can be named without looking for new clips."""
        name, _, _ = parse(text)
        return self._clip(name) is not None or (not self._inside(name) and _is_file(name))

    def provenance(self) -> dict[str, Any]:
        """Say what the encoder was trained on."""
        metadata = self.tables.metadata(MOTION_ENCODER.name)
        said: dict[str, Any] = json.loads(metadata.get(b"provenance", b"{}"))
        return said

    def motion(self, text: str) -> NamedMotion:
        """Embed a motion named in a wish.

        Raises
        ------
        StudioError
            If it is no clip and no file, is no body, or the stretch lies beyond its end.
        """
        name, start_s, end_s = parse(text)
        rows = self._clip(name)
        if rows is None and _is_file(name):
            return self._outside(text, Path(name), start_s, end_s)
        if rows is None:
            raise StudioError(self._unknown(name))
        assert self.index is not None
        clip_id, duration_s = rows["clip_id"][0].as_py(), rows["duration_s"][0].as_py()
        if start_s == 0 and end_s == float("inf"):
            at = rows["row_index"].to_numpy()
            return NamedMotion(text, clip_id, 0.0, duration_s, np.asarray(self.index.vector[at[0] : at[-1] + 1]))
        if start_s > duration_s:
            raise StudioError(
                f"{text}: want a stretch within {clip_id}, {duration_s:.2f} s long; it begins after its end"
            )
        poses = self.poses(clip_id, rows["session"][0].as_py())
        return self._embed(text, clip_id, poses, start_s, min(end_s, duration_s))

    def poses(self, clip_id: str, session: str) -> tuple[Float, float]:
        """Read the canonical positions of a clip, (F, 22, 3) metres, and its frame rate in Hz.

        Parameters
        ----------
        clip_id : of a clip of the index
        session : its session
        """
        table = self.tables.table("canonical_pose", session, clip_ids=[clip_id])
        return pack.to_array(table["position_xyz_m"]), pack.frame_rate_hz(table)

    def _embed(self, text: str, clip_id: str, poses: tuple[Float, float], start_s: float, end_s: float) -> NamedMotion:
        settings = read_settings(self.root / "odori.toml").search
        longest = max(settings.longest_whole_s, settings.window_s)
        cut = start_s + windows(end_s - start_s, window_s=settings.window_s, longest_whole_s=longest)
        return NamedMotion(text, clip_id, start_s, end_s, self._encoder().embed(*poses, cut), poses)

    def _encoder(self) -> Encoder:
        return from_arrays(search_tables.to_encoder(self.tables.table(MOTION_ENCODER.name)))

    def _clip(self, name: str) -> pa.Table | None:
        """Rows of a clip by its key, or by its file's path."""
        if self.index is None:
            return None
        rows = self.index.rows
        found = rows.filter(pc.field("clip_id") == name)
        if not found.num_rows and (path := self._inside(name)):
            found = rows.filter(pc.field("path") == path)
        return found if found.num_rows else None

    def _inside(self, name: str) -> str:
        """Path from the studio of a file under its clips, however it was reached; empty for others."""
        # The folder's links are followed and the file's are not: a clip may itself be a link to elsewhere.
        plain = Path(os.path.normpath(Path(name).absolute()))
        for path, root in ((plain, self.root), (plain.parent.resolve() / plain.name, self.root.resolve())):
            if path.is_relative_to(root / "clips"):
                return path.relative_to(root).as_posix()
        return ""

    def _outside(self, text: str, path: Path, start_s: float, end_s: float) -> NamedMotion:
        """Read a file that is not of the catalogue, and bring it to the canonical skeleton."""
        joints = read_settings(self.root / "odori.toml").joints
        try:
            take = bvh.to_clip(bvh.read(path), extra=joints)
            mapping = take.mapping or map_joints(take.clip.skeleton, joints)
            moved = retarget(take.clip, mapping)
        except FormatError as error:
            raise StudioError(f"{path}: {f'line {error.line}: ' if error.line else ''}{error.what}") from error
        except ValueError as error:
            raise StudioError(f"{path}: {error}") from error
        if start_s > take.clip.duration_s:
            raise StudioError(
                f"{text}: want a stretch within the file, {take.clip.duration_s:.2f} s long; it begins after"
            )
        poses = (moved.position_xyz_m, take.clip.frame_rate_hz)
        return self._embed(text, "", poses, start_s, min(end_s, take.clip.duration_s))

    def _unknown(self, name: str) -> str:
        refused = self._refused(name)
        if refused:
            return f"{name}: cannot be searched for: {refused}"
        before, at, after = name.rpartition("@")
        if at and self._clip(before) is not None:
            return f"{name}: want a stretch in seconds as in {before}@2.5-4, got @{after}"
        known = pc.unique(self.index.rows["clip_id"]).to_pylist() if self.index is not None else []
        near = difflib.get_close_matches(name, known, n=3, cutoff=0.4) or [k for k in known if name in k][:3]
        hint = f"near are {', '.join(near)}" if near else f"there are {', '.join(known[:5])}"
        return f"{name}: want a clip of this studio or a BVH file, found neither; {hint}"

    def _refused(self, name: str) -> str:
        """Why a clip of the studio is not in the index; empty where it is no clip."""
        for session in self.tables.keys("clip"):
            for row in self.tables.table("clip", session).to_pylist():
                if name in (row["clip_id"], row["path"]) or self._inside(name) == row["path"]:
                    return row["reason"] or "its motion could not be brought to the canonical skeleton"
        return ""


def _is_file(name: str) -> bool:
    return name.lower().endswith(".bvh") and Path(name).is_file()
