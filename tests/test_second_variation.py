import mpmath as mp
import numpy as np
import pytest
from quick import quick_for

import rbcourse as rb
from rbclassroom.atlas import random_problems
from rbcourse._polynomials import grid
from rbcourse.curves.ends import Ends
from rbcourse.optimum._collocation import relax
from rbcourse.optimum._result import optimum_of
from rbcourse.optimum._search import LIMITS, ball, body, jerk
from rbcourse.optimum._second_variation import _share, polynomials
from rbcourse.so3 import hat, vee

pytestmark = pytest.mark.source("beyond BK 15")
I3, REST, BOOK = np.eye(3), np.zeros(3), np.diag([1.0, 2.22, 3.18])
TURN = {"acceleration": [0, 0, 3, -2], "jerk": [0, 0, 0, 10, -15, 6]}
with mp.workdps(50):
    BEAM = mp.findroot(lambda x: mp.cosh(x) * mp.cos(x) - 1, 4.73) ** 2
    SUP, MIXED = 1 / mp.mpf(192), 1 / (16 * mp.sqrt(3) * mp.pi)


def stationary(what, R, ends, G=BOOK, accelerations=(REST, REST)):
    """Return the curve that Newton's method finds from guessed rotations; it may be a saddle."""
    one = Ends(*(np.asarray(x, float)[None] for x in ends))
    if what == "jerk":
        task = jerk(one, *(np.asarray(a, float)[None] for a in accelerations))
    elif what == "torque":
        task = body(one, G[None], of_torque=True)
    else:
        task = ball(one)
    equations = task.equations
    found = relax(equations, R[None])
    return optimum_of(equations.functional, equations.ends, found, np.ones(1), rb.Body(G))


def upright(what, angle):
    """Return the turn about the third axis from rest to rest, which is stationary for all
    functionals."""
    nodes = grid(LIMITS.nodes_for_jerk if what == "jerk" else LIMITS.nodes).t
    angles = angle * np.polynomial.Polynomial(TURN.get(what, TURN["acceleration"]))(nodes)
    axis = np.array([0, 0, 1.0])
    R = rb.exp_so3(angles[:, None] * axis)
    return stationary(what, R, (I3, rb.exp_so3(angle * axis), REST, REST))


def hessian(curve, nodes=41, h=2e-2):
    """Return eigenvalues of the second variation relative to ∫ ‖η⁽ᵏ⁾‖², where η turns the nodes.

    The second differences use only values of R exp(η̂) at the nodes.
    """
    functional, k = curve.functional, curve.functional.ends // 2
    count = 10 if k == 1 else 16  # polynomials that find the saddles, of the jerk from 14 on
    points, weights = grid(nodes), grid(nodes).integral[-1]
    R = curve(points.t)
    D = points.derivative

    def cost(etas):
        moved = R @ rb.exp_so3(etas)
        w = vee(moved.mT @ np.einsum("st,...tij->...sij", D, moved))
        rates = [w]
        for _ in range(k):
            rates.append(np.einsum("st,...ti->...si", D, rates[-1]))
        return np.sum(functional.deviation(*rates) ** 2, axis=-1) @ weights

    bumps = polynomials(count, k + 1, nodes)[0]
    each = np.einsum("tj,ab->jatb", bumps, I3).reshape(-1, nodes, 3)
    m = len(each)
    pairs = np.array([(i, j) for i in range(m) for j in range(i, m)])
    first, second = h * each[pairs[:, 0]], h * each[pairs[:, 1]]
    sums = cost(first + second) + cost(-first - second) - cost(first - second)
    sums -= cost(second - first)
    H = np.zeros((m, m))
    H[tuple(pairs.T)] = H[tuple(pairs.T[::-1])] = sums / (8 * h * h)
    return np.linalg.eigvalsh(H)


def test_the_constants_of_the_lemma_are_right():
    """If η is clamped at both ends, the constants bound it by ∫ ‖η''‖². The constants are computed
    as Rayleigh quotients of polynomials."""
    nodes = grid(129)
    weights = nodes.integral[-1]
    eta, rate = polynomials(40, 2, 129)[:2]
    squares, slopes = ((x.T * weights) @ x for x in (eta, rate))
    assert np.linalg.eigvalsh(squares)[-1] == pytest.approx(float(BEAM**-2), rel=1e-10)
    assert np.linalg.eigvalsh(slopes)[-1] == pytest.approx(1 / (4 * np.pi**2), rel=1e-10)
    assert np.sum(eta**2, axis=1).max() == pytest.approx(float(SUP), rel=1e-4)
    assert float(4 * BEAM) == pytest.approx(89.4931, abs=1e-4)
    assert float(MIXED) == pytest.approx(0.011486, abs=1e-6)
    assert float(mp.sqrt(SUP) / (2 * mp.pi)) == pytest.approx(float(MIXED), rel=1e-15)


