"""Plain arrays: known answers, and input that cannot be meant refused by its name."""

import numpy as np
import pytest

import odori
from kernels.matching.score import reference_matches
from kernels.music.beats import track_beats as kernel_beats
from kernels.synthetic.drum_machine import drum_machine_song

RATE_HZ = 22050


@pytest.fixture(scope="module")
def song():
    made = drum_machine_song(tempo_bpm=120, n_bars=6)
    return made, made.render(sample_rate_hz=RATE_HZ)


def test_beats_of_sound_are_the_engines(song):
    made, sound = song
    found = odori.track_beats(sound, RATE_HZ)
    assert np.array_equal(found.time_s, kernel_beats(sound, RATE_HZ).grid.time_s)
    assert odori.score_beats(found, made.beats.time_s) > 0.95
    assert round(found.tempo_bpm) == 120
    assert (np.diff(found.downbeat_s) > 1.9).all()


def test_channels_come_last(song):
    _, sound = song
    stereo = np.stack([sound[:, 0], sound[:, 0]], axis=1) if sound.ndim == 2 else np.stack([sound, sound], axis=1)
    assert len(odori.track_beats(stereo, RATE_HZ)) > 10
    with pytest.raises(
        odori.InputError, match=r"samples: want \(n,\) or \(n, C\), got .* channels first; give samples.T"
    ):
        odori.track_beats(stereo.T, RATE_HZ)


@pytest.mark.parametrize(
    ("samples", "words"),
    [
        (np.zeros((2, 3, 4)), r"samples: want \(n,\) or \(n, C\), got \(2, 3, 4\)"),
        (np.zeros(0), "samples: want at least one sample, got none"),
        (np.zeros((0, 2)), "samples: want at least one sample, got none"),
        (np.float64(1.0), "samples: want"),
        (np.array([0.0, np.nan, 0.0]), "samples: want finite values, got nan at 1"),
        (np.array([[0.0, 0.0], [0.0, np.inf], [0, 0]]), r"samples: want finite values, got inf at \(1, 1\)"),
        (np.array([0, 1200, -4000], np.int16), "samples: want float from -1 to 1, got int16; divide by 32768"),
        (np.array([0.0, 1200.0, -4000.0]), "samples: want full scale -1 to 1, got values to 4000"),
        (np.array(["a", "b"]), "samples: want numbers, got <U1"),
        (np.array([1j, 0]), "samples: want numbers, got complex128"),
        (np.array([True, False]), "samples: want numbers, got bool"),
        ([[0.0, 0.0], [0.0]], "samples: want an array of numbers, got rows of different lengths"),
    ],
)
def test_samples_that_cannot_be_meant_are_refused(samples, words):
    with pytest.raises(odori.InputError, match=words):
        odori.track_beats(samples, RATE_HZ)


@pytest.mark.parametrize(
    ("rate_hz", "words"),
    [
        (0, "rate_hz: want samples a second, 4000 to 768000, got 0"),
        (-44100, "rate_hz: want samples a second"),
        (44.1, "was it given in kHz"),
        (np.nan, "rate_hz: want a finite number, got nan"),
        ("fast", "rate_hz: want a number, got 'fast'"),
        (None, "rate_hz: want a number, got None"),
    ],
)
def test_rates_that_are_none_are_refused(rate_hz, words):
    with pytest.raises(odori.InputError, match=words):
        odori.track_beats(np.zeros(RATE_HZ), rate_hz)


def test_silence_has_no_beats():
    found = odori.track_beats(np.zeros(RATE_HZ), RATE_HZ)
    assert len(found) == 0
    assert found.tempo_bpm is None
    assert len(found.downbeat_s) == 0


@pytest.mark.parametrize(
    ("beats_s", "words"),
    [
        ([500.0, 1000.0, 1500.0], "want seconds, got beats 500 apart; were they given in milliseconds"),
        ([1.0, 0.5, 1.5], "want rising times, got 1 before 0.5"),
        ([0.5, 0.5, 1.5], "want rising times"),
        ([-0.5, 0.5], "want seconds >= 0, got -0.5"),
        ([0.5, np.nan], "want finite seconds, got nan"),
        ([40_000.0], "want seconds, got a beat at 40000; were they given in milliseconds"),
        ([[0.5, 1.0]], r"want \(B,\) seconds, got \(1, 2\)"),
    ],
)
def test_beats_that_cannot_be_meant_are_refused_on_either_side(beats_s, words):
    with pytest.raises(odori.InputError, match=f"beats_s: {words}"):
        odori.score_beats(beats_s, [0.5, 1.0])
    with pytest.raises(odori.InputError, match=f"reference_s: {words}"):
        odori.score_beats([0.5, 1.0], beats_s)


def test_beats_are_scored_one_to_one_within_the_tolerance():
    assert odori.score_beats([], [0.5]) == 0
    assert odori.score_beats([0.5, 0.56], [0.53]) == pytest.approx(2 / 3)
    assert odori.score_beats([0.5], [0.6]) == 0
    assert odori.score_beats([0.5], [0.6], tolerance_s=0.11) == 1
    with pytest.raises(odori.InputError, match="tolerance_s: want seconds, above 0 and at most 1, got 0"):
        odori.score_beats([0.5], [0.6], tolerance_s=0)


