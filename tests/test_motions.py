"""Test motions on SE(3): separate curves for rotation and origin, bodies, and screws."""

import numpy as np
import oracles
import pytest
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation

import rbcourse as rb

EPS = np.finfo(float).eps
RNG, FORMS = np.random.default_rng(63), rb.closed_forms.FORMS.values()
N = 8
A0, A1 = (
    rb.pose_from_components(Rotation.random(N, RNG).as_matrix(), 3 * RNG.normal(size=(N, 3)))
    for _ in range(2)
)
RATES = RNG.normal(size=(4, N, 3))
GEODESICS, SCREWS = rb.geodesic(A0, A1), rb.screw(A0, A1)
TIMES = np.linspace(0, 1, 11)
TWISTS = [rb.twist_from_rates(A, *RATES[k::2]) for k, A in enumerate((A0, A1))]
INERTIA = np.array([[0.2, 0.02, 0], [0.02, 0.3, 0.01], [0, 0.01, 0.4]])
BODY = rb.Body(INERTIA, mass=2.0, centre=[0.1, -0.2, 0.3])


def on_so3(make, *more, **options):
    return make(A0[:, :3, :3], A1[:, :3, :3], *more, **options)


def turned(A, v):
    return (A[..., :3, :3] @ v[..., None])[..., 0]


@pytest.mark.source("BK 6.3", "BK (1)", "BK (9)", "BK 2.6", "BK (14)")
@pytest.mark.parametrize("make", [rb.geodesic, *FORMS, rb.minimum_acceleration])
def test_rotation_and_origin_follow_separate_curves(make):
    """The origin moves on a cubic or, for a geodesic, on a line at constant speed."""
    at_rates = make is not rb.geodesic
    motion = make(A0, A1, *TWISTS[: 2 * at_rates])
    rotation = on_so3(make, *RATES[: 2 * at_rates])
    slopes = RATES[2:] if at_rates else [(A1 - A0)[:, :3, 3]] * 2
    path = CubicHermiteSpline([0, 1], [A0[:, :3, 3], A1[:, :3, 3]], slopes)
    A = motion(TIMES)
    assert rb.is_se(A).all()
    assert np.array_equal(A[..., :3, :3], rotation(TIMES))
    assert np.abs(A[..., :3, 3] - path(TIMES)).max() < 40 * EPS
    assert np.array_equal(motion.margin, rotation.margin)
    for order in (1, 2):
        assert np.array_equal(motion(TIMES, order)[..., :3], rotation(TIMES, order))
        assert np.abs(turned(A, motion(TIMES, order)[..., 3:]) - path(TIMES, order)).max() < 1e-13
    assert at_rates or not motion(TIMES, 2).any()


@pytest.mark.source("beyond BK 9")
@pytest.mark.parametrize(
    "make", [rb.projected_cubic, rb.minimum_acceleration, rb.closed_forms.normal_cubic]
)
def test_the_centre_of_mass_of_a_body_follows_a_cubic(make):
    """The twist refers to the body frame, whose origin is not the centre of mass."""
    t, (w0, w1, *v) = np.linspace(0, 1, 21), RATES
    motion, r = make(A0, A1, *TWISTS, body=BODY), BODY.centre
    A = motion(t)
    centre = (A[..., :3, :3] @ r + A[..., :3, 3]).reshape(21, -1)
    fit = np.polynomial.polynomial.polyfit(t, centre, 3)
    assert np.abs(np.polynomial.polynomial.polyval(t, fit).T - centre).max() < 1e-13
    alone = on_so3(make, w0, w1, body=BODY)
    assert np.abs(A[..., :3, :3] - alone(t)).max() < 1e-13
    assert np.abs(A[[0, -1]] - [A0, A1]).max() < 1e-14
    S = motion([0, 1], 1)
    assert np.abs(S[..., :3] - [w0, w1]).max() < 1e-13
    assert np.abs(turned(A[[0, -1]], S[..., 3:]) - v).max() < 1e-13
    heavy = rb.Body(INERTIA, mass=7.0, centre=r)
    assert np.array_equal(make(A0, A1, *TWISTS, body=heavy)(t), A)


