"""What a studio holds: its clips, songs and dances, its tables, poses and beats."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from assets.tables.music import to_music_beat
from assets.tables.pack import concat
from odori import inputs
from odori.answers import BeatTimes, CatalogueClip, CatalogueSong, Listing, PoseSequence
from odori.exceptions import OdoriError, refused
from odori.made_dances import MadeDance, dance_poses
from pipelines.studio import inventory
from pipelines.studio.folder import StudioFolder
from schemas.catalog import TABLES

if TYPE_CHECKING:
    import polars as pl


class Holdings:
    """What a studio holds, read when it is asked for, and again where it changed.

    Parameters
    ----------
    folder : StudioFolder

    See Also
    --------
    odori.OpenStudio : which has all this, and dances
    """

    def __init__(self, folder: StudioFolder) -> None:
        self._folder = folder

    @property
    def root(self) -> Path:
        """The studio's folder."""
        return self._folder.root

    @property
    def clips(self) -> Listing[CatalogueClip]:
        """Motion files with their state, in order of their keys.

        Raises
        ------
        OdoriError
            If the folder or its settings cannot be read.

        Examples
        --------
        >>> import odori
        >>> clip = odori.demo().clips["kaede-kick_02"]
        >>> clip.state, clip.label, clip.frame_rate_hz, clip.licence
        ('read', 'kick', 60.0, 'CC0-1.0')

        See Also
        --------
        songs, dances
        """
        with refused():
            rows = inventory.clip_rows(self._folder.lake)
            files, _ = inventory.clips_and_doubts(self._folder.sources(), self._folder.lake, rows)
        found = [
            CatalogueClip(
                file["key"],
                file["session"],
                file["path"],
                file["state"],
                file["reason"],
                **_told(rows.get(file["path"])),
            )
            for file in files
        ]
        return Listing("a clip", sorted(found, key=lambda clip: clip.clip_id))

    @property
    def songs(self) -> Listing[CatalogueSong]:
        """Music files with their state, in order of their keys.

        Raises
        ------
        OdoriError
            If the folder or its settings cannot be read.

        Examples
        --------
        >>> import odori
        >>> for song in odori.demo().songs:
        ...     print(song.song_id, song.state, round(song.duration_s))
        drum_machine read 35
        drum_machine_mid read 35
        hidden_rules read 105

        See Also
        --------
        beats : of one of them
        """
        with refused():
            rows = inventory.song_rows(self._folder.lake)
            files = inventory.songs_found(self._folder.sources(), self._folder.lake, rows)
        found = [
            CatalogueSong(
                file["key"],
                file["path"],
                file["state"],
                file["reason"],
                float((rows.get(file["path"]) or {}).get("duration_s") or 0.0),
            )
            for file in files
        ]
        return Listing("a song", sorted(found, key=lambda song: song.song_id))

    @property
    def dances(self) -> Listing[MadeDance]:
        """Finished dances, in order of their keys ``<song>|<method>``.

        Examples
        --------
        >>> import odori
        >>> studio = odori.demo()
        >>> made = studio.dance("drum_machine")
        >>> studio.dances["drum_machine|graph"].usdz == made.usdz
        True

        See Also
        --------
        dance : makes one
        """
        return Listing("a dance", [MadeDance(self._folder, key) for key in self._folder.lake.keys("usd_animation")])

    def table(self, name: str, *, key: str | None = None) -> pa.Table:
        """Read a table of the lake as Arrow.

        Parameters
        ----------
        name : as ``docs/data.md`` lists them: ``clip``, ``music_beat``, ``frame_lineage`` …
        key : one partition alone: a session, a song, or ``<song>|<method>``; None for all of them, one after the other

        Returns
        -------
        pyarrow.Table
            Without rows where nothing is stored.

        Raises
        ------
        OdoriError
            If there is no such table, the partition is not stored, or a file is damaged.

        Examples
        --------
        >>> import odori
        >>> beats = odori.demo().table("music_beat", key="drum_machine")
        >>> beats.num_rows, beats["time_s"].type
        (66, DataType(double))

        See Also
        --------
        polars, numpy : the same in other forms
        scan : a table that is larger than memory
        """
        self._known(name)
        with refused():
            if key is not None:
                wanted = inputs.key("key", key)
                if wanted not in self._folder.lake.keys(name):
                    raise OdoriError(f"{name}: want a partition that is stored, {wanted!r} is not built")
                return self._folder.lake.table(name, wanted)
            parts = [self._folder.lake.table(name, one) for one in self._folder.lake.keys(name)]
            return concat(TABLES[name], parts)

    def polars(self, name: str, *, key: str | None = None) -> pl.DataFrame:
        """Read a table of the lake with Polars.

        Parameters
        ----------
        name, key : as :meth:`table`

        Returns
        -------
        polars.DataFrame

        Raises
        ------
        OdoriError
            As :meth:`table`.

        Examples
        --------
        >>> import odori
        >>> clips = odori.demo().polars("clip")
        >>> clips.group_by("style").len().sort("style").rows()
        [('procedural', 50)]

        See Also
        --------
        table, numpy, scan
        """
        import polars as pl

        found = pl.from_arrow(self.table(name, key=key))
        return cast(pl.DataFrame, found)

    def numpy(self, name: str, *, key: str | None = None) -> dict[str, NDArray[Any]]:
        """Read a table of the lake as arrays by column.

        Parameters
        ----------
        name, key : as :meth:`table`

        Returns
        -------
        dict of (N, …) arrays
            Lists of one length become further axes; text and lists of other lengths are arrays of objects.

        Raises
        ------
        OdoriError
            As :meth:`table`.

        Examples
        --------
        >>> import odori
        >>> feature = odori.demo().numpy("music_feature", key="drum_machine")
        >>> feature["rhythm"].dtype, feature["rhythm"].min() >= 0
        (dtype('float32'), np.True_)

        See Also
        --------
        table, polars, scan
        """
        table = self.table(name, key=key)
        return {column: _array(table[column]) for column in table.column_names}

    def scan(self, name: str) -> pl.LazyFrame:
        """Read a table of the lake lazily: only the columns and rows a query needs.

        Parameters
        ----------
        name : as :meth:`table`

        Returns
        -------
        polars.LazyFrame

        Raises
        ------
        OdoriError
            If there is no such table, or nothing of it is stored.

        Examples
        --------
        >>> import odori, polars as pl
        >>> frames = odori.demo().scan("canonical_pose")
        >>> longest = frames.group_by("clip_id").agg(pl.col("time_s").max()).sort("time_s").tail(1)
        >>> longest.collect()["clip_id"].to_list()
        ['sumire-hidden_rules']

        See Also
        --------
        polars : the whole table
        """
        import polars as pl

        self._known(name)
        paths = [self._folder.lake.path(name, key) for key in self._folder.lake.keys(name)]
        if not paths:
            raise OdoriError(f"{name}: nothing of it is stored; build the studio, or dance a song")
        return pl.scan_parquet([str(path) for path in paths], glob=False)

    def poses(self, clip: str | CatalogueClip) -> PoseSequence:
        """Read the poses of a clip on odori's 22 joints.

        Parameters
        ----------
        clip : its key

        Returns
        -------
        PoseSequence

        Raises
        ------
        OdoriError
            If there is no such clip, it was refused, or the studio was not built.

        Examples
        --------
        >>> import odori
        >>> studio = odori.demo()
        >>> poses = studio.poses("ayame-spin_01")
        >>> poses.position_xyz_m.shape == (poses.n_frames, 22, 3)
        True

        See Also
        --------
        clips, odori.read
        MadeDance.poses : of a dance
        """
        wanted, clips = inputs.key("clip", clip), self.clips
        named = [one for one in clips if self._is_of(wanted, one.path)]
        row = named[0] if named and not clips.has(wanted) else clips[wanted]
        if row.reason:
            raise OdoriError(f"{row.clip_id}: it was refused: {row.reason}")
        with refused():
            rows = self._folder.lake.table("canonical_pose", row.session, clip_ids=[row.clip_id])
        if not rows.num_rows:
            raise OdoriError(f"{row.clip_id}: its poses are not built; build the studio")
        return dance_poses(row.clip_id, rows)

    def beats(self, song: str | CatalogueSong) -> BeatTimes:
        """Read the beats of a song, as its brief wants them.

        Parameters
        ----------
        song : its key, or the name of its file

        Returns
        -------
        BeatTimes
            Empty where the song has none to tap to.

        Raises
        ------
        OdoriError
            If there is no such song, it was refused, or the studio was not built.

        Examples
        --------
        >>> import odori
        >>> odori.demo().beats("drum_machine").time_s[:3].round(2).tolist()
        [0.0, 0.52, 1.04]

        See Also
        --------
        odori.song_beats, odori.track_beats
        """
        row = self._song(song)
        if row.reason:
            raise OdoriError(f"{row.song_id}: it was refused: {row.reason}")
        with refused():
            grid = to_music_beat(self._folder.lake.table("music_beat", row.song_id))
        return BeatTimes(grid.time_s, grid.bar_number, grid.beat_in_bar_number, grid.confidence)

    def _song(self, song: str | CatalogueSong) -> CatalogueSong:
        wanted, songs = inputs.key("song", song), self.songs
        named = [
            one
            for one in songs
            if wanted in (Path(one.path).name, Path(one.path).stem) or self._is_of(wanted, one.path)
        ]
        return named[0] if named and not songs.has(wanted) else songs[wanted]

    def _is_of(self, wanted: str, path: str) -> bool:
        return wanted == path or Path(wanted).absolute() == (self.root / path).absolute()

    def _known(self, name: str) -> None:
        if not isinstance(name, str) or name not in TABLES:
            raise OdoriError(f"{name}: want a table, got none of that name; they are {', '.join(sorted(TABLES))}")


def _told(row: Mapping[str, Any] | None) -> dict[str, Any]:
    """Take what the table says of a clip that was looked at."""
    if row is None:
        return {}
    texts = {name: row[name] or "" for name in ("label", "style", "subject", "licence")}
    return texts | {name: row[name] or 0 for name in ("frame_rate_hz", "frame_count", "duration_s")}


def _array(column: pa.ChunkedArray) -> NDArray[Any]:
    """Turn a column into an array; lists of one length become further axes."""
    kind = column.type
    if pa.types.is_list(kind) or pa.types.is_fixed_size_list(kind):
        lists = column.to_pylist()
        try:
            return np.asarray(lists)
        except ValueError:  # of different lengths
            found = np.full(len(lists), None, object)
            found[:] = lists
            return found
    return np.asarray(column.to_numpy())
