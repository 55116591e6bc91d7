"""Whatever lies in the folder: one clear sentence each, an exit status, and the rest goes on."""

import json
import shutil
import subprocess
import sys

import numpy as np
import pyarrow.parquet as pq
import pytest

from assets.formats import audio
from assets.formats.audio import Audio
from kernels.synthetic.dancer import take
from pipelines.commands.dance_songs import dance_songs
from pipelines.resources import NoProgress
from pipelines.studio.files import StudioError


def reasons(outcome):
    return {entry["path"]: entry["reason"] for entry in outcome.facts["refused"]}


def odori(*arguments, **options):
    """Run the command as a user does."""
    return subprocess.run(
        [sys.executable, "-m", "pipelines.cli", *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        **options,
    )


def motion(text):
    return text.index(b"MOTION")


def damaged(good):
    """Files no reader should take, each with a word of the sentence that refuses it."""
    rows = good.split(b"\n")
    frame = next(i for i, row in enumerate(rows) if row.startswith(b"Frame Time"))
    return {
        "empty.bvh": (b"", "empty"),
        "junk.bvh": (bytes(range(256)) * 20, "HIERARCHY"),
        "no_motion.bvh": (good[: motion(good)], "MOTION"),
        "truncated.bvh": (good[: len(good) * 2 // 3], "values"),
        "zero_frames.bvh": (b"\n".join([*rows[: frame - 1], b"Frames: 0", rows[frame]]) + b"\n", "frame"),
        "nan.bvh": (
            b"\n".join(
                [*rows[: frame + 3], b"nan" + rows[frame + 3][rows[frame + 3].index(b" ") :], *rows[frame + 4 :]]
            ),
            "nan",
        ),
        "not_a_body.bvh": (
            b"HIERARCHY\nROOT box\n{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\n"
            b"End Site\n{\nOFFSET 0 1 0\n}\n}\n"
            b"MOTION\nFrames: 2\nFrame Time: 0.1\n0 0 0\n0 0 0\n",
            "human body",
        ),
        "wrong.fbx": (b"Kaydara FBX Binary", ".bvh"),
    }


def test_damaged_clips_are_refused_one_by_one_and_the_rest_goes_on(fresh_studio, build):
    folder = fresh_studio / "clips" / "ayame"
    good = (folder / "step.bvh").read_bytes()
    cases = damaged(good)
    for name, (data, _) in cases.items():
        (folder / name).write_bytes(data)
    outcome = build(fresh_studio)
    found = reasons(outcome)
    assert outcome.status == 1
    assert outcome.facts["clips"]["read"] == 5
    assert set(found) == {f"clips/ayame/{name}" for name in cases}
    for name, (_, word) in cases.items():
        assert word.lower() in found[f"clips/ayame/{name}"].lower(), (name, found[f"clips/ayame/{name}"])
    assert any("truncated.bvh" in line for line in outcome.troubles)
    rows = pq.read_table(fresh_studio / "lake" / "clip" / "ayame.parquet").to_pylist()
    assert {r["state"] for r in rows if r["reason"]} == {"refused"}
    assert all(r["reason"] is None for r in rows if r["state"] == "read")


def test_mended_clip_is_read(fresh_studio, build):
    clip = fresh_studio / "clips" / "ayame" / "step.bvh"
    good = clip.read_bytes()
    clip.write_bytes(good[:3000])
    assert build(fresh_studio).status == 1
    clip.write_bytes(good)
    outcome = build(fresh_studio)
    assert outcome.status == 0
    assert outcome.facts["refused"] == []


def test_one_frame_clip_is_read_and_has_no_beats(fresh_studio, build):
    from assets.formats import bvh
    from kernels.types import Clip

    whole = take("step").clip
    one = Clip(whole.skeleton, 30.0, whole.root_xyz_m[:1], whole.rotation_wxyz[:1])
    (fresh_studio / "clips" / "ayame" / "one.bvh").write_bytes(bvh.format(one))
    assert build(fresh_studio).status == 0
    beats = pq.read_table(fresh_studio / "lake" / "motion_beat" / "ayame.parquet")
    assert "ayame-one" not in beats["clip_id"].to_pylist()
    poses = pq.read_table(fresh_studio / "lake" / "canonical_pose" / "ayame.parquet")
    assert poses["clip_id"].to_pylist().count("ayame-one") == 1


def test_huge_file_is_refused_unread(fresh_studio, build):
    with (fresh_studio / "clips" / "ayame" / "huge.bvh").open("wb") as file:
        file.truncate(2_000_000_000)
    found = reasons(build(fresh_studio))["clips/ayame/huge.bvh"]
    assert "2000 MB" in found
    assert "odori.toml" in found


def test_two_files_of_one_key(fresh_studio, build):
    folder = fresh_studio / "clips" / "ayame"
    (folder / "Wave.BVH").write_bytes((folder / "wave.bvh").read_bytes())
    (fresh_studio / "songs" / "BEAT.wav").write_bytes((fresh_studio / "songs" / "beat.wav").read_bytes())
    outcome = build(fresh_studio)
    found = reasons(outcome)
    assert set(found) == {"clips/ayame/wave.bvh", "songs/beat.wav"}
    assert "clips/ayame/Wave.BVH" in found["clips/ayame/wave.bvh"]
    assert "rename" in found["songs/beat.wav"]
    assert outcome.facts["clips"]["read"] == 5
    assert outcome.facts["songs"]["read"] == 1


ODD_NAMES = ("two words", "踊り 一", 'it\'s "quoted"', "dots..in..it", "tab\there", "-dash", "%2e%2e", "🕺", "x" * 120)


def test_odd_names(fresh_studio, build):
    folder = fresh_studio / "clips" / "ayame"
    clip, song = (folder / "step.bvh").read_bytes(), (fresh_studio / "songs" / "beat.wav").read_bytes()
    for name in ODD_NAMES:
        (folder / f"{name}.bvh").write_bytes(clip)
        (fresh_studio / "songs" / f"{name}.wav").write_bytes(song)
    (fresh_studio / "clips" / "kaede").rename(fresh_studio / "clips" / ODD_NAMES[1])
    outcome = build(fresh_studio)
    assert outcome.status == 0, outcome.troubles
    assert outcome.facts["clips"]["read"] == 5 + len(ODD_NAMES)
    assert outcome.facts["songs"]["read"] == 1 + len(ODD_NAMES)
    asked = [f"{ODD_NAMES[1]}.wav", ODD_NAMES[2]]
    danced = dance_songs(fresh_studio, asked, method="graph", frame_rate_hz=None, out=None, progress=NoProgress)
    assert danced.status == 0, danced.troubles
    keys = {d["song"] for d in danced.facts["dances"]}
    assert {p.name for p in (fresh_studio / "dances").iterdir()} == keys
    assert len(keys) == 2


def wav(samples, rate_hz=22050):
    return audio.format_wav(Audio(np.asarray(samples, np.float32).reshape(-1, 1), rate_hz))


SONGS = {
    "silence.wav": (wav(np.zeros(22050 * 8)), "silent"),
    "short.wav": (wav(np.sin(np.arange(4000))), "two beats"),
    "corrupt.wav": (b"RIFF\x24\x00\x00\x00WAVEfmt ", "want"),
    "text.mp3": (b"this is no music" * 50, "want"),
    "corrupt.mid": (b"MThd\x00\x00\x00\x06\x00\x01\x00\x01\x01\xe0MTrk\x00\x00\x00\xffnot", "want"),
    "empty.ogg": (b"", "empty"),
    "song.m4a": (b"\x00\x00\x00\x20ftypM4A ", "audio"),
}


def test_bad_songs_are_refused_and_the_good_one_is_danced(fresh_studio, build):
    for name, (data, _) in SONGS.items():
        (fresh_studio / "songs" / name).write_bytes(data)
    outcome = build(fresh_studio)
    found = reasons(outcome)
    assert outcome.status == 1
    assert set(found) == {f"songs/{name}" for name in SONGS}
    for name, (_, word) in SONGS.items():
        assert word in found[f"songs/{name}"], (name, found[f"songs/{name}"])
    danced = dance_songs(fresh_studio, ["all"], method="graph", frame_rate_hz=None, out=None, progress=NoProgress)
    assert danced.status == 1
    assert [d["song"] for d in danced.facts["dances"]] == ["beat"]
    assert len(danced.troubles) == len(SONGS)


def test_dancing_a_silent_song_does_nothing_and_says_why(fresh_studio):
    (fresh_studio / "songs" / "silence.wav").write_bytes(SONGS["silence.wav"][0])
    done = odori("dance", "silence", "--studio", fresh_studio, "--json")
    assert done.returncode == 2
    assert "silent" in json.loads(done.stdout)["error"]
    assert "silent" in done.stderr


def test_no_clip_with_beats(fresh_studio):
    from assets.formats import bvh

    for clip in (fresh_studio / "clips").rglob("*.bvh"):
        clip.write_bytes(bvh.format(take("idle").clip))
    done = odori("dance", "beat", "--studio", fresh_studio)
    assert done.returncode == 2
    assert "add clips in which beats are found" in done.stderr
    assert "Traceback" not in done.stderr


def test_broken_brief_and_settings_name_the_key(fresh_studio, build):
    (fresh_studio / "songs" / "beat.brief.toml").write_text("[beats]\noctav = 2\n")
    found = reasons(build(fresh_studio))["songs/beat.wav"]
    assert "beats.octav" in found
    assert "'octave'" in found
    (fresh_studio / "odori.toml").write_text("[motion_graph]\nneighbours = 'many'\n")
    done = odori("build", "--studio", fresh_studio)
    assert done.returncode == 2
    assert "motion_graph.neighbours: want a whole number, got 'many'" in done.stderr
    assert "Traceback" not in done.stderr


def test_setting_that_no_kernel_takes_is_one_sentence(fresh_studio):
    (fresh_studio / "odori.toml").write_text("[motion_beat]\njoints = ['leftWing']\n")
    done = odori("build", "--studio", fresh_studio)
    assert done.returncode == 2
    assert "leftWing" in done.stderr
    assert "Traceback" not in done.stderr


def test_device_that_is_not_there_is_an_error(fresh_studio):
    (fresh_studio / "odori.toml").write_text("[opencl]\ndevice = 'no such card'\n")
    done = odori("build", "--studio", fresh_studio, "--json")
    assert done.returncode == 2
    assert "[opencl] device: want 'no such card', found" in json.loads(done.stdout)["error"]
    assert not (fresh_studio / "lake").exists()


def test_a_joint_that_is_none_refuses_the_settings_not_every_clip(fresh_studio):
    (fresh_studio / "odori.toml").write_text("[joints]\nLeftAnkle = 'leftFoots'\n")
    done = odori("build", "--studio", fresh_studio)
    assert done.returncode == 2
    assert "[joints] 'LeftAnkle': want a canonical joint, got 'leftFoots'; did you mean 'leftFoot'?" in done.stderr
    assert not (fresh_studio / "lake").exists()


def test_a_number_without_end_is_refused(fresh_studio):
    (fresh_studio / "odori.toml").write_text("[limits]\nlongest_song_s = inf\n")
    done = odori("build", "--studio", fresh_studio)
    assert done.returncode == 2
    assert "[limits] longest_song_s: want a finite number, got inf" in done.stderr


def test_broken_clips_csv_is_a_note(fresh_studio, build):
    (fresh_studio / "clips" / "ayame" / "clips.csv").write_bytes(b"\xff\xfe\x00")
    outcome = build(fresh_studio)
    assert outcome.status == 0
    assert any("clips/ayame/clips.csv" in note for note in outcome.facts["notes"])
    rows = pq.read_table(fresh_studio / "lake" / "clip" / "ayame.parquet").to_pylist()
    assert {r["label"] for r in rows} == {"ayame"}


def test_empty_and_missing_studio(tmp_path, build):
    with pytest.raises(StudioError, match="want clips under clips/"):
        build(tmp_path)
    for command in (["build"], ["status"], ["dance", "x"], ["ui"]):
        done = odori(*command, "--studio", tmp_path / "nowhere")
        assert done.returncode == 2
        assert "odori demo" in done.stderr
        assert "Traceback" not in done.stderr


def test_unknown_song_names_the_nearest(fresh_studio):
    done = odori("dance", "baet", "--studio", fresh_studio)
    assert done.returncode == 2
    assert "near are beat" in done.stderr


def test_path_out_of_the_studio_is_no_song(fresh_studio):
    done = odori("dance", "../../etc/passwd", "--studio", fresh_studio)
    assert done.returncode == 2
    assert not (fresh_studio / "dances").exists()


@pytest.fixture
def small_disk(tmp_path):
    """Mount a file system of a few megabytes; skipped where that is not allowed."""
    place = tmp_path / "disk"
    place.mkdir()
    done = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=12m", "tmpfs", place], capture_output=True, check=False)
    if done.returncode:
        pytest.skip("mounting a file system is not allowed here")
    yield place
    subprocess.run(["umount", place], check=True)


def test_read_only_disk(fresh_studio, small_disk):
    root = shutil.copytree(fresh_studio, small_disk / "studio")
    subprocess.run(["mount", "-o", "remount,ro", small_disk], check=True)
    for command in (["build"], ["dance", "beat"]):
        done = odori(*command, "--studio", root)
        assert done.returncode == 2, done.stderr
        assert "cannot be written: the disk is read-only" in done.stderr
        assert "Traceback" not in done.stderr
    assert odori("status", "--studio", root).returncode == 0


def test_full_disk_leaves_every_file_whole(studio, small_disk, build):
    root = shutil.copytree(studio, small_disk / "studio")
    clip = root / "clips" / "ayame" / "step.bvh"
    clip.write_bytes((root / "clips" / "ayame" / "twist.bvh").read_bytes())
    before = {p: p.read_bytes() for p in (root / "lake").rglob("*.parquet")}
    filler = small_disk / "filler"
    filler.write_bytes(bytes(max(shutil.disk_usage(small_disk).free - 150_000, 0)))
    done = odori("build", "--studio", root, "--json")
    assert done.returncode in (1, 2), done.stderr
    assert "disk" in done.stderr
    assert "Traceback" not in done.stderr
    assert not list((root / "lake").rglob(".tmp-*"))
    for path, data in before.items():
        assert path.read_bytes() == data or pq.read_table(path).num_rows > 0
    filler.unlink()
    assert build(root).status == 0
