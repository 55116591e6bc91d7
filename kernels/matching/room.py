"""Memory that is used again and again: new memory for every product costs more than the product."""

from __future__ import annotations

import math
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

_T = TypeVar("_T", bound=np.generic)


class Room:
    """Arrays by name, which last until the next array of that name is asked for."""

    def __init__(self) -> None:
        self._kept: dict[str, NDArray[np.generic]] = {}

    def array(self, name: str, shape: tuple[int, ...], dtype: type[_T]) -> NDArray[_T]:
        """Give an array to write into; what is in it is of no meaning.

        Parameters
        ----------
        name : str
        shape : tuple of int
        dtype : a scalar type of NumPy, always the same for a name

        Returns
        -------
        C-contiguous array of that shape, in the memory of the last of that name where that suffices
        """
        size = math.prod(shape)
        kept = self._kept.get(name)
        if kept is None or kept.size < size:
            kept = self._kept[name] = np.zeros(size, dtype)
        found: NDArray[_T] = kept[:size].reshape(shape)  # type: ignore[assignment]
        return found
