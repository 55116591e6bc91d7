"""Who reads and writes the lake for Dagster: tables by partition, stamped; and stages.

Assets return tables or records, never paths; only this module and the lake know paths.
"""

import dataclasses
import json
import shutil
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import dagster as dg
import pyarrow as pa

from assets.formats import audio, motion_index, tree, usd, usd_cast, usd_package
from assets.partitions import dagster_key, lake_key
from assets.search import Index
from assets.stage import Stage
from assets.stamps import Part, Parts, Stamp, content_version
from assets.tables import pack
from pipelines.freshness import Freshness
from pipelines.studio.files import LakeError, why, write_beside
from pipelines.studio.folder import StudioFolder
from pipelines.studio.lake import Lake
from pipelines.studio.stored import StoredTable
from schemas.catalog import TABLES
from schemas.choreography import USD_ANIMATION
from schemas.search import MOTION_INDEX


class EarlierTables:
    """What the lake held before; see :class:`assets.stamps.Earlier`."""

    def __init__(self, lake: Lake) -> None:
        self._lake = lake

    def table(self, asset: str, key: str) -> pa.Table | None:
        """Rows stored earlier; None when there are none or they cannot be read."""
        try:
            return self._lake.table(asset, key)
        except LakeError:
            return None

    def stamp(self, asset: str, key: str) -> Stamp | None:
        """Stamp stored earlier."""
        return self._lake.stamp(asset, key)


class LakeIOManager(dg.IOManager):
    """Stores :class:`~assets.stamps.Parts` or a table; loads a table, or a handle where one is annotated."""

    def __init__(self, lake: Lake, freshness: Freshness) -> None:
        self._lake, self._freshness = lake, freshness

    def handle_output(self, context: dg.OutputContext, obj: pa.Table | Part | Parts) -> None:
        """Store every part with its stamp, and tell Dagster what a person wants to see of it."""
        asset = context.asset_key.to_user_string()
        keys = [lake_key(k) for k in context.asset_partition_keys] if context.has_asset_partitions else [""]
        stored = {part.key: self._store(asset, part) for part in _parts(obj, keys)}
        missing = sorted(set(keys) - set(stored))
        if missing:
            raise LakeError(f"{asset}: want the partitions {', '.join(keys)}, {', '.join(missing)} did not come")
        for key, metadata in stored.items():
            if len(keys) == 1:
                context.add_output_metadata(metadata)
            else:
                context.step_context.add_asset_metadata(metadata, context.asset_key, dagster_key(key))

    def _store(self, asset: str, part: Part) -> dict[str, Any]:
        table = TABLES[asset].check(part.table)
        self._freshness.forget()
        inputs = self._freshness.inputs(asset, part.key) or {}
        if part.sources:
            inputs = inputs | {"sources": part.sources}
        stamp = Stamp(
            self._freshness.assets[asset].code_version_of(part.key),
            self._freshness.settings_version(asset, part.key),
            inputs,
            content_version(table),
            part.clips,
        )
        self._lake.write(asset, part.key, table, stamp)
        return {"dagster/row_count": table.num_rows, "content_version": stamp.content, **part.metadata}

    def load_input(self, context: dg.InputContext) -> pa.Table | StoredTable:
        """Load a table where the asset asks for one, else a handle on the stored partitions."""
        asset = context.asset_key.to_user_string()
        keys = [lake_key(k) for k in context.asset_partition_keys] if context.has_asset_partitions else [""]
        if context.dagster_type.typing_type is pa.Table:
            return StoredTable(self._lake, asset, keys).read(keys[0])
        # Of all partitions those that there are: one that could not be made stops no other.
        return StoredTable(self._lake, asset, [key for key in sorted(keys) if self._lake.stamp(asset, key) is not None])


def _parts(obj: pa.Table | Part | Parts, keys: Sequence[str]) -> Iterable[Part]:
    if isinstance(obj, Parts):
        return obj.each
    return [obj if isinstance(obj, Part) else Part(keys[0], obj)]


