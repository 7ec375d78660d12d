"""Problem set 1: what is asked of a body on a table and of a two-link arm, and what goes wrong."""

from collections.abc import Callable

import numpy as np

from rbcourse._numerics import Array
from rbcourse.arm import arm_forward_kinematics, arm_inverse_kinematics
from rbcourse.marking import Drawing, Mistake, Problem
from rbcourse.planar import matrix_from_planar, propagate_planar

IN_RADIANS = (
    "Angles are in radians here, and NumPy's functions take and give radians: convert none."
)


def _turn(angle: float) -> Array:
    return matrix_from_planar([0, 0, angle])[:2, :2]


def _scaled(pose: Array, factor: float) -> Array:
    return np.asarray(pose, float) * [1, 1, factor]


_POSES = [np.array(pose) for pose in ([4.0, 2.0, 0.5], [-1.0, 3.0, -2.0], [0.5, -2.5, 1.2])]

POSE_MATRIX = Problem(
    answer=matrix_from_planar,
    inputs=[(pose,) for pose in _POSES],
    mistakes=[
        Mistake(
            "The body turns the wrong way: your sines and cosines are transposed. The first column "
            "is the body's x axis as the world sees it.",
            lambda p: np.block([[_turn(-p[2]), p[:2, None]], [np.zeros((1, 2)), np.eye(1)]]),
        ),
        Mistake(
            "The whole matrix is transposed: x and y belong in the last column, 0 0 1 in the last "
            "row.",
            lambda p: matrix_from_planar(p).T,
        ),
        Mistake(
            "This is the inverse: it takes what the world says to what the body says. The other "
            "way is asked for.",
            lambda p: np.linalg.inv(matrix_from_planar(p)),
        ),
        Mistake(
            IN_RADIANS,
            lambda p: matrix_from_planar(_scaled(p, np.pi / 180)),
            lambda p: matrix_from_planar(_scaled(p, 180 / np.pi)),
        ),
    ],
)

SEEN_FROM_BODY = Problem(
    answer=lambda pose, point: _turn(pose[2]).T @ (point - pose[:2]),
    inputs=[
        (pose, np.array(point))
        for pose, point in zip(_POSES, ([5.0, 7.0], [2.0, 2.5], [-3.0, 1.0]), strict=True)
    ],
    mistakes=[
        Mistake(
            "This goes the other way: it takes coordinates that the body gives to those that the "
            "world gives.",
            lambda pose, point: _turn(pose[2]) @ point + pose[:2],
        ),
        Mistake(
            "The body's centre is missing. Seen from the body, its own centre is at (0, 0); with "
            "your function it is not.",
            lambda pose, point: _turn(pose[2]).T @ point,
        ),
        Mistake(
            "The turn goes the wrong way. The body is turned by θ; to see with its eyes, turn the "
            "arrow from its centre to the point back.",
            lambda pose, point: _turn(pose[2]) @ (point - pose[:2]),
        ),
        Mistake(
            "The order is wrong: you turn first, and subtract a place of the world afterwards. "
            "Subtract while both are still in the world's coordinates.",
            lambda pose, point: _turn(pose[2]).T @ point - pose[:2],
        ),
        Mistake(
            IN_RADIANS,
            lambda pose, point: _turn(np.radians(pose[2])).T @ (point - pose[:2]),
            lambda pose, point: _turn(np.degrees(pose[2])).T @ (point - pose[:2]),
        ),
    ],
)


def _held(start: Array, plan: list[tuple[Array, float]]) -> Array:
    """Return what comes of body velocities that are held in the direction they had at first."""
    poses = [np.asarray(start, float)]
    for velocity, duration in plan:
        step = np.array([*(_turn(poses[-1][2]) @ velocity[:2]), velocity[2]])
        poses.append(poses[-1] + step * duration)
    return np.array(poses)


_PLAN = [
    (np.array([1.0, 0.5, 0.25]), 3.0),
    (np.array([0.0, -1.0, 0.5]), 0.5),
    (np.array([2.0, 1.0, -1.0]), 1.5),
]

