"""The second way to dance a song, on the small studio: what is stored, what is needed, what may go wrong."""

import shutil
from pathlib import Path

import numpy as np
import pyarrow.compute as pc
import pytest

from assets.formats import audio, bvh
from assets.formats.audio import Audio
from assets.formats.errors import FormatError
from assets.tables import matching as matching_tables
from assets.tables import pack
from kernels.matching.pieces import motion_under
from kernels.matching.score import reference_matches, similarity
from kernels.synthetic.dancer import take
from kernels.types import Clip
from pipelines.collection import freshness
from pipelines.commands.dance_songs import dance_songs
from pipelines.resources import NoProgress
from pipelines.studio.folder import StudioFolder

pytestmark = pytest.mark.opencl


def dance(root, song="beat", method="matching"):
    return dance_songs(root, [song], method=method, frame_rate_hz=None, out=None, progress=NoProgress)


def lake(root):
    return StudioFolder(root).lake


@pytest.fixture
def studio(matched, tmp_path):
    return Path(shutil.copytree(matched, tmp_path / "studio"))


def test_features_are_120_a_second_float32_and_scaled(matched):
    table = lake(matched).table("motion_feature", "ayame")
    for rows in pack.by_clip(table).values():
        np.testing.assert_allclose(np.diff(rows["time_s"]), 1 / 120)
        for name in ("rhythm", "intensity"):
            values = rows[name].to_numpy()
            assert values.dtype == np.float32
            assert values.min() >= 0
            assert np.percentile(values, 99) == pytest.approx(1, abs=1e-5)
    song = lake(matched).table("music_feature", "beat")
    assert np.percentile(song["rhythm"].to_numpy(), 99) == pytest.approx(1, abs=1e-5)
    assert song.num_rows == int(lake(matched).table("song", "beat")["duration_s"][0].as_py() * 120 + 1e-6) + 1


def test_segments_cover_the_song(matched):
    rows = lake(matched).table("music_segment", "beat").to_pylist()
    song = lake(matched).table("music_feature", "beat")
    assert rows[0]["start_frame_index"] == 0
    assert sum(r["frame_count"] for r in rows) == song.num_rows
    assert all(r["end_s"] - r["start_s"] <= 8 for r in rows)


def test_matches_are_those_of_the_reference_from_what_is_stored(matched):
    store = lake(matched)
    rhythms = {}
    for session in store.keys("motion_feature"):
        rhythms |= matching_tables.to_rhythms(store.table("motion_feature", session))
    names = sorted(rhythms)
    segments = matching_tables.to_music_segment(store.table("music_segment", "beat"))
    music = store.table("music_feature", "beat")["rhythm"].to_numpy()
    parts = matching_tables.segment_rhythms(segments, music)
    wanted = reference_matches(parts, [rhythms[n] for n in names], k=20)
    got = store.table("match", "beat")
    assert got.equals(matching_tables.from_matches("beat", wanted, names))
    assert set(got["segment_index"].to_pylist()) == set(range(len(parts)))


def test_steps_are_the_matches_at_their_scales(matched):
    store = lake(matched)
    steps = store.table("choreography", "beat|matching").to_pylist()
    matches = store.table("match", "beat").to_pylist()
    segments = store.table("music_segment", "beat").to_pylist()
    rhythm = store.table("music_feature", "beat")["rhythm"].to_numpy()
    clips = {}
    for session in store.keys("motion_feature"):
        clips |= matching_tables.to_rhythms(store.table("motion_feature", session))
    assert steps[0]["song_start_s"] == 0
    assert steps[-1]["song_end_s"] == pytest.approx(store.table("song", "beat")["duration_s"][0].as_py())
    for segment in segments:
        step = next(s for s in steps if abs(s["song_start_s"] - segment["start_s"]) < 1e-9)
        near = [
            m for m in matches if m["segment_index"] == segment["segment_index"] and m["clip_id"] == step["clip_id"]
        ]
        assert len(near) == 1
        assert 1 / step["warp_ratio"] == pytest.approx(near[0]["scale_ratio"], abs=0.01)
        # its start, or another in the clip where it matches nearly as well; brought to a beat
        part = rhythm[segment["start_frame_index"] :][: segment["frame_count"]]
        numerator = round(near[0]["scale_ratio"] * 50)
        under = motion_under(clips[step["clip_id"]], len(part), numerator=numerator, start=120 * step["clip_start_s"])
        assert similarity(part, under).sum() > 0.7 * near[0]["score"]
    assert all(s["stride_cost"] == s["beat_cost"] == 0 for s in steps)
    assert sum(s["match_cost"] for s in steps) > 0
    assert {s["method_name"] for s in steps} == {"matching"}