class IndexIOManager(LakeIOManager):
    """Stores an :class:`~assets.search.Index`: its vectors as they are searched, then its rows, which name them."""

    def __init__(self, studio: StudioFolder, freshness: Freshness) -> None:
        super().__init__(studio.lake, freshness)
        self._folder = studio.root / "lake" / MOTION_INDEX.name

    def handle_output(self, context: dg.OutputContext, obj: Any) -> None:  # noqa: ANN401 - an Index, narrower than the parent's
        """Write vectors, rows, and take away what the index before left."""
        if not isinstance(obj, Index):
            raise TypeError(f"motion_index: want an Index, got {type(obj).__name__}")
        try:
            said = motion_index.write_vectors(self._folder, obj.part.table, obj.vector, obj.track)
        except OSError as error:
            raise LakeError(f"{self._folder}: cannot be written: {why(error)}") from error
        table = MOTION_INDEX.with_metadata(obj.part.table, said)
        super().handle_output(
            context, dataclasses.replace(obj.part, table=table, metadata={**obj.part.metadata, **said})
        )
        motion_index.remove_others(self._folder, said)


class StageIOManager(LakeIOManager):
    """Writes a :class:`~assets.stage.Stage` as USD under ``dances/``, with a row in the lake that names it."""

    def __init__(self, studio: StudioFolder, freshness: Freshness) -> None:
        super().__init__(studio.lake, freshness)
        self._studio = studio

    def handle_output(self, context: dg.OutputContext, obj: Any) -> None:  # noqa: ANN401 - a Stage, narrower than the parent's
        """Write sound, stage, package and report, then the row."""
        if not isinstance(obj, Stage):
            raise TypeError(f"usd_animation: want a Stage, got {type(obj).__name__}")
        folder = self._studio.dances_of(obj.song_id)
        try:
            written = write_dance(folder, obj)
        except OSError as error:
            raise LakeError(f"{folder}: cannot be written: {why(error)}") from error
        rows = [
            {
                "song_id": obj.song_id,
                "method_name": obj.method,
                "stage_path": path.relative_to(self._studio.root).as_posix(),
                "stage_sha256": tree.sha256(path),
                "frame_count": obj.clip.n_frames,
                "frame_rate_hz": obj.clip.frame_rate_hz,
            }
            for path in written
        ]
        key = f"{obj.song_id}|{obj.method}"
        super().handle_output(context, Part(key, pack.from_rows(USD_ANIMATION, rows), obj.asked))


def write_dance(folder: Path, stage: Stage) -> list[Path]:
    """Write a dance: ``song.wav``, ``<method>.usdc``, ``<method>.usdz`` and ``<method>.json``; the stages' paths."""
    folder.mkdir(parents=True, exist_ok=True)
    sound, usdc, usdz = folder / "song.wav", folder / f"{stage.method}.usdc", folder / f"{stage.method}.usdz"
    audio.write_wav(sound, stage.sound)
    told: dict[str, Any] = {
        "audio": sound.name,
        "provenance": stage.provenance,
        "title": f"{stage.song_id}, {stage.method}",
        "lineage": stage.lineage,
    }
    if stage.cast is not None and stage.cast.rig is not None and stage.cast.copy is not None:
        usd_cast.write_cast_stage(usdc, stage.clip, stage.cast.rig, stage.cast.copy, **told)
    else:
        usd.write_stage(usdc, stage.clip, **told)
        shutil.rmtree(usd_cast.character_folder(usdc), ignore_errors=True)  # of a dance by somebody else
    usd_package.write_package(usdz, usdc)
    report = {
        "song": stage.song_id,
        "method": stage.method,
        "stage": usdc.name,
        "usdz": usdz.name,
        "frame_count": stage.clip.n_frames,
        "frame_rate_hz": stage.clip.frame_rate_hz,
        "quality": {name: measure["value"] for name, measure in stage.quality.items()},
        "wanted": {name: m for name, m in stage.quality.items() if m["wanted"]},
        "licence": stage.provenance["licence"],
        "provenance": stage.provenance,
    }
    text = json.dumps(report, indent=2, sort_keys=True, ensure_ascii=False) + "\n"
    write_beside(folder / f"{stage.method}.json", lambda file: file.write(text.encode()))
    return [usdc, usdz]
