"""What a way of choosing a dance is: the record that each method fills in."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from assets.dancing.asked import Direction
from assets.dancing.avoided import AvoidedSpan
from assets.dancing.chosen_steps import ChosenSteps
from assets.stamps import Stored
from kernels.types import BeatGrid
from schemas.settings import Settings


@dataclass(frozen=True, eq=False)
class DanceOrder:
    """A song to be danced, and what is asked of the dance.

    Parameters
    ----------
    song_id : key of the song
    beats : BeatGrid of at least two beats
    duration_s : float, seconds, > 0
    settings : Settings
    direction : pins, licences, which alternative
    temperature : float, or None for the setting's; only where the method draws
    seed : int, of what is drawn
    avoid : stretches of clips that are not to be shown where there is any other way
    """

    song_id: str
    beats: BeatGrid
    duration_s: float
    settings: Settings
    direction: Direction
    temperature: float | None = None
    seed: int = 0
    avoid: tuple[AvoidedSpan, ...] = ()


@dataclass(frozen=True)
class Method:
    """A way of choosing what is danced when.

    Parameters
    ----------
    name : as it is typed and stored
    version : raised by hand when its dances change; makes its own dances stale, and no others
    inputs : tables it reads, besides the song's row and beats and the rows of the clips; with ``canonical_pose`` its
        dances are looked at, and chosen again where they flip
    settings : sections of ``odori.toml`` it reads, or single keys as ``section.key``
    choose : chooses the steps from the inputs by name; raises :class:`assets.dancing.refusal.RefusalError`
    keeps_pins : whether a director's pins are kept
    has_alternatives : whether it can make a second dance unlike the first
    draws : whether its dances are drawn by a temperature and a seed
    learns : whether it learns from clips that were performed to songs
    """

    name: str
    version: str
    inputs: tuple[str, ...]
    settings: tuple[str, ...]
    choose: Callable[[Mapping[str, Stored], DanceOrder], ChosenSteps]
    keeps_pins: bool = True
    has_alternatives: bool = False
    draws: bool = False
    learns: bool = False
