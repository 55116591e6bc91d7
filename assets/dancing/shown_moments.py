"""What a frame of a dance shows, and sentences on frames that are not as they should be."""

from collections.abc import Sequence

import numpy as np

from kernels.assembly.blend import Dance
from kernels.assembly.one_frame_flips import FurthestMove, OneFrameFlip
from kernels.skeleton.canonical import JOINTS
from kernels.types import Choreography
from schemas.keys import is_mirrored, source_clip


def shown_at(dance: Dance, steps: Choreography, frame: int) -> list[tuple[str, float]]:
    """Name the clips that a frame of a dance shows, with the moments of them.

    Parameters
    ----------
    dance : Dance
    steps : Choreography it was assembled from
    frame : int

    Returns
    -------
    list of (name of the step's clip, seconds)
        The dominant clip, and the partner of a blend.
    """
    line = dance.lineage
    shown = [(steps.clip_id[line.step_index[frame]], float(line.clip_time_s[frame]))]
    if line.blend_step_index[frame] >= 0:
        shown.append((steps.clip_id[line.blend_step_index[frame]], float(line.blend_time_s[frame])))
    return shown


def flip_sentences(flips: Sequence[OneFrameFlip], dance: Dance, steps: Choreography) -> tuple[str, ...]:
    """Say of each flip which joint turns how far, when, and what is shown.

    Parameters
    ----------
    flips : of the dance
    dance, steps : as :func:`shown_at` has them
    """
    return tuple(
        f"{JOINTS[flip.joint]} turns {np.degrees(flip.turn_rad):.0f}° {'in the world ' if flip.is_of_body else ''}"
        f"from one frame to the next at {flip.frame / dance.frame_rate_hz:.2f} s, {_where(dance, steps, flip.frame)}"
        for flip in flips
    )


def move_sentence(found: FurthestMove, dance: Dance, steps: Choreography) -> str:
    """Say which joint moves furthest in a frame, when, and what is shown.

    Parameters
    ----------
    found : of the dance
    dance, steps : as :func:`shown_at` has them
    """
    return (
        f"{JOINTS[found.joint]} moves at {found.speed_m_per_s:.1f} m/s at {found.frame / dance.frame_rate_hz:.2f} s, "
        f"{found.ratio:.2f} times the fastest frame of the clips shown, {_where(dance, steps, found.frame)}"
    )


def _where(dance: Dance, steps: Choreography, frame: int) -> str:
    named = [
        f"{source_clip(name)}{', mirrored,' if is_mirrored(name) else ''} at {time_s:.2f} s"
        for name, time_s in shown_at(dance, steps, frame)
    ]
    return f"in {named[0]}" if len(named) == 1 else f"in the blend of {named[0]} with {named[1]}"
