"""Define the contests, in which several methods for the same task are timed."""

import sys
import tempfile
from collections.abc import Callable
from functools import partial
from itertools import accumulate
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from pytransform3d.batch_rotations import matrices_from_quaternions, quaternion_slerp_batch
from pytransform3d.rotations import robust_polar_decomposition as polar
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline, Slerp

import rbcourse as rb
from rbclassroom.atlas import random_problems
from rbclassroom.figures import FORMS
from rbcourse import textbook
from rbcourse.draw import animate, bodies

sys.path.append(str(Path(__file__).parents[1] / "tests"))
import oracles

try:
    import roma
    import torch
except ImportError:
    roma = torch = None
try:
    import toppra
    from toppra import algorithm, constraint

    toppra.setup_logging("ERROR")
except ImportError:
    toppra = None
OURS, SAMPLE, MOMENTS = "rbcourse", 100, np.linspace(0, 1, 101)
"""The first method of each contest, the number of items whose error is computed, and the times at
which an optimum is evaluated."""
LEGS = {"projected cubics": rb.projected_cubic_se3, "geodesics": rb.geodesic_se3}
ALONG, E1 = np.pi / 6 * np.array([1, 2, 3]), np.array([1.0, 0, 0])
CASES = {x: (ALONG, ALONG, ALONG + k * E1) for x, k in (("4a", 0), ("4b", 1), ("4c", 5))}
CASES["5"] = np.pi / 6 * np.array([1, 4, 3]), np.array([1.0, 2, 3]), np.array([2.0, 1, 1])
"""The rotation vectors and the end velocities of the figures of BK."""
ENDS = {name: (np.eye(3), rb.exp_so3(turn), w0, w1) for name, (turn, w0, w1) in CASES.items()}
BOOK = rb.metrics.box_inertia([0.3, 0.2, 0.03])  # the inertia of a book of 1 kg, in kg m²


class Method(NamedTuple):
    """A timed method: `does` names its functions, and `call()` runs the method on prepared input.

    `value` converts the result so that its error can be computed. If results are not comparable,
    `value` is None. The time is divided by `items`, the number of problems that a call solves.
    """

    does: str
    call: Callable[[], Any]
    value: Callable[[Any], Any] | None = np.asarray
    items: int = 1


def nearest_rotation(n, rng):
    """Compare methods that find the rotations nearest to n noisy matrices with det > 0."""
    M = rb.sample_rotation(n, rng=rng) + 0.1 * rng.standard_normal((n, 3, 3))
    M[np.linalg.det(M) <= 0] *= -1
    methods = {
        OURS: Method("project_so", lambda: rb.project_so(M)),
        "textbook": Method("svd, with the sign", lambda: textbook.project_so(M)),
        "SciPy": Method("from_matrix, as_matrix", lambda: Rotation.from_matrix(M).as_matrix()),
    }
    if roma:
        tensor = torch.from_numpy(M)
        methods["RoMa"] = Method("special_procrustes", lambda: roma.special_procrustes(tensor))
    if n <= 1000:  # this method takes a millisecond per matrix
        methods["pytransform3d"] = Method(polar.__name__, lambda: [polar(A) for A in M])
    methods["NumPy, SVD alone"] = Method("svd", lambda: np.linalg.svd(M), None)
    return methods, _distance([oracles.nearest_rotation(A) for A in M[:SAMPLE]])


