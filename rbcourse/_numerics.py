"""Numerical tools: ratios near zero, products, scaling by powers of two, blocks, progress."""

import math
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
EPS = float(np.finfo(np.float64).eps)
CACHED = 4096  # vectors that are converted together; with 1,024, `exp_so3` takes 1.3 times as long
BLOCK = 5000  # matrices that are computed together, which bounds the memory for workspaces
Item = TypeVar("Item")


def sinc(x: Array) -> Array:
    """Return sin(x)/x, and 1 at x = 0."""
    return np.where(x == 0, 1.0, np.sin(x) / np.where(x == 0, 1.0, x))[()]


def sine_gap_ratio(x: Array) -> Array:
    """Return (x − sin x)/x³, and 1/6 at x = 0, with an absolute error of eps/x²."""
    tiny = np.abs(x) < 1e-4  # accurate enough, since the caller multiplies by x³
    return np.where(tiny, 1 / 6, (1 - sinc(x)) / np.where(tiny, 1.0, x) ** 2)


def solve(A: Array, b: Array) -> Array:
    """Return the solution x of A x = b; the annotation of `numpy.linalg.solve` is less precise."""
    x: Any = np.linalg.solve(A, b)
    return x


def matvec(A: Array, x: Array) -> Array:
    """Return A x for matrices A of shape (..., m, n) and vectors x of shape (..., n)."""
    return (A @ x[..., None])[..., 0]


def cross(x: Array, y: Array, axis: int = -1) -> Array:
    """Return x × y, several times faster than `numpy.cross`; `axis` is 0 or −1."""
    product = np.empty(np.broadcast(x, y).shape)
    if axis == -1 and x.ndim != y.ndim:  # the transposes below align the first axes
        x, y = (z.reshape((1,) * (product.ndim - z.ndim) + z.shape) for z in (x, y))
    (a, b, c), (u, v, w), parts = (z if axis == 0 else z.T for z in (x, y, product))
    parts[0], parts[1], parts[2] = b * w - c * v, c * u - a * w, a * v - b * u
    return product


def scaled(matrix: Array, axis: int | tuple[int, int] = (-2, -1)) -> Array:
    """Divide matrices or columns by powers of two, so that the largest entries are in [0.5, 1)."""
    _, exponent = np.frexp(np.abs(matrix).max(axis=axis, keepdims=True))
    return np.ldexp(matrix, -exponent)


def blocks(count: int, size: int = BLOCK) -> Iterator[slice]:
    """Yield slices that divide `count` items into parts of at most `size`."""
    for start in range(0, count, size):
        yield slice(start, min(start + size, count))


def in_blocks(function: Callable[[Array], Array], x: Array, size: int) -> Array:
    """Return function(x) for vectors x of shape (..., n), in blocks whose workspaces fit the cache.

    The results are square matrices of the given size.
    """
    count = math.prod(x.shape[:-1])
    if count <= CACHED:
        return function(x)
    flat, done = x.reshape(count, -1), np.empty((count, size, size))
    for part in blocks(count, CACHED):
        done[part] = function(flat[part])
    return done.reshape(*x.shape[:-1], size, size)


def reported(work: str, items: Sequence[Item]) -> Iterator[Item]:
    """Yield the items; after 10 s, and then every 5 s, write the progress to stderr."""
    due = time.monotonic() + 10
    for number, item in enumerate(items):
        if time.monotonic() > due:
            print(f"{work}: {number / len(items):.0%}", file=sys.stderr, flush=True)
            due = time.monotonic() + 5
        yield item
