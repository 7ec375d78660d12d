import re
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.integrate

import rbcourse as rb
from rbcourse.connection import christoffel, covariant_derivative, structure_constants

EPS = np.finfo(float).eps
BASES = {3: rb.connection.BASIS_SO3, 6: rb.connection.BASIS_SE3}
both_groups = pytest.mark.parametrize("m", BASES)
TIMES = np.linspace(0, 10, 21)
ONE, INERTIA = np.eye(3), np.diag([1.0, 2, 3])


def metrics(m, count=100, definite=True):
    X = np.random.default_rng(m).normal(size=(count, m, m))
    return X @ X.mT if definite else X + X.mT


def momentum(G, A, v):
    """Return the momentum in the fixed frame, where it is conserved (Noether)."""
    adjoint = rb.adjoint_se3(A) if A.shape[-1] == 4 else A
    return np.linalg.solve(adjoint.mT, (v @ G)[..., None])[..., 0]


@pytest.mark.source("BK (2)", "BK (3)", "BK 2.4")
@pytest.mark.parametrize("condition", [1, 1e3, 1e5])
def test_structure_constants_give_the_commutators_in_bases_of_any_scale(condition):
    for m, basis in BASES.items():
        C = structure_constants(basis)
        for i, j in np.ndindex(m, m):
            bracket = basis[i] @ basis[j] - basis[j] @ basis[i]
            assert np.array_equal(np.einsum("k,kab->ab", C[:, i, j], basis), bracket)
    Q, P = np.linalg.qr(np.random.default_rng(0).normal(size=(2, 6, 6)))[0]
    change = (Q * np.geomspace(1, 1 / condition, 6)) @ P
    wanted = np.einsum("kc,kij,ai,bj->cab", np.linalg.inv(change), C, change, change)
    C = structure_constants(np.einsum("ij,jab->iab", change, rb.connection.BASIS_SE3))
    assert np.abs(C - wanted).max() < 1e-13 * condition
    sizes = np.array([1e-150, 1.0, 1e120])[:, None, None]
    C, unit = (structure_constants(size * rb.connection.BASIS_SO3) for size in (sizes, 1))
    wanted = unit * sizes[:, 0] * sizes[:, 0, 0] / sizes
    assert np.allclose(C, wanted, rtol=4 * EPS, atol=0)


@pytest.mark.source("BK 2.4", "BK (8)")
@both_groups
@pytest.mark.parametrize("definite", [True, False])
def test_the_connection_is_the_levi_civita_connection(m, definite):
    """The product rule d/dt ⟨x, y⟩ = ⟨Dx/dt, y⟩ + ⟨x, Dy/dt⟩ is tested, too."""
    G, C = metrics(m, definite=definite), structure_constants(BASES[m])
    gamma, condition = christoffel(G, BASES[m]), np.linalg.cond(G)
    bound = 1e-14 * condition[:, None, None, None]
    assert np.all(np.abs(gamma - gamma.mT - C) < bound)
    lowered = np.einsum("bil,bljk->bijk", G, gamma)
    # the derivative of ⟨L_i, L_k⟩ along L_j, which must be 0
    change = lowered + lowered.transpose(0, 3, 2, 1)
    assert np.all(np.abs(change) < bound * np.abs(G).max(axis=(-2, -1))[:, None, None, None])
    v, x, y, dx, dy = np.random.default_rng(4).normal(size=(5, 100, m))

    def products(a, b):
        return np.einsum("bij,bi,bj->b", G, a, b)

    Dx, Dy = (covariant_derivative(gamma, v, *z) for z in ((x, dx), (y, dy)))
    off = products(Dx, y) + products(x, Dy) - products(dx, y) - products(x, dy)
    assert np.all(np.abs(off) < 1e-13 * condition * np.linalg.norm(G, axis=(-2, -1)))


@pytest.mark.source("BK (9)", "BK 2.4")
def test_the_connection_of_a_bi_invariant_metric_is_half_the_commutator():
    C = structure_constants(rb.connection.BASIS_SO3)
    for size in (2, 1e-320, 1e-310, 1e-200, 1e200, 1e308):
        assert np.array_equal(christoffel(size * np.eye(3), rb.connection.BASIS_SO3), C / 2)
    C = structure_constants(rb.connection.BASIS_SE3)
    gamma = christoffel(rb.metrics.semi_riemannian_metric_se3(2, 3), rb.connection.BASIS_SE3)
    assert np.abs(gamma - C / 2).max() < 4 * EPS