def geodesic(n, rng):
    """Compare evaluations of a geodesic at n times; making the curve is not timed."""
    R0, t, sigma = rb.sample_rotation(rng=rng), rng.random(n), np.array([1, -1, 1.5])
    R1 = R0 @ rb.exp_so3(sigma)
    ours, ends = rb.geodesic_so3(R0, R1), Rotation.from_matrix([R0, R1])
    theirs, xyzw = Slerp([0, 1], ends), ends.as_quat()
    methods = {
        OURS: Method("geodesic_so3", lambda: ours(t)),
        "textbook": Method("R0 exp(σ̂ t), with log", lambda: textbook.geodesic_so3(R0, R1, t)),
        "SciPy": Method("Slerp, as_matrix", lambda: theirs(t).as_matrix()),
        "SciPy, as Rotation": Method("Slerp", lambda: theirs(t), Rotation.as_matrix),
    }
    if roma:
        by_roma = partial(roma.unitquat_slerp, *map(torch.from_numpy, (*xyzw, t)))
        turn, does = roma.unitquat_to_rotmat, "unitquat_slerp"
        methods["RoMa"] = Method(f"{does}, unitquat_to_rotmat", lambda: turn(by_roma()))
        methods["RoMa, as quaternions"] = Method(does, by_roma, turn)
    batch = partial(quaternion_slerp_batch, *np.roll(xyzw, 1, axis=1), t, shortest_path=True)
    convert, does = matrices_from_quaternions, "quaternion_slerp_batch"
    methods["pytransform3d"] = Method(f"{does}, {convert.__name__}", lambda: convert(batch()))
    methods["pytransform3d, as quaternions"] = Method(does, batch, convert)
    return methods, _distance([R0 @ oracles.exp_so3(x * sigma) for x in t[:SAMPLE]])


def projected_cubic(n, rng, orders):
    """Compare evaluations of a projected cubic at n times; the textbook is the reference."""
    t, ends, knots = rng.random(n), ENDS["5"], np.linspace(0, 1, 5)
    few, (R0, R1, w0, w1) = t[:SAMPLE], ends
    ours, theirs = rb.projected_cubic_so3(*ends), textbook.projected_cubic_so3
    spline = RotationSpline(knots, Rotation.from_matrix(ours(knots)))
    cubic = textbook.cubic_coefficients(R0, R1, R0 @ rb.hat_so3(w0), R1 @ rb.hat_so3(w1))

    def by_textbook():
        if orders > 1:
            return theirs(*ends, t)
        return [textbook.project_so(textbook.polynomial(cubic, t[:, None, None]))]

    def by_scipy():
        return [spline(t).as_matrix(), *(spline(t, k) for k in range(1, orders))]

    def rows(parts):
        return np.concatenate([np.reshape(part, (len(part), -1)) for part in parts], axis=1)

    does = "projected_cubic_so3" if orders > 1 else "project_so of the cubic"
    methods = {
        OURS: Method("projected_cubic_so3", lambda: [ours(t, k) for k in range(orders)], rows),
        "textbook": Method(does, by_textbook, rows),
        "SciPy, another curve": Method("RotationSpline", by_scipy, None),
    }
    M, *rates = textbook.polynomial(cubic, few[:, None, None]), *theirs(*ends, few)[1:orders]
    return methods, _distance(rows([[oracles.nearest_rotation(A) for A in M], *rates]))


def closed_forms(n, rng, orders):
    """Compare evaluations of closed-form curves and their derivatives at n times."""
    t, methods = rng.random(n), {}
    for form, make in FORMS.items():
        curve, name = make(*ENDS["5"]), OURS if form == "projection" else f"rbcourse, {form}"
        call = partial(lambda curve: [curve(t, order) for order in range(orders)], curve)
        methods[name] = Method(make.__name__, call, None)
    return methods, None


def random_samples(n, rng, kind, author, form, name):
    """Compare samplers of n matrices or unit quaternions, whose singular values should be 1."""
    ours, theirs = getattr(rb, f"sample_{kind}"), getattr(textbook, f"sample_{kind}")
    convert = getattr(Rotation, f"as_{form}")
    methods = {
        OURS: Method(f"sample_{kind}", lambda: ours(n, rng=rng)),
        "textbook": Method(f"{author}'s {kind}s", lambda: theirs(n, rng)),
        "SciPy": Method(f"random, as_{form}", lambda: convert(Rotation.random(n, rng=rng))),
        "SciPy, as Rotation": Method("random", lambda: Rotation.random(n, rng=rng), convert),
    }
    if roma:
        sample = partial(getattr(roma, name), n, dtype=torch.float64)
        methods["RoMa"] = Method(f"{name}, float64", sample)

    shape = (-1, 3, 3) if form == "matrix" else (-1, 4, 1)
    return methods, lambda x: np.abs(np.linalg.svdvals(x[:SAMPLE].reshape(shape)) - 1).max()


