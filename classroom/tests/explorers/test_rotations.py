"""What the explorers of rotations draw is what the package computes, wherever the sliders are."""

import numpy as np
import pytest
from sweeps import corners, numbers_in, points, read_off, sweep

import rbcourse as rb
from rbclassroom.explorers import projection_explorer, random_explorer, rotation_explorer


@pytest.fixture(scope="module")
def orientation():
    return rotation_explorer()


@pytest.fixture(scope="module")
def repairs():
    return projection_explorer()


@pytest.fixture(scope="module")
def sample():
    return random_explorer()


def tips(explorer, name):
    """The columns of a matrix whose axes are drawn."""
    lines = [points(explorer.artists[f"{name} {axis}"]) for axis in "xyz"]
    assert all((line[0] == 0).all() for line in lines)
    return np.stack([line[1] for line in lines], axis=-1)


@pytest.mark.source("RR (7)", "RR (8)", "RR 2.1")
def test_box_axes_and_turns_belong_to_the_angles(orientation):
    x, y, z = np.eye(3)
    for v in sweep(orientation):
        alpha, beta, gamma = np.radians([v["alpha"], v["beta"], v["gamma"]])
        R = rb.exp_so3(alpha * z) @ rb.exp_so3(beta * y) @ rb.exp_so3(gamma * x)
        assert np.abs(tips(orientation, "body") - R).max() < 1e-14
        faces = corners(orientation.artists["box"])
        assert np.abs(faces[0].mean(axis=0) - 0.65 * R[:, 0]).max() < 1e-14
        assert np.abs(faces[2].mean(axis=0) - 0.125 * R[:, 2]).max() < 1e-14
        turns = {"first turn": z, "second turn": rb.exp_so3(alpha * z) @ y, "third turn": R @ x}
        for name, axis in turns.items():
            line = points(orientation.artists[name])
            assert np.abs(np.cross(line, axis)).max() < 1e-14
        one = points(orientation.artists["axis"])
        assert np.abs(one @ R.T - one).max() < 1e-8  # near half-turns the axis has half the digits


def test_all_that_is_read_off_is_the_same_rotation(orientation):
    orientation.put(alpha=50.0, beta=-30.0, gamma=110.0)
    said = read_off(orientation)
    R = rb.matrix_from_zyx(np.radians([50, -30, 110]))
    matrix = np.array([line.split() for line in said["matrix"].splitlines()], dtype=float)
    assert np.abs(matrix - R).max() <= 0.00051
    q = np.array(said["quaternion"].split(","), dtype=float)
    assert np.abs(rb.matrix_from_quaternion(rb.project_quaternion(q)) - R).max() < 0.03
    axis = np.array(said["axis"].split(","), dtype=float)
    angle = np.radians(float(said["angle"].rstrip("°")))
    assert np.abs(rb.exp_so3(angle * axis) - R).max() < 0.03
    assert np.degrees(angle) == pytest.approx(np.degrees(np.linalg.norm(rb.log_so3(R))), abs=0.051)


@pytest.mark.source("RR (8)")
def test_gimbal_lock_is_said_where_two_axes_coincide_and_nowhere_else(orientation):
    for v in sweep(orientation):
        assert ("gimbal lock" in read_off(orientation)) == (abs(v["beta"]) == 90)
    for beta, sign in ((90.0, 1), (-90.0, -1)):
        orientation.put(alpha=20.0, beta=beta, gamma=50.0)
        before, said = tips(orientation, "body"), read_off(orientation)["gimbal lock"]
        orientation.put(alpha=30.0, gamma=50.0 + sign * 10)
        assert np.abs(tips(orientation, "body") - before).max() < 1e-14
        assert read_off(orientation)["gimbal lock"] == said
        assert f"{20 - sign * 50}°" in said


def test_at_rest_there_is_no_axis(orientation):
    orientation.put(alpha=0.0, beta=0.0, gamma=0.0)
    assert read_off(orientation)["axis"] == "any"
    assert not points(orientation.artists["axis"]).any()


