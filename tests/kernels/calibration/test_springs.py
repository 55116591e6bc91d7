import numpy as np
import pytest

from kernels.calibration.poses import body_model, gaps, to_stream
from kernels.calibration.springs import END_STIFFNESS, HOLD_STIFFNESS, relax_frame, relax_springs, spring_body
from kernels.calibration.tree_solver import BodyModel, Stream


@pytest.fixture(scope="module")
def received(made, cleaned, calibration):
    """Body, and frames as received, noise and all, where every sensor was good."""
    whole = np.flatnonzero(~cleaned.is_filled.any(axis=1))[::10]
    stream = to_stream(cleaned)
    recording = made.recording
    return body_model(calibration), Stream(
        recording.position_xyz_m[whole], recording.rotation_wxyz[whole], stream.weight[whole]
    )


def gap_rms_mm(model, stream, iterations):
    solved = relax_springs(model, stream, iterations=iterations)
    return 1000 * float(np.sqrt(np.mean(gaps(model, solved.position_xyz_m, solved.rotation_wxyz) ** 2)))


def test_few_iterations_oscillate_and_many_settle(received):
    gap = {n: gap_rms_mm(*received, n) for n in (1, 2, 3, 10, 30, 100)}
    assert max(gap[2], gap[3]) > gap[1]  # the weakness [Kitsunai2007] says of itself
    assert gap[10] < gap[3]
    assert 0.3 < gap[30] < 1.0
    assert gap[100] < 0.1


def test_the_loop_in_plain_python_gives_the_same_bits(received):
    model, stream = received
    solved = relax_springs(model, stream, iterations=5)
    for k in (0, 3, 11):
        place, turned = relax_frame(
            spring_body(model),
            model.parent,
            stream.position_xyz_m[k].tolist(),
            stream.rotation_wxyz[k].tolist(),
            iterations=5,
        )
        np.testing.assert_array_equal(place, solved.position_xyz_m[k])
        np.testing.assert_array_equal(turned, solved.rotation_wxyz[k])


def test_a_body_without_gaps_rests(perfect):
    from kernels.calibration.tree_solver import make_model

    model = make_model(perfect.body.in_parent_sensor_m, perfect.body.in_child_sensor_m)
    recording = perfect.recording
    stream = Stream(recording.position_xyz_m[:40], recording.rotation_wxyz[:40], np.ones((40, 17)))
    solved = relax_springs(model, stream, iterations=10)
    np.testing.assert_allclose(solved.position_xyz_m[:, 1:], perfect.joint_xyz_m[:40, 1:], atol=1e-9)


def test_no_frames_and_no_iterations(calibration):
    model = body_model(calibration)
    none = Stream(np.zeros((0, 17, 3)), np.zeros((0, 17, 4)), np.zeros((0, 17)))
    assert relax_springs(model, none).position_xyz_m.shape == (0, 17, 3)
    with pytest.raises(ValueError, match="iterations"):
        relax_springs(model, none, iterations=0)


def test_bones_are_weighed_about_the_mean_of_their_joints():
    """A root between two joints has none of its own; the next bone lies between its own joint and the one below."""
    offset = np.array([[0.0, 0.0, 0.0], [0.3, 0.1, 0.0], [-0.1, 0.1, 0.0], [0.0, 0.4, 0.0]])
    sensor = np.array([[0.0, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, -0.2, 0.0], [0.0, 0.02, 0.0]])
    body = spring_body(BodyModel((-1, 0, 0, 1), sensor, offset, np.ones(4), np.ones(4)))
    centre = np.array([[0.1, 0.1, 0.0], [0.0, 0.2, 0.0], [0.0, -0.1, 0.0], [0.0, 0.01, 0.0]])
    np.testing.assert_allclose(body.proximal_m, -centre)
    np.testing.assert_allclose(body.sensor_m, sensor - centre)
    np.testing.assert_allclose(body.attachment_m[1:], offset[1:] - centre[[0, 0, 1]])
    np.testing.assert_allclose(body.turnability, 1 / np.array([0.08, 0.08, 0.02, 0.002]))
    assert (body.hold == [HOLD_STIFFNESS, HOLD_STIFFNESS, END_STIFFNESS, END_STIFFNESS]).all()
