"""The stage of a dance by a character from a USD file: the character beside it, referenced and moved."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path

from pxr import Sdf, Usd

from assets.formats import usd, usd_character, usd_lineage
from assets.formats.usd_character import Copy, UsdRig
from kernels.types import Clip
from schemas import stage_contract as contract


def write_cast_stage(
    path: str | Path,
    fitted: Clip,
    rig: UsdRig,
    copy: Copy,
    *,
    audio: str | None = None,
    provenance: Mapping[str, object] | None = None,
    title: str = "dance",
    lineage: usd_lineage.Frames | None = None,
) -> None:
    """Write a dance by a character as a USD stage.

    Parameters
    ----------
    path : ends in .usdc; folders are made
        The character's copy goes into a folder beside it, see :func:`character_folder`.
    fitted : Clip on ``rig.character.figure``, F >= 1 frames
    rig, copy : of the character
    audio, provenance, title, lineage : as :func:`assets.formats.usd.write_stage` has them

    Raises
    ------
    ValueError
        If the suffix, the audio path, the provenance or the lineage does not fit.
    OSError
        If a file cannot be written; what stood at ``path`` before still stands.
    """
    path = Path(path)
    if path.suffix != ".usdc":
        raise ValueError(f"path: want a name ending in .usdc, got {path.name!r}")
    if fitted.n_frames < 1:
        raise ValueError("fitted: want at least one frame, got none")
    folder = character_folder(path)
    layer = Sdf.Layer.CreateAnonymous(".usdc")
    stage = Usd.Stage.Open(layer)
    usd.write_metadata(stage, fitted)
    usd.tell_root(stage, stage.DefinePrim(contract.ROOT_PATH), provenance or {}, title)
    if audio is not None:
        usd.write_audio(stage, audio)
    del stage  # nothing looks while the reference has nothing to point at yet
    moved = usd_character.moves(rig, fitted)
    with Sdf.ChangeBlock():
        usd_character.write_cast(layer, rig, f"{folder.name}/{CHARACTER_FILE}", moved)
        place = usd_character.ANIMATION_PATH
        usd.write_samples(layer, place, rig.joints, moved.rotation_wxyz, moved.translation, moved.scale)
        if lineage is not None:
            usd_lineage.write_lineage(layer, place, lineage)
    shutil.rmtree(folder, ignore_errors=True)
    with usd.written_beside(folder / CHARACTER_FILE) as partial:
        usd.save(copy.layer, partial)
    for name, data in copy.files.items():
        with usd.written_beside(folder / name) as partial:
            partial.write_bytes(data)
    with usd.written_beside(path) as partial:
        usd.save(layer, partial)


CHARACTER_FILE = "character.usdc"


def character_folder(stage: Path) -> Path:
    """Folder beside a stage that holds its character."""
    return stage.parent / f"{stage.stem}_character"
