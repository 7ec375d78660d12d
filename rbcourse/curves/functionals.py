"""The functionals that optima on SO(3) minimise, and the costate p, for which R p is constant.

Each functional is a number times ∫ ‖u‖² dt, where u is a function of w, w' and, for the jerk, w''.
Vary a curve R(t) to R exp(η̂), where η is a small function of time. Then w changes by
δw = η' + w × η, and with L = ‖u‖²

    ½ δ ∫ L dt = ± ∫ p · δw dt,    p = ±½ (∂L/∂w − d/dt ∂L/∂w' + d²/dt² ∂L/∂w''),

where η = η' = 0 at both ends, and for the jerk also η'' = 0. The integral is
±∫ (−p' − w × p) · η dt. It is 0 for every η if p' + w × p = 0. Since (R p)' = R (p' + w × p), a
curve is stationary if and only if R p = c is constant. This is Noether's theorem: rotations of the
fixed frame do not change the cost.
"""

from __future__ import annotations

from typing import Any, Self, TypeAlias

import numpy as np

from rbcourse._numerics import Array, cross
from rbcourse.so3 import hat

Functional: TypeAlias = "BallAcceleration | Effort | Jerk"
"""A number times ∫ ‖u‖² dt for a stack of problems.

The rates w, w', … have the shape (N, n, 3), for N problems and n times. `deviation` returns u, and
`p` returns p. `deviation_by` and `p_by` return their derivatives with respect to w, w', …, as lists
of matrices, shape (N, n, 3, 3). `momenta` returns the momenta, shape (N, n, 3) or, for the jerk,
(N, n, 6), and their derivatives. If the end values of an optimum change by δ, ∫ ‖u‖² dt changes by
momenta · δ at t = 1, minus momenta · δ at t = 0. `take` selects some of the problems.

Attributes
----------
name : str
    The name of the deviation u.
ends : int
    The number of end values of an optimum: 2 (w at 0 and 1) or 4 (also w'). It is also the order of
    the highest derivative of w in p.
needs : tuple of int
    The orders of the derivatives ``c(t, order)`` on which the deviation u depends.
scale, unit : float or ndarray, shape (N,)
    The cost is `scale` times ∫ ‖u‖² dt, and the costate is `unit` times `p`.
"""


class BallAcceleration:
    """The functional 2 ∫ ‖w'‖² dt: the squared covariant acceleration of a ball (G = 2 I).

    Here u = w' and p = w''. The optimum has R w'' = c, a constant vector in the fixed frame. By
    (19), the components w'' + w × w' = b are constant, too (20), so that c = R (b − w × w').
    Source: BK (18), BK (19), BK (20).
    """

    name, ends, scale, unit = "acceleration", 2, 2.0, 1.0
    needs: tuple[int, ...] = (2,)

    def take(self, index: Any) -> Self:
        """Return the functional itself, which is the same for all problems."""
        return self

    def deviation(self, *rates: Array) -> Array:
        """Return w'."""
        return rates[-1]

    def deviation_by(self, w: Array, a: Array) -> list[Array]:
        """Return the derivatives of w' with respect to w and w'."""
        zero = np.zeros((*w.shape, 3))
        return [zero, zero + np.eye(3)]

    def momenta(self, w: Array, a: Array) -> tuple[Array, list[Array]]:
        """Return 2 w' and its derivatives."""
        return 2 * a, [2 * x for x in self.deviation_by(w, a)]

    def p(self, w: Array, a: Array, b: Array) -> Array:
        """Return w''."""
        return b

    def p_by(self, w: Array, a: Array, b: Array) -> list[Array]:
        """Return the derivatives of w'' with respect to w, w' and w''."""
        zero, one = self.deviation_by(w, a)
        return [zero, zero, one]


