"""Which stretches of clips show what is to be avoided."""

import numpy as np
import pytest

from assets.dancing.avoided import AvoidedSpan, merged, touched
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
