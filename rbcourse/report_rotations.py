"""The functions of the report RR on rotations, sections 1 and 2, under its own names.

Each hands its work to the package. What has the wrong shape, or is not finite, fails a check and
is refused by a correction.
"""

from collections.abc import Callable
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from rbcourse._checks import Rng, as_count, as_generator, as_single, as_tolerance, as_unit
from rbcourse._numerics import Array
from rbcourse.conversions import rotation_vector_from_quaternion
from rbcourse.draw.animate import Animation, animate
from rbcourse.draw.save import Table
from rbcourse.draw.spheres import describe_images, image_table, moving_images
from rbcourse.projection import is_se, is_so, project_se, project_so
from rbcourse.quaternion import is_unit_quaternion, project_quaternion, rotate_by_quaternion
from rbcourse.sampling import (
    sample_quaternion,
    sample_quaternion_naive,
    sample_rotation,
    sample_rotation_naive,
)
from rbcourse.so3 import exp_so3, log_so3

_V0 = np.array([0.0, 0.0, 1.0])
_V1 = np.array([0.0, 0.2, 0.0]) + _V0


def check_SOn(m: ArrayLike, epsilon: float = 0.01) -> bool:
    """Tell whether m is a rotation matrix: mᵀm = I and det m = 1, each entry within epsilon.

    Parameters
    ----------
    m : array_like
        Anything; only one square matrix of finite real numbers can pass. [[1]] is in SO(1).
    epsilon : float, optional
        The largest defect that passes.

    Returns
    -------
    bool

    Raises
    ------
    ValueError
        If `epsilon` is negative or NaN.

    References
    ----------
    RR 1.1, RR (1), RR (2).

    Examples
    --------
    >>> check_SOn([[0, -1], [1, 0]]), check_SOn([[0, 1], [1, 0]]), check_SOn([[1, 0]])
    (True, False, False)
    """
    return _passes(is_so, m, epsilon)


def check_quaternion(v: ArrayLike, epsilon: float = 0.01) -> bool:
    """Tell whether v is a unit quaternion: its norm is 1 within epsilon.

    Parameters
    ----------
    v : array_like
        Anything; only four finite real numbers (w, x, y, z) can pass.
    epsilon : float, optional
        The largest defect that passes.

    Returns
    -------
    bool

    Raises
    ------
    ValueError
        If `epsilon` is negative or NaN.

    References
    ----------
    RR 1.2, RR (3).

    Examples
    --------
    >>> check_quaternion([0.5, 0.5, 0.5, 0.5]), check_quaternion([1, 1, 0, 0])
    (True, False)
    """
    return _passes(is_unit_quaternion, v, epsilon)


def check_SEn(m: ArrayLike, epsilon: float = 0.01) -> bool:
    """Tell whether m is a pose: a rotation, any translation, and the last row 0, …, 0, 1.

    Parameters
    ----------
    m : array_like
        Anything; only one square matrix of finite real numbers, 2 × 2 or larger, can pass.
    epsilon : float, optional
        The largest defect of the rotation (see `check_SOn`) and of the last row that passes.

    Returns
    -------
    bool

    Raises
    ------
    ValueError
        If `epsilon` is negative or NaN.

    References
    ----------
    RR 1.3.

    Examples
    --------
    >>> check_SEn([[0, -1, 5], [1, 0, 7], [0, 0, 1]]), check_SEn([[1]])
    (True, False)
    """
    return _passes(is_se, m, epsilon)


def correct_SOn(m: ArrayLike, epsilon: float = 0.01) -> NDArray[Any]:
    """Return m as it is if it passes `check_SOn`, else the rotation matrix nearest to it.

    Parameters
    ----------
    m : array_like, shape (n, n)
        Any square matrix, a singular or reflected one too.
    epsilon : float, optional
        The largest defect that is left alone.

    Returns
    -------
    ndarray, shape (n, n)
        An equal copy, or `project_so` of m.

    Raises
    ------
    ValueError
        If `m` is not one square matrix of finite real numbers, or `epsilon` is negative or NaN.

    References
    ----------
    RR 1.4, RR (4), RR (5), RR Fig. 1.

    Examples
    --------
    >>> correct_SOn([[1, 2, 3], [4, 5, 6], [7, 8, 9]]).round(8)
    array([[-0.75271952,  0.38914789,  0.5310153 ],
           [ 0.38914789, -0.38759388,  0.83566435],
           [ 0.5310153 ,  0.83566435,  0.1403134 ]])
    """
    return np.array(m) if check_SOn(m, epsilon) else project_so(as_single("m", m, "n", "n"))


