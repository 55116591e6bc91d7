"""Songs as sound: decoding through libsndfile, and the plain WAV we hand on.

Conventions
-----------
Time counts from the first decoded sample. MP3 is decoded without gaps: libsndfile drops the silence that encoders put
before the first sample, where the file tells its length.
"""

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
import soundfile
from numpy.typing import NDArray

from assets.formats.beside import written_beside
from assets.formats.errors import FormatError

LONGEST_S = 1800.0
MOST_VALUES = 2**28
"""Seconds of a song, and its samples over all channels: 1 GiB of float32. Chosen by hand."""

SLOWEST_HZ, FASTEST_HZ = 4000, 768_000
"""Chosen by hand: half of what telephones have, and four times the fastest in use."""

BLOCK_FRAMES = 1 << 18
"""Decoded at a time. Chosen for memory, by hand."""

UNSTATED = (0, 0xFFFFFFFF)
"""Sizes that a RIFF header has, by convention, when its writer did not know them."""

LARGEST_OGG_PAGE = 65_307
"""Bytes, by definition: a header of 27, 255 lengths, and 255 pieces of 255."""

SUFFIXES = {
    "WAV": {".wav", ".wave"},
    "WAVEX": {".wav", ".wave"},
    "RF64": {".wav", ".rf64"},
    "FLAC": {".flac"},
    "OGG": {".ogg", ".oga", ".opus"},
    "MP3": {".mp3"},
    "AIFF": {".aif", ".aiff", ".aifc"},
}

STRANGERS = (
    (0, b"MThd", "MIDI"),
    (4, b"ftyp", "MPEG-4 (m4a)"),
    (0, b"\x30\x26\xb2\x75", "Windows Media"),
    (0, b"\x1aE\xdf\xa3", "Matroska or WebM"),
    (0, b"\xff\xf1", "raw AAC"),
    (0, b"PK\x03\x04", "a ZIP archive"),
    (0, b"\x89PNG", "a PNG picture"),
)
"""First bytes of files that are no audio odori reads, and where they stand: by definition of those formats."""


@dataclass(frozen=True)
class AudioHeader:
    """What a file says of itself, without decoding.

    Parameters
    ----------
    n_frames : int, >= 0
        Samples a channel; an estimate for MP3 files that do not tell their length.
    n_channels : int, >= 1
    sample_rate_hz : int, > 0
    format_name : container and encoding, such as ``OGG/VORBIS``
    remark : one sentence where the file's name says another format, else empty
    """

    n_frames: int
    n_channels: int
    sample_rate_hz: int
    format_name: str
    remark: str

    @property
    def duration_s(self) -> float:
        """Seconds."""
        return self.n_frames / self.sample_rate_hz


@dataclass(frozen=True, eq=False)
class Audio:
    """Decoded sound.

    Parameters
    ----------
    samples : (n, C) float32, full scale -1 to 1, n >= 1, C >= 1
    sample_rate_hz : int, > 0
    format_name : container and encoding of the file it came from
    remark : what a person should know of the file, else empty

    Raises
    ------
    ValueError
        If the shape or the rate does not fit or a sample is not finite.
    """

    samples: NDArray[np.float32]
    sample_rate_hz: int
    format_name: str = ""
    remark: str = ""

    def __post_init__(self) -> None:
        if self.samples.ndim != 2 or self.samples.shape[1] < 1 or self.samples.shape[0] < 1:
            raise ValueError(f"samples: want (n, C) with n >= 1 and C >= 1, got {self.samples.shape}")
        if self.sample_rate_hz <= 0:
            raise ValueError(f"sample_rate_hz: want > 0, got {self.sample_rate_hz}")
        if not np.isfinite(self.samples).all():
            raise ValueError("samples: not finite; refuse or mend the song where it is read")

    @property
    def duration_s(self) -> float:
        """Seconds."""
        return len(self.samples) / self.sample_rate_hz


