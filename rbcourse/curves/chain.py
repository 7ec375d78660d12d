"""Curves through many poses, composed of two-point curves.

The velocities of the splines make the accelerations continuous (see `rbcourse.curves.velocities`).
Optimal splines are in `rbcourse.optimum.many_poses`.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from inspect import Parameter, signature
from operator import index
from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbcourse._numerics import BLOCK, EPS, Array, blocks, matvec
from rbcourse._valid import as_poses, as_rotations
from rbcourse.curves.closed import quaternion_cubic_so3
from rbcourse.curves.curve import Curve, SingularTime
from rbcourse.curves.projected_polynomial import projected_cubic_so3, weighted_cubic_so3
from rbcourse.curves.rigid import RigidMotion, projected_cubic_se3, rigid_motion
from rbcourse.curves.velocities import (
    PathEnds,
    as_ends,
    checked_path,
    quaternion_system,
    resting_spline,
    spline_velocities,
)

Leg = Callable[..., Curve]
RestAt = Sequence[int] | NDArray[np.integer] | Literal["repeated"]

_ARRIVED = 1e-6


def chain(
    times: ArrayLike,
    poses: ArrayLike,
    velocities: ArrayLike | None = None,
    *,
    leg: Leg | None = None,
    rest_at: RestAt = (),
) -> Chain:
    """Return a curve through poses at given times, by default at rest at both ends.

    Source: BK 6, BK 6.3.

    Parameters
    ----------
    times, poses
        As for `bessel_velocities`.
    velocities : array_like, shape (N, 6) or (N, 3), optional
        Twists or angular velocities at the poses. The default is the `spline_velocities`, with
        velocity 0 at both ends and at the poses `rest_at`.
    leg : callable, optional
        A function, from this package or your own, that makes the legs. It returns a stack of
        two-point curves, and is called once for all legs. Its arguments are the keyword
        ``duration`` and some of R0, R1, A0, A1, w0, w1, d0_dot, d1_dot, a0, a1 (d0_dot and d1_dot
        in the fixed frame). A function for rotations can also join poses: the origin then moves on
        the polynomial with the same number of boundary conditions. The default is
        `projected_cubic_so3`, or for poses `projected_cubic_se3`.
    rest_at : sequence of int or "repeated", optional
        The indices of inner poses at which the curve rests. "repeated" means all poses that equal
        the previous or the next pose, as during a pause of a recording; the curve then stands still
        between them. Otherwise, a repeated pose is an ordinary pose: the curve leaves it and
        returns.

    Returns
    -------
    Chain
        A `Curve` on [times[0], times[-1]] that passes through its poses up to a few eps. It has the
        attributes ``legs`` and ``velocities`` and the method ``jumps(order)``.

    Raises
    ------
    ValueError
        As for `bessel_velocities`. Also if both `velocities` and `rest_at` are given, if one of
        them is given but `leg` takes no velocities, or if `leg` needs other arguments, raises
        ValueError, or misses the next pose by more than 1e-6. The message names the first such
        place. Warnings and other errors are those of `leg`.

    Notes
    -----
    With `geodesic_so3`, `geodesic_se3`, `screw_se3` and `projected_line_so3`, a chain is C⁰ at the
    joints (the velocity jumps). With the default legs and velocities, it is C², except at inner
    poses where it rests. It is also C² with `projected_quintic_so3`, `exponential_quintic_so3` and
    `minimum_jerk_so3`. All other legs take velocities, and the chain is C¹: the acceleration jumps,
    unless the velocities belong to a spline of these legs (`quaternion_spline_so3`). At the joints
    of projected legs, velocities agree to a few eps of the largest ‖w‖, and accelerations to a few
    eps of ‖w‖² + ‖w'‖.
    The accelerations a0, a1 are 0 at both ends and where the curve rests. At other poses they are
    those of the default chain, even if velocities are given.
    A chain at rest at both ends costs more than one with natural ends (`projected_spline_se3`).
    Compared with `minimum_acceleration_spline_se3` for the same ends, the rotation of a chain costs
    0.3 %, 5 % or 33 % more if each leg turns by 30°, 60° or 90°. For `quaternion_spline_so3`, these
    figures are 0.02 %, 0.4 % and 2 %.
    Singular set: that of the legs. Half-turns between successive poses raise ValueError. For a
    larger turn, insert a pose.

    Examples
    --------
    >>> from rbcourse import pose_from_coordinates
    >>> poses = pose_from_coordinates([[0, 0, 0, 0, 0, 0], [0, 0, 1, 2, 0, 0], [0, 0, 2, 2, 2, 0]])
    >>> c = chain([0, 2, 3], poses)
    >>> c(2)[:3, 3].round(12), c([0, 2, 3], 1)[:, 2].round(3) + 0.0
    (array([2., 0., 0.]), array([0.   , 1.052, 0.   ]))
    """
    times, poses, velocities = checked_path(times, poses, velocities)
    moves = poses.shape[-1] == 4
    if leg is None:
        leg = projected_cubic_se3 if moves else projected_cubic_so3
    wanted = _arguments(leg)
    if velocities is not None and "w0" not in wanted:
        raise ValueError("velocities: the legs take none")
    rests = _rests(rest_at, poses)
    if rests[1:-1].any() and velocities is not None:
        raise ValueError("rest_at: the velocities are given; set them to 0 at rests")
    if rests[1:-1].any() and "w0" not in wanted:
        raise ValueError("rest_at: the legs take no velocities")
    own, bends = resting_spline(times, poses, rests)
    if velocities is None and "w0" in wanted:
        velocities = own
    twists = own if velocities is None else velocities
    d_dot, d_bend = (_rotated(poses, x[:, 3:]) for x in (twists, bends))
    ends = _ends("R{}", poses[:, :3, :3]) | _ends("w{}", twists[:, :3]) | _ends("a{}", bends[:, :3])
    if moves:
        ends |= _ends("A{}", poses) | _ends("d{}_dot", d_dot)
    unknown = [name for name in wanted if name not in ends]
    if unknown:
        bound = f"functools.partial(leg, {unknown[0]}=...)"
        raise ValueError(
            f"leg: it needs {unknown[0]}, which is not among {', '.join(ends)}; use {bound}"
        )
    legs = _made(leg, {name: ends[name] for name in wanted}, np.diff(times))
    if moves and "A0" not in wanted:
        order = max(("Rwa".index(name[0]) for name in wanted), default=0)  # highest given order
        path = [poses[:, :3, 3], d_dot, d_bend][: 1 + order]
        legs = rigid_motion(RigidMotion, legs, *(x for pair in path for x in (pair[:-1], pair[1:])))
    _check_arrival(legs, poses)
    return Chain(
        duration=np.array(times[-1] - times[0]), times=times, legs=legs, velocities=velocities
    )


def projected_spline_so3(
    times: ArrayLike,
    rotations: ArrayLike,
    ends: PathEnds = "natural",
    inertia: ArrayLike | None = None,
) -> Chain:
    """Return a twice differentiable chain of BK's projected cubics through many rotations.

    Source: BK Prop. 3; beyond BK 13, beyond BK 14.

    Parameters
    ----------
    times, ends, inertia
        As for `spline_velocities`.
    rotations : array_like, shape (N, 3, 3)
        Two or more rotations.

    Returns
    -------
    Chain
        A chain of `projected_cubic_so3` (`weighted_cubic_so3` if an inertia is given) with the
        `spline_velocities`.

    Notes
    -----
    For two rotations and given velocities, the result is the projected cubic. If the rotations are
    moved, the spline moves with them; if the times are reversed, the spline is reversed. Its
    relative excess over the optimum (`minimum_acceleration_spline_so3`) is about 0.05 θ⁴, where θ
    is the angle of a leg in rad: 0.3 % at 30°, 5 % at 60°, 30 % at 90°. The excess of
    `quaternion_spline_so3` is 16 times smaller. For three rotations by 0, θ, 0 about one axis, at
    equally spaced times and with natural ends, the excess is 20711/180180 θ⁴.
    Singular set: that of the legs.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> c = projected_spline_so3([0, 1, 3], exp_so3([[0, 0, 0], [0, 0, 1], [0, 1, 0]]))
    >>> c.jumps(2).round(12) + 0.0, c([0, 3], 2).round(12) + 0.0
    (array([[0., 0., 0.]]), array([[0., 0., 0.],
           [0., 0., 0.]]))
    """
    rotations = as_rotations("rotations", rotations)
    w = spline_velocities(times, rotations, ends, inertia)
    leg = projected_cubic_so3 if inertia is None else partial(weighted_cubic_so3, inertia=inertia)
    return chain(times, rotations, w, leg=leg)


def projected_spline_se3(times: ArrayLike, poses: ArrayLike, ends: PathEnds = "natural") -> Chain:
    """Return a twice differentiable chain of BK's projected motions through many poses.

    Source: BK 6.3; beyond BK 13.

    Parameters
    ----------
    times, poses, ends
        As for `spline_velocities`.

    Returns
    -------
    Chain
        A chain of `projected_cubic_se3` with the `spline_velocities`. The rotation is
        `projected_spline_so3`, and the origin moves on a cubic spline.

    Examples
    --------
    >>> from rbcourse import pose_from_coordinates
    >>> poses = pose_from_coordinates([[0, 0, 0, 0, 0, 0], [0, 0, 1, 2, 0, 0], [0, 0, 2, 2, 2, 0]])
    >>> c = projected_spline_se3([0, 2, 3], poses)
    >>> c(2)[:3, 3].round(12), c.jumps(2).round(12) + 0.0
    (array([2., 0., 0.]), array([[0., 0., 0., 0., 0., 0.]]))
    """
    poses = as_poses("poses", poses)
    return chain(times, poses, spline_velocities(times, poses, ends))


def quaternion_spline_so3(
    times: ArrayLike, rotations: ArrayLike, ends: PathEnds = "natural"
) -> Chain:
    """Return a twice differentiable chain of normalised quaternion cubics through many rotations.

    Among the closed forms of this package, this spline is the nearest to the optimum
    (`minimum_acceleration_spline_so3`). Its relative excess is about 0.003 θ⁴, where θ is the angle
    of a leg in rad. A leg of duration h turns the short way if h ‖ω‖ is below 8 at both ends. If
    the rotations are moved, the spline moves with them; if the times are reversed, the spline is
    reversed. Singular set: that of the legs.
    Source: beyond BK 13, beyond BK 14.

    Parameters
    ----------
    times, rotations, ends
        As for `projected_spline_so3`.

    Returns
    -------
    Chain
        A chain of `quaternion_cubic_so3`. Its velocities, which make the acceleration continuous,
        solve a linear system that is positive definite for all rotations.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> c = quaternion_spline_so3([0, 1, 3], exp_so3([[0, 0, 0], [0, 0, 1], [0, 1, 0]]))
    >>> c.jumps(2).round(12) + 0.0
    array([[0., 0., 0.]])
    """
    times, rotations, _ = checked_path(times, as_rotations("rotations", rotations))
    w = quaternion_system(np.diff(times), rotations).solve(as_ends(ends, len(rotations), 3))
    return chain(times, rotations, w, leg=quaternion_cubic_so3)


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

    @property
    def domain(self) -> tuple[float, float]:
        """The first and the last time."""
        return float(self.times[0]), float(self.times[-1])

    @property
    def breakpoints(self) -> Array:
        """The ends of panels for a quadrature, and the joints, as fractions of the duration."""
        T = self.legs.duration
        inside = self.legs.breakpoints * T[:, None]
        return np.unique((np.append(0.0, np.cumsum(T[:-1]))[:, None] + inside) / np.sum(T))

    def _what(self) -> str:
        return f"Chain of {self.legs.count} legs, {self.legs._what()},"

    def lasting(self, duration: Array) -> Self:
        """Return the chain with another duration; the first time is kept."""
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
            legs=self.legs.lasting(share * self.legs.duration),
            velocities=None if self.velocities is None else self.velocities / share,
        )

    def jumps(self, order: int) -> Array:
        """Return the jumps of the curve, or of a derivative, at the N − 2 inner poses.

        A jump is the value after a pose minus the value before it; `order` is from 0 to 3, or from
        0 to 2 on SE(3).
        """
        starts, ends = _at_ends(self.legs, self.legs._check_order(order))
        return starts[1:] - ends[:-1]

    def evaluate(self, t: Array, order: int) -> Array:
        """Return the values at the times t, shape (T, 1), each from the leg at that time."""
        times = t[:, 0]
        if np.any(times[1:] < times[:-1]):
            values = np.empty((len(t), 1, *self._core(order)))
            in_order = np.argsort(times)
            values[in_order] = self.evaluate(t[in_order], order)
            return values
        own = np.searchsorted(self.times[1:-1], times, side="right")
        shares = np.minimum((times - self.times[own]) / np.diff(self.times)[own], 1)
        try:
            return evaluate_legs(self.legs, own, shares, order)[:, None]
        except SingularTime as error:
            i = error.curve
            after = error.time * self.legs.duration[i]
            raise ValueError(
                f"leg {i}, from {self.times[i]} to {self.times[i + 1]}, {after} after its "
                f"start: {error.reason}"
            ) from error

    def check_smooth(self, name: str, order: int) -> None:
        """Raise a RuntimeError that begins with `name` if a derivative up to `order` jumps."""
        moments = np.append(self.times, self.times[:-1] + self.legs.duration / 2)
        for k, what in ((1, "a velocity"), (2, "an acceleration"))[:order]:
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
            some = legs.take(first + leg[part]).values(shares[rows].T, order)
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

    Return the group of each part, shape (parts,), and the rows, shape (parts, length). Shorter
    parts are filled up by repeating their last row.
    """
    mean = math.ceil(counts.sum() / max(1, np.count_nonzero(counts)))
    length, ends = max(1, min(int(counts.max(initial=0)), 2 * mean)), np.cumsum(counts)
    parts = (counts + length - 1) // length
    run = np.repeat(np.arange(len(counts)), parts)
    number = np.arange(len(run)) - np.repeat(np.cumsum(parts) - parts, parts)
    first = (ends - counts)[run] + number * length
    return run, np.minimum(first[:, None] + np.arange(length), ends[run, None] - 1)


