"""The .usdz: layout by the specification, told by zipfile and by the bytes themselves."""

import zipfile

import pytest
from pxr import Usd, UsdMedia

from assets.formats import usd, usd_package, usd_read
from assets.formats.errors import FormatError
from schemas import stage_contract as contract


@pytest.fixture
def package(swaying, song_wav, tmp_path):
    usd.write_stage(tmp_path / "graph.usdc", swaying, audio="song.wav")
    usd_package.write_package(tmp_path / "graph.usdz", tmp_path / "graph.usdc")
    return tmp_path / "graph.usdz"


def test_members_are_stored_undated_and_aligned(package, song_wav):
    with zipfile.ZipFile(package) as archive:
        members = archive.infolist()
        assert archive.testzip() is None
        assert [member.filename for member in members] == ["dance.usdc", "song.wav"]
        assert archive.read("song.wav") == song_wav.read_bytes()
    content = package.read_bytes()
    for member in members:
        assert member.compress_type == zipfile.ZIP_STORED
        assert member.date_time == (1980, 1, 1, 0, 0, 0)
        name_bytes, extra_bytes = content[member.header_offset + 26], content[member.header_offset + 28]
        first = member.header_offset + 30 + name_bytes + extra_bytes
        assert first % contract.PACKAGE_ALIGNMENT_BYTES == 0
        assert content[first : first + 8] in (b"PXR-USDC", song_wav.read_bytes()[:8])


def test_the_dance_and_its_song_are_inside(package, swaying, tmp_path):
    moved = tmp_path / "elsewhere" / "b.usdz"
    moved.parent.mkdir()
    package.rename(moved)
    stage = Usd.Stage.Open(str(moved))
    song = UsdMedia.SpatialAudio(stage.GetPrimAtPath(contract.AUDIO_PATH)).GetFilePathAttr().Get()
    assert song.resolvedPath == f"{moved}[song.wav]"
    assert usd_read.read_animation(moved).n_frames == swaying.n_frames


def test_songs_from_other_folders_with_other_letters_are_packed(swaying, song_wav, tmp_path):
    (tmp_path / "songs").mkdir()
    song_wav.rename(tmp_path / "songs" / "踊り 1's.wav")
    usd.write_stage(tmp_path / "dances" / "a.usdc", swaying, audio="../songs/踊り 1's.wav")
    usd_package.write_package(tmp_path / "dances" / "a.usdz", tmp_path / "dances" / "a.usdc")
    stage = Usd.Stage.Open(str(tmp_path / "dances" / "a.usdz"))
    song = UsdMedia.SpatialAudio(stage.GetPrimAtPath(contract.AUDIO_PATH)).GetFilePathAttr().Get()
    assert song.path == "./___1_s.wav"
    assert song.resolvedPath


def test_a_stage_without_song_is_packed_alone(swaying, tmp_path):
    usd.write_stage(tmp_path / "a.usdc", swaying)
    usd_package.write_package(tmp_path / "a.usdz", tmp_path / "a.usdc")
    with zipfile.ZipFile(tmp_path / "a.usdz") as archive:
        assert archive.namelist() == ["dance.usdc"]


def test_packing_leaves_the_stage_as_it_is(swaying, song_wav, tmp_path):
    usd.write_stage(tmp_path / "a.usdc", swaying, audio="song.wav")
    before = (tmp_path / "a.usdc").read_bytes()
    usd_package.write_package(tmp_path / "a.usdz", tmp_path / "a.usdc")
    assert (tmp_path / "a.usdc").read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.usdc", "a.usdz", "song.wav"]


def test_a_stage_rewritten_in_one_process_is_packed_anew(swaying, tmp_path):
    for title in ("first", "second"):
        usd.write_stage(tmp_path / "a.usdc", swaying, title=title)
        usd_package.write_package(tmp_path / "a.usdz", tmp_path / "a.usdc")
        stage = Usd.Stage.Open(str(tmp_path / "a.usdz"))
        assert Usd.ModelAPI(stage.GetDefaultPrim()).GetAssetName() == title
        del stage


@pytest.mark.parametrize("content", [None, b"", b"OggS" + bytes(100), b"RIFF"], ids=["none", "empty", "ogg", "short"])
def test_songs_that_are_no_wave_are_told_and_nothing_is_written(swaying, tmp_path, content):
    usd.write_stage(tmp_path / "a.usdc", swaying, audio="song.wav")
    if content is not None:
        (tmp_path / "song.wav").write_bytes(content)
    (tmp_path / "a.usdz").write_bytes(b"old")
    with pytest.raises(FormatError, match=r"song\.wav: want (the song|a WAV)"):
        usd_package.write_package(tmp_path / "a.usdz", tmp_path / "a.usdc")
    assert (tmp_path / "a.usdz").read_bytes() == b"old"
    assert not list(tmp_path.glob(".*"))


def test_suffix_and_stage_are_asked_for(tmp_path):
    with pytest.raises(ValueError, match=r"path: want a name ending in \.usdz, got 'a\.zip'"):
        usd_package.write_package(tmp_path / "a.zip", tmp_path / "a.usdc")
    with pytest.raises(FormatError, match="want a file, got none"):
        usd_package.write_package(tmp_path / "a.usdz", tmp_path / "a.usdc")


def test_a_place_that_cannot_be_written_is_told(swaying, tmp_path):
    usd.write_stage(tmp_path / "a.usdc", swaying)
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(OSError, match=r"a\.usdz: want a place to write, got: "):
        usd_package.write_package(tmp_path / "file" / "a.usdz", tmp_path / "a.usdc")
