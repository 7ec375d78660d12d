"""Inputs that break code even if it passes tests with random inputs."""

from itertools import product

import numpy as np
from scipy.spatial import transform

RigidTransform = getattr(transform, "RigidTransform", None)
"""The class of SciPy, or None before SciPy 1.16."""

AXES = np.array([a for a in product([-1, 0, 1], repeat=3) if any(a)], dtype=float)
"""The 26 directions to the faces, edges and corners of a cube. They are not normalised."""

UNIT_AXES = AXES / np.linalg.norm(AXES, axis=1, keepdims=True)

ANGLES = np.array(
    [0, 1e-300, 1e-160, 1e-12, 1e-9, 1e-8, 1e-6, 1e-4, 9.9e-5, 1e-3, 0.1, 1.0, np.pi / 2, 2.0, 3.0]
    + [np.pi - 10.0**-k for k in range(1, 9)]
)
"""Angles from 0 to 1e-8 below a half-turn."""

ROTATION_VECTORS = (ANGLES[:, None, None] * UNIT_AXES).reshape(-1, 3)

LINE_ANGLES = np.concatenate(
    [10.0 ** np.arange(-12, 0), [9e-7, 0.5, 1, np.pi / 2, 2, 3], np.pi - 10.0 ** -np.arange(1, 9)]
)
"""Angles from 1e-12 to π − 1e-8."""

_EARLY_TIMES = [0, 1e-300, 1e-16, 1e-9, 1e-3, 0.1, 0.25, 0.49, 0.5 - 1e-9, 0.5]
_LATE_TIMES = [0.5 + 1e-9, 0.6, 0.75, 0.9, 1 - 1e-3, 1 - 1e-9, 1 - 2.0**-53, 1]
LINE_TIMES = np.array([*_EARLY_TIMES, *_LATE_TIMES])


def half_turns():
    """Return exact half-turns 2 n nᵀ − I about the axes, the face diagonals, and (±2, ±2, ±1)/3."""
    faces = [a for a in AXES if np.count_nonzero(a) < 3]
    thirds = [np.array(s) * p for s in product([-1, 1], repeat=3) for p in _PERMUTED]
    axes = [a / np.sqrt(a @ a) for a in faces] + [a / 3 for a in thirds]
    matrices = [2 * np.outer(a, a) / (a @ a) - np.eye(3) for a in faces]
    matrices += [2 * np.outer(a, a) / 9 - np.eye(3) for a in thirds]
    return np.array(matrices), np.array(axes)


def rounded_half_turns(rng, count=500):
    """Return R0 and R1 = R0 (2 n nᵀ − I), both rounded, and the axes n; R0 and n are random."""
    R0 = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    R0[..., 0] *= np.linalg.det(R0)[:, None]
    n = np.concatenate([rng.normal(size=(count - 26, 3)), AXES])
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    return R0, R0 @ (2 * n[:, :, None] * n[:, None, :] - np.eye(3)), n


_PERMUTED = [np.array([2, 2, 1.0]), np.array([2, 1, 2.0]), np.array([1, 2, 2.0])]


def matrices(n, rng):
    """Return random, singular, reflected, tiny, huge, nearly orthogonal and zero matrices."""
    random = rng.normal(size=(40, n, n))
    orthogonal = np.linalg.qr(random)[0]
    low_rank = [random[k, :, :r] @ random[k, :r, :] for k in range(4) for r in range(1, n)]
    return np.concatenate(
        [
            random,
            orthogonal,
            -orthogonal,
            orthogonal + 1e-9 * random,
            1e-150 * random[:4],
            1e150 * random[:4],
            np.reshape(low_rank, (-1, n, n)),
            np.zeros((1, n, n)),
            np.eye(n)[None],
            -np.eye(n)[None],
            np.diag([1.0] * (n - 1) + [-1])[None],
        ]
    )


def quaternions():
    """Return unit quaternions of turns by `ANGLES` about `UNIT_AXES`."""
    half = ANGLES[:, None, None] / 2
    parts = np.broadcast_arrays(np.cos(half), np.sin(half) * UNIT_AXES)
    return np.concatenate([parts[0][..., :1], parts[1]], axis=-1).reshape(-1, 4)
