"""Screw motions: the four definitions of BK 2.6, and Chasles's theorem."""

import numpy as np
import oracles
import pytest
from scipy.spatial.transform import Rotation

import rbcourse as rb

EPS = np.finfo(float).eps
RNG = np.random.default_rng(26)
STARTS, GOALS = (
    rb.pose_from_components(Rotation.random(12, rng=RNG).as_matrix(), RNG.normal(size=(12, 3)))
    for _ in range(2)
)
SCREWS = rb.screw_se3(STARTS, GOALS)
GEODESICS = rb.geodesic_se3(STARTS, GOALS)
TIMES = np.linspace(0.1, 0.9, 5)


def rates(curve):
    return np.array([oracles.derivative_by_differences(curve, t) for t in TIMES])


@pytest.mark.source("BK 2.6", "errata 15")
def test_first_definition_the_inverse_times_the_rate_is_constant():
    """As printed, without the dot, A⁻¹A = I is constant for every curve, no screws too."""
    for curve in (SCREWS, GEODESICS):
        assert np.abs(rb.inverse_se3(curve(TIMES)) @ curve(TIMES) - np.eye(4)).max() < 1e-13
    S = rb.inverse_se3(SCREWS(TIMES)) @ rates(SCREWS)
    assert np.abs(S - S[0]).max() < 1e-11
    S = rb.inverse_se3(GEODESICS(TIMES)) @ rates(GEODESICS)
    assert np.abs(S - S[0]).max() > 0.1


@pytest.mark.source("BK 2.6")
def test_second_definition_the_twist_is_constant():
    assert np.array_equal(SCREWS(TIMES, 1), np.broadcast_to(SCREWS.twist, (5, 12, 6)))
    twist = rb.vee_se3(rb.inverse_se3(SCREWS(TIMES)) @ rates(SCREWS))
    assert np.abs(twist - SCREWS.twist).max() < 1e-11
    assert np.ptp(GEODESICS(TIMES, 1), axis=0).max() > 0.1


@pytest.mark.source("BK 2.6")
def test_third_definition_from_its_start_it_is_a_one_parameter_subgroup():
    def subgroup_defect(curve):
        from_start = rb.inverse_se3(STARTS) @ curve(np.array([0.2, 0.5, 0.7]))
        return np.abs(from_start[0] @ from_start[1] - from_start[2]).max()

    assert subgroup_defect(SCREWS) < 40 * EPS
    assert subgroup_defect(GEODESICS) > 0.1
    A = SCREWS(np.array([0.2, 0.5, 0.7]))
    assert np.abs(A[0] @ A[1] - A[2]).max() > 0.1  # A itself is none, unless A0 = I


@pytest.mark.source("BK 2.6", "errata 15")
def test_fourth_definition_the_tangents_belong_to_a_left_invariant_field():
    """Carried from A(s) to A(t) by left translation, the tangent there is the tangent here."""

    def carried_defect(curve):
        A, rate = curve(TIMES), rates(curve)
        return np.abs(A @ rb.inverse_se3(A[:1]) @ rate[:1] - rate).max()

    assert carried_defect(SCREWS) < 1e-11
    assert carried_defect(GEODESICS) > 0.1
    A = GEODESICS(TIMES)  # as printed, without the dot, every curve passes
    assert np.abs(A @ rb.inverse_se3(A[:1]) @ A[:1] - A).max() < 1e-13


@pytest.mark.source("errata 15")
def test_the_subgroup_through_a_pose_is_not_unique():
    S = np.array([0, 0, 1.0, 0.3, -0.2, 0.5])
    w, v = S[:3], S[3:]
    screw = rb.screw_from_pose(rb.exp_se3(S))
    longer = w * (1 + 2 * np.pi)
    along = screw.slide * screw.axis
    other = np.concatenate([longer, along - np.cross(longer, screw.point)])
    assert np.abs(rb.exp_se3(other) - rb.exp_se3(S)).max() < 40 * EPS
    assert np.abs(rb.exp_se3(other / 2) - rb.exp_se3(S / 2)).max() > 0.1
    assert np.abs(v - (along - np.cross(w, screw.point))).max() < 4 * EPS


def test_ends_and_acceleration():
    assert np.abs(SCREWS(0) - STARTS).max() < 8 * EPS
    assert np.abs(SCREWS(1) - GOALS).max() < 40 * EPS
    for t in (0.3, 0.6):
        speed = oracles.derivative_by_differences(
            lambda u: (SCREWS(u)[..., :3, :3] @ SCREWS(u, 1)[..., 3:, None])[..., 0], t
        )
        in_body = (np.swapaxes(SCREWS(t)[..., :3, :3], -1, -2) @ speed[..., None])[..., 0]
        assert np.abs(SCREWS(t, 2)[..., 3:] - in_body).max() < 1e-10
        assert np.all(SCREWS(t, 2)[..., :3] == 0)


