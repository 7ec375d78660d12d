"""Curves through many poses, composed of two-point curves. Optimal ones: `rbcourse.optimum`."""

from __future__ import annotations

import math
import warnings
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from inspect import signature
from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._checks import as_single
from rbcourse._docs import described_by
from rbcourse._numerics import BLOCK, EPS, Array, blocks
from rbcourse.body import Body
from rbcourse.curves.closed import quaternion_cubic
from rbcourse.curves.curve import Curve, Order, SingularTime, moved_rates
from rbcourse.curves.projected import projected_cubic, projected_quintic
from rbcourse.curves.rigid import Joined, Position
from rbcourse.curves.velocities import (
    PathEnds,
    as_ends,
    checked_path,
    path_velocities,
    quaternion_system,
    spline_velocities,
)
from rbcourse.so3 import angle_between

Leg = Callable[..., Curve]

_WIDE = 120  # degrees; from rest to rest, a wider leg costs 2.6 times as much as the optimum
_ARRIVED = 1e-6  # a leg may miss its poses by this much, as rotation matrices may miss RᵀR = I
_SMOOTH = 1e-9  # a velocity jumps if it changes at a knot by more than this share of the largest


@described_by(spline_velocities)
def chain(
    times: ArrayLike,
    poses: ArrayLike,
    velocities: ArrayLike | None = None,
    accelerations: ArrayLike | None = None,
    *,
    leg: Leg | None = None,
) -> Chain:
    """Return a curve of legs that join poses with given velocities.

    `projected_spline` and the other splines choose the velocities.
    Source: BK 6, BK 6.3.

    Parameters
    ----------
    velocities : array_like, shape (N, 3) or (N, 6), optional
        Angular velocities or twists (ω, v) at the poses, in the body frame; required without `leg`.
    accelerations : array_like, shape (N, 3) or (N, 6), optional
        Accelerations at the poses as ``c(t, 2)`` returns them.
    leg : callable, optional
        A function that returns a stack of two-point curves, by default `projected_cubic`, or
        `projected_quintic` if accelerations are given. It is called once for all legs, as
        ``leg(start, goal, v0, v1, a0, a1, duration=...)``, without v0 and v1 (and a0 and a1) if no
        `velocities` (`accelerations`) are given. Without velocities, legs of `geodesic` meet at
        corners, and legs of `projected_cubic` rest at all poses.

    Returns
    -------
    Chain
        A `Curve` on [times[0], times[-1]] that passes through its poses up to a few eps. It has the
        attributes ``legs`` and ``velocities`` and the method ``jumps(order)``.

    Raises
    ------
    ValueError
        Also if `leg` does not take these arguments, raises ValueError, or misses the next pose by
        more than 1e-6. The message names the first such place. Warnings and other errors are those
        of `leg`.

    Notes
    -----
    A chain of cubic legs is C¹: the acceleration jumps, unless the velocities belong to a spline of
    these legs. A chain of quintic legs is C². Singular set: that of the legs. Half-turns between
    successive poses raise ValueError. For a larger turn, insert a pose. Legs of `projected_cubic`
    have a high peak of acceleration near a half-turn, without a warning: from rest to rest, one
    costs 14 times as much as the optimum at 150°, and 300 times at 170°.

    Examples
    --------
    >>> from rbcourse import geodesic, pose_from_coordinates
    >>> poses = pose_from_coordinates([[0, 0, 0, 0, 0, 0], [0, 0, 1, 2, 0, 0], [0, 0, 2, 2, 2, 0]])
    >>> c = chain([0, 2, 3], poses, leg=geodesic)
    >>> c(2)[:3, 3].round(12), c.jumps(1)[0, 3:].round(3)  # the velocity jumps
    (array([2., 0., 0.]), array([1.143, 1.922, 0.   ]))
    """
    times, poses, velocities = checked_path(times, poses, velocities)
    if velocities is None and leg is None:
        raise ValueError(
            "velocities: one for each pose is wanted; projected_spline(times, poses) chooses them"
        )
    rates = [] if velocities is None else [velocities]
    if accelerations is not None:
        if velocities is None:
            raise ValueError("accelerations: not without velocities")
        rates.append(as_single("accelerations", accelerations, *velocities.shape))
    ends = [x for values in (poses, *rates) for x in (values[:-1], values[1:])]
    usual: Leg = projected_cubic if accelerations is None else projected_quintic
    legs = _made(leg or usual, ends, np.diff(times))
    _check_arrival(legs, poses)
    return Chain(
        duration=np.array(times[-1] - times[0]),
        body=legs.body,
        times=times,
        legs=legs,
        velocities=velocities,
    )


