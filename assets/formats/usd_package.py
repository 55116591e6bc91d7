"""A stage and its song in one file: .usdz, the same bytes every time.

USD's own packager dates its members by the clock; this one does not. The layout is that of the USDZ specification: a
zip file without compression, the stage first, every member's bytes on a 64-byte boundary, sound as WAV.
"""

from __future__ import annotations

import re
import struct
import zipfile
from pathlib import Path

from pxr import Sdf

from assets.formats import usd, usd_read
from assets.formats.errors import FormatError
from assets.formats.usd_cast import character_folder
from schemas import stage_contract as contract

_ZIP_HEADER_BYTES = 30
"""Of a local file header, by definition of ZIP."""


def write_package(path: str | Path, stage: str | Path) -> None:
    """Pack a stage and the song it names into one .usdz.

    Parameters
    ----------
    path : ends in .usdz; folders are made
    stage : path of a stage written by :func:`assets.formats.usd.write_stage`

    Raises
    ------
    ValueError
        If the suffix does not fit.
    FormatError
        If the stage cannot be read, or its song is missing or no WAV.
    OSError
        If the file cannot be written; what stood at ``path`` before still stands.
    """
    path, stage = Path(path), Path(stage)
    if path.suffix != ".usdz":
        raise ValueError(f"path: want a name ending in .usdz, got {path.name!r}")
    layer = _open_layer(stage)
    members: list[tuple[str, bytes]] = []
    song = layer.GetAttributeAtPath(contract.AUDIO_PATH + ".filePath")
    if song is not None:
        source = stage.parent / song.default.path
        name = re.sub(r"[^A-Za-z0-9._-]", "_", source.name)
        song.default = Sdf.AssetPath("./" + name)
        members.append((name, _read_wave(source)))
    members += [(name, file.read_bytes()) for name, file in _character_files(layer, stage).items()]
    with usd.written_beside(path) as partial:
        scratch = partial.with_suffix(".usdc")
        try:
            usd.save(layer, scratch)
            members.insert(0, ("dance.usdc", scratch.read_bytes()))
        finally:
            scratch.unlink(missing_ok=True)
        _zip(partial, members)


def copy_stage(path: str | Path, stage: str | Path) -> None:
    """Copy a stage with the song it names; in the copy the song bears the copy's name, so that copies share a folder.

    Parameters
    ----------
    path : ends in .usdc or .usda; folders are made
    stage : path of a stage written by :func:`assets.formats.usd.write_stage`

    Raises
    ------
    FormatError
        If the stage cannot be read, or its song is missing or no WAV.
    OSError
        If a file cannot be written; what stood there before still stands.
    """
    path, stage = Path(path), Path(stage)
    layer = _open_layer(stage)
    song = layer.GetAttributeAtPath(contract.AUDIO_PATH + ".filePath")
    if song is not None:
        sound = path.with_suffix(contract.PACKAGE_AUDIO_SUFFIX)
        data = _read_wave(stage.parent / song.default.path)
        with usd.written_beside(sound) as partial:
            partial.write_bytes(data)
        song.default = Sdf.AssetPath("./" + sound.name)
    for name, file in _character_files(layer, stage).items():
        own = character_folder(path).name + name[name.index("/") :]
        with usd.written_beside(path.parent / own) as partial:
            partial.write_bytes(file.read_bytes())
        layer.UpdateCompositionAssetDependency(f"./{name}", f"./{own}")
    with usd.written_beside(path) as partial:
        usd.save(layer, partial)


def song_name(stage: str | Path) -> str | None:
    """Name of the song file a stage names; None where it names none, or is no stage.

    Parameters
    ----------
    stage : path of any file
    """
    try:
        layer = _open_layer(Path(stage))
    except FormatError:
        return None
    song = layer.GetAttributeAtPath(contract.AUDIO_PATH + ".filePath")
    return None if song is None else Path(song.default.path).name


def _character_files(layer: Sdf.Layer, stage: Path) -> dict[str, Path]:
    """Files of the character a stage references, by path relative to it; none where it has a body of its own."""
    referenced = [Path(name) for name in layer.GetCompositionAssetDependencies()]
    folders = {stage.parent / name.parent for name in referenced if name.parent.name == character_folder(stage).name}
    files = sorted(file for folder in folders for file in folder.rglob("*") if file.is_file())
    return {file.relative_to(stage.parent).as_posix(): file for file in files}


def _open_layer(path: Path) -> Sdf.Layer:
    """Open one layer apart from any other holder of the same file."""
    usd_read.open_stage(path)
    return Sdf.Layer.OpenAsAnonymous(str(path))


def _read_wave(path: Path) -> bytes:
    """Read the bytes of a WAV file."""
    if not path.is_file():
        raise FormatError(str(path), 0, "want the song the stage names, got no such file; write it first")
    data = path.read_bytes()
    if data[:4] not in (b"RIFF", b"RF64") or data[8:12] != b"WAVE":
        raise FormatError(str(path), 0, "want a WAV file, got something else; a .usdz may hold no other kind we write")
    return data


def _zip(path: Path, members: list[tuple[str, bytes]]) -> None:
    """Write a .usdz: stored, dated 1980, each member's bytes on a 64-byte boundary."""
    align = contract.PACKAGE_ALIGNMENT_BYTES
    with path.open("wb") as file, zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as package:
        for name, data in members:
            info = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
            info.create_system, info.external_attr = 3, 0o644 << 16
            start = file.tell() + _ZIP_HEADER_BYTES + len(name.encode())
            # A field of its own kind that pads; it has a header of 4 bytes itself.
            pad = -(start + 4) % align
            info.extra = struct.pack("<HH", 0x1986, pad) + bytes(pad)
            package.writestr(info, data)
