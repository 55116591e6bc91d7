"""The stage contract: what every stage odori writes says and where.

Paths
-----
``/Dance`` (SkelRoot, default prim, kind component) holds ``Skeleton``, ``Skeleton/Animation``, ``Body`` (skinned mesh
with one GeomSubset a side), ``Looks`` (one material a side) and, where there is music, ``Song`` (SpatialAudio).
"""

from __future__ import annotations

ROOT_PATH = "/Dance"
SKELETON_PATH = "/Dance/Skeleton"
ANIMATION_PATH = "/Dance/Skeleton/Animation"
MESH_PATH = "/Dance/Body"
LOOKS_PATH = "/Dance/Looks"
AUDIO_PATH = "/Dance/Song"

# Materials and mesh subsets: the dancer's own sides.
SIDES: tuple[str, ...] = ("middle", "left", "right")

UP_AXIS = "Y"
METERS_PER_UNIT = 1.0
START_TIME_CODE = 0.0

# What is packed into a .usdz: the stage comes first, its music lies beside it.
PACKAGE_ALIGNMENT_BYTES = 64
PACKAGE_AUDIO_SUFFIX = ".wav"

# Key of the default prim's customData that holds the provenance.
PROVENANCE_KEY = "odori"

# Where each frame comes from: attributes of the animation, sampled at the time codes where their value changes. Names
# and texts are held from one sample to the next; numbers between samples lie on a line.
LINEAGE: dict[str, tuple[str, str]] = {
    "odori:clip": ("token", "Clip that the frame shows, the dominant one of a blend."),
    "odori:clipTime": ("float", "Seconds from that clip's first frame."),
    "odori:mirrored": ("bool", "Whether that clip is shown mirrored, left for right."),
    "odori:blendClip": ("token", "Partner of the blend; empty where unblended."),
    "odori:blendTime": ("float", "Seconds from the partner's first frame; 0 where unblended."),
    "odori:blendMirrored": ("bool", "Whether the partner is shown mirrored; false where unblended."),
    "odori:blendWeight": ("float", "The partner's share, 0 to 0.5; 0 where unblended."),
    "odori:warp": ("float", "Song time over clip time."),
    "odori:step": ("string", "The step of the choreography, as JSON: its place, pin and costs."),
}
