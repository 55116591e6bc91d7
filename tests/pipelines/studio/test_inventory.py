from pipelines.studio.folder import StudioFolder
from pipelines.studio.inventory import clip_rows, clips_and_doubts, song_rows, songs_found


def states(files):
    return {file["key"]: file["state"] for file in files}


def test_files_are_new_then_read_then_changed(fresh_studio, build):
    folder = StudioFolder(fresh_studio)
    assert set(states(clips_and_doubts(folder.sources(), folder.lake)[0]).values()) == {"new"}
    assert states(songs_found(folder.sources(), folder.lake)) == {"beat": "new"}
    build(fresh_studio)
    found, doubts = clips_and_doubts(folder.sources(), folder.lake)
    assert set(states(found).values()) == {"read"}
    assert doubts == []
    assert set(clip_rows(folder.lake)) == {file["path"] for file in found}
    assert song_rows(folder.lake)["songs/beat.wav"]["song_id"] == "beat"
    wave = fresh_studio / "clips" / "ayame" / "wave.bvh"
    wave.write_bytes(wave.read_bytes() + b"\n")
    after = states(clips_and_doubts(folder.sources(), folder.lake)[0])
    assert after == states(found) | {"ayame-wave": "changed"}


def test_refused_files_say_why(fresh_studio, build):
    (fresh_studio / "clips" / "ayame" / "broken.bvh").write_text("HIERARCHY", encoding="utf-8")
    build(fresh_studio)
    folder = StudioFolder(fresh_studio)
    [broken] = [f for f in clips_and_doubts(folder.sources(), folder.lake)[0] if f["key"] == "ayame-broken"]
    assert broken["state"] == "refused"
    assert "line" in broken["reason"]
