"""The search for the best clips of every segment of a song, as the stages see it."""

from __future__ import annotations

from kernels.matching.plan import BRUTE, BRUTE_SPARSE, PLANS, Plan
from kernels.matching.score import SCALES, Match, merge_matches, reference_matches
from kernels.opencl.match import ClipIndex, Matcher

__all__ = [
    "BRUTE",
    "BRUTE_SPARSE",
    "PLANS",
    "SCALES",
    "ClipIndex",
    "Match",
    "Matcher",
    "Plan",
    "merge_matches",
    "reference_matches",
]
