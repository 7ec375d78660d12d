"""Problem set 5: what is asked of curves of minimum acceleration, and what goes wrong."""

import numpy as np

from rbclassroom.assignments.marking import Drawing, Mistake, Problem
from rbcourse import Array, exp_so3, hat_so3, project_so, projected_cubic_so3

ALLOWED = ("hat_so3", "project_so")  # what the notebook imports


def _hermite(p0: Array, p1: Array, v0: Array, v1: Array, t: float) -> Array:
    """Return the cubic with these ends and end velocities."""
    return np.array(
        (1 + 2 * t) * (1 - t) ** 2 * p0
        + t**2 * (3 - 2 * t) * p1
        + t * (1 - t) ** 2 * v0
        - t**2 * (1 - t) * v1
    )


_ENDS = [
    (np.array([0.0, 1.0]), np.array([2.0, -1.0]), np.array([1.0, 3.0]), np.array([-2.0, 0.5])),
    (np.array([-1.0, 0.3]), np.array([0.5, 2.0]), np.array([0.4, -2.0]), np.array([1.0, 1.5])),
    (np.eye(2), np.array([[0.0, 2], [1, 3]]), np.array([[1.0, -1], [0, 2]]), 2 * np.eye(2)),
]

CUBIC = Problem(
    answer=_hermite,
    inputs=[(*ends, t) for ends, t in zip(_ENDS, (0.3, 0.8, 0.4), strict=True)],
    allowed=ALLOWED,
    mistakes=[
        Mistake(
            "The velocity at the end has the wrong sign: v₁ says where the curve would go on to.",
            lambda p0, p1, v0, v1, t: _hermite(p0, p1, v0, -v1, t),
        ),
        Mistake(
            "The velocities are exchanged.",
            lambda p0, p1, v0, v1, t: _hermite(p0, p1, v1, v0, t),
        ),
        Mistake(
            "The velocity at the start has the wrong sign.",
            lambda p0, p1, v0, v1, t: _hermite(p0, p1, -v0, v1, t),
        ),
        Mistake(
            "Both velocities have the wrong sign.",
            lambda p0, p1, v0, v1, t: _hermite(p0, p1, -v0, -v1, t),
        ),
        Mistake(
            "The velocities come out three times too large: Bézier's inner points are p₀ + v₀/3 "
            "and p₁ − v₁/3.",
            lambda p0, p1, v0, v1, t: _hermite(p0, p1, 3 * v0, 3 * v1, t),
        ),
        Mistake(
            "The velocities are not used: this is the cubic from rest to rest.",
            lambda p0, p1, v0, v1, t: _hermite(p0, p1, 0 * v0, 0 * v1, t),
        ),
        Mistake(
            "This is the straight line.",
            lambda p0, p1, v0, v1, t: (1 - t) * p0 + t * p1,
        ),
        Mistake(
            "The second velocity is taken for the second derivative at the end.",
            lambda p0, p1, v0, v1, t: _bent(p0, p1, v0, v1, t),
        ),
    ],
)


def _bent(p0: Array, p1: Array, v0: Array, a1: Array, t: float) -> Array:
    """Return the cubic with the ends, the first velocity, and the second derivative at the end."""
    c3 = (a1 - 2 * (p1 - p0 - v0)) / 4
    return np.array(p0 + t * v0 + t**2 * (p1 - p0 - v0 - c3) + t**3 * c3)


_CASES = [
    (
        exp_so3([0.3, -0.8, 0.5]),
        exp_so3([1.0, 0.7, -1.2]),
        np.array([1.0, 0.5, -2.0]),
        np.array([0.3, -1.5, 0.8]),
    ),
    (
        exp_so3([-1.5, 0.4, 0.2]),
        exp_so3([-0.2, 0.9, 1.4]),
        np.array([-1.0, 2.0, 0.2]),
        np.array([2.0, 1.0, -1.0]),
    ),
    (  # in the middle the cubic of matrices has a negative determinant
        exp_so3([-0.3, 0.9, 0.8]),
        exp_so3([1.7, -1.5, 0.9]),
        np.array([7.0, 7.0, -8.0]),
        np.array([6.0, 8.0, 7.0]),
    ),
]

