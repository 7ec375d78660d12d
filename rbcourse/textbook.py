"""Short, slow, readable textbook versions of the fast functions.

Read them first. Each function has the name, units, frames and singular set of its fast counterpart.
The textbook and the fast version agree up to rounding or, for an optimum, up to a tolerance.
Arguments are not checked. The results R have the shape (N, 3, 3), and w and w' the shape (N, 3).

Parameters
----------
R0, R1 : ndarray, shape (3, 3)
    The rotations at both ends.
w0, w1 : ndarray, shape (3,)
    The angular velocities at both ends in the body frame, in rad per unit time.
G : ndarray, shape (3, 3)
    The inertia of the body about its centre of mass.
times : ndarray, shape (N,)
    Increasing times, one for each rotation.
R : ndarray, shape (N, 3, 3)
    The rotations of the path.
ends : (ndarray, ndarray) or None, shape (3,), optional
    The first and the last angular velocity; by default, w' is 0 at both ends.
x0, x1, v0, v1 : float or ndarray, all of one shape
    The values and the derivatives at both ends.
coefficients : ndarray, shape (degree + 1, ...)
    The coefficients of 1, t, t², ….
t : ndarray, shape (N,)
    Times; those of a curve are from 0 to 1.
order : int, optional
    The order of the derivative.
tol : float, optional
    The tolerance of `solve_bvp`.
M : ndarray, shape (..., n, n)
    Square matrices.
n : int
    The number of samples.
rng : numpy.random.Generator
    The source of random numbers.
turn : ndarray, shape (3,)
    The rotation vector, in rad.
inertia : ndarray, shape (3, 3)
    The inertia of the body.
torque : float
    The largest norm of the torque.
cells : int
    The number of cells.
function : callable
    A function with a docstring.
"""

import ast
import inspect
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbcourse._docs import described_by
from rbcourse.curves.bezier import corrected_bezier
from rbcourse.quaternion import (
    continuous_quaternions,
    matrix_from_quaternion,
    project_quaternion,
    quaternion_from_matrix,
)
from rbcourse.sampling import arvo_rotation, shoemake_quaternion
from rbcourse.so3 import exp_so3, hat_so3, log_so3, right_jacobian_inverse_so3, vee_so3

Array = NDArray[Any]

__all__ = [
    "cubic_coefficients",
    "fastest",
    "geodesic",
    "minimum_acceleration",
    "minimum_acceleration_spline",
    "minimum_torque",
    "polynomial",
    "project_so",
    "projected_cubic",
    "sample_quaternion",
    "sample_rotation",
    "shoot",
    "show",
    "smoothing_spline",
    "spline_velocities",
]


def show(function: Callable[..., Any]) -> None:
    """Print the code of a function without its docstring.

    Examples
    --------
    >>> show(sample_quaternion)
    def sample_quaternion(n: int, rng: np.random.Generator) -> Array:
        return shoemake_quaternion(rng.random((n, 3)))
    """
    source = inspect.getsource(function)
    [definition] = ast.parse(source).body
    if not isinstance(definition, ast.FunctionDef) or not ast.get_docstring(definition):
        raise ValueError(f"function: one with a docstring is wanted, got {function!r}")
    docstring, lines = definition.body[0], source.splitlines()
    print("\n".join(lines[: docstring.lineno - 1] + lines[docstring.end_lineno :]))


def project_so(M: Array) -> Array:
    """Return the rotations nearest to M, shape (..., n, n): U diag(1, …, 1, det(U Vᵀ)) Vᵀ.

    Source: BK Prop. 2, with the determinant's sign.

    Examples
    --------
    >>> project_so(np.array([[0.0, -2.0], [3.0, 0.0]]))
    array([[ 0., -1.],
           [ 1.,  0.]])
    """
    U, _, Vt = np.linalg.svd(M)
    U[..., -1] *= np.linalg.det(U @ Vt)[..., None]
    return U @ Vt


