"""Checks of arguments: a failed check raises a ValueError that names the first bad entry."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from operator import index
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._numerics import EPS, Array

Rng: TypeAlias = "np.random.Generator | int | None"  # in quotes, so numpy.random is not imported
SINGLE = 1e-6  # numbers in single precision are exact to this, after a few operations


def as_array(
    name: str, value: ArrayLike, *core: int | str, stacked: bool = True, copy: bool = True
) -> Array:
    """Return `value` as an array of floats; its last axes must have the sizes `core`.

    Ragged and masked arrays, and entries that are not real numbers, are refused. A letter in `core`
    matches any size ≥ 1, repeated letters match the same size, and "n+1" matches any size ≥ 2. For
    example, ``as_array("M", M, "n", "n")`` takes a stack of square matrices. All other axes are
    batch axes; with ``stacked=False``, no batch axis is allowed. Entries may be NaN or infinite.
    With ``copy=False``, the result may be the input. Where square matrices are wanted, objects with
    a method ``as_matrix``, such as SciPy's ``Rotation`` and ``RigidTransform``, are replaced by
    their matrices.
    """
    given = value if type(value) is np.ndarray else _array_of(name, value, *core)
    if given.dtype.kind not in "biuf":
        dates = f"; seconds are ({name} - {name}[0]) / np.timedelta64(1, 's')"
        cure = dates if given.dtype.kind == "M" else ""
        raise ValueError(f"{name}: real numbers are wanted, got dtype {given.dtype}{cure}")
    if not _has_core(given.shape, core) or (given.ndim > len(core) and not stacked):
        wanted = ", ".join([*["..."] * stacked, *map(str, core)])
        raise ValueError(f"{name}: shape ({wanted}) is wanted, got {given.shape}")
    array: Array = given.astype(np.float64, copy=copy)
    return array


def as_finite(name: str, value: ArrayLike, *core: int | str, stacked: bool = True) -> Array:
    """Return `value` as `as_array` does, but refuse NaN and infinity."""
    array = as_array(name, value, *core, stacked=stacked)
    if not math.isfinite(np.vdot(array, array)):  # 0.7 µs instead of 3 for np.isfinite(array).all()
        check_all(np.isfinite(array), name, array, "a finite number")
    return array


def as_single(name: str, value: ArrayLike, *core: int | str) -> Array:
    """Return `value` as `as_finite` does, but refuse a stack of arrays."""
    return as_finite(name, value, *core, stacked=False)


def as_unit(name: str, value: ArrayLike, size: int) -> Array:
    """Return vectors, divided by their norms."""
    array = as_finite(name, value, size)
    largest = np.abs(array).max(axis=-1, keepdims=True)
    if not largest.all():
        entry = first_index(name, largest[..., 0] == 0)
        raise ValueError(f"{entry} is zero: it has no direction")
    scaled = array / largest  # avoids overflow of the squares
    return scaled / np.linalg.norm(scaled, axis=-1, keepdims=True)


def as_symmetric(name: str, value: ArrayLike, size: int | str) -> Array:
    """Return square matrices; they must be symmetric up to single precision.

    The matrices are replaced by their symmetric parts.
    """
    half = as_finite(name, value, size, size) / 2  # so that nothing overflows
    mirrored = np.swapaxes(half, -1, -2)
    skew, largest = (np.abs(x).max(axis=(-2, -1)) for x in (half - mirrored, half))
    crooked = skew > SINGLE * largest
    if crooked.any():
        share = (skew[crooked] / largest[crooked]).flat[0]
        raise ValueError(
            f"{first_index(name, crooked)} is not symmetric: two entries differ by {share:.2g} "
            f"of the largest one, and {SINGLE:g} is allowed"
        )
    return half + mirrored


def as_inertia(name: str, value: ArrayLike) -> Array:
    """Return 3 × 3 matrices; they must be symmetric and positive definite.

    The squares of their eigenvalues must neither overflow nor underflow.
    """
    G = as_symmetric(name, value, 3)
    moments = np.linalg.eigvalsh(G)
    refused = moments[..., 0] <= 8 * EPS * np.abs(moments).max(axis=-1)
    if refused.any():
        listed = ", ".join(f"{x:.6g}" for x in moments[refused][0])
        raise ValueError(
            f"{first_index(name, refused)} is not positive definite, to rounding: its eigenvalues "
            f"are {listed}"
        )
    refused = (moments[..., 0] < 1e-150) | (moments[..., 2] > 1e150)
    if refused.any():
        listed = ", ".join(f"{x:.6g}" for x in moments[refused][0])
        raise ValueError(
            f"{first_index(name, refused)}: eigenvalues from 1e-150 to 1e150 are wanted, got "
            f"{listed}; use another unit"
        )
    return G


def as_within_unit(name: str, value: ArrayLike, *core: int | str) -> Array:
    """Return `value` as `as_finite` does; all entries must lie in [0, 1]."""
    array = as_finite(name, value, *core)
    check_all((array >= 0) & (array <= 1), name, array, "a number in [0, 1]")
    return array


def as_time(
    t: ArrayLike, batch_ndim: int, domain: tuple[float, float | Array] = (0.0, 1.0)
) -> Array:
    """Append `batch_ndim` axes of length 1 to the times `t`, which must lie in the domain.

    A time that is outside the domain by at most 8 eps of the larger end is replaced by the nearer
    end; eps is that of the type of `t`. The end of the domain is a number, or an array that
    broadcasts with the times.
    """
    times, (start, end) = as_array("t", t, copy=False), domain
    if not _all((times >= start) & (times <= end)):
        times = as_finite("t", t)
        ends = np.broadcast_to(end, times.shape)
        given = np.asarray(t).dtype
        eps = max(EPS, float(np.finfo(given).eps)) if given.kind == "f" else EPS
        slack = 8 * eps * np.maximum(abs(start), np.abs(ends))
        outside = (times < start - slack) | (times > ends + slack)
        wanted = f"a time in [{start:.17g}, {ends[outside][0] if outside.any() else 1:.17g}]"
        check_all(~outside, "t", times, wanted)
        times = np.clip(times, start, ends)
    return times.reshape(times.shape + (1,) * batch_ndim)


def as_duration(name: str, value: ArrayLike) -> Array:
    """Return durations of at least 1e-100; shorter ones would make accelerations overflow."""
    durations = as_finite(name, value)
    check_all(durations >= 1e-100, name, durations, "a duration from 1e-100 up")
    return durations


def as_angle(angle: ArrayLike) -> Array:
    """Return angles of rotation in [0, π]; an angle that exceeds π only by rounding becomes π."""
    angles = as_finite("angle", angle)
    within = (angles >= 0) & (angles <= np.pi * (1 + 4 * EPS))
    check_all(within, "angle", angles, "an angle in [0, π]")
    return np.minimum(angles, np.pi)


def as_tolerance(name: str, value: float) -> float:
    """Return a tolerance: a number of at least 0."""
    tolerance = as_array(name, value)
    if tolerance.ndim or not tolerance >= 0:
        raise ValueError(f"{name}: a number from 0 up is wanted, got {value!r}")
    return float(tolerance)


def as_positive(name: str, value: float) -> float:
    """Return a number above 0."""
    if isinstance(value, bool | np.bool_):
        raise ValueError(f"{name} is {value}, a number above 0 is wanted")
    number = as_single(name, value)
    check_all(number > 0, name, number, "a number above 0")
    return float(number)


def as_count(name: str, value: int) -> int:
    """Return a count: an integer of at least 1."""
    if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < 1:
        raise ValueError(f"{name}: an integer from 1 up is wanted, got {value!r}")
    return int(value)


def as_size(size: int | Sequence[int] | None) -> tuple[int, ...]:
    """Return `size` as a batch shape; None gives (), and n gives (n,)."""
    given: Any = () if size is None else size
    lengths = given if isinstance(given, tuple | list) else [given]
    try:
        if any(isinstance(length, bool) for length in lengths):
            raise TypeError("a bool is not a length")
        shape = tuple(map(index, lengths))
    except TypeError as error:
        raise ValueError(f"size: None, an integer or a tuple is wanted, got {size!r}") from error
    if any(length < 0 for length in shape):
        raise ValueError(f"size: lengths from 0 up are wanted, got {size!r}")
    return shape


def as_generator(rng: Rng) -> np.random.Generator:
    """Return a generator of random numbers."""
    try:
        return np.random.default_rng(rng)
    except (TypeError, ValueError) as error:
        raise ValueError(f"rng: a Generator, a seed or None is wanted, got {rng!r}") from error


def check_order(order: int, most: int) -> int:
    """Return the order of a derivative; it must be an integer from 0 to `most`."""
    known = isinstance(order, int | np.integer) and not isinstance(order, bool)
    if not known or not 0 <= order <= most:
        wanted = ", ".join(map(str, range(most)))
        raise ValueError(f"order: {wanted} or {most} is wanted, got {order!r}")
    return order


def check_broadcast(**arguments: tuple[Array, int]) -> tuple[int, ...]:
    """Return the common batch shape of arrays; each is given with its number of core axes.

    If the batch shapes do not broadcast, the ValueError lists all of them.
    """
    batches = {name: array.shape[: array.ndim - core] for name, (array, core) in arguments.items()}
    if len(different := {*batches.values()}) == 1:
        return different.pop()
    try:
        return np.broadcast_shapes(*batches.values())
    except ValueError as error:
        listed = ", ".join(f"{name} {batch}" for name, batch in batches.items())
        raise ValueError(f"batch shapes do not broadcast: {listed}") from error


def first_index(name: str, chosen: NDArray[np.bool_]) -> str:
    """Return the name of the first chosen entry: ``R[0, 2]``, or ``R`` for a single value."""
    first = ", ".join(str(i) for i in np.argwhere(chosen)[0])
    return f"{name}[{first}]" if first else name


def check_all(passes: NDArray[np.bool_], name: str, array: Array, wanted: str) -> None:
    """Raise a ValueError that names the first entry that does not pass, and the wanted values."""
    if not _all(passes):
        value = array[~passes][0]
        raise ValueError(f"{first_index(name, ~passes)} is {value}, {wanted} is wanted")


def _all(passes: NDArray[np.bool_]) -> bool:
    """Return whether all are True; of a single one, in 0.1 µs instead of 2."""
    return bool(passes.all() if passes.ndim else passes)


def _array_of(name: str, value: Any, *core: int | str) -> NDArray[Any]:
    """Return an array; refuse ragged and masked arrays, and replace objects by their matrices."""
    if not core or core[-1] in core[:-1]:  # square matrices
        value = _matrices_of(value)
    parts = value if isinstance(value, list | tuple) else [value]
    ma = sys.modules.get("numpy.ma")  # if numpy.ma is not loaded, no array is masked
    if ma and any(isinstance(part, ma.MaskedArray) for part in parts):
        raise ValueError(
            f"{name}: an array without a mask is wanted, got a masked array; fill or compress it"
        )
    try:
        return np.asarray(value)
    except ValueError as error:
        raise ValueError(
            f"{name}: an array of numbers is wanted, got rows of unequal length"
        ) from error


def _matrices_of(value: Any) -> Any:
    """Return the matrices of an object, or of a list of objects, that has ``as_matrix``."""
    if hasattr(value, "as_matrix"):
        return value.as_matrix()
    if isinstance(value, list | tuple) and any(hasattr(part, "as_matrix") for part in value):
        return [_matrices_of(part) for part in value]
    return value


def _has_core(shape: tuple[int, ...], core: tuple[int | str, ...]) -> bool:
    tail = shape[len(shape) - len(core) :]
    if tail == core:
        return True
    letters = {c: size for c, size in zip(core, tail, strict=False) if isinstance(c, str)}
    wanted = tuple(letters.get(str(c), c) for c in core)
    return tail == wanted and all(size > ("+1" in c) for c, size in letters.items())
