"""A made-up recording and what calibration makes of it, once for all tests."""

import pytest

from kernels.calibration.calibrate import calibrate
from kernels.calibration.cleaning import clean
from kernels.calibration.joints import solve_joints
from kernels.calibration.poses import solve_poses
from kernels.synthetic import suit_performer


@pytest.fixture(scope="session")
def made():
    return suit_performer.made_up(7, n_frames=3000)


@pytest.fixture(scope="session")
def cleaned(made):
    return clean(made.recording)


@pytest.fixture(scope="session")
def pairs(cleaned):
    return solve_joints(cleaned)


@pytest.fixture(scope="session")
def calibration(cleaned):
    return calibrate(cleaned)


@pytest.fixture(scope="session")
def poses(cleaned, calibration):
    return solve_poses(cleaned, calibration)


@pytest.fixture(scope="session")
def perfect():
    """Without noise, outliers or gaps."""
    return suit_performer.made_up(8, n_frames=3000, disturbance=suit_performer.CLEAN)
