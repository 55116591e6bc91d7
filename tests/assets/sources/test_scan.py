"""What is a source, which session it belongs to, who gets a key that two want."""

import unicodedata

import pytest

from assets.formats.tree import HashCache
from assets.sources.scan import LARGEST_SESSION, scan
from assets.sources.sources import session_version, song_version
from schemas.settings import Limits, Settings


@pytest.fixture
def studio(tmp_path):
    """Write files of a studio: {path: bytes}."""

    def write(files):
        for path, data in files.items():
            (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / path).write_bytes(data)
        return tmp_path

    return write


def look(root, *, settings=None, sessions=()):
    return scan(root, settings or Settings(), sessions_in_use=sessions, cache=HashCache(root / "lake" / "hashes.json"))


def test_clips_and_songs_with_keys_and_sessions(studio):
    root = studio(
        {"clips/a/b/One.bvh": b"1", "clips/two.BVH": b"2", "songs/Waltz No 1.mp3": b"3", "songs/x/y.mid": b"4"}
    )
    found = look(root)
    assert [(c.key, c.session, c.path) for c in found.clips] == [
        ("clips-two", "clips", "clips/two.BVH"),
        ("a-b-one", "a-b", "clips/a/b/One.bvh"),
    ]
    assert [(s.key, s.kind) for s in found.songs] == [("waltz_no_1", "audio"), ("y", "midi")]


def test_empty_studio_has_nothing(tmp_path):
    assert look(tmp_path).clips == ()
    assert look(tmp_path).songs == ()


def test_documents_are_no_sources_and_strangers_are_refused(studio):
    found = look(studio({"clips/LICENSE.txt": b"", "clips/x.fbx": b"x", "songs/x.zip": b"x", "songs/readme.md": b""}))
    assert [c.problem[:32] for c in found.clips] == ["want a BVH file (.bvh) or a suit"]
    assert [s.problem[:10] for s in found.songs] == ["want audio"]


def test_one_stem_as_audio_and_midi_makes_two_songs(studio):
    found = look(studio({"songs/a.mid": b"m", "songs/a.wav": b"w", "songs/a.mp3": b"p", "songs/b.mid": b"m"}))
    assert {s.path: s.key for s in found.songs} == {
        "songs/a.wav": "a",
        "songs/a.mp3": "a_mp3",
        "songs/a.mid": "a_mid",
        "songs/b.mid": "b",
    }
    assert not any(s.problem for s in found.songs)


def test_key_wanted_twice_goes_to_the_first_path(studio):
    found = look(studio({"clips/s/a b.bvh": b"1", "clips/s/a_b.bvh": b"2", "songs/C.wav": b"1", "songs/c.wav": b"2"}))
    assert [bool(c.problem) for c in found.clips] == [False, True]
    assert "clips/s/a b.bvh has" in found.clips[1].problem
    assert found.song("c").path == "songs/C.wav"
    assert len(found.songs_by_key()["c"]) == 2


def test_labels_come_from_the_nearest_table_else_from_the_folder(studio):
    found = look(
        studio(
            {
                "clips/clips.csv": b"file,label\nday/a.bvh,far\nday/b.bvh,far\n",
                "clips/day/clips.csv": b"file,label,licence\na.bvh,near,CC0-1.0\nc.bvh,,MIT\n",
                "clips/day/a.bvh": b"1",
                "clips/day/b.bvh": b"2",
                "clips/day/c.bvh": b"3",
            }
        )
    )
    assert [c.facts.label for c in found.clips] == ["near", "far", "day"]
    assert [c.facts.licence for c in found.clips] == ["CC0-1.0", "", "MIT"]


def test_labels_of_a_data_set_copied_with_its_own_paths(studio):
    found = look(
        studio(
            {
                "clips/set/labels.csv": b"path,content,style\nroot/of/data/x.bvh,walk,angry\n",
                "clips/set/sub/x.bvh": b"1",
            }
        )
    )
    assert (found.clips[0].facts.label, found.clips[0].facts.style) == ("walk", "angry")


