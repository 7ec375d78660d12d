"""The rivals of lesson 16: known ways to smooth rotations, and their errors on synthetic data.

``python -m rbclassroom.rivals`` computes the table of the lesson again, in about 15 minutes.
"""

from __future__ import annotations

import csv
import sys
import warnings
from collections.abc import Callable, Iterable
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline, make_smoothing_spline
from scipy.signal import savgol_filter
from scipy.spatial.transform import Rotation, RotationSpline

import rbcourse as rb
from rbclassroom.figures import rounded
from rbcourse import Array
from rbcourse.draw.save import csv_text
from rbcourse.files import replace_file

Smooth = Callable[..., Array]
"""A function of the time and of the order of a derivative, as a `Curve` is."""

TABLE = Path(__file__).with_name("rivals.csv")
POSES, FINE, SUBSTEPS = 120, 8, 32
"""The number of poses; each step is divided for the errors, and again for the integration."""
TIMES = np.linspace(0, POSES - 1, FINE * (POSES - 1) + 1)
STEPS, NOISES = (1, 5, 20, 60), (0.2, 1, 3, 10)
"""Mean turns from pose to pose, and root mean squares of the noise, in degrees."""
ERRORS = "R [1]", "w [1]", "a [1]"
"""Errors over the noise for the unit of time 1: of the rotation, of w and of w'."""


class Motion(NamedTuple):
    """A motion at `FINE` times a step, with the unit of time 1: rotations, w and w'."""

    t: Array
    R: Array
    w: Array
    a: Array


def wander(rng: np.random.Generator, step: float) -> Motion:
    """Return a motion whose w is a sum of waves with periods of about 26 steps."""
    frequencies = rng.normal(size=(40, 1, 3)) / 26
    phases = rng.uniform(0, 2 * np.pi, (40, 1, 3))

    def waves(t: Array, order: int) -> Array:
        angles = 2 * np.pi * (frequencies * t[:, None] + order / 4) + phases
        return np.sum((2 * np.pi * frequencies) ** order * np.cos(angles), axis=0)

    size = np.linalg.norm(waves(np.linspace(0, POSES - 1, 1000), 0), axis=1).mean()
    return _integrated(lambda t, order: step / size * waves(t, order))


def tumble(rng: np.random.Generator, step: float) -> Motion:
    """Return the free motion of a book."""
    G, start = np.diag([1, 2.22, 3.18]), rng.normal(size=3) * [1, 2, 1]
    start /= np.linalg.norm(start)
    flow = partial(rb.connection.geodesic_flow, G, np.eye(3))
    # w(t) of a free motion gives another one, speed * w(speed * t)
    _, w = flow(start, np.linspace(0, step * (POSES - 1), 2000))
    speed = step / np.linalg.norm(w, axis=1).mean()
    R, w = flow(speed * start, TIMES)
    return Motion(TIMES, R, w, np.cross(w @ G, w) / np.diag(G))


