"""Suit recordings in a studio: through the same graph as any BVH, refused with a sentence, carried over."""

import shutil
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from assets.formats import bvh, suit
from assets.tables import pack
from assets.tables.motion import to_canonical_pose
from kernels import rotation
from kernels.skeleton import kinematics
from kernels.synthetic.dancer import take
from kernels.synthetic.medley import medley, wear
from kernels.synthetic.suit_performer import Disturbance, made_up, make_body, record
from pipelines.collection import freshness
from pipelines.commands.build_studio import build_studio
from pipelines.commands.status import studio_status
from pipelines.resources import NoProgress
from pipelines.studio.folder import StudioFolder

NOISE = Disturbance(0.001, 0.01, 0.002, 0.003, 0.003)


@pytest.fixture(scope="module")
def danced():
    return medley(("step", "twist", "wave"), n_beats=8, frame_rate_hz=120.0, seed=11)


@pytest.fixture(scope="module")
def built_suit(tmp_path_factory, danced):
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("DAGSTER_HOME", raising=False)
        root = tmp_path_factory.mktemp("suits") / "studio"
        clips = root / "clips" / "suit"
        clips.mkdir(parents=True)
        body = make_body(11)
        made = record(body, wear(danced.clip, body), seed=11, disturbance=NOISE)
        (clips / "medley.parquet").write_bytes(suit.format_parquet(made.recording))
        (clips / "frozen.csv").write_bytes(suit.format_csv(made_up(3, n_frames=1000, frozen=("head",)).recording))
        (clips / "torn.csv").write_bytes(b"frame,time_s,sensor,qw\n0,0,head,1\n")
        (clips / "walk.bvh").write_bytes(bvh.format(take("rock", n_beats=8).clip))
        (clips / "clips.csv").write_text("file,label,licence\nmedley.parquet,medley,CC0-1.0\n")
        yield root, build_studio(root, dances=False, progress=NoProgress)


@pytest.fixture
def studio(built_suit, tmp_path):
    return Path(shutil.copytree(built_suit[0], tmp_path / "studio"))


def stored(root, table):
    return pq.read_table(root / "lake" / table / "suit.parquet")


def rows(root):
    return {row["path"].rsplit("/", 1)[-1]: row for row in stored(root, "clip").to_pylist()}


def test_read_or_refused_with_a_sentence(built_suit):
    root, outcome = built_suit
    assert outcome.status == 1
    found = rows(root)
    assert {name: (row["state"], row["source_format"]) for name, row in found.items()} == {
        "medley.parquet": ("read", "suit"),
        "walk.bvh": ("read", "bvh"),
        "frozen.csv": ("refused", "suit"),
        "torn.csv": ("refused", "suit"),
    }
    assert "head" in found["frozen.csv"]["reason"]
    assert "want the columns" in found["torn.csv"]["reason"]
    medley_row = found["medley.parquet"]
    assert (medley_row["frame_rate_hz"], medley_row["up_axis"], medley_row["label"]) == (120.0, "Z", "medley")
    assert medley_row["reason"] is None


def test_calibration_goes_with_the_clip_that_was_read(built_suit):
    table = stored(built_suit[0], "calibration")
    assert set(table["clip_id"].to_pylist()) == {"suit-medley"}
    assert table.num_rows == 16
    assert np.max(table["gap_after_m"].to_numpy()) < 1e-6


def test_the_dancer_in_the_suit_dances_as_the_dancer_without(built_suit, danced):
    """Canonical poses against the motion behind the recording, both seen from where the body faces."""
    clips = pack.by_clip(stored(built_suit[0], "canonical_pose"))
    found = to_canonical_pose(clips["suit-medley"])
    place, world = kinematics.place(danced.clip)
    assert found.position_xyz_m.shape == place.shape
    seen = _facing(found.position_xyz_m, found.rotation_wxyz[:, 0])
    truth = _facing(place, world[:, 0])
    away = np.linalg.norm(seen - truth, axis=-1)
    assert np.sqrt(np.mean(away**2)) < 0.08
    beats = pack.by_clip(stored(built_suit[0], "motion_beat"))["suit-medley"]
    assert beats["interval_s"][0].as_py() == pytest.approx(0.52, rel=0.02)


def _facing(place, hips):
    back = rotation.from_heading(-rotation.heading_rad(hips))
    return rotation.apply(back[:, None], place - place[:, :1])


def test_everything_is_fresh_and_status_says_what_is_doubtful(built_suit):
    root, _ = built_suit
    assert all(f.state == "fresh" for f in freshness(StudioFolder(root)).findings())
    found = studio_status(root)
    said = [(doubt["path"], doubt["warning"]) for doubt in found.facts["warnings"]]
    assert said == [("clips/suit/medley.parquet", warning) for warning in rows(root)["medley.parquet"]["warnings"]]
    assert all(f"warning: {path}: {warning}" in found.report for path, warning in said)
    assert "refused: clips/suit/frozen.csv: " in found.report


def test_a_changed_setting_calibrates_again_and_leaves_bvh_alone(studio):
    before = stored(studio, "calibration")
    (studio / "odori.toml").write_text("[calibration]\nlow_pass_hz = 6\n")
    assert any("settings [joints]" in f.why for f in freshness(StudioFolder(studio)).findings() if f.state == "stale")
    build_studio(studio, dances=False, progress=NoProgress)
    after = stored(studio, "calibration")
    assert not after["in_child_sensor_xyz_m"].equals(before["in_child_sensor_xyz_m"])
    counts = _materialised(studio, "pose")
    assert (counts["computed_clips"].value, counts["carried_clips"].value) == (3, 1)


def test_unchanged_recordings_are_carried_over_with_the_same_bytes(studio):
    before = stored(studio, "calibration")
    (studio / "clips" / "suit" / "more.bvh").write_bytes(bvh.format(take("kick", n_beats=8).clip))
    build_studio(studio, dances=False, progress=NoProgress)
    assert stored(studio, "calibration").equals(before)
    counts = _materialised(studio, "pose")
    assert (counts["computed_clips"].value, counts["carried_clips"].value) == (1, 4)
    shown = _materialised(studio, "calibration")["calibrations"].value
    assert "data:image/png;base64," in shown
    assert "| l_forearm | l_upper_arm |" in shown


def test_a_sensor_table_in_the_settings_reaches_the_reader(studio):
    place = studio / "clips" / "suit" / "torn.csv"
    text = suit.format_csv(made_up(5, n_frames=1000, disturbance=NOISE).recording).decode()
    place.write_text(text.replace(",head,", ",hat,"))
    build_studio(studio, dances=False, progress=NoProgress)
    assert "sensor 'hat'" in rows(studio)["torn.csv"]["reason"]
    (studio / "odori.toml").write_text('[sensors]\nhat = "head"\n')
    build_studio(studio, dances=False, progress=NoProgress)
    assert rows(studio)["torn.csv"]["state"] == "read", rows(studio)["torn.csv"]["reason"]


def test_a_recording_taken_away_takes_its_rows_with_it(studio):
    (studio / "clips" / "suit" / "medley.parquet").unlink()
    build_studio(studio, dances=False, progress=NoProgress)
    assert stored(studio, "calibration").num_rows == 0


def _materialised(root, asset):
    import dagster as dg

    with dg.DagsterInstance.from_config(str(root / ".dagster")) as instance:
        event = instance.get_latest_materialization_event(dg.AssetKey(asset))
    return event.asset_materialization.metadata
