"""Problem set 3: what is asked of random rotations, and what goes wrong."""

from collections.abc import Callable

import numpy as np

from rbclassroom.assignments.marking import Drawing, Mistake, Problem
from rbclassroom.assignments.marking_samplers import Sampler
from rbcourse import (
    Array,
    exp_so3,
    matrix_from_quaternion,
    quaternion_from_matrix,
    quaternion_from_rotation_vector,
)
from rbcourse.sampling import angle_law, arvo_rotation, sample_quaternion_naive, shoemake_quaternion

Generator = np.random.Generator
FULL = 2 * np.pi


def _normalised(points: Array) -> Array:
    return points / np.linalg.norm(points, axis=-1, keepdims=True)


def _cosine(c: Array) -> Array:
    """Return (1 + c)/2, uniform if c is the height of a uniform point of the sphere."""
    return (1 + c) / 2


# Directions: heights along these axes, and between pairs of draws.
_AXES = _normalised(
    np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1], [1, 1, -1], [1, -1, 1], [-1, 1, 1]])
)


def _direction_fault(drawn: Array) -> str:
    lengths = np.linalg.norm(drawn, axis=1)
    return _off_length("A direction", lengths)


def _off_length(what: str, lengths: Array) -> str:
    worst = lengths[np.argmax(np.abs(lengths - 1))]
    if abs(worst - 1) > 1e-9:
        return f"{what} has the length 1; one of yours has {worst:.10g}."
    return ""


def _direction_rows(drawn: Array) -> dict[str, Array]:
    rows = {f"the height along {axis.round(2).tolist()}": drawn @ axis for axis in _AXES}
    half = len(drawn) // 2
    rows["the height of a draw along the one before"] = np.einsum(
        "ni,ni->n", drawn[: 2 * half : 2], drawn[1 : 2 * half : 2]
    )
    return {name: _cosine(row) for name, row in rows.items()}


def _from_angles(colatitude: Array, longitude: Array) -> Array:
    s = np.sin(colatitude)
    return np.stack([s * np.cos(longitude), s * np.sin(longitude), np.cos(colatitude)], axis=-1)


RANDOM_DIRECTION = Sampler(
    shape=(3,),
    fault=_direction_fault,
    uniforms=_direction_rows,
    mistakes=[
        Mistake(
            "These are points of a cube, divided by their lengths: its corners are too frequent. "
            "Which law looks the same from all sides?",
            lambda n, rng: _normalised(rng.uniform(-1, 1, (n, 3))),
        ),
        Mistake(
            "These crowd at the poles: latitude and longitude are uniform, and near the poles a "
            "degree of latitude has less area. By Archimedes it is the height that is uniform.",
            lambda n, rng: _from_angles(*rng.uniform(0, [[np.pi], [FULL]], (2, n))),
            lambda n, rng: _from_angles(*rng.uniform(0, FULL, (2, n))),
        ),
        Mistake(
            "All your numbers are positive: that is an eighth of the sphere.",
            lambda n, rng: _normalised(rng.uniform(0, 1, (n, 3))),
            lambda n, rng: _normalised(np.abs(rng.normal(size=(n, 3)))),
        ),
        Mistake(
            "These are on one half of the sphere: the height goes from −1 to 1.",
            lambda n, rng: _from_angles(np.arccos(rng.uniform(0, 1, n)), rng.uniform(0, FULL, n)),
        ),
    ],
)


def _angles(R: Array) -> Array:
    trace = np.trace(R, axis1=-2, axis2=-1)
    return angle_law(np.arccos(np.clip((trace - 1) / 2, -1, 1)))


_FIXED = exp_so3([0.4, -1.1, 0.7])
_DIAGONALS = _normalised(np.array([[1, 1, 1], [1, 1, -1], [1, -1, 1]]))


def _rotation_rows(R: Array) -> dict[str, Array]:
    """Return what is uniform: every entry, in any frames, and the laws of three angles."""
    rows = {f"the entry R[{i}, {j}]": _cosine(R[:, i, j]) for i in range(3) for j in range(3)}
    for i, x in enumerate(_DIAGONALS):
        for j, y in enumerate(_DIAGONALS):
            rows[f"the cosine between diagonal {i} and the image of diagonal {j}"] = _cosine(
                R @ y @ x
            )
    half = len(R) // 2
    back = np.swapaxes(R, 1, 2)
    rows["the angle of the turn"] = _angles(R)
    rows["the angle to a fixed rotation"] = _angles(_FIXED.T @ R)
    rows["the angle from a draw to the next"] = _angles(back[: 2 * half : 2] @ R[1 : 2 * half : 2])
    return rows


