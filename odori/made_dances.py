"""Dances in Python: finished ones, drafts in memory, what could be pinned, and where a moment comes from."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import pyarrow as pa

from assets.tables.pack import frame_rate_hz, to_array
from odori import inputs
from odori.answers import PoseSequence
from odori.exceptions import InputError, OdoriError, refused
from pipelines.studio.folder import StudioFolder

if TYPE_CHECKING:
    import polars as pl


class MadeDance:
    """A finished dance of a studio, as it stands: danced again, it is the new one.

    Parameters
    ----------
    folder : StudioFolder
    key : ``<song>|<method>``

    Examples
    --------
    >>> import odori
    >>> dance = odori.demo().dance("drum_machine")
    >>> dance.song, dance.method, dance.usdz.suffix
    ('drum_machine', 'graph', '.usdz')
    >>> sorted(dance.quality)[:2]
    ['added_foot_slide_cm_per_s', 'beat_alignment_chance_ratio']
    >>> dance.steps.columns[:5]
    ['song_id', 'method_name', 'step_index', 'song_start_s', 'song_end_s']

    See Also
    --------
    OpenStudio.dance : makes one
    """

    def __init__(self, folder: StudioFolder, key: str) -> None:
        self._folder = folder
        self.key = key
        self.song, self.method = key.split("|")

    def __repr__(self) -> str:
        return f"<dance {self.key}: {self.usdz}>"

    @property
    def stage(self) -> Path:
        """The stage: USD, with the song beside it."""
        return self._folder.dances_of(self.song) / f"{self.method}.usdc"

    @property
    def usdz(self) -> Path:
        """The stage in one file, the song in it."""
        return self.stage.with_suffix(".usdz")

    @property
    def report(self) -> dict[str, Any]:
        """What ``<method>.json`` beside the stage says: measures, what is wanted of them, licence, provenance.

        Raises
        ------
        OdoriError
            If the file is gone, or is no report of a dance.
        """
        place = self.stage.with_suffix(".json")
        try:
            with refused():
                found: dict[str, Any] = json.loads(place.read_bytes())
            return {name: found[name] for name in ("quality", "wanted", "licence")} | found
        except (InputError, KeyError, TypeError) as error:
            raise OdoriError(f"{place}: is no report of a dance; dance the song again") from error

    @property
    def quality(self) -> dict[str, float]:
        """Measures of the dance by name; the names end in their units."""
        return dict(self.report["quality"])

    @property
    def not_as_wanted(self) -> list[str]:
        """Sentences on what keeps the dance from being as wanted, with time and clip; empty where nothing does."""
        from pipelines.commands.dance_report import not_as_wanted

        return not_as_wanted(self.report)

    @property
    def is_as_wanted(self) -> bool:
        """Whether every measure that decides is as wanted."""
        return not self.not_as_wanted

    @property
    def missed(self) -> list[str]:
        """Names of the measures that miss their limits, whether they decide or not."""
        from pipelines.commands.dance_report import missed

        return missed(self.report)

    @property
    def licence(self) -> dict[str, Any]:
        """Licence of the dance, from those of its clips."""
        return dict(self.report["licence"])

    @property
    def pins(self) -> list[dict[str, Any]]:
        """Of each pin asked for: ``pin``, ``from_s``, ``to_s``, ``clips``, ``is_kept``."""
        from pipelines.commands.dance_report import facts_of

        with refused():
            return list(facts_of(self._folder, self.song, self.method)["pins"])

    @property
    def steps(self) -> pl.DataFrame:
        """What is danced when, one row a step: the table ``choreography``."""
        return self._table("choreography")

    @property
    def frames(self) -> pl.DataFrame:
        """Where each frame comes from: the table ``frame_lineage``."""
        return self._table("frame_lineage")

    @property
    def poses(self) -> PoseSequence:
        """Poses of every frame."""
        with refused():
            return dance_poses(self.key, self._folder.lake.table("dance_pose", self.key))

    def why(self, time_s: float) -> FrameOrigin:
        """Say where a moment comes from, and why it was chosen.

        Parameters
        ----------
        time_s : float, seconds of the song

        Returns
        -------
        FrameOrigin

        Raises
        ------
        OdoriError
            If the moment is not in the dance.

        Examples
        --------
        >>> import odori
        >>> origin = odori.demo().dance("drum_machine").why(12.0)
        >>> sorted(origin.costs)[:3]
        ['beat', 'intensity', 'warp']

        See Also
        --------
        OpenStudio.why : of a stage without its studio
        """
        return explain_frame(self._folder.root, self.key, time_s)

    def _table(self, name: str) -> pl.DataFrame:
        import polars as pl

        with refused():
            found = pl.from_arrow(self._folder.lake.table(name, self.key))
        return cast(pl.DataFrame, found)


@dataclass(frozen=True, eq=False)
class Draft:
    """A dance in memory, chosen and assembled, without a stage.

    Parameters
    ----------
    song, method : str
    steps : polars.DataFrame, what is danced when, the rows of the table ``choreography``
    poses : PoseSequence of every frame

    See Also
    --------
    OpenStudio.draft : makes one
    """

    song: str
    method: str
    steps: pl.DataFrame = field(repr=False)
    poses: PoseSequence


@dataclass(frozen=True)
class PinProposal:
    """Something that could be pinned at a place of a song.

    Parameters
    ----------
    kind : ``label``, ``style`` or ``clip``
    name : of the label, the style or the clip
    pin : as it is typed; goes into ``pins`` as it is
    extra_cost : float, over the best dance's; a seam is about 1; infinite where it is out of reach
    steps_outside_warp_bounds : int, >= 0, steps it takes beyond the bounds of warp
    """

    kind: str
    name: str
    pin: str
    extra_cost: float
    steps_outside_warp_bounds: int = 0

    @property
    def is_within_reach(self) -> bool:
        """Whether a dance can show it there at all."""
        return bool(np.isfinite(self.extra_cost))


@dataclass(frozen=True)
class FrameOrigin:
    """Where a moment of a dance comes from.

    Parameters
    ----------
    clip_id, clip_time_s : what is shown, or most of it in a blend
    path : of the clip's file, relative to the studio
    label, style, licence : of the clip
    is_mirrored : whether its mirror image is shown
    warp_ratio : float, song time over clip time
    blend : partner of a blend: ``clip_id`` (None outside blends), ``clip_time_s``, ``weight_ratio`` …
    pin : the pin it serves, or None
    costs : what the step costs, by component
    facts : all of it, as ``odori why --json`` prints it
    """

    clip_id: str
    clip_time_s: float
    path: str
    label: str
    style: str
    licence: str
    is_mirrored: bool
    warp_ratio: float
    blend: Mapping[str, Any]
    pin: str | None
    costs: Mapping[str, float]
    facts: Mapping[str, Any] = field(repr=False)


def explain_frame(root: Path, dance: str, time_s: float) -> FrameOrigin:
    """Say where a moment of a dance comes from.

    Parameters
    ----------
    root : the studio
    dance : a song, ``<song>|<method>``, or the path of a stage
    time_s : float, seconds of the song

    Raises
    ------
    OdoriError
        If there is no such dance, or the moment is not in it.
    """
    from pipelines.commands.why import explain_dance

    with refused():
        facts = explain_dance(root, dance, at_s=inputs.number("time_s", time_s, least=-inf, most=inf)).facts
    names = ("clip_id", "clip_time_s", "path", "label", "style", "licence", "is_mirrored", "warp_ratio", "blend")
    told = {name: facts[name] for name in names}
    return FrameOrigin(**told, pin=facts["pin"] or None, costs=dict(facts["step"]["costs"]), facts=facts)


def dance_poses(name: str, rows: pa.Table) -> PoseSequence:
    """Unpack the poses of one clip or one dance.

    Parameters
    ----------
    name : of the clip or the dance
    rows : of the table ``canonical_pose`` or ``dance_pose``, at least one
    """
    columns = [to_array(rows[c]) for c in ("root_xyz_m", "rotation_wxyz", "position_xyz_m")]
    return PoseSequence(name, frame_rate_hz(rows), np.asarray(rows["time_s"].to_numpy(), np.float64), *columns)
