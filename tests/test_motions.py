"""Motions on SE(3): a rotation curve, and a path of the origin of its own."""

import numpy as np
import oracles
import pytest
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation

import rbcourse as rb

EPS = np.finfo(float).eps
RNG = np.random.default_rng(63)
N = 8
A0, A1 = (
    rb.pose_from_components(Rotation.random(N, rng=RNG).as_matrix(), 3 * RNG.normal(size=(N, 3)))
    for _ in range(2)
)
W0, W1, V0, V1 = RNG.normal(size=(4, N, 3))
CUBICS = rb.projected_cubic_se3(A0, A1, W0, W1, V0, V1)
GEODESICS = rb.geodesic_se3(A0, A1)
OPTIMUM = rb.minimum_acceleration_se3(A0[0], A1[0], W0[0], W1[0], V0[0], V1[0])
TIMES = np.linspace(0, 1, 11)


@pytest.mark.source("BK 6.3")
def test_rotation_and_origin_each_go_their_own_way():
    path = CubicHermiteSpline([0, 1], [A0[:, :3, 3], A1[:, :3, 3]], [V0, V1])
    rotation = rb.projected_cubic_so3(A0[:, :3, :3], A1[:, :3, :3], W0, W1)
    A = CUBICS(TIMES)
    assert rb.is_se(A).all()
    assert np.array_equal(A[..., :3, :3], rotation(TIMES))
    assert np.abs(A[..., :3, 3] - path(TIMES)).max() < 40 * EPS
    assert np.array_equal(CUBICS.margin, rotation.margin)
    A = OPTIMUM(TIMES)
    optimum = rb.minimum_acceleration_so3(A0[0, :3, :3], A1[0, :3, :3], W0[0], W1[0])
    assert np.array_equal(A[..., :3, :3], optimum(TIMES))
    assert np.abs(A[..., :3, 3] - path(TIMES)[:, 0]).max() < 40 * EPS


@pytest.mark.source("BK 2.6", "BK (14)")
def test_the_geodesic_turns_as_on_so3_and_moves_straight():
    A = GEODESICS(TIMES)
    turning = rb.geodesic_so3(A0[:, :3, :3], A1[:, :3, :3])
    assert np.array_equal(A[..., :3, :3], turning(TIMES))
    straight = A0[:, :3, 3] + (A1 - A0)[:, :3, 3] * TIMES[:, None, None]
    assert np.abs(A[..., :3, 3] - straight).max() < 8 * EPS
    assert np.all(GEODESICS(TIMES, 2) == 0)
    speed = np.linalg.norm(GEODESICS(TIMES, 1)[..., 3:], axis=-1)
    assert np.abs(speed - np.linalg.norm((A1 - A0)[:, :3, 3], axis=-1)).max() < 20 * EPS


@pytest.mark.source("BK (1)", "BK (9)")
@pytest.mark.parametrize(
    "curve", [CUBICS, GEODESICS, OPTIMUM], ids=["cubic", "geodesic", "optimum"]
)
def test_twist_and_covariant_acceleration_are_what_the_protocol_says(curve):
    for t in (0.2, 0.5, 0.9):
        A, S, acceleration = curve(t), curve(t, 1), curve(t, 2)
        rate = oracles.derivative_by_differences(curve, t, 2.0**-11)
        assert np.abs(rate - A @ rb.hat_se3(S)).max() < 1e-9
        w, v = S[..., :3], S[..., 3:]
        twist_rate = oracles.derivative_by_differences(lambda u: curve(u, 1), t, 2.0**-11)
        assert np.abs(acceleration[..., :3] - twist_rate[..., :3]).max() < 1e-7
        assert np.abs(acceleration[..., 3:] - np.cross(w, v) - twist_rate[..., 3:]).max() < 1e-7


@pytest.mark.source("BK Prop. 5")
def test_moving_the_fixed_frame_moves_the_motion():
    L = rb.exp_se3([1, -2, 0.5, 3, 1, -1])
    moved = rb.projected_cubic_se3(L @ A0, L @ A1, W0, W1, V0 @ L[:3, :3].T, V1 @ L[:3, :3].T)
    off = np.abs(moved(TIMES) - L @ CUBICS(TIMES)).max(axis=(0, -2, -1))
    assert np.all(off < 1e-12 / np.minimum(CUBICS.margin, 1))


def test_the_ends_are_met():
    for t, A, w, v in ((0, A0, W0, V0), (1, A1, W1, V1)):
        assert np.abs(CUBICS(t) - A).max() < 80 * EPS
        in_body = (np.swapaxes(A[:, :3, :3], -1, -2) @ v[..., None])[..., 0]
        assert np.abs(CUBICS(t, 1) - np.concatenate([w, in_body], axis=-1)).max() < 400 * EPS
