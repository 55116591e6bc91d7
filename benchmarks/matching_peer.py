"""Brute force in Numba: the peer that the OpenCL searches are measured against.

Four segments a pass, four terms a division.
"""

from __future__ import annotations

import numba as nb
import numpy as np
from numpy.typing import NDArray


@nb.njit(fastmath=True, inline="always")
def four(b0, b1, b2, b3, a0, a1, a2, a3, s0, s1, s2, s3):  # noqa: ANN001, ANN201
    """Sum of a^2 / (a + b) of four terms, s the squares of a."""
    d0, d1, d2, d3 = a0 + b0, a1 + b1, a2 + b2, a3 + b3
    q0, q1 = d0 * d1, d2 * d3
    return ((s0 * d1 + s1 * d0) * q1 + (s2 * d3 + s3 * d2) * q0) / (q0 * q1)


@nb.njit(parallel=True, fastmath=True)
def largest(
    segments: NDArray[np.float32],
    squares: NDArray[np.float32],
    clips: NDArray[np.float32],
    n_frames: NDArray[np.int64],
    numerators: NDArray[np.int64],
) -> NDArray[np.float32]:
    """Best score of every segment, (S, L) with S and L multiples of 4, in every clip, (C, T) with zeros behind.

    Squares are of the segments; n_frames are the clips' own. Returns (S, C) float32.
    """
    n_segments, length = segments.shape
    n_clips = len(clips)
    best = np.zeros((n_segments, n_clips), np.float32)
    for work in nb.prange(n_clips * (n_segments // 4)):
        clip, s = work % n_clips, work // n_clips * 4
        m = clips[clip]
        total = np.zeros((4, 64), np.float32)
        least = np.full(4, np.float32(3e38), np.float32)
        for p in numerators:
            n = n_frames[clip] - (p * (length - 1) + 49) // 50
            for first in range(0, n, 64):
                total[:] = 0
                for f in range(0, length, 4):
                    x0, x1, x2, x3 = p * f, p * (f + 1), p * (f + 2), p * (f + 3)
                    w0 = np.float32(x0 % 50) * np.float32(0.02)
                    w1 = np.float32(x1 % 50) * np.float32(0.02)
                    w2 = np.float32(x2 % 50) * np.float32(0.02)
                    w3 = np.float32(x3 % 50) * np.float32(0.02)
                    m0, m1 = m[first + x0 // 50 :], m[first + x1 // 50 :]
                    m2, m3 = m[first + x2 // 50 :], m[first + x3 // 50 :]
                    a00, a01, a02, a03 = (
                        segments[s + 0, f + 0],
                        segments[s + 0, f + 1],
                        segments[s + 0, f + 2],
                        segments[s + 0, f + 3],
                    )
                    s00, s01, s02, s03 = (
                        squares[s + 0, f + 0],
                        squares[s + 0, f + 1],
                        squares[s + 0, f + 2],
                        squares[s + 0, f + 3],
                    )
                    a10, a11, a12, a13 = (
                        segments[s + 1, f + 0],
                        segments[s + 1, f + 1],
                        segments[s + 1, f + 2],
                        segments[s + 1, f + 3],
                    )
                    s10, s11, s12, s13 = (
                        squares[s + 1, f + 0],
                        squares[s + 1, f + 1],
                        squares[s + 1, f + 2],
                        squares[s + 1, f + 3],
                    )
                    a20, a21, a22, a23 = (
                        segments[s + 2, f + 0],
                        segments[s + 2, f + 1],
                        segments[s + 2, f + 2],
                        segments[s + 2, f + 3],
                    )
                    s20, s21, s22, s23 = (
                        squares[s + 2, f + 0],
                        squares[s + 2, f + 1],
                        squares[s + 2, f + 2],
                        squares[s + 2, f + 3],
                    )
                    a30, a31, a32, a33 = (
                        segments[s + 3, f + 0],
                        segments[s + 3, f + 1],
                        segments[s + 3, f + 2],
                        segments[s + 3, f + 3],
                    )
                    s30, s31, s32, s33 = (
                        squares[s + 3, f + 0],
                        squares[s + 3, f + 1],
                        squares[s + 3, f + 2],
                        squares[s + 3, f + 3],
                    )
                    for i in range(64):
                        b0 = m0[i] + w0 * (m0[i + 1] - m0[i])
                        b1 = m1[i] + w1 * (m1[i + 1] - m1[i])
                        b2 = m2[i] + w2 * (m2[i + 1] - m2[i])
                        b3 = m3[i] + w3 * (m3[i + 1] - m3[i])
                        total[0, i] += four(b0, b1, b2, b3, a00, a01, a02, a03, s00, s01, s02, s03)
                        total[1, i] += four(b0, b1, b2, b3, a10, a11, a12, a13, s10, s11, s12, s13)
                        total[2, i] += four(b0, b1, b2, b3, a20, a21, a22, a23, s20, s21, s22, s23)
                        total[3, i] += four(b0, b1, b2, b3, a30, a31, a32, a33, s30, s31, s32, s33)
                for j in range(4):
                    for i in range(min(64, n - first)):
                        least[j] = min(least[j], total[j, i])
        for j in range(4):
            best[s + j, clip] = segments[s + j].sum() - least[j]
    return best


@nb.njit
def exact_best(
    segment: NDArray[np.float64],
    clips: NDArray[np.float64],
    n_frames: NDArray[np.int64],
    numerators: NDArray[np.int64],
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
    """Best candidate of every clip in float64, in the order of operations of kernels.matching.score.sums.

    Clips are (C, T) with at least one zero behind. Returns score (-1: none fits), scale index and start, (C,) each.
    """
    n_clips, length = len(clips), len(segment)
    best = np.full(n_clips, -1.0)
    scale, start = np.zeros(n_clips, np.int64), np.zeros(n_clips, np.int64)
    for clip in range(n_clips):
        m = clips[clip]
        for j, p in enumerate(numerators):
            n = n_frames[clip] - (p * (length - 1) + 49) // 50
            if n < 1:
                continue
            total = np.zeros(n)
            for f in range(length):
                a = segment[f]
                if a <= 0:
                    continue
                whole, weight = p * f // 50, p * f % 50 / 50
                for i in range(n):
                    b = (1.0 - weight) * m[whole + i] + weight * m[whole + i + 1]
                    total[i] += (a * b) / (a + b)
            i = np.argmax(total)
            if total[i] > best[clip]:
                best[clip], scale[clip], start[clip] = total[i], j, i
    return best, scale, start
