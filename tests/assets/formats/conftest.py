"""A made-up dance and song for the tests of files."""

import wave

import numpy as np
import pytest

from kernels import rotation
from kernels.skeleton.canonical import CANONICAL
from kernels.types import Clip


@pytest.fixture(scope="session")
def swaying() -> Clip:
    """41 frames at 30 Hz in which every joint turns about all axes by its own amount and the hips travel."""
    time_s = np.arange(41) / 30
    rng = np.random.default_rng(7)
    size_rad, phase = rng.uniform(0.1, 0.7, (22, 3)), rng.uniform(0, 2 * np.pi, (22, 3))
    turn = size_rad * np.sin(2 * np.pi * time_s[:, None, None] + phase)
    root = np.stack([np.sin(time_s), 0.94 + 0.05 * np.cos(5 * time_s), 0.4 * time_s], -1)
    return Clip(CANONICAL, 30.0, root, rotation.continuous(rotation.exp(turn)))


@pytest.fixture
def song_wav(tmp_path):
    """Half a second of a tone, as song.wav."""
    path = tmp_path / "song.wav"
    with wave.open(str(path), "wb") as song:
        song.setnchannels(1)
        song.setsampwidth(2)
        song.setframerate(8000)
        song.writeframes((8000 * np.sin(np.arange(4000) / 6)).astype("<i2").tobytes())
    return path
