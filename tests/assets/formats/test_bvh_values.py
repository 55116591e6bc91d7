import numpy as np
import pytest

from assets.formats.bvh_values import parse_values
from assets.formats.errors import FormatError


def read(block, n_frames, n_channels):
    return parse_values(block, n_frames, n_channels, path="a.bvh", first_line=10)


def test_numbers_are_those_of_float_to_the_last_bit():
    rng = np.random.default_rng(0)
    numbers = rng.normal(size=600) * 10.0 ** rng.integers(-12, 13, 600)
    words = [
        f"{x:.{d}{f}}" for x, d, f in zip(numbers, rng.integers(0, 19, 600), rng.choice(list("efg"), 600), strict=True)
    ]
    words += ["-0", "+1.5", ".5", "5.", "-.25e-3", "1E+2", "007", "4.9e-324", "0.1", "179.999999999999999"]
    block = " ".join(words).encode()
    np.testing.assert_array_equal(
        read(b"\n" + block, 1, len(words))[0].view(np.int64), np.array([float(w) for w in words]).view(np.int64)
    )


@pytest.mark.parametrize(
    "block",
    [
        b"1 2 3\n4 5 6\n",
        b"1 2 3\n4 5 6",
        b"  1\t2  3 \n\n 4 5\t\t6\t\n\n\n",
        b"1 2\n3\n4 5\n6\n",
        b"1 2 3 4 5 6\n",
        b"1\n2\n3\n4\n5\n6\n",
        b"\n\n1 2 3\n\n4 5 6\n\x0c\n",
    ],
)
def test_lines_and_blanks_do_not_matter(block):
    np.testing.assert_array_equal(read(block, 2, 3), [[1, 2, 3], [4, 5, 6]])


@pytest.mark.parametrize(
    ("block", "line", "what"),
    [
        (b"1 2 3\n4 x 6\n", 11, "want a number, got 'x'"),
        (b"1 2 3\n4 5 6\nthe end\n", 12, "want a number, got 'the'"),
        (b"1 2 3\n4 5 1,5\n", 11, "write decimals with a point"),
        (b"1 2 3\n4 5 1_5\n", 11, "want a number"),
        (b"1 2 3\n4 5 6\x00\n", 11, "want a number"),
        (b"1 2 nan\n4 5 6\n", 10, "want finite numbers, got 'nan'"),
        (b"1 2 3\n4 -inf 6\n", 11, "want finite numbers, got '-inf'"),
        (b"1 2 3\n4 1e999 6\n", 11, "want finite numbers, got '1e999'"),
        (b"1 2 3\n4 -nan(ind) 6\n", 11, "want a number, got '-nan(ind)'"),
        (b"1 2 3\n\n4 1.#QNAN 6\n", 12, "want a number"),
        (b"1 2 3\n4 5\n", 11, "want 2 frames of 3 values, got 1 frames and 2 values; the file is cut short"),
        (b"1 2 3\n", 10, "want 2 frames of 3 values, got 1 frames; the file is cut short"),
        (b"", 10, "got none"),
        (b"\n \n", 10, "got none"),
        (b"1 2 3\n4 5 6\n7 8 9\n", 12, "got 3 frames"),
        (b"1 2 3 4\n5 6\n", 10, "want 3 values in a frame, got 4"),
        (b"1 2\n3 4 5 6\n", 10, "want 3 values in a frame, got 2"),
    ],
)
def test_refusals_name_the_line(block, line, what):
    with pytest.raises(FormatError) as caught:
        read(block, 2, 3)
    assert what in caught.value.what
    assert caught.value.line == line


def test_a_short_frame_among_many_is_found():
    rows = [b"1 2 3"] * 50
    rows[30] = b"1 2"
    with pytest.raises(FormatError, match="want 3 values in a frame, got 2") as caught:
        read(b"\n".join(rows), 50, 3)
    assert caught.value.line == 40


def test_many_sizes_against_the_plain_reader():
    rng = np.random.default_rng(1)
    for n_frames, n_channels in ((1, 1), (1, 200), (97, 3), (31, 32)):
        wanted = rng.normal(size=(n_frames, n_channels)).round(6)
        block = "\n".join(" ".join(map(repr, row)) for row in wanted.tolist()).encode()
        np.testing.assert_array_equal(read(block, n_frames, n_channels), wanted)
