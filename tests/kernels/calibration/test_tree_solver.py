import hashlib
from dataclasses import replace

import numpy as np
import pytest

from kernels import rotation
from kernels.calibration import tree_solver
from kernels.calibration.poses import body_model, gaps, to_stream
from kernels.calibration.tree_solver import DAMPING, KINDNESS, Stream, body_rows, make_model, solve_tree


def true_model(made):
    return make_model(made.body.in_parent_sensor_m, made.body.in_child_sensor_m)


def arithmetic_problem():
    """Some body and sensors made by arithmetic alone, so that they are the same on every processor."""
    rng = np.random.default_rng(0)
    model = make_model(rng.random((16, 3)) / 2 - 0.25, rng.random((16, 3)) / 2 - 0.25)
    q = rng.random((401, 17, 4)) - 0.5
    q[..., 0] += 2
    w, x, y, z = (q[..., k : k + 1] for k in range(4))
    q /= np.sqrt(w * w + x * x + y * y + z * z)
    return model, Stream(rng.random((401, 17, 3)) * 2, q, rng.random((401, 17)) + 0.04)


def test_perfect_sensors_give_the_true_body(perfect):
    recording = perfect.recording
    stream = Stream(recording.position_xyz_m, recording.rotation_wxyz, np.ones(recording.is_valid.shape))
    solved = solve_tree(true_model(perfect), stream)
    np.testing.assert_allclose(solved.position_xyz_m[:, 1:], perfect.joint_xyz_m[:, 1:], atol=1e-9)
    assert rotation.angle_between(solved.rotation_wxyz, perfect.sensor_wxyz).max() < 1e-7


def test_joints_are_closed_by_construction(cleaned, calibration):
    model = body_model(calibration)
    solved = solve_tree(model, to_stream(cleaned), iterations=1)
    assert gaps(model, solved.position_xyz_m, solved.rotation_wxyz).max() < 1e-12


def test_two_steps_are_enough(cleaned, calibration):
    model, stream = body_model(calibration), to_stream(cleaned)
    whole = ~cleaned.is_filled.any(axis=1)
    two, ten = (solve_tree(model, stream, iterations=n).position_xyz_m[whole] for n in (2, 10))
    assert np.abs(two - ten).max() < 5e-5


def test_a_step_is_the_least_squares_step(cleaned, calibration):
    # the cost of small changes about the answer is not less than the answer's
    model, stream = body_model(calibration), to_stream(cleaned)
    stream = Stream(stream.position_xyz_m[500:501], stream.rotation_wxyz[500:501], stream.weight[500:501])

    def kind(square, sigma):
        u = square / (3 * sigma**2)
        return 3 * 16 * u / (1 + u / 16)  # whose slope is the weight

    def cost(q, root):
        at = [root]
        for s in range(1, 17):
            at.append(at[model.parent[s]] + rotation.apply(q[model.parent[s]], model.offset_m[s]))
        at = np.stack(at) + rotation.apply(q, model.sensor_m)
        off = np.sum((stream.position_xyz_m[0] - at) ** 2, axis=-1)
        turned = rotation.angle_between(stream.rotation_wxyz[0], q) ** 2
        belief = stream.weight[0]
        return float(
            np.sum(belief * kind(off, model.position_sigma_m)) + np.sum(belief * kind(turned, model.rotation_sigma_rad))
        )

    solved = solve_tree(model, stream, iterations=60)
    q, root = solved.rotation_wxyz[0], solved.position_xyz_m[0, 0]
    least = cost(q, root)
    rng = np.random.default_rng(0)
    for _ in range(50):
        turned = rotation.mul(rotation.exp(rng.normal(0, 0.003, (17, 3))), q)
        assert cost(turned, root + rng.normal(0, 0.001, 3)) > least