@described_by(spline_velocities)
def projected_spline(
    times: ArrayLike,
    poses: ArrayLike,
    ends: PathEnds = "natural",
    *,
    rest_at: Sequence[int] | NDArray[np.integer] = (),
    body: Body | None = None,
) -> Chain:
    """Return a twice differentiable chain of BK's projected cubics through rotations or poses.

    Source: BK Prop. 3, BK 6.3; beyond BK 13, beyond BK 14.

    Returns
    -------
    Chain
        A chain of `projected_cubic` with the `spline_velocities`. For poses, the centre of mass
        moves on a cubic spline.

    Notes
    -----
    The acceleration is continuous, except at poses of `rest_at`. If the poses are moved, the spline
    moves with them; if the times are reversed, the spline is reversed. For rotations with natural
    ends, its relative excess over the optimum (`minimum_acceleration_spline`) is about 0.05 θ⁴,
    where θ is the angle of a leg in rad: 0.3 % at 30°, 5 % at 60°, 30 % at 90°. The excess of
    `quaternion_spline` is 16 times smaller; take it if legs turn by more than 90°. Near a half-turn
    the acceleration of a projected cubic has a high peak: from rest to rest, it costs 14 times as
    much as the optimum at 150°, and 300 times at 170°. RuntimeWarning is given if a leg turns by
    more than 120°. Singular set: that of the legs.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> c = projected_spline([0, 1, 3], exp_so3([[0, 0, 0], [0, 0, 1], [0, 1, 0]]))
    >>> c.jumps(2).round(12) + 0.0, c([0, 3], 2).round(12) + 0.0
    (array([[0., 0., 0.]]), array([[0., 0., 0.],
           [0., 0., 0.]]))
    """
    times, poses, _ = checked_path(times, poses)
    R = poses[:, :3, :3]
    angles = np.degrees(angle_between(R[:-1], R[1:]))
    i = np.argmax(angles)
    if angles[i] > _WIDE:
        warnings.warn(
            f"poses[{i}] and poses[{i + 1}]: the body turns by {angles[i]:.0f}°; beyond {_WIDE}° "
            "the acceleration of a projected spline has a high peak: take quaternion_spline, or "
            "put poses between them",
            RuntimeWarning,
            stacklevel=2,
        )
    velocities = spline_velocities(times, poses, ends, rest_at=rest_at, body=body)
    return chain(times, poses, velocities, leg=partial(projected_cubic, body=body))


@described_by(spline_velocities)
def quaternion_spline(times: ArrayLike, poses: ArrayLike, ends: PathEnds = "natural") -> Chain:
    """Return a twice differentiable chain of normalised quaternion cubics.

    Among the closed forms of this package, this spline is the nearest to the optimum
    (`minimum_acceleration_spline`). Its relative excess for rotations is about 0.003 θ⁴, where θ is
    the angle of a leg in rad. A leg of duration h turns the short way if h ‖ω‖ is below 8 at both
    ends. Moved poses, reversed times and singular set: as for `projected_spline`.
    Source: beyond BK 13, beyond BK 14.

    Returns
    -------
    Chain
        A chain of `closed_forms.quaternion_cubic`, whose velocities make the acceleration
        continuous. For poses, the origin moves on a cubic spline.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> c = quaternion_spline([0, 1, 3], exp_so3([[0, 0, 0], [0, 0, 1], [0, 1, 0]]))
    >>> c.jumps(2).round(12) + 0.0
    array([[0., 0., 0.]])
    """
    times, poses, _ = checked_path(times, poses)
    conditions = as_ends(ends, len(poses), 3 * poses.shape[-1] - 6)
    h, turning = np.diff(times), conditions._replace(given=conditions.given[:, :3])
    V = quaternion_system(h, poses[:, :3, :3]).solve(turning)
    if poses.shape[-1] == 4:
        V = np.append(V, path_velocities(h, poses, V, conditions, np.zeros(3)), axis=1)
    return chain(times, poses, V, leg=quaternion_cubic)


