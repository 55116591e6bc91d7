import json

import pytest

from kernels.opencl.device import list_devices
from pipelines.commands import device_report
from pipelines.commands.status import studio_status
from pipelines.device_fallback import REFERENCE

pytestmark = pytest.mark.opencl


def chosen(facts):
    return [device["name"] for device in facts["devices"] if device["is_chosen"]]


def test_every_device_is_told_with_its_trial_and_exactly_one_computes(tmp_path):
    outcome = device_report.report(tmp_path / "no studio")
    assert outcome.status == 0
    assert {d["name"] for d in outcome.facts["devices"]} == {d.name.strip() for d in list_devices()} | {REFERENCE}
    assert outcome.facts["devices"][-1]["name"] == REFERENCE
    assert len(chosen(outcome.facts)) == 1
    assert (chosen(outcome.facts) == [REFERENCE]) == (not list_devices())
    for device in outcome.facts["devices"]:
        assert device.keys() >= {"name", "driver_version", "kind", "is_usable", "reason", "is_chosen"}
        assert device["is_usable"] == (device["reason"] is None)
    json.dumps(outcome.facts)


def test_a_device_that_fails_its_trial_stands_there_with_its_reason(tmp_path, monkeypatch):
    if not list_devices():
        pytest.skip("no OpenCL device here")
    monkeypatch.setattr(
        "pipelines.device_fallback.try_alone", lambda index, device: "error: unknown target CPU 'generic'"
    )
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    outcome = device_report.report(tmp_path)
    assert [d["reason"] for d in outcome.facts["devices"][:-1]] == ["error: unknown target CPU 'generic'"] * len(
        list_devices()
    )
    assert chosen(outcome.facts) == [REFERENCE]
    assert "error: unknown target CPU 'generic'" in outcome.report
    assert "apt install pocl-opencl-icd" in outcome.report


def test_the_studios_setting_counts(tmp_path):
    (tmp_path / "odori.toml").write_text('[opencl]\ndevice = "reference"\n')
    outcome = device_report.report(tmp_path)
    assert chosen(outcome.facts) == [REFERENCE]
    assert outcome.status == 0
    (tmp_path / "odori.toml").write_text('[opencl]\ndevice = "no such card"\n')
    outcome = device_report.report(tmp_path)
    assert chosen(outcome.facts) == []
    assert outcome.status == 1
    assert "want 'no such card'" in outcome.troubles[0]


def test_status_tells_devices_beside_the_studio_or_alone(built, tmp_path):
    both = studio_status(built, devices=True)
    assert {"clips", "songs", "assets", "devices"} <= both.facts.keys()
    assert "clips: 5 read" in both.report
    assert "computes" in both.report
    assert "devices" not in studio_status(built).facts
    assert set(studio_status(tmp_path / "none", devices=True).facts) == {"devices"}
