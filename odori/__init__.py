"""odori in Python: a studio opened, its tables, poses and beats, and dances made as ``odori dance`` makes them.

>>> import odori
>>> studio = odori.demo()
>>> dance = studio.dance("drum_machine")
>>> dance.usdz.name
'graph.usdz'

Conventions: metres, seconds, Hz; Y up; quaternions ``wxyz``. ``F`` frames, ``J`` joints, ``B`` beats. What is
refused is an :class:`OdoriError`. Nothing heavy is loaded before it is used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from odori.exceptions import DanceRefusedError, InputError, OdoriError

if TYPE_CHECKING:
    from odori.answers import BeatTimes, CatalogueClip, CatalogueSong, Listing, PoseSequence, SearchHit
    from odori.arrays import SegmentMatch, match, motion_beats, score_beats, track_beats
    from odori.made_dances import Draft, FrameOrigin, MadeDance, PinProposal
    from odori.opened import OpenStudio, demo, open
    from odori.takes import MotionTake, read, song_beats

_HOMES = {
    "arrays": ("SegmentMatch", "match", "motion_beats", "score_beats", "track_beats"),
    "made_dances": ("Draft", "FrameOrigin", "MadeDance", "PinProposal"),
    "takes": ("MotionTake", "read", "song_beats"),
    "opened": ("OpenStudio", "demo", "open"),
    "answers": ("BeatTimes", "CatalogueClip", "CatalogueSong", "PoseSequence", "Listing", "SearchHit"),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}

__all__ = [  # noqa: RUF022 - what one starts with comes first; not `open`, which would hide Python's own
    "demo",
    "read",
    "song_beats",
    "track_beats",
    "score_beats",
    "motion_beats",
    "match",
    "OdoriError",
    "InputError",
    "DanceRefusedError",
    "OpenStudio",
    "CatalogueClip",
    "CatalogueSong",
    "Listing",
    "PoseSequence",
    "BeatTimes",
    "MotionTake",
    "SegmentMatch",
    "SearchHit",
    "MadeDance",
    "Draft",
    "PinProposal",
    "FrameOrigin",
    "open",
]


def __getattr__(name: str) -> Any:  # noqa: ANN401 - whatever is asked for
    """Load a name's module when it is first used."""
    if name not in _HOME:
        raise AttributeError(f"module 'odori' has no attribute {name!r}")
    found = getattr(import_module(f"odori.{_HOME[name]}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})
