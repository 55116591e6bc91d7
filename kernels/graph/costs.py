"""What a dance pays for: seams, warp, half- and double-time, showing the same again."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from kernels.ranks import mean_ranks
from kernels.types import Float, Int, MotionGraph
from kernels.warp import EASY_WARP, HARD_WARP, WarpWeights


@dataclass(frozen=True)
class PathCosts:
    """Prices and bounds of a path; without unit, about 1 for one ordinary seam.

    Parameters
    ----------
    seam, transition : float, >= 0
        A transition costs ``seam + transition · weight / scale``.
    transition_scale : float, > 0, or None
        Weight of a poor seam. None: the 95th percentile of the graph's weights.
    rough : float, >= 0
        A transition costs ``rough · (log2 of the clips' own jerk around it over what is usual)²`` more.
    warp, leaving, warp_outside : float, >= 0
        A step of warp ratio r (song time ÷ clip time) costs ``warp · (ln r / ln 1.1)²``; outside the soft bounds
        ``leaving + warp_outside · e`` more, e = 0 at the soft bound and 1 at the hard one, linear in ln r and beyond.
    soft_ratio, hard_ratio : (low, high), 0 < low < 1 < high
        Inside the soft bounds a warp is hardly seen; leaving them costs as much as several seams, so that it happens
        only where the catalogue has nothing near the song's tempo. Outside the hard bounds a step is used only where
        nothing else reaches the last beat.
    last_resort_ratio : (low, high)
        Outside these a step is never used.
    stride : float, >= 0
        Price of each doubling or halving of time: a step of m motion beats over d music beats costs
        ``stride · |log2(m / d)|``.
    jump_back, jump_back_window_s : float, >= 0
        A transition costs ``jump_back`` more when it goes back in its own clip by at most the window, in seconds.
    usage : float, >= 0
        Showing a stretch between two motion beats for the n-th time costs ``usage · (n − 1)``.
    stay : float, >= 0
        A transition r music beats after the one before it, or after the song's start, costs ``stay · (M − r) / M`` more
        where r < M: a phrase cut short. The song's end cuts none short.
    stay_beats : int, >= 1
        M, beats of the music after which a stay is long enough; 1 for no price.
    missed_beat : float, >= 0
        A step over d music beats that ends on a node of accent a costs ``missed_beat · (d − a)``: each music beat on
        which the body does not visibly stop. Nothing where the graph's accents are not known.

    Raises
    ------
    ValueError
        If a price is negative or not finite, or bounds are not nested around 1.
    """

    seam: float = 0.5
    transition: float = 1.0
    transition_scale: float | None = None
    rough: float = 4.0
    warp: float = 0.1
    leaving: float = 8.0
    warp_outside: float = 8.0
    soft_ratio: tuple[float, float] = EASY_WARP
    hard_ratio: tuple[float, float] = HARD_WARP
    last_resort_ratio: tuple[float, float] = (0.4, 2.5)
    stride: float = 0.25
    jump_back: float = 1.0
    jump_back_window_s: float = 8.0
    usage: float = 0.5
    stay: float = 0.0
    stay_beats: int = 4
    missed_beat: float = 2.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, float | int) and not (np.isfinite(value) and value >= 0):
                raise ValueError(f"{field.name}: want finite, >= 0, got {value}")
        if self.stay_beats < 1:
            raise ValueError(f"stay_beats: want >= 1, got {self.stay_beats}")
        if self.transition_scale == 0:
            raise ValueError("transition_scale: want > 0, got 0")
        (a, b), (c, d), (e, f) = self.last_resort_ratio, self.hard_ratio, self.soft_ratio
        if not 0 < a <= c < e < 1 < f < d <= b:
            raise ValueError(
                "last_resort_ratio, hard_ratio, soft_ratio: want each within the one before and around 1, got "
                f"{self.last_resort_ratio}, {self.hard_ratio}, {self.soft_ratio}"
            )

    @property
    def warp_weights(self) -> WarpWeights:
        """What a warp costs, as :func:`kernels.warp.warp_cost` takes it."""
        return WarpWeights(self.warp, self.leaving, self.warp_outside, self.soft_ratio, self.hard_ratio)


def stride_cost(motion_beats: int, music_beats: int, costs: PathCosts) -> float:
    """Price of dancing in half- or double-time: ``stride · |log2(m / d)|``; 0 for beat on beat.

    Parameters
    ----------
    motion_beats, music_beats : int, >= 1
    costs : PathCosts

    Returns
    -------
    float, >= 0
    """
    return costs.stride * abs(float(np.log2(motion_beats / music_beats)))


def beat_cost(graph: MotionGraph, end: Int, music_beats: int, costs: PathCosts) -> Float:
    """Price of the music beats a step leaves undanced.

    Parameters
    ----------
    graph : MotionGraph
    end : (M,) int64, nodes where steps end; -1 counts nothing
    music_beats : int, >= 1, beats the steps cover
    costs : PathCosts

    Returns
    -------
    (M,) float64, >= 0: ``missed_beat · (d − accent)``; zeros where the graph's accents are not known
    """
    if graph.accent is None:
        return np.zeros(len(end))
    return np.where(end >= 0, costs.missed_beat * (music_beats - graph.accent[np.maximum(end, 0)]), 0.0)


def transition_cost(graph: MotionGraph, costs: PathCosts) -> Float:
    """Price of each transition by its weight, (E,) float64: ``seam + transition · weight / scale``.

    Parameters
    ----------
    graph : MotionGraph of E transitions
    costs : PathCosts

    Returns
    -------
    (E,) float64, >= 0; empty without transitions
    """
    return np.asarray(costs.seam + costs.transition * graph.weight / weight_scale(graph, costs), np.float64)


def weight_scale(graph: MotionGraph, costs: PathCosts) -> float:
    """Give the weight of a poor seam.

    Parameters
    ----------
    graph : MotionGraph
    costs : PathCosts

    Returns
    -------
    float, > 0
        The costs' own, else the 95th percentile of the graph's; 1 where there are no transitions, or that is 0.
    """
    if costs.transition_scale is not None:
        return costs.transition_scale
    return (float(np.percentile(graph.weight, 95)) if len(graph.weight) else 1.0) or 1.0


def rough_cost(graph: MotionGraph, costs: PathCosts) -> Float:
    """Price of each transition by how rough its clips are around it, (E,) float64 (ours).

    A seam draws the eye to what happens around it: a stamp or a kick of the one clip beside the calm of the other.

    Parameters
    ----------
    graph : MotionGraph of E transitions
    costs : PathCosts

    Returns
    -------
    (E,) float64, >= 0
        ``rough · log2(peak / usual)²``: the larger jerk around its two nodes over what is usual in the calmer of the
        two clips, or in the median clip where both are wilder; 0 where it is below, or jerk is not known.
    """
    if graph.peak_jerk is None or graph.usual_jerk is None or not len(graph.source):
        return np.zeros(len(graph.source))
    peak = np.maximum(graph.peak_jerk[graph.source], graph.peak_jerk[graph.target])
    usual = np.minimum(graph.usual_jerk[graph.source], graph.usual_jerk[graph.target])
    usual = np.minimum(usual, np.median(graph.usual_jerk))
    is_rough = (peak > usual) & (usual > 0)
    doublings = np.log2(np.where(is_rough, peak, 1.0) / np.where(is_rough, usual, 1.0))
    return np.asarray(costs.rough * doublings**2, np.float64)


def intensity_price(music: Float, graph: MotionGraph, *, weight: float) -> Float:
    """Price of dancing strong music with little movement, and weak music with much (ours).

    Parameters
    ----------
    music : (K,) float, how strong each music interval is, in any unit
    graph : MotionGraph of N nodes
    weight : float, >= 0

    Returns
    -------
    (K, N) float64, 0 to ``weight``
        ``weight`` times the squared difference of the ranks, 0 to 1: of the interval in the song, of the movement after
        the node in the catalogue. Zeros where the nodes' speeds are not known.
    """
    if graph.speed is None or not len(music) or not len(graph.speed):
        return np.zeros((len(music), len(graph.clip_index)))
    ranks = [(mean_ranks(values) - 0.5) / len(values) for values in (music, graph.speed)]
    return np.asarray(weight * np.subtract.outer(*ranks) ** 2, np.float64)


def hurry_cost(costs: PathCosts) -> Float:
    """Price of a transition by the music beats since the one before: 1, 2, … M, the last free.

    Parameters
    ----------
    costs : PathCosts

    Returns
    -------
    (M,) float64, ``stay · (M − r) / M``; one zero where stays have no price
    """
    most = costs.stay_beats if costs.stay else 1
    return np.asarray(costs.stay * (most - np.arange(1, most + 1)) / most, np.float64)


def jump_back_cost(graph: MotionGraph, costs: PathCosts) -> Float:
    """Price of each transition that goes back to what may just have been danced, (E,) float64.

    Parameters
    ----------
    graph : MotionGraph of E transitions
    costs : PathCosts

    Returns
    -------
    (E,) float64, 0 or ``jump_back``; empty without transitions
    """
    back_s = graph.time_s[graph.source] - graph.time_s[graph.target]
    same = graph.clip_index[graph.source] == graph.clip_index[graph.target]
    return np.where(same & (back_s >= 0) & (back_s <= costs.jump_back_window_s), costs.jump_back, 0.0)


def usage_cost(shown: Int, n_nodes: int, costs: PathCosts) -> Float:
    """Price of showing stretches again.

    Parameters
    ----------
    shown : (M,) int64, first node of every stretch shown, in order of the dance
    n_nodes : int
    costs : PathCosts

    Returns
    -------
    (M,) float64: ``usage`` times how often the stretch was shown before
    """
    order = np.argsort(shown, kind="stable")
    ranked = shown[order]
    earlier = np.arange(len(shown)) - np.searchsorted(ranked, ranked, "left")
    cost = np.zeros(len(shown))
    cost[order] = costs.usage * earlier
    return cost


def is_within(ratio: Float, bounds: tuple[float, float]) -> NDArray[np.bool_]:
    """Whether warp ratios lie within bounds, with room for the last bits: (...) bool.

    Parameters
    ----------
    ratio : (...) float, song time ÷ clip time
    bounds : (low, high), 0 < low <= high

    Returns
    -------
    (...) bool
    """
    return np.asarray((ratio >= bounds[0] * (1 - 1e-9)) & (ratio <= bounds[1] * (1 + 1e-9)))