@pytest.mark.source("BK 2.6")
def test_chasles_every_displacement_turns_about_an_axis_and_slides_along_it():
    screw = rb.screw_from_pose(GOALS)
    R, d = GOALS[:, :3, :3], GOALS[:, :3, 3]
    on_axis = screw.point + 3 * screw.axis
    moved = (R @ on_axis[..., None])[..., 0] + d
    assert np.abs(moved - on_axis - screw.slide[:, None] * screw.axis).max() < 100 * EPS
    assert np.abs(np.vecdot(screw.point, screw.axis)).max() < 40 * EPS
    assert np.abs(np.linalg.norm(screw.axis, axis=-1) - 1).max() < 4 * EPS
    assert np.abs(np.cos(screw.angle) - (np.trace(R, axis1=1, axis2=2) - 1) / 2).max() < 20 * EPS
    assert np.array_equal(screw.pitch, screw.slide / screw.angle)


def test_screws_of_what_does_not_turn():
    screw = rb.screw_from_pose(rb.pose_from_components(np.eye(3), [[0, 3, 4], [0, 0, 0]]))
    assert np.array_equal(screw.axis, [[0, 0.6, 0.8], [0, 0, 0]])
    assert np.all(screw.point == 0)
    assert np.array_equal(screw.slide, [5, 0])
    assert np.array_equal(screw.pitch, [np.inf, np.nan], equal_nan=True)


def test_what_turns_by_rounding_only_slides():
    B, C = Rotation.random(400, rng=RNG).as_matrix().reshape(2, 200, 3, 3)
    slide = np.array([3.0, 4, 0])
    there_and_back = B @ (np.swapaxes(B, 1, 2) @ C) @ np.swapaxes(C, 1, 2)
    rounded = rb.pose_from_components(there_and_back, slide)
    assert np.abs(rb.log_so3(there_and_back)).max() > 0
    screw = rb.screw_from_pose(rounded)
    assert np.all(screw.angle == 0)
    assert np.abs(screw.axis - slide / 5).max() < 8 * EPS
    assert np.abs(screw.slide - 5).max() < 40 * EPS
    assert np.all(screw.point == 0)
    assert np.all(np.isinf(screw.pitch))


@pytest.mark.parametrize("size", [1e-300, 1e-170, 1e170, 1e300])
def test_slides_of_any_size(size):
    screw = rb.screw_from_pose(rb.pose_from_components(np.eye(3), [0, 0.6 * size, 0.8 * size]))
    assert np.abs(screw.axis - [0, 0.6, 0.8]).max() < 4 * EPS
    assert screw.slide == pytest.approx(size, rel=4 * EPS)
    assert screw.pitch == np.inf


def test_a_small_turn_is_a_turn():
    axis = np.array([0.6, 0, 0.8])
    for angle in (1e-3, 1e-6, 1e-9):
        screw = rb.screw_from_pose(rb.exp_se3(np.append(angle * axis, 2 * axis)))
        assert np.abs(screw.axis - axis).max() < 8 * EPS / angle
        assert screw.slide == pytest.approx(2, rel=8 * EPS / angle)
        assert screw.angle == pytest.approx(angle, rel=8 * EPS / angle)


def test_the_last_row_is_not_read():
    wrong = np.eye(4)
    wrong[3] = 7
    assert np.array_equal(
        rb.screw_se3(wrong, GOALS[0])(0.3), rb.screw_se3(np.eye(4), GOALS[0])(0.3)
    )


@pytest.mark.source("BK (10)", "BK (14)")
def test_every_point_of_the_body_runs_on_a_helix_of_one_axis():
    """The distance to the axis does not change, the height grows evenly; so it is for no geodesic
    of metric (14) that turns and moves across its axis."""
    screw = rb.screw_from_pose(GOALS @ rb.inverse_se3(STARTS))

    def distance_and_height(curve):
        x = curve(TIMES)[..., :3, :3] @ np.array([0.3, -1.0, 0.5]) + curve(TIMES)[..., :3, 3]
        height = np.vecdot(x - screw.point, screw.axis)
        across = x - screw.point - height[..., None] * screw.axis
        return np.linalg.norm(across, axis=-1), height

    distance, height = distance_and_height(SCREWS)
    assert np.abs(distance - distance[0]).max() < 1e-13
    assert np.abs(np.diff(height, 2, axis=0)).max() < 1e-13
    assert np.ptp(distance_and_height(GEODESICS)[0], axis=0).min() > 1e-3
