"""Songs as sound: decoding through libsndfile, and the WAV we hand on."""

import io
import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import soundfile
from numpy.typing import NDArray

from assets.formats.errors import FormatError


@dataclass(frozen=True, eq=False)
class Audio:
    """Decoded sound; time counts from the first sample.

    Parameters
    ----------
    samples : (n, C) float32, full scale -1 to 1
    sample_rate_hz : int, > 0
    """

    samples: NDArray[np.float32]
    sample_rate_hz: int

    @property
    def duration_s(self) -> float:
        """Seconds."""
        return len(self.samples) / self.sample_rate_hz


def read(path: Path) -> Audio:
    """Decode a file of music.

    Parameters
    ----------
    path : wav, flac, ogg, mp3 …: whatever libsndfile decodes

    Returns
    -------
    Audio

    Raises
    ------
    FormatError
        If the file cannot be decoded or holds no samples.
    """
    try:
        samples, rate = soundfile.read(str(path), dtype="float32", always_2d=True)
    except (soundfile.LibsndfileError, OSError) as error:
        raise FormatError(str(path), 0, f"want audio that libsndfile decodes, got: {error}") from error
    if not len(samples):
        raise FormatError(str(path), 0, "want at least one sample, got none")
    return Audio(samples, int(rate))


def format_wav(audio: Audio) -> bytes:
    """Write 16-bit PCM WAV: the same bytes for the same samples."""
    pcm = np.clip(np.rint(audio.samples * 32767.0), -32768, 32767).astype("<i2")
    n_channels = audio.samples.shape[1]
    body = pcm.tobytes()
    out = io.BytesIO()
    out.write(b"RIFF" + struct.pack("<I", 36 + len(body)) + b"WAVEfmt ")
    out.write(
        struct.pack(
            "<IHHIIHH",
            16,
            1,
            n_channels,
            audio.sample_rate_hz,
            audio.sample_rate_hz * n_channels * 2,
            n_channels * 2,
            16,
        )
    )
    out.write(b"data" + struct.pack("<I", len(body)) + body)
    return out.getvalue()
