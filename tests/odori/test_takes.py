import numpy as np
import pytest

import odori
from assets.formats import audio, bvh, midi, suit
from kernels.music.beats import track_beats
from kernels.synthetic.dancer import take
from kernels.synthetic.drum_machine import drum_machine_song
from pipelines.commands.demo_studio import suit_recording


def test_a_bvh_is_one_take_on_its_own_rig(tmp_path):
    made = take("kick", n_beats=4, interval_s=0.5).clip
    (tmp_path / "kick.bvh").write_bytes(bvh.format(made))
    [found] = odori.read(tmp_path / "kick.bvh")
    assert (found.name, found.path, found.frame_rate_hz) == ("kick", tmp_path / "kick.bvh", made.frame_rate_hz)
    assert found.joints[: len(made.skeleton.joints)]
    assert found.position_xyz_m.shape == (made.n_frames, len(found.joints), 3)
    assert found.time_s[-1] == pytest.approx(made.duration_s)
    poses = found.canonical()
    assert poses.position_xyz_m.shape == (made.n_frames, 22, 3)
    assert poses.of("leftFoot")[:, 1].min() > -0.1


def test_a_suit_recording_is_calibrated(tmp_path):
    (tmp_path / "medley.parquet").write_bytes(suit.format_parquet(suit_recording()))
    [found] = odori.read(str(tmp_path / "medley.parquet"))
    assert found.frame_rate_hz == pytest.approx(120)
    assert found.canonical().position_xyz_m.shape[1:] == (22, 3)


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("none.bvh", None, "want a motion file, got nothing there"),
        ("clip.mp4", b"", "want a motion file, .bvh, or .parquet or .csv of a suit, got .mp4"),
        ("clip", b"", "got no suffix"),
        ("broken.bvh", b"HIERARCHY\nROOT", "broken.bvh"),
        ("table.csv", b"a,b\n1,2\n", "table.csv"),
    ],
)
def test_what_is_no_motion_is_refused(tmp_path, name, data, words):
    if data is not None:
        (tmp_path / name).write_bytes(data)
    with pytest.raises(odori.OdoriError, match=words):
        odori.read(tmp_path / name)


def test_a_rig_that_is_no_body_is_read_and_not_brought_to_one(tmp_path):
    text = "HIERARCHY\nROOT box\n{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\n"
    text += "End Site\n{\nOFFSET 0 1 0\n}\n}\n"
    (tmp_path / "box.bvh").write_text(f"{text}MOTION\nFrames: 2\nFrame Time: 0.1\n0 0 0\n0 1 0\n", encoding="utf-8")
    [found] = odori.read(tmp_path / "box.bvh")
    with pytest.raises(odori.OdoriError, match="joints"):
        found.canonical()


def test_beats_of_a_file_are_heard_in_sound_and_read_in_midi(tmp_path):
    song = drum_machine_song(tempo_bpm=120, n_bars=4)
    sound = song.render(sample_rate_hz=22050)
    (tmp_path / "a.wav").write_bytes(audio.format_wav(audio.Audio(sound, 22050)))
    (tmp_path / "a.mid").write_bytes(midi.format(song.notes, tempo=song.tempo))
    heard = odori.song_beats(tmp_path / "a.wav")
    wanted = track_beats(audio.read(tmp_path / "a.wav").samples, 22050).grid
    assert np.array_equal(heard.time_s, wanted.time_s)
    played = odori.song_beats(tmp_path / "a.mid")
    assert np.array_equal(played.time_s, midi.read(tmp_path / "a.mid").beats.time_s)
    with pytest.raises(odori.OdoriError, match="want a music file, got nothing there"):
        odori.song_beats(tmp_path / "b.wav")
