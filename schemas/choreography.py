"""Tables of dances: the choreography, its poses, where every frame comes from, how good it is."""

from __future__ import annotations

import pyarrow as pa

from schemas import fields as f
from schemas.table import Column, Table

CHOREOGRAPHY = Table(
    name="choreography",
    version=4,
    meaning="One step: an interval of the song danced with an interval of a clip.",
    key=("song_id", "method_name", "step_index"),
    columns=(
        f.SONG_ID,
        f.METHOD,
        Column("step_index", pa.int32(), "Step of the dance, from 0."),
        Column("song_start_s", pa.float64(), "Start in the song."),
        Column("song_end_s", pa.float64(), "End in the song."),
        f.CLIP_ID,
        Column("clip_start_s", pa.float64(), "Start in the clip."),
        Column("clip_end_s", pa.float64(), "End in the clip."),
        f.IS_MIRRORED,
        Column("has_seam", pa.bool_(), "Whether the step does not continue the one before in its clip."),
        Column("blend_s", pa.float32(), "Song time blended around the start; 0 without a seam."),
        f.WARP_RATIO,
        Column("pin_id", pa.string(), "The pin this step serves; null when none.", is_optional=True),
        Column("transition_cost", pa.float32(), "Cost of the seam before the step, by how the poses differ."),
        Column("stay_cost", pa.float32(), "Cost of the seam before the step coming soon after the one before it."),
        Column(
            "warp_cost",
            pa.float32(),
            "Cost of leaving the clip's own pace: (ln r / ln 1.1)² of the warp ratio r, more outside 0.90 to 1.10, by "
            "the weights of the method.",
        ),
        Column("match_cost", pa.float32(), "Cost of rhythm unlike the music's; 0 but on a match's first step."),
        Column("intensity_cost", pa.float32(), "Cost of intensity unlike the music's; 0 but on a match's first step."),
        Column("stride_cost", pa.float32(), "Cost of half- or double-time."),
        Column("beat_cost", pa.float32(), "Cost of music beats on which the body does not visibly stop."),
        Column("repetition_cost", pa.float32(), "Cost of showing again what was shown."),
        Column("diversity_cost", pa.float32(), "Cost of showing what the better dances of the song show."),
        Column("wish_cost", pa.float32(), "Cost of soft wishes that are not kept."),
        Column("state_index", pa.int32(), "Basic motion danced, by the model; -1 in other methods."),
        Column("model_cost", pa.float32(), "Minus log probability of the motion after the one before."),
        Column("music_cost", pa.float32(), "Minus log likelihood of the music heard during the motion."),
    ),
)

DANCE_POSE = Table(
    name="dance_pose",
    version=1,
    meaning="One frame of a dance on the canonical skeleton; schema metadata `joints` has the order.",
    key=("song_id", "method_name", "frame_index"),
    columns=(f.SONG_ID, f.METHOD, f.FRAME_INDEX, f.TIME_S, f.ROOT_XYZ_M, f.ROTATION_WXYZ, f.POSITION_XYZ_M),
)

FRAME_LINEAGE = Table(
    name="frame_lineage",
    version=2,
    meaning="Where one frame of a dance comes from.",
    key=("song_id", "method_name", "frame_index"),
    columns=(
        f.SONG_ID,
        f.METHOD,
        f.FRAME_INDEX,
        f.TIME_S,
        f.CLIP_ID,
        f.IS_MIRRORED,
        Column("clip_time_s", pa.float64(), "Time in the dominant clip."),
        Column("blend_clip_id", pa.string(), "Partner of the blend; null where unblended.", is_optional=True),
        Column("is_blend_mirrored", pa.bool_(), "Whether the partner is shown mirrored; false where unblended."),
        Column("blend_time_s", pa.float64(), "Time in the partner; null where unblended.", is_optional=True),
        Column("blend_weight_ratio", pa.float32(), "The partner's share, 0 to 0.5; 0 where unblended."),
        f.WARP_RATIO,
    ),
)

DANCE_QUALITY = Table(
    name="dance_quality",
    version=1,
    meaning="One measure of one dance.",
    key=("song_id", "method_name", "metric_name"),
    columns=(
        f.SONG_ID,
        f.METHOD,
        Column("metric_name", pa.string(), "What is measured; ends in its unit."),
        Column("value", pa.float64(), "The measure; null when it cannot be taken.", is_optional=True),
        Column("wanted", pa.string(), "What is wanted, in words; empty when only reported."),
        Column("is_passed", pa.bool_(), "Whether it is as wanted; null when only reported.", is_optional=True),
        Column("reasons", pa.list_(pa.string()), "Sentences on what is not as wanted: when, and of which clip."),
    ),
)

DECISIVE_MEASURES = ("one_frame_flip_count",)
"""Measures that decide whether a dance is as wanted: all of them must be."""

USD_ANIMATION = Table(
    name="usd_animation",
    version=1,
    meaning="One stage written for a dance.",
    key=("song_id", "method_name", "stage_path"),
    columns=(
        f.SONG_ID,
        f.METHOD,
        Column("stage_path", pa.string(), "File, relative to the studio."),
        Column("stage_sha256", pa.string(), "Hash of its bytes, hexadecimal."),
        Column("frame_count", pa.int32(), "Time codes in the animation."),
        Column("frame_rate_hz", pa.float64(), "Time codes a second."),
    ),
)
