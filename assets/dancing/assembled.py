"""From chosen steps to the poses of a dance, for the stage and for a draft alike."""

from __future__ import annotations

from assets.reading.clips import load_clips
from assets.stamps import Stored
from kernels.assembly.blend import Dance, assemble
from kernels.assembly.feet import lock_feet, planted_feet
from kernels.skeleton.canonical import CANONICAL
from kernels.types import Choreography
from schemas.settings import DanceSettings


def assemble_steps(
    steps: Choreography, canonical_pose: Stored, settings: DanceSettings, *, frame_rate_hz: float | None = None
) -> Dance:
    """Warp, join and sample the clips of a choreography, its planted feet locked where the settings say so.

    Parameters
    ----------
    steps : Choreography of at least one step
    canonical_pose : Stored, poses of clips by session
    settings : the ``[dance]`` section
    frame_rate_hz : float, > 0; None or 0 for the setting's

    Returns
    -------
    Dance
    """
    clips = load_clips(canonical_pose, steps)
    dance = assemble(
        steps,
        clips,
        skeleton=CANONICAL,
        frame_rate_hz=frame_rate_hz or settings.frame_rate_hz,
        duration_s=float(steps.song_end_s[-1]),
        shape=settings.blend_shape,
    )
    return lock_feet(dance, planted_feet(dance, steps, clips)) if settings.lock_feet else dance
