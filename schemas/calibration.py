"""What was found of a suit and the body in it."""

from __future__ import annotations

import pyarrow as pa

from schemas import fields as f
from schemas.table import Column, Table

CONFIDENCES = ("high", "medium", "low", "axis-unobserved", "none")
CURVE = pa.list_(pa.float32())

CALIBRATION = Table(
    name="calibration",
    version=1,
    meaning="One joint of the body in one suit recording: where its two sensors have it, and how sure that is.",
    key=("clip_id", "joint_index"),
    columns=(
        f.CLIP_ID,
        Column("joint_index", pa.int32(), "Joint of the skeleton; the pelvis, 0, is no joint."),
        Column("joint_name", pa.string(), "The segment it moves: l_forearm is the left elbow."),
        Column("parent_name", pa.string(), "The segment it hangs from."),
        Column(
            "length_m", pa.float32(), "Bone from the parent's joint to this one; from between the hips for the pelvis."
        ),
        Column("offset_xyz_m", f.VECTOR, "Rest position in the parent's frame."),
        Column("sensor_xyz_m", f.VECTOR, "The segment's sensor in its bone's frame."),
        Column("sensor_wxyz", f.QUATERNION, "Turns vectors of the segment's sensor into its bone's frame."),
        Column("in_parent_sensor_xyz_m", f.VECTOR, "The joint in the frame of the parent's sensor."),
        Column("in_child_sensor_xyz_m", f.VECTOR, "The joint in the frame of its own sensor."),
        Column("residual_rms_m", pa.float32(), "Distance between the joint as either sensor has it, root mean square."),
        Column("residual_sigma_m", pa.float32(), "The same, robust standard deviation an axis."),
        Column("conditioning", pa.float32(), "Largest over smallest singular value of the joint's equations."),
        Column(
            "range_of_motion_rad", f.VECTOR, "How far it was moved about its directions, falling; the last decides."
        ),
        Column("rank", pa.int32(), "Directions of the joint's place that the motion shows, 0 to 3."),
        Column("confidence_label", pa.string(), "How far its place is to be trusted.", values=CONFIDENCES),
        Column("advice", pa.string(), "What the performer can do better; null: nothing.", is_optional=True),
        Column("noise_position_m", pa.float32(), "Noise of its own sensor's position, standard deviation an axis."),
        Column("noise_rotation_rad", pa.float32(), "Noise of its own sensor's rotation, standard deviation an axis."),
        Column("frame_count", pa.int32(), "Frames in which both its sensors were good."),
        Column("filled_ratio", pa.float32(), "Share of its sensor's frames that were missing or outliers, and filled."),
        Column("outlier_ratio", pa.float32(), "Share of its sensor's frames that were outliers."),
        Column(
            "gap_before_m",
            pa.float32(),
            "Gap at the joint with every bone carried by its own sensor, root mean square.",
        ),
        Column("gap_after_m", pa.float32(), "Gap at the joint in the stored poses, largest of all frames."),
        Column("gap_before_curve_m", CURVE, "Root mean square of the gap before, in equal spans of the clip."),
        Column("span_s", pa.float32(), "Length of one of those spans."),
        Column("gap_after_curve_m", CURVE, "Root mean square of the gap after, in the same spans."),
        Column("rest_start_frame_index", pa.int32(), "First frame of the rest pose that says what a bone's frame is."),
        Column("rest_end_frame_index", pa.int32(), "One past its last frame."),
    ),
)