def geodesic(R0: Array, R1: Array, t: Array) -> Array:
    """Return R0 exp(σ̂ t) at the times t, with σ = log(R0ᵀ R1).

    Source: BK 6.1.

    Examples
    --------
    >>> R = geodesic(np.eye(3), exp_so3([0, 0, 1.5]), np.array([0, 0.5, 1]))
    >>> log_so3(R)[:, 2].round(12)
    array([0.  , 0.75, 1.5 ])
    """
    sigma = log_so3(R0.T @ R1)
    return R0 @ exp_so3(t[:, None] * sigma)


def projected_cubic(
    R0: Array, R1: Array, w0: Array, w1: Array, t: Array
) -> tuple[Array, Array, Array]:
    """Return R, w and w' of the projected cubic at the times t.

    Let S = RᵀM, A = RᵀM' and G = tr(S) I − S. Since S is symmetric, differentiation gives G w =
    vee(A − Aᵀ) and G w' = vee(A' − A'ᵀ) − G' w.
    Source: BK 6.2.

    Examples
    --------
    >>> R1, rest, t = exp_so3([0, 0, 1.5]), np.zeros(3), np.array([0, 0.5, 1])
    >>> log_so3(projected_cubic(np.eye(3), R1, rest, rest, t)[0])[:, 2].round(12)
    array([0.  , 0.75, 1.5 ])
    """
    coefficients = cubic_coefficients(R0, R1, R0 @ hat_so3(w0), R1 @ hat_so3(w1))
    M, M_rate, M_bend = (polynomial(coefficients, t[:, None, None], order) for order in range(3))
    R = project_so(M)
    Rt = np.swapaxes(R, -1, -2)
    S, A = Rt @ M, Rt @ M_rate
    w = np.linalg.solve(_spin(S), 2 * vee_so3(A)[..., None])
    W = hat_so3(w[..., 0])
    A_rate, S_rate = Rt @ M_bend - W @ A, A - W @ S
    a = np.linalg.solve(_spin(S), 2 * vee_so3(A_rate)[..., None] - _spin(S_rate) @ w)
    return R, w[..., 0], a[..., 0]


def cubic_coefficients(x0: Array, x1: Array, v0: Array, v1: Array) -> Array:
    """Return the cubic on [0, 1] with values x0, x1 and derivatives v0, v1 at its ends.

    x0, x1, v0, v1 have the same shape. The result, shape (4, ...), contains the coefficients of 1,
    t, t², t³. Of all curves with these boundary conditions, the cubic has the least ∫ ‖x''‖² dt.
    Source: BK 6.2.

    Examples
    --------
    >>> cubic_coefficients(0.0, 1.0, 0.0, 0.0)
    array([ 0.,  0.,  3., -2.])
    """
    gap = x1 - x0
    return np.stack([x0, v0, 3 * gap - 2 * v0 - v1, v0 + v1 - 2 * gap])


def polynomial(coefficients: Array, t: Array, order: int = 0) -> Array:
    """Evaluate a polynomial or, if order > 0, its derivative of this order at the times t.

    The times broadcast with each coefficient.

    Examples
    --------
    >>> polynomial(np.array([1.0, 2.0, 3.0]), np.array([0.0, 1.0]), 1)
    array([2., 8.])
    """
    for _ in range(order):
        powers = np.arange(len(coefficients)).reshape(-1, *(1,) * (coefficients.ndim - 1))
        coefficients = (powers * coefficients)[min(1, len(coefficients) - 1) :]
    value: Array = np.array(coefficients[-1] + 0.0 * t)
    for coefficient in coefficients[-2::-1]:  # Horner's scheme
        value *= t
        value += coefficient
    return value[()]


