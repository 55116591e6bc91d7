"""What the stages compute on, each on the device in use: matches and pose distances.

Every one has a twin in NumPy, the reference, for machines without a device.
"""

from collections.abc import Sequence
from typing import Any

from numpy.typing import NDArray

from assets.matching import SegmentMatcher
from kernels.graph.distance import PairDistance, PoseFeatures, pose_distance
from kernels.matching.score import Match
from pipelines.device_fallback import Devices, OnDevice
from schemas.settings import MatchingSettings


class Distances:
    """Pose distances on the device in use; see :class:`kernels.graph.distance.PairDistance`.

    Parameters
    ----------
    devices : Devices
    """

    def __init__(self, devices: Devices) -> None:
        self._on: OnDevice[PairDistance] = OnDevice(devices, _distance)

    @property
    def name(self) -> str:
        """What computes, with its driver."""
        return self._on.name

    def __call__(self, rows: PoseFeatures, columns: PoseFeatures) -> NDArray[Any]:
        """Distances of every row to every column.

        Parameters
        ----------
        rows, columns : PoseFeatures of n and m poses, made alike

        Returns
        -------
        (n, m) float, >= 0
        """
        return self._on.use(lambda distance: distance(rows, columns))


class Matches:
    """The search for matches on the device in use; see :class:`assets.matching.SegmentMatcher`.

    Parameters
    ----------
    devices : Devices
    settings : the ``[matching]`` section
    """

    def __init__(self, devices: Devices, settings: MatchingSettings) -> None:
        memory_bytes = int(settings.memory_mb * 2**20)
        self._on: OnDevice[SegmentMatcher] = OnDevice(devices, lambda context: _matcher(context, memory_bytes))

    @property
    def name(self) -> str:
        """What computes, with its driver."""
        return self._on.name

    def index(self, clips: Sequence[NDArray[Any]]) -> "IndexedClips":
        """Prepare a catalogue for many songs.

        Parameters
        ----------
        clips : sequence of (T,) float, finite, >= 0, in ascending order of their keys
        """
        return IndexedClips(clips)

    def matches(
        self, segments: Sequence[NDArray[Any]], clips: "IndexedClips | Sequence[NDArray[Any]]", *, k: int
    ) -> Sequence[Sequence[Match]]:
        """Find the k best clips of every segment.

        Parameters
        ----------
        segments : sequence of (L,) float, L >= 1, finite, >= 0
        clips : what :meth:`index` made, or clips
        k : int, >= 1

        Returns
        -------
        one list a segment, the best first
        """
        if not isinstance(clips, IndexedClips):
            return self._on.use(lambda engine: engine.matches(segments, clips, k=k))
        return self._on.use(lambda engine: engine.matches(segments, clips.indexed(engine), k=k))


class IndexedClips:
    """Clips prepared for many songs on whatever searches them.

    Parameters
    ----------
    clips : sequence of (T,) float, finite, >= 0, in ascending order of their keys
    """

    def __init__(self, clips: Sequence[NDArray[Any]]) -> None:
        self._clips = clips
        self._made: tuple[SegmentMatcher, Any] | None = None

    def indexed(self, engine: SegmentMatcher) -> Any:  # noqa: ANN401 - what only the engine reads
        """Give the index of one engine, made anew where another made the last.

        Parameters
        ----------
        engine : SegmentMatcher
        """
        if self._made is None or self._made[0] is not engine:
            self._made = engine, engine.index(self._clips)
        return self._made[1]


def _distance(context: Any) -> PairDistance:  # noqa: ANN401 - a cl.Context or None
    if context is None:
        return pose_distance
    from kernels.opencl.pose_distance import PoseDistance

    return PoseDistance(context)


def _matcher(context: Any, memory_bytes: int) -> SegmentMatcher:  # noqa: ANN401 - a cl.Context or None
    if context is None:
        from kernels.matching.numpy_search import NumpyMatcher

        return NumpyMatcher(memory_bytes=memory_bytes)
    from kernels.opencl.match import Matcher

    return Matcher(context, memory_bytes=memory_bytes)
