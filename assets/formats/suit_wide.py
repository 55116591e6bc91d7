"""Suit recordings with one row a reading and columns for every station, as software for Polhemus trackers writes them.

``Time,w1,x1,y1,z1,w2,…,loc1_x,loc1_y,loc1_z,loc2_x,…``: seconds since 1970, w-first quaternions. A row is written
whenever anything was heard, so rows repeat, and times come in bursts.
"""

from __future__ import annotations

import re

import numpy as np

from assets.formats.suit_columns import Columns, column
from assets.formats.suit_long import METRES_PER_UNIT, SECONDS, Suit, kept, notes_on_time
from assets.formats.suit_names import name_sensors
from kernels.calibration import timeline
from kernels.calibration.records import SENSORS
from kernels.types import Float

_UNIT = "(?:_(?P<unit>m|cm|mm|in|inch))?"
_TURNED = (
    re.compile(r"q?(?P<axis>[wxyz])_?(?P<station>\d+)"),
    re.compile(r"(?P<station>.+?)_q(?:uat)?_?(?P<axis>[wxyz])"),
    re.compile(r"q(?:uat)?_?(?P<axis>[wxyz])_(?P<station>.+)"),
)
_PLACED = (
    re.compile(r"(?:loc|pos|position|p)_?(?P<station>\d+)_?(?P<axis>[xyz])" + _UNIT),
    re.compile(r"(?P<station>.+?)_(?:loc|pos|position|p)_?(?P<axis>[xyz])" + _UNIT),
    re.compile(r"(?:loc|pos|position)_?(?P<axis>[xyz])_(?P<station>.+?)" + _UNIT),
)
# A body's largest distance between two sensors, in each unit, chosen by hand; inches end where centimetres begin.
_BODY = (("m", 0.5, 3.0), ("in", 20.0, 95.0), ("cm", 95.0, 320.0), ("mm", 500.0, 3200.0))


def is_wide(names: list[str]) -> bool:
    """Whether columns are meant for this form: a time, and a whole quaternion of one station.

    Parameters
    ----------
    names : of the columns, in lower case
    """
    return any(name in SECONDS for name in names) and any(len(axes) == 4 for axes in _stations(names, _TURNED).values())


def parse(columns: Columns, own: dict[str, str] | None = None, *, unit: str = "auto") -> Suit:
    """Read the wide form.

    Parameters
    ----------
    columns : of the file
    own : names of stations in the file to ours, the user's own
    unit : "m", "cm", "mm", "in", or "auto"
        Of lengths whose columns do not say. "auto" tells by the size of the body where all 17 sensors are there, and
        takes inches, as trackers are delivered, where they are not.

    Returns
    -------
    Suit
        Repeated rows brought down to one a sample, on an even grid. A station that says nothing new in a sample is not
        valid there.

    Raises
    ------
    FormatError
        Naming what is missing, or the line at which time falls.
    """
    turned_at, placed_at = _stations(columns.names, _TURNED), _stations(columns.names, _PLACED)
    stations = [s for s, axes in turned_at.items() if len(axes) == 4]
    _all_there(columns, turned_at, placed_at, stations)
    try:
        sensors, said = name_sensors([str(s) for s in stations], own)
    except ValueError as error:
        raise columns.error(None, str(error)) from error
    time_name = str(column(columns, *SECONDS))
    time_s = columns.numbers(time_name) * SECONDS[time_name]
    _rising(columns, time_name, time_s)
    turned = np.stack([np.stack([columns.numbers(turned_at[s][c][0]) for c in "wxyz"], -1) for s in stations], 1)
    placed = np.stack([np.stack([columns.numbers(placed_at[s][c][0]) for c in "xyz"], -1) for s in stations], 1)
    notes, warnings = [], [said] if said else []
    units = {placed_at[s][c][1] for s in stations for c in "xyz"}
    scale, note, warning = _metres(units, placed, sensors, unit)
    notes += note
    warnings += warning
    valid = np.isfinite(np.concatenate([turned, placed], -1)).all(-1)
    seen = timeline.collapse(time_s, np.concatenate([turned, placed], -1))
    rows, at_s = np.arange(len(time_s)), time_s
    try:
        line = timeline.timeline(time_s)
        if len(seen.row) < len(time_s) and (line.kind != "even" or np.median(np.diff(seen.row, prepend=-1)) >= 2):
            notes.append(f"{len(time_s) - len(seen.row)} of {len(time_s)} rows repeat what was said and are left out")
            valid[seen.row] &= seen.is_new
            rows, at_s = seen.row, time_s[seen.arrived_row]
            line = timeline.timeline(at_s)
    except ValueError as error:
        raise columns.error(None, str(error)) from error
    on_time, more = notes_on_time(line)
    arrays = timeline.onto_grid(line, at_s, scale * placed[rows], turned[rows], valid[rows])
    return Suit(kept(line.rate_hz, sensors, *arrays), 0, scale, (*notes, *on_time), (*warnings, *more))


