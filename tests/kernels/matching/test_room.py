import numpy as np

from kernels.matching.room import Room


def test_memory_is_used_again():
    room = Room()
    first = room.array("a", (3, 4), np.float32)
    assert first.shape == (3, 4)
    assert first.flags.c_contiguous
    first[:] = 5
    again = room.array("a", (2, 5), np.float32)
    assert np.shares_memory(first, again)
    assert again.shape == (2, 5)
    assert not np.shares_memory(first, room.array("b", (3, 4), np.float32))


def test_it_grows():
    room = Room()
    assert room.array("a", (0, 7), np.int64).shape == (0, 7)
    assert room.array("a", (4,), np.int64).size == 4
    assert room.array("a", (9, 9), np.int64).dtype == np.int64
