"""Problem set 6: what is asked of real bodies, and what goes wrong."""

import numpy as np

from rbclassroom.assignments.marking import Drawing, Mistake, Problem
from rbcourse import Array, exp_so3, project_so, project_so_weighted

ALLOWED = ("project_so",)  # what the notebook imports

_AXES = exp_so3([0.4, -0.9, 0.3])
_BODIES = [
    _AXES @ np.diag([1.0, 2.2, 3.1]) @ _AXES.T,  # not along the axes of the frame
    np.diag([2.0, 0.7, 1.6]),
]


def _torque(G: Array, w: Array, w1: Array) -> Array:
    """Return the torques for one ω and ω′, or for samples of them."""
    return np.array(w1 @ G + np.cross(w, w @ G))


_MOMENT = [(np.array([1.0, 2, -1]), np.array([0.5, -0.3, 2])), (np.ones(3), np.array([0.2, 1, -3]))]

TORQUE = Problem(
    answer=_torque,
    inputs=[(G, *rates) for G, rates in zip(_BODIES, _MOMENT, strict=True)],
    allowed=ALLOWED,
    mistakes=[
        Mistake(
            "The second term is missing: a book that turns about a diagonal needs a torque even "
            "while ω does not change.",
            lambda G, w, w1: G @ w1,
        ),
        Mistake(
            "The sign of the second term is wrong: it is ω × Gω.",
            lambda G, w, w1: G @ w1 - np.cross(w, G @ w),
        ),
        Mistake(
            "G multiplies too much: it belongs to ω′ and to the ω inside of the product, and not "
            "to the product.",
            lambda G, w, w1: G @ (w1 + np.cross(w, G @ w)),
        ),
        Mistake(
            "This is the acceleration in the metric of the body, G⁻¹τ. The torque is asked for.",
            lambda G, w, w1: np.linalg.solve(G, _torque(G, w, w1)),
        ),
        Mistake(
            "This uses the diagonal of G only. The axes of the frame need not be those of the "
            "body: multiply by the matrix, with @.",
            lambda G, w, w1: np.diag(G) * w1 + np.cross(w, np.diag(G) * w),
        ),
        Mistake("ω and ω′ are exchanged.", lambda G, w, w1: _torque(G, w1, w)),
        Mistake(
            "The product has ω′ where ω is meant.",
            lambda G, w, w1: G @ w1 + np.cross(w1, G @ w),
            lambda G, w, w1: G @ w1 + np.cross(w, G @ w1),
            lambda G, w, w1: G @ w1 + np.cross(w1, G @ w1),
        ),
    ],
)

_TIME = np.linspace(0, 1, 2001)[:, None]
_SAMPLES = [
    (
        np.hstack([np.sin(3 * _TIME), 1 + _TIME, _TIME**2]),
        np.hstack([3 * np.cos(3 * _TIME), 1 + 0 * _TIME, 2 * _TIME]),
    ),
    (
        np.hstack([2 - _TIME, np.cos(5 * _TIME), 0.5 * _TIME]),
        np.hstack([0 * _TIME - 1, -5 * np.sin(5 * _TIME), 0.5 + 0 * _TIME]),
    ),
]


def _integral(values: Array) -> float:
    return float(np.trapezoid(values, dx=1 / (len(values) - 1)))


def _squares(G: Array, w: Array, w1: Array) -> Array:
    """Return τᵀ G⁻¹ τ of each sample."""
    torque = _torque(G, w, w1)
    return np.array(np.sum(torque * np.linalg.solve(G, torque.T).T, axis=1))


def _squared_over(G: Array, torque: Array) -> float:
    """Return ∫ τᵀ G⁻¹ τ dt of samples of τ."""
    return _integral(np.sum(torque * np.linalg.solve(G, torque.T).T, axis=1))


