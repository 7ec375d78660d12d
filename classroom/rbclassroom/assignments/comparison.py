"""Compare a student's function with the course's and with SciPy's: accuracy and time."""

import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy import integrate, linalg, optimize
from scipy.spatial.transform import Rotation, RotationSpline, Slerp

import rbcourse as rb
from rbclassroom.assignments.marking import as_numbers
from rbclassroom.assignments.student_code import NotYet, call_student
from rbcourse import Array, arm, connection, textbook
from rbcourse.sampling import angle_law

Function = Callable[..., Any]


class _Comparison(NamedTuple):
    course: Function
    scipy: Function
    trials: dict[str, tuple[Any, ...]]  # the arguments for each row
    error: Function  # of a result and its arguments
    adapt: Function = lambda function: function


def compare(name: str, function: Function) -> None:
    """Print the errors and the time of a student's function, of the course's, and of SciPy's."""
    known = _KNOWN[name]()
    functions = [known.adapt(each) for each in (function, known.course, known.scipy)]
    rows = {f"errors of {name}": ["yours", "the course's", "SciPy's"]}
    for said, given in known.trials.items():
        rows[said] = [_error(known.error, each, given) for each in functions]
    first = next(iter(known.trials.values()))
    rows["time of a call, first row"] = [_time(each, first) for each in functions]
    for said, cells in rows.items():
        print(f"{said:28}", *(f"{cell:>13}" for cell in cells))


def _error(error: Function, function: Function, given: tuple[Any, ...]) -> str:
    try:
        result = as_numbers(call_student(function, given)[0])
        return "-" if result is None else f"{error(result, *given):.0e}"
    except (NotYet, ValueError) as problem:
        return "not written" if "is written" in str(problem) else "fails"


def _time(function: Function, given: tuple[Any, ...]) -> str:
    """Return the median time of a call, from calls in a tenth of a second."""
    times, end = list[float](), time.perf_counter() + 0.1
    while not times or time.perf_counter() < end:
        start = time.perf_counter()
        try:
            call_student(function, given)
        except NotYet:
            return "-"
        times.append(time.perf_counter() - start)
    took = float(np.median(times))
    return f"{took * 1e3:.1f} ms" if took > 1e-3 else f"{took * 1e6:.0f} µs"


_AXIS = np.array([1.0, 2.0, 2.0]) / 3
_BODY = np.diag([1.0, 2.0, 2.5])
_ANGLES = {"1": 1.0, "1e-8": 1e-8, "π − 1e-3": np.pi - 1e-3, "π − 1e-8": np.pi - 1e-8}


def _turn(angle: float) -> Array:
    """Return the rotation about `_AXIS`; all its digits are right for every angle."""
    N, half = rb.hat_so3(_AXIS), angle / 2
    return np.eye(3) + 2 * np.sin(half) * (np.cos(half) * N + np.sin(half) * N @ N)


def _apart(result: Array, right: Array) -> float:
    return float(np.abs(result - right).max())


def _arm_angles() -> _Comparison:
    lengths = np.array([2, 1.5])

    def tip(angles: Array) -> Array:
        return arm.arm_forward_kinematics(angles, lengths).joints[-1]

    def fit(goal: Array, _: Array) -> Array:
        return optimize.least_squares(lambda q: tip(q) - goal, [0.2, 0.6], xtol=1e-15).x

    bends = {f"θ₁ = {bend:g}": np.array([0.4, bend]) for bend in (1.0, 1e-2, 1e-4, 1e-6)}
    return _Comparison(
        lambda goal, lengths: arm.arm_inverse_kinematics(goal, lengths)[0],
        fit,
        {said: (tip(angles), lengths) for said, angles in bends.items()},
        lambda found, goal, _: _apart(tip(found), goal),
    )


def _log() -> _Comparison:
    right = {_turn(angle).tobytes(): angle * _AXIS for angle in _ANGLES.values()}
    return _Comparison(
        rb.log_so3,
        lambda R: Rotation.from_matrix(R).as_rotvec(),
        {f"angle {said}": (_turn(angle),) for said, angle in _ANGLES.items()},
        lambda found, R: _apart(found, right[R.tobytes()]),
    )


def _sampler() -> _Comparison:
    def adapt(function: Function) -> Function:
        def quality(of: str) -> float:
            rng = np.random.default_rng(1)
            R = np.array([function(rng) for _ in range(2000)])
            if of == "orthogonality":
                return _apart(R.mT @ R, np.eye(3))
            angles = np.arccos(np.clip((np.trace(R, axis1=1, axis2=2) - 1) / 2, -1, 1))
            return _apart(np.sort(angle_law(angles)), np.arange(2000) / 2000)

        return quality

    return _Comparison(
        lambda rng: rb.sample_rotation(rng=rng),
        lambda rng: Rotation.random(None, rng).as_matrix(),
        {f"{of}, 2000 draws": (of,) for of in ("orthogonality", "angles")},
        lambda found, _: float(found),
        adapt,
    )