def test_a_dance_by_the_graph_pays_nothing_for_matches(matched):
    graph = lake(matched).table("choreography", "beat|graph")
    assert pc.sum(graph["match_cost"]).as_py() == 0


def test_the_stage_and_its_quality_are_there(matched):
    assert (matched / "dances" / "beat" / "matching.usdz").is_file()
    quality = lake(matched).table("dance_quality", "beat|matching")
    value = dict(zip(quality["metric_name"].to_pylist(), quality["value"].to_pylist(), strict=True))
    assert value["beat_lag_ms"] < 500 / 30
    assert 0.8 <= value["warp_least_ratio"] <= value["warp_most_ratio"] <= 1.25
    assert value["beat_p_probability"] < 0.01


def test_everything_is_fresh_after_both_and_each_is_made_from_its_own(matched):
    state = freshness(StudioFolder(matched))
    assert {f.state for f in state.findings()} == {"fresh"}
    of_graph, of_matching = (lake(matched).stamp("choreography", f"beat|{m}").inputs for m in ("graph", "matching"))
    assert "motion_graph_edge" in of_graph
    assert "match" not in of_graph
    assert "match" in of_matching
    assert "motion_graph_edge" not in of_matching


def test_a_graph_dance_does_not_wait_for_matches_and_no_song_is_matched_unasked(built):
    state = freshness(StudioFolder(built))
    assert not [f for f in state.findings() if f.asset == "match"]
    assert state.state("choreography", "beat|graph").state == "fresh"


def test_a_matching_dance_needs_no_motion_graph(fresh_studio):
    outcome = dance(fresh_studio)
    assert outcome.status == 0, outcome.troubles
    assert not (fresh_studio / "lake" / "motion_graph_node").exists()
    assert (fresh_studio / "dances" / "beat" / "matching.usdz").is_file()


def test_settings_of_one_method_leave_the_other_fresh(studio):
    (studio / "odori.toml").write_text("[match_path]\nrepetition_weight = 2.0\n[matching]\nmemory_mb = 64\n")
    state = freshness(StudioFolder(studio))
    assert state.state("choreography", "beat|graph").state == "fresh"
    assert state.state("choreography", "beat|matching").state == "stale"
    assert state.state("match", "beat").state == "fresh"
    (studio / "odori.toml").write_text("[path]\nwarp_weight = 2.0\n[matching]\ncandidates = 3\n")
    state = freshness(StudioFolder(studio))
    assert state.state("choreography", "beat|graph").state == "stale"
    assert state.state("choreography", "beat|matching").state == "fresh"
    assert state.state("match", "beat").state == "stale"


def test_fewer_candidates_are_the_first_of_more(studio, build):
    more = lake(studio).table("match", "beat")
    (studio / "odori.toml").write_text("[matching]\ncandidates = 2\n")
    assert build(studio, dances=True).status == 0
    fewer = lake(studio).table("match", "beat")
    assert fewer.equals(more.filter(pc.less_equal(more["rank_number"], 2)))


def test_same_inputs_same_bytes(studio):
    paths = [lake(studio).path("match", "beat"), lake(studio).path("choreography", "beat|matching")]
    before = [p.read_bytes() for p in paths]
    for path in paths:
        path.unlink()
    assert dance(studio).status == 0
    assert [p.read_bytes() for p in paths] == before


def test_unchanged_clips_are_carried_over(studio, build):
    source = studio / "clips" / "kaede" / "kick.bvh"
    source.write_bytes(bvh.format(take("kick", n_beats=9, interval_s=0.55).clip))
    before = lake(studio).stamp("motion_feature", "kaede").clips
    assert build(studio).status == 0
    after = lake(studio).stamp("motion_feature", "kaede").clips
    assert [c for c in after if after[c] != before[c]] == ["kaede-kick"]


def test_the_brief_names_the_method(studio):
    (studio / "songs" / "beat.brief.toml").write_text('method = "matching"\n')
    outcome = dance_songs(studio, ["beat"], frame_rate_hz=None, out=None, progress=NoProgress)
    assert outcome.facts["method"] == "matching"
    outcome = dance(studio, method="graph")
    assert outcome.facts["method"] == "graph"


def test_a_method_nobody_knows_refuses_the_song(fresh_studio):
    (fresh_studio / "songs" / "beat.brief.toml").write_text('method = "hmm2"\n')
    outcome = dance_songs(fresh_studio, ["beat"], frame_rate_hz=None, out=None, progress=NoProgress)
    assert outcome.status == 2
    assert "method: want one of graph, matching" in outcome.facts["error"]