def test_broken_table_is_a_note(studio):
    found = look(studio({"clips/s/clips.csv": b"nothing", "clips/s/a.bvh": b"1"}))
    assert "clips/s/clips.csv" in found.notes[0]
    assert found.clips[0].facts.label == "s"


def test_rows_for_no_file_and_columns_misspelt_are_notes(studio):
    column, rows = look(studio({"clips/clips.csv": b"file,lable\nlost.bvh,a\ngone.bvh,b\n"})).notes
    assert "column 'lable' is not read; if 'label' was meant" in column
    assert "clips/clips.csv: 2 of 2 rows speak of no file here, such as 'gone.bvh'" in rows


def test_a_link_that_leads_nowhere_is_a_note(studio):
    root = studio({"clips/one.bvh": b"1"})
    (root / "clips" / "kept_elsewhere.bvh").symlink_to(root / "nowhere.bvh")
    (note,) = look(root).notes
    assert note.startswith("clips/kept_elsewhere.bvh: is a link that leads nowhere: No such file")


def test_too_large_is_refused_unread(studio):
    root = studio({"clips/s/a.bvh": b"1" * 2000})
    found = look(root, settings=Settings(limits=Limits(largest_clip_mb=0.001)))
    assert "at most 0.001 MB" in found.clips[0].problem
    assert found.clips[0].sha256 == ""


def test_versions_follow_content_labels_and_names_only(studio):
    root = studio({"clips/s/a.bvh": b"1", "songs/x.wav": b"1"})
    before = look(root)
    again = look(root)
    assert session_version(before.clips) == session_version(again.clips)
    (root / "clips/s/a.bvh").write_bytes(b"22")
    (root / "songs/x.wav").write_bytes(b"22")
    after = look(root)
    assert session_version(before.clips) != session_version(after.clips)
    assert song_version(before.songs) != song_version(after.songs)
    assert before.clips[0].key == after.clips[0].key
    (root / "clips/s/clips.csv").write_text("file,label\na.bvh,spin\n")
    assert session_version(look(root).clips) != session_version(after.clips)


def test_large_folder_is_split_into_parts_that_stay_put(studio):
    files = {f"clips/big/c{i:04d}.bvh": b"x" for i in range(600)}
    root = studio(files)
    found = look(root).sessions()
    assert all(len(clips) <= LARGEST_SESSION for clips in found.values())
    assert all(key.startswith("big-part_") for key in found)
    assert {c.key for clips in found.values() for c in clips} == {f"big-c{i:04d}" for i in range(600)}
    before = {c.path: c.session for clips in found.values() for c in clips}
    for path in list(files)[:200]:
        (root / path).unlink()
    studio({f"clips/big/new{i}.bvh": b"x" for i in range(50)})
    after = {c.path: c.session for c in look(root, sessions=list(found)).clips}
    assert all(after[path] == before[path] for path in after if path in before)


def test_folder_at_the_limit_is_one_session(studio):
    root = studio({f"clips/s/{i}.bvh": b"x" for i in range(LARGEST_SESSION)})
    assert list(look(root).sessions()) == ["s"]


def test_name_that_is_no_text_is_listed(studio, tmp_path):
    import os

    (tmp_path / "clips" / "s").mkdir(parents=True)
    try:
        (tmp_path / "clips" / "s" / os.fsdecode(b"bad\xff.bvh")).write_bytes(b"x")
    except OSError:
        pytest.skip("this file system takes only UTF-8 names")
    (clip,) = look(tmp_path).clips
    assert clip.key.startswith("s-bad")


def test_brief_beside_a_song(studio):
    found = look(studio({"songs/x.wav": b"1", "songs/x.brief.toml": b"", "songs/y.wav": b"2"}))
    assert [s.brief for s in found.songs] == ["songs/x.brief.toml", ""]
    assert found.notes == ()


