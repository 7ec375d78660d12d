"""Curves that are a fixed rotation times the rotation of a quaternion Q(t) of any norm."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rbcourse._hermite import hermite
from rbcourse._numerics import Array
from rbcourse._taylor import (
    Jet,
    angular_velocity,
    multiply,
    rotation,
)
from rbcourse.curves import (
    Curve,
)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class QuaternionCurve(Curve):
    """A `Curve` that is a fixed rotation times the rotation of a quaternion Q(t) of any norm.

    Source: BK 1.
    """

    start: Array  # the fixed rotation as a quaternion, shape (..., 4)
    controls: Array  # what Q is made of, shape (..., n, components)

    def quaternion(self, controls: Array, t: Array, order: int) -> Jet:
        """Return the jet of Q at the times t, from controls that broadcast with them."""
        raise NotImplementedError

    def values(self, t: Array, order: int) -> Array:
        """Return the rotation of the start times Q, or a derivative."""
        by_curve = len(t) > self.count  # the longer axis last
        t, axis = (t.T, -1) if by_curve else (t, -2)
        Q = self.quaternion(np.expand_dims(self._first, axis), t, order)
        self._check(Q[0], t, by_curve)
        if order:
            values = np.moveaxis(angular_velocity(Q), 0, -1)
        else:
            values = rotation(multiply(np.expand_dims(self.start.T, axis), Q[0]))
        return values.swapaxes(0, 1) if by_curve else values

    def _check(self, Q: Array, t: Array, by_curve: bool) -> None:
        """Raise a SingularTime where Q has no direction."""

    @cached_property
    def _first(self) -> Array:
        """The controls, components first."""
        return np.ascontiguousarray(np.moveaxis(self.controls, (-2, -1), (0, 1)))


def other_way(turn: Array) -> Array:
    """Return the turns to the same rotations the other way round, by 2π − angle; 0 stays 0."""
    angle = np.linalg.norm(turn, axis=-1, keepdims=True)
    return turn - 2 * np.pi * turn / np.where(angle == 0, 1, angle)


def polynomial_jet(ends: Array, t: Array, order: int) -> Jet:
    return [hermite(ends, t, k) for k in range(order + 1)]
