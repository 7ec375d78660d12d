"""Curves of any duration, and curves through many poses."""

import warnings
from collections.abc import Callable
from inspect import Parameter, signature
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._numerics import EPS, Array, as_single, blocks, check_order
from rbcourse.bessel import SHORTEST, as_path, parabolas_and_rests, rotated, twists
from rbcourse.curves import BLOCK, Chosen, Curve, runs
from rbcourse.motions import RigidMotion, projected_cubic_se3
from rbcourse.polynomials import cubic_coefficients, quintic_coefficients
from rbcourse.projected import projected_cubic_so3

Leg = Callable[..., Curve]

_ARRIVED = 1e-6


class Retimed(Curve):
    """A `Curve` that runs through another one evenly, in another time.

    Attributes
    ----------
    curve : Curve
        The other one.
    rate : float
        How much of its time passes in a unit of time.
    """

    def __init__(self, curve: Curve, rate: float, domain: tuple[float, float]) -> None:
        self.curve, self.rate, self.domain = curve, rate, domain
        self.batch_shape = curve.batch_shape

    def _pick(self, chosen: Chosen) -> Self:
        return type(self)(self.curve._pick(chosen), self.rate, self.domain)

    def _evaluate(self, t: Array, order: int) -> Array:
        (start, end), (first, last) = self.domain, self.curve.domain
        inner = np.minimum(first + (t - start) * self.rate, last)
        values = self.curve._evaluate(np.where(t == end, last, inner), order)
        return values * self.rate**order if order else values


def retime(curve: Curve, duration: float) -> Retimed:
    """Return the same curve run through evenly in another time, from the same start on.

    Parameters
    ----------
    curve : Curve
        Or a stack of them.
    duration : float
        How long it is to take, in s or what else you measure time in; more than 0.

    Returns
    -------
    Retimed
        A `Curve` on [a, a + duration], a the first time of `curve`, which is 0 but for a `chain`.
        Velocities and accelerations are per unit of the new time: over k and k² for k times the
        duration. `acceleration_cost` falls by k³.

    Raises
    ------
    ValueError
        If `curve` is no `Curve`, `duration` no number above 0, or so short that accelerations
        overflow or that it vanishes beside the first time.

    See Also
    --------
    chain : Through many poses, at times of your own.

    Notes
    -----
    To arrive with the angular velocity w after T seconds, make a curve with the end velocity T w,
    and then let it take T. A chain that takes k times as long is at its poses at a + k (t − a).

    Examples
    --------
    >>> from rbcourse import exp_so3, geodesic_so3
    >>> c = retime(geodesic_so3(np.eye(3), exp_so3([0, 0, 1.5])), 3)
    >>> c.domain, c(3, 1).round(12)
    ((0.0, 3.0), array([0. , 0. , 0.5]))
    """
    if not isinstance(curve, Curve):
        raise ValueError(f"curve: a Curve wanted, got {curve!r}")
    time, (start, end) = float(as_single("duration", duration)), curve.domain
    if time <= 0:
        raise ValueError(f"duration is {time}, a time above 0 is wanted")
    if start + time == start:
        raise ValueError(f"duration is {time}: that vanishes beside the first time, {start}")
    if time < SHORTEST * (end - start):
        raise ValueError(f"duration is {time}: too short, accelerations would overflow")
    return Retimed(curve, (end - start) / time, (start, start + time))