def minimum_torque(
    R0: Array, R1: Array, w0: Array, w1: Array, G: Array, t: Array, tol: float = 1e-9
) -> tuple[Array, Array]:
    """Return R and w of the least-torque motion at the times t, by SciPy's `solve_bvp`.

    With R = R0 exp(σ̂), the equations are σ' = J(σ)⁻¹ w, R p = c, and Euler's equation G w' = τ − w
    × G w. Here p = G (τ' + w × τ) − G w × τ, and c is an unknown constant. ‖σ‖ must be below 2π. If
    the solver fails, a RuntimeError names the reason. The solver may find a stationary curve that
    is not the cheapest.
    Source: beyond BK 4 (see `rbcourse.curves.functionals.Effort`, with M = I).

    Examples
    --------
    >>> R1, rest, G = exp_so3([0, 0, 1.5]), np.zeros(3), np.diag([1.0, 2, 2.5])
    >>> R, w = minimum_torque(np.eye(3), R1, rest, rest, G, np.array([0.5]))
    >>> log_so3(R)[:, 2].round(9) + 0.0
    array([0.75])
    """
    from scipy.integrate import solve_bvp

    goal = log_so3(R0.T @ R1)

    def cross(x: Array, y: Array) -> Array:
        return np.cross(x, y, axis=0)

    def rates(_: Array, y: Array, c: Array) -> Array:
        sigma, w, torque = y.reshape(3, 3, -1)
        sigma_rate = np.einsum("nij,jn->in", right_jacobian_inverse_so3(sigma.T), w)
        costate = (R0 @ exp_so3(sigma.T)).mT @ c
        w_rate = np.linalg.solve(G, torque - cross(w, G @ w))
        torque_rate = np.linalg.solve(G, costate.T + cross(G @ w, torque)) - cross(w, torque)
        return np.concatenate([sigma_rate, w_rate, torque_rate])

    def misses(start: Array, end: Array, c: Array) -> Array:
        return np.concatenate([start[:3], start[3:6] - w0, end[:3] - goal, end[3:6] - w1])

    nodes = np.linspace(0, 1, 11)
    guess = np.zeros((9, 11))
    guess[:3], guess[3:6] = np.outer(goal, nodes), np.outer(w0, 1 - nodes) + np.outer(w1, nodes)
    with np.errstate(over="ignore", invalid="ignore"):
        solution = solve_bvp(rates, misses, nodes, guess, p=np.zeros(3), tol=tol, max_nodes=100_000)
    if not solution.success:
        raise RuntimeError(solution.message)
    sigma, w, _ = np.moveaxis(solution.sol(t).reshape(3, 3, -1), -1, 1)
    return R0 @ exp_so3(sigma), w


def _spin(S: Array) -> Array:
    return np.trace(S, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) - S


def sample_rotation(n: int, rng: np.random.Generator) -> Array:
    """Return n uniformly random rotations, each by Arvo's method from three uniform numbers.

    Source: RR 2.1, RR (9), RR (10), RR (11).

    Examples
    --------
    >>> sample_rotation(5, np.random.default_rng(1)).shape
    (5, 3, 3)
    """
    return arvo_rotation(rng.random((n, 3)))


def sample_quaternion(n: int, rng: np.random.Generator) -> Array:
    """Return n uniformly random unit quaternions, each by Shoemake's method.

    Source: RR 2.2, RR (13).

    Examples
    --------
    >>> sample_quaternion(5, np.random.default_rng(1)).shape
    (5, 4)
    """
    return shoemake_quaternion(rng.random((n, 3)))


def minimum_acceleration(
    R0: Array, R1: Array, w0: Array, w1: Array, t: Array, tol: float = 1e-9
) -> tuple[Array, Array, Array]:
    """Return R, w and w' of the optimum at the times t, by SciPy's `solve_bvp`.

    With R = R0 exp(σ̂), the equations are σ' = J(σ)⁻¹ w and w''' = −w × w''. ‖σ‖ must be below 2π.
    If the solver fails, a RuntimeError names the reason.
    Source: BK (19).

    Examples
    --------
    >>> R1, rest, t = exp_so3([0, 0, 1.5]), np.zeros(3), np.array([0, 0.5, 1])
    >>> R, w, a = minimum_acceleration(np.eye(3), R1, rest, rest, t)
    >>> log_so3(R)[:, 2].round(9) + 0.0
    array([0.  , 0.75, 1.5 ])
    """
    from scipy.integrate import solve_bvp

    goal = log_so3(R0.T @ R1)

    def rates(_: Array, y: Array) -> Array:
        sigma, w, acceleration, jerk = y.reshape(4, 3, -1)
        sigma_rate = np.einsum("nij,jn->in", right_jacobian_inverse_so3(sigma.T), w)
        return np.concatenate([sigma_rate, acceleration, jerk, np.cross(jerk, w, axis=0)])

    def misses(start: Array, end: Array) -> Array:
        return np.concatenate([start[:3], start[3:6] - w0, end[:3] - goal, end[3:6] - w1])

    nodes = np.linspace(0, 1, 11)
    guess = np.zeros((12, 11))
    guess[:3], guess[3:6] = np.outer(goal, nodes), np.outer(w0, 1 - nodes) + np.outer(w1, nodes)
    solution = solve_bvp(rates, misses, nodes, guess, tol=tol, max_nodes=100_000)
    if not solution.success:
        raise RuntimeError(solution.message)
    sigma, w, acceleration, _ = np.moveaxis(solution.sol(t).reshape(4, 3, -1), -1, 1)
    return R0 @ exp_so3(sigma), w, acceleration