END_RATE = Problem(
    answer=lambda R, w: R @ hat_so3(w),
    inputs=[(R0, w0) for R0, _, w0, _ in _CASES],
    allowed=ALLOWED,
    mistakes=[
        Mistake(
            "This takes ω along the axes of the room. It is measured in the body, so its hat "
            "stands on the other side.",
            lambda R, w: hat_so3(w) @ R,
        ),
        Mistake(
            "The sign is wrong: ω̂ x = ω × x. Yours is its transpose.",
            lambda R, w: -R @ hat_so3(w),
            lambda R, w: (hat_so3(w)).T @ R,
        ),
        Mistake(
            "R is missing: ω̂ alone is the rate at I.",
            lambda R, w: hat_so3(w),
        ),
        Mistake(
            "R ω̂ Rᵀ is the hat of ω as the room sees it. The rate of R is R ω̂.",
            lambda R, w: R @ hat_so3(w) @ R.T,
        ),
        Mistake(
            "The product of a matrix and a vector is a vector. The rate of a matrix is a matrix.",
            lambda R, w: R @ w,
        ),
        Mistake(
            "This is the transpose of the rate.",
            lambda R, w: (R @ hat_so3(w)).T,
        ),
    ],
)


def _matrices(R0: Array, R1: Array, w0: Array, w1: Array, t: float) -> Array:
    return _hermite(R0, R1, R0 @ hat_so3(w0), R1 @ hat_so3(w1), t)


def _unsigned(M: Array) -> Array:
    U, _, Vt = np.linalg.svd(M)
    return np.array(U @ Vt)


PROJECTED_CUBIC = Problem(
    answer=lambda R0, R1, w0, w1, t: projected_cubic_so3(R0, R1, w0, w1)(t),
    inputs=[(*case, t) for case, t in zip(_CASES, (0.4, 0.7, 0.5), strict=True)],
    allowed=ALLOWED,
    mistakes=[
        Mistake(
            "This is the cubic through the matrices: between its ends it is no rotation. Take the "
            "nearest one.",
            _matrices,
        ),
        Mistake(
            "You take the angular velocities along the axes of the room: Ṙ = R ω̂, with ω in the "
            "body.",
            lambda R0, R1, w0, w1, t: project_so(
                _hermite(R0, R1, hat_so3(w0) @ R0, hat_so3(w1) @ R1, t)
            ),
            lambda R0, R1, w0, w1, t: project_so(
                _hermite(R0, R1, R0 @ hat_so3(w0), hat_so3(w1) @ R1, t)
            ),
            lambda R0, R1, w0, w1, t: project_so(
                _hermite(R0, R1, hat_so3(w0) @ R0, R1 @ hat_so3(w1), t)
            ),
        ),
        Mistake(
            "For some matrices this is a mirror, not a rotation: U Vᵀ alone does not look at the "
            "determinant. project_so does.",
            lambda R0, R1, w0, w1, t: _unsigned(_matrices(R0, R1, w0, w1, t)),
        ),
        Mistake(
            "The two velocities are exchanged.",
            lambda R0, R1, w0, w1, t: project_so(_matrices(R0, R1, w1, w0, t)),
        ),
        Mistake(
            "The velocities are not used: this is the projected cubic from rest to rest.",
            lambda R0, R1, w0, w1, t: project_so(_matrices(R0, R1, 0 * w0, 0 * w1, t)),
        ),
        Mistake(
            "This is the projected line: ends only, no velocities.",
            lambda R0, R1, w0, w1, t: project_so((1 - t) * R0 + t * R1),
        ),
        Mistake(
            "The last condition is printed with two dots in our copy of the paper. It is one: the "
            "rate Ṙ(1), not the second derivative.",
            lambda R0, R1, w0, w1, t: project_so(
                _bent(R0, R1, R0 @ hat_so3(w0), R1 @ hat_so3(w1), t)
            ),
        ),
        Mistake(
            "R₁ is missing, or R₀ stands in its place: at the end Ṙ = R₁ω̂₁.",
            lambda R0, R1, w0, w1, t: project_so(
                _hermite(R0, R1, R0 @ hat_so3(w0), R0 @ hat_so3(w1), t)
            ),
            lambda R0, R1, w0, w1, t: project_so(_hermite(R0, R1, hat_so3(w0), hat_so3(w1), t)),
        ),
        Mistake(
            "A velocity has the wrong sign: ω̂ x = ω × x, at both ends.",
            lambda R0, R1, w0, w1, t: project_so(_matrices(R0, R1, -w0, -w1, t)),
            lambda R0, R1, w0, w1, t: project_so(_matrices(R0, R1, w0, -w1, t)),
            lambda R0, R1, w0, w1, t: project_so(_matrices(R0, R1, -w0, w1, t)),
        ),
    ],
)

_RATES = [
    tuple(np.array(rate) for rate in rates)
    for rates in (
        ([1.0, 2.0, -1.0], [0.5, -0.3, 2.0], [-2.0, 1.0, 0.5]),
        ([0.2, -1.0, 3.0], [1.0, 1.0, -0.4], [0.7, 2.0, -1.5]),
    )
]