class Chain(Curve):
    """A `Curve` of legs, each from one pose to the next.

    At an inner time the later leg counts.

    Attributes
    ----------
    times : ndarray, shape (N,)
        When it is at each pose.
    velocities : ndarray, shape (N, 3) or (N, 6), or None
        What it was told to have there, body frame; None where the legs ask for none.
    legs : Curve
        The stack of the N − 1 legs, each on [0, 1].
    durations : ndarray, shape (N − 1,)
        How long each takes.
    """

    batch_shape = ()

    def __init__(self, times: Array, legs: Curve, velocities: Array | None) -> None:
        self.times, self.legs, self.velocities = times, legs, velocities
        self.domain = float(times[0]), float(times[-1])
        self.durations = np.diff(times)
        matrix = legs[0](0.0).shape
        rates = (3,) if matrix == (3, 3) else (6,)
        self._cores = matrix, rates, rates

    def jumps(self, order: int) -> Array:
        """Return what the inner poses change in the curve or a derivative: after, minus before.

        Parameters
        ----------
        order : {0, 1, 2}

        Returns
        -------
        ndarray, shape (N − 2, …)

        Raises
        ------
        ValueError
            If `order` is another.

        Examples
        --------
        >>> from rbcourse import exp_so3, geodesic_so3
        >>> R = exp_so3([[0, 0, 0], [0, 0, 1], [0, 0, 3]])
        >>> chain([0, 1, 2], R, leg=geodesic_so3).jumps(1).round(12)
        array([[0., 0., 1.]])
        """
        starts, ends = self.legs([0.0, 1.0], check_order(order))
        if order:
            starts, ends = (x / self.durations[:, None] ** order for x in (starts, ends))
        return starts[1:] - ends[:-1]

    def _evaluate(self, t: Array, order: int) -> Array:
        times = t.reshape(-1)
        values = np.empty((len(times), *self._cores[order]))
        in_order = None if np.all(times[1:] >= times[:-1]) else np.argsort(times)
        for block in blocks(len(times), BLOCK):
            if in_order is None:
                self._write(times[block], order, values[block])
            else:
                part = in_order[block]
                written = np.empty((len(part), *self._cores[order]))
                self._write(times[part], order, written)
                values[part] = written
        return values.reshape(*t.shape, *self._cores[order])

    def _write(self, times: Array, order: int, out: Array) -> None:
        """Write the values at ascending times."""
        first, last = np.searchsorted(self.times[1:-1], times[[0, -1]], side="right")
        starts = np.searchsorted(times, self.times[first + 1 : last + 1])
        counts = np.diff([0, *starts.tolist(), len(times)])
        which = np.repeat(np.arange(first, last + 1), counts)
        durations = self.durations[which]
        share = (times - self.times[which]) / durations
        try:
            self.legs._write_each(share, which, order, out)
        except ValueError:
            for leg, run in runs(which):
                self._check_leg(leg, share[run], order)
            raise
        if order:
            out /= durations[:, None] ** order

    def _check_leg(self, leg: int, share: Array, order: int) -> None:
        """Raise the ValueError of a leg, with the times between which it is."""
        try:
            self.legs[leg](share, order)
        except ValueError as error:
            during = f"leg {leg}, from {self.times[leg]} to {self.times[leg + 1]}"
            raise ValueError(f"{during}, in its own time from 0 to 1: {error}") from error


def chain(
    times: ArrayLike,
    poses: ArrayLike,
    velocities: ArrayLike | None = None,
    *,
    leg: Leg | None = None,
) -> Chain:
    """Return a curve that is at given poses at given times, joined by two-point curves.

    Parameters
    ----------
    times : array_like, shape (N,)
        Increasing; two or more.
    poses : array_like, shape (N, 4, 4) or (N, 3, 3)
        Poses, or rotation matrices, to 1e-9, one for each time.
    velocities : array_like, shape (N, 6) or (N, 3), optional
        Twists (ω, v), or angular velocities ω, body frame, per unit of the times: what the curve
        has at each pose. By default it starts and ends at rest, rests where a pose equals its
        neighbour, to rounding, and has the `bessel_velocities` elsewhere.
    leg : callable, optional
        What joins two poses: a function of this package that makes two-point curves, or one of your
        own that makes a stack of them. It is called by name, with what it asks for of R0, R1, A0,
        A1, w0, w1, d0_dot, d1_dot, a0, a1: all legs at once, in a leg's own time from 0 to 1 (h ω,
        h² ω' for a leg that lasts h); d0_dot and d1_dot in the fixed frame. One for rotations also
        joins poses: the origin then moves on the polynomial with as many ends. By default
        `projected_cubic_so3`, or `projected_cubic_se3`.

    Returns
    -------
    Chain
        A `Curve` on [times[0], times[-1]], with ``legs``, ``velocities`` and ``jumps``.

    Raises
    ------
    ValueError
        If times do not increase; if a matrix is no pose or no rotation; if neighbours are a
        half-turn apart, to 1e-6; if the numbers do not agree; if `velocities` are given to legs
        that ask for none; if `leg` asks for other arguments, refuses these, or does not lead to
        the next pose, to 1e-6. The message names the first place.
    ConvergenceError
        If `leg` does.

    Warns
    -----
    RuntimeWarning
        Where `leg` does.

    See Also
    --------
    bessel_velocities : The velocities that are chosen, those of the ends among them.
    read_path : Times, poses and velocities from a file.

    Notes
    -----
    What the joints have, to a few eps of the scale:

    ==========================================================  ==================================
    `geodesic_so3`, `geodesic_se3`, `screw_se3`,                C⁰: the velocity jumps
    `projected_line_so3`
    all that ask for velocities: projected and other cubics,    C¹: the acceleration jumps
    Bézier's curves, minimum acceleration
    `projected_quintic_so3`                                     C²
    ==========================================================  ==================================

    The accelerations that the quintic asks for are those of the parabolas of `bessel_velocities`,
    also where velocities are given; 0 at both ends and where it rests.

    A million times take about as long as on one leg: up to three times as long with geodesics,
    projected lines and quaternion cubics of rotations alone, which are quick, and up to twice as
    long where the times are in no order.

    Singular set: that of the legs; half-turns between neighbours are refused, as they leave open
    which way to turn. Where a leg is to turn by more than that, put a pose between.

    References
    ----------
    BK 6, BK 6.3.

    Examples
    --------
    >>> from rbcourse import pose_from_coordinates
    >>> poses = pose_from_coordinates([[0, 0, 0, 0, 0, 0], [0, 0, 1, 2, 0, 0], [0, 0, 2, 2, 2, 0]])
    >>> c = chain([0, 2, 3], poses)
    >>> c(2)[:3, 3].round(12), c([0, 2, 3], 1)[:, 2].round(3) + 0.0
    (array([2., 0., 0.]), array([0.   , 0.833, 0.   ]))
    """
    times, poses, velocities = as_path(times, poses, velocities)
    moves = poses.shape[-1] == 4
    if leg is None:
        leg = projected_cubic_se3 if moves else projected_cubic_so3
    wanted = _arguments(leg)
    if velocities is not None and "w0" not in wanted:
        raise ValueError("velocities: the legs ask for none")
    w, d_dot, a, d_bend = parabolas_and_rests(times, poses)
    if velocities is not None:
        w, d_dot = velocities[:, :3], rotated(poses, velocities[:, 3:])
    elif "w0" in wanted:
        velocities = twists(poses, w, d_dot)
    h = np.diff(times)[:, None]
    ends = _ends("R{}", poses[:, :3, :3]) | _ends("w{}", w, h) | _ends("a{}", a, h**2)
    if moves:
        ends |= _ends("A{}", poses) | _ends("d{}_dot", d_dot, h)
    unknown = [name for name in wanted if name not in ends]
    if unknown:
        raise ValueError(f"leg: it asks for {unknown[0]}; there are {', '.join(ends)}")
    legs = _made(leg, {name: ends[name] for name in wanted})
    if moves and "A0" not in wanted:
        path = _ends("d{}", poses[:, :3, 3]) | _ends("v{}", d_dot, h) | _ends("a{}", d_bend, h**2)
        legs = RigidMotion(legs, _coefficients(wanted, *path.values()))
    _check_arrival(legs, poses)
    return Chain(times, legs, velocities)


