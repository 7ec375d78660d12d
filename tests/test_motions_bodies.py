"""Motions of a body whose frame is off its centre of mass."""

import numpy as np
import oracles
import pytest

import rbcourse as rb

BODY = {
    "inertia": np.array([[0.2, 0.02, 0], [0.02, 0.3, 0.01], [0, 0.01, 0.4]]),
    "mass": 2.0,
    "centre": np.array([0.1, -0.2, 0.3]),
}


def off_centre(**body):
    A0 = rb.pose_from_coordinates([[0.1, 0.2, 0.3, 1, 0, 2], [0, 0, 0, 0, 0, 0]])
    A1 = rb.pose_from_coordinates([[1.0, -0.5, 0.4, 3, 1, 1], [0.3, 0.4, 1.0, 1, 1, 0]])
    w0, w1, v0, v1 = np.random.default_rng(8).normal(size=(4, 2, 3))
    return A0, A1, w0, w1, v0, v1, rb.minimum_acceleration_se3(A0, A1, w0, w1, v0, v1, **body)


@pytest.mark.source("beyond BK 9")
def test_the_centre_of_mass_of_a_body_runs_along_a_cubic():
    A0, A1, w0, w1, v0, v1, motion = off_centre(**BODY)
    t = np.linspace(0, 1, 21)
    centre = motion(t)[..., :3, :3] @ BODY["centre"] + motion(t)[..., :3, 3]
    fit = np.polynomial.polynomial.polyfit(t, centre.reshape(21, 6), 3)
    off = np.polynomial.polynomial.polyval(t, fit).T - centre.reshape(21, 6)
    assert np.abs(off).max() < 1e-13
    R0, R1 = A0[:, :3, :3], A1[:, :3, :3]
    alone = rb.minimum_acceleration_so3(R0, R1, w0, w1, BODY["inertia"])
    assert np.abs(motion(t)[..., :3, :3] - alone(t)).max() < 1e-13
    assert np.abs(motion([0, 1]) - [A0, A1]).max() < 1e-14
    for k, (w, v, R) in enumerate(((w0, v0, R0), (w1, v1, R1))):
        assert np.abs(motion(k, 1)[..., :3] - w).max() < 1e-13
        assert np.abs((R @ motion(k, 1)[..., 3:, None])[..., 0] - v).max() < 1e-13


def test_twist_and_acceleration_of_a_body_are_those_of_its_frame():
    *_, motion = off_centre(**BODY)
    for t in (0.2, 0.6):
        A, S, a = motion(t), motion(t, 1), motion(t, 2)
        rate = oracles.derivative_by_differences(motion, t)
        assert np.abs(rate - A @ rb.hat_se3(S)).max() < 1e-10
        rate = oracles.derivative_by_differences(lambda u: motion(u, 1), t)
        assert np.abs(rate[:, :3] - a[:, :3]).max() < 1e-10
        assert np.abs(rate[:, 3:] - (a[:, 3:] - np.cross(S[:, :3], S[:, 3:]))).max() < 1e-10
    with pytest.raises(ValueError, match="order: 0, 1 or 2 wanted, got 3"):
        motion(0.5, 3)
    assert motion[1](0.3) == pytest.approx(motion(0.3)[1], rel=1e-14)


def test_another_frame_of_the_same_body_gives_the_same_motion():
    """The frame is moved to the centre of mass, and so are the ends."""
    A0, A1, w0, w1, v0, v1, motion = off_centre(**BODY)
    r, shift = BODY["centre"], np.eye(4)
    shift[:3, 3] = r
    v = [
        v + (A[:, :3, :3] @ np.cross(w, r)[..., None])[..., 0]
        for A, w, v in ((A0, w0, v0), (A1, w1, v1))
    ]
    central = rb.minimum_acceleration_se3(
        A0 @ shift, A1 @ shift, w0, w1, *v, inertia=BODY["inertia"], mass=7
    )
    t = np.linspace(0, 1, 9)
    assert np.abs(motion(t) @ shift - central(t)).max() < 1e-12
    assert rb.acceleration_cost(motion, **BODY) == pytest.approx(
        rb.acceleration_cost(central, BODY["inertia"], BODY["mass"]), rel=1e-10
    )


@pytest.mark.source("beyond BK 9")
def test_no_motion_nearby_costs_a_body_less():
    """Perturbed by R exp(η̂) and d + ξ, η and ξ polynomials that vanish at the ends, twice."""
    *_, motion = off_centre(**BODY)
    motion, G, m, r = motion[0], *BODY.values()
    x, weights = np.polynomial.legendre.leggauss(60)
    t, rng = (x + 1) / 2, np.random.default_rng(9)
    bump = np.polynomial.Polynomial([0, 0, 1, -2, 1])

    def cost(size, eta, xi):
        def entries(t):
            R, d = motion(t)[..., :3, :3], motion(t)[..., :3, 3]
            R = R @ rb.exp_so3(size * bump(t)[:, None] * eta)
            centre = d + R @ r + size * bump(t)[:, None] * xi
            return np.concatenate([R.reshape(-1, 9), centre], axis=1)

        parts = [
            np.polynomial.Chebyshev.interpolate(lambda t, i=i: entries(t)[:, i], 50, [0, 1])
            for i in range(12)
        ]
        jets = [np.stack([(p.deriv(k) if k else p)(t) for p in parts], axis=-1) for k in range(3)]
        R, R1, R2 = (x[:, :9].reshape(-1, 3, 3) for x in jets)
        w, a = (rb.vee_so3((R.mT @ X - X.mT @ R) / 2) for X in (R1, R2))
        torque = a @ G + np.cross(w, w @ G)
        squares = np.sum(torque * (torque @ np.linalg.inv(G)), axis=-1)
        return (squares + m * np.sum(jets[2][:, 9:] ** 2, axis=-1)) @ weights / 2

    for _ in range(3):
        eta, xi = rng.normal(size=(2, 3))
        less, same, more = (cost(size, eta, xi) for size in (-0.3, 0.0, 0.3))
        assert same == pytest.approx(rb.acceleration_cost(motion, **BODY), rel=1e-8)
        assert min(less, more) > same
        slope = cost(1e-3, eta, xi) - cost(-1e-3, eta, xi)
        assert abs(slope) < 1e-5 * (less + more - 2 * same)
