"""One BVH file on the canonical skeleton, as USD, without a studio.

``python examples/retarget_one.py CLIP.bvh OUT.usdc``
"""

import sys
from pathlib import Path

from assets.formats import bvh, usd
from kernels.skeleton.canonical import CANONICAL
from kernels.skeleton.naming import map_joints
from kernels.skeleton.retarget import retarget
from kernels.types import Clip


def convert(source: Path, out: Path) -> Clip:
    """Read, retarget and write a clip; FormatError or ValueError says why where it cannot be done."""
    clip = bvh.to_clip(bvh.read(source)).clip
    motion = retarget(clip, map_joints(clip.skeleton))
    moved = Clip(CANONICAL, clip.frame_rate_hz, motion.root_xyz_m, motion.rotation_wxyz)
    usd.write_stage(out, moved, provenance={"source": source.name}, title=source.stem)
    return moved


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    done = convert(Path(sys.argv[1]), Path(sys.argv[2]))
    print(f"{sys.argv[2]}: {done.n_frames} frames at {done.frame_rate_hz:g} Hz, {len(done.skeleton.joints)} joints")