def joined(rotation: Curve, position: Position) -> Curve:
    """Return the motion of poses with a given rotation and a given path of the origin.

    Parameters
    ----------
    rotation : Curve
        A single curve on SO(3); a `chain` gives a chain.
    position : callable
        ``position(t, order)`` returns the position of the origin in the fixed frame, in m, or its
        derivative of order 1 or 2, shape (N, 3), at times t, shape (N,), in the domain of
        `rotation`. It must be continuously differentiable; only for SciPy's splines, such as
        ``CubicSpline`` and ``make_interp_spline``, this is checked. Their knots may differ from
        those of the rotation.

    Returns
    -------
    Curve
        A curve on SE(3) with the duration and the body of the rotation.

    Raises
    ------
    ValueError
        Also at a call, if `position` returns another shape or a number that is not finite.

    Examples
    --------
    >>> from scipy.interpolate import CubicSpline
    >>> from rbcourse import exp_so3, geodesic
    >>> turn = geodesic(np.eye(3), exp_so3([0, 0, 1.5]), duration=2)
    >>> c = joined(turn, CubicSpline([0, 0.5, 2], [[0, 0, 0], [1, 0, 0], [1, 1, 0]]))
    >>> c(0.5)[:3, 3].round(12), c(0.5, 1)[:3].round(12)
    (array([1., 0., 0.]), array([0.  , 0.  , 0.75]))
    """
    if not isinstance(rotation, Curve) or rotation.size != 3 or rotation.batch_shape:
        raise ValueError(f"rotation: a single curve on SO(3) is wanted, got {rotation!r}")
    if hasattr(rotation, "progress"):
        raise ValueError(
            "rotation: it is a Timed; join its path and the position, then call fastest"
        )
    _check_position(position, rotation.domain)
    turns = rotation
    first = np.array(rotation.domain[0])
    if isinstance(rotation, Chain):
        turns, first = rotation.legs, rotation.times[:-1]
    T = turns.duration
    legs = Joined(
        duration=T, body=rotation.body, rotation=turns, position=position, first=first, span=T
    )
    if not isinstance(rotation, Chain):
        return legs
    chain = Chain(
        duration=rotation.duration,
        body=rotation.body,
        times=rotation.times,
        legs=legs,
        velocities=None,
    )
    return replace(chain, velocities=chain(chain.times, 1))