BODY_COST = Problem(
    answer=lambda G, w, w1: _integral(_squares(G, w, w1)),
    inputs=[(G, *samples) for G, samples in zip(_BODIES, _SAMPLES, strict=True)],
    allowed=ALLOWED,
    accuracy=2e-3,  # a sum of rectangles will do
    mistakes=[
        Mistake(
            "This is the other cost, of least torque: ∫ ‖τ‖² dt. Here G⁻¹ stands between the two "
            "torques.",
            lambda G, w, w1: _integral(np.sum(_torque(G, w, w1) ** 2, axis=1)),
        ),
        Mistake(
            "This has G where its inverse is meant.",
            lambda G, w, w1: _integral(np.sum(_torque(G, w, w1) * (_torque(G, w, w1) @ G), axis=1)),
        ),
        Mistake(
            "The term ω × Gω is missing in the torque: this takes G ω′ for it.",
            lambda G, w, w1: _integral(np.sum(w1 * (w1 @ G), axis=1)),
        ),
        Mistake(
            "The sign of ω × Gω in the torque is wrong.",
            lambda G, w, w1: _squared_over(G, w1 @ G - np.cross(w, w @ G)),
        ),
        Mistake(
            "This is the cost for a ball: it does not use G.",
            lambda G, w, w1: 2 * _integral(np.sum(w1**2, axis=1)),
            lambda G, w, w1: _integral(np.sum(w1**2, axis=1)),
        ),
        Mistake(
            "The integral is missing its dt: this grows with the number of samples.",
            lambda G, w, w1: _squares(G, w, w1).sum(),
        ),
        Mistake(
            "This is the mean over all entries. The three products of a sample are added.",
            lambda G, w, w1: _integral(_squares(G, w, w1)) / 3,
        ),
        Mistake(
            "There is a root too many: the cost is the integral itself.",
            lambda G, w, w1: np.sqrt(_integral(_squares(G, w, w1))),
            lambda G, w, w1: _integral(np.sqrt(_squares(G, w, w1))),
        ),
    ],
)

_T = np.linspace(0, 1, 41)


def _curve(t: Array, *values: Array) -> list[Array]:
    return [np.column_stack([t, each]) for each in values]


DRAW_TORQUE = Drawing(
    answer=lambda t, G, w, w1: _curve(t, np.linalg.norm(_torque(G, w, w1), axis=1)),
    inputs=[(_T, G, *(x[::50] for x in xs)) for G, xs in zip(_BODIES, _SAMPLES, strict=True)],
    allowed=ALLOWED,
    mistakes=[
        Mistake(
            "x and y are swapped: time belongs on the x axis.",
            lambda t, G, w, w1: [np.column_stack([np.linalg.norm(_torque(G, w, w1), axis=1), t])],
        ),
        Mistake(
            "These are the components of the torque. Its size is asked for.",
            lambda t, G, w, w1: _curve(t, *_torque(G, w, w1).T),
        ),
        Mistake(
            "This is the square of the size: the root is missing.",
            lambda t, G, w, w1: _curve(t, np.sum(_torque(G, w, w1) ** 2, axis=1)),
        ),
        Mistake(
            "This is the size of G⁻¹τ, the acceleration. The torque's is asked for.",
            lambda t, G, w, w1: _curve(
                t, np.linalg.norm(np.linalg.solve(G, _torque(G, w, w1).T), axis=0)
            ),
        ),
        Mistake(
            "The sign of ω × Gω in the torque is wrong.",
            lambda t, G, w, w1: _curve(t, np.linalg.norm(w1 @ G - np.cross(w, w @ G), axis=1)),
        ),
        Mistake(
            "This is the size of G ω′: the torque has a second term, ω × Gω.",
            lambda t, G, w, w1: _curve(t, np.linalg.norm(w1 @ G, axis=1)),
        ),
        Mistake(
            "Only the numbers of the points stand on the x axis. Hand t to plot as well.",
            lambda t, G, w, w1: _curve(
                np.arange(float(len(t))), np.linalg.norm(_torque(G, w, w1), axis=1)
            ),
        ),
    ],
)

_MATRICES = [
    np.array([[0.9, -0.4, 0.2], [0.5, 0.7, -0.3], [0.1, 0.6, 1.2]]),
    np.array([[0.2, 1.1, 0.1], [-0.8, 0.3, 0.4], [0.3, 0.1, -0.9]]),  # a mirror
]


def _weight(G: Array) -> Array:
    return np.array(np.trace(G) / 2 * np.eye(3) - G)


