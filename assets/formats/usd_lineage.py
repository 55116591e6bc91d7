"""Where every frame of a dance comes from, inside its stage: attributes of the animation.

Conventions
-----------
Names, types and meanings are those of :data:`schemas.stage_contract.LINEAGE`. They sit on the SkelAnimation, so that
lineage goes where the animation goes when it is referenced; readers that do not know them leave them alone. Samples are
written only where a value changes, and on both sides of the change for numbers, which USD blends.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd

from schemas import stage_contract as contract

HELD = {"token": str, "string": str, "bool": bool}
Frames = Mapping[str, Sequence[str] | Sequence[bool] | NDArray[np.float64]]


def write_lineage(layer: Sdf.Layer, animation: str, frames: Frames) -> None:
    """Write the lineage of a dance onto its animation; call it inside a change block.

    Parameters
    ----------
    layer : Sdf.Layer that holds the animation
    animation : path of the SkelAnimation
    frames : F values by the names of :data:`schemas.stage_contract.LINEAGE`, all of them

    Raises
    ------
    ValueError
        If a name is missing or strange, or the numbers of values differ.
    """
    if set(frames) != set(contract.LINEAGE) or len({len(values) for values in frames.values()}) != 1:
        got = ", ".join(f"{name} ({len(values)})" for name, values in frames.items())
        raise ValueError(f"lineage: want as many values of {', '.join(contract.LINEAGE)}, got {got or 'none'}")
    prim = layer.GetPrimAtPath(animation)
    for name, (kind, meaning) in contract.LINEAGE.items():
        spec = Sdf.AttributeSpec(prim, name, Sdf.ValueTypeNames.Find(kind), declaresCustom=True)
        spec.documentation = meaning
        values = frames[name]
        for frame in _needed(values, is_held=kind in HELD):
            value = HELD.get(kind, float)(values[frame])
            layer.SetTimeSample(spec.path, contract.START_TIME_CODE + frame, value)


def animation_with_lineage(stage: Usd.Stage) -> Usd.Prim | None:
    """Find the first prim of a stage that says where its frames come from; None where there is none.

    Parameters
    ----------
    stage : Usd.Stage
    """
    return next((prim for prim in stage.Traverse() if prim.GetAttribute("odori:clip").HasAuthoredValue()), None)


def read_lineage(animation: Usd.Prim, time_codes: NDArray[np.float64]) -> dict[str, list[str] | list[float]]:
    """Read the lineage of a dance at time codes.

    Parameters
    ----------
    animation : the SkelAnimation
    time_codes : (F,) float

    Returns
    -------
    dict
        F values by the names of :data:`schemas.stage_contract.LINEAGE`; {} where the stage has none.
    """
    found = {name: animation.GetAttribute(name) for name in contract.LINEAGE}
    if not all(attribute and attribute.GetNumTimeSamples() for attribute in found.values()):
        return {}
    return {name: [attribute.Get(float(time)) for time in time_codes] for name, attribute in found.items()}


def troubles(animation: Usd.Prim, time_codes: NDArray[np.float64], clips: Sequence[str] | None) -> Iterator[str]:
    """Say what is wrong with the lineage of an animation.

    Parameters
    ----------
    animation : the SkelAnimation
    time_codes : (F,) float, those of the dance, increasing
    clips : clips the provenance names; None where it names none

    Yields
    ------
    str
        One sentence each; nothing where the lineage is whole.
    """
    for name, (kind, _) in contract.LINEAGE.items():
        attribute = animation.GetAttribute(name)
        if not attribute or not attribute.GetNumTimeSamples():
            yield f"{name}: want where each frame comes from, got none"
            continue
        if str(attribute.GetTypeName()) != kind:
            yield f"{name}: want a {kind}, got a {attribute.GetTypeName()}"
            continue
        times = np.array(attribute.GetTimeSamples())
        if times[0] != time_codes[0] or times[-1] > time_codes[-1]:
            yield (
                f"{name}: want samples from time code {time_codes[0]:g} on, up to {time_codes[-1]:g}, "
                f"got {times[0]:g} to {times[-1]:g}"
            )
        yield from _wrong_values(name, kind, [attribute.Get(time) for time in times], clips)


def _wrong_values(name: str, kind: str, values: Sequence[str | float], clips: Sequence[str] | None) -> Iterator[str]:
    if kind == "float":
        number = np.array(values, np.float64)
        low, high = {"odori:blendWeight": (0.0, 0.5), "odori:warp": (1e-6, np.inf)}.get(name, (0.0, np.inf))
        if not (np.isfinite(number).all() and (number >= low - 1e-5).all() and (number <= high + 1e-5).all()):
            yield f"{name}: want {low:g} to {high:g}, got {number.min():g} to {number.max():g}"
    elif kind == "token" and clips is not None:
        strange = sorted({str(value) for value in values} - {*clips, *([""] if name == "odori:blendClip" else [])})
        if strange:
            yield f"{name}: want clips that the provenance names, got {', '.join(repr(clip) for clip in strange[:5])}"
    elif kind == "string":
        try:
            is_told = all(isinstance(json.loads(str(value)), dict) for value in values)
        except ValueError:
            is_told = False
        if not is_told:
            yield f"{name}: want a JSON object, got another text"


def _needed(values: Sequence[str] | Sequence[bool] | NDArray[np.float64], *, is_held: bool) -> list[int]:
    """Frames that must have a sample for every frame to read back as it was."""
    n = len(values)
    changes = [i for i in range(1, n) if values[i] != values[i - 1]]
    if is_held:
        return [0, *changes][: max(n, 0)] if n else []
    return sorted({0, n - 1, *changes, *(i - 1 for i in changes)}) if n else []
