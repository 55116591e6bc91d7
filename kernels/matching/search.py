"""The search for the best clips of every segment of a song, as the stages see it."""

from __future__ import annotations

from kernels.matching.score import SCALES, Match, merge_matches, reference_matches

__all__ = ["SCALES", "Match", "merge_matches", "reference_matches"]