RUN_PLAN = Problem(
    answer=lambda start, plan: propagate_planar(start, plan),
    inputs=[(_POSES[0], _PLAN), (_POSES[1], _PLAN[:2])],
    mistakes=[
        Mistake(
            "The durations are missing: a velocity acts for its time.",
            lambda start, plan: propagate_planar(start, [(v, 1) for v, _ in plan]),
        ),
        Mistake(
            "The start is missing: N commands make N + 1 poses.",
            lambda start, plan: propagate_planar(start, plan)[1:],
        ),
        Mistake(
            "Only the last pose comes back. All are wanted, the start first.",
            lambda start, plan: propagate_planar(start, plan)[-1],
        ),
        Mistake(
            "Each command starts at the start. It should start where the command before it ended.",
            lambda start, plan: np.array([start, *(start + v * d for v, d in plan)]),
        ),
        Mistake(
            "You take the velocities along the axes of the body, which turn with it. Here they are "
            "meant along those of the world.",
            lambda start, plan: propagate_planar(start, plan, frame="body"),
            _held,
        ),
        Mistake(
            "Your plan starts from (0, 0, 0), not from the start that is given.",
            lambda start, plan: propagate_planar([0, 0, 0], plan),
        ),
    ],
)


def _short(start: float, goal: float) -> float:
    return float((goal - start + np.pi) % (2 * np.pi) - np.pi)


SHORT_WAY = Problem(
    answer=lambda start, goal, t: start + t * _short(start, goal),
    inputs=[
        (np.radians(170.0), np.radians(-170.0), 0.75),
        (np.radians(-100.0), np.radians(150.0), 0.75),
        (np.radians(30.0), np.radians(-40.0), 0.25),
        (np.radians(20.0), np.radians(385.0), 0.5),
        (np.radians(500.0), np.radians(10.0), 0.5),
    ],
    mistakes=[
        Mistake(
            "This blends the numbers as they are. From 170° to −170° that is 340° to the right, "
            "not 20° to the left.",
            lambda start, goal, t: (1 - t) * start + t * goal,
        ),
        Mistake(
            "You take the long way: what is left of the circle when the short way is cut off.",
            lambda start, goal, t: (
                start + t * (_short(start, goal) - 2 * np.pi)
                if _short(start, goal) > 0
                else start + t * (_short(start, goal) + 2 * np.pi)
            ),
        ),
        Mistake(
            "The way is right, but the result is folded back into one turn: a heading that passes "
            "180° jumps there. Fold the difference, not the result.",
            lambda start, goal, t: (start + t * _short(start, goal) + np.pi) % (2 * np.pi) - np.pi,
            lambda start, goal, t: (start + t * _short(start, goal)) % (2 * np.pi),
        ),
        Mistake(
            "You always turn to the left. The short way may be to the right: keep the sign.",
            lambda start, goal, t: start + t * abs(_short(start, goal)),
            lambda start, goal, t: start + t * ((goal - start) % (2 * np.pi)),
        ),
        Mistake(
            "You fold both headings first, and blend then. That only moves the place where the "
            "numbers jump: fold the difference of the two.",
            lambda start, goal, t: (1 - t) * (start % (2 * np.pi)) + t * (goal % (2 * np.pi)),
            lambda start, goal, t: (1 - t) * _short(0, start) + t * _short(0, goal),
        ),
    ],
)

_JOINTS = [
    (np.array([0.2, 1.0]), np.array([1.5, -0.7]), 0.25),
    (np.array([-1.0, 0.4]), np.array([2.0, 0.9]), 0.8),
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
    inputs=[(start, goal, np.array([2.0, 1.5])) for start, goal, _ in _JOINTS],
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
            "This is the straight line between the two places of the tip. The motors turn evenly; "
            "the tip does what comes of it.",
            lambda start, goal, lengths: [_straight(*_tips(start, goal, lengths)[[0, -1]])],
        ),
    ],
)

_PLACES = [(np.array(tip), np.array([2.0, 1.5])) for tip in ([1.0, 2.0], [-2.0, 1.5], [-1.0, -1.5])]


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
    read=lambda q: np.array([np.cos(q), np.sin(q)]),  # full turns do not count
    mistakes=[
        Mistake(
            "x and y are swapped: np.arctan2 takes the sine part first, arctan2(y, x).",
            lambda tip, lengths: _elbow(tip, lengths, heading=_swapped),
            lambda tip, lengths: _elbow(tip, lengths, bend=_swapped),
            lambda tip, lengths: _elbow(tip, lengths, heading=_swapped, bend=_swapped),
        ),
        Mistake(
            "np.arctan of a ratio loses the quadrant: for a tip with x < 0 it points the other "
            "way. Take np.arctan2.",
            lambda tip, lengths: _elbow(tip, lengths, heading=_ratio),
        ),
        Mistake(
            "This is the other elbow: a right answer to another question. θ₁ ≥ 0 is asked for.",
            lambda tip, lengths: _elbow(tip, lengths, sign=-1),
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
