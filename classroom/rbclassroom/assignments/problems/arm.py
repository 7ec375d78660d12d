"""Problem set 1, second part: what is asked of a two-link arm, and what goes wrong."""

from collections.abc import Callable

import numpy as np

from rbclassroom.assignments.marking import Drawing, Mistake, Problem
from rbcourse import Array
from rbcourse.arm import arm_forward_kinematics, arm_inverse_kinematics

_JOINTS = [
    (np.array([0.2, 1.0]), np.array([1.5, -0.7]), 0.25),
    (np.array([-1.0, 0.4]), np.array([2.0, 0.9]), 0.8),
    (np.array([0.0, -2.0]), np.array([4.0, 2.5]), 0.5),
]

BLEND_JOINTS = Problem(
    answer=lambda start, goal, t: (1 - t) * start + t * goal,
    inputs=_JOINTS,
    mistakes=[
        Mistake(
            "This is the formula as the report prints it: it blends the start of link 1 with the "
            "start of link 2. Each link goes from its own start to its own goal.",
            lambda start, goal, t: np.array(
                [(1 - t) * start[0] + t * start[1], (1 - t) * goal[0] + t * goal[1]]
            ),
        ),
        Mistake(
            "At t = 0 your arm is at the goal. Which of the two weights is for the start?",
            lambda start, goal, t: t * start + (1 - t) * goal,
        ),
        Mistake(
            "You let the motors take the short way round. A motor cannot: between −2 and 2.5 rad "
            "it turns through all angles.",
            lambda start, goal, t: start + t * ((goal - start + np.pi) % (2 * np.pi) - np.pi),
        ),
        Mistake(
            "This adds t times the goal to the start. What is to be added is a part of the "
            "difference.",
            lambda start, goal, t: start + t * goal,
        ),
    ],
)


def _joints(start: Array, goal: Array, lengths: Array) -> Array:
    """Return where shoulder, elbow and tip are, at 41 times."""
    t = np.linspace(0, 1, 41)[:, None]
    return arm_forward_kinematics((1 - t) * start + t * goal, lengths).joints


def _tips(start: Array, goal: Array, lengths: Array) -> Array:
    return _joints(start, goal, lengths)[:, 2]


def _absolute(start: Array, goal: Array, lengths: Array) -> Array:
    """Return the tips for somebody who measures the second angle from the world's x axis."""
    t = np.linspace(0, 1, 41)[:, None]
    q = (1 - t) * start + t * goal
    return np.column_stack([np.cos(q) @ lengths, np.sin(q) @ lengths])


def _straight(start: Array, goal: Array) -> Array:
    return np.array(np.linspace(start, goal, 41))


DRAW_TIP = Drawing(
    answer=lambda start, goal, lengths: [_tips(start, goal, lengths)],
    inputs=[(start, goal, np.array([2.0, 1.5])) for start, goal, _ in _JOINTS[:2]],
    mistakes=[
        Mistake(
            "x and y are swapped.",
            lambda start, goal, lengths: [_tips(start, goal, lengths)[:, ::-1]],
        ),
        Mistake(
            "These are the angles, not the places of the tip.",
            lambda start, goal, lengths: [_straight(start, goal)],
        ),
        Mistake(
            "This is the way of the elbow. Go on to the end of the second link.",
            lambda start, goal, lengths: [_joints(start, goal, lengths)[:, 1]],
        ),
        Mistake(
            "The second angle is measured from the first link, not from the world's x axis: link 2 "
            "heads in the direction of the sum of the two.",
            lambda start, goal, lengths: [_absolute(start, goal, lengths)],
        ),
        Mistake(
            "The two lengths are exchanged: the first is that of link 1.",
            lambda start, goal, lengths: [_tips(start, goal, lengths[::-1])],
        ),
        Mistake(
            "This is the straight line between the two places of the tip. The motors turn evenly; "
            "the tip does what comes of it.",
            lambda start, goal, lengths: [_straight(*_tips(start, goal, lengths)[[0, -1]])],
        ),
    ],
)

_PLACES = [
    *((np.array(tip), np.array([2.0, 1.5])) for tip in ([1.0, 2.0], [-2.0, 1.5], [-1.0, -1.5])),
    (np.array([0.2, 0.6]), np.array([1.5, 2.0])),
]


def _swapped(y: float, x: float) -> float:
    return float(np.arctan2(x, y))