def _ends(name: str, values: Array, scale: float | Array = 1.0) -> dict[str, Array]:
    """Return, by their names, what legs have at their starts and their ends."""
    return {name.format(0): scale * values[:-1], name.format(1): scale * values[1:]}


def _coefficients(
    wanted: list[str], d0: Array, d1: Array, v0: Array, v1: Array, a0: Array, a1: Array
) -> Array:
    """Return the path of the origin that meets as many ends as the rotation does."""
    if "a0" in wanted:
        return quintic_coefficients(d0, d1, v0, v1, a0, a1)
    if "w0" in wanted:
        return cubic_coefficients(d0, d1, v0, v1)
    return np.stack([d0, d1 - d0])


def _arguments(leg: Leg) -> list[str]:
    """Return the names of the arguments that a leg cannot do without."""
    try:
        parameters = signature(leg).parameters
    except (TypeError, ValueError) as error:
        raise ValueError(f"leg: a function that makes curves wanted, got {leg!r}") from error
    return [name for name, parameter in parameters.items() if parameter.default is Parameter.empty]


def _made(leg: Leg, ends: dict[str, Array]) -> Curve:
    """Return the stack of legs; what it warns of is told where `chain` is called."""
    with warnings.catch_warnings(record=True, action="always") as warned:
        try:
            legs = leg(**ends)
        except ValueError as error:
            raise ValueError(f"leg, in its own time from 0 to 1: {error}") from error
    for warning in warned:
        warnings.warn(warning.message, stacklevel=3)
    count, size = len(next(iter(ends.values()))), 4 if "A0" in ends else 3
    if not isinstance(legs, Curve) or (legs.batch_shape, legs.domain) != ((count,), (0, 1)):
        raise ValueError(f"leg: a stack of {count} curves on [0, 1] wanted, got {legs!r}")
    shape = legs[0](0.0).shape
    if shape != (size, size):
        raise ValueError(f"leg: curves of shape ({size}, {size}) wanted, got {shape}")
    return legs


def _check_arrival(legs: Curve, poses: Array) -> None:
    """Raise a ValueError that names the first leg that is not at the poses of its ends."""
    starts, ends = legs([0.0, 1.0])
    missed = np.abs(np.stack([starts - poses[:-1], ends - poses[1:]]))
    missed[..., :3, 3:] -= 64 * EPS * np.abs(poses[1:, :3, 3:])
    lost = ~(missed <= _ARRIVED).all(axis=(0, 2, 3))
    if lost.any():
        i = np.argmax(lost)
        if np.isnan(missed[:, i]).any():
            raise ValueError(f"leg: it found no curve from poses[{i}] to poses[{i + 1}] (NaN)")
        raise ValueError(f"leg: it does not lead from poses[{i}] to poses[{i + 1}]")
