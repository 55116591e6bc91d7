"""A studio opened in Python does what the command does, to the byte."""

import subprocess
import sys

import pytest

import odori


def test_the_front_door_loads_nothing_heavy():
    code = "import odori, sys; print(sorted({name.split('.')[0] for name in sys.modules}))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert not any(
        f"'{name}'" in loaded for name in ("dagster", "numpy", "pyarrow", "polars", "pxr", "jax", "pipelines")
    )


def test_names_of_the_front_door_are_there_and_others_are_not():
    assert {"open", "read", "track_beats", "match", "OdoriError"} <= set(dir(odori))
    assert all(getattr(odori, name) for name in odori.__all__)
    with pytest.raises(AttributeError, match="module 'odori' has no attribute 'openn'"):
        _ = odori.openn


def test_a_folder_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(odori.OdoriError, match="want a studio folder"):
        odori.open(tmp_path / "nothing")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "mine.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(odori.OdoriError, match="want a new folder or an earlier demo, got something else"):
        odori.demo(tmp_path / "other")


@pytest.mark.slow
def test_a_dance_has_the_bytes_of_the_commands(danced_demo, studio):
    before = {path.name: path.read_bytes() for path in (danced_demo / "dances" / "drum_machine").iterdir()}
    odori_command = [sys.executable, "-m", "pipelines.cli", "dance", "drum_machine", "--pin", "8-12=kick"]
    subprocess.run([*odori_command, "--studio", str(studio.root)], check=True, capture_output=True)
    by_command = {path.name: path.read_bytes() for path in (studio.root / "dances" / "drum_machine").iterdir()}
    assert by_command["graph.usdc"] != before["graph.usdc"]
    for path in (studio.root / "dances" / "drum_machine").iterdir():
        path.unlink()
    dance = studio.dance("drum_machine", pins=["8-12=kick"])
    assert {path.name: path.read_bytes() for path in dance.stage.parent.iterdir()} == by_command
    assert [pin["pin"] for pin in dance.pins] == ["8-12=kick"]
    assert dance.pins[0]["is_kept"]


@pytest.mark.slow
def test_a_build_reports_what_is_refused_and_goes_on(studio):
    (studio.root / "clips" / "ayame" / "broken.bvh").write_text("HIERARCHY", encoding="utf-8")
    report = studio.build()
    assert list(report.refused) == ["clips/ayame/broken.bvh"]
    assert report.n_clips == 50
    assert report.n_made > 0
    clip = studio.clips["ayame-broken"]
    assert (clip.state, clip.reason) == ("refused", report.refused["clips/ayame/broken.bvh"])
    with pytest.raises(odori.OdoriError, match="ayame-broken: it was refused"):
        studio.poses("ayame-broken")


@pytest.mark.slow
def test_pins_that_cannot_all_be_kept_are_refused_with_ways_out(studio):
    with pytest.raises(odori.DanceRefusedError) as caught:
        studio.dance("drum_machine", pins=["12=spin", "12.4=kick"])
    assert caught.value.conflict == ["12=spin", "12.4=kick"]
    assert caught.value.ways_out
    assert caught.value.reason.startswith("12=spin, 12.4=kick:")
    assert studio.dances.keys() == ["drum_machine|graph"]  # the dance that was there stands


def test_what_is_none_is_refused_by_its_name(shown):
    with pytest.raises(odori.OdoriError, match="want a song, got none of that name"):
        shown.dance("drum_machin")
    with pytest.raises(odori.OdoriError, match="want one of graph, matching, hmm"):
        shown.dance("drum_machine", method="tango")
    with pytest.raises(odori.OdoriError, match="12spin"):
        shown.dance("drum_machine", pins="12spin")
    with pytest.raises(odori.OdoriError, match="k: want a whole number >= 1, got 0"):
        shown.search("ayame-kick_01", k=0)
    with pytest.raises(odori.OdoriError, match="nothing to look for"):
        shown.search()