class Effort:
    """The functional ∫ τᵀ M τ dt, where τ = G w' + w × G w is the torque on a body of inertia G.

    If M = G⁻¹, the product M τ = w' + G⁻¹ (w × G w) is the covariant acceleration ∇_V V in the
    metric G of the kinetic energy, and τᵀ M τ is its squared norm. With v = M τ and h = G w,

        p = G (v' + w × v) − h × v.

    Source: beyond BK 1, beyond BK 2; BK 3 leaves these metrics to a later publication. The equation
    for M = G⁻¹ is in Noakes, Heinzinger and Paden 1989 and in Crouch and Silva Leite 1995.

    Parameters
    ----------
    G : ndarray, shape (N, 3, 3)
        The inertia. It is divided by a third of its trace, so that its unit does not matter.
    of_torque : bool
        True if M is I (the squared torque), and False if M is G⁻¹.
    """

    ends = 2
    needs: tuple[int, ...] = (1, 2)

    def __init__(self, G: Array, *, of_torque: bool) -> None:
        size = np.trace(G, axis1=-2, axis2=-1) / 3
        self.G = G / size[:, None, None]
        self.of_torque = of_torque
        self.name = "torque" if of_torque else "acceleration"
        self.M = np.broadcast_to(np.eye(3), G.shape) if of_torque else np.linalg.inv(self.G)
        self.root = np.linalg.cholesky(self.M).mT
        self.scale = self.unit = size**2 if of_torque else size

    def take(self, index: Any) -> Self:
        """Return the functional of some of the problems."""
        chosen = object.__new__(type(self))
        chosen.of_torque, chosen.name = self.of_torque, self.name
        chosen.G, chosen.M, chosen.root = (x[index] for x in (self.G, self.M, self.root))
        chosen.scale = chosen.unit = self.scale[index]
        return chosen

    def torque(self, w: Array, a: Array) -> Array:
        """Return the torque τ = G w' + w × G w of the scaled inertia G."""
        return _times(self.G, a) + cross(w, _times(self.G, w))

    def deviation(self, w: Array, a: Array) -> Array:
        """Return u, a square root of M times the torque."""
        return _times(self.root, self.torque(w, a))

    def deviation_by(self, w: Array, a: Array) -> list[Array]:
        """Return the derivatives of the deviation with respect to w and w'."""
        G, root = self.G[:, None], self.root[:, None]
        T0 = hat(w) @ G - hat(_times(self.G, w))
        return [root @ T0, np.broadcast_to(root @ G, T0.shape)]

    def momenta(self, w: Array, a: Array) -> tuple[Array, list[Array]]:
        """Return 2 G M τ and its derivatives."""
        pull = 2 * (self.root @ self.G).mT
        by = [pull[:, None] @ x for x in self.deviation_by(w, a)]
        return _times(pull, self.deviation(w, a)), by

    def p(self, w: Array, a: Array, b: Array) -> Array:
        """Return G (v' + w × v) − h × v, with v = M τ and h = G w."""
        G, M = self.G, self.M
        h, h_rate = _times(G, w), _times(G, a)
        torque_rate = _times(G, b) + cross(a, h) + cross(w, h_rate)
        v, v_rate = _times(M, h_rate + cross(w, h)), _times(M, torque_rate)
        return _times(G, v_rate + cross(w, v)) - cross(h, v)

    def p_by(self, w: Array, a: Array, b: Array) -> list[Array]:
        """Return the derivatives of p with respect to w, w' and w''."""
        G, M = self.G[:, None], self.M[:, None]
        W, H = hat(w), hat(_times(self.G, w))
        V = hat(_times(self.M, self.torque(w, a)))
        T0 = W @ G - H  # the derivative of τ with respect to w
        T1 = hat(a) @ G - hat(_times(self.G, a))  # and that of τ'
        GM = G @ M
        QM = (G @ W - H) @ M
        by_w = GM @ T1 + QM @ T0 - G @ V + V @ G
        return [by_w, GM @ T0 + QM @ G, np.broadcast_to(GM @ G, W.shape)]


def _times(A: Array, x: Array) -> Array:
    """Return A x at each time, by one product a problem, for A (N, 3, 3) and x (N, n, 3)."""
    return x @ A.mT


class Jerk:
    """The functional 2 ∫ ‖j‖² dt, where j = w'' + ½ w × w' is the covariant jerk of a ball.

    In the metric G = 2 I, p = j'' + ½ w × j' + w' × j. Among all j = w'' + κ w × w', only this one
    assigns the same cost to a motion R(t) and to its inverse Rᵀ(t).
    Source: beyond BK 2, beyond BK 5; Žefran, Kumar and Croke 1998; Camarinha, Silva Leite and
    Crouch 1995.
    """

    name, ends, scale, unit = "jerk", 4, 2.0, 1.0
    needs: tuple[int, ...] = (1, 2, 3)

    def take(self, index: Any) -> Self:
        """Return the functional itself, which is the same for all problems."""
        return self

    def deviation(self, w: Array, a: Array, b: Array) -> Array:
        """Return j."""
        return b + cross(w, a) / 2

    def deviation_by(self, w: Array, a: Array, b: Array) -> list[Array]:
        """Return the derivatives of j with respect to w, w' and w''."""
        W = hat(w)
        return [-hat(a) / 2, W / 2, np.broadcast_to(np.eye(3), W.shape)]

    def momenta(self, w: Array, a: Array, b: Array, d: Array) -> tuple[Array, list[Array]]:
        """Return the momenta −2 j' − w × j (of w) and 2 j (of w'), and their derivatives."""
        j = self.deviation(w, a, b)
        j_rate = d + cross(w, b) / 2
        W = hat(w)
        one = np.broadcast_to(np.eye(3), W.shape)
        by_j = [-hat(a) / 2, W / 2, one, 0 * one]
        by_rate = [-hat(b) / 2, 0 * one, W / 2, one]
        by = [-2 * y - W @ x for x, y in zip(by_j, by_rate, strict=True)]
        by[0] = by[0] + hat(j)
        both = [np.concatenate([y, 2 * x], axis=-2) for x, y in zip(by_j, by, strict=True)]
        of_w = -2 * j_rate - cross(w, j)
        return np.concatenate([of_w, 2 * j], axis=-1), both

    def p(self, w: Array, a: Array, b: Array, d: Array, e: Array) -> Array:
        """Return j'' + ½ w × j' + w' × j; d and e are the third and fourth derivatives of w."""
        j, j_rate = self.deviation(w, a, b), d + cross(w, b) / 2
        j_bend = e + (cross(a, b) + cross(w, d)) / 2
        return j_bend + cross(w, j_rate) / 2 + cross(a, j)

    def p_by(self, w: Array, a: Array, b: Array, d: Array, e: Array) -> list[Array]:
        """Return the derivatives of p with respect to w and its four derivatives."""
        W, A, B, D = hat(w), hat(a), hat(b), hat(d)
        J, J_rate = B + hat(cross(w, a)) / 2, D + hat(cross(w, b)) / 2
        return [
            -(D + J_rate + W @ B / 2 + A @ A) / 2,
            A @ W / 2 - B / 2 - J,
            1.5 * A + W @ W / 4,
            W,
            np.broadcast_to(np.eye(3), W.shape),
        ]