def _check_position(position: Position, domain: tuple[float, float]) -> None:
    """Refuse an object without the call position(t, order), and a spline with corners."""
    wanted = "position: a callable position(t, order) is wanted, such as a CubicSpline"
    if not callable(position) or isinstance(position, Curve):
        raise ValueError(f"{wanted}, got {type(position).__name__}")
    try:
        signature(position).bind(np.array(domain), 1)
    except TypeError as error:
        raise ValueError(f"{wanted} ({error})") from error
    except ValueError:  # no signature is known
        pass
    knots = np.unique(getattr(position, "x", getattr(position, "t", domain)))
    start, end = domain
    if knots[0] > start or (knots[-1] < end and not np.isclose(knots[-1], end, rtol=1e-12)):
        raise ValueError(
            f"position: its knots from {knots[0]} to {knots[-1]} do not cover {start} to {end}"
        )
    inner = knots[(knots > start) & (knots < end)]
    earlier = np.nextafter(inner, -np.inf)
    after, before = (np.asarray(position(t, 1)) for t in (inner, earlier))
    between = np.asarray(position((knots[1:] + knots[:-1]) / 2, 1))
    rate = np.maximum(*(np.abs(np.asarray(position(t, 2))) for t in (inner, earlier)))
    # after 1970, neighbouring doubles are 2e-7 s apart
    known = 2 * rate * (inner - earlier)[:, None]
    largest = np.abs(np.concatenate([after, between])).max()
    jumps = np.abs(after - before) > _SMOOTH * largest + known
    if jumps.any():
        where = inner[np.argmax(jumps.any(axis=-1))]
        raise ValueError(f"position: its velocity jumps at t = {where}; a smooth path is wanted")


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Chain(Curve):
    """A `Curve` of legs from pose to pose. At the time of an inner pose, the later leg is used.

    Attributes
    ----------
    times : ndarray, shape (N,)
        The times at which the chain passes through its poses.
    velocities : ndarray, shape (N, 3) or (N, 6), or None
        The velocities at the poses, or None if the legs take no velocities.
    legs : Curve
        The stack of the N − 1 legs.
    """

    times: Array
    legs: Curve
    velocities: Array | None

    @property
    def size(self) -> int:
        """The size of the curve's matrices: 3 on SO(3), 4 on SE(3)."""
        return self.legs.size

    @cached_property
    def domain(self) -> tuple[float, float]:
        """The first and the last time."""
        return float(self.times[0]), float(self.times[-1])

    @property
    def breakpoints(self) -> list[Array]:
        """The ends of panels for a quadrature, and the joints, as fractions of the duration."""
        T = self.legs.duration
        starts = np.append(0.0, np.cumsum(T[:-1]))
        legs = zip(starts, T, self.legs.breakpoints, strict=True)
        return [np.unique(np.concatenate([a + h * inside for a, h, inside in legs]) / np.sum(T))]

    @property
    def margin(self) -> Array:
        """The least margin of the legs."""
        return np.asarray(self.legs.margin.min())

    def _what(self) -> str:
        return f"Chain of {self.legs.count} legs, {self.legs._what()},"

    def _lasting(self, duration: Array) -> Self:
        start, end = self.domain
        share = float(duration) / (end - start)
        if start + float(duration) == start:
            raise ValueError(
                f"duration is {duration}: it vanishes by rounding when added to the time {start}"
            )
        times = start + share * (self.times - start)
        times[-1] = start + duration
        return replace(
            self,
            duration=duration,
            times=times,
            legs=self.legs._lasting(share * self.legs.duration),
            velocities=None if self.velocities is None else self.velocities / share,
        )

    def _moved(self, L: Array, X: Array) -> Chain:
        velocities, legs = self.velocities, self.legs._moved(L, X)
        if velocities is not None:
            [velocities] = moved_rates(X, velocities)
        return replace(self, body=legs.body, legs=legs, velocities=velocities)

    def jumps(self, order: Order) -> Array:
        """Return the jumps of the curve, or of a derivative, at the N − 2 inner poses.

        A jump is the value after a pose minus the value before it; `order` is from 0 to 3, or from
        0 to 2 on SE(3).
        """
        starts, ends = _at_ends(self.legs, order)
        return starts[1:] - ends[:-1]

    def _evaluate(self, t: Array, order: int) -> Array:
        """Return the values at the times t, shape (T, 1), each from the leg at that time."""
        times = t[:, 0]
        if np.any(times[1:] < times[:-1]):
            values = np.empty((len(t), 1, *self._core(order)))
            in_order = np.argsort(times)
            values[in_order] = self._evaluate(t[in_order], order)
            return values
        own = np.searchsorted(self.times[1:-1], times, side="right")
        shares = np.minimum((times - self.times[own]) / np.diff(self.times)[own], 1)
        try:
            return evaluate_legs(self.legs, own, shares, order)[:, None]
        except SingularTime as error:
            raise self._lost(error) from error

    def _once(self, t: float, orders: tuple[int, ...]) -> list[Array]:
        times = self._times
        i = bisect_right(times, t, 1, len(times) - 1) - 1
        h = times[i + 1] - times[i]
        try:
            values = self.legs._single(i, min((t - times[i]) / h, 1.0), orders)
        except SingularTime as error:
            raise self._lost(error) from error
        return [x / h**k if k else x for x, k in zip(values, orders, strict=True)]

    @cached_property
    def _times(self) -> list[float]:
        times: list[float] = self.times.tolist()
        return times

    def _lost(self, error: SingularTime) -> ValueError:
        i = error.curve
        after = error.time * self.legs.duration[i]
        return ValueError(
            f"leg {i}, from {self.times[i]} to {self.times[i + 1]}, {after} after its start: "
            f"{error.reason}"
        )

    def check_smooth(self, name: str, order: Literal[1, 2]) -> None:
        """Raise a RuntimeError that begins with `name` if a derivative up to `order` jumps."""
        moments = np.append(self.times, self.times[:-1] + self.legs.duration / 2)
        checked: tuple[tuple[Literal[1, 2], str], ...] = (1, "a velocity"), (2, "an acceleration")
        for k, what in checked[:order]:
            jumps, sizes = np.abs(self.jumps(k)), np.abs(self(moments, k))
            if k == 2:
                sizes = sizes + np.abs(self(moments, 1)).max(axis=0) / self.legs.duration.min()
            for half in (slice(3), slice(3, None)):
                jump = jumps[:, half].max(initial=0)
                if jump > 1e-9 * sizes[:, half].max(initial=0):
                    raise RuntimeError(f"{name}: {what} jumps at a joint, by {jump:.3g}")


