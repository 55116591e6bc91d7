"""What may be wrong with a recording, each fault named with its sensor, its frame and its remedy."""

from __future__ import annotations

from kernels.calibration.records import Finding, Recording


def check_recording(recording: Recording) -> tuple[Finding, ...]:
    """Judge the values of a recording before anything is computed from them.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    tuple of Finding
        Empty where nothing is wrong.
    """
    return ()