def chain_of_poses(n, rng, legs, poses=1000):
    """Compare evaluations of a chain at n increasing times; making the chain is not timed."""
    when, places = np.cumsum(rng.uniform(0.5, 1.5, poses)), rng.normal(size=(poses, 3)).cumsum(0)
    R, t = rb.exp_so3(rng.normal(0, 0.5, (poses, 3)).cumsum(0)), np.linspace(when[0], when[-1], n)
    motion = rb.chain(when, rb.pose_from_components(R, places), leg=LEGS[legs])
    turning, path = RotationSpline(when, Rotation.from_matrix(R)), CubicSpline(when, places)
    one = motion.legs[1]
    times = np.linspace(0, one.duration, n)

    def by_scipy():
        A = np.zeros((n, 4, 4))
        A[:, :3, :3], A[:, :3, 3], A[:, 3, 3] = turning(t).as_matrix(), path(t), 1
        return A

    methods = {
        OURS: Method("chain", lambda: motion(t)),
        "rbcourse, one leg": Method(LEGS[legs].__name__, lambda: one(times), None),
        "SciPy, another curve": Method("RotationSpline, CubicSpline", by_scipy, None),
    }
    return methods, None


def splines(n, rng):
    """Compare methods that make splines of n legs of 30°; `does` states the excess cost."""
    axes, t = rng.normal(size=(n, 3)), np.cumsum(rng.uniform(0.5, 1.5, n + 1))
    turns = rb.exp_so3(np.pi / 6 * axes / np.linalg.norm(axes, axis=1)[:, None])
    R = np.array(list(accumulate(turns, np.matmul, initial=np.eye(3))))
    known, best = Rotation.from_matrix(R), rb.minimum_acceleration_spline_so3

    def closed(make):
        more = rb.acceleration_cost(make(t, R)) / best(t, R).cost - 1
        return Method(f"{make.__name__}, cost {100 * more:.2g} % more", partial(make, t, R), None)

    methods = {
        OURS: Method(best.__name__, partial(best, t, R), None),
        "rbcourse, quaternions": closed(rb.quaternion_spline_so3),
        "rbcourse, projected cubics": closed(rb.projected_spline_so3),
        "rbcourse, their velocities": Method("", partial(rb.spline_velocities, t, R), None),
        "SciPy, another curve": Method("RotationSpline", partial(RotationSpline, t, known), None),
    }
    return methods, None


def one_optimum(n, rng, case):
    """Compare solvers on one problem of the paper (BK); each computes 101 rotations."""
    matrices, vectors = oracles.rotation_of_quaternions, textbook.minimum_acceleration_so3

    def bvp(**options):
        return oracles.minimum_acceleration(*CASES[case], **options).sol(MOMENTS)[:4]

    does, exact = "solve_bvp, rotation vectors", "solve_bvp, quaternions, exact Jacobians"
    methods = {
        OURS: _ours(case, rb.minimum_acceleration_so3),
        "rbcourse, shooting": _ours(case, rb.shoot_minimum_acceleration_so3),
        "rbcourse, projected cubic": _ours(case, rb.projected_cubic_so3)._replace(value=None),
        "textbook": Method(does, lambda: vectors(*ENDS[case], MOMENTS)[0]),
        "SciPy": Method("solve_bvp, quaternions", bvp, matrices),
        "SciPy, with Jacobians": Method(exact, partial(bvp, jacobians=True), matrices),
    }
    return methods, _distance(_true_optimum(ENDS[case], np.eye(3)))


def one_body(n, rng, case):
    """Compare methods that find optimal motions of a book, such as the motion of least torque."""
    bvp, does = textbook.minimum_torque_so3, "minimum_acceleration_so3, of the book"
    rest = np.zeros(3)
    least = _ours(case, rb.minimum_acceleration_so3, BOOK)
    methods = {
        OURS: _ours(case, rb.minimum_torque_so3, BOOK),
        "rbcourse, least acceleration": least._replace(does=does, value=None),
        "rbcourse, least jerk": _ours(case, rb.minimum_jerk_so3, rest, rest)._replace(value=None),
        "textbook": Method("solve_bvp, tol 1e-9", lambda: bvp(*ENDS[case], BOOK, MOMENTS)[0]),
    }
    return methods, _distance(_true_optimum(ENDS[case], BOOK))