@pytest.mark.source("BK Prop. 2")
def test_matrices_and_their_repairs(repairs):
    for v in sweep(repairs, pull=1.0, e23=-0.3):
        E = np.array([[0, v["e12"], 0], [0, 0, v["e23"]], [0, 0, v["e33"]]])
        M = np.eye(3) + v["pull"] * E
        R, G, said = tips(repairs, "nearest"), tips(repairs, "Gram–Schmidt"), read_off(repairs)
        assert np.abs(tips(repairs, "M") - M).max() < 1e-15
        S = R.T @ M
        eigenvalues = np.linalg.eigvalsh(S)
        assert np.abs(S - S.T).max() < 1e-14  # nearest, by definition
        assert eigenvalues[:2].sum() > -1e-14
        assert np.linalg.det(R) > 0
        letter = repairs.artists["nearest x letter"].get_position_3d()
        assert np.abs(letter - 1.15 * R[:, 0]).max() < 1e-14
        singular, det = np.linalg.svd(M, compute_uv=False), np.linalg.det(M)
        assert np.abs(numbers_in(said["singular values"]) - singular).max() < 0.0051
        assert float(said["determinant"]) == pytest.approx(det, abs=0.0051)
        assert float(said["M to nearest"]) == pytest.approx(np.linalg.norm(M - R), abs=5.1e-4)
        if abs(det) < 1e-12:
            assert not G.any()
            assert said["M to Gram–Schmidt"] == "none: M is flat"
            continue
        Q, triangle = np.linalg.qr(M)
        assert np.abs(G - Q * np.sign(np.diag(triangle))).max() < 1e-12
        if det < 0:
            assert (said["M to Gram–Schmidt"], said["angle between"]) == ("a mirror", "none")
            continue
        assert float(said["M to Gram–Schmidt"]) == pytest.approx(np.linalg.norm(M - G), abs=5.1e-4)
        between = np.degrees(np.linalg.norm(rb.log_so3(R.T @ G)))
        assert float(said["angle between"].rstrip("°")) == pytest.approx(between, abs=0.051)


def test_a_flat_matrix_has_a_nearest_rotation_and_one_half_way_to_a_mirror_several(repairs):
    repairs.put(e12=0.8, e23=0.0, e33=-1.0, pull=1.0)
    assert read_off(repairs)["M to Gram–Schmidt"] == "none: M is flat"
    assert "nearest?" not in read_off(repairs)
    repairs.put(e12=0.0, e33=-2.0)
    assert read_off(repairs)["nearest?"] == "several are equally near"
    repairs.put(e33=-1.9)
    assert "nearest?" not in read_off(repairs)


def test_the_poll_is_not_answered_before_it_is_touched(repairs):
    repairs.restart()
    assert np.abs(tips(repairs, "nearest") - np.eye(3)).max() < 1e-15


@pytest.mark.source("RR 2.1", "RR 2.2")
def test_dots_and_histogram_are_of_the_first_rotations(sample):
    samplers = {"three angles": rb.sampling.sample_rotation_naive, "uniform": rb.sample_rotation}
    for v in sweep(sample):
        R = samplers[v["sampler"]](2000, rng=int(v["seed"]))[: int(v["number"])]
        e1 = R[:, :, 0]
        assert np.array_equal(points(sample.artists["points"]), e1)
        density, edges, _ = sample.artists["histogram"].get_data()
        counts, _ = np.histogram(e1[:, 2], edges)
        assert np.abs(density * np.diff(edges) - counts / len(R)).max() < 1e-14
        said, caps = read_off(sample), np.mean(np.abs(e1[:, 2]) > 0.5)
        assert numbers_in(said["|height| > ½"])[0] == pytest.approx(100 * caps, abs=0.051)
        assert density.max() < sample.artists["histogram"].axes.get_xlim()[1]
        for name in ("image of e₁", "angle") if len(R) >= 100 else ():
            p = rb.sampling.uniformity_tests(R)[name].p_value
            if p < 1e-6:
                assert said[f"p, {name}"] == "< 1e-6: not uniform"
            else:
                assert float(said[f"p, {name}"]) == pytest.approx(p, rel=0.051)


def test_too_few_have_no_p_value(sample):
    sample.put(number=80.0)
    assert read_off(sample)["p-values"] == "from 100 rotations on"