def _unsigned(M: Array) -> Array:
    U, _, Vt = np.linalg.svd(M)
    return np.array(U @ Vt)


NEAREST_FOR_BODY = Problem(
    answer=lambda M, G: project_so_weighted(M, _weight(G)),
    inputs=list(zip(_MATRICES, _BODIES, strict=True)),
    allowed=ALLOWED,
    mistakes=[
        Mistake(
            "This is the nearest rotation for a ball: the inertia is not used, or M was made a "
            "rotation before W came in.",
            lambda M, G: project_so(M),
        ),
        Mistake(
            "The inertia is not the weight: W = ½ tr(G) I − G.",
            lambda M, G: project_so(M @ G),
        ),
        Mistake(
            "The half is missing: W = ½ tr(G) I − G. (tr(W) I − W goes from the weight to the "
            "inertia.)",
            lambda M, G: project_so(M @ (2 * _weight(G) + G)),
        ),
        Mistake(
            "The weight stands on the wrong side: it belongs to the body, so on the right of M.",
            lambda M, G: project_so(_weight(G) @ M),
        ),
        Mistake(
            "For some matrices this is a mirror, not a rotation: U Vᵀ alone does not look at the "
            "determinant. project_so does.",
            lambda M, G: _unsigned(M @ _weight(G)),
        ),
        Mistake(
            "The unit matrix is missing: ½ tr(G) is a number, and belongs on the diagonal only.",
            lambda M, G: project_so(M @ (np.trace(G) / 2 - G)),
        ),
        Mistake(
            "This is M W itself: the nearest rotation to it is still to be taken.",
            lambda M, G: M @ _weight(G),
        ),
    ],
)

_ROTATIONS = exp_so3([[0.3, -0.8, 0.5], [1.2, 0.4, -0.6]])
_EFFORTS = [
    (np.array([0.4, -1.0, 0.8]), np.array([2.0, 0.1, -1.5])),
    (np.array([-1.2, 0.3, 0.9]), np.array([0.6, -2.0, 0.4])),
]


def _costate(G: Array, w: Array, v: Array, v1: Array) -> Array:
    return np.array(G @ (v1 + np.cross(w, v)) - np.cross(G @ w, v))


CONSTANT = Problem(
    answer=lambda R, G, w, v, v1: R @ _costate(G, w, v, v1),
    inputs=[
        (R, G, w, *effort)
        for R, G, (w, _), effort in zip(_ROTATIONS, _BODIES, _MOMENT, _EFFORTS, strict=True)
    ],
    allowed=ALLOWED,
    mistakes=[
        Mistake(
            "This is p, as the body sees it. What does not change is R p, as the room sees it.",
            lambda R, G, w, v, v1: _costate(G, w, v, v1),
        ),
        Mistake(
            "This has the transpose of R: R carries from the body to the room.",
            lambda R, G, w, v, v1: R.T @ _costate(G, w, v, v1),
        ),
        Mistake(
            "The sign of the last term is wrong: Gω × v is subtracted.",
            lambda R, G, w, v, v1: R @ (G @ (v1 + np.cross(w, v)) + np.cross(G @ w, v)),
        ),
        Mistake(
            "In the last term G belongs to ω: it is Gω × v.",
            lambda R, G, w, v, v1: R @ (G @ (v1 + np.cross(w, v)) - np.cross(w, G @ v)),
        ),
        Mistake(
            "The last term is missing: Gω × v, from the variation of ω in ω × Gω.",
            lambda R, G, w, v, v1: R @ G @ (v1 + np.cross(w, v)),
        ),
        Mistake(
            "Inside of G the product ω × v is missing.",
            lambda R, G, w, v, v1: R @ (G @ v1 - np.cross(G @ w, v)),
        ),
        Mistake(
            "Inside of G the product has the wrong sign: it is ω × v.",
            lambda R, G, w, v, v1: R @ (G @ (v1 - np.cross(w, v)) - np.cross(G @ w, v)),
        ),
        Mistake(
            "This is the constant of a ball: G is not used, or only as a factor.",
            lambda R, G, w, v, v1: R @ v1,
            lambda R, G, w, v, v1: R @ G @ v1,
        ),
    ],
)