def test_a_brief_beside_no_song_is_a_note(studio):
    found = look(studio({"songs/waltz.wav": b"1", "songs/Waltz.brief.toml": b"", "songs/tango.brief.toml": b""}))
    assert found.songs[0].brief == ""
    assert found.notes == (
        "songs/Waltz.brief.toml: no song songs/Waltz is beside it; left alone; if 'songs/waltz' was meant, name it "
        "songs/waltz.brief.toml",
        "songs/tango.brief.toml: no song songs/tango is beside it; left alone",
    )


SUIT = b"frame,time_s,sensor,px_m,py_m,pz_m,qw,qx,qy,qz,is_valid\n"


def test_suit_recordings_are_clips_and_other_tables_are_not(studio):
    found = look(
        studio(
            {
                "clips/s/take.csv": SUIT,
                "clips/s/Take Two.parquet": b"PAR1",
                "clips/s/walk.bvh": b"x",
                "clips/s/clips.csv": b"file,label\ntake.csv,rom\n",
                "clips/s/labels_more.csv": b"file,label\n",
                "clips/s/budget.csv": b"item,price\n",
                "clips/s/take.poses.parquet": b"PAR1",
            }
        )
    )
    assert [(c.key, c.kind, c.problem) for c in found.clips] == [
        ("s-take_two", "suit", ""),
        ("s-take", "suit", ""),
        ("s-walk", "bvh", ""),
    ]
    assert all(c.session == "s" and c.sha256 for c in found.clips)
    assert {c.path: c.facts.label for c in found.clips}["clips/s/take.csv"] == "rom"
    assert found.notes == ("clips/s/budget.csv: its first line has no columns of a suit recording; left alone",)


def test_a_table_that_says_what_clips_are_is_never_one_itself(studio):
    """Whatever its columns."""
    assert look(studio({"clips/s/clips.csv": SUIT, "clips/s/labels.csv": SUIT})).clips == ()


def test_one_stem_as_bvh_and_recording_goes_to_the_first(studio):
    found = look(studio({"clips/s/a.bvh": b"x", "clips/s/a.csv": SUIT}))
    assert [bool(c.problem) for c in found.clips] == [False, True]


def test_names_that_differ_in_capitals_alone_share_no_output(studio):
    """Keys are in small letters: where capitals do not count, no file is written over another's."""
    found = look(
        studio(
            {
                "clips/Ayame/Walk.bvh": b"1",
                "clips/Ayame/walk.BVH": b"2",
                "clips/ayame/walk.bvh": b"3",
                "clips/ayame/run.bvh": b"4",
                "songs/Waltz.wav": b"5",
                "songs/waltz.WAV": b"6",
                "songs/WALTZ.mid": b"7",
            }
        )
    )
    read = [c for c in found.clips if not c.problem]
    assert [(c.key, c.path) for c in read] == [
        ("ayame-walk", "clips/Ayame/Walk.bvh"),
        ("ayame-run", "clips/ayame/run.bvh"),
    ]
    assert {c.session for c in found.clips} == {"ayame"}
    assert all("rename one of the two files" in c.problem for c in found.clips if c not in read)
    assert {s.path: s.key for s in found.songs if not s.problem} == {
        "songs/Waltz.wav": "waltz",
        "songs/WALTZ.mid": "waltz_mid",
    }
    assert [s.path for s in found.songs if "rename one of the two files" in s.problem] == ["songs/waltz.WAV"]


def test_names_that_differ_in_how_accents_are_put_together_are_one_name(studio):
    apart, together = (unicodedata.normalize(form, "ガ") for form in ("NFD", "NFC"))
    found = look(studio({f"songs/{apart}.wav": b"1", f"songs/{together}.wav": b"2"}))
    assert len({s.key for s in found.songs}) == 1
    assert len([s for s in found.songs if "rename one of the two files" in s.problem]) == 1


def test_paths_of_sources_have_slashes(studio):
    found = look(studio({"clips/a/b/one.bvh": b"1", "songs/x/y.mid": b"4", "songs/x/y.brief.toml": b""}))
    assert (found.clips[0].path, found.songs[0].path, found.songs[0].brief) == (
        "clips/a/b/one.bvh",
        "songs/x/y.mid",
        "songs/x/y.brief.toml",
    )