def _stations(names: list[str], patterns: tuple[re.Pattern[str], ...]) -> dict[str, dict[str, tuple[str, str]]]:
    """By station, in order of appearance, the column and unit of each axis; of the spelling that fits most columns."""
    best: dict[str, dict[str, tuple[str, str]]] = {}
    for pattern in patterns:
        found: dict[str, dict[str, tuple[str, str]]] = {}
        for name in names:
            match = pattern.fullmatch(name)
            if match:
                said = match.groupdict().get("unit") or ""
                found.setdefault(match["station"], {}).setdefault(match["axis"], (name, said))
        if sum(map(len, found.values())) > sum(map(len, best.values())):
            best = found
    return best


def _all_there(
    columns: Columns,
    turned: dict[str, dict[str, tuple[str, str]]],
    placed: dict[str, dict[str, tuple[str, str]]],
    stations: list[str],
) -> None:
    missing = [f"{c}{s}" for s in turned if s not in stations for c in "wxyz" if c not in turned[s]]
    missing += [f"loc{s}_{c}" for s in stations for c in "xyz" if c not in placed.get(s, {})]
    missing += [f"w{s}, x{s}, y{s}, z{s}" for s in placed if s not in turned]
    if missing:
        more = f" and {len(missing) - 6} more" if len(missing) > 6 else ""
        what = "a recording needs where every sensor is and how it is turned; export both"
        raise columns.error(None, f"want the columns {', '.join(missing[:6])}{more}, got none of them; {what}")


def _rising(columns: Columns, name: str, time_s: Float) -> None:
    bad = np.flatnonzero(~np.isfinite(time_s))
    if len(bad):
        raise columns.error(bad[0], f"column {name!r}: want a time, got none in {len(bad)} rows; mend them")
    falls = np.flatnonzero(np.diff(time_s) < 0)
    if len(falls):
        row = int(falls[0]) + 1
        what = f"want a time not before {time_s[row - 1]:.6f} s, got {time_s[row]:.6f} s; sort the recording"
        raise columns.error(row, f"column {name!r}: {what}")


def _metres(units: set[str], placed: Float, sensors: tuple[str, ...], unit: str) -> tuple[float, list[str], list[str]]:
    """Metres a unit, a note where it was told by size, and a warning where it was assumed."""
    said = units - {""}
    if len(said) == 1 and "" not in units:
        return METRES_PER_UNIT[said.pop()], [], []
    if unit != "auto":
        return METRES_PER_UNIT[unit], [], []
    if set(sensors) >= set(SENSORS):
        span = _span(placed)
        for name, least, most in _BODY:
            if least <= span < most:
                return METRES_PER_UNIT[name], [f"lengths are in {name}: the body is {span:.3g} of them across"], []
    warning = (
        'lengths are taken as inches, as such trackers are delivered; if they are not, say unit = "cm" in odori.toml, '
        "[calibration]"
    )
    return METRES_PER_UNIT["in"], [], [warning]


def _span(placed: Float) -> float:
    """Largest distance between two sensors, in the median of some hundred rows."""
    some = placed[:: max(len(placed) // 200, 1)]
    some = some[np.isfinite(some).all((-1, -2))]
    if not len(some):
        return float("nan")
    apart = np.linalg.norm(some[:, :, None] - some[:, None], axis=-1)
    return float(np.median(apart.max((1, 2))))