def shoot(R0: Array, R1: Array, w0: Array, w1: Array, t: Array) -> tuple[Array, Array, Array, int]:
    """Return R, w and w' of the optimum at the times t, and the number of corrections, by shooting.

    Equation (20), w'' + w × w' = b, is integrated from t = 0. Newton's method corrects the six
    unknowns w'(0) and b until R(1) and w(1) are right to 1e-10. The first values are those of
    `corrected_bezier`, with the mean of R w'', which is constant along an optimum. The method
    may find a stationary curve that is not the cheapest.

    If ‖w0‖ or ‖w1‖ is 3π or more, where the method seldom converges, a ValueError is raised. If 20
    corrections do not suffice, a RuntimeError is raised.
    Source: BK (20), BK 6.2.

    Examples
    --------
    >>> R1, rest, t = exp_so3([0, 0, 1.5]), np.zeros(3), np.array([0, 0.5, 1])
    >>> R, w, a, corrections = shoot(np.eye(3), R1, rest, rest, t)
    >>> log_so3(R)[:, 2].round(9) + 0.0
    array([0.  , 0.75, 1.5 ])
    """
    from scipy.integrate import solve_ivp

    def motions(aims: Array, times: Array) -> tuple[Array, Array, Array]:
        """Integrate the motions of several aims (w'(0), b), shape (K, 6), together."""
        K = len(aims)

        def rates(_: float, y: Array) -> Array:
            R, w, a = np.split(y.reshape(K, 15), [9, 12], axis=1)
            turning = R.reshape(K, 3, 3) @ hat_so3(w)
            return np.hstack([turning.reshape(K, 9), a, aims[:, 3:] - np.cross(w, a)]).ravel()

        fixed = np.tile(np.append(R0, w0), (K, 1))
        start = np.hstack([fixed, aims[:, :3]]).ravel()
        moved = solve_ivp(rates, (0, 1), start, "DOP853", t_eval=times, rtol=1e-12, atol=1e-13)
        R, w, a = np.split(moved.y.T.reshape(-1, K, 15), [9, 12], axis=2)
        return R.reshape(-1, K, 3, 3), w, a

    guess, inside = corrected_bezier(R0, R1, w0, w1), np.linspace(0.1, 0.9, 9)
    constant = np.mean(guess(inside) @ guess(inside, 3)[..., None], axis=0)[:, 0]
    aim = np.append(guess(0, 2), R0.T @ constant + np.cross(w0, guess(0, 2)))
    for corrections in range(21):
        nudged = aim + 1e-6 * np.eye(7, 6, -1)  # the aim, and one nudge of each unknown
        R, w, _ = motions(nudged, np.ones(1))
        missed, *others = np.hstack([log_so3(R1.T @ R[0]), w[0] - w1])
        size = np.abs(missed).max()
        if size < 1e-10:
            R, w, a = motions(aim[None], t)
            return R[:, 0], w[:, 0], a[:, 0], corrections
        slopes = (np.transpose(others) - missed[:, None]) / 1e-6
        aim = aim - np.linalg.solve(slopes, missed) * min(1, 0.5 / size)
    raise RuntimeError(f"the motion misses its end by {size:.1g} after 20 corrections")


