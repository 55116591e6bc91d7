"""Resources that are plain objects: the stored arrays of the motion graph, and progress that is not shown."""

import zipfile
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.studio.files import write_beside
from pipelines.studio.lake import Lake


class NoProgress:
    """Progress that is not shown."""

    def begin(self, what: str, total: int) -> None:
        """Start counting."""

    def step(self) -> None:
        """One more is done."""


class GraphMemory:
    """Arrays the motion graph keeps in the lake; see :class:`assets.graph_memory.KeptArrays`."""

    def __init__(self, lake: Lake) -> None:
        self._path = lake.root / "motion_graph.npz"

    def recall(self) -> dict[str, NDArray[Any]] | None:
        """Read what was kept."""
        try:
            with self._path.open("rb") as file, np.load(file, allow_pickle=False) as kept:
                return {name: kept[name] for name in kept.files}
        except (OSError, ValueError, zipfile.BadZipFile, EOFError):
            return None  # none yet, or damaged: everything is computed again

    def keep(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Keep these instead of what was kept."""
        write_beside(self._path, lambda file: np.savez(file, **arrays))  # type: ignore[arg-type]
