"""Motions of a rigid body: a rotation, and the path of one point of the body."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import as_array, check_all
from rbcourse._numerics import Array, matvec
from rbcourse._polynomials import hermite, hermite_stack, stack_terms
from rbcourse.body import of_point
from rbcourse.curves.curve import Curve
from rbcourse.curves.ends import Given

Position = Callable[..., ArrayLike]


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class _WithRotation(Curve):
    """A `Curve` on SE(3) that has the margin and the breakpoints of its rotation."""

    rotation: Curve

    size = 4

    @property
    def margin(self) -> Array:
        """The margin of the rotation."""
        return self.rotation.margin

    @property
    def breakpoints(self) -> list[Array]:
        """The `Curve.breakpoints` of the rotation."""
        return self.rotation.breakpoints

    def _lasting(self, duration: Array) -> Self:
        return replace(self, duration=duration, rotation=self.rotation._lasting(duration))


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class RigidMotion(_WithRotation):
    """A `Curve` on SE(3): a rotation R(t), and a polynomial path of the body's centre of mass.

    The `path`, shape (..., n, 3), has the positions of the centre of mass at t = 0 and 1. A cubic
    also has the velocities, and a quintic the accelerations. The vectors are in m, in the fixed
    frame, and time runs from 0 to 1.
    Source: BK 6.3.
    """

    path: Array

    def values(self, t: Array, order: int) -> Array:
        """Return the pose, or (w, Rᵀ d'), or (w', Rᵀ d''), where d is the origin's position."""
        orders = range(1, order + 1) if self.body.centre.any() else [order][:order]
        rates = [self.rotation.values(t, k) for k in orders]
        R = self.rotation.values(t, 0)
        position = np.moveaxis(hermite_stack(self._terms, t, order), 0, -1)
        return _of_rotation_and_path(self.body.centre, R, rates, position, order)

    def _single(self, i: int, t: float, orders: tuple[int, ...]) -> list[Array]:
        R, *rates = self.rotation._single(i, t, tuple(range(max(orders) + 1)))
        path, r = self.flat.path[i], self.body.centre
        return [_of_rotation_and_path(r, R, rates[:k], hermite(path, t, k), k) for k in orders]

    @cached_property
    def _terms(self) -> Array:
        """The terms of the path, shape (n + 1, 3, count)."""
        return stack_terms(self.path)


def _of_rotation_and_path(r: Array, R: Array, rates: list[Array], path: Array, order: int) -> Array:
    """Return the pose, velocity or acceleration of a motion whose point r follows a path.

    `rates` contains w, w' up to the given order (of which only the last is needed if r is 0), and
    `path` the derivative of this order.
    """
    if order == 0:
        pose = np.zeros((*R.shape[:-2], 4, 4))
        pose[..., :3, :3], pose[..., 3, 3] = R, 1
        pose[..., :3, 3] = path - matvec(R, r) if r.any() else path
        return pose
    v = matvec(R.mT, path)
    if r.any():  # the motion of the point relative to the origin
        still = [np.concatenate([rate, np.zeros_like(rate)], axis=-1) for rate in rates]
        v = v - of_point(r, *still)
    return np.concatenate([np.broadcast_to(rates[-1], v.shape), v], axis=-1)


def moving(given: Given, rotation: Curve) -> Curve:
    """Return the motion with this rotation, whose centre of mass follows the given path.

    For boundary conditions of rotations, it is the rotation itself. The path is the line, the cubic
    or the quintic with as many boundary conditions as `given` has.
    """
    if not given.path:
        return rotation
    path = np.stack(given.path, axis=-2)
    return RigidMotion(duration=given.duration, body=given.body, rotation=rotation, path=path)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Joined(_WithRotation):
    """A rotation, and a path of the origin that a function gives.

    The function is called as ``position(first + t * span, order)``, where t is from 0 to 1.
    """

    position: Position
    first: Array
    span: Array

    def values(self, t: Array, order: int) -> Array:
        """Return the pose, or (w, Rᵀ d'), or (w', Rᵀ d'')."""
        rates = [self.rotation.values(t, order)] if order else []
        times = self.first + t * self.span
        name, shape = f"position(t, {order})", (times.size, 3)
        found = as_array(name, self.position(times.ravel(), order))
        if found.shape != shape:
            raise ValueError(f"{name}: shape {shape} is wanted, got {found.shape}")
        check_all(np.isfinite(found), name, found, "a finite number")
        path = found.reshape(*times.shape, 3) * self.span[:, None] ** order
        return _of_rotation_and_path(np.zeros(3), self.rotation.values(t, 0), rates, path, order)
