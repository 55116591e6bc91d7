"""Flips, pops and bursts of single joints: mended where both sides tell what was there, fenced where they do not."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from kernels import rotation
from kernels.health import jumps, mending
from kernels.health.body_in_motion import BodyInMotion
from kernels.health.jumps import Burst
from kernels.health.speed_limit import LIMIT_DEG_PER_S
from kernels.health.verdicts import ClipFault
from kernels.types import Clip, Float

_PLAIN_DEG = 2.5
"""How far the same curve may miss frames just before and after a gap, so that it is mended. Chosen by hand, near what
anybody sees."""

_PLAIN_ONE_DEG = 4.0
"""The same for a gap of one frame. Chosen by hand: a frame that is a little off is better than a hole in a dance."""

_PLAIN_M = 0.01
"""The same for places, on the canonical body. Chosen by hand."""

_CUT_SHARE = 0.2
"""Share of the joints that jump in one step and do not come back where two takes were joined. Chosen by hand: clean
takes have one joint at a time, the toes."""

_CUT_FEWEST = 3
"""Joints of such a cut. Chosen by hand."""

_WILD = 4
"""Sharp steps in one burst that make it a gimbal's: more than in and out, twice. Chosen by hand."""


_HALF_TURN_DEG = 150.0
"""From here on a step may as well be one the other way round. Chosen by hand, beyond all that bodies do in a frame."""


@dataclass(frozen=True)
class _Channel:
    """Signals of one sort: their values, what they are called, and how they are measured and bridged."""

    kind: str
    value: Float
    names: Sequence[str]
    step: Float
    least: float
    plain: tuple[float, float]
    apart: Callable[[int, int, int], float]
    bridge: Callable[[Float, tuple[int, int, int, int]], Float]
    miss: Callable[[Float, Float], float]
    largest: float
    unit: str


def mend(body: BodyInMotion, is_hidden: NDArray[np.bool_]) -> tuple[Clip, list[ClipFault]]:
    """Mend and fence what jumps.

    Parameters
    ----------
    body : BodyInMotion of F frames
    is_hidden : (F,) bool
        Frames that are fenced already: jumps within them or at their edges are theirs.

    Returns
    -------
    clip : of F frames, mended
    faults : mended and fenced, by frame
        None where F is less than 4.
    """
    clip = body.clip
    if clip.n_frames < 4:
        return clip, []
    faults: list[ClipFault] = []
    turns = _turns(body)
    turned, found = _mended(body, turns, is_hidden)
    faults += found
    rotation_wxyz = clip.rotation_wxyz.copy()
    rotation_wxyz[:, body.needed] = turned
    moving = _moving(body)
    placed, found = _mended(body, _places(body, moving), is_hidden)
    faults += found
    translation = clip.translation_xyz_m
    if translation is not None and len(moving):
        translation = translation.copy()
        translation[:, moving] = placed[:, 1:]
    mended = replace(
        clip,
        root_xyz_m=placed[:, 0],
        rotation_wxyz=rotation.continuous(rotation_wxyz),
        translation_xyz_m=translation,
    )
    has_mended = any(fault.verdict == "mended" for fault in faults)
    return mended if has_mended else clip, told_once(faults)


def told_once(faults: list[ClipFault]) -> list[ClipFault]:
    """Say faults of one kind in the same frames once, with the joint that jumps most named first.

    Parameters
    ----------
    faults : in any order

    Returns
    -------
    list of ClipFault
        By frame, then by joint; of those told together the reason of the first, with how many more there are.
    """
    groups: dict[tuple[str, int, int, str], list[ClipFault]] = {}
    for fault in faults:
        groups.setdefault((fault.kind, fault.first, fault.last, fault.verdict), []).append(fault)
    told = []
    for group in groups.values():
        first, n_more = group[0], len({fault.joint for fault in group} - {group[0].joint})
        also = f"; so do {n_more} more joints" if n_more > 1 else f"; so does {group[1].joint}" if n_more else ""
        told.append(replace(first, reason=first.reason + also))
    return sorted(told, key=lambda fault: (fault.first, fault.last, fault.kind, fault.joint))


