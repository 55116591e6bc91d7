"""Which stretches of clips show what is to be avoided."""

import numpy as np
import pyarrow as pa
import pytest

from assets.dancing.avoided import AvoidedSpan, fenced_spans, merged, touched
from schemas.keys import mirrored


@pytest.mark.parametrize(
    ("start_s", "end_s", "blend_s", "wanted"),
    [
        (1.0, 2.0, 0.0, False),
        (2.5, 3.5, 0.0, True),
        (3.2, 4.0, 0.0, True),  # the span's own end
        (3.3, 4.0, 0.0, False),
        (1.0, 2.9, 0.4, True),  # half a blend is shown after its end
        (3.3, 4.0, 0.4, True),  # and before its start
        (3.5, 4.0, 0.4, False),
    ],
)
def test_a_stretch_that_shows_a_span_touches_it(start_s, end_s, blend_s, wanted):
    span = AvoidedSpan("a", 3.0, 3.2)
    assert touched([span], ["a"], np.array([start_s]), np.array([end_s]), blend_s=blend_s).tolist() == [wanted]


def test_images_are_avoided_with_their_clips_and_other_clips_are_not():
    names, at = ["a", mirrored("a"), "b"], np.ones(3)
    assert touched([AvoidedSpan("a", 0.5, 1.5)], names, at, at + 1, blend_s=0.0).tolist() == [True, True, False]
    assert not touched([], names, at, at + 1, blend_s=0.0).any()
    assert touched([AvoidedSpan("a", 0.5, 1.5)], [], np.zeros(0), np.zeros(0), blend_s=0.0).shape == (0,)


def test_spans_that_overlap_are_one_and_all_are_in_order():
    spans = [AvoidedSpan("b", 1, 2), AvoidedSpan("a", 3, 4), AvoidedSpan("a", 1, 3), AvoidedSpan("a", 1.5, 2)]
    assert merged(spans) == (AvoidedSpan("a", 1, 4), AvoidedSpan("b", 1, 2))
    assert merged([]) == ()
    assert str(AvoidedSpan("a", 1, 2.256)) == "a from 1.00 to 2.26 s"


def test_what_is_fenced_is_avoided_with_the_way_to_the_frames_beside_it(stored_poses, in_memory):
    poses = stored_poses(10.0, a=np.zeros(30), b=np.zeros(30), c=np.zeros(30))
    rows = dict(poses.rows)
    for name, frames in (("a", [0, 1]), ("b", [12, 20, 21])):
        k = rows[name].schema.get_field_index("is_fenced")
        fenced = pa.array(np.isin(np.arange(30), frames))
        rows[name] = rows[name].set_column(k, rows[name].schema.field(k), fenced)
    found = fenced_spans(in_memory(rows), {"b", "a"})
    wanted = [("a", 0.0, 0.2), ("b", 1.1, 1.3), ("b", 1.9, 2.2)]
    assert [(span.clip_id, span.start_s, span.end_s) for span in found] == [
        (name, pytest.approx(start_s), pytest.approx(end_s)) for name, start_s, end_s in wanted
    ]
    assert fenced_spans(poses, {"a", "c"}) == []
