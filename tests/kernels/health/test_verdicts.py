"""Faults, and which frames they fence."""

import numpy as np
import pytest

from kernels.health.verdicts import ClipFault, ExaminedClip, fence_of


def fault(first, last, verdict="fenced", reason="it flips", kind="flip"):
    return ClipFault(kind, "head", first, last, verdict, reason)


def test_only_fenced_frames_are_fenced_and_both_ends_of_a_fault_are():
    found = fence_of([fault(1, 2), fault(4, 4), fault(5, 6, "mended"), fault(7, 7, "doubtful")], 9)
    assert np.flatnonzero(found).tolist() == [1, 2, 4]


def test_a_kind_that_is_none_and_frames_in_disorder_are_named():
    with pytest.raises(ValueError, match=r"kind: want one of .*flip.*, got 'oddness'"):
        fault(0, 1, kind="oddness")
    with pytest.raises(ValueError, match=r"first, last: want 0 <= first <= last, got 3, 2"):
        fault(3, 2)


def test_a_clip_is_refused_by_its_refused_faults_each_said_once():
    said = ExaminedClip(None, (fault(0, 1), fault(0, 1, "refused", "a dog"), fault(2, 3, "refused", "a dog")))
    assert said.refusal == "a dog"
    assert ExaminedClip(None, (fault(0, 1),)).refusal == ""
