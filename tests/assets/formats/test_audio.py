"""Decoding of songs, and everything that may be wrong with a file."""

import struct

import numpy as np
import pytest
import soundfile

from assets.formats import audio
from assets.formats.audio import Audio
from assets.formats.errors import FormatError

RATE = 22050


@pytest.fixture
def tone():
    """Two seconds of stereo, the channels told apart."""
    t = np.arange(2 * RATE) / RATE
    return np.stack([0.5 * np.sin(2 * np.pi * 440 * t), 0.25 * np.sin(2 * np.pi * 660 * t)], axis=1).astype(np.float32)


def write(path, samples, rate=RATE, **how):
    soundfile.write(path, samples, rate, **how)
    return path


def test_pcm_comes_back_to_the_last_bit(tmp_path, tone):
    pcm = (tone * 32767).astype(np.int16)
    sound = audio.read(write(tmp_path / "a.wav", pcm))
    assert sound.sample_rate_hz == RATE
    assert sound.samples.dtype == np.float32
    assert sound.duration_s == 2.0
    np.testing.assert_array_equal(sound.samples * 32768, pcm)
    assert audio.format_wav(sound)[44:] == pcm.tobytes()


@pytest.mark.parametrize(
    ("name", "how"),
    [("a.flac", {}), ("a.ogg", {"format": "OGG", "subtype": "VORBIS"}), ("a.mp3", {"format": "MP3"}), ("a.aiff", {})],
)
def test_each_format_has_the_same_length_and_start(tmp_path, tone, name, how):
    """Lossy ones too: an MP3 that starts late would put every beat late."""
    sound = audio.read(write(tmp_path / name, tone, **how))
    assert sound.samples.shape == tone.shape
    lags = np.arange(-100, 101)
    inner = tone[500:20000, 0]
    match = [float((inner * sound.samples[500 + lag : 20000 + lag, 0]).sum()) for lag in lags]
    assert lags[int(np.argmax(match))] == 0


@pytest.mark.parametrize("rate", [8000, 11025, 32000, 48000, 96000, 192000])
@pytest.mark.parametrize("n_channels", [1, 6])
def test_odd_rates_and_channels(tmp_path, rate, n_channels):
    samples = np.tile(np.linspace(-0.5, 0.5, 1000, dtype=np.float32)[:, None], (1, n_channels))
    sound = audio.read(write(tmp_path / "a.wav", samples, rate))
    assert sound.samples.shape == (1000, n_channels)
    assert sound.sample_rate_hz == rate


def test_one_sample(tmp_path):
    assert audio.read(write(tmp_path / "a.wav", np.array([[0.5]]))).samples.tolist() == [[0.5]]


def test_header_agrees_with_what_is_decoded(tmp_path, tone):
    sound = audio.read(write(tmp_path / "a.flac", tone))
    assert (*sound.samples.shape, sound.sample_rate_hz) == (2 * RATE, 2, RATE)
    assert sound.format_name == "FLAC/PCM_16"
    assert sound.duration_s == 2.0
    assert sound.remark == ""


def test_content_decides_and_the_remark_says_so(tmp_path, tone):
    write(tmp_path / "a.flac", tone)
    wrong = (tmp_path / "a.flac").rename(tmp_path / "a.mp3")
    sound = audio.read(wrong)
    np.testing.assert_allclose(sound.samples, tone, atol=2**-15)
    assert "named .mp3 but holds FLAC" in sound.remark


def test_names_in_any_script(tmp_path, tone):
    assert audio.read(write(tmp_path / "踊り 'a\" b.wav", tone)).samples.shape == tone.shape


def refusal(path, **how):
    with pytest.raises(FormatError) as caught:
        audio.read(path, **how)
    assert caught.value.path == str(path)
    return caught.value.what


def test_empty_and_foreign_files_are_refused(tmp_path):
    for name, content, said in [
        ("a.wav", b"", "empty file"),
        ("b.wav", b"hello world\n" * 50, "Format not recognised"),
        ("c.mp3", bytes(4000), "want WAV"),
        ("d.mp3", b"\x00\x00\x00\x20ftypM4A " + bytes(400), "MPEG-4"),
        ("e.wav", b"MThd\x00\x00\x00\x06\x00\x00\x00\x01\x00\x60", "MIDI"),
        ("f.raw", b"no suffix is trusted", "want WAV"),
    ]:
        path = tmp_path / name
        path.write_bytes(content)
        assert said in refusal(path), name


def test_missing_file_and_folder_are_refused(tmp_path):
    assert "No such file" in refusal(tmp_path / "none.wav")
    assert "readable file" in refusal(tmp_path)


def test_no_samples(tmp_path):
    assert "at least one sample" in refusal(write(tmp_path / "a.wav", np.zeros((0, 2))))