def test_raw_impulses(studio, build):
    (studio / "odori.toml").write_text('[feature]\nrhythm = "impulses"\n')
    assert build(studio, dances=True).status == 0
    rhythm = lake(studio).table("music_feature", "beat")["rhythm"].to_numpy()
    assert 0 < np.count_nonzero(rhythm) <= lake(studio).table("music_beat", "beat").num_rows
    assert (studio / "dances" / "beat" / "matching.usdz").is_file()


def test_silence_within_a_song_is_danced_too(studio):
    place = studio / "songs" / "beat.wav"
    sound = audio.read(place)
    quiet = sound.samples.copy()
    quiet[len(quiet) // 2 :] = 0
    place.write_bytes(audio.format_wav(Audio(quiet, sound.sample_rate_hz)))
    outcome = dance(studio)
    assert outcome.status == 0, outcome.troubles
    rows = lake(studio).table("match", "beat").to_pylist()
    assert min(r["score"] for r in rows) == 0
    assert all(np.isfinite([r["music_ratio"], r["mutual_ratio"]]).all() for r in rows)


def test_a_clip_of_one_frame_and_one_that_stands_still_do_no_harm(studio):
    clip = take("step", n_beats=4).clip
    for name, n in (("one", 1), ("still", 90)):
        made = Clip(
            clip.skeleton,
            clip.frame_rate_hz,
            np.repeat(clip.root_xyz_m[:1], n, axis=0),
            np.repeat(clip.rotation_wxyz[:1], n, axis=0),
        )
        (studio / "clips" / "kaede" / f"{name}.bvh").write_bytes(bvh.format(made))
    outcome = dance(studio)
    assert outcome.facts["method"] == "matching", outcome.troubles
    features = pack.by_clip(lake(studio).table("motion_feature", "kaede"))
    assert features["kaede-one"].num_rows == 1
    assert not features["kaede-still"]["rhythm"].to_numpy().any()


def test_clips_too_short_for_any_segment_fill_the_song(tmp_path, fresh_studio):
    for path in fresh_studio.rglob("*.bvh"):
        path.unlink()
    for label in ("step", "twist"):
        made = take(label, n_beats=2, interval_s=0.5).clip
        (fresh_studio / "clips" / "kaede" / f"{label}.bvh").write_bytes(bvh.format(made))
    outcome = dance(fresh_studio)
    assert outcome.facts.get("method") == "matching", outcome.troubles
    steps = lake(fresh_studio).table("choreography", "beat|matching").to_pylist()
    duration_s = lake(fresh_studio).table("song", "beat")["duration_s"][0].as_py()
    assert steps[-1]["song_end_s"] == pytest.approx(duration_s)
    assert all(0.8 <= s["warp_ratio"] <= 1.25 for s in steps)


def test_a_rhythm_that_is_no_number_leaves_that_clip_out(studio):
    store = lake(studio)
    table = store.table("motion_feature", "kaede")
    stamp = store.stamp("motion_feature", "kaede")
    clip = np.array(table["clip_id"].to_pylist()) == "kaede-kick"
    rhythm = np.where(clip, np.nan, table["rhythm"].to_numpy()).astype(np.float32)
    at = table.schema.get_field_index("rhythm")
    broken = table.set_column(at, table.schema.field(at), [rhythm])
    store.write("motion_feature", "kaede", broken, stamp)
    store.path("match", "beat").unlink()
    assert dance(studio).facts["method"] == "matching"
    assert "kaede-kick" not in store.table("match", "beat")["clip_id"].to_pylist()


def test_a_device_that_is_not_there_is_an_error(studio):
    (studio / "odori.toml").write_text('[opencl]\ndevice = "no such thing"\n')
    before = lake(studio).path("match", "beat").read_bytes()
    (studio / "clips" / "kaede" / "kick.bvh").unlink()
    with pytest.raises(FormatError, match="no such thing"):
        dance(studio)
    assert lake(studio).path("match", "beat").read_bytes() == before


def test_an_interrupted_match_leaves_what_was_there(studio, monkeypatch):
    before = lake(studio).path("match", "beat").read_bytes()
    (studio / "clips" / "kaede" / "kick.bvh").unlink()

    def stop(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("kernels.opencl.match.Matcher.matches", stop)
    assert dance(studio).status == 2
    assert lake(studio).path("match", "beat").read_bytes() == before
    assert not list((studio / "lake").rglob(".tmp-*"))
    monkeypatch.undo()
    assert dance(studio).status == 0
    assert "kaede-kick" not in lake(studio).table("match", "beat")["clip_id"].to_pylist()
