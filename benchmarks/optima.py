"""What is compared for the optimum: one problem of the paper, and many random ones at once."""

import numpy as np
from scipy.interpolate import CubicSpline

import rbcourse as rb
from benchmarks import references
from benchmarks.contest import OURS, Contest, Method
from benchmarks.references import oracles
from rbclassroom.surveys.atlas import random_problems
from rbclassroom.surveys.survey import processes, survey
from rbcourse import textbook

MOMENTS = np.linspace(0, 1, 101)
ALONG, E1 = np.pi / 6 * np.array([1, 2, 3]), np.array([1.0, 0, 0])
CASES = {
    "4a": (ALONG, ALONG, ALONG),
    "4b": (ALONG, ALONG, ALONG + E1),
    "4c": (ALONG, ALONG, ALONG + 5 * E1),
    "5": (np.pi / 6 * np.array([1, 4, 3]), np.array([1.0, 2, 3]), np.array([2.0, 1, 1])),
}
"""The turns and the end velocities of the figures of BK."""
BOOK = rb.metrics.box_inertia([0.3, 0.2, 0.03])
"""The inertia of a book of 1 kg, in kg m²."""


def one_optimum(case):
    """Return the contest of the optimum: from the end conditions to 101 rotations on it."""
    turn, w0, w1 = CASES[case]
    ends = np.eye(3), rb.exp_so3(turn), w0, w1

    def truth():
        curve = rb.minimum_acceleration_so3(*ends)
        jerk = (curve(1e-4, 2) - curve(0.0, 2)) / 1e-4
        return references.optimum(*ends[1:], curve(0.0, 2), jerk)

    methods = [*_ours(ends), *_by_solve_bvp(turn, w0, w1, ends)]
    return Contest("optimum, one problem", case, 1, methods, references.against(truth))


def _ours(ends):
    makers = {
        OURS: rb.minimum_acceleration_so3,
        "rbcourse, shooting": rb.shoot_minimum_acceleration_so3,
        "rbcourse, projected cubic": rb.projected_cubic_so3,
    }
    return [
        Method(
            name, make.__name__, lambda make=make: make(*ends)(MOMENTS), same="cubic" not in name
        )
        for name, make in makers.items()
    ]


def _by_solve_bvp(turn, w0, w1, ends):
    def quaternions(**exact):
        return oracles.minimum_acceleration(turn, w0, w1, **exact).sol(MOMENTS)[:4]

    rotations = oracles.rotation_of_quaternions
    return [
        Method(
            "textbook",
            "solve_bvp, rotation vectors",
            lambda: textbook.minimum_acceleration_so3(*ends, MOMENTS)[0],
        ),
        Method("SciPy", "solve_bvp, quaternions", quaternions, rotations),
        Method(
            "SciPy, with Jacobians",
            "solve_bvp, quaternions, exact Jacobians",
            lambda: quaternions(jacobians=True),
            rotations,
        ),
    ]


def stacked_optimum(problems, rng, bvps=20):
    """Return the contest of many random optima at once; the times are of one problem.

    Ours is the time of all over the number that converged; that of `solve_bvp` is the time of those
    among the first that it solves, over their number. What it finds may be another optimum.
    """
    R1 = rb.exp_so3(_ball(problems, 3, rng))
    w0, w1 = _ball(problems, 6, rng), _ball(problems, 6, rng)
    R0 = np.broadcast_to(np.eye(3), R1.shape)
    curve = rb.minimum_acceleration_so3(R0, R1, w0, w1)
    found = int(curve.converged.sum())

    def one(k):
        return textbook.minimum_acceleration_so3(R0[k], R1[k], w0[k], w1[k], MOMENTS, tol=1e-6)

    bvps = min(problems, bvps)
    solved = [k for k in range(bvps) if _solves(lambda k=k: one(k), R1[k], w0[k], w1[k])]
    methods = [
        Method(
            OURS,
            f"minimum_acceleration_so3, {found} of {problems} converged",
            lambda: rb.minimum_acceleration_so3(R0, R1, w0, w1)(MOMENTS),
            items=found,
        ),
        Method(
            "textbook",
            f"solve_bvp, tol 1e-6, {len(solved)} of {bvps} solved",
            lambda: [one(k)[0] for k in solved],
            same=False,
            items=len(solved),
        ),
    ]
    few = np.flatnonzero(curve.converged)[:5]
    return Contest(
        "optimum, stacked",
        "random",
        problems,
        methods,
        references.against(lambda: _true_optima(curve, R1, w0, w1, few), (slice(None), few)),
    )