def _turns(body: BodyInMotion) -> _Channel:
    clip = body.clip
    value = clip.rotation_wxyz[:, body.needed]

    def apart(signal: int, a: int, b: int) -> float:
        return float(np.degrees(rotation.angle_between(value[a, signal], value[b, signal])))

    return _Channel(
        kind="flip",
        value=value,
        names=[clip.skeleton.joints[k] for k in body.needed],
        step=_opposed(body.step_deg),
        least=jumps.bound(jumps.TURN_DEG, jumps.TURN_LEAST_DEG, clip.frame_rate_hz),
        plain=(_PLAIN_ONE_DEG, _PLAIN_DEG),
        apart=apart,
        bridge=mending.bridge_turns,
        miss=lambda a, b: float(np.degrees(rotation.angle_between(a, b)).max()),
        largest=LIMIT_DEG_PER_S / clip.frame_rate_hz,
        unit="°",
    )


def _opposed(step_deg: Float) -> Float:
    """Tell half turns there and back, which look the same, apart: of two in a row the second goes the other way."""
    out, size = step_deg.copy(), np.linalg.norm(step_deg, axis=-1)
    for t, k in zip(*np.nonzero((size[1:] > _HALF_TURN_DEG) & (size[:-1] > _HALF_TURN_DEG)), strict=True):
        if out[t + 1, k] @ out[t, k] > 0:
            out[t + 1, k] *= 1 - 360 / size[t + 1, k]
    return out


def _moving(body: BodyInMotion) -> NDArray[np.int64]:
    """Joints below the root that move against their parent."""
    moved = body.clip.translation_xyz_m
    if moved is None:
        return np.zeros(0, np.int64)
    reach = np.ptp(moved, axis=0).max(axis=-1)
    return np.array([k for k in body.needed if k > 0 and reach[k] > 1e-3 * body.leg_m], np.int64)


def _places(body: BodyInMotion, moving: NDArray[np.int64]) -> _Channel:
    clip = body.clip
    value = clip.root_xyz_m[:, None]
    if clip.translation_xyz_m is not None:
        value = np.concatenate([value, clip.translation_xyz_m[:, moving]], axis=1)
    least = body.scale * jumps.bound(jumps.PLACE_M, jumps.PLACE_LEAST_M, clip.frame_rate_hz)
    return _Channel(
        kind="pop",
        value=value,
        names=[clip.skeleton.joints[k] for k in (0, *moving.tolist())],
        step=np.diff(value, axis=0),
        least=least,
        plain=(body.scale * _PLAIN_M, body.scale * _PLAIN_M),
        apart=lambda signal, a, b: float(np.linalg.norm(value[a, signal] - value[b, signal])),
        bridge=mending.bridge_places,
        miss=lambda a, b: float(np.linalg.norm(a - b, axis=-1).max()),
        largest=least,
        unit=" m",
    )