def evaluate_legs(legs: Curve, own: NDArray[np.intp], shares: Array, order: int) -> Array:
    """Return the values of the legs `own`, shape (n,), at fractions of their durations.

    `own` increases. A SingularTime has the number of the leg, and the fraction as its time.
    """
    first = own[0] if len(own) else 0
    leg, index = _even_parts(np.bincount(own - first))
    values = np.empty((len(own), *legs._core(order)))
    for part in blocks(len(leg), max(1, BLOCK // index.shape[1])):
        rows = index[part]
        try:
            some = legs._take(first + leg[part]).values(shares[rows].T, order)
        except SingularTime as error:
            raise SingularTime(
                error.time, int(first + leg[part][error.curve]), error.reason
            ) from error
        values[rows] = some.swapaxes(0, 1)
    if order:
        values /= legs.duration[own].reshape(-1, *(1 for _ in values.shape[1:])) ** order
    return values


def _even_parts(counts: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Divide successive groups of `counts` rows into parts of equal length.

    Return the group of each part, and its rows, shape (parts, length). Shorter parts are filled up
    by repeating their last row.
    """
    mean = math.ceil(counts.sum() / max(1, np.count_nonzero(counts)))
    length, ends = max(1, min(int(counts.max(initial=0)), 2 * mean)), np.cumsum(counts)
    parts = (counts + length - 1) // length
    run = np.repeat(np.arange(len(counts)), parts)
    number = np.arange(len(run)) - np.repeat(np.cumsum(parts) - parts, parts)
    first = (ends - counts)[run] + number * length
    return run, np.minimum(first[:, None] + np.arange(length), ends[run, None] - 1)


def _at_ends(legs: Curve, order: Order) -> Array:
    return legs.at_own_times(np.stack([0 * legs.duration, legs.duration]), order)


def _made(leg: Leg, ends: list[Array], duration: Array) -> Curve:
    try:
        signature(leg).bind(*ends, duration=duration)
    except (TypeError, ValueError) as error:
        names = ", ".join(("start", "goal", "v0", "v1", "a0", "a1")[: len(ends)])
        raise ValueError(
            f"leg: a function that takes {names} and the keyword duration is wanted ({error})"
        ) from error
    with warnings.catch_warnings(record=True, action="always") as warned:
        try:
            legs = leg(*ends, duration=duration)
        except ValueError as error:
            raise ValueError(f"leg: {error}") from error
    for warning in warned:
        warnings.warn(warning.message, stacklevel=3)
    count, size = len(duration), ends[0].shape[-1]
    if not isinstance(legs, Curve) or not np.array_equal(legs.duration, duration):
        raise ValueError(
            f"leg: a stack of {count} curves of these durations is wanted, got {legs!r}"
        )
    if legs.size != size:
        given = f"({legs.size}, {legs.size})"
        raise ValueError(f"leg: curves of shape ({size}, {size}) are wanted, got {given}")
    if legs.body.batch_shape:
        raise ValueError("leg: the same body for all legs is wanted")
    return legs


def _check_arrival(legs: Curve, poses: Array) -> None:
    starts, ends = _at_ends(legs, 0)
    missed = np.abs(np.stack([starts - poses[:-1], ends - poses[1:]]))
    missed[..., :3, 3:] -= 64 * EPS * np.abs(poses[1:, :3, 3:])
    lost = ~(missed <= _ARRIVED).all(axis=(0, 2, 3))
    if lost.any():
        i = np.argmax(lost)
        if np.isnan(missed[:, i]).any():
            raise ValueError(f"leg: it found no curve from poses[{i}] to poses[{i + 1}] (NaN)")
        raise ValueError(f"leg: it does not lead from poses[{i}] to poses[{i + 1}]")