def read(path: Path, *, limit_s: float = LONGEST_S) -> Audio:
    """Decode a file of music.

    Parameters
    ----------
    path : wav, flac, ogg, opus, mp3, aiff …: whatever libsndfile decodes
        The content decides, not the suffix; where they disagree ``remark`` says so.
    limit_s : float, seconds, > 0
        Longest song accepted. A longer one than :data:`LONGEST_S` lets as many more values in.

    Returns
    -------
    Audio

    Raises
    ------
    FormatError
        If the file cannot be opened, is no audio that libsndfile knows, holds no samples, holds NaN or infinity, has a
        rate outside 4 to 768 kHz, is too long, or ends before the length it states.

    Notes
    -----
    A file that ends before its stated length (WAV, AIFF, FLAC, MP3 with a length tag) or within a page (Ogg, RFC 3533)
    is refused: it is a copy broken off or still going on. Files that state no length (streamed WAV, MP3 without a tag)
    are decoded to where they end, so a cut there cannot be told, nor one of Ogg between two pages.
    """
    with _opened(path) as sound:
        header = _header(sound, path)
        most = int(limit_s * header.sample_rate_hz)
        most_values = int(MOST_VALUES * max(limit_s / LONGEST_S, 1.0))
        if header.n_frames > most or header.n_frames * header.n_channels > most_values:
            raise _too_long(path, header, header.n_frames, limit_s, most_values)
        stated = _stated_frames(sound, path, header)
        if header.format_name.startswith("OGG") and _is_within_page(path):
            raise FormatError(
                str(path), 0, "want whole Ogg pages, got a file that ends within one: cut short; copy it again"
            )
        blocks: list[NDArray[np.float32]] = []
        n_frames = 0
        while n_frames <= most:
            try:
                block = sound.read(BLOCK_FRAMES, dtype="float32", always_2d=True)
            except soundfile.LibsndfileError as error:
                at_s = n_frames / header.sample_rate_hz
                raise FormatError(
                    str(path),
                    0,
                    f"want {header.format_name} that decodes, broken after {at_s:.1f} s: {error}; copy again",
                ) from error
            if not len(block):
                break
            blocks.append(block)
            n_frames += len(block)
    if n_frames > most:
        raise _too_long(path, header, n_frames, limit_s, most_values)
    if n_frames == 0:
        raise FormatError(str(path), 0, "want at least one sample, got none; export the song again")
    if stated - n_frames > header.sample_rate_hz // 10:
        raise FormatError(
            str(path),
            0,
            f"want the {stated / header.sample_rate_hz:.1f} s that its header states, "
            f"got {n_frames / header.sample_rate_hz:.1f} s: cut short; copy it again or save it anew",
        )
    samples = np.concatenate(blocks)
    bad = np.flatnonzero(~np.isfinite(samples).all(axis=1))
    if len(bad):
        at_s = bad[0] / header.sample_rate_hz
        raise FormatError(str(path), 0, f"want finite samples, got {len(bad)} that are not, first at {at_s:.3f} s")
    return Audio(samples, header.sample_rate_hz, header.format_name, header.remark)


def format_wav(audio: Audio) -> bytes:
    """Write 16-bit PCM WAV: the same bytes for the same samples.

    Parameters
    ----------
    audio : Audio
        Where a sample lies beyond full scale (decoded MP3s often do) the whole song is turned down until none does;
        16-bit samples that were decoded come back unchanged.

    Returns
    -------
    bytes
        A 44-byte header (68 for more than two channels) and the samples.

    Raises
    ------
    ValueError
        If the file would exceed 4 GiB.
    """
    n_channels, rate = audio.samples.shape[1], audio.sample_rate_hz
    if audio.samples.size * 2 > 0xFFFFFF00:
        raise ValueError(f"samples: want at most 4 GiB of WAV, got {audio.samples.size * 2} bytes")
    peak = max(float(audio.samples.max()), -float(audio.samples.min()), 1.0)
    body: bytes = np.clip(np.rint(audio.samples * (32768.0 / peak)), -32768, 32767).astype("<i2").tobytes()
    form = struct.pack("<HHIIHH", 1, n_channels, rate, rate * n_channels * 2, n_channels * 2, 16)
    if n_channels > 2:
        pcm_guid = bytes.fromhex("0100000000001000800000aa00389b71")
        form = struct.pack("<H", 0xFFFE) + form[2:] + struct.pack("<HHI", 22, 16, 0) + pcm_guid
    chunks = b"WAVEfmt " + struct.pack("<I", len(form)) + form + b"data" + struct.pack("<I", len(body))
    return b"RIFF" + struct.pack("<I", len(chunks) + len(body)) + chunks + body


def write_wav(path: Path, audio: Audio) -> None:
    """Write :func:`format_wav` beside ``path``, then rename: the file is whole or not there.

    Parameters
    ----------
    path : Path; folders are made
    audio : Audio

    Raises
    ------
    OSError
        If it cannot be written; what stood at ``path`` before still stands.
    """
    with written_beside(path) as partial:
        partial.write_bytes(format_wav(audio))


