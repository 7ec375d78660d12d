"""Problem set 4: what is asked of geodesics, projected lines and screws, and what goes wrong."""

from typing import Any

import numpy as np

from rbclassroom.assignments.marking import Drawing, Mistake, Problem
from rbcourse import Array, exp_se3, exp_so3, log_se3, log_so3
from rbcourse.projected_line import f, theta

ALLOWED = ("exp_se3", "exp_so3", "log_se3", "log_so3")  # what the notebook imports
_PAIRS = [
    (exp_so3([0.3, -0.8, 0.5]), exp_so3([1.0, 0.7, -1.2]), 0.3),
    (exp_so3([-1.5, 0.4, 0.2]), exp_so3([0.2, 0.9, 1.4]), 0.8),
]


def _between(R0: Array, R1: Array) -> Array:
    return log_so3(R0.T @ R1)


def _long(w: Array) -> Array:
    a = np.linalg.norm(w)
    return w * (a - 2 * np.pi) / a


GEODESIC = Problem(
    answer=lambda R0, R1, t: R0 @ exp_so3(t * _between(R0, R1)),
    inputs=_PAIRS,
    allowed=ALLOWED,
    mistakes=[
        Mistake(
            "Two frames are mixed: R₁R₀ᵀ is the turn as the room sees it, and stands on the left "
            "of R₀. What stands on the right is the turn as the body sees it, R₀ᵀR₁.",
            lambda R0, R1, t: R0 @ exp_so3(t * log_so3(R1 @ R0.T)),
            lambda R0, R1, t: exp_so3(t * _between(R0, R1)) @ R0,
        ),
        Mistake(
            "This starts at R₁. At t = 0 it should be at R₀.",
            lambda R0, R1, t: R1 @ exp_so3(t * _between(R1, R0)),
        ),
        Mistake(
            "This sets out from R₀ in the opposite direction: R₁ᵀR₀ leads from R₁ to R₀.",
            lambda R0, R1, t: R0 @ exp_so3(-t * _between(R0, R1)),
        ),
        Mistake(
            "This goes the long way round: more than a half-turn.",
            lambda R0, R1, t: R0 @ exp_so3(t * _long(_between(R0, R1))),
        ),
        Mistake(
            "This starts at I. The turn from R₀ is right, but R₀ itself is missing.",
            lambda R0, R1, t: exp_so3(t * _between(R0, R1)),
            lambda R0, R1, t: exp_so3(t * log_so3(R1 @ R0.T)),
        ),
        Mistake(
            "A transpose is missing: R₀R₁ is one turn after the other, not the way from one to the "
            "other.",
            lambda R0, R1, t: R0 @ exp_so3(t * log_so3(R0 @ R1)),
            lambda R0, R1, t: exp_so3(t * log_so3(R1 @ R0)) @ R0,
        ),
        Mistake(
            "Rotation vectors cannot be subtracted: log R₁ − log R₀ is no turn from R₀ to R₁, "
            "unless the two axes agree.",
            lambda R0, R1, t: R0 @ exp_so3(t * (log_so3(R1) - log_so3(R0))),
        ),
        Mistake(
            "A part of one turn after a part of the other is no geodesic, unless the two axes "
            "agree.",
            lambda R0, R1, t: exp_so3((1 - t) * log_so3(R0)) @ exp_so3(t * log_so3(R1)),
            lambda R0, R1, t: exp_so3(t * log_so3(R1)) @ exp_so3((1 - t) * log_so3(R0)),
        ),
        Mistake(
            "This is the straight line through the matrices: between its ends it is no rotation.",
            lambda R0, R1, t: (1 - t) * R0 + t * R1,
        ),
        Mistake(
            "Blended rotation vectors are no geodesic, unless the two axes agree.",
            lambda R0, R1, t: exp_so3((1 - t) * log_so3(R0) + t * log_so3(R1)),
        ),
    ],
)


def _parts(t: Any, a: float) -> tuple[Any, Any]:
    """Return sine and cosine part of the chord's point."""
    return t * np.sin(a), 1 - t + t * np.cos(a)


