"""Tables of the model of a dancer: performances, motions and their kinds, what follows what and sounds with it."""

from __future__ import annotations

import pyarrow as pa

from schemas import fields as f
from schemas.table import Column, Table

STATE_INDEX = Column("state_index", pa.int32(), "Basic motion, from 0, the most frequent first; -1 for none.")
PARAMETERS = ("initial", "transition", "emission", "melody")

KEY_POSE = Table(
    name="key_pose",
    version=1,
    meaning="One motion of one clip, from braking over launching to braking: its three key poses, and its kind.",
    key=("clip_id", "motion_index"),
    columns=(
        f.CLIP_ID,
        Column("motion_index", pa.int32(), "Motion of its clip, from 0."),
        Column("start_s", pa.float64(), "First key pose: the body is slowest after braking."),
        Column("peak_s", pa.float64(), "Second key pose: the body launches hardest."),
        Column("end_s", pa.float64(), "Third key pose: the body is slowest again; the next motion starts."),
        STATE_INDEX,
        Column("distance_score", pa.float32(), "Distance from the basic motion's centroid, metres over all joints."),
    ),
)

PERFORMANCE = Table(
    name="performance",
    version=1,
    meaning="One clip that was danced to one song of the studio.",
    key=("clip_id",),
    columns=(
        f.CLIP_ID,
        f.SONG_ID,
        Column("offset_s", pa.float64(), "Time of the song at the clip's first frame."),
        Column("paired_by", pa.string(), "What says so.", values=("clips.csv", "name")),
    ),
)

BASIC_MOTION = Table(
    name="basic_motion",
    version=1,
    meaning="One kind of motion: a cluster of motions by their three key poses, a state of the model.",
    key=("state_index",),
    columns=(
        STATE_INDEX,
        f.CLIP_ID,
        Column("start_s", pa.float64(), "Start in `clip_id` of the motion nearest to the centroid."),
        Column("end_s", pa.float64(), "End of that motion."),
        Column("motion_count", pa.int32(), "Motions the kind was made from."),
        Column("reach_m", pa.float64(), "How far from the centroid 95 in 100 of them lie at most."),
        Column("pose_xyz_m", f.VECTORS, "The centroid: joints at start, peak and end, the start facing +Z."),
    ),
)

CHOREOGRAPHY_MODEL = Table(
    name="choreography_model",
    version=1,
    meaning="One probability of the model of the dancer.",
    key=("parameter_name", "state_index", "target_index"),
    columns=(
        Column("parameter_name", pa.string(), "Which of the model's tables it is in.", values=PARAMETERS),
        STATE_INDEX,
        Column(
            "target_index",
            pa.int32(),
            "Next state of a transition, percussion key of an emission, step of the melody (0 leap down to 4 leap up); "
            "-1 for initial.",
        ),
        Column("probability", pa.float64(), "Probability, linear; those of one state and parameter sum to 1."),
        f.CLIP_ID,
    ),
)

MUSIC_EVIDENCE = Table(
    name="music_evidence",
    version=1,
    meaning="What the music of one performance tells of its motions, measured on parts held out.",
    key=("clip_id",),
    columns=(
        f.CLIP_ID,
        f.SONG_ID,
        Column("motion_count", pa.int32(), "Motions predicted."),
        Column("hit_count", pa.int32(), "Drums heard during the performance."),
        Column(
            "music_log_probability", pa.float64(), "Mean log probability of a motion, given the last and the music."
        ),
        Column("bigram_log_probability", pa.float64(), "The same without music."),
        Column("shuffled_log_probability", pa.float64(), "The same with music shuffled."),
        Column(
            "chance_probability",
            pa.float64(),
            "Share of shuffles that predict as well, over all performances; the same in every row.",
        ),
    ),
)