@contextmanager
def _opened(path: Path) -> Iterator[soundfile.SoundFile]:
    """Open through a file object, so that names in any script and suffixes of any kind work."""
    try:
        with path.open("rb") as file:
            start = file.read(16)
            file.seek(0)
            if not start:
                raise FormatError(str(path), 0, "want audio, got an empty file; copy it again")
            try:
                sound = soundfile.SoundFile(file)
            except (soundfile.LibsndfileError, TypeError) as error:
                reason = getattr(error, "error_string", "") or str(error)
                kind = next((name for at, magic, name in STRANGERS if start[at:].startswith(magic)), "")
                got = f"{kind}" if kind else f"{start[:8]!r} ({reason.strip().rstrip('.')})"
                raise FormatError(
                    str(path), 0, f"want WAV, FLAC, Ogg, Opus, MP3 or AIFF, got {got}; convert the song"
                ) from error
            with sound:
                yield sound
    except OSError as error:
        raise FormatError(str(path), 0, f"want a readable file, got: {error.strerror or error}") from error


def _header(sound: soundfile.SoundFile, path: Path) -> AudioHeader:
    rate = int(sound.samplerate)
    if not SLOWEST_HZ <= rate <= FASTEST_HZ:
        raise FormatError(str(path), 0, f"want {SLOWEST_HZ} to {FASTEST_HZ} samples a second, got {rate}")
    name = f"{sound.format}/{sound.subtype}"
    suffix = path.suffix.lower()
    wanted = SUFFIXES.get(sound.format)
    fits = suffix in wanted if wanted else suffix not in set().union(*SUFFIXES.values())
    remark = "" if fits else f"named {suffix or 'without suffix'} but holds {name}; read as what it holds"
    return AudioHeader(int(sound.frames), int(sound.channels), rate, name, remark)


def _stated_frames(sound: soundfile.SoundFile, path: Path, header: AudioHeader) -> int:
    """Read how many samples a channel the file itself promises; 0 where it promises nothing."""
    if header.format_name.startswith("FLAC"):
        return header.n_frames
    with path.open("rb") as file:
        if header.format_name.startswith("MP3"):
            start = file.read(4096)
            if start[:3] == b"ID3" and len(start) >= 10:
                size = start[6] << 21 | start[7] << 14 | start[8] << 7 | start[9]
                file.seek(10 + size)
                start = file.read(4096)
            return header.n_frames if b"Xing" in start or b"Info" in start else 0
        if header.format_name.startswith(("WAV", "AIFF")):
            promised, left = _data_chunk(file)
            if promised not in UNSTATED and promised > left > 0:
                return header.n_frames * promised // left
    return 0


def _data_chunk(file: BinaryIO) -> tuple[int, int]:
    """Bytes that the sample chunk of a RIFF or AIFF file states, and that the file has from its start on."""
    order = {b"RIFF": "<I", b"FORM": ">I"}.get(file.read(4), "")
    end = file.seek(0, 2)
    at = 12
    while order and at + 8 <= end:
        file.seek(at)
        head = file.read(8)
        size = int(struct.unpack(order, head[4:])[0])
        if head[:4] in (b"data", b"SSND"):
            return size, end - at - 8
        at += 8 + size + (size & 1)
    return 0, 0


def _is_within_page(path: Path) -> bool:
    """Whether an Ogg file ends before its last page does (RFC 3533, section 6)."""
    with path.open("rb") as file:
        file.seek(max(0, file.seek(0, 2) - 2 * LARGEST_OGG_PAGE))
        end = file.read()
    at = end.rfind(b"OggS")
    if at < 0 or at + 27 > len(end):
        return at >= 0
    sizes = end[at + 27 : at + 27 + end[at + 26]]
    return len(end) < at + 27 + end[at + 26] + sum(sizes)


def _too_long(path: Path, header: AudioHeader, n_frames: int, limit_s: float, most_values: int) -> FormatError:
    return FormatError(
        str(path),
        0,
        f"want at most {limit_s:g} s and {most_values} values, got {n_frames / header.sample_rate_hz:.0f} s of "
        f"{header.n_channels} channels at {header.sample_rate_hz} Hz; cut the song shorter, or raise longest_song_s",
    )