def correct_quaternion(v: ArrayLike, epsilon: float = 0.01) -> NDArray[Any]:
    """Return v as it is if it passes `check_quaternion`, else v over its norm.

    Parameters
    ----------
    v : array_like, shape (4,)
        A quaternion (w, x, y, z), not zero.
    epsilon : float, optional
        The largest defect that is left alone.

    Returns
    -------
    ndarray, shape (4,)
        An equal copy, or `project_quaternion` of v.

    Raises
    ------
    ValueError
        If `v` does not pass and is zero or not four finite real numbers, or `epsilon` is negative
        or NaN.

    References
    ----------
    RR 1.5, RR (6), RR Fig. 2.

    Examples
    --------
    >>> correct_quaternion([2, 2, 0, 0])
    array([0.70710678, 0.70710678, 0.        , 0.        ])
    """
    return np.array(v) if check_quaternion(v, epsilon) else as_unit("v", as_single("v", v, 4), 4)


def correct_SEn(m: ArrayLike, epsilon: float = 0.01) -> NDArray[Any]:
    """Return m as it is if it passes `check_SEn`, else the pose nearest to it.

    Parameters
    ----------
    m : array_like, shape (n + 1, n + 1)
        Any square matrix, n ≥ 1.
    epsilon : float, optional
        The largest defect that is left alone.

    Returns
    -------
    ndarray, shape (n + 1, n + 1)
        An equal copy, or `project_se` of m: the rotation corrected, the translation kept, the last
        row 0, …, 0, 1 whatever it was.

    Raises
    ------
    ValueError
        If `m` is not one square matrix of finite real numbers of that size, or `epsilon` is
        negative or NaN.

    References
    ----------
    RR 1.6, RR Fig. 3.

    Examples
    --------
    >>> correct_SEn([[3, 2, 4], [2, 3, 2], [0, 1, 1]]).round(12) + 0.0
    array([[1., 0., 4.],
           [0., 1., 2.],
           [0., 0., 1.]])
    """
    return np.array(m) if check_SEn(m, epsilon) else project_se(as_single("m", m, "n+1", "n+1"))


def random_rotation_matrix(naive: bool, *, rng: Rng = None) -> Array:
    """Return a random rotation matrix.

    Parameters
    ----------
    naive : bool
        True for three uniform angles, which is not uniform; False for Arvo's method, which is.
    rng : Generator, int or None, optional
        Where the random numbers come from.

    Returns
    -------
    ndarray, shape (3, 3)

    Raises
    ------
    ValueError
        If `naive` is neither True nor False, or `rng` makes no random numbers.

    References
    ----------
    RR 2.1.

    Examples
    --------
    >>> check_SOn(random_rotation_matrix(naive=False), 1e-14)
    True
    """
    return (sample_rotation_naive if _chosen("naive", naive) else sample_rotation)(rng=rng)


def random_quaternion(naive: bool, *, rng: Rng = None) -> Array:
    """Return a random unit quaternion.

    Parameters
    ----------
    naive : bool
        True for three uniform angles, which is not uniform; False for Shoemake's method, which is.
    rng : Generator, int or None, optional
        Where the random numbers come from.

    Returns
    -------
    ndarray, shape (4,)

    Raises
    ------
    ValueError
        If `naive` is neither True nor False, or `rng` makes no random numbers.

    References
    ----------
    RR 2.2.

    Examples
    --------
    >>> check_quaternion(random_quaternion(naive=False), 1e-14)
    True
    """
    return (sample_quaternion_naive if _chosen("naive", naive) else sample_quaternion)(rng=rng)


