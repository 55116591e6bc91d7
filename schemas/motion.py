"""Tables of clips: the files, what is wrong with them, their skeletons and poses, their beats."""

from __future__ import annotations

import pyarrow as pa

from schemas import fields as f
from schemas.table import Column, Table

CLIP = Table(
    name="clip",
    version=5,
    meaning="One file of motion under clips/.",
    key=("clip_id", "path"),
    columns=(
        f.CLIP_ID,
        f.SESSION,
        f.PATH,
        f.SOURCE_SHA256,
        Column("frame_rate_hz", pa.float64(), "Frames a second, cleaned of rounding; 0 when refused."),
        Column("frame_count", pa.int32(), "Frames; 0 when refused."),
        f.DURATION_S,
        f.LABEL,
        f.IS_LABELLED,
        f.STYLE,
        Column("subject", pa.string(), "Who was recorded, from clips.csv; empty when not said."),
        f.LICENCE,
        Column("performed_to", pa.string(), "Song it was danced to, from clips.csv; empty when not said."),
        Column("performed_offset_s", pa.float64(), "Time of that song at the first frame, from clips.csv; else 0."),
        Column(
            "health", pa.string(), "What clips.csv says of its health; 'ok': it is not examined.", values=("ok", "")
        ),
        f.STATE,
        f.REASON,
        Column("danceability_ratio", pa.float32(), "Share of its frames that may be shown; 0 when refused."),
        Column("joint_count", pa.int32(), "Joints of the source rig; 0 when refused."),
        Column("metres_per_unit", pa.float64(), "Metres one unit of the file stands for, inferred from body height."),
        Column("up_axis", pa.string(), "Axis that points up in the file, inferred; empty when refused."),
        Column("root_offset_rule", pa.string(), "Whether root channels replace the root's OFFSET or add to it."),
        Column("naming_family", pa.string(), "Which table of joint names fitted, or 'topology'."),
        Column("source_format", pa.string(), "What kind of file it is.", values=("bvh", "suit", "")),
        Column("warnings", pa.list_(pa.string()), "What is doubtful about a clip that was read, one sentence each."),
    ),
)

QUIET_FAULT_KINDS = ("fast", "tpose", "trimmed")
"""Kinds of fault nobody has to look at: motion that is real, a calibration pose at an end, what the studio cut off."""

VERDICTS = ("mended", "fenced", "doubtful", "refused")

CLIP_FAULT = Table(
    name="clip_fault",
    version=1,
    meaning="One fault of one clip: what was found where, and what became of it.",
    key=("clip_id", "fault_index"),
    columns=(
        f.CLIP_ID,
        Column("fault_index", pa.int32(), "Fault of its clip, from 0, in order of time."),
        Column("fault_kind", pa.string(), "What is wrong; docs/clip-health.md explains each kind."),
        Column("joint_name", pa.string(), "Joint in the source file; empty for the whole body."),
        Column("start_s", pa.float64(), "Time of its first frame in the clip."),
        Column("end_s", pa.float64(), "Time of its last frame in the clip; that frame is at fault too."),
        Column(
            "verdict",
            pa.string(),
            "Mended: put right, and danced; fenced: never shown; doubtful: danced; refused: nothing of the clip is.",
            values=VERDICTS,
        ),
        f.REASON_OF_FAULT,
        Column("turn_start_s", pa.float64(), "Time of the first value of `turn_rad_per_s` in the clip."),
        Column(
            "turn_rad_per_s",
            pa.list_(pa.float32()),
            "How fast the joint turned around it, as recorded, a value a frame; of the whole body its fastest joint.",
        ),
    ),
)

SKELETON = Table(
    name="skeleton",
    version=1,
    meaning="One joint of one clip's source skeleton.",
    key=("clip_id", "joint_index"),
    columns=(
        f.CLIP_ID,
        Column("joint_index", pa.int32(), "Joint, from 0 at the root, parents first."),
        Column("joint_name", pa.string(), "Name in the source file."),
        Column("parent_index", pa.int32(), "Joint index of the parent; -1 for the root."),
        Column("offset_xyz_m", f.VECTOR, "Rest position in the parent's frame."),
        Column(
            "canonical_joint",
            pa.string(),
            "Canonical joints it drives, joined by commas; null: none.",
            is_optional=True,
        ),
    ),
)

