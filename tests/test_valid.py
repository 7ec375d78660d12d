"""Test the rule of validity of rotations, poses and unit quaternions, for all functions at once."""

import inspect

import awkward
import numpy as np
import oracles
import pytest
from scipy.spatial.transform import Rotation
from test_contract import REFUSED
from test_functions import exported

import rbcourse as rb
from rbcourse import metrics

TURN, GOAL = (oracles.exp_so3(np.array(w)) for w in ([0.3, -0.4, 0.5], [-0.2, 0.7, 0.1]))
POSE, END = np.eye(4), np.eye(4)
POSE[:3, :3], POSE[:3, 3], END[:3, :3], END[:3, 3] = TURN, [1, -2, 3], GOAL, [0, 2, 1]
QUATERNION = np.array([0.5, 0.5, -0.5, 0.5])
ANY = {"is_so", "is_se", "is_unit_quaternion", "vee_so3", "hat_se3", "exp_se3", "exp_planar"}
ANY |= {"project_so", "project_se", "project_quaternion", "project_so_weighted"}
ANY |= {"orthonormalize_gram_schmidt", "distance_to_so", "planar_from_matrix"}
ANY |= {"quaternion_multiply", "quaternion_conjugate", "canonical_quaternion"}
ANY |= {"interpolate_joints", "interpolate_planar"}
ANY |= {"continuous_quaternions", "arm_forward_kinematics", "arm_tip_jacobian"}
"""Functions of matrices or quaternions that need not be valid, or of other arguments."""

ARGUMENTS = {
    "R": TURN,
    "S": GOAL,
    "A": POSE,
    "poses": np.stack([POSE, END]),
    "q": QUATERNION,
    "q0": QUATERNION,
    "q1": np.array([0.6, 0.8, 0, 0]),
    "times": [0, 1],
    "t": 0.5,
    "p": np.ones(3),
    "d": np.ones(3),
    "w": np.ones(3),
    "d_dot": np.ones(3),
    "body": rb.Body(np.diag([1.0, 2, 2.5])),
    "name": "projected_cubic",
    "x": np.ones(6),
    "v0": np.ones(6),
    "X": metrics.tangent_from_components(POSE, np.ones(6)),
    "Y": metrics.tangent_from_components(POSE, np.ones(6)),
    "G": np.eye(6),
}
RATES = {"v0": 1, "v1": 2, "a0": 3, "a1": 4, "velocities": np.ones((2, 1))}
OF_GROUP = {
    size: {"start": A, "goal": B, "poses": np.stack([A, B])}
    | {name: np.full(n, 0.1) * x for name, x in RATES.items()}
    for size, n, A, B in ((3, 3, TURN, GOAL), (4, 6, POSE, END))
}
"""Arguments that may belong to rotations or to poses."""
REFUSED = REFUSED | {"minimum_torque_spline": 4, "minimum_jerk_spline": 4}


def taken(function, size):
    """Return the valid arguments of a function, by name; uniformity needs many rotations."""
    parameters = inspect.signature(function).parameters
    of_group = OF_GROUP[size] if {"start", "poses"} & set(parameters) else {}
    arguments = ARGUMENTS | of_group
    names = [x.name for x in parameters.values() if x.default is x.empty or x.name in of_group]
    given = {name: arguments[name] for name in names if name in arguments}
    if "smoothing" in function.__name__ or function is rb.outliers.wrong_poses:  # ten or more poses
        poses = np.resize(given["poses"], (10, *given["poses"].shape[1:]))
        given = {"times": np.arange(len(poses)), "poses": poses}
    if function is rb.sampling.uniformity_tests:
        given = {"R": rb.sample_rotation(100, rng=1)}
    return given if set(given) == set(names) else {}


CHECKED = {"R", "S", "A", "start", "goal", "poses", "q", "q0", "q1"}
CASES = {
    f"{name}-{argument}-{size}": (function, size, argument)
    for name, function in sorted(exported().items())
    if name not in ANY and name != "write_path"
    for size in {3, 4} - {REFUSED.get(name)}
    for argument in taken(function, size)
    if argument in CHECKED and (size == 4 or argument in OF_GROUP[3])
}
every_argument = pytest.mark.parametrize(
    ("function", "size", "argument"), CASES.values(), ids=CASES
)


def test_the_rule_holds_for_all_functions_of_rotations_poses_and_quaternions():
    names = {name.partition("-")[0] for name in CASES}
    assert len(names) > 45
    assert {"log_so3", "chain", "slerp", *REFUSED} <= names