def _rotation_fault(R: Array) -> str:
    stretch = np.linalg.svd(R, compute_uv=False)
    if np.abs(stretch - 1).max() > 1e-9:
        if np.abs(stretch[:, :2] - 1).max() < 1e-9:
            return (
                "A draw is no rotation. If you reflect by I − 2VVᵀ: V has not the length 1. Its "
                "radius is √z and its height √(1 − z); are both roots there?"
            )
        worst = stretch[np.argmax(np.abs(stretch - 1).max(axis=1))]
        return f"A draw is no rotation: its singular values are {worst.round(10).tolist()}."
    negative = (np.linalg.det(R) < 0).mean()
    if negative > 0:
        how = "all" if negative == 1 else f"{negative:.0%}"
        return (
            f"The determinant is −1 for {how} of your draws: mirrors. A reflection times a turn is "
            "a mirror; one sign more makes it a rotation."
        )
    return ""


def _three_turns(n: int, rng: Generator, axes: str, low: float, high: float) -> Array:
    """Return products of turns about three axes, the middle one by an angle in [low, high)."""
    a, b, c = rng.uniform([0, low, 0], [FULL, high, FULL], (n, 3)).T
    first, second, third = (
        exp_so3(angle[:, None] * np.eye(3)["xyz".index(axis)])
        for angle, axis in zip((a, b, c), axes, strict=True)
    )
    return first @ second @ third


def _naive(axes: str, low: float, high: float) -> Callable[[int, Generator], Array]:
    return lambda n, rng: _three_turns(n, rng, axes, low, high)


def _by_qr(n: int, rng: Generator, signs: Callable[[Array], Array]) -> Array:
    Q = np.linalg.qr(rng.normal(size=(n, 3, 3)))[0]
    return np.array(Q * signs(np.linalg.det(Q)[:, None, None]))


def _by_axis(n: int, rng: Generator, largest: float) -> Array:
    return _normalised(rng.normal(size=(n, 3))) * rng.uniform(0, largest, (n, 1))


THREE_ANGLES = (
    "Three uniform angles are no uniform rotation: where the first and the third axis nearly "
    "agree, too many rotations crowd in too little room. Areas count, not degrees."
)
EVEN_ANGLE = (
    "The axis is uniform, and so is the angle. But small turns are rare: there is little room near "
    "I. Which law has the angle?"
)

RANDOM_ROTATION = Sampler(
    shape=(3, 3),
    fault=_rotation_fault,
    uniforms=_rotation_rows,
    mistakes=[
        Mistake(
            THREE_ANGLES,
            *(
                _naive(axes, low, high)
                for axes in ("zyx", "xyz", "zyz", "zxz")
                for low, high in ((0, FULL), (0, np.pi), (-np.pi / 2, np.pi / 2))
            ),
        ),
        Mistake(
            "A root is missing: with z in the place of √z the images of the z axis crowd at one "
            "pole. The square of the radius is to be uniform.",
            lambda n, rng: arvo_rotation(rng.random((n, 3)) ** [1, 1, 2]),
        ),
        Mistake(
            EVEN_ANGLE,
            lambda n, rng: exp_so3(_by_axis(n, rng, np.pi)),
            lambda n, rng: exp_so3(_by_axis(n, rng, FULL)),
        ),
        Mistake(
            "Q of a QR decomposition is not uniform by itself: the library chooses its signs. "
            "Multiply the columns of Q by the signs of R's diagonal, and then see to the "
            "determinant.",
            lambda n, rng: _by_qr(n, rng, lambda d: d),
            lambda n, rng: _by_qr(n, rng, lambda d: 1 + (d - 1) * [1, 0, 0]),
            lambda n, rng: _by_qr(n, rng, lambda d: 1 + (d - 1) * [0, 1, 0]),
            lambda n, rng: _by_qr(n, rng, lambda d: 1 + (d - 1) * [0, 0, 1]),
        ),
        Mistake(
            "The turn about z goes only half way round: its angle is uniform on [0, 2π).",
            lambda n, rng: arvo_rotation(rng.random((n, 3)) * [0.5, 1, 1]),
        ),
    ],
)


def _quaternion_fault(drawn: Array) -> str:
    lengths = np.linalg.norm(drawn, axis=1)
    if lengths.min() > 0.7 and lengths.max() <= 1 and lengths.max() - lengths.min() > 0.1:
        return (
            "The length is between 0.71 and 1, and should be 1: the two radii are √s and √(1 − s), "
            "whose squares add up to 1. Are the roots there?"
        )
    return _off_length("A unit quaternion", lengths)


def _rootless(x: Array) -> Array:
    """Return Shoemake's quaternions with s and 1 − s in the place of the roots, normalised."""
    s = x[:, 0]
    return shoemake_quaternion(np.column_stack([s**2 / (s**2 + (1 - s) ** 2), x[:, 1:]]))


