"""Boundary conditions of curves: rotations or poses, and velocities, at both ends."""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import as_array, as_duration, check_all, check_broadcast
from rbcourse._numerics import Array, matvec
from rbcourse._valid import as_rotations_or_poses
from rbcourse.body import Body, of_point

Rate: TypeAlias = ArrayLike | None
"""A velocity or an acceleration at one end of a curve; None is 0."""


class Ends(NamedTuple):
    """Boundary conditions: rotations and angular velocities at both ends, in a common batch shape.

    `Ends` is a tuple, so that ``make(*ends)`` calls a function ``make`` with these arguments.
    Source: BK 6.2.
    """

    R0: Array
    R1: Array
    w0: Array
    w1: Array

    @property
    def turn(self) -> Array:
        """The rotation R0ᵀ R1 from the start to the end."""
        return np.swapaxes(self.R0, -1, -2) @ self.R1

    def flat(self) -> Ends:
        """Return the ends with a single batch axis."""
        return Ends(*(x.reshape(-1, *x.shape[self.w0.ndim - 1 :]) for x in self))

    def take(self, index: Any) -> Ends:
        """Return the ends that a NumPy index into the batch axes selects."""
        return Ends(*(x[index] for x in self))


class Given(NamedTuple):
    """Checked boundary conditions of a curve between two rotations or poses, for times from 0 to 1.

    For poses, `path` contains the positions of the centre of mass at both ends, its velocities and,
    if accelerations are given, its accelerations, in the fixed frame. For rotations, it is empty.
    All arrays have the batch shape of the durations.
    """

    ends: Ends
    duration: Array
    body: Body
    path: tuple[Array, ...] = ()
    bends: tuple[Array, ...] = ()  # the angular accelerations at both ends, if they are given


def between(
    start: ArrayLike,
    goal: ArrayLike,
    v0: Rate = None,
    v1: Rate = None,
    *accelerations: Rate,
    body: Body | None = None,
    duration: ArrayLike = 1.0,
) -> Given:
    """Check boundary conditions; velocities and accelerations that are None are 0.

    Parameters
    ----------
    start, goal : array_like, shape (..., 3, 3) or (..., 4, 4)
        Rotation matrices, or poses.
    v0, v1 : array_like, shape (..., 3) or (..., 6), optional
        The velocities at both ends in the body frame: angular velocities w for rotations, twists
        (ω, v) for poses. The default is rest. `twist_from_rates` makes twists of ω and ḋ.
    duration : array_like, shape (...), optional
        The duration of the motion; velocities are per unit of this time.
    """
    start, size = as_rotations_or_poses("start", start)
    goal, size_of_goal = as_rotations_or_poses("goal", goal)
    if size != size_of_goal:
        raise ValueError(
            "start, goal: two rotations or two poses are wanted, got shapes "
            f"{start.shape} and {goal.shape}"
        )
    names = "v0", "v1", "a0", "a1"
    given = zip(names, (v0, v1, *accelerations), strict=False)
    rates = {name: _as_rate(name, value, size) for name, value in given}
    body, T = as_body(body, Body.ball()), as_duration("duration", duration)
    batch = check_broadcast(
        start=(start, 2),
        goal=(goal, 2),
        duration=(T, 0),
        body=(body.inertia, 2),
        **{name: (rate, 1) for name, rate in rates.items()},
    )
    T = np.broadcast_to(T, batch)
    R0, R1 = (np.broadcast_to(A[..., :3, :3], (*batch, 3, 3)) for A in (start, goal))
    V0, V1, *bends = (
        np.broadcast_to(T[..., None] ** order * rate, (*batch, size))
        for order, rate in zip((1, 1, 2, 2), rates.values(), strict=False)
    )
    ends = Ends(R0, R1, V0[..., :3], V1[..., :3])
    turning = tuple(A[..., :3] for A in bends)
    if size == 3:
        return Given(ends, T, body, bends=turning)
    r = body.centre
    d0, d1 = (np.broadcast_to(A[..., :3, 3], (*batch, 3)) for A in (start, goal))
    path = [d0 + matvec(R0, r), d1 + matvec(R1, r)]
    path += [matvec(R0, of_point(r, V0)), matvec(R1, of_point(r, V1))]
    if bends:
        A0, A1 = bends
        path += [matvec(R0, of_point(r, V0, A0)), matvec(R1, of_point(r, V1, A1))]
    return Given(ends, T, body, tuple(path), turning)


def on_rotations(given: Given, what: str) -> Given:
    """Return the boundary conditions; refuse poses."""
    if given.path:
        raise ValueError(
            f"start, goal: {what} is defined for rotations, got poses; take their blocks [:3, :3]"
        )
    return given


def as_body(body: Body | None, default: Body | None = None) -> Body:
    """Return the body, or the default in place of None; without a default, None is refused."""
    body = default if body is None else body
    if not isinstance(body, Body):
        raise ValueError(f"body: a Body is wanted, such as Body(inertia), got {body!r}")
    return body


def _as_rate(name: str, value: Rate, size: int) -> Array:
    """Return a velocity or an acceleration, shape (..., size); None means 0."""
    if value is None:
        return np.zeros(size)
    rate = as_array(name, value)
    if rate.shape[-1:] != (size,):
        kind = {3: "rotations", 6: "poses"}[size]
        hint = "; twist_from_rates makes twists" * (size == 6)
        raise ValueError(
            f"{name}: shape (..., {size}) is wanted, since start and goal are {kind}, "
            f"got {rate.shape}{hint}"
        )
    check_all(np.isfinite(rate), name, rate, "a finite number")
    return rate