def numbers(result):
    """Return the numbers of a result: an array, a curve, or a tuple."""
    if isinstance(result, rb.Curve):
        return np.concatenate([result(0.3, k).ravel() for k in range(3)])
    if isinstance(result, dict):
        return np.array([test.statistic for test in result.values()])
    if isinstance(result, tuple):
        return np.concatenate([np.ravel(x) for x in result])
    return np.where(result, 2.0, 1.0) if result.dtype == bool else result


def wrong_values(value):
    """Yield a reflection, a matrix of another size, a shear, a transposed pose, or norms."""
    if value.shape[-1] == 4 and value.ndim == 1:
        yield from (2 * value, value * (1 + 3e-6), value * (1 - 1e-5))
        return
    left = np.eye(value.shape[-1])
    left[2, 2] = -1
    yield value @ left
    for factor in (np.diag([1.1, 1.1, 1.1]), np.diag([1 + 3e-6, 1, 1]), np.diag([0.0, 0, 0])):
        other = np.eye(value.shape[-1])
        other[:3, :3] = factor
        yield value @ other
    sheared = np.eye(value.shape[-1])
    sheared[0, 1] = 1e-5
    yield value @ sheared
    if value.shape[-1] == 4:
        yield value.swapaxes(-1, -2)
        yield value + np.pad([[3e-6]], ((3, 0), (0, 3)))


@every_argument
def test_an_invalid_argument_is_refused_with_its_deviation(function, size, argument):
    given = taken(function, size)
    for value in wrong_values(given[argument]):
        with pytest.raises(ValueError, match=rf"^{argument}.* (project_|its last row is)") as told:
            function(**given | {argument: value})
        assert any(
            x in str(told.value) for x in ("is allowed", "determinant", "1 is wanted", "row")
        )


@every_argument
def test_numbers_in_single_precision_are_repaired(function, size, argument):
    given = taken(function, size)
    exact = numbers(function(**given))
    single = function(**given | {argument: given[argument].astype(np.float32)})
    assert np.abs(numbers(single) - exact).max() < 1e-5 * np.abs(exact).max()
    if isinstance(single, rb.Curve):
        assert rb.is_so(single([0, 0.3, 1])[..., :3, :3], atol=1e-14).all()
    accepted = function(**given | {argument: given[argument] * (1 + 1e-10)})
    assert np.abs(numbers(accepted) - exact).max() < 1e-7 * np.abs(exact).max()


@every_argument
def test_scipy_objects_are_accepted(function, size, argument):
    given = taken(function, size)
    value = given[argument]
    if value.ndim == 1:
        return
    kind = Rotation if value.shape[-1] == 3 else awkward.RigidTransform
    if kind is None:
        pytest.skip("RigidTransform is new in SciPy 1.16")
    want = numbers(function(**given))
    others = [kind.from_matrix(value)]
    if value.ndim == 3:
        others.append([kind.from_matrix(one) for one in value])
    for other in others:
        result = numbers(function(**given | {argument: other}))
        assert np.abs(result - want).max() < 1e-12 * np.abs(want).max()


def test_the_message_names_the_entry_and_the_converter():
    rotations, poses = (rf"shape \(..., {n}, {n}\) is wanted, got .*; " for n in (3, 4))
    for function, value, message in (
        (rb.log_so3, [TURN, TURN, 1.1 * TURN], r"R\[2\] is not .* is 0.21, and 1e-06 is allowed"),
        (rb.log_so3, np.ones((5, 3)), rotations + "exp_so3 makes rotations of rotation vectors"),
        (rb.log_so3, np.ones((5, 4)), rotations + "matrix_from_quaternion makes rotations of quat"),
        (rb.log_se3, np.ones((5, 6)), poses + "pose_from_coordinates makes poses of"),
        (rb.log_se3, np.ones((5, 7)), poses + "pose_from_components makes poses of"),
        (rb.log_se3, np.ones((5, 3, 3)), poses + "pose_from_components makes poses of"),
    ):
        with pytest.raises(ValueError, match=message):
            function(value)
    with pytest.raises(ValueError, match=r"poses: .*; pose_from_components makes poses"):
        rb.projected_spline([0, 1], np.ones((2, 7)))


def test_deviations_are_measured_to_rounding():
    """A symmetric error E, removed by projection, is found from 1e-9 up; smaller ones remain."""
    rng = np.random.default_rng(77)
    for size in (1e-10, 1e-8, 4e-7):
        for _ in range(50):
            E = rng.normal(size=(3, 3))
            E = (E + E.T) * size / np.abs(E + E.T).max()
            M = TURN @ (np.eye(3) + E)
            R = rb.geodesic(M, TURN)(0)
            off = np.abs(R.T @ R - np.eye(3)).max()
            assert off < 1e-14 if size > 1e-9 else np.array_equal(R, M)