RANDOM_QUATERNION = Sampler(
    shape=(4,),
    fault=_quaternion_fault,
    uniforms=lambda q: _rotation_rows(matrix_from_quaternion(q)),  # q and −q are one
    mistakes=[
        Mistake(
            THREE_ANGLES,
            lambda n, rng: sample_quaternion_naive(n, rng=rng),
            lambda n, rng: quaternion_from_matrix(_three_turns(n, rng, "xyz", 0, FULL)),
            lambda n, rng: quaternion_from_matrix(
                _three_turns(n, rng, "zyx", -np.pi / 2, np.pi / 2)
            ),
        ),
        Mistake(
            "The length is right, the law is not: dividing by the length does not make up for the "
            "missing roots. The radii are √s and √(1 − s).",
            lambda n, rng: _rootless(rng.random((n, 3))),
        ),
        Mistake(
            "These are points of a cube, divided by their lengths: its corners are too frequent. "
            "Which law looks the same from all sides?",
            lambda n, rng: _normalised(rng.uniform(-1, 1, (n, 4))),
        ),
        Mistake(
            "All your numbers are positive: that is a sixteenth of the sphere.",
            lambda n, rng: _normalised(rng.random((n, 4))),
            lambda n, rng: _normalised(np.abs(rng.normal(size=(n, 4)))),
        ),
        Mistake(
            f"{EVEN_ANGLE} (If you gave it the right one: a quaternion holds *half* the angle, "
            "cos(a/2), and sin(a/2) times the axis.)",
            lambda n, rng: quaternion_from_rotation_vector(_by_axis(n, rng, np.pi)),
            lambda n, rng: quaternion_from_rotation_vector(_by_axis(n, rng, FULL)),
        ),
        Mistake(
            "Both angles go only half way round: one of them at least is uniform on [0, 2π).",
            lambda n, rng: shoemake_quaternion(rng.random((n, 3)) * [1, 0.5, 0.5]),
        ),
    ],
)

ANGLE_DENSITY = Problem(
    answer=lambda a: (1 - np.cos(a)) / np.pi,
    inputs=[(0.5,), (2.0,), (3.0,)],
    mistakes=[
        Mistake(
            "This is the same for all angles. There is more room for large turns than for small.",
            lambda a: 1 / np.pi,
            lambda a: 1 / FULL,
        ),
        Mistake(
            "This is the density of the angle between a fixed direction and a random one, on the "
            "ordinary sphere. A rotation also turns about its axis.",
            lambda a: np.sin(a) / 2,
        ),
        Mistake(
            "This adds up to π over the angles from 0 to π, and should add up to 1.",
            lambda a: 1 - np.cos(a),
        ),
        Mistake(
            "This adds up to ½ over the angles from 0 to π, and should add up to 1. The angle of a "
            "rotation never exceeds π.",
            lambda a: (1 - np.cos(a)) / FULL,
        ),
        Mistake(
            "This is the probability of an angle of at most a. The density is its derivative.",
            lambda a: (a - np.sin(a)) / np.pi,
        ),
        Mistake(
            "This is what rotation vectors give that are uniform in the ball of radius π. Far from "
            "I there is less room among rotations than among their vectors.",
            lambda a: 3 * a**2 / np.pi**3,
        ),
        Mistake(
            "The angle comes in radians: convert nothing.",
            lambda a: (1 - np.cos(np.radians(a))) / np.pi,
            lambda a: (1 - np.cos(np.degrees(a))) / np.pi,
        ),
    ],
)

_EDGES = np.linspace(0, np.pi, 25)
_SAMPLE = np.pi * np.random.default_rng(5).random(400) ** 0.4  # any angles will do


def _bars(angles: Array, edges: Array, density: bool = True) -> Array:
    middles = (edges[1:] + edges[:-1]) / 2
    return np.column_stack([middles, np.histogram(angles, edges, density=density)[0]])


def _curve(edges: Array) -> Array:
    return np.column_stack([edges, (1 - np.cos(edges)) / np.pi])


DRAW_ANGLES = Drawing(
    answer=lambda angles, edges: [_bars(angles, edges), _curve(edges)],
    inputs=[(_SAMPLE, _EDGES), (_SAMPLE[:100], _EDGES[::2])],
    mistakes=[
        Mistake(
            "The bars are counts. To compare them with a density, draw the density of the sample: "
            "all areas add up to 1.",
            lambda angles, edges: [_bars(angles, edges, density=False), _curve(edges)],
            lambda angles, edges: [_bars(angles, edges, density=False)],
        ),
        Mistake(
            "The bars are shares of the sample. To compare them with a density, divide each by its "
            "width: all areas add up to 1.",
            lambda angles, edges: [_bars(angles, edges) * [1, edges[1] - edges[0]]],
        ),
        Mistake(
            "The bars stand with their middles on the edges. Each belongs between two edges: "
            'align="edge".',
            lambda angles, edges: [_bars(angles, edges) - [(edges[1] - edges[0]) / 2, 0]],
        ),
        Mistake(
            "The bars are right. The line of the density, through its values at the edges, is "
            "missing.",
            lambda angles, edges: [_bars(angles, edges)],
        ),
        Mistake(
            "The line of the density is right. The histogram is missing, or its bars are not "
            "between the given edges.",
            lambda angles, edges: [_curve(edges)],
        ),
        Mistake(
            "These are degrees. The law is a density per radian.",
            lambda angles, edges: [_bars(np.degrees(angles), np.degrees(edges))],
        ),
    ],
)
