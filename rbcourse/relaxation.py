"""The optimum by relaxation: Newton's method on the whole curve at once."""

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._numerics import Array, as_single
from rbcourse.motions import RigidMotion, cubic_ends
from rbcourse.optimum import (
    ConvergenceError,
    Ends,
    Guess,
    MinimumAcceleration,
    along,
    first_guess,
    grid,
    hats,
    solve,
    vees,
    velocity,
)
from rbcourse.so3 import exp_so3, hat_so3

STEPS = 60
LONGEST_STEP = 0.5


def minimum_acceleration_so3(
    R0: ArrayLike, R1: ArrayLike, w0: ArrayLike, w1: ArrayLike
) -> MinimumAcceleration:
    """Return the minimum-acceleration curve with these ends, by relaxation.

    Parameters
    ----------
    R0, R1 : array_like, shape (3, 3)
        Rotation matrices at t = 0 and 1; of what is none, the nearest rotation (`project_so`).
    w0, w1 : array_like, shape (3,)
        Angular velocities there, body frame, in rad per unit time.

    Returns
    -------
    MinimumAcceleration
        A `Curve` that meets all four ends and solves w''' + w × w'' = 0. Its ``residual``,
        ``iterations`` and ``nodes`` tell how it was found, and ``c`` is the constant R w''.

    Raises
    ------
    ValueError
        If an argument is not finite or not of that shape.
    ConvergenceError
        If Newton's method does not converge, neither from the projected cubic nor in small steps
        from the geodesic. Rare for ‖w0‖, ‖w1‖ < 9; a tenth of all draws up to 20.

    See Also
    --------
    shoot_minimum_acceleration_so3 : The same by shooting.
    projected_cubic_so3 : Its near-optimal stand-in, in closed form.
    acceleration_cost : What both cost.

    Notes
    -----
    Singular set: none is known in closed form. (19) is necessary, not sufficient, and has several
    solutions: a turn by σ and one by σ ± 2π reach the same rotation. The one that is found from
    the projected cubic is returned; it is stationary, and not proven to be the best.

    End velocities along the geodesic give R0 exp(σ̂ p(t)), with p a cubic and σ a logarithm of
    R0ᵀR1: the shortest, or one that turns the other way round or once more; as a rule because that
    costs less.

    References
    ----------
    BK (19), BK 6.2, BK Prop. 7.

    Examples
    --------
    >>> from rbcourse import exp_so3
    >>> R1 = exp_so3([0, 0, 1.5])
    >>> c = minimum_acceleration_so3(np.eye(3), R1, [0, 0, 0], [0, 1, 0])
    >>> c([0, 1], 1).round(9) + 0.0
    array([[0., 0., 0.],
           [0., 1., 0.]])
    >>> c.residual < 1e-12
    True
    """
    return solve(relax, R0, R1, w0, w1)


def minimum_acceleration_se3(
    A0: ArrayLike,
    A1: ArrayLike,
    w0: ArrayLike,
    w1: ArrayLike,
    d0_dot: ArrayLike,
    d1_dot: ArrayLike,
) -> RigidMotion:
    """Return the minimum-acceleration motion: the optimum on SO(3), and a cubic in R³.

    Parameters
    ----------
    A0, A1 : array_like, shape (4, 4)
        Poses at t = 0 and 1; of what is none, the nearest pose (`project_se`).
    w0, w1 : array_like, shape (3,)
        Angular velocities there, body frame, in rad per unit time.
    d0_dot, d1_dot : array_like, shape (3,)
        Velocities of the origin there, *fixed* frame, in m per unit time.

    Returns
    -------
    RigidMotion
        A `Curve`: its ``rotation`` is `minimum_acceleration_so3`.

    Raises
    ------
    ValueError
        If an argument is not finite or not of that shape.
    ConvergenceError
        As `minimum_acceleration_so3`.

    See Also
    --------
    projected_cubic_se3 : Its near-optimal stand-in, in closed form.

    Notes
    -----
    In metric (14) rotation and translation do not know of each other, so each has its own optimum.

    References
    ----------
    BK 6.3.

    Examples
    --------
    >>> from rbcourse import pose_from_coordinates
    >>> A1, rest = pose_from_coordinates([0, 0, 1, 2, 0, 0]), [0, 0, 0]
    >>> c = minimum_acceleration_se3(np.eye(4), A1, rest, rest, rest, rest)
    >>> c(0.5)[:3, 3].round(9)
    array([1., 0., 0.])
    """
    vectors = {"w0": w0, "w1": w1, "d0_dot": d0_dot, "d1_dot": d1_dot}
    poses = as_single("A0", A0, 4, 4), as_single("A1", A1, 4, 4)
    ends = cubic_ends(*poses, *(as_single(name, v, 3) for name, v in vectors.items()))
    R0, R1, path = ends
    return RigidMotion(minimum_acceleration_so3(R0, R1, w0, w1), path)


def relax(ends: Ends, guess: Guess) -> MinimumAcceleration:
    """Solve (19) on 28 nodes, then on ever more, until they carry the curve."""
    curve = _newton(ends, guess, 28)
    while not curve.resolved:
        if curve.nodes == 224:
            raise ConvergenceError(curve.residual, curve.iterations)
        curve = _newton(ends, curve, 2 * curve.nodes)
    return curve


def _newton(ends: Ends, guess: Guess, n: int) -> MinimumAcceleration:
    """Solve (19) on n nodes by Newton's method, no node turned by more than half a rad at once."""
    R, c = first_guess(ends, guess, n)
    for iteration in range(1, STEPS + 1):
        turn, dc = _newton_step(ends, R, c)
        size = float(np.abs(turn).max())
        share = min(1.0, LONGEST_STEP / max(size, LONGEST_STEP))
        R = exp_so3(share * turn) @ R
        c = c + share * dc
        if size < 1e-8:
            return MinimumAcceleration(ends, R, c, iteration)
    raise ConvergenceError(size, STEPS)


def _newton_step(ends: Ends, R: Array, c: Array) -> tuple[Array, Array]:
    """Return the turns ε of the nodes, in the fixed frame, and the change of c.

    With w'' = Rᵀc, so w = (1 − t) w0 + t w1 + G Rᵀc, the unknowns are R and c. The equation is
    R' = R ŵ in integral form; its defect is E = R0 + ∫ R ŵ − R. When ε turns R, Rᵀc changes by
    Rᵀ(ĉ ε + dc), and to first order

        ε = ∫ R G Rᵀ (ĉ ε + dc) + vee(E Rᵀ + ∫ E ŵ Rᵀ),

    with ε = 0 at the end.
    """
    n, Rt, nodes = len(R), np.swapaxes(R, -1, -2), grid(len(R))
    W = hats(velocity(ends, Rt @ c))
    E = ends.R0 + along(nodes.integral, R @ W) - R
    defect = vees(E @ Rt + along(nodes.integral, E @ W @ Rt))
    rows = R.reshape(-1, 3)
    RGRt = nodes.twice[:, None, :, None] * (rows @ rows.T).reshape(n, 3, n, 3)
    effect = along(nodes.integral, RGRt)
    system = np.eye(3 * n) - (effect.reshape(-1, 3) @ hat_so3(c)).reshape(3 * n, 3 * n)
    right = np.concatenate([defect[..., None], effect.sum(axis=2)], axis=-1)
    x = np.linalg.solve(system, right.reshape(3 * n, 4)).reshape(n, 3, 4)
    dc = -np.linalg.solve(x[-1, :, 1:], x[-1, :, 0])
    return x[..., 0] + x[..., 1:] @ dc, dc