@pytest.mark.source("BK 2.6", "errata 15", "errata 27")
def test_only_screws_satisfy_each_definition_of_a_screw_motion():
    """A⁻¹ A' and the twist are constant, A0⁻¹ A is a subgroup, and A' is a left-invariant field.
    The printed definitions lack the dot, or A0⁻¹."""
    found, inside = [], TIMES[1:-1]
    for curve in (SCREWS, GEODESICS):
        A, rate = curve(inside), oracles.derivative_by_differences(curve, inside)
        S, twist = rb.inverse_se3(A) @ rate, curve(TIMES, 1)
        a, b, ab = rb.inverse_se3(A0) @ curve([0.2, 0.5, 0.7])
        carried = A @ rb.inverse_se3(A[:1])
        defects = S - S[0], twist - twist[0], a @ b - ab, carried @ rate[:1] - rate
        found.append([np.abs(one).max() for one in defects])
        for printed in (rb.inverse_se3(A) @ A - np.eye(4), carried @ A[:1] - A):
            assert np.abs(printed).max() < 1e-13
    assert np.all(np.array(found[0]) <= [1e-11, 0, 40 * EPS, 1e-11])
    assert np.all(np.array(found[1]) > 0.1)
    A, rate = SCREWS(inside), oracles.derivative_by_differences(SCREWS, inside)
    assert np.abs(rb.vee_se3(rb.inverse_se3(A) @ rate) - SCREWS.twist).max() < 1e-11
    assert np.array_equal(SCREWS(0, 1), SCREWS.twist)
    a, b, ab = SCREWS([0.2, 0.5, 0.7])
    assert np.all(np.abs(a @ b - ab).max(axis=(-2, -1)) > 0.1)


@pytest.mark.source("BK (1)", "BK 3.2", "errata 34")
def test_the_twist_and_its_metric_contain_the_derivatives_of_the_pose():
    """Without their dots, the printed Rᵀ d is a position, and the printed trace is not 0 for a body
    at rest."""
    t = TIMES[1:-1]
    A, rate = SCREWS(t), oracles.derivative_by_differences(SCREWS, t)
    R, d, d_dot = A[..., :3, :3], A[..., :3, 3:], rate[..., :3, 3:]
    v = SCREWS(t, 1)[..., 3:, None]
    assert np.abs(R.mT @ d_dot - v).max() < 1e-11
    assert np.abs(R.mT @ d - v).max() > 0.1
    squares = rb.metrics.inner_se3(rate, rate)
    assert np.abs(np.sum(rate**2, axis=(-2, -1)) - squares).max() < 1e-10 * squares.max()
    assert np.sum(A**2, axis=(-2, -1)).min() > 3.9  # tr(AᵀA), also for a body at rest


@pytest.mark.source("errata 25")
def test_the_subgroup_through_a_pose_is_not_unique():
    S = np.array([0, 0, 1.0, 0.3, -0.2, 0.5])
    screw, w = rb.screw_from_pose(rb.exp_se3(S)), S[:3]
    along, longer = screw.slide * screw.axis, w * (1 + 2 * np.pi)
    other = np.concatenate([longer, along - np.cross(longer, screw.point)])
    assert np.abs(rb.exp_se3(other) - rb.exp_se3(S)).max() < 40 * EPS
    assert np.abs(rb.exp_se3(other / 2) - rb.exp_se3(S / 2)).max() > 0.1
    assert np.abs(S[3:] - (along - np.cross(w, screw.point))).max() < 4 * EPS


@pytest.mark.source("BK 2.6")
def test_every_displacement_is_a_screw():
    screw = rb.screw_from_pose(A1)
    on_axis = screw.point + 3 * screw.axis
    moved = turned(A1, on_axis) + A1[:, :3, 3]
    assert np.abs(moved - on_axis - screw.slide[:, None] * screw.axis).max() < 100 * EPS
    assert np.abs(np.vecdot(screw.point, screw.axis)).max() < 40 * EPS
    assert np.abs(np.linalg.norm(screw.axis, axis=-1) - 1).max() < 4 * EPS
    trace = np.trace(A1[:, :3, :3], axis1=1, axis2=2)
    assert np.abs(np.cos(screw.angle) - (trace - 1) / 2).max() < 20 * EPS
    assert np.array_equal(screw.pitch, screw.slide / screw.angle)
    axis = np.array([0.6, 0, 0.8])
    for angle in (1e-3, 1e-6, 1e-9):
        screw = rb.screw_from_pose(rb.exp_se3(np.append(angle * axis, 2 * axis)))
        assert np.abs(screw.axis - axis).max() < 8 * EPS / angle
        assert [screw.slide, screw.angle] == pytest.approx([2, angle], rel=8 * EPS / angle)


def test_displacements_that_turn_only_by_rounding_errors_are_translations():
    still = rb.screw_from_pose(np.eye(4))
    assert not np.any([*still.axis, *still.point, still.angle, still.slide])
    assert np.isnan(still.pitch)
    B, C = Rotation.random(400, RNG).as_matrix().reshape(2, 200, 3, 3)
    rounded = B @ (B.mT @ C) @ C.mT
    assert np.abs(rb.log_so3(rounded)).max() > 0
    exact = [(np.eye(3), size, 4 * EPS) for size in (1e-300, 1e-170, 1, 1e170, 1e300)]
    for R, size, off in ((rounded, 5, 8 * EPS), *exact):
        screw = rb.screw_from_pose(rb.pose_from_components(R, size * np.array([0, 0.6, 0.8])))
        assert not np.any(screw.angle)
        assert not np.any(screw.point)
        assert np.abs(screw.axis - [0, 0.6, 0.8]).max() < off
        assert screw.slide == pytest.approx(size, rel=off)
        assert np.all(screw.pitch == np.inf)