def reach(rng: np.random.Generator, step: float) -> Motion:
    """Return turns of least jerk about random axes, each in 18 steps, with rests of 6 steps."""
    t, count = TIMES, POSES // 24
    axes = rng.normal(size=(count, 3))
    turns = axes / np.linalg.norm(axes, axis=1)[:, None] * rng.uniform(0.6, 1.4, (count, 1))
    turns *= 18 * step
    starts = [np.eye(3)]
    for turn in rb.exp_so3(turns):
        starts.append(starts[-1] @ turn)
    i = np.minimum(t // 24, count - 1).astype(int)
    u = np.clip((t - 24 * i) / 18, 0, 1)[:, None]
    done, speed = u**3 * (10 - 15 * u + 6 * u**2), 30 * u**2 * (1 - u) ** 2 / 18
    change = 60 * u * (1 - u) * (1 - 2 * u) / 18**2
    R = np.array(starts)[i] @ rb.exp_so3(done * turns[i])
    return Motion(t, R, speed * turns[i], change * turns[i])


MOTIONS = {"wander": wander, "tumble": tumble, "reach": reach}


def _integrated(rates: Callable[[Array, int], Array]) -> Motion:
    """Return the motion with w(t) and w'(t), by a method of order four."""
    count = SUBSTEPS * (POSES - 1)
    h, half, apart = 1 / SUBSTEPS, np.arange(count) + 0.5, 3**0.5 / 6
    before, after = (rates((half + x) / SUBSTEPS, 0) for x in (-apart, apart))
    turns = rb.exp_so3(h * (before + after) / 2 + 3**0.5 / 12 * h**2 * np.cross(before, after))
    R = np.empty((count + 1, 3, 3))
    R[0] = np.eye(3)
    for i, turn in enumerate(turns):
        R[i + 1] = R[i] @ turn
    return Motion(TIMES, R[:: SUBSTEPS // FINE], rates(TIMES, 0), rates(TIMES, 1))


def interpolated(t: Array, R: Array) -> Smooth:
    """Return SciPy's spline through the rotations."""
    c = RotationSpline(t, Rotation.from_matrix(R))
    return lambda t, order=0: c(t, order) if order else c(t).as_matrix()


def by_vectors(t: Array, R: Array) -> Smooth:
    """Return SciPy's smoothing spline of unwrapped rotation vectors about the mean."""
    base, x = _vectors(R)
    splines = [make_smoothing_spline(t, column) for column in x.T]
    return _of_vectors(base, lambda t, k: np.stack([s(t, k) for s in splines], axis=-1))


def _of_vectors(base: Array, x: Callable[[Array, int], Array]) -> Smooth:
    """Return the rotations base exp(x), given x(t, order)."""

    def curve(t: Array, order: int = 0) -> Array:
        if order == 0:
            return base @ rb.exp_so3(x(t, 0))
        return (rb.right_jacobian_so3(x(t, 0)) @ x(t, 1)[..., None])[..., 0]

    return _with_differences(curve)


def by_quaternions(t: Array, R: Array) -> Smooth:
    """Return SciPy's smoothing spline of quaternions with continuous signs, normalised."""
    q = rb.quaternion.continuous_quaternions(rb.quaternion_from_matrix(R))
    splines = [make_smoothing_spline(t, column) for column in q.T]

    def curve(t: Array, order: int = 0) -> Array:
        q, rate = (np.stack([s(t, k) for s in splines], axis=-1) for k in (0, 1))
        size = np.linalg.norm(q, axis=-1, keepdims=True)
        if order == 0:
            return rb.matrix_from_quaternion(q / size)
        inverse = rb.quaternion.quaternion_conjugate(q / size)
        return 2 * rb.quaternion.quaternion_multiply(inverse, rate / size)[..., 1:]

    return _with_differences(curve)


def moving_average(t: Array, R: Array, window: int) -> Smooth:
    """Return SciPy's spline through averages of quaternions; windows are shorter at the ends."""
    q = rb.quaternion.continuous_quaternions(rb.quaternion_from_matrix(R))
    i = np.arange(len(t))
    reach = np.minimum(np.minimum(i, i[::-1]), window // 2)
    sums = np.concatenate([np.zeros((1, 4)), np.cumsum(q, axis=0)])
    mean = rb.quaternion.project_quaternion(sums[i + reach + 1] - sums[i - reach])
    return interpolated(t, rb.matrix_from_quaternion(mean))


def savitzky_golay(t: Array, R: Array, window: int) -> Smooth:
    """Return rotation vectors with the values and the slopes of a Savitzky–Golay filter."""
    base, x = _vectors(R)
    values, slopes = (savgol_filter(x, window, 3, k, t[1] - t[0], axis=0) for k in (0, 1))
    return _of_vectors(base, CubicHermiteSpline(t, values, slopes))


def _vectors(R: Array) -> tuple[Array, Array]:
    """Return the mean, and rotation vectors about it that jump by less than π."""
    base = rb.metrics.mean_rotation(R)
    x = rb.log_so3(base.T @ R)
    for i in range(1, len(x)):
        angle = np.linalg.norm(x[i])
        if angle > 0:
            axis = x[i] / angle
            turns = np.round((x[i - 1] @ axis - angle) / (2 * np.pi))
            x[i] = axis * (angle + 2 * np.pi * turns)
    return base, x


def _with_differences(curve: Smooth) -> Smooth:
    h = 1e-4  # s

    def whole(t: Array, order: int = 0) -> Array:
        if order < 2:
            return curve(t, order)
        return np.asarray((curve(t + h, 1) - curve(t - h, 1)) / (2 * h))

    return whole


def errors(curve: Smooth, motion: Motion) -> Array:
    """Return root mean squares of the errors of the rotation, of w and of w'."""
    apart = rb.angle_between(curve(motion.t, 0), motion.R)[:, None]
    w, a = (curve(motion.t, k) - x for k, x in ((1, motion.w), (2, motion.a)))
    return np.array([np.sqrt(np.mean(np.sum(x**2, axis=1))) for x in (apart, w, a)])


def _best(
    make: Callable[..., Smooth], windows: Iterable[int], motion: Motion, t: Array, R: Array
) -> Smooth:
    """Return the curve for the window with the least error of the rotation."""
    curves = [make(t, R, window) for window in windows]
    return min(curves, key=lambda c: np.sum(rb.angle_between(c(t), motion.R[::FINE]) ** 2))


def methods(motion: Motion, sigma: float) -> dict[str, Callable[[Array, Array], Smooth]]:
    """Return the compared methods; those with * know the motion, and sigma is the noise."""
    return {
        "through the data": interpolated,
        "rotation vectors": by_vectors,
        "quaternions": by_quaternions,
        "moving average*": partial(_best, moving_average, range(3, 26, 2), motion),
        "Savitzky-Golay*": partial(_best, savitzky_golay, range(5, 102, 8), motion),
        "smoothing_spline": rb.smoothing_spline,
        "with the noise": partial(rb.smoothing_spline, noise=sigma),
        "optimum": rb.optimum.minimum_acceleration_smoothing,
    }


def errors_of_all(step: float, noise: float, kind: str, seed: int) -> dict[str, Array]:
    """Return the errors of each method over the noise; step and noise are in degrees."""
    rng = np.random.default_rng([seed, 7])
    motion, rms = MOTIONS[kind](rng, np.radians(step)), np.radians(noise)
    sigma = rms / 3**0.5
    R = motion.R[::FINE] @ rb.exp_so3(rng.normal(scale=sigma, size=(POSES, 3)))
    with warnings.catch_warnings(action="ignore"):
        makers = methods(motion, sigma)
        made: dict[str, Smooth] = {name: make(motion.t[::FINE], R) for name, make in makers.items()}
    return {name: errors(curve, motion) / rms for name, curve in made.items()}


def table(seeds: int) -> dict[str, tuple[Any, ...]]:
    """Return for each step, noise and method the geometric mean of the three medians."""
    from concurrent.futures import ProcessPoolExecutor  # not available in web browsers
    from multiprocessing import get_context

    rows = []
    with ProcessPoolExecutor(mp_context=get_context("spawn")) as pool:
        for step, noise in product(STEPS, NOISES):
            medians = []
            for kind in MOTIONS:
                found = list(pool.map(partial(errors_of_all, step, noise, kind), range(seeds)))
                each = {name: np.array([x[name] for x in found]) for name in found[0]}
                medians.append({name: np.median(x, axis=0) for name, x in each.items()})
            for name in medians[0]:
                mean = np.exp(np.mean([np.log(x[name]) for x in medians], axis=0))
                rows.append([np.radians(step), np.radians(noise), name, *rounded(mean, 6)])
            print(f"{step}° a step, noise {noise}°", flush=True)
    names = "step [rad]", "noise [rad]", "method", *ERRORS
    return dict(zip(names, zip(*rows, strict=True), strict=True))


def stored() -> dict[tuple[float, float], dict[str, Array]]:
    """Return the stored errors of each method, by the step and the noise in degrees."""
    found: dict[tuple[float, float], dict[str, Array]] = {}
    with TABLE.open(encoding="utf-8", newline="") as file:
        for step, noise, method, *numbers in [*csv.reader(file)][1:]:
            pair = tuple(float(f"{np.degrees(float(x)):.6g}") for x in (step, noise))
            found.setdefault((pair[0], pair[1]), {})[method] = np.array(numbers, float)
    return found


def main() -> None:
    """Compute the table and write it; an argument is the number of motions of each kind."""
    columns = table(int(sys.argv[1]) if len(sys.argv) > 1 else 30)
    replace_file(TABLE, csv_text(columns).encode())


if __name__ == "__main__":
    main()
