"""A rigid body: its inertia, its mass and its centre of mass."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import as_finite, as_inertia, as_positive, as_single, check_all, first_index
from rbcourse._numerics import EPS, Array, cross, scaled

__all__ = ["Body"]


class Body:
    """A rigid body, which determines the cost of a motion.

    A body is immutable; its parameters are also its attributes. Curves keep their body as the
    attribute ``body``.
    Source: BK (12), BK (14); for other bodies, beyond BK 1.

    Parameters
    ----------
    inertia : array_like, shape (..., 3, 3)
        G, the inertia about the centre of mass in the axes of the body frame, in kg m², or any
        other symmetric, positive definite matrix that is used as a metric. A stack of matrices
        belongs to a stack of curves.
    mass : float, optional
        The mass in kg, above 0.
    centre : array_like, shape (3,), optional
        The centre of mass in the body frame, in m.

    Examples
    --------
    >>> book = Body.box([0.30, 0.20, 0.03], mass=1.5)
    >>> book
    <Body: inertia diag(0.005113, 0.01136, 0.01625), mass 1.5, centre (0, 0, 0)>
    >>> book.inertia.shape
    (3, 3)
    """

    __slots__ = ("centre", "inertia", "mass")

    inertia: Array
    mass: float
    centre: Array
    _default: ClassVar[Body]

    def __init__(
        self, inertia: ArrayLike, mass: float = 1.0, centre: ArrayLike = (0.0, 0.0, 0.0)
    ) -> None:
        if np.shape(inertia) == (3,):
            raise ValueError("inertia: a matrix is wanted, such as np.diag(moments), got 3 numbers")
        G, r = as_inertia("inertia", inertia), as_single("centre", centre, 3)
        self._set(G, as_positive("mass", mass), r)

    def _set(self, inertia: Array, mass: float, centre: Array) -> None:
        inertia, centre = inertia.view(), centre.view()
        inertia.flags.writeable = centre.flags.writeable = False
        for name, value in (("inertia", inertia), ("mass", mass), ("centre", centre)):
            object.__setattr__(self, name, value)

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"a Body is immutable: {name} cannot be changed")

    def __reduce__(self) -> tuple[type, tuple[Array, float, Array]]:
        """Return the class and its arguments, for copies and pickles."""
        return type(self), (self.inertia, self.mass, self.centre)

    @classmethod
    def ball(cls) -> Body:
        """Return the body of the paper's metrics (12) and (14): inertia 2 I, mass 1, centre 0."""
        return cls._default

    @classmethod
    def box(cls, sides: ArrayLike, mass: float = 1.0) -> Self:
        """Return a solid box with its centre at the origin: diag(b² + c², c² + a², a² + b²) m/12.

        Parameters
        ----------
        sides : array_like, shape (..., 3)
            The lengths a, b, c along the axes, in m; at most one of them is 0.
        mass : float, optional
            The mass in kg, above 0.

        Examples
        --------
        >>> Body.box([1, 2, 3], 12).inertia
        array([[13.,  0.,  0.],
               [ 0., 10.,  0.],
               [ 0.,  0.,  5.]])
        """
        sides, mass = as_finite("sides", sides, 3), as_positive("mass", mass)
        check_all(sides >= 0, "sides", sides, "a length from 0 up")
        if (rods := np.count_nonzero(sides, axis=-1) < 2).any():
            raise ValueError(f"{first_index('sides', rods)}: at most one length of 0 is wanted")
        squares = sides**2
        moments = squares[..., [1, 2, 0]] + squares[..., [2, 0, 1]]
        return cls(mass / 12 * moments[..., None] * np.eye(3), mass)

    @property
    def is_ball(self) -> bool:
        """Whether the inertia is 2 I, as in metric (12)."""
        return bool((self.inertia == 2 * np.eye(3)).all())

    @property
    def batch_shape(self) -> tuple[int, ...]:
        """The shape of a stack of bodies; ``()`` for one body."""
        return self.inertia.shape[:-2]

    def _take(self, index: Any, batch: tuple[int, ...]) -> Body:
        """Return the bodies of some curves of a stack, whose shape is `batch`."""
        if not self.batch_shape:
            return self
        flat = np.broadcast_to(self.inertia, (*batch, 3, 3)).reshape(-1, 3, 3)
        return self._with(flat[index], self.centre)

    def moved(self, R: Array, d: Array) -> Body:
        """Return the same body in another body frame.

        Parameters
        ----------
        R : ndarray, shape (3, 3)
            The orientation of the new frame in the old one.
        d : ndarray, shape (3,)
            The origin of the new frame in the old one, in m.
        """
        G = self.inertia if self.is_ball else R.T @ self.inertia @ R
        return self._with((G + G.mT) / 2, R.T @ (self.centre - d))

    def _with(self, inertia: Array, centre: Array) -> Body:
        body = object.__new__(Body)
        body._set(inertia, self.mass, centre)
        return body

    def __repr__(self) -> str:
        if self.batch_shape:
            inertia = f"stack of shape {self.batch_shape}"
        elif np.array_equal(self.inertia, np.diag(np.diag(self.inertia))):
            inertia = f"diag({_listed(np.diag(self.inertia))})"
        else:
            inertia = "; ".join(_listed(row) for row in self.inertia).join("[]")
        mass, centre = f"mass {self.mass:.4g}", f"centre ({_listed(self.centre)})"
        return f"<Body: inertia {inertia}, {mass}, {centre}>"


def _listed(numbers: Iterable[float]) -> str:
    return ", ".join(f"{x:.4g}" for x in numbers)


Body._default = Body(2 * np.eye(3))


def of_point(r: Array, V: Array, A: Array | None = None) -> Array:
    """Return the velocity v + w × r of a body's point r or, given A, its acceleration.

    V = (w, v) is the twist of the body, and A = (w', a) its acceleration. The acceleration of the
    point is a + w' × r + w × (w × r). All vectors are in the body frame.
    """
    moving = V if A is None else A
    if not r.any():
        return moving[..., 3:]
    point = moving[..., 3:] + cross(moving[..., :3], r)
    if A is None:
        return point
    w = V[..., :3]
    return point + cross(w, cross(w, r))


def weight_of(name: str, G: Array) -> Array:
    """Compute `metrics.weight_from_inertia`, tr(G)/2 I − G, for symmetric matrices.

    A ValueError begins with `name`.
    """
    moments = np.linalg.eigvalsh(scaled(G))
    slack = moments[..., 0] + moments[..., 1] - moments[..., 2]
    refused = slack < -16 * EPS * np.abs(moments).max(axis=-1)
    if refused.any():
        least, middle, largest = np.linalg.eigvalsh(G[refused][0])
        raise ValueError(
            f"{first_index(name, refused)} has the principal moments {least:.6g}, {middle:.6g}, "
            f"{largest:.6g}; each must be at most the sum of the other two"
        )
    return np.trace(G / 2, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) - G