POSE = Table(
    name="pose",
    version=2,
    meaning="One frame of one clip on its own skeleton, in metres, Y up.",
    key=("clip_id", "frame_index"),
    columns=(
        f.CLIP_ID,
        f.FRAME_INDEX,
        f.TIME_S,
        f.ROOT_XYZ_M,
        f.ROTATION_WXYZ,
        Column(
            "translation_xyz_m",
            f.VECTORS,
            "Local position of each joint where the rig moves its joints; null when they stay at their offsets.",
            is_optional=True,
        ),
        f.IS_FENCED,
    ),
)

CANONICAL_POSE = Table(
    name="canonical_pose",
    version=2,
    meaning="One frame of one clip on the canonical skeleton; schema metadata `joints` has the order.",
    key=("clip_id", "frame_index"),
    columns=(f.CLIP_ID, f.FRAME_INDEX, f.TIME_S, f.ROOT_XYZ_M, f.ROTATION_WXYZ, f.POSITION_XYZ_M, f.IS_FENCED),
)

MOTION_FEATURE = Table(
    name="motion_feature",
    version=2,
    meaning="What one clip does at one instant, 120 a second.",
    key=("clip_id", "frame_index"),
    columns=(
        f.CLIP_ID,
        f.FRAME_INDEX,
        f.TIME_S,
        f.RHYTHM,
        f.INTENSITY,
        Column(
            "weight_effort_rad_per_s",
            pa.float32(),
            "Speed at which the body's links turn, body-centred, weighted by length.",
        ),
        Column(
            "peak_effort_rad_per_s", pa.float32(), "Largest weight effort between two stops: intensity before scaling."
        ),
        Column("is_left_contact", pa.bool_(), "Whether the left foot stands on the floor."),
        Column("is_right_contact", pa.bool_(), "Whether the right foot stands on the floor."),
        f.IS_FENCED,
    ),
)

MOTION_BEAT = Table(
    name="motion_beat",
    version=2,
    meaning="One beat of one clip: a stop of the body at its pulse, or a turn of its largest movement.",
    key=("clip_id", "beat_index"),
    columns=(
        f.CLIP_ID,
        f.BEAT_INDEX,
        f.FRAME_INDEX,
        f.TIME_S,
        f.CONFIDENCE_RATIO,
        Column("interval_s", pa.float32(), "Mean beat interval of the clip; beats of a pulse may breathe about it."),
        Column(
            "component_share_ratio",
            pa.float32(),
            "Share of the clip's variance that the beat's component carries; 0 of a pulse, which has none.",
        ),
        Column("peak_share_ratio", pa.float32(), "Share of the beat curve's spectrum inside its peak; 0 of a pulse."),
    ),
)

MOTION_TURN = Table(
    name="motion_turn",
    version=1,
    meaning="One turn of a clip's largest movement, on an even grid: a dance may step there too, off the clip's pulse.",
    key=("clip_id", "turn_index"),
    columns=(
        f.CLIP_ID,
        Column("turn_index", pa.int32(), "Turn of its clip, from 0."),
        f.FRAME_INDEX,
        f.TIME_S,
        Column("interval_s", pa.float32(), "Interval of the clip's turns."),
    ),
)

MOTION_TEMPO = Table(
    name="motion_tempo",
    version=1,
    meaning="Tempo of one clip, or that its motion has no pulse.",
    key=("clip_id",),
    columns=(
        f.CLIP_ID,
        Column("tempo_bpm", pa.float32(), "Tempo of the clip's beats; null where it has no pulse.", is_optional=True),
        Column(
            "confidence_probability",
            pa.float32(),
            "That the tempo is the dancer's, up to an octave; of principal components their confidence.",
        ),
        Column("has_pulse", pa.bool_(), "Whether the clip has beats."),
        Column("slower_bpm", pa.float32(), "Half the tempo, where that is a level too; else null.", is_optional=True),
        Column("faster_bpm", pa.float32(), "Twice the tempo, where that is a level too; else null.", is_optional=True),
        Column(
            "level_probability",
            pa.float32(),
            "That this level is the one counted, and not the slower or the faster; 0 of principal components.",
        ),
        Column("tempo_spread_ratio", pa.float32(), "Standard deviation of the beat intervals over their mean."),
        Column("beat_count", pa.int32(), "Beats of the clip."),
    ),
)