def test_moving_the_world_moves_the_answer(cleaned, calibration):
    model, stream = body_model(calibration), to_stream(cleaned)
    some = Stream(stream.position_xyz_m[:50], stream.rotation_wxyz[:50], stream.weight[:50])
    turn, shift = rotation.exp(np.array([0.3, -1.0, 2.0])), np.array([1.0, 2.0, 3.0])
    moved = Stream(
        rotation.apply(turn, some.position_xyz_m) + shift, rotation.mul(turn, some.rotation_wxyz), some.weight
    )
    one, other = solve_tree(model, some), solve_tree(model, moved)
    np.testing.assert_allclose(other.position_xyz_m, rotation.apply(turn, one.position_xyz_m) + shift, atol=1e-9)


def test_a_frame_has_the_same_bits_in_any_portion(cleaned, calibration, monkeypatch):
    model, stream = body_model(calibration), to_stream(cleaned)
    some = Stream(stream.position_xyz_m[13:60], stream.rotation_wxyz[13:60], stream.weight[13:60])
    whole = solve_tree(model, stream)
    monkeypatch.setattr(tree_solver, "_PORTION", 5)
    part = solve_tree(model, some)
    np.testing.assert_array_equal(part.position_xyz_m, whole.position_xyz_m[13:60])
    np.testing.assert_array_equal(part.rotation_wxyz, whole.rotation_wxyz[13:60])


def test_the_bits_are_known():
    # they are the same on every processor: where this fails, the arithmetic changed, and stored poses with it
    solved = solve_tree(*arithmetic_problem())
    bits = (solved.position_xyz_m + 0.0).tobytes() + (solved.rotation_wxyz + 0.0).tobytes()
    assert hashlib.sha256(bits).hexdigest()[:16] == "57cce236d4ac18c3"


def test_an_origin_far_off_costs_nothing(cleaned, calibration):
    model, stream = body_model(calibration), to_stream(cleaned)
    far = 1e6  # metres, of which float64 still tells 1e-10
    one = solve_tree(model, stream)
    other = solve_tree(model, replace(stream, position_xyz_m=stream.position_xyz_m + far))
    np.testing.assert_allclose(other.position_xyz_m - far, one.position_xyz_m, rtol=0, atol=4 * far * 2.0**-52)
    np.testing.assert_allclose(other.rotation_wxyz, one.rotation_wxyz, rtol=0, atol=100 * far * 2.0**-52)


def test_a_body_is_written_in_rows():
    model = make_model(np.full((16, 3), 0.2), np.full((16, 3), -0.1), position_sigma_m=0.01, rotation_sigma_rad=0.02)
    row = body_rows(model)[1]
    np.testing.assert_allclose(row[:6], [0.1, 0.1, 0.1, 0.2, 0.2, 0.2])
    np.testing.assert_allclose(row[6:9], [0.25, 0.0625, DAMPING * 0.0625])
    np.testing.assert_allclose(row[9:], [1 / (3 * KINDNESS * 0.01**2), 1 / (3 * KINDNESS * 0.02**2)])


def test_no_frames(calibration):
    none = Stream(np.zeros((0, 17, 3)), np.zeros((0, 17, 4)), np.zeros((0, 17)))
    solved = solve_tree(body_model(calibration), none)
    assert solved.position_xyz_m.shape == (0, 17, 3)
    assert solved.rotation_wxyz.shape == (0, 17, 4)


def test_what_cannot_be_solved_is_refused(cleaned, calibration):
    model, stream = body_model(calibration), to_stream(cleaned)
    for changes, iterations, words in (
        ({"weight": np.zeros_like(stream.weight)}, 2, "weight: want > 0"),
        ({"weight": stream.weight[:5]}, 2, "weight: want"),
        ({"position_xyz_m": np.full_like(stream.position_xyz_m, np.nan)}, 2, "not finite"),
        ({}, 0, "iterations: want at least 1"),
    ):
        with pytest.raises(ValueError, match=words):
            solve_tree(model, replace(stream, **changes), iterations=iterations)
