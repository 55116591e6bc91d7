"""Windows of long clips."""

import numpy as np
import pytest

from kernels.search.windows import windows


@pytest.mark.parametrize("duration_s", [0.0, 0.5, 8.0])
def test_a_short_clip_is_one_window(duration_s):
    np.testing.assert_array_equal(windows(duration_s), [[0.0, duration_s]])


@pytest.mark.parametrize("duration_s", [8.01, 9.0, 63.4])
def test_a_long_clip_is_covered_to_its_end_by_windows_that_overlap_by_half_or_more(duration_s):
    found = windows(duration_s)
    assert found[0, 0] == 0
    assert found[-1, 1] == pytest.approx(duration_s)
    np.testing.assert_allclose(found[:, 1] - found[:, 0], 4.0)
    assert np.diff(found[:, 0]).max() <= 2.0 + 1e-9


@pytest.mark.parametrize("wrong", [{"duration_s": -1}, {"duration_s": 1, "window_s": 0}])
def test_wrong_lengths_are_refused(wrong):
    with pytest.raises(ValueError, match="windows: want"):
        windows(**wrong)


def test_a_window_longer_than_a_whole_clip_is_refused():
    with pytest.raises(ValueError, match="longest_whole_s"):
        windows(1.0, window_s=8.0, longest_whole_s=6.0)