def _s(t: float, a: float) -> float:
    return float(np.sqrt(1 - 2 * (1 - np.cos(a)) * t * (1 - t)))


_TIMES = [(0.3, 1.0), (0.9, 2.6), (0.5, 2.0)]

THETA = Problem(
    answer=lambda t, a: theta(t, a),
    inputs=_TIMES,
    allowed=ALLOWED,
    mistakes=[
        Mistake(
            "x and y are swapped. The paper writes atan2(cosine part, sine part); np.arctan2 takes "
            "the sine part first.",
            lambda t, a: np.arctan2(*_parts(t, a)[::-1]) / a,
        ),
        Mistake(
            "This is the angle turned. θ is its share of the whole: divide by a.",
            lambda t, a: np.arctan2(*_parts(t, a)),
        ),
        Mistake(
            "np.arctan of a ratio loses the quadrant: beyond 90° it jumps. Take np.arctan2.",
            lambda t, a: np.arctan(_parts(t, a)[0] / _parts(t, a)[1]) / a,
        ),
        Mistake(
            "This is the other function, f: how to time the line so that its projection is even.",
            lambda t, a: f(t, a),
        ),
        Mistake(
            "This is a weight of Slerp. θ is the direction of a point on the chord.",
            lambda t, a: np.sin(t * a) / np.sin(a),
        ),
        Mistake(
            "This is where the geodesic is. The projection of the line is elsewhere, except at the "
            "ends and in the middle.",
            lambda t, a: t,
        ),
        Mistake(
            "Angles are in radians here: convert none.",
            lambda t, a: np.arctan2(*_parts(t, np.radians(a))) / np.radians(a),
            lambda t, a: np.degrees(np.arctan2(*_parts(t, a))) / a,
            lambda t, a: np.arctan2(*_parts(t, np.radians(a))) / a,
        ),
    ],
)

THETA_RATE = Problem(
    answer=lambda t, a: theta(t, a, 1),
    inputs=_TIMES,
    allowed=ALLOWED,
    mistakes=[
        Mistake(
            "This is what the paper prints in Corollary 1. There s should be squared: with s the "
            "rates do not add up to θ(1) − θ(0) = 1.",
            lambda t, a: np.sin(a) / (a * _s(t, a)),
        ),
        Mistake(
            "A division by a is missing: this is the rate of the angle, not of its share.",
            lambda t, a: np.sin(a) / _s(t, a) ** 2,
        ),
        Mistake(
            "s is the root in (17), and is squared in the rate: root and square undo each other. "
            "Yours is squared once too often.",
            lambda t, a: np.sin(a) / (a * _s(t, a) ** 4),
        ),
        Mistake(
            "This is the rate of f, the other function.",
            lambda t, a: f(t, a, 1),
        ),
    ],
)

_POSES = [
    (exp_se3([0.3, -0.8, 0.5, 1, 2, 0]), exp_se3([1.0, 0.7, -1.2, 0, 1, -2]), 0.3),
    (exp_se3([-1.5, 0.4, 0.2, 0, -1, 1]), exp_se3([0.2, 0.9, 1.4, 2, 0, 1]), 0.8),
]


def _pose(R: Array, d: Array) -> Array:
    return np.block([[R, d[:, None]], [np.zeros((1, 3)), np.ones((1, 1))]])


def _even(A0: Array, A1: Array, t: float) -> Array:
    R0, R1, d0, d1 = A0[:3, :3], A1[:3, :3], A0[:3, 3], A1[:3, 3]
    return _pose(R0 @ exp_so3(t * _between(R0, R1)), (1 - t) * d0 + t * d1)