def stacked_optima(n, rng, least, bvps=20):
    """Compare SciPy's `solve_bvp` with our solver, which solves n random problems together.

    `solve_bvp` solves the first `bvps` problems one by one. The times are per solved problem.
    `solve_bvp` may find another optimum.
    """
    name, bodily = f"minimum_{least}_so3", least == "torque"
    ours, theirs = getattr(rb, name), getattr(textbook, name)
    ends, axes = random_problems(n, 3, rng=rng), rb.sample_rotation(n, rng=rng)
    G = axes @ ([[1], [2], [2.9]] ** (bodily * rng.random((n, 3, 1))) * axes.mT)
    G = (G + G.mT) / 2
    inputs = [ends.R0, ends.R1, ends.w0, ends.w1, *([G] * bodily)]

    def one(k):
        try:
            return theirs(*(x[k] for x in inputs), MOMENTS, tol=1e-6)[0]
        except RuntimeError:
            return None

    curve, bvps = ours(*inputs), min(n, bvps)
    found = np.flatnonzero(curve.converged)
    few, solved = found[:5], [k for k in range(bvps) if one(k) is not None]
    does = f"{name}, {len(found)} of {n} converged"
    other = f"solve_bvp, tol 1e-6, {len(solved)} of {bvps} solved"
    methods = {
        OURS: Method(does, lambda: ours(*inputs)(MOMENTS), lambda R: R[:, few], len(found)),
        "textbook": Method(other, lambda: list(map(one, solved)), None, len(solved)),
    }
    truths = [_true_optimum([x[k] for x in inputs[:4]], G[k], curve[k]) for k in few]
    return methods, _distance(np.stack(truths, axis=1))


def cubes(n, rng):
    """Compare methods that write a GIF of two cubes with n frames."""
    t, A0 = np.linspace(0, 1, n), np.eye(4)
    A1 = rb.pose_from_coordinates([np.pi / 6, 2 * np.pi / 3, np.pi / 2, 8, 10, 12])
    motions = {"screw": rb.screw_se3(A0, A1)(t), "geodesic": rb.geodesic_se3(A0, A1)(t)}

    def moving():
        panes = {"layout": "none", "subplot_kw": {"projection": "space"}}
        fig, axes = plt.subplots(1, 2, figsize=(8, 4), dpi=80, **panes)
        return fig, bodies.moving_boxes(axes, motions, edges=2)

    def by_matplotlib():
        with tempfile.TemporaryDirectory() as folder:
            film = FuncAnimation(*theirs, frames=n)
            film.save(Path(folder) / "cubes.gif", PillowWriter(fps=25), dpi=80)

    ours, theirs, other = moving(), moving(), "FuncAnimation, PillowWriter"
    render = partial(animate.render, *ours, n)
    ours = Method("animate.gif", lambda: animate.gif(animate.indexed(render()), seconds=4))
    return {OURS: ours, "matplotlib": Method(other, by_matplotlib)}, None


def _ours(case, make, *further):
    """Return the method that makes a curve from the ends of a case and evaluates it."""
    return Method(make.__name__, lambda: make(*ENDS[case], *further)(MOMENTS))


def _distance(truth):
    """Return a function that compares values with `truth` and gives the largest distance."""
    n, truth = len(truth), np.asarray(truth)
    return lambda value: np.linalg.norm((value[:n] - truth).reshape(n, -1), axis=1).max()


def _true_optimum(ends, G, near=None):
    """Return 101 rotations of the least-torque curve that `solve_bvp` finds from a guess."""
    near = near or rb.minimum_torque_so3(*ends, G)
    found, _ = oracles.stationary(("effort", G, np.eye(3)), tuple(ends), near)
    return oracles.rotation_of_quaternions(found.sol(MOMENTS)[:4])