@pytest.mark.source("BK (9)", "BK (14)", "BK 2.4")
@pytest.mark.parametrize(
    ("G", "exp"), [(rb.metrics.METRIC_SO3, rb.exp_so3), (rb.metrics.METRIC_SE3, rb.exp_se3)]
)
def test_the_acceleration_is_the_tangential_part_of_the_second_derivative(G, exp):
    """The metrics (12) and (14) are induced by a flat metric. A'' is computed by differences, not
    from Γ."""
    start, v, a = np.random.default_rng(2).normal(size=(3, len(G)))
    h, A0 = 1e-4, exp(start)
    before, at, after = (A0 @ exp(v * t + a * t**2 / 2) for t in (-h, 0, h))
    projected = rb.metrics.components_from_tangent(A0, (before - 2 * at + after) / h**2)
    gamma = christoffel(G, BASES[len(G)])
    assert np.abs(covariant_derivative(gamma, v, v, a) - projected).max() < 1e-6


@pytest.mark.source("BK 2.4", "errata 22")
def test_the_covariant_derivative_is_along_the_velocity():
    """The point A is not a tangent vector at A: its rotational components are 0, so no vector would
    turn along A."""
    A, S = rb.exp_se3([1, 2, 3, 4, 5, 6]), np.array([0, 0, 2.0, 3, 0, 0])
    gamma = christoffel(rb.metrics.METRIC_SE3, rb.connection.BASIS_SE3)
    printed = rb.metrics.components_from_tangent(A, A)
    corrected = rb.metrics.components_from_tangent(A, rb.metrics.tangent_from_components(A, S))
    assert np.abs(printed[:3]).max() < 8 * EPS
    at = (covariant_derivative(gamma, x, S, 0 * S) for x in (corrected, printed))
    # the acceleration of the origin on a circle: ω × v
    off = [np.abs(x - [0, 0, 0, 0, 6, 0]).max() for x in at]
    assert off[0] < 1e-13
    assert off[1] > 1