SCREW = Problem(
    answer=lambda A0, A1, t: A0 @ exp_se3(t * log_se3(np.linalg.inv(A0) @ A1)),
    inputs=_POSES,
    allowed=ALLOWED,
    mistakes=[
        Mistake(
            "This turns evenly and moves the origin along a straight line: the geodesic of metric "
            "(14). On a screw the twist is constant, and the origin runs on a helix.",
            _even,
        ),
        Mistake(
            "Two frames are mixed: A₁A₀⁻¹ is the displacement as the room sees it, and stands on "
            "the left of A₀; A₀⁻¹A₁ stands on the right.",
            lambda A0, A1, t: A0 @ exp_se3(t * log_se3(A1 @ np.linalg.inv(A0))),
            lambda A0, A1, t: exp_se3(t * log_se3(np.linalg.inv(A0) @ A1)) @ A0,
        ),
        Mistake(
            "The inverse of a pose is not its transpose: only that of its rotation is. Take "
            "np.linalg.inv, or (Rᵀ, −Rᵀd).",
            lambda A0, A1, t: A0 @ exp_se3(t * log_se3(A0.T @ A1)),
            lambda A0, A1, t: A0 @ exp_se3(t * log_se3(_pose(A0[:3, :3].T, -A0[:3, 3]) @ A1)),
        ),
        Mistake(
            "This starts at A₁. At t = 0 it should be at A₀.",
            lambda A0, A1, t: A1 @ exp_se3(t * log_se3(np.linalg.inv(A1) @ A0)),
        ),
        Mistake(
            "This starts at I: A₀ itself is missing.",
            lambda A0, A1, t: exp_se3(t * log_se3(np.linalg.inv(A0) @ A1)),
            lambda A0, A1, t: exp_se3(t * log_se3(A1 @ np.linalg.inv(A0))),
        ),
        Mistake(
            "This sets out from A₀ in the opposite direction: A₁⁻¹A₀ leads from A₁ to A₀.",
            lambda A0, A1, t: A0 @ exp_se3(-t * log_se3(np.linalg.inv(A0) @ A1)),
        ),
        Mistake(
            "Twists of two poses cannot be subtracted or blended: take the twist of the "
            "displacement between them.",
            lambda A0, A1, t: A0 @ exp_se3(t * (log_se3(A1) - log_se3(A0))),
            lambda A0, A1, t: exp_se3((1 - t) * log_se3(A0) + t * log_se3(A1)),
        ),
        Mistake(
            "Blended matrices are no pose: the rotation shrinks on the way.",
            lambda A0, A1, t: (1 - t) * A0 + t * A1,
        ),
    ],
)


_T = np.linspace(0, 1, 31)
_ANGLES = np.radians([60.0, 120.0, 170.0])

DRAW_THETA = Drawing(
    answer=lambda t, angles: [np.column_stack([t, theta(t, a)]) for a in angles],
    inputs=[(_T, _ANGLES), (_T[::3], _ANGLES[1:])],
    allowed=ALLOWED,
    mistakes=[
        Mistake(
            "x and y are swapped. (What you see is the other function, f: the two are inverse.)",
            lambda t, angles: [np.column_stack([theta(t, a), t]) for a in angles],
        ),
        Mistake(
            "These are the curves of f, the other function.",
            lambda t, angles: [np.column_stack([t, f(t, a)]) for a in angles],
        ),
        Mistake(
            "This is the angle turned, not its share: divide by a.",
            lambda t, angles: [np.column_stack([t, a * theta(t, a)]) for a in angles],
            lambda t, angles: [np.column_stack([t, np.degrees(a * theta(t, a))]) for a in angles],
        ),
        Mistake(
            "This is the rate of θ. The way itself is asked for.",
            lambda t, angles: [np.column_stack([t, theta(t, a, 1)]) for a in angles],
        ),
        Mistake(
            "The arguments of np.arctan2 are exchanged: the sine part comes first.",
            lambda t, angles: [
                np.column_stack([t, np.arctan2(*_parts(t, a)[::-1]) / a]) for a in angles
            ],
        ),
        Mistake(
            "These are straight lines: where the geodesic is. The projection of the line runs "
            "unevenly.",
            lambda t, angles: [np.column_stack([t, t])],
        ),
        Mistake(
            "The angles come in radians: convert none.",
            lambda t, angles: [np.column_stack([t, theta(t, np.radians(a))]) for a in angles],
        ),
        Mistake(
            "Not all of the curves are there: one for each angle is wanted.",
            lambda t, angles: [np.column_stack([t, theta(t, angles[0])])],
            lambda t, angles: [np.column_stack([t, theta(t, angles[-1])])],
        ),
    ],
)