def _ratio(y: float, x: float) -> float:
    return float(np.arctan(y / x))


def _elbow(
    tip: Array,
    lengths: Array,
    *,
    sign: int = 1,
    inner: int = 1,
    cosine: int = 1,
    heading: Callable[[float, float], float] = np.arctan2,
    bend: Callable[[float, float], float] = np.arctan2,
) -> Array:
    """Return the angles by the law of cosines, with what people get wrong in it."""
    a, b = lengths
    theta1 = sign * np.arccos(cosine * (tip @ tip - a**2 - b**2) / (2 * a * b))
    bent = bend(b * np.sin(theta1), a + b * np.cos(theta1))
    return np.array([heading(tip[1], tip[0]) - inner * bent, theta1])


def _right_elbow(tip: Array, lengths: Array) -> Array:
    found = arm_inverse_kinematics(tip, lengths)
    return found[np.argmax(np.sin(found[:, 1]))]


ARM_ANGLES = Problem(
    answer=_right_elbow,
    inputs=_PLACES,
    read=lambda q: np.array([np.cos(q[0]), np.sin(q[0]), q[1]]),  # full turns of θ₀ do not count
    mistakes=[
        Mistake(
            "x and y are swapped: np.arctan2 takes the sine part first, arctan2(y, x).",
            lambda tip, lengths: _elbow(tip, lengths, heading=_swapped),
            lambda tip, lengths: _elbow(tip, lengths, bend=_swapped),
            lambda tip, lengths: _elbow(tip, lengths, heading=_swapped, bend=_swapped),
        ),
        Mistake(
            "np.arctan of a ratio loses the quadrant: where the denominator is negative it points "
            "the other way. Take np.arctan2.",
            lambda tip, lengths: _elbow(tip, lengths, heading=_ratio),
            lambda tip, lengths: _elbow(tip, lengths, bend=_ratio),
            lambda tip, lengths: _elbow(tip, lengths, heading=_ratio, bend=_ratio),
        ),
        Mistake(
            "np.arcsin never gives more than 90°, and the angle at the shoulder may be larger. "
            "Take np.arctan2, or np.arccos.",
            lambda tip, lengths: _elbow(
                tip, lengths, bend=lambda y, x: float(np.arcsin(y / np.hypot(y, x)))
            ),
        ),
        Mistake(
            "This is the other elbow: a right answer to another question. 0 ≤ θ₁ ≤ π is asked for.",
            lambda tip, lengths: _elbow(tip, lengths, sign=-1),
            lambda tip, lengths: _elbow(tip, lengths, sign=-1) - [0, -2 * np.pi],
        ),
        Mistake(
            "The angles are right up to full turns. 0 ≤ θ₁ ≤ π is asked for.",
            lambda tip, lengths: _elbow(tip, lengths) - [0, -2 * np.pi],
            lambda tip, lengths: _elbow(tip, lengths) - [0, 2 * np.pi],
        ),
        Mistake(
            "The two angles are exchanged: θ₀ comes first.",
            lambda tip, lengths: _elbow(tip, lengths)[::-1],
        ),
        Mistake(
            "θ₀ is not the direction of the tip: link 1 points elsewhere. The angle of the "
            "triangle at the shoulder is missing.",
            lambda tip, lengths: _elbow(tip, lengths, inner=0),
        ),
        Mistake(
            "The angle at the shoulder has the wrong sign: when the elbow bends to the left, link "
            "1 points to the right of the tip.",
            lambda tip, lengths: _elbow(tip, lengths, inner=-1),
        ),
        Mistake(
            "You took the angle inside the triangle for θ₁. θ₁ = 0 is the stretched arm, where the "
            "angle inside is 180°.",
            lambda tip, lengths: _elbow(tip, lengths, cosine=-1),
            lambda tip, lengths: _elbow(tip, lengths) * [1, -1] + [0, np.pi],
        ),
        Mistake(
            "θ₁ is measured from link 1, not from the world's x axis.",
            lambda tip, lengths: _elbow(tip, lengths) @ [[1, 1], [0, 1]],
        ),
        Mistake(
            "These are degrees. Radians are asked for.",
            lambda tip, lengths: np.degrees(_elbow(tip, lengths)),
            lambda tip, lengths: np.degrees(_right_elbow(tip, lengths)),
        ),
    ],
)