def test_the_second_variation_satisfies_the_bound_of_the_lemma():
    """For 500 optima, test the eigenvalues of the second variation relative to ∫ ‖D²η‖², for
    polynomials η."""
    nodes = grid(65)
    weights = nodes.integral[-1]
    eta, rate, bend = (
        np.einsum("tj,ab->tajb", x, I3).reshape(65, 3, -1) for x in polynomials(14, 2, 65)[:3]
    )
    margins = []
    for size, seed in ((0.5, 1), (1.0, 2), (1.5, 3), (2.0, 4), (3.0, 5)):
        curves = rb.minimum_acceleration(*random_problems(100, size, rng=seed))
        w, a, b = (np.moveaxis(curves(nodes.t, k), 1, 0) for k in (1, 2, 3))
        v = np.linalg.norm(w, axis=-1).max(axis=1)
        root = np.sqrt(np.sum(a**2, axis=-1) @ weights)
        bound = (1 - v**2 / float(4 * BEAM)) ** 2
        bound -= float(MIXED) * root * v + float(SUP) / 4 * root**2
        W, A, C = hat(w), hat(a), hat(b)
        x, x_rate = rate + W @ eta, bend + A @ eta + W @ rate
        D2 = bend + A @ eta / 2 + W @ rate + W @ W @ eta / 4
        Q, M, P = (
            np.einsum("t,...tia,...tib->...ab", weights, p, q)
            for p, q in ((x_rate, x_rate), (D2, D2), (eta, C @ x))
        )
        Q -= (P + P.mT) / 2  # the term w'' · (η × x), integrated by parts
        L = np.linalg.inv(np.linalg.cholesky(M))
        least = np.linalg.eigvalsh(L @ Q @ L.mT)[:, 0]
        assert np.all(least > bound)
        margins.append(np.max(bound))
        assert np.all(curves.certified == (least > 0))
    assert margins[0] > 0.9


TURNS = {  # in degrees: the saddles and the minima of each functional
    "torque": ([108.5, 115, 140, 170, 179], [10, 60, 100, 107]),
    "acceleration": ([365, 380, 400, 430], [10, 170, 200, 330, 450, 530]),
    "jerk": ([365, 380, 390], [10, 170, 200, 350, 450]),
}


@pytest.mark.parametrize("minimum", [False, True])
@pytest.mark.parametrize("what", quick_for(["torque"], TURNS))
def test_turns_are_minima_if_no_small_rotations_of_the_nodes_reduce_the_cost(what, minimum):
    for degrees in TURNS[what][minimum]:
        curve = upright(what, np.radians(degrees))
        assert curve.converged.all()
        least = hessian(curve[0])[0]
        assert least > 1e-5 if minimum else least < -1e-5
        assert curve.certified == minimum


def test_saddles_are_recognised_among_many_stationary_curves():
    """The curves turn by more than 360° and are slow at both ends."""
    rng, told, least = np.random.default_rng(7), [], []
    t = grid(LIMITS.nodes).t[:, None]
    for _ in range(16):
        w0, w1 = 0.5 * rng.normal(size=(2, 3))
        axis = rng.normal(size=3)
        turn = np.radians(rng.uniform(365, 480)) * axis / np.linalg.norm(axis)
        bend = rb.exp_so3(t * (1 - t) ** 2 * w0 - t**2 * (1 - t) * w1)
        R = rb.exp_so3((3 * t**2 - 2 * t**3) * turn) @ bend
        curve = stationary("acceleration", R, (I3, R[-1], w0, w1))
        if curve.converged.all():
            told.append(curve.certified.item())
            least.append(hessian(curve[0])[0])
    assert np.all(told == (np.array(least) > 0))
    assert 2 < np.sum(told) < len(told) - 2


def test_missing_curves_are_not_minima():
    ends = I3, rb.exp_so3([[0, 0, 1.0], [0, 0, 2.0]]), [[0, 1, 0], [0, 1e160, 0]], REST
    with pytest.warns(RuntimeWarning, match="1 of 2 problems did not converge"):
        curves = rb.minimum_acceleration(*ends)
    assert curves.certified.tolist() == [True, False]
    assert curves[0].retimed(50.0).certified is True
    poses = rb.pose_from_coordinates([[0, 0, 0, 0, 0, 0], [0, 0, 1, 2, 0, 0]])
    assert rb.minimum_acceleration(*poses).certified is True


def test_stationary_curves_with_short_costates_are_minima():
    """If ‖c‖ < 2π³, a stationary curve is a minimum by the isoperimetric inequality
    (docs/near_optimal.md)."""
    guess = rb.closed_forms.exponential_cubic(*random_problems(200, 1.5, rng=8), long=True)
    curves = rb.optimum.stationary(guess)
    short = np.linalg.norm(curves.c, axis=-1) < 2 * np.pi**3
    assert short.sum() > 20
    assert np.all(curves.certified[short])


@pytest.mark.parametrize(
    ("k", "part"), [(1, 0), (1, 1), (1, "c"), *((2, i) for i in (0, 1, 2, 3, "c"))]
)
def test_the_remainder_bounds_each_term_with_fewer_derivatives(k, part):
    """Each term is above 0 for some of 300 functions, so it needs its part of the bound."""
    rng, n, m = np.random.default_rng(4), 61, 1
    nodes = grid(n)
    weights, M = nodes.integral[-1], np.broadcast_to(I3, (n, 3, 3))
    P, c = [0 * M for _ in range(2 * k)], np.zeros(3)
    if part == "c":
        c = np.array([0, 0, 2.0])
    else:  # for odd derivatives, only the skew part contributes
        P[part] = M if part % 2 == 0 else np.broadcast_to(hat(np.array([0, 0, 1.0])), (n, 3, 3))
    share = _share([*P, M], np.linalg.norm(c), nodes, m + k)
    derivatives = [values[:, m:] for values in polynomials(m + 4, k, n)]
    ratios = []
    for combination in rng.normal(size=(300, 4, 3)):
        y = [values @ combination for values in derivatives]
        turn = nodes.integral @ y[0] - weights @ y[0] / 2
        force = sum((Pi @ x[..., None])[..., 0] for Pi, x in zip(P, y, strict=False))
        term = weights @ np.sum(y[0] * (force - np.cross(c, turn)), axis=1)
        ratios.append(abs(term) / (share * (weights @ np.sum(y[k] ** 2, axis=1))))
    assert 1e-3 < max(ratios) <= 1