@pytest.mark.source("BK (8)")
@both_groups
def test_energy_and_momentum_are_conserved(m):
    """The relative error of the energy is small over ten units of time, at condition numbers up to
    1e4."""
    rng, h = np.random.default_rng(5), 1e-4
    G, v0 = metrics(m, 40), rng.normal(size=(2, m))
    G = G[np.linalg.cond(G) < 1e4][:2]
    _, v = rb.connection.geodesic_flow(G, np.eye(2 + m // 3), v0, TIMES)
    energy = np.einsum("tbi,bij,tbj->tb", v, G, v)
    assert np.abs(energy / energy[0] - 1).max() < 1e-9
    G, A0 = G[0] + np.eye(m), [rb.exp_so3, rb.exp_se3][m // 6](rng.normal(size=m))
    A, v = rb.connection.geodesic_flow(G, A0, v0[0], np.linspace(-3, 3, 13)[:, None] + [-h, 0, h])
    slopes = rb.metrics.components_from_tangent(A[:, 1], (A[:, 2] - A[:, 0]) / (2 * h))
    assert np.abs(slopes - v[:, 1]).max() < 1e-5
    assert np.abs(momentum(G, A, v) - momentum(G, A, v)[0, 0]).max() < 1e-10
    assert (rb.is_so if m == 3 else rb.is_se)(A, 1e-13).all()


@pytest.mark.source("BK (8)", "errata 13", "errata 26")
def test_the_printed_geodesic_equation_is_wrong_for_the_free_body():
    """The printed equation has Γ^i_ik instead of Γ^i_jk. It also has ä, the derivative in
    coordinates, where the symbols Γ of the frame need ẇ."""
    turn = rb.exp_so3([0.4, -0.3, 0.5])
    inertia, w, h = turn @ INERTIA @ turn.T, np.array([1.0, 2, 3]), 1e-4
    gamma = christoffel(inertia, rb.connection.BASIS_SO3)
    euler = np.linalg.solve(inertia, np.cross(inertia @ w, w))
    assert np.abs(-np.einsum("ijk,j,k->i", gamma, w, w) - euler).max() < 40 * EPS
    # the printed j may be a summation index, or may stand for i
    for reading in ("iik,j,k->i", "iik,i,k->i"):
        printed = -np.einsum(reading, gamma, w, w)
        assert np.abs(printed).max() > 0.1
        assert np.abs(printed - euler).max() > 1
    _, after = rb.connection.geodesic_flow(inertia, ONE, w, h)
    assert np.abs((after - w) / h - euler).max() < 1e-2
    ways, _ = rb.connection.geodesic_flow(rb.metrics.METRIC_SO3, turn, w, [-h, 0, h])
    # these are coordinates along the geodesic
    before, at, ahead = rb.log_so3(ways)
    velocity, acceleration = (ahead - before) / (2 * h), (before - 2 * at + ahead) / h**2
    frame = christoffel(rb.metrics.METRIC_SO3, rb.connection.BASIS_SO3)
    assert np.abs(acceleration + np.einsum("ijk,j,k->i", frame, velocity, velocity)).max() > 0.1


def steady_and_straight(S):
    return rb.pose_from_components(rb.exp_so3(S[..., :3]), S[..., 3:])


@pytest.mark.source("BK (10)", "BK (14)", "BK 2.5", "BK 2.6")
@pytest.mark.parametrize(
    ("G", "exp", "constant", "tolerance"),
    [
        (rb.metrics.METRIC_SO3, rb.exp_so3, 3, 1e-12),
        (rb.metrics.semi_riemannian_metric_se3(2, 3), rb.exp_se3, 6, 1e-10),
        (rb.metrics.METRIC_SE3, steady_and_straight, 3, 1e-10),
    ],
)
def test_geodesics_of_bi_invariant_metrics_are_one_parameter_subgroups(G, exp, constant, tolerance):
    v0 = np.random.default_rng(8).normal(size=(5, len(G)))
    A, v = rb.connection.geodesic_flow(G, exp(0 * v0[0]), v0, TIMES)
    assert np.abs(v - v0)[..., :constant].max() < 1e-12
    assert np.abs(A - exp(TIMES[:, None, None] * v0)).max() < tolerance


def test_geodesics_are_evaluated_at_times_in_any_order():
    start, spin = rb.exp_so3([1, 2, 3]), [0.3, 2, -1]
    t = np.array([[2.0, -1, 0], [2, 0.5, -3]])
    R, w = rb.connection.geodesic_flow(INERTIA, start, spin, t)
    assert R.shape == (2, 3, 3, 3)
    assert np.array_equal(w[0, 2], spin)
    assert np.array_equal(w[0, 0], w[1, 0])
    for i in np.ndindex(2, 3):
        assert (
            np.abs(R[i] - rb.connection.geodesic_flow(INERTIA, start, spin, t[i])[0]).max() < 1e-11
        )
    back, _ = rb.connection.geodesic_flow(INERTIA, R[0, 0], w[0, 0], -2)
    assert np.abs(back - start).max() < 1e-11
    crowd, _ = rb.connection.geodesic_flow(INERTIA, start, [spin] + [[0.01, 0, 0]] * 399, 10)
    # the error of a batch may be √400 times as large
    alone, _ = rb.connection.geodesic_flow(INERTIA, start, spin, 10)
    assert np.abs(crowd[0] - alone).max() < 20 * 1e-12
    assert rb.connection.geodesic_flow(INERTIA, start, spin, [])[0].shape == (0, 3, 3)
    assert rb.connection.geodesic_flow(np.ones((0, 3, 3)), start, spin, 1)[0].shape == (0, 3, 3)


def test_the_scale_of_velocities_and_metrics_does_not_matter():
    """γ_sv(t) = γ_v(st) holds for single geodesics and in a batch, also at extreme scales."""
    w0 = np.array([0.3, 2, -1])
    R, w = rb.connection.geodesic_flow(INERTIA, ONE, w0, 3)
    for s in (1e-8, 1e8):
        A, v = rb.connection.geodesic_flow(INERTIA, ONE, s * w0, 3 / s)
        assert np.abs(A - R).max() < 1e-11
        assert np.abs(v / s - w).max() < 1e-11
    A, _ = rb.connection.geodesic_flow(INERTIA, ONE, np.array([[1], [1e-8], [0]]) * w0, 3)
    assert np.abs(A[:2] - [R, rb.exp_so3(3e-8 * w0)]).max() < 1e-11
    for speed, t in ((1e-320, 1), (1e-310, 1), (1e200, 1e-200)):
        A, v = rb.connection.geodesic_flow(INERTIA, ONE, [speed, 0, 0], t)
        assert np.abs(A - rb.exp_so3([speed * t, 0, 0])).max() < 1e-12
        assert np.abs(v / speed - [1, 0, 0]).max() < 1e-6
    for size in (1e-320, 1e-310, 1e-200, 1e200, 1e307):
        _, v = rb.connection.geodesic_flow(np.diag(np.array([1, 2, 3]) * size), ONE, w0, 3)
        assert np.abs(v - w).max() < (1e-11 if size > 1e-300 else 1e-2)


def test_the_momentum_is_conserved_even_if_velocities_grow():
    G = np.linalg.inv(np.kron([[0, 1], [1, 0]], np.diag([2, 0.5, 1])))
    v0 = np.linalg.solve(G, [1, 1, 0, 0, 0, 1])
    A, v = rb.connection.geodesic_flow(G, np.eye(4), v0, [0, 10, 20])
    speeds = np.linalg.norm(v, axis=-1)
    assert np.all(speeds[1:] > 10 * speeds[:-1])
    off = np.abs(momentum(G, A, v) - momentum(G, A, v)[0]).max(axis=-1)
    assert np.all(off < 1e-10 * speeds * np.linalg.norm(rb.adjoint_se3(A), axis=(-2, -1)))


def test_a_start_near_the_group_is_projected_onto_the_group():
    start = rb.exp_so3([1, 2, 3]) + 1e-8
    R, _ = rb.connection.geodesic_flow(INERTIA, start, [0.3, 2, -1], TIMES)
    assert np.abs(R[0] - rb.project_so(start)).max() < 4 * EPS
    assert np.abs(R.mT @ R - ONE).max() < 10 * EPS
    longer = 1 + 4e-7  # without the projection, the speed would be larger by this factor
    A, _ = rb.connection.geodesic_flow(
        np.eye(6), np.diag([longer] * 3 + [1]), [0, 0, 0, 1, 0, 0], 3
    )
    assert np.abs(A[:3, 3] - [3, 0, 0]).max() < 1e-12


def test_a_fast_translation_does_not_disturb_the_rotation():
    """The body travels 1e8 units of length per unit of time; the unit of length must not matter."""
    G = np.diag([1.0, 2, 3, 1, 1, 1])
    _, w = rb.connection.geodesic_flow(INERTIA, ONE, [1, 2, 3], TIMES)
    A, v = rb.connection.geodesic_flow(G, np.eye(4), [1, 2, 3, 1e8, 0, 0], TIMES)
    assert np.abs(v[:, :3] - w).max() < 1e-11
    assert np.abs(A[:, :3, 3] - TIMES[:, None] * [1e8, 0, 0]).max() < 1e-11 * 1e9
    A, v = rb.connection.geodesic_flow(G, np.eye(4), np.zeros(6), TIMES)
    assert not np.any(A - np.eye(4))
    assert not v.any()


def test_a_failed_integration_raises_an_error(monkeypatch):
    failed = SimpleNamespace(success=False, message="the step is too small")
    monkeypatch.setattr(scipy.integrate, "solve_ivp", lambda *_, **__: failed)
    with pytest.raises(FloatingPointError, match="followed to its end: the step is too small"):
        rb.connection.geodesic_flow(INERTIA, ONE, [1, 2, 3], [1, 5])


L1, L2, L3 = rb.connection.BASIS_SO3
NEARLY_SO3 = [L1 + 1e-7 * ONE, L2, L3 + 1e-10]


@pytest.mark.parametrize(
    ("function", "arguments", "message"),
    [
        ("structure_constants", (ONE,), "basis: shape (m, n, n) is wanted"),
        ("structure_constants", ([np.eye(2), 2 * np.eye(2)],), "linearly dependent"),
        ("structure_constants", ([1e6 * ONE, L1, L2],), "a commutator of two"),
        ("structure_constants", (NEARLY_SO3,), "a commutator of two"),
        ("christoffel", (np.eye(6), rb.connection.BASIS_SO3), "G: shape (..., 3, 3) is wanted"),
        ("christoffel", (np.eye(3, k=1), rb.connection.BASIS_SO3), "G is not symmetric"),
        ("christoffel", (np.ones((3, 3)), rb.connection.BASIS_SO3), "G is singular"),
        ("geodesic_flow", (ONE, [ONE] * 2, ONE, 1), "broadcast: G (), A0 (2,), v0 (3,)"),
        ("geodesic_flow", (ONE, ONE, np.ones(6), 1), "v0: shape (..., 3)"),
        ("geodesic_flow", (ONE, np.eye(2), [1], 1), "A0: shape (..., 3, 3) or"),
        ("geodesic_flow", (ONE, ONE, [1, 2, 3], [0, np.nan]), "t[1] is nan"),
    ],
)
def test_bases_that_span_no_lie_algebra_are_refused(function, arguments, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        getattr(rb.connection, function)(*arguments)