def visualize_rotation(rotation: ArrayLike, *, steps: int = 24) -> tuple[Figure, Animation]:
    """Show a rotation: how it carries v0 = (0, 0, 1) and v1 = v0 + (0, ε, 0) over the sphere.

    Parameters
    ----------
    rotation : array_like, shape (3, 3) or (4,)
        A rotation matrix or a unit quaternion, within 0.01; the nearest one is shown.
    steps : int, optional
        In how many equal steps about one axis it is reached.

    Returns
    -------
    figure : Figure
        The sphere with all images.
    animation : Animation
        They appear one by one. A notebook shows a player; ``animation.save(path)`` writes a GIF.

    Raises
    ------
    ValueError
        If `rotation` has another shape or does not pass `check_SOn` or `check_quaternion`, or
        `steps` is not 1 or more.

    References
    ----------
    RR 2.2.

    Examples
    --------
    >>> figure, animation = visualize_rotation(np.eye(3), steps=1)
    >>> plt.close(figure)
    """
    turn = _rotation_vector(rotation)
    R = exp_so3(np.linspace(0, 1, as_count("steps", steps) + 1)[:, None] * turn)
    place = ", ".join(f"{x:.2f}" for x in (R[-1] @ _V0).round(2) + 0.0)
    degrees = np.degrees(np.linalg.norm(turn))
    alt = f"A turn of {degrees:.0f} degrees carries the pole of a sphere to ({place})."
    return _show("rotation", alt, image_table({"one rotation": (R @ _V0, R @ _V1)}))


def visualize(
    quaternion: bool, *, naive: bool = False, rng: Rng = None, steps: int = 100
) -> tuple[Figure, Animation]:
    """Show 100 random rotations: where they carry v0 = (0, 0, 1) and v1 = v0 + (0, ε, 0).

    Parameters
    ----------
    quaternion : bool
        True for `random_quaternion`, with v ↦ q v q⁻¹; False for `random_rotation_matrix`.
    naive : bool, optional
        Whether the angles are drawn uniformly, which the rotations are not then.
    rng : Generator, int or None, optional
        Where the random numbers come from.
    steps : int, optional
        How many rotations.

    Returns
    -------
    figure : Figure
        The sphere with all images.
    animation : Animation
        They appear one by one. A notebook shows a player; ``animation.save(path)`` writes a GIF.

    Raises
    ------
    ValueError
        If `quaternion` or `naive` is neither True nor False, `rng` makes no random numbers, or
        `steps` is not 1 or more.

    References
    ----------
    RR 2.2, RR Fig. 4, RR Fig. 5.

    Examples
    --------
    >>> figure, animation = visualize(True, rng=1, steps=2)
    >>> plt.close(figure)
    """
    generator, count = as_generator(rng), range(as_count("steps", steps))
    if _chosen("quaternion", quaternion):
        q = np.array([random_quaternion(naive, rng=generator) for _ in count])
        images = rotate_by_quaternion(q, _V0), rotate_by_quaternion(q, _V1)
        data = image_table({"random quaternions": images})
        return _show("random_quaternions", describe_images(data), data)
    R = np.array([random_rotation_matrix(naive, rng=generator) for _ in count])
    data = image_table({"random matrices": (R @ _V0, R @ _V1)})
    return _show("random_matrices", describe_images(data), data)


def _show(name: str, alt: str, data: Table) -> tuple[Figure, Animation]:
    fig, ax = plt.subplots(figsize=(5, 5), dpi=80, subplot_kw={"projection": "3d"}, layout="none")
    frames = np.size(next(iter(data.values()))) + 1
    seconds = max(4.0, frames / 25)
    return fig, animate(fig, name, alt, moving_images([ax], data), frames, seconds)


def _passes(test: Callable[..., Any], x: ArrayLike, epsilon: float) -> bool:
    """Return what a test says of one member; a stack of them is none."""
    epsilon = as_tolerance("epsilon", epsilon)
    try:
        verdict = test(x, epsilon)
    except ValueError:
        return False
    return np.ndim(verdict) == 0 and bool(verdict)


def _chosen(name: str, value: bool) -> bool:
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"{name}: True or False wanted, got {value!r}")
    return bool(value)


def _rotation_vector(rotation: ArrayLike) -> Array:
    if check_SOn(rotation) and np.shape(rotation) == (3, 3):
        return log_so3(project_so(rotation))
    if check_quaternion(rotation):
        return rotation_vector_from_quaternion(project_quaternion(rotation))
    raise ValueError("rotation: a rotation matrix (3, 3) or a unit quaternion (4,) is wanted")
