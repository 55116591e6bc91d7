"""Stages on devices that fail, and on none: the same tables all the same."""

import pyopencl as cl
import pytest

from kernels.opencl.device import list_devices
from pipelines.commands.build_studio import build_studio
from pipelines.commands.dance_songs import dance_songs
from pipelines.resources import NoProgress
from pipelines.studio.folder import StudioFolder

pytestmark = [pytest.mark.opencl, pytest.mark.skipif(not list_devices(), reason="no OpenCL device here")]


def table(root, name, key=""):
    return StudioFolder(root).lake.table(name, key)


def build(root):
    return build_studio(root, dances=False, progress=NoProgress)


def forget_graph(root):
    for name in ("motion_graph_node", "motion_graph_edge"):
        StudioFolder(root).lake.path(name).unlink()
    (root / "lake" / "motion_graph.npz").unlink()


def refuse(*arguments, **more):
    raise cl.MemoryError("clCreateBuffer failed: MEM_OBJECT_ALLOCATION_FAILURE")


def test_a_graph_whose_devices_fail_in_the_middle_is_made_by_the_reference(built, studio, monkeypatch, capsys):
    forget_graph(studio)
    monkeypatch.setattr("kernels.opencl.pose_distance.PoseDistance.__call__", refuse)
    outcome = build(studio)
    assert outcome.status == 0
    for name in ("motion_graph_node", "motion_graph_edge"):
        assert table(studio, name).equals(table(built, name))
    notes = [note for note in outcome.facts["notes"] if "MEM_OBJECT_ALLOCATION_FAILURE" in note]
    assert len(notes) == len(list_devices())
    assert "the NumPy reference takes over" in notes[-1]
    assert capsys.readouterr().err.count("MEM_OBJECT_ALLOCATION_FAILURE") == len(list_devices())


def test_the_graph_on_the_reference_is_the_same(built, studio):
    forget_graph(studio)
    (studio / "odori.toml").write_text('[opencl]\ndevice = "reference"\n')
    assert build(studio).status == 0
    for name in ("motion_graph_node", "motion_graph_edge"):
        assert table(studio, name).equals(table(built, name))


@pytest.mark.parametrize("how", ["named", "failing"])
def test_matches_on_the_reference_are_the_same(matched, tmp_path, monkeypatch, how):
    import shutil

    root = shutil.copytree(matched, tmp_path / "studio")
    StudioFolder(root).lake.path("match", "beat").unlink()
    if how == "named":
        (root / "odori.toml").write_text('[opencl]\ndevice = "reference"\n')
    else:
        monkeypatch.setattr("kernels.opencl.match.Matcher.matches", refuse)
    outcome = dance_songs(root, ["beat"], method="matching", frame_rate_hz=None, out=None, progress=NoProgress)
    assert outcome.status == 0, outcome.troubles
    assert table(root, "match", "beat").equals(table(matched, "match", "beat"))


def test_without_opencl_a_studio_is_built_and_danced(fresh_studio, monkeypatch, capsys, built):
    monkeypatch.setattr("pipelines.device_fallback.found_devices", tuple)
    assert build(fresh_studio).status == 0
    outcome = dance_songs(fresh_studio, ["beat"], method="graph", frame_rate_hz=None, out=None, progress=NoProgress)
    assert outcome.status == 0, outcome.troubles
    assert "no OpenCL device is there" in capsys.readouterr().err
    steps = table(fresh_studio, "choreography", "beat|graph")
    assert steps.equals(table(built, "choreography", "beat|graph"))


def test_a_named_device_that_fails_is_told_and_nothing_takes_its_place(studio, monkeypatch):
    forget_graph(studio)
    (studio / "odori.toml").write_text('[opencl]\ndevice = "0"\n')
    monkeypatch.setattr("kernels.opencl.pose_distance.PoseDistance.__call__", refuse)
    outcome = build(studio)
    assert outcome.status != 0
    assert any("leave the setting out" in line for line in outcome.troubles)