def spline_velocities(times: Array, R: Array) -> Array:
    """Return the angular velocities w for which w' is continuous at the rotations R.

    Let Q = R_iᵀ R_{i+1}, s = vee skew Q, and B = ½ (tr Q I − Qᵀ). A projected cubic of duration h
    has h² w'(0) = 6 s − 4 h w_i − 2 h B w_{i+1} and h² w'(1) = −6 s + 2 h Bᵀ w_i + 4 h w_{i+1}. At
    both ends of the path, w' = 0.
    Source: beyond BK 13.

    Examples
    --------
    >>> spline_velocities(np.array([0.0, 2]), exp_so3([[0, 0, 0], [0, 0, 1]])).round(4) + 0.0
    array([[0.    , 0.    , 0.4969],
           [0.    , 0.    , 0.4969]])
    """
    H, b = np.zeros((len(R), 3, len(R), 3)), np.zeros((len(R), 3))
    for i, h in enumerate(np.diff(times)):
        Q = R[i].T @ R[i + 1]
        s, B = vee_so3((Q - Q.T) / 2), (np.trace(Q) * np.eye(3) - Q.T) / 2
        H[i, :, i] += 4 / h * np.eye(3)
        H[i, :, i + 1] += 2 / h * B
        H[i + 1, :, i] += 2 / h * B.T
        H[i + 1, :, i + 1] += 4 / h * np.eye(3)
        b[i] += 6 * s / h**2
        b[i + 1] += 6 * s / h**2
    return np.linalg.solve(H.reshape(b.size, b.size), b.ravel()).reshape(b.shape)


def smoothing_spline(times: Array, R: Array, smoothing: float, t: Array) -> Array:
    """Return the projected smoothing spline near noisy rotations R, at the times t, by SciPy.

    The spline M of the matrices, projected, has the angular velocity w. The quaternions q near the
    rotations shall have q'' = −¼ ‖w‖² q without a cost. Twice integrated, this is a function x(t),
    and the other part q − x is a smoothing spline.
    Source: beyond BK 17.

    Parameters
    ----------
    smoothing : float
        The factor λ of ∫ ‖M'' ‖² dt, in the cube of the unit of time.

    Examples
    --------
    >>> times = np.arange(9.0)
    >>> R = smoothing_spline(times, exp_so3(times[:, None] * [0, 0, 0.5]), 1.0, times[4:5])
    >>> log_so3(R).round(3) + 0.0
    array([[0., 0., 2.]])
    """
    from scipy.interpolate import make_interp_spline, make_smoothing_spline

    def smoothed(values: Array, t: Array, order: int = 0) -> Array:
        splines = [make_smoothing_spline(times, column, lam=smoothing) for column in values.T]
        return np.stack([spline(t, order) for spline in splines], axis=-1)

    M, M_rate = (smoothed(R.reshape(-1, 9), times, k).reshape(R.shape) for k in (0, 1))
    near = project_so(M)
    S, A = near.mT @ M, near.mT @ M_rate
    w = np.linalg.solve(_spin(S), 2 * vee_so3(A)[..., None])
    q, data = continuous_quaternions(quaternion_from_matrix(near)), quaternion_from_matrix(R)
    data = data * np.sign(np.sum(data * q, axis=1, keepdims=True))
    bend = -np.sum(w * w, axis=1) / 4 * q
    x = make_interp_spline(times, bend, k=1).antiderivative(2)
    return matrix_from_quaternion(project_quaternion(smoothed(data - x(times), t) + x(t)))


