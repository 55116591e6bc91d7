"""The stage contract: what every stage odori writes says and where.

Paths
-----
``/Dance`` (SkelRoot, default prim, kind component) holds ``Skeleton``,
``Skeleton/Animation``, ``Body`` (skinned mesh) and ``Song`` (SpatialAudio).
"""

from __future__ import annotations

ROOT_PATH = "/Dance"
SKELETON_PATH = "/Dance/Skeleton"
ANIMATION_PATH = "/Dance/Skeleton/Animation"
MESH_PATH = "/Dance/Body"
AUDIO_PATH = "/Dance/Song"

UP_AXIS = "Y"
METERS_PER_UNIT = 1.0
START_TIME_CODE = 0.0
DEFAULT_FRAME_RATE_HZ = 30.0

# Keys of the default prim's customData.
PROVENANCE_KEY = "odori"