def test_a_swing_slows_down_twice_a_cycle():
    time_s = np.arange(240) / 60
    swing = np.zeros((240, 2, 3))
    swing[:, :, 1] = np.sin(2 * np.pi * time_s)[:, None]
    np.testing.assert_allclose(odori.motion_beats(swing, 60), np.arange(0.25, 4, 0.5), atol=1 / 60)


@pytest.mark.parametrize(
    ("position", "rate_hz", "words"),
    [
        (np.zeros((10, 3)), 60, r"position_xyz_m: want \(F, J, 3\), got \(10, 3\)"),
        (np.zeros((10, 3, 22)), 60, r"position_xyz_m: want \(F, J, 3\), got \(10, 3, 22\)"),
        (np.full((10, 1, 3), np.nan), 60, r"position_xyz_m: want finite values, got nan at \(0, 0, 0\)"),
        (np.zeros((22, 300, 3)), 60, r"got \(22, 300, 3\), joints first; swap the first two axes"),
        (np.zeros((10, 1, 3)), 0, "rate_hz: want frames a second, > 0, got 0"),
    ],
)
def test_positions_that_cannot_be_meant_are_refused(position, rate_hz, words):
    with pytest.raises(odori.InputError, match=words):
        odori.motion_beats(position, rate_hz)


@pytest.fixture(scope="module")
def rhythms():
    rng = np.random.default_rng(3)
    return {f"clip_{i}": rng.random(300 + 10 * i).astype(np.float32) for i in range(6)}


def test_matches_are_the_references(rhythms):
    segments = [rhythms["clip_2"][50:200], np.ones(80, np.float32)]
    found = odori.match(segments, rhythms, k=3)
    wanted = reference_matches(segments, list(rhythms.values()), k=3)
    assert [[(m.clip_id, m.start_frame_index, m.score) for m in one] for one in found] == [
        [(f"clip_{m.clip_index}", m.start_frame_index, m.score) for m in one] for one in wanted
    ]
    assert found[0][0].clip_id == "clip_2"
    assert found[0][0].scale_ratio == 1.0


def test_one_segment_and_clips_without_names(rhythms):
    [best] = odori.match(rhythms["clip_4"][20:120], list(rhythms.values()), k=1)
    assert (best[0].clip_id, best[0].start_frame_index) == (4, 20)
    assert odori.match([0.5, 1.0, 0.5], {"a": [0.5, 1.0, 0.5, 0.0]}, k=1)[0][0].clip_id == "a"


def test_nothing_to_match_with_is_no_match(rhythms):
    assert odori.match([np.ones(10)], {}) == [[]]
    assert odori.match([], rhythms) == []
    assert odori.match([np.ones(1000)], {"short": np.ones(10)}) == [[]]


@pytest.mark.opencl
def test_a_device_gives_the_same_to_the_bit(rhythms):
    segments = [rhythms["clip_1"][10:170]]
    assert odori.match(segments, rhythms, device="auto") == odori.match(segments, rhythms)


@pytest.mark.parametrize(
    ("segments", "clips", "words"),
    [
        ([np.ones((3, 2))], {"a": np.ones(9)}, r"segments\[0\]: want \(n,\) with n >= 1, got \(3, 2\)"),
        ([np.zeros(0)], {"a": np.ones(9)}, r"segments\[0\]: want \(n,\) with n >= 1, got \(0,\)"),
        ([np.ones(3)], {"a": -np.ones(9)}, r"clips\['a'\]: want 0 to 1e\+100, got -1"),
        (np.ones((3, 9)), {"a": np.ones(9)}, r"segments: want a sequence of \(n,\), got \(3, 9\)"),
        ([np.ones(3)], {"a": np.full(9, 1e200)}, r"clips\['a'\]: want 0 to 1e\+100"),
        (None, {"a": np.ones(9)}, r"segments: want a sequence of \(n,\) arrays, got NoneType"),
        ([np.ones(3)], [np.full(9, np.nan)], r"clips\[0\]: want finite values, got nan at 0"),
    ],
)
def test_rhythms_that_cannot_be_meant_are_refused(segments, clips, words):
    with pytest.raises(odori.InputError, match=words):
        odori.match(segments, clips)


def test_counts_and_devices_that_are_none_are_refused(rhythms):
    with pytest.raises(odori.InputError, match="k: want a whole number >= 1, got 0"):
        odori.match([np.ones(10)], rhythms, k=0)
    with pytest.raises(odori.OdoriError, match="no-such-device"):
        odori.match([np.ones(10)], rhythms, device="no-such-device")


def test_beats_of_the_pulse_are_the_turns_of_a_swing_and_none_of_a_body_that_stands():
    swing = np.zeros((480, 1, 3))
    swing[:, 0, 0] = np.sin(2 * np.pi * np.arange(480) / 60)
    beats = odori.motion_beats(swing, 60, method="pulse")
    assert np.abs((beats - 0.25) / 0.5 - np.round((beats - 0.25) / 0.5)).max() < 0.1
    assert len(beats) >= 14
    assert len(odori.motion_beats(np.zeros((240, 3, 3)), 60, method="pulse")) == 0
    with pytest.raises(odori.InputError, match="method: want stops or pulse"):
        odori.motion_beats(swing, 60, method="guess")