def minimum_acceleration_spline(
    times: Array, R: Array, ends: tuple[Array, Array] | None = None, tol: float = 1e-10
) -> tuple[Array, Array]:
    """Return w and w' of the optimum through the rotations R, by SciPy's `solve_bvp`.

    All legs are solved together; the time of each leg runs from 0 to 1. The equations are those of
    `minimum_acceleration`. At the inner rotations, w and w' are continuous. At both ends, w is
    given, or w' = 0. If the solver fails, a RuntimeError names the reason.
    Source: beyond BK 12.

    Examples
    --------
    >>> w, a = minimum_acceleration_spline(np.array([0.0, 2]), exp_so3([[0, 0, 0], [0, 0, 1]]))
    >>> w.round(9) + 0.0
    array([[0. , 0. , 0.5],
           [0. , 0. , 0.5]])
    """
    from scipy.integrate import solve_bvp

    h, goals = np.diff(times)[:, None], log_so3(R[:-1].mT @ R[1:])
    count = len(h)

    def rates(_: Array, y: Array) -> Array:
        sigma, w, a, b = y.reshape(4, 3, count, -1)
        J = right_jacobian_inverse_so3(np.moveaxis(sigma, 0, -1))
        sigma_rate = np.einsum("nmij,jnm->inm", J, w)
        return np.stack([sigma_rate, a, b, np.cross(b, w, axis=0)]).reshape(y.shape)

    def misses(start: Array, end: Array) -> Array:
        (sigma0, w0, a0, _), (sigma1, w1, a1, _) = (
            np.swapaxes(x.reshape(4, 3, count), 1, 2) for x in (start, end)
        )
        w0, w1, a0, a1 = w0 / h, w1 / h, a0 / h**2, a1 / h**2
        at_ends = (a0[0], a1[-1]) if ends is None else (w0[0] - ends[0], w1[-1] - ends[1])
        joints = w1[:-1] - w0[1:], a1[:-1] - a0[1:]
        return np.concatenate([np.ravel(x) for x in (sigma0, sigma1 - goals, *joints, *at_ends)])

    nodes = np.linspace(0, 1, 11)
    guess = np.zeros((4, 3, count, 11))
    guess[0], guess[1] = goals.T[..., None] * nodes, goals.T[..., None]
    solution = solve_bvp(rates, misses, nodes, guess.reshape(-1, 11), tol=tol, max_nodes=100_000)
    if not solution.success:
        raise RuntimeError(solution.message)
    _, w, a, _ = np.moveaxis(solution.sol([0.0, 1.0]).reshape(4, 3, count, 2), 1, -1)
    w, a = w / h[..., None], a / h[..., None] ** 2
    return np.append(w[:, 0], w[-1:, 1], axis=0), np.append(a[:, 0], a[-1:, 1], axis=0)


def fastest(turn: Array, inertia: Array, torque: float, cells: int) -> tuple[Array, Array]:
    """Return the fractions of a turn and the least times to reach them with bounded torque.

    Let σ be the rotation vector `turn` and R = exp(σ̂ s). In a cell of length h, x = s'² changes
    linearly, and u = s'' = (x_i+1 − x_i)/2h. The two terms of the torque G σ u + (σ × G σ) x are
    perpendicular. In each cell, ‖G σ‖² u² + ‖σ × G σ‖² x² = τ² at the end where x is larger. The
    first pass goes backward from the end, and the second pass goes forward from the start.
    Source: beyond BK 16.

    Examples
    --------
    >>> s, t = fastest(np.array([0, 0, 2.0]), np.eye(3), 1.0, 100)
    >>> float((t[-1] / 2**1.5).round(9))  # 2 √(θ G/τ)
    1.0
    """
    s, h = np.linspace(0, 1, cells + 1), 1 / cells
    a = np.sum((inertia @ turn) ** 2) / (4 * h**2)
    b = np.sum(np.cross(turn, inertia @ turn) ** 2)

    def larger(y: float) -> float:
        x = (a * y + np.sqrt((a * y) ** 2 - (a + b) * (a * y * y - torque**2))) / (a + b)
        return float(x if b * x * x < torque**2 else torque / np.sqrt(b))

    x = np.zeros((2, cells + 1))
    for i in range(cells):
        x[0, i + 1], x[1, cells - 1 - i] = larger(x[0, i]), larger(x[1, cells - i])
    rate = np.sqrt(x.min(axis=0))
    return s, np.append(0, np.cumsum(2 * h / (rate[1:] + rate[:-1])))


for _name in __all__:
    described_by(__doc__)(globals()[_name])
