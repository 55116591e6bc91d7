"""Calibrations are drawn and listed, and repeat to the byte."""

import pytest

from assets.plots import calibration as calibration_plots
from assets.sources.calibration import calibrate_recording
from assets.tables import pack
from assets.tables.calibration import from_calibration
from kernels.synthetic.suit_performer import made_up
from schemas.calibration import CALIBRATION
from schemas.settings import CalibrationSettings

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture(scope="module")
def joints():
    found = calibrate_recording(made_up(3, n_frames=600).recording, settings=CalibrationSettings())
    return from_calibration("s-take", found)


def test_calibration_is_drawn_and_listed(joints):
    data = calibration_plots.residuals(joints)
    assert data.startswith(PNG)
    assert calibration_plots.residuals(joints) == data
    table = calibration_plots.joint_table(joints)
    assert len(table.splitlines()) == 2 + 16
    assert "| l_forearm | l_upper_arm |" in table


def test_calibrations_of_a_session(joints):
    shown = calibration_plots.session(joints, ["clips/s/a.csv: doubtful"])
    assert shown.startswith("- clips/s/a.csv: doubtful")
    assert "### s-take" in shown
    assert calibration_plots.session(CALIBRATION.empty(), []) == "no suit recordings"
    many = pack.concat(CALIBRATION, [joints.set_column(0, joints.schema.field(0), [[f"s-{k}"] * 16]) for k in range(8)])
    assert "and 2 more recordings" in calibration_plots.session(many, [])
