"""What is danced when: the methods, each writing the same table."""

import dagster as dg
import pyarrow as pa

from assets.dancing.asked import direction_of
from assets.dancing.method import DanceOrder
from assets.dancing.methods import METHODS, check_order
from assets.dancing.without_flips import SEEN_SETTINGS, choose_without_flips
from assets.declare import refusals_fail, shown, table_asset
from assets.partitions import DANCE, EVERY, SESSION_TABLES, lake_key
from assets.sources.sources import Studio, request_of, request_version
from assets.stamps import Part, Progress, Stored
from assets.tables.choreography import from_choreography
from assets.tables.music import to_music_beat
from schemas.choreography import CHOREOGRAPHY
from schemas.keys import base_method

_INPUTS = tuple(dict.fromkeys(name for method in METHODS.values() for name in method.inputs))


@table_asset(
    CHOREOGRAPHY,
    group="dance",
    code_version="5",
    settings=" ".join(dict.fromkeys([*SEEN_SETTINGS, *(s for method in METHODS.values() for s in method.settings)])),
    sources="request",
    partitions=DANCE,
    ins={name: dg.AssetIn(partition_mapping=EVERY if name in SESSION_TABLES else None) for name in _INPUTS},
    methods=METHODS,
)
def choreography(
    context: dg.AssetExecutionContext,
    music_beat: pa.Table,
    song: pa.Table,
    studio: dg.ResourceParam[Studio],
    progress: dg.ResourceParam[Progress],
    **inputs: Stored,
) -> Part:
    """Choose what is danced when, by the method of the partition."""
    progress.begin("choosing the steps", 1)
    key = lake_key(context.partition_key)
    song_id, way = key.split("|")
    method = METHODS[base_method(way)]
    beats = to_music_beat(music_beat)
    if len(beats.time_s) < 2:
        reason = "; ".join(filter(None, song["reason"].to_pylist())) or "it has no beats"
        raise dg.Failure(f"{song_id}: cannot be danced: {reason}", allow_retries=False)
    duration_s = float(max(song["duration_s"].to_pylist()))
    request = request_of(studio, key)
    with refusals_fail():
        asked = direction_of(studio, key)
        check_order(method, song_id, asked)
        order = DanceOrder(song_id, beats, duration_s, studio.settings(), asked, request.temperature, request.seed)
        danced = choose_without_flips(method, inputs, order, frame_rate_hz=request.frame_rate_hz)
    progress.step()
    rows = from_choreography(song_id, way, danced.steps, danced.costs, danced.pin_ids, danced.states)
    return Part(key, rows, request_version(studio, key), metadata=shown(danced.metadata))