def timing_of_poses(n, rng):
    """Compare methods that find the fastest timing of a leg or of a chain of n poses."""
    steps = rb.exp_se3(rng.uniform(-0.7, 0.7, (n - 1, 6)))
    poses = np.array(list(accumulate(steps, np.matmul, initial=np.eye(4))))
    path, leg, does = rb.chain(np.arange(n), poses), rb.geodesic_se3(*poses[:2]), "fastest, norms"
    norms = {"angular_speed": 1.5, "speed": 1, "angular_acceleration": 4, "acceleration": 3}
    boxes = norms | {"angular_acceleration": [4, 4, 4], "acceleration": [3, 3, 3]}
    methods = {
        OURS: Method("fastest, boxes", lambda: [rb.fastest(leg, **boxes).duration]),
        "rbcourse, norms": Method(does, partial(rb.fastest, leg, **norms), None),
        "rbcourse, chain": Method(does, partial(rb.fastest, path, **norms), None),
    }
    if toppra:
        methods["toppra"] = Method("TOPPRA", partial(_by_toppra, leg, 1000))
    return methods, _distance(_by_toppra(leg, 1000) if toppra else methods[OURS].call())


def _by_toppra(curve, cells):
    """Let toppra compute the least time of a curve on [0, 1] with the same limits."""
    linear, s = constraint.linear_constraint, np.linspace(0, 1, cells + 1)
    V, A = curve(s, 1), curve(s, 2)

    class Boxes(linear.LinearConstraint):
        def compute_constraint_params(self, *_):
            faces = np.vstack([np.eye(6), -np.eye(6)]) / [4, 4, 4, 3, 3, 3]
            F, g = np.tile(faces, (len(s), 1, 1)), np.ones((len(s), 12))
            both = linear.canlinear_colloc_to_interpolate(V, A, 0 * V, F, g, None, None, s)
            speeds = np.linalg.norm(V.reshape(-1, 2, 3), axis=2) / [1.5, 1]
            return *both[:5], None, np.stack([0 * s, speeds.max(axis=1) ** -2], axis=1)

    limit = Boxes()
    limit.dof, limit._format_string = 1, ""
    path = toppra.SplineInterpolator([0, 1], [[0], [1]])
    solver = algorithm.TOPPRA([limit], path, gridpoints=s, solver_wrapper="seidel")
    rate = solver.compute_parameterization(0, 0)[1]
    return [np.sum(2 / cells / (rate[1:] + rate[:-1]))]


class Contest(NamedTuple):
    """A contest, which times methods for the same task at some sizes N.

    `make` takes N, a generator and the options. Its first result is a dict of the methods, which
    begins with ours. Its second result is a function that computes the error of a value, or None.
    `bound` is the largest error that is allowed.
    """

    task: str
    case: str
    sizes: tuple[int, ...]
    bound: float | None
    make: Callable[..., tuple[dict[str, Method], Callable | None]]
    options: tuple = ()


ALL = tuple(10**k for k in range(7))
SOME, BODY = ALL[::3], "optimum of a body"
MATRICES = "rotation", "Arvo", "matrix", "random_rotmat"
QUATERNIONS = "quaternion", "Shoemake", "quat", "random_unitquat"
CONTESTS = [
    Contest("nearest rotation", "noisy", ALL, 1e-13, nearest_rotation),
    Contest("geodesic at N times", "", ALL, 1e-14, geodesic),
    Contest("projected cubic at N times", "", ALL, 1e-13, projected_cubic, (1,)),
    Contest("projected cubic with derivatives", "", ALL, 1e-12, projected_cubic, (3,)),
    Contest("random rotation matrices", "", ALL, 1e-14, random_samples, MATRICES),
    Contest("random quaternions", "", ALL, 1e-14, random_samples, QUATERNIONS),
    Contest("closed forms at N times", "", SOME, None, closed_forms, (1,)),
    Contest("closed forms with derivatives", "", SOME, None, closed_forms, (3,)),
    *(Contest("chain at N times", legs, SOME, None, chain_of_poses, (legs,)) for legs in LEGS),
    Contest("spline of N legs", "30°", (10, 1000), None, splines),
    Contest("fastest timing", "chain of N", (8,), 1e-5, timing_of_poses),
    *(Contest("optimum, one problem", case, (1,), 1e-10, one_optimum, (case,)) for case in CASES),
    Contest("optimum, stacked", "random", (1000,), 1e-10, stacked_optima, ("acceleration",)),
    *(Contest(f"{BODY}, one problem", case, (1,), 1e-10, one_body, (case,)) for case in CASES),
    Contest(f"{BODY}, stacked", "random", (1000,), 1e-10, stacked_optima, ("torque",)),
    Contest("cubes as GIF", "", (100,), None, cubes),
]
