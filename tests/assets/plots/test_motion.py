"""Sessions are shown with every clip."""

import base64
import re

from assets.plots.motion import session_beats
from assets.tables import pack
from assets.tables.motion import from_motion_beat
from kernels.motion.motion_beats import motion_beats
from kernels.synthetic.dancer import place, take
from schemas.motion import CLIP, MOTION_BEAT

PNG = b"\x89PNG\r\n\x1a\n"


def png_of(markdown):
    return base64.b64decode(re.search(r"data:image/png;base64,([A-Za-z0-9+/=]+)\)", markdown)[1])


def test_session_shows_every_clip_refused_ones_with_their_reason():
    nothing = dict.fromkeys(CLIP.arrow.names, "") | {
        "frame_rate_hz": 30.0,
        "frame_count": 100,
        "duration_s": 8.0,
        "joint_count": 22,
        "is_labelled": False,
        "health": "",
        "danceability_ratio": 1.0,
        "performed_offset_s": 0.0,
        "metres_per_unit": 1.0,
        "reason": None,
    }
    rows = [
        nothing | {"clip_id": "s-a", "path": "clips/s/a.bvh", "label": "step", "state": "read"},
        nothing | {"clip_id": "s-b", "path": "clips/s/b.bvh", "state": "refused", "reason": "want | less"},
    ]
    beats = from_motion_beat("s-a", motion_beats(place(take("step")), 30.0), 30.0)
    shown = session_beats(beats, pack.from_rows(CLIP, rows))
    assert png_of(shown).startswith(PNG)
    assert "| s-a | step |" in shown
    assert "want \\| less" in shown
    assert "| 120 |" in shown


def test_session_without_clips_is_a_table_without_a_picture():
    assert "base64" not in session_beats(MOTION_BEAT.empty(), CLIP.empty())