def _mended(body: BodyInMotion, channel: _Channel, is_hidden: NDArray[np.bool_]) -> tuple[Float, list[ClipFault]]:
    """Values with what is plain mended, and the faults."""
    n_frames, rate_hz = len(channel.value), body.clip.frame_rate_hz
    found = jumps.find_bursts(channel.step, channel.apart, least=channel.least, frame_rate_hz=rate_hz)
    found = [burst for burst in jumps.merged(found) if not _is_hidden(burst, is_hidden)]
    cuts = _cuts(found, len(channel.names))
    value = channel.value.copy()
    faults: list[ClipFault] = []
    longest = mending.longest_gap(rate_hz)
    by_signal: dict[int, list[Burst]] = {}
    for burst in found:
        by_signal.setdefault(burst.signal, []).append(burst)
    for signal, bursts in by_signal.items():
        is_good = ~is_hidden
        for burst in bursts:
            if burst.n_sharp > 1:
                is_good[burst.first : burst.last + 1] = False
        for burst in bursts:
            kind = "gimbal" if channel.kind == "flip" and burst.n_sharp >= _WILD else channel.kind
            name, said = channel.names[signal], _sentence(body, channel, burst)
            if not burst.is_back:
                if burst.size > channel.largest or burst.n_sharp > 1 or burst.first in cuts:
                    first, last = _beyond(burst, n_frames, longest)
                    stays = f"{said}, and stays; not shown; clean it where it was recorded"
                    faults.append(ClipFault(kind, name, first, last, "fenced", stays))
                continue
            bridged = None
            if burst.last - burst.first < longest:
                bridged = _bridged(channel, signal, burst, is_good)
            if bridged is None:
                first, last = max(burst.first - 1, 0), min(burst.last + 1, n_frames - 1)
                unsure = f"{said} and comes back, and the frames around do not tell what was there; not shown"
                faults.append(ClipFault(kind, name, first, last, "fenced", f"{unsure}; clean it where it was recorded"))
            else:
                value[burst.first : burst.last + 1, signal] = bridged
                put_right = f"{said} and comes back; mended by a cubic from the frames around"
                faults.append(ClipFault(kind, name, burst.first, burst.last, "mended", put_right))
    return value, sorted(faults, key=lambda fault: (fault.first, fault.last))


def _is_hidden(burst: Burst, is_hidden: NDArray[np.bool_]) -> bool:
    """Whether every step of a burst is from or to a frame that is fenced already."""
    first, last = (burst.first, burst.last) if burst.n_sharp == 1 else (burst.first - 1, burst.last + 1)
    return bool((is_hidden[first:last] | is_hidden[first + 1 : last + 1]).all())


def _cuts(found: list[Burst], n_signals: int) -> set[int]:
    """First frames of lone sharp steps that many signals share."""
    lone = [burst.first for burst in found if burst.n_sharp == 1]
    fewest = max(_CUT_FEWEST, _CUT_SHARE * n_signals)
    return {frame for frame in lone if lone.count(frame) >= fewest}


def _beyond(burst: Burst, n_frames: int, longest: int) -> tuple[int, int]:
    """Frames that go with a jump that stays: near an end of the clip, all up to that end."""
    first, last = (burst.first, burst.last) if burst.n_sharp == 1 else (burst.first - 1, burst.last + 1)
    if first < longest:
        return 0, min(last, n_frames - 1)
    if n_frames - 1 - last < longest:
        return max(first, 0), n_frames - 1
    return max(first, 0), min(last, n_frames - 1)


def _bridged(channel: _Channel, signal: int, burst: Burst, is_good: NDArray[np.bool_]) -> Float | None:
    """Values over a gap, or None where they would be a guess."""
    frames = mending.support(burst.first, burst.last, is_good)
    if frames is None:
        return None
    value = channel.value[:, signal]
    missed = mending.doubt(
        lambda frames: channel.bridge(value, frames),
        lambda first, curve: channel.miss(value[first : first + len(curve)], curve),
        burst.first,
        burst.last,
        is_good,
    )
    is_one = burst.last == burst.first
    if missed > channel.plain[0 if is_one else 1] and not (is_one and np.isinf(missed)):
        return None
    return channel.bridge(value, frames)


def _sentence(body: BodyInMotion, channel: _Channel, burst: Burst) -> str:
    rate_hz = body.clip.frame_rate_hz
    what = "turns" if channel.kind == "flip" else "jumps"
    figure = f"{burst.size:.0f}" if channel.kind == "flip" else f"{burst.size:.2f}"
    when = f"in one frame of {1000 / rate_hz:.3g} ms at {body.at_s(burst.first)}"
    return f"{channel.names[burst.signal]} {what} {figure}{channel.unit} {when}"