def smooth_parts(curve: Curve, name: str, order: int) -> Curve:
    """Return the curve, or the legs of a chain that passes `Chain.check_smooth`."""
    if isinstance(curve, Chain):
        curve.check_smooth(name, order)
        return curve.legs
    return curve


def _at_ends(legs: Curve, order: int) -> Array:
    return legs.at_own_times(np.stack([0 * legs.duration, legs.duration]), order)


def _ends(name: str, values: Array) -> dict[str, Array]:
    return {name.format(0): values[:-1], name.format(1): values[1:]}


def _arguments(leg: Leg) -> list[str]:
    """Return the names of the required arguments of a leg, except the duration."""
    try:
        parameters = signature(leg).parameters
    except (TypeError, ValueError) as error:
        raise ValueError(f"leg: a function that makes curves is wanted, got {leg!r}") from error
    named = [one for one in parameters.values() if one.kind != Parameter.VAR_KEYWORD]
    if "duration" not in parameters and len(named) == len(parameters):
        raise ValueError(f"leg: it has no parameter duration: {leg!r}")
    needed = [one.name for one in named if one.default is Parameter.empty]
    return [name for name in needed if name != "duration"]


def _made(leg: Leg, ends: dict[str, Array], duration: Array) -> Curve:
    with warnings.catch_warnings(record=True, action="always") as warned:
        try:
            legs = leg(**ends, duration=duration)
        except ValueError as error:
            raise ValueError(f"leg: {error}") from error
    for warning in warned:
        warnings.warn(warning.message, stacklevel=3)
    count, size = len(duration), 4 if "A0" in ends else 3
    if not isinstance(legs, Curve) or not np.array_equal(legs.duration, duration):
        raise ValueError(
            f"leg: a stack of {count} curves of these durations is wanted, got {legs!r}"
        )
    if legs.size != size:
        given = f"({legs.size}, {legs.size})"
        raise ValueError(f"leg: curves of shape ({size}, {size}) are wanted, got {given}")
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


def _rests(rest_at: RestAt, poses: Array) -> NDArray[np.bool_]:
    """Return the poses at which a chain rests, shape (N,): both ends, and those of `rest_at`."""
    rests = np.zeros(len(poses), bool)
    rests[[0, -1]] = True
    if isinstance(rest_at, str):
        if rest_at != "repeated":
            raise ValueError(f"rest_at: indices or 'repeated' is wanted, got {rest_at!r}")
        same = (poses[1:] == poses[:-1]).all(axis=(1, 2))
        return rests | np.append(same, False) | np.append(False, same)
    try:
        rests[[index(i) for i in rest_at]] = True
    except (TypeError, IndexError) as error:
        raise ValueError(
            f"rest_at: indices of the {len(poses)} poses are wanted, got {rest_at!r}"
        ) from error
    return rests


def _rotated(poses: Array, v: Array) -> Array:
    """Return vectors in the fixed frame, from their components in the body frames."""
    return matvec(poses[:, :3, :3], v) if v.size else v
