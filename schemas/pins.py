"""How a director writes a pin: where in the song, and what is to be danced there.

On the command line ``PLACE=WISH``, in a brief one table ``[[pin]]`` each:

==============  =========================  ==============================================
place           in a brief                 the stretch of the song
==============  =========================  ==============================================
``42``          ``at = 42.0``              the beat interval at 42 seconds
``12.5-16``     ``at``, ``until``          every beat interval from 12.5 to 16 seconds
``beat:8-16``   ``beat``, ``until_beat``   from the 8th beat of the song to the 16th
``bar:3-4``     ``bar``, ``until_bar``     bars 3 and 4, both whole
``start``       ``place = "start"``        the first beat interval; ``end``: the last
==============  =========================  ==============================================

Wishes: ``LABEL`` or ``label:LABEL``, ``style:STYLE``, ``clip:KEY``, ``not:LABEL``, ``pose:KEY@SECONDS``. Several keys
of clips are joined by commas: any of them. On the command line ``like:KEY`` names the clips most like one. A pose is
that of a clip at a moment of it, to be shown on the first beat of the place; at the start in the first frame, at the
end in the last.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from schemas.options import check, key

_NUMBER = r"\d+(?:\.\d*)?|\.\d+"
_SECONDS = re.compile(rf"(?P<at>{_NUMBER})(?:-(?P<until>{_NUMBER}))?")
_COUNTED = re.compile(r"(?P<unit>beat|bar):(?P<first>\d+)(?:-(?P<last>\d+))?")
_POSE = re.compile(rf"(?P<clip>[^@]+)@(?P<at>{_NUMBER})")
_WISHES = {"label": "label", "style": "style", "clip": "clip", "not": "not_label", "pose": "pose"}


@dataclass(frozen=True)
class PinWish:
    """One pin as it was written; exactly one place and one wish.

    Raises
    ------
    ValueError
        If a value is out of range, or there is not exactly one place and one wish.
    """

    at: float = key(-1.0, "Seconds of the song where the pin begins.")
    until: float = key(-1.0, "Seconds where it ends; left out: the one beat interval at `at`.")
    beat: int = key(0, "Beat of the song where it begins, from 1.", least=0)
    until_beat: int = key(0, "Beat where it ends; left out: one beat interval.", least=0)
    bar: int = key(0, "Bar where it begins, from 1.", least=0)
    until_bar: int = key(0, "Last bar; left out: one bar.", least=0)
    place: str = key("", "'start' or 'end' of the song instead.", values=("", "start", "end"))
    label: str = key("", "Label to be danced.")
    style: str = key("", "Style to be danced.")
    clip: str = key("", "Clip to be danced, by its key; of several, joined by commas, any.")
    not_label: str = key("", "Label not to be danced.")
    pose: str = key("", "Pose to be shown, as KEY@SECONDS: that of a clip at a moment of it.")

    def __post_init__(self) -> None:
        check(self)
        places = [self.at >= 0, self.beat > 0, self.bar > 0, bool(self.place)]
        if sum(places) != 1:
            raise ValueError(
                "pin: want one place (at, beat, bar or place), got " + ("none" if not any(places) else "more")
            )
        wishes = [name for name in _WISHES.values() if getattr(self, name)]
        if len(wishes) != 1:
            got = " and ".join(wishes) or "none"
            raise ValueError(f"pin: want one wish (label, style, clip, not_label or pose), got {got}")
        if self.pose and not _POSE.fullmatch(self.pose):
            raise ValueError(f"pin: want a pose as KEY@SECONDS, as in pose:kaede-spin_01@2.5, got {self.pose!r}")
        for first, last, least in (("at", "until", 0.0), ("beat", "until_beat", 1), ("bar", "until_bar", 0)):
            a, b = getattr(self, first), getattr(self, last)
            if b > 0 and not (a >= 0 and b - a >= least and b >= a and not (first == "at" and b == a)):
                raise ValueError(f"pin: want {last} after {first}, got {a:g} and {b:g}")

    @property
    def text(self) -> str:
        """The pin as on the command line; what reports call it."""
        if self.place:
            where = self.place
        elif self.at >= 0:
            where = f"{self.at:g}" + (f"-{self.until:g}" if self.until > 0 else "")
        else:
            unit, first, last = ("beat", self.beat, self.until_beat) if self.beat else ("bar", self.bar, self.until_bar)
            where = f"{unit}:{first}" + (f"-{last}" if last else "")
        short, name = next((s, n) for s, n in _WISHES.items() if getattr(self, n))
        return f"{where}=" + ("" if short == "label" else f"{short}:") + str(getattr(self, name))

    @property
    def clips(self) -> list[str]:
        """Keys of the clips wished for."""
        return [name.strip() for name in self.clip.split(",")] if self.clip else []

    @property
    def pose_moment(self) -> tuple[str, float]:
        """Key of the clip whose pose is wished for, and seconds from its first frame; ``("", 0.0)`` for none."""
        found = _POSE.fullmatch(self.pose)
        return (found["clip"].strip(), float(found["at"])) if found else ("", 0.0)

    def is_kept_by(self, *, clip_id: str, label: str, style: str) -> bool:
        """Whether a clip is what the pin wishes; of a pose no clip alone can tell, and any is."""
        if self.clip:
            return clip_id in self.clips
        if self.style:
            return style == self.style
        if self.pose:
            return True
        return label != self.not_label if self.not_label else label == self.label


def parse_pin(text: str) -> PinWish:
    """Read a pin from the command line.

    Parameters
    ----------
    text : str
        ``PLACE=WISH``, see the top of this module.

    Returns
    -------
    PinWish

    Raises
    ------
    ValueError
        If it is none; the message says what a pin looks like.
    """
    where, equals, wish = text.partition("=")
    where, wish = where.strip(), wish.strip()
    values: dict[str, float | int | str] = {}
    seconds, counted = _SECONDS.fullmatch(where), _COUNTED.fullmatch(where)
    if where in ("start", "end"):
        values["place"] = where
    elif seconds:
        values = {name: float(value) for name, value in seconds.groupdict().items() if value is not None}
    elif counted:
        unit = counted["unit"]
        values[unit] = int(counted["first"])
        if not values[unit]:
            raise ValueError(f"pin: want {unit}s counted from 1, got {text!r}")
        if counted["last"]:
            values[f"until_{unit}"] = int(counted["last"])
    kind, colon, name = wish.partition(":")
    if colon and kind in _WISHES:
        values[_WISHES[kind]] = name.strip()
    else:
        values["label"] = wish
    if not (equals and values and (where in ("start", "end") or seconds or counted)):
        raise ValueError(
            f"pin: want PLACE=WISH, as in 42=spin, 12.5-16=clip:KEY, beat:8-16=not:walk, bar:3=waltz or "
            f"start=pose:KEY@2.5, got {text!r}"
        )
    try:
        return PinWish(**values)  # type: ignore[arg-type]  # the names are those of its fields
    except ValueError as error:
        raise ValueError(f"{error}, in {text!r}") from error
