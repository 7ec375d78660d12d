"""Problem set 1, first part: what is asked of a body on a table, and what goes wrong."""

import numpy as np

from rbclassroom.assignments.marking import IN_RADIANS, Mistake, Problem
from rbcourse import Array
from rbcourse.planar import matrix_from_planar, propagate_planar


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
            "Sine and cosine are exchanged: at θ = 0 the matrix should not turn anything.",
            lambda p: matrix_from_planar([p[0], p[1], np.pi / 2 - p[2]]),
            lambda p: matrix_from_planar([p[0], p[1], p[2] - np.pi / 2]),
        ),
        Mistake(
            "x and y are exchanged in the last column.",
            lambda p: matrix_from_planar([p[1], p[0], p[2]]),
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
            "The signs are wrong: the arrow goes from the body's centre to the point, not back.",
            lambda pose, point: _turn(pose[2]).T @ (pose[:2] - point),
        ),
        Mistake(
            "The second number is how far to the *left* the point is. Yours is how far to the "
            "right.",
            lambda pose, point: [1, -1] * (_turn(pose[2]).T @ (point - pose[:2])),
        ),
        Mistake(
            "The turn is missing: this is the arrow from the centre to the point as the world sees "
            "it.",
            lambda pose, point: point - pose[:2],
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


def _with_folded(path: Array) -> Array:
    return np.column_stack([path[:, :2], (path[:, 2] + np.pi) % (2 * np.pi) - np.pi])


_PLAN = [
    (np.array([1.0, 0.5, 0.25]), 3.0),
    (np.array([0.0, -1.0, 0.5]), 0.5),
    (np.array([2.0, 1.0, -1.0]), 1.5),
]

RUN_PLAN = Problem(
    answer=lambda start, plan: propagate_planar(start, plan),
    inputs=[(_POSES[0], _PLAN), (_POSES[1], _PLAN[:2]), (_POSES[2], [(_PLAN[0][0], 9.0)])],
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
            "All your poses are the last one: the list holds one array, again and again, and += "
            "changes it. Add to a copy.",
            lambda start, plan: propagate_planar(start, plan)[[-1] * (len(plan) + 1)],
        ),
        Mistake(
            "The headings are folded into one turn. θ counts turns here: leave it as it comes.",
            lambda start, plan: _with_folded(propagate_planar(start, plan)),
        ),
        Mistake(
            "Your plan starts from (0, 0, 0), not from the start that is given.",
            lambda start, plan: propagate_planar([0, 0, 0], plan),
        ),
    ],
)


def _short(start: float, goal: float) -> float:
    return float((goal - start + np.pi) % (2 * np.pi) - np.pi)


def _once(difference: float) -> float:
    """Return the difference folded by one turn at most."""
    if difference > np.pi:
        return difference - 2 * np.pi
    return difference + 2 * np.pi if difference < -np.pi else difference


SHORT_WAY = Problem(
    answer=lambda start, goal, t: start + t * _short(start, goal),
    inputs=[
        (np.radians(170.0), np.radians(-170.0), 0.75),
        (np.radians(-100.0), np.radians(150.0), 0.75),
        (np.radians(30.0), np.radians(-40.0), 0.25),
        (np.radians(20.0), np.radians(385.0), 0.5),
        (np.radians(500.0), np.radians(10.0), 0.5),
        (np.radians(20.0), np.radians(1000.0), 0.25),
    ],
    mistakes=[
        Mistake(
            "This blends the numbers as they are. From 170° to −170° that is 340° to the right, "
            "not 20° to the left. (Half a turn is π here, not 180.)",
            lambda start, goal, t: (1 - t) * start + t * goal,
        ),
        Mistake(
            "One turn more or less is not always enough: the headings are any numbers, and may be "
            "many turns apart.",
            lambda start, goal, t: start + t * _once(goal - start),
        ),
        Mistake(
            "The result is in degrees. Radians are asked for.",
            lambda start, goal, t: np.degrees(start + t * _short(start, goal)),
        ),
        Mistake(
            "You turn away from the goal: the difference is goal − start.",
            lambda start, goal, t: start - t * _short(start, goal),
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
