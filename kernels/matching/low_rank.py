"""An upper bound of h(a, b) = a b / (a + b) that is a sum of four products, so that many bounds are one matrix product.

    h(a, b) <= sum over r < 4 of u_r(a) v_r(b') + e(a),    b' the next node above b

Conventions: b is a sum of motion, divided so that 0 <= b <= 1; a is a sum of music in the same unit, at most 2^w for
some window w. Nodes of b are 0 and 2^-14 to 1, 512 to the octave, named by their place (*code*). Nodes of a are 0 and
2^(w - 14) to 2^w, 32 to the octave.

Why it holds, for every a and b:

1. h rises with b, so h(a, b) <= h(a, b').
2. v is a table over the nodes of b, u one over the nodes of a, linear between them. How far h is above their product
   is found by trying all nodes of a with all of b: h(a_i, b') <= u(a_i) v(b') + e_i.
3. Between two nodes of a, h is concave in a, so it is above its chord by at most d^2 / 8 max |h''|, d the distance of
   the nodes, and |h''| = 2 b^2 / (a + b)^3 is at most 8 / (27 a), where b = 2 a: by at most d^2 / (27 a_i). Below the
   first node that is not 0, h <= a bounds it by that node. So e(a) = max(e_i, e_{i+1}) + that.
4. For a above 2^w, h(a, b) <= b <= h(2^w, b) + b^2 / (2^w + b): the last node stands for all above it, and
   e(a) = e_n + 2^-w.

u and v come from the singular vectors of h over both ranges, which makes e small (about a thousandth of 2^w at most, a
tenth of that for most a) but is no part of the argument. v is stored in float32, and e is that of the stored values.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

RANK = 4
"""Products that bound h together. Chosen by hand: what they leave open is 0.1 to 0.2 % of the music's sum, as measured
on the data of the benchmark."""

_OCTAVES = 14
_MANTISSA = 9
"""Octaves of b, and bits of its mantissa, so 512 nodes an octave. Chosen so that a node's number fits into two
bytes."""

_SHIFT = 23 - _MANTISSA
_BELOW = (127 - _OCTAVES) << _MANTISSA
"""Bits of float32 that a node does not have, and its first bits at 2^-14: by definition of IEEE 754."""

_MUSIC_STEPS = 32
"""Nodes of a in an octave. Chosen by hand: all pairs of nodes are tried in 20 ms."""

_WINDOWS = (-60, 20)
"""Exponents of two that sums of music are brought near to. Chosen within the range of float32."""

_ROWS = 16
"""Nodes of a that are tried at a time. Chosen so that they stay in the cache, by hand; changes no bound."""


def nodes() -> NDArray[np.float64]:
    """List the nodes of b by their codes.

    Returns
    -------
    (7170,) float64, rising: 0, then 2^-14 to 1
    """
    bits = (_BELOW + np.arange((_OCTAVES << _MANTISSA) + 1, dtype=np.int32)) << _SHIFT
    return np.append(0.0, bits.astype(np.int32).view(np.float32).astype(np.float64))


def codes(sums: NDArray[np.float32]) -> NDArray[np.uint16]:
    """Find the node at or next above each sum.

    Parameters
    ----------
    sums : float32, 0 to 1, any shape, C-contiguous

    Returns
    -------
    uint16 of that shape
        0 only for 0.
    """
    bits = sums.view(np.int32)
    code = bits + ((1 << _SHIFT) - 1)  # bits of positive floats rise with them
    code >>= _SHIFT
    code -= _BELOW - 1
    np.maximum(code, 1, out=code)
    np.minimum(code, bits, out=code)  # only the bits of 0 are less than a code
    return code.astype(np.uint16)


class LowRank:
    """The bound for one window; see :func:`low_rank`.

    Parameters
    ----------
    window : int, w

    Attributes
    ----------
    motion : (7170, 4) float32, within -1 to 1
        v of every node of b; 0 for b = 0.
    """

    def __init__(self, window: int) -> None:
        motion, top = nodes(), 2.0**window
        octave = 2.0 ** np.arange(-_OCTAVES, 0)
        fine = np.append((octave[:, None] * (1 + np.arange(_MUSIC_STEPS) / _MUSIC_STEPS)).ravel(), 1.0)
        self._music = np.append(0.0, top * fine)
        some = 2.0 ** -np.linspace(0, _OCTAVES - 1, 8 * _OCTAVES)
        left, _, _ = np.linalg.svd(_h(top * some, some))
        values = left[:, :RANK].T @ _h(top * some, motion)
        values /= np.abs(values).max(1, keepdims=True)
        self.motion = np.ascontiguousarray(values.T, np.float32)
        few = self.motion[1::16].astype(np.float64)
        self._factor = _h(self._music, motion[1::16]) @ np.linalg.pinv(few.T)
        self._factor[0] = 0
        stored = self.motion.T.astype(np.float64)
        most = np.zeros(len(self._music))
        for at in range(0, len(most), _ROWS):
            rows = slice(at, at + _ROWS)
            most[rows] = np.maximum((_h(self._music[rows], motion) - self._factor[rows] @ stored).max(1), 0)
        gap = np.append(self._music[1], np.diff(self._music[1:]) ** 2 / (27 * self._music[1:-1]))
        self._excess = np.maximum(most[:-1], most[1:]) + gap
        self._beyond = most[-1] + 1 / top

    def music(self, sums: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Give u and e of sums of music.

        Parameters
        ----------
        sums : (...) float64, >= 0, in the unit of the window

        Returns
        -------
        factor : (..., 4) float64
        excess : (...) float64, >= 0
            Both 0 for 0.
        """
        flat = np.minimum(sums.ravel(), self._music[-1])
        factor = np.stack([np.interp(flat, self._music, self._factor[:, r]) for r in range(RANK)], -1)
        after = np.clip(np.searchsorted(self._music, sums), 1, len(self._music) - 1)
        excess = np.where(sums > self._music[-1], self._beyond, self._excess[after - 1])
        return factor.reshape(*sums.shape, RANK), np.where(sums > 0, excess, 0.0)


@lru_cache(maxsize=64)
def low_rank(window: int) -> LowRank:
    """Give the bound for sums of music up to 2^window, made once.

    Parameters
    ----------
    window : int, w

    Returns
    -------
    LowRank
    """
    return LowRank(window)


def window(largest: float) -> int:
    """Choose the window for sums of music: the even number just above, within -60 to 20.

    Parameters
    ----------
    largest : float, > 0, the largest sum, in the unit of the largest sum of motion

    Returns
    -------
    int
        Sums beyond the window, or far below it, have bounds too, loose ones.
    """
    exponent = int(np.frexp(largest)[1])
    return int(np.clip(exponent + exponent % 2, *_WINDOWS))


def _h(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Give h of all pairs, (A, B)."""
    total = a[:, None] + b
    total[total == 0] = 1.0
    product = a[:, None] * b
    product /= total
    return product