THIRD_RATE = Problem(
    answer=lambda w, w1, w2: -np.cross(w, w2),
    inputs=_RATES,
    allowed=ALLOWED,
    mistakes=[
        Mistake(
            "The sign is wrong. The equation says that the sum of the third derivative and ω × ω″ "
            "is 0.",
            lambda w, w1, w2: np.cross(w, w2),
        ),
        Mistake(
            "This uses ω′ where ω″ is meant.",
            lambda w, w1, w2: -np.cross(w, w1),
            lambda w, w1, w2: np.cross(w, w1),
        ),
        Mistake(
            "ω itself is missing: this is a product of derivatives only.",
            lambda w, w1, w2: -np.cross(w1, w2),
            lambda w, w1, w2: np.cross(w1, w2),
        ),
        Mistake(
            "With 0 the angular velocity would be a quadratic. That is so only where the axis "
            "never changes.",
            lambda w, w1, w2: 0 * w,
        ),
        Mistake(
            "This multiplies entry by entry. The product is the vector product.",
            lambda w, w1, w2: -w * w2,
            lambda w, w1, w2: w * w2,
        ),
    ],
)

_TIME = np.linspace(0, 1, 2001)[:, None]
_SAMPLES = [
    np.hstack([1 + _TIME, np.sin(3 * _TIME), _TIME**2 - 2]),
    np.hstack([np.cos(5 * _TIME), 0 * _TIME, 3 * _TIME]),
]


def _integral(values: Array) -> float:
    return float(np.trapezoid(values, dx=1 / (len(values) - 1)))


def _square(w1: Array) -> Array:
    return np.array(np.sum(w1**2, axis=1))


COST = Problem(
    answer=lambda w1: 2 * _integral(_square(w1)),
    inputs=[(sample,) for sample in _SAMPLES],
    allowed=ALLOWED,
    accuracy=2e-3,  # a sum of rectangles will do
    mistakes=[
        Mistake(
            "The factor 2 of (18) is missing: the metric counts a rotation twice.",
            lambda w1: _integral(_square(w1)),
        ),
        Mistake(
            "The integral is missing its dt: this grows with the number of samples.",
            lambda w1: 2 * _square(w1).sum(),
            lambda w1: _square(w1).sum(),
        ),
        Mistake(
            "This is the mean over all entries. The three squares of a sample are added.",
            lambda w1: 2 * np.mean(w1**2),
        ),
        Mistake(
            "The norm is to be squared.",
            lambda w1: 2 * _integral(np.sqrt(_square(w1))),
        ),
        Mistake(
            "There is a root too many: the cost is the integral itself.",
            lambda w1: np.sqrt(2 * _integral(_square(w1))),
            lambda w1: np.sqrt(_integral(_square(w1))),
            lambda w1: 2 * np.sqrt(_integral(_square(w1))),
        ),
        Mistake(
            "This adds the components first. Each is squared, then they are added.",
            lambda w1: 2 * _integral(w1.sum(axis=1) ** 2),
        ),
        Mistake(
            "This differentiates once more: what is handed over is ω′ already.",
            lambda w1: 2 * _integral(_square(np.gradient(w1, 1 / (len(w1) - 1), axis=0))),
        ),
    ],
)

_T = np.linspace(0, 1, 41)

DRAW_SPEED = Drawing(
    answer=lambda t, w: [np.column_stack([t, np.linalg.norm(w, axis=1)])],
    inputs=[(_T, _SAMPLES[0][::50]), (_T, _SAMPLES[1][::50])],
    mistakes=[
        Mistake(
            "x and y are swapped: time belongs on the x axis.",
            lambda t, w: [np.column_stack([np.linalg.norm(w, axis=1), t])],
        ),
        Mistake(
            "These are the components of ω. Its length is asked for.",
            lambda t, w: [np.column_stack([t, component]) for component in w.T],
        ),
        Mistake(
            "This is the square of the speed: the root is missing.",
            lambda t, w: [np.column_stack([t, np.sum(w**2, axis=1)])],
        ),
        Mistake(
            "This is the sum of the components, or of their sizes; the length is the root of the "
            "sum of squares.",
            lambda t, w: [np.column_stack([t, np.sum(w, axis=1)])],
            lambda t, w: [np.column_stack([t, np.sum(np.abs(w), axis=1)])],
        ),
        Mistake(
            "Only the numbers of the points stand on the x axis. Hand t to plot as well.",
            lambda t, w: [np.column_stack([np.arange(len(t)), np.linalg.norm(w, axis=1)])],
        ),
    ],
)