def _geodesic() -> _Comparison:
    R0 = _turn(0.4)
    right = {(R0 @ _turn(angle)).tobytes(): R0 @ _turn(angle / 2) for angle in _ANGLES.values()}
    return _Comparison(
        lambda R0, R1, t: textbook.geodesic(R0, R1, np.array([t]))[0],
        lambda R0, R1, t: Slerp([0, 1], Rotation.from_matrix([R0, R1]))(t).as_matrix(),
        {f"angle {said}": (R0, R0 @ _turn(angle), 0.5) for said, angle in _ANGLES.items()},
        lambda found, R0, R1, t: _apart(found, right[R1.tobytes()]),
    )


def _ends(degrees: float) -> tuple[Array, Array, Array, Array]:
    turn = _turn(np.radians(degrees))
    return np.eye(3), turn, np.array([0.5, 0, -0.5]), np.array([0, 0.8, 0])


def _shooting() -> _Comparison:
    t = np.array([0.0, 1])
    return _Comparison(
        lambda R0, R1, w0, w1: textbook.shoot(R0, R1, w0, w1, t)[2][[0, 0]],
        lambda R0, R1, w0, w1: textbook.minimum_acceleration(R0, R1, w0, w1, t)[2][[0, 0]],
        {f"turn of {degrees}°": _ends(degrees) for degrees in (50, 100, 170)},
        lambda found, *ends: _apart(found[0], rb.minimum_acceleration(*ends)(0.0, 2)),
    )


def _nearest() -> _Comparison:
    W, U, right = np.trace(_BODY) / 2 * np.eye(3) - _BODY, _turn(0.7), _turn(1.0)
    # the two smallest eigenvalues of RᵀMW add up to the gap
    gaps = {gap: right @ U @ np.diag([1, 0.5, gap - 0.5]) @ U.T for gap in (1, 1e-3, 1e-6, 1e-9)}
    return _Comparison(
        lambda M, G: textbook.project_so(M @ W),
        lambda M, G: linalg.polar(M @ W)[0],
        {f"gap {gap:g}": (MW @ np.linalg.inv(W), _BODY) for gap, MW in gaps.items()},
        lambda found, M, G: _apart(found, right),
    )


def _spline() -> _Comparison:
    def path(degrees: float) -> tuple[Array, Array]:
        one, two = rb.exp_so3(np.radians(degrees) * np.array([[1, 0, 0], [0, 0.8, 0.6]]))
        return np.array([0, 1, 2.5]), np.array([np.eye(3), one, one @ two])

    return _Comparison(
        textbook.spline_velocities,
        lambda times, R: RotationSpline(times, Rotation.from_matrix(R))(times, 1),
        {f"legs of {degrees}°": path(degrees) for degrees in (10, 20, 40, 80)},
        lambda found, times, R: _apart(found, rb.spline_velocities(times, R)),
    )


def _free_motion() -> _Comparison:
    def scipy(G: Array, R0: Array, w0: Array, T: float) -> Array:
        def rate(_: float, y: Array) -> Array:
            R, w = y[:9].reshape(3, 3), y[9:]
            return np.append(R @ rb.hat_so3(w), np.linalg.solve(G, np.cross(G @ w, w)))

        return integrate.solve_ivp(rate, (0, T), np.append(R0, w0)).y[:9, -1].reshape(3, 3)

    def right(G: Array, R0: Array, w0: Array, T: float) -> Array:
        return connection.geodesic_flow(G, R0, w0, T)[0]

    spins = {tilt: np.array([tilt, 3.0, 0.0]) for tilt in (1, 0.1, 1e-3, 1e-5)}
    return _Comparison(
        right,
        scipy,
        {f"ω₁ = {tilt:g}": (_BODY, np.eye(3), w, 10.0) for tilt, w in spins.items()},
        lambda found, *given: _apart(found, right(*given)),
    )


def _relaxation() -> _Comparison:
    t = (1 - np.cos(np.pi * np.arange(20) / 19)) / 2
    return _Comparison(
        lambda *given: rb.minimum_acceleration(*given[:4])(t),
        lambda R0, R1, w0, w1, n: textbook.minimum_acceleration(R0, R1, w0, w1, t, 1e-6)[0],
        {f"turn of {degrees}°": (*_ends(degrees), 20) for degrees in (50, 120, 175)},
        lambda found, *given: _apart(found, rb.minimum_acceleration(*given[:4])(t)),
    )


_KNOWN = {
    "arm_angles": _arm_angles,
    "log_so3": _log,
    "random_rotation": _sampler,
    "geodesic": _geodesic,
    "shoot": _shooting,
    "nearest_in_metric": _nearest,
    "spline_velocities": _spline,
    "free_motion": _free_motion,
    "relax": _relaxation,
}