@pytest.mark.parametrize("name", ["a.wav", "a.aiff", "a.flac", "a.mp3"])
def test_file_cut_short_is_refused(tmp_path, tone, name):
    path = write(tmp_path / name, tone)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    what = refusal(path)
    assert "cut short" in what or "broken after" in what


def test_ogg_cut_within_a_page_is_refused_and_between_pages_decoded_to_its_end(tmp_path):
    noise = np.random.default_rng(0).uniform(-0.5, 0.5, (10 * RATE, 1))
    path = write(tmp_path / "a.ogg", noise, format="OGG", subtype="VORBIS")
    data = path.read_bytes()
    page = data.index(b"OggS", len(data) // 2)
    for end in (page - 1, page + 4, page + 27, page + 100):
        path.write_bytes(data[:end])
        assert "ends within one: cut short" in refusal(path)
    path.write_bytes(data[:page])
    assert 2.0 < audio.read(path).duration_s < 8.0


def test_streamed_wav_states_no_length_and_is_decoded_to_its_end(tmp_path, tone):
    path = write(tmp_path / "a.wav", tone)
    data = bytearray(path.read_bytes())
    at = data.index(b"data")
    data[at + 4 : at + 8] = b"\xff\xff\xff\xff"
    path.write_bytes(data)
    assert audio.read(path).samples.shape == tone.shape


def test_not_a_number_is_refused_with_its_time(tmp_path, tone):
    tone[11025] = np.nan
    assert "first at 0.500 s" in refusal(write(tmp_path / "a.wav", tone, subtype="FLOAT"))


def test_too_long_is_refused(tmp_path, tone):
    path = write(tmp_path / "a.wav", tone)
    assert "at most 1.5 s" in refusal(path, limit_s=1.5)
    assert audio.read(path, limit_s=2.0).duration_s == 2.0


def test_unheard_of_rate_is_refused(tmp_path, tone):
    assert "1000" in refusal(write(tmp_path / "a.wav", tone, 1000))


def test_wav_header_by_hand():
    data = audio.format_wav(Audio(np.array([[0.5, -1.0], [1.0, 0.0]], np.float32), 48000))
    assert data[:4] == b"RIFF"
    assert struct.unpack("<I", data[4:8])[0] == len(data) - 8
    assert data[8:16] == b"WAVEfmt "
    assert struct.unpack("<IHHIIHH", data[16:36]) == (16, 1, 2, 48000, 192000, 4, 16)
    assert data[36:40] == b"data"
    assert struct.unpack("<I4h", data[40:]) == (8, 16384, -32768, 32767, 0)


def test_written_wav_reads_back(tmp_path, tone):
    for n_channels in (1, 2, 6):
        samples = np.tile(tone[:, :1], (1, n_channels))
        audio.write_wav(tmp_path / "a.wav", Audio(samples, RATE))
        np.testing.assert_allclose(audio.read(tmp_path / "a.wav").samples, samples, atol=2**-16)
    assert [path.name for path in tmp_path.iterdir()] == ["a.wav"]


def test_a_song_beyond_full_scale_is_turned_down_whole(tmp_path):
    samples = np.array([[3.0], [1.5], [-3.0], [0.0]], np.float32)
    audio.write_wav(tmp_path / "a.wav", Audio(samples, RATE))
    np.testing.assert_allclose(audio.read(tmp_path / "a.wav").samples, samples / 3.0, atol=2**-14)


@pytest.mark.parametrize(
    ("samples", "rate", "said"),
    [
        (np.zeros((0, 1), np.float32), RATE, "samples"),
        (np.zeros(5, np.float32), RATE, "samples"),
        (np.zeros((5, 1), np.float32), 0, "sample_rate_hz"),
        (np.full((5, 1), np.inf, np.float32), RATE, "finite"),
    ],
)
def test_record_refuses(samples, rate, said):
    with pytest.raises(ValueError, match=said):
        Audio(samples, rate)


def test_real_songs_decode_whole(data_dir):
    """The lengths that the collection's table states, whatever the format."""
    lengths_s = {"fof_muldjord_chaos_god.ogg": 60.0, "us_Not_About_You.mp3": 45.0, "madmom_sample.wav": 2.8}
    for name, length_s in lengths_s.items():
        assert audio.read(data_dir / "audio_beats" / name).duration_s == pytest.approx(length_s, abs=0.06)


def test_a_raised_limit_lets_as_many_more_values_in(tmp_path, monkeypatch):
    monkeypatch.setattr(audio, "MOST_VALUES", 8000)
    monkeypatch.setattr(audio, "LONGEST_S", 1.0)
    path = tmp_path / "wide.wav"
    audio.write_wav(path, Audio(np.zeros((8000, 2), np.float32), 8000))
    assert "at most 1 s and 8000 values, got 1 s of 2 channels" in refusal(path, limit_s=1.0)
    assert audio.read(path, limit_s=2.0).duration_s == 1.0