def one_body(case):
    """Return the contest of a body's least torque, from the ends to 101 rotations; and its kin."""
    turn, w0, w1 = CASES[case]
    ends = np.eye(3), rb.exp_so3(turn), w0, w1
    rest = np.zeros(3)
    methods = [
        Method(OURS, "minimum_torque_so3", lambda: rb.minimum_torque_so3(*ends, BOOK)(MOMENTS)),
        Method(
            "rbcourse, least acceleration",
            "minimum_acceleration_so3, of the book",
            lambda: rb.minimum_acceleration_so3(*ends, BOOK)(MOMENTS),
            same=False,
        ),
        Method(
            "rbcourse, least jerk",
            "minimum_jerk_so3",
            lambda: rb.minimum_jerk_so3(*ends, rest, rest)(MOMENTS),
            same=False,
        ),
        Method(
            "textbook",
            "solve_bvp, tol 1e-9",
            lambda: textbook.minimum_torque_so3(*ends, BOOK, MOMENTS)[0],
        ),
    ]
    return Contest("optimum of a body, one problem", case, 1, methods)


def stacked_bodies(problems, rng, bvps=10):
    """Return the contest of the least torques of many random bodies; times are of one problem.

    Their moments are up to 1, 2 and 2.9. As in `stacked_optimum`, what `solve_bvp` finds may be
    another optimum.
    """
    R1, bvps = rb.exp_so3(_ball(problems, 3, rng)), min(problems, bvps)
    w0, w1 = _ball(problems, 6, rng), _ball(problems, 6, rng)
    R0 = np.broadcast_to(np.eye(3), R1.shape)
    axes = rb.sample_rotation(problems, rng=rng)
    moments = np.array([1, 2, 2.9]) ** rng.random((problems, 3))
    G = axes @ (moments[:, :, None] * axes.mT)
    G = (G + G.mT) / 2
    found = int(rb.minimum_torque_so3(R0, R1, w0, w1, G).converged.sum())

    def one(k):
        return textbook.minimum_torque_so3(R0[k], R1[k], w0[k], w1[k], G[k], MOMENTS, tol=1e-6)

    def solves(k):
        try:
            return one(k) is not None
        except RuntimeError:
            return False

    solved = [k for k in range(bvps) if solves(k)]
    methods = [
        Method(
            OURS,
            f"minimum_torque_so3, {found} of {problems} converged",
            lambda: rb.minimum_torque_so3(R0, R1, w0, w1, G)(MOMENTS),
            items=found,
        ),
        Method(
            "textbook",
            f"solve_bvp, tol 1e-6, {len(solved)} of {bvps} solved",
            lambda: [one(k)[0] for k in solved],
            same=False,
            items=len(solved),
        ),
    ]
    return Contest("optimum of a body, stacked", "random", problems, methods)


def surveys(problems, rng):
    """Return the contest of a survey of the book by two processes and by one, started anew."""
    ends = random_problems(problems, 3, rng=rng)

    def by(workers):
        with processes(workers) as pool:
            return np.stack(list(survey(ends, pool, inertia=BOOK).values()))

    methods = [
        Method(OURS, "survey, two processes", lambda: by(2)),
        Method("rbcourse, alone", "survey, one process", lambda: by(1)),
    ]
    return Contest("survey of a body", "", problems, methods)


def _ball(n, radius, rng):
    """Return n points uniform in a ball, shape (n, 3)."""
    x = rng.standard_normal((n, 3))
    return radius * rng.random((n, 1)) ** (1 / 3) * x / np.linalg.norm(x, axis=1, keepdims=True)


def _solves(solver, R1, w0, w1):
    """Return whether R, w, w' at 101 times meet the ends, and R w'' is constant to a hundredth."""
    try:
        R, w, a = solver()
    except RuntimeError:
        return False
    c = (R @ CubicSpline(MOMENTS, a)(MOMENTS, 1)[..., None])[..., 0]
    spread = np.abs(c - c.mean(axis=0)).max() / np.abs(c).max()
    ends = np.abs(np.concatenate([(R[-1] - R1).ravel(), w[0] - w0, w[-1] - w1])).max()
    return spread < 1e-2 and ends < 1e-4


def _true_optima(curve, R1, w0, w1, few, h=1e-4):
    """Return the true optima next to some of our curves as `doubles`, shape (101, len(few), …)."""
    a, later = curve(0.0, 2), curve(h, 2)
    jerk = (later - a) / h
    truths = [references.optimum(R1[k], w0[k], w1[k], a[k], jerk[k]) for k in few]
    return np.stack(truths, axis=1)
