"""A smooth curve near noisy rotations or poses: smoothing splines in the ambient space, projected.

Vectors Mᵢ are measured at the times tᵢ with weights wᵢ. Among all curves, a C² cubic spline has the
least Σ wᵢ ‖M(tᵢ) − Mᵢ‖² + λ ∫ ‖M'' − F‖² dt, where F is a given function that is linear between the
times. Let h be the steps, Q ᵀM the differences of the slopes ΔM/h, and B the matrix with the rows
(hᵢ, 2 (hᵢ + hᵢ₊₁), hᵢ₊₁)/6. For every C² cubic spline, QᵀM = B M''. With γ = M'' − F, which is 0 at
natural ends, the cost is Σ wᵢ ‖M(tᵢ) − Mᵢ‖² + λ γᵀ B γ, and it is least if

    (B + λ Qᵀ W⁻¹ Q) γ = Qᵀ Mᵢ − B F,    M(tᵢ) = Mᵢ − λ W⁻¹ Q γ.

This matrix has five bands, and is the same for all components. M(tᵢ) is linear in the data: A Mᵢ
plus a constant. The residuals have n − tr A = d log det(B + λ Qᵀ W⁻¹ Q) / d log λ degrees of
freedom for each component. An oscillation with the period P keeps 1/(1 + (P₀/P)⁴) of its amplitude,
where P₀/2π is the fourth root of λ times the mean step, over the mean weight.

For rotations, M'' = R (ŵ' + ŵ²), and for unit quaternions q'' = q (½ w' − ¼ ‖w‖²). Only the terms
with w' should cost something. So F is the other term, with w from a first spline, which is that of
the matrices: projected, it also gives the quaternions their signs.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._checks import as_single, check_all
from rbcourse._numerics import Array, matvec
from rbcourse._quaternions import quaternion_of
from rbcourse._valid import as_rotations_or_poses
from rbcourse.curves._doubts import warn_of_doubts
from rbcourse.curves.chain import Chain
from rbcourse.curves.closed import QuaternionCubic
from rbcourse.curves.rigid import RigidMotion
from rbcourse.curves.velocities import usual_step
from rbcourse.projection import nearest
from rbcourse.quaternion import continuous_quaternions, quaternion_conjugate, quaternion_multiply
from rbcourse.so3 import vee

LEAST, STEP, MOST = -12.0, 1.5, 28.0  # of log λ, if the mean step and the mean weight are 1
TOGETHER = 1e-3  # of the usual step [one pair apart by 2e-5 changed the best period by 8 %]
LEAST_PERIOD = 1e-3  # in mean steps; below, the degrees of freedom and the noise are lost
_RATIO = 1e6  # of weights; with 1e12, a period of 1,000 steps gives a noise that is wrong by 30 %
DOMAIN = 1.0  # rad: the turn in the time period/2π up to which the excess is small [measured: 5 %]


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class SmoothedChain(Chain):
    """A twice differentiable `Chain` near noisy rotations or poses; it has a leg for each step.

    Attributes
    ----------
    period : float or ndarray, shape (2,)
        The period of the smoothing; for poses, the periods for the rotation and for the origin.
    noise : float or ndarray, shape (2,)
        The estimated standard deviation of the noise of a pose of weight 1: about each axis in rad;
        for poses also along each axis in m.
    """

    velocities: Array
    period: Any
    noise: Any

    def _lasting(self, duration: Array) -> Self:
        share = float(duration / self.duration)
        return replace(super()._lasting(duration), period=self.period * share)


def smoothing_spline(
    times: ArrayLike,
    poses: ArrayLike,
    ends: Literal["natural", "rest"] = "natural",
    *,
    noise: ArrayLike | None = None,
    period: ArrayLike | None = None,
    weights: ArrayLike | None = None,
) -> SmoothedChain:
    """Return a smooth curve near noisy rotations or poses: a smoothing spline, projected.

    Source: BK 4, BK 6; beyond BK 17.

    Parameters
    ----------
    times : array_like, shape (N,)
        Times that do not decrease, with three or more different values. Poses at equal times, or
        closer than a thousandth of the usual step, are averaged.
    poses : array_like, shape (N, 3, 3) or (N, 4, 4)
        A rotation matrix or a pose for each of the times.
    ends : {"natural", "rest"}, optional
        Whether the acceleration or the velocity is 0 at both ends.
    noise : float, or array_like, shape (2,), optional
        The standard deviation of the noise: in rad about each axis, and for poses a pair, also in m
        along each axis. The smoothing has the least expected error at the times of the poses.
    period : float, or array_like, shape (2,), optional
        Oscillations with this period keep half of their amplitude, and faster ones less; for poses
        a pair may be given, for the rotation and the origin. Without `noise` and `period`,
        generalised cross validation chooses the period.
    weights : array_like, shape (N,), optional
        Positive weights; the variance of the noise of a pose is noise² divided by its weight. Omit
        a wrong pose; cross validation counts it even if its weight is small.

    Returns
    -------
    SmoothedChain
        A chain of quaternion cubics, with continuous acceleration. It has the attributes ``period``
        and ``noise``, the estimate of the noise. For poses, the origin moves on a smoothing spline.

    Warns
    -----
    RuntimeWarning
        If the body turns by more than 1 rad in the time period/2π; if an interval between two times
        is longer than the period and than five usual steps (the motion in this gap is not known;
        smooth both sides apart, and join them by `chain`); if a period is shorter than a tenth of a
        step; if many poses equal the one before while the body moves; if ends should be at rest,
        and the body moves there; if, without given weights, a pose is five times as far from the
        line through its neighbours as is usual near it; or if, without a given period, nothing is
        smoothed, a pose is ten times as far from the curve as half of the poses are, poses seem to
        be interpolated, errors of neighbours seem to be alike, or cross validation has fewer than
        ten poses.

    Notes
    -----
    The rotations have nearly the least Σ wᵢ ‖R(tᵢ) − Rᵢ‖² + λ ∫ 2 ‖w'‖² dt, where λ is
    (period/2π)⁴ times the mean weight over the mean step; if the body turns by θ in the time
    period/2π, the sum is larger than the least by about 0.05 θ⁴ of it. The errors of different
    poses must be independent; for tracked poses whose errors change slowly, give a period. Natural
    ends have no acceleration. If the body accelerates there, the velocity is wrong near the ends.

    Moved rotations give the moved curve; reversed times reverse it. A pose of another point of the
    body is smoothed differently, since the origin is. Singular set: that of `quaternion_spline`.

    A few wrong poses spoil the curve; `rbcourse.outliers.wrong_poses` finds them.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> t, rng = np.linspace(0, 1, 50), np.random.default_rng(1)
    >>> measured = exp_so3(t[:, None] ** 2 * [0, 0, 2] + rng.normal(scale=0.02, size=(50, 3)))
    >>> c = smoothing_spline(t, measured)
    >>> c(0.5, 1).round(1) + 0.0, round(c.noise, 2)
    (array([0., 0., 2.]), 0.02)
    """
    A, smoother, noises, periods = checked_problem(times, poses, ends, noise, period, weights)
    c = smooth(smoother, A, noises, periods)
    if (turn := turn_in_period(c)) > DOMAIN:
        warnings.warn(
            f"the body turns by {turn:.3g} rad in the time period/2π, and beyond {DOMAIN:g} rad "
            "the closed form is not near the optimum; choose a shorter period, or "
            "rbcourse.optimum.minimum_acceleration_smoothing",
            RuntimeWarning,
            stacklevel=2,
        )
    warn_of_doubts(smoother, c, A, noise, period, weights)
    return c


def smooth(
    smoother: Smoother,
    A: Array,
    noises: Sequence[float | None],
    periods: Sequence[float | None],
) -> SmoothedChain:
    """Return the smooth curve near rotations or poses."""
    c = closed_form(smoother, A[:, :3, :3], noises[0], periods[0])
    if A.shape[-1] == 4:
        c = with_origins(c, RigidMotion, smoother, A[:, :3, 3], noises[1], periods[1])
    return c


def turn_in_period(c: SmoothedChain) -> float:
    """Return the turn of a curve in the time period/2π, in rad."""
    speed = np.sqrt(np.mean(np.sum(c.velocities[:, :3] ** 2, axis=1)))
    return float(np.ravel(c.period)[0] / (2 * np.pi) * speed)


def checked_problem(
    times: ArrayLike,
    poses: ArrayLike,
    ends: str,
    noise: ArrayLike | None,
    period: ArrayLike | None,
    weights: ArrayLike | None,
) -> tuple[Array, Smoother, Sequence[float | None], Sequence[float | None]]:
    """Return poses, their `Smoother`, and a noise and a period for each part, or None."""
    A, size = as_rotations_or_poses("poses", poses)
    times, w = _checked_data(times, A, weights)
    if noise is not None and period is not None:
        raise ValueError("noise, period: one of them is wanted, got both")
    parts = size // 3
    noises = _as_pair("noise", noise, parts, alike=False)
    return A, Smoother(times, w, ends), noises, _as_pair("period", period, parts)


def closed_form(
    smoother: Smoother, R: Array, noise: float | None, period: float | None
) -> SmoothedChain:
    """Return the smooth curve near rotations."""
    found = smoother.best(lambda x: _quaternions(smoother, R, x)[2], noise, period)
    q, rates, _ = _quaternions(smoother, R, found.smoothing)
    inverse = quaternion_conjugate(q) / np.sum(q * q, axis=1, keepdims=True)
    h = np.diff(smoother.knots)[:, None]
    controls = np.stack([q[:-1], q[1:], h * rates[:-1], h * rates[1:]], axis=-2)
    one = np.broadcast_to(np.eye(4)[0], (len(h), 4))
    return SmoothedChain(
        duration=np.array(smoother.knots[-1] - smoother.knots[0]),
        times=smoother.knots,
        legs=QuaternionCubic(duration=h[:, 0], start=one, controls=controls),
        velocities=2 * quaternion_multiply(inverse, rates)[:, 1:],
        period=found.period,
        noise=found.noise,
    )


def with_origins(
    turning: Any,
    legs: type[RigidMotion],
    smoother: Smoother,
    d: Array,
    noise: float | None,
    period: float | None,
) -> Any:
    """Return a smooth curve near poses: rotations, and a smoothing spline near the origins d."""

    def misfit(smoothing: float) -> float:
        return smoother.sum_of(d - smoother.fit(d, smoothing)[0][smoother.which])

    found = smoother.best(misfit, noise, period)
    x, v = smoother.fit(d, found.smoothing)
    h = np.diff(smoother.knots)[:, None]
    path = np.stack([x[:-1], x[1:], h * v[:-1], h * v[1:]], axis=-2)
    R = turning(turning.times)
    return replace(
        turning,
        legs=legs(duration=h[:, 0], body=turning.body, rotation=turning.legs, path=path),
        velocities=np.append(turning.velocities, matvec(R.mT, v), axis=1),
        period=np.array([turning.period, found.period]),
        noise=np.array([turning.noise, found.noise]),
    )


def _quaternions(smoother: Smoother, R: Array, smoothing: float) -> tuple[Array, Array, float]:
    """Return quaternions of any norm and their rates at the knots, and Σ w (3 − tr RᵢᵀR)."""
    M, M_rates = (x.reshape(-1, 3, 3) for x in smoother.fit(R.reshape(-1, 9), smoothing))
    first = nearest(M)[0]
    S, K = first.mT @ M, first.mT @ M_rates
    spin = np.trace(S, axis1=1, axis2=2)[:, None, None] * np.eye(3) - S
    w = np.linalg.solve(spin, vee(K - K.mT)[..., None])[..., 0]
    q, data = continuous_quaternions(quaternion_of(first)), quaternion_of(R)
    data = np.where(np.sum(data * q[smoother.which], axis=1, keepdims=True) < 0, -data, data)
    centripetal = -np.sum(w * w, axis=1, keepdims=True) / 4 * q
    q, rates = smoother.fit(data, smoothing, centripetal)
    unit = q / np.linalg.norm(q, axis=1, keepdims=True)
    off = quaternion_multiply(quaternion_conjugate(unit)[smoother.which], data)
    return q, rates, 4 * smoother.sum_of(off[:, 1:])


def _checked_data(times: ArrayLike, poses: Array, weights: ArrayLike | None) -> tuple[Array, Array]:
    times = as_single("times", times, "N")
    w = np.ones(len(times)) if weights is None else as_single("weights", weights, "N")
    if poses.ndim != 3 or not len(times) == len(poses) == len(w):
        raise ValueError(
            f"times, poses, weights: equal numbers are wanted, got {len(times)}, {poses.shape} "
            f"and {len(w)}"
        )
    late = np.flatnonzero(np.diff(times) < 0)
    if len(late):
        i = late[0]
        raise ValueError(f"times[{i + 1}] is {times[i + 1]}, a time from {times[i]} on is wanted")
    check_all(w > 0, "weights", w, "a number above 0")
    if w.max() > _RATIO * w.min():
        raise ValueError(
            f"weights: a ratio of at most {_RATIO:g} is wanted, got {w.max() / w.min():g}"
        )
    return times, w


def _as_pair(
    name: str, value: ArrayLike | None, parts: int, alike: bool = True
) -> Sequence[float | None]:
    """Return a value for the rotation and, of poses, one for the origin."""
    if value is None:
        return [None] * parts
    values = as_single(name, np.atleast_1d(np.asarray(value)), "k")
    if len(values) != parts and not (alike and len(values) == 1):
        raise ValueError(
            f"{name}: "
            + ("a pair, for the rotation and the origin, is" if parts > 1 else "one is")
            + f" wanted, got {value!r}"
        )
    given = values.reshape(np.shape(value))
    check_all(given > 0, name, given, "a number above 0")
    return [float(x) for x in np.broadcast_to(values, parts)]


class Smoothing(NamedTuple):
    """The smoothing λ in the units of a `Smoother`, its period, and the noise that is left."""

    smoothing: float
    period: float
    noise: float


class Smoother:
    """Smoothing splines of vectors that are measured at given times with given weights.

    Vectors at equal times, or closer than `TOGETHER`, are replaced by their weighted mean. For ends
    at rest, a leg of duration 0 and slope 0 is put before the first knot and after the last one.
    The unit of time is the mean step, and the unit of the weights is the mean of their sums at the
    knots.
    """

    def __init__(self, times: Array, weights: Array, ends: str) -> None:
        if ends not in ("natural", "rest"):
            raise ValueError(f"ends: 'natural' or 'rest' is wanted, got {ends!r}")
        steps = np.diff(times)
        is_knot = np.append(True, steps > TOGETHER * usual_step(steps))
        self.first, self.which = np.flatnonzero(is_knot), np.cumsum(is_knot) - 1
        last = np.append(self.first[1:], len(times)) - 1
        self.knots = (times[self.first] + times[last]) / 2
        self.knots[[0, -1]] = times[[0, -1]]
        if len(self.knots) < 3:
            raise ValueError("times: three or more different ones are wanted")
        self.weights, self.pad = weights, int(ends == "rest")
        self.total = np.add.reduceat(weights, self.first)
        self.unit = float(np.diff(self.knots).mean())
        self.u = u = self._padded(self.total.mean() / self.total)
        self.h = h = np.diff(self._padded(self.knots)) / self.unit
        k = np.divide(1, h, out=np.zeros_like(h), where=h > 0)
        self.Q = a, b, c = k[:-1], -k[:-1] - k[1:], k[1:]
        self.B, self.K = np.zeros((2, 3, len(a)))  # lower bands
        self.B[0], self.B[1, :-1] = (h[:-1] + h[1:]) / 3, h[1:-1] / 6
        self.K[0] = a**2 * u[:-2] + b**2 * u[1:-1] + c**2 * u[2:]
        self.K[1, :-1] = b[:-1] * a[1:] * u[1:-2] + c[:-1] * b[1:] * u[2:-1]
        self.K[2, :-2] = c[:-2] * a[2:] * u[2:-2]

    def _padded(self, values: Array) -> Array:
        return np.pad(values, [(self.pad, self.pad), *[(0, 0)] * (values.ndim - 1)], mode="edge")

    def sum_of(self, residuals: Array) -> float:
        """Return Σ wᵢ ‖rᵢ‖²."""
        return float(self.weights @ np.sum(residuals**2, axis=1))

    def fit(self, data: Array, smoothing: float, F: Array | None = None) -> tuple[Array, Array]:
        """Return the values and the rates at the knots, shape (knots, components)."""
        from scipy.linalg import solveh_banded

        mean = np.add.reduceat(self.weights[:, None] * data, self.first) / self.total[:, None]
        y, h, (a, b, c) = self._padded(mean), self.h[:, None], (x[:, None] for x in self.Q)
        second = self._padded(np.zeros_like(mean) if F is None else self.unit**2 * F)
        load = a * y[:-2] + b * y[1:-1] + c * y[2:]
        load -= (h[:-1] * (second[:-2] + 2 * second[1:-1])) / 6
        load -= (h[1:] * (2 * second[1:-1] + second[2:])) / 6
        gamma = solveh_banded(self.B + smoothing * self.K, load, lower=True)
        second[1:-1] += gamma
        for part, share in ((slice(-2), a), (slice(1, -1), b), (slice(2, None), c)):
            y[part] -= smoothing * self.u[part, None] * share * gamma
        kept = slice(self.pad, len(y) - self.pad)
        y, second, h = y[kept], second[kept], np.diff(self.knots)[:, None] / self.unit
        slopes = np.diff(y, axis=0) / h
        rates = np.append(slopes - h * (2 * second[:-1] + second[1:]) / 6, slopes[-1:], axis=0)
        rates[-1] += h[-1] * (second[-2] + 2 * second[-1]) / 6
        return y, rates / self.unit

    def freedom(self, smoothing: float) -> float:
        """Return n − tr A, by a difference of fourth order of log det."""
        from scipy.linalg import cholesky_banded

        scales = smoothing * np.exp([-0.02, -0.01, 0.01, 0.02])
        logs = [np.log(cholesky_banded(self.B + x * self.K, lower=True)[0]).sum() for x in scales]
        # half of log det is the sum of the logarithms of the diagonal
        slope = np.dot([1, -8, 8, -1], logs) / (12 * 0.01)
        return len(self.weights) - len(self.knots) + 2 * float(slope)

    def score(self, misfit: float, smoothing: float, noise: float | None) -> float:
        """Return the expected error up to a constant or, without a noise, the cross validation.

        The misfit is Σ wᵢ ‖rᵢ‖², where rᵢ has three components.
        """
        free = self.freedom(smoothing)
        if noise is not None:
            return misfit - 6 * noise**2 * free
        return float(np.log(max(misfit, 1e-300)) - 2 * np.log(free))

    def best(
        self, misfit: Callable[[float], float], noise: float | None, period: float | None
    ) -> Smoothing:
        """Return the smoothing for a noise or a period or, without them, by cross validation."""
        from scipy.optimize import minimize_scalar

        def score(log: float) -> float:
            smoothing = float(np.exp(log))
            with suppress(np.linalg.LinAlgError):
                return self.score(misfit(smoothing), smoothing, noise)
            return np.inf

        if period is not None:
            if period < LEAST_PERIOD * self.unit:
                raise ValueError(
                    f"period: a thousandth of the mean step {self.unit:.4g} or more is wanted, got "
                    f"{period:.4g}; times and period have the same unit"
                )
            smoothing = self.smoothing(period)
        else:
            logs = np.arange(LEAST, min(4 * np.log(len(self.knots)), MOST), STEP)
            best = logs[np.argmin([score(x) for x in logs])]
            bounds, options = (best - STEP, best + STEP), {"xatol": 0.05}
            found = minimize_scalar(score, bounds=bounds, method="bounded", options=options)
            smoothing = float(np.exp(found.x))
        try:
            return self.found(misfit(smoothing), smoothing)
        except np.linalg.LinAlgError as error:
            some = f"times from {self.knots[0]:g} to {self.knots[-1]:g}, weights from "
            some += f"{self.total.min():g} to {self.total.max():g}"
            raise ValueError(f"period: a shorter one is wanted for {some}") from error

    def found(self, misfit: float, smoothing: float) -> Smoothing:
        """Return a smoothing with its period, and with the noise that its misfit shows."""
        noise = np.sqrt(misfit / (3 * self.freedom(smoothing)))
        return Smoothing(smoothing, self.period(smoothing), float(noise))

    def smoothing(self, period: float) -> float:
        """Return the smoothing with a period."""
        return float((period / (2 * np.pi * self.unit)) ** 4)

    def period(self, smoothing: float) -> float:
        """Return the period of which an oscillation keeps half of its amplitude."""
        return float(2 * np.pi * self.unit * smoothing**0.25)

    def is_least(self, periods: Any) -> NDArray[np.bool_]:
        """Tell which of the periods are the least one that is tried."""
        return np.atleast_1d(periods) < self.period(np.exp(LEAST + STEP))
