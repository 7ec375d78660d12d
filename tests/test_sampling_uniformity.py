"""Statistics of uniformity: uniform samples pass, every deliberate fault is caught.

The seeds are fixed. A correct sampler would give a p-value below 1e-8 in one of its seven
statistics less than once in ten million seeds.
"""

from functools import partial

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial.transform import Rotation
from scipy.stats import kstest, norm

import rbcourse as rb
from rbcourse.sampling import angle_law, arvo_rotation, shoemake_quaternion

MILLION = 1_000_000
ALL = {"E tr", "E tr²", "angle", "image of e₁", "image of e₃", "angle to next", "angle to half"}


def failed(R, level=1e-8):
    """The statistics that say no."""
    return {name for name, test in rb.sampling.uniformity_tests(R).items() if test.p_value < level}


def random_matrices(q):
    return rb.matrix_from_quaternion(q)


def by_arvo(change, count=20_000):
    return arvo_rotation(change(np.random.default_rng(0).random((count, 3))))


def by_shoemake(change, count=20_000):
    numbers = change(np.random.default_rng(0).random((count, 3)))
    return random_matrices(shoemake_quaternion(numbers))


def twice(column, other):
    """One stream of numbers used for two of the three."""

    def change(x):
        x[:, column] = x[:, other]
        return x

    return change


def test_a_million_uniform_draws_pass():
    assert failed(rb.sample_rotation(MILLION, rng=1)) == set()
    assert failed(random_matrices(rb.sample_quaternion(MILLION, rng=1))) == set()


def test_other_uniform_samplers_pass():
    assert failed(Rotation.random(100_000, rng=3).as_matrix()) == set()
    R = np.linalg.qr(np.random.default_rng(3).normal(size=(100_000, 3, 3)))
    R = R.Q * np.sign(np.diagonal(R.R, axis1=1, axis2=2))[:, None]
    assert failed(R * np.linalg.det(R)[:, None, None]) == set()


@pytest.mark.source("errata 18")
def test_a_negated_column_is_uniform_too():
    R = rb.sample_rotation(100_000, rng=4)
    assert failed(R @ np.diag([1, -1, -1])) == set()


@pytest.mark.source("errata 17")
def test_naive_draws_fail():
    """Matrices and quaternions alike, though they take their angles the other way round."""
    for R in (
        rb.sampling.sample_rotation_naive(100_000, rng=1),
        random_matrices(rb.sampling.sample_quaternion_naive(100_000, rng=1)),
    ):
        assert failed(R, 1e-6) >= {"E tr²", "angle", "image of e₁", "image of e₃"}
        assert abs(rb.sampling.uniformity_tests(R)["E tr²"].statistic - 7 / 8) < 0.02


@pytest.mark.parametrize(
    "draw",
    [
        lambda: by_arvo(lambda x: x * [0.5, 1, 1]),
        lambda: by_arvo(lambda x: x * [1, 0.5, 1]),
        lambda: by_arvo(lambda x: x ** [1, 1, 2]),
        lambda: by_shoemake(lambda x: x * [1, 0.5, 0.5]),
        lambda: by_shoemake(lambda x: x ** [2, 1, 1]),
        *(
            partial(make, twice(i, j))
            for make in (by_arvo, by_shoemake)
            for i, j in [(0, 1), (0, 2), (1, 2)]
        ),
        lambda: np.repeat(by_arvo(lambda x: x, 10_000), 2, axis=0),
        lambda: np.tile(by_arvo(lambda x: x, 10_000), (2, 1, 1)),
        lambda: np.tile(rb.sample_rotation(rng=1), (100, 1, 1)),
    ],
    ids=[
        "Arvo, θ in [0, π)",
        "Arvo, φ in [0, π)",
        "Arvo, z without its root",
        "Shoemake, both angles in [0, π)",
        "Shoemake, s without its root",
        *(
            f"{who}, numbers {i} and {j} equal"
            for who in ("Arvo", "Shoemake")
            for i, j in ("01", "02", "12")
        ),
        "every draw twice",
        "the sample twice",
        "one draw only",
    ],
)
def test_a_deliberate_fault_is_caught(draw):
    assert failed(draw()) != set()


def test_a_z_without_its_root_in_two_places_only_is_caught():
    x1, x2, z = np.random.default_rng(0).random((3, 20_000))
    phi = 2 * np.pi * x2
    V = np.array([np.cos(phi) * z, np.sin(phi) * z, np.sqrt(1 - z)]).T
    M = np.eye(3) - 2 * np.einsum("ni,nj->nij", V, V)
    assert failed(-M @ rb.exp_so3(2 * np.pi * x1[:, None] * [0, 0, 1])) != set()


def test_one_angle_of_shoemake_over_half_the_circle_is_no_fault_of_the_rotations():
    """q and −q are one rotation, so half of the sphere of quaternions is enough."""
    assert failed(by_shoemake(lambda x: x * [1, 0.5, 1], 100_000)) == set()


def test_p_values_are_uniform_for_uniform_rotations():
    """800 samples of 500: the share below a level is the level, to five standard deviations."""
    rng = np.random.default_rng(11)
    tests = [rb.sampling.uniformity_tests(rb.sample_rotation(500, rng=rng)) for _ in range(800)]
    assert set(tests[0]) == ALL
    for name in ALL:
        p = np.array([test[name].p_value for test in tests])
        for level in (0.2, 0.5):  # the laws hold for large samples, here to a hundredth
            assert abs((p < level).mean() - level) < 5 * np.sqrt(level * (1 - level) / 800) + 0.01


def test_the_law_of_the_angle_is_the_area_of_a_cap_of_the_sphere_of_quaternions():
    for a in (0.1, 1.0, 2.5, np.pi):
        cap, _ = quad(lambda u: np.sin(u) ** 2, 0, a / 2)
        assert angle_law(a) == pytest.approx(cap / (np.pi / 4), rel=1e-12)
    assert angle_law(1e-8) == pytest.approx(1e-24 / (6 * np.pi), rel=1e-12)
    q = np.random.default_rng(5).normal(size=(20_000, 4))
    turned = 2 * np.arctan2(np.linalg.norm(q[:, 1:], axis=1), np.abs(q[:, 0]))
    assert kstest(turned, angle_law).pvalue > 1e-8
    with pytest.raises(ValueError, match=r"angle is 4.0, an angle in \[0, π\] is wanted"):
        angle_law(4)


def test_what_each_statistic_is():
    R = rb.sample_rotation(1000, rng=9)
    tests = rb.sampling.uniformity_tests(R)
    trace = np.einsum("nii", R)
    assert tests["E tr"].statistic == pytest.approx(trace.mean(), abs=1e-15)
    assert tests["E tr²"].statistic == pytest.approx((trace**2).mean(), rel=1e-14)
    angles = np.linalg.norm(rb.log_so3(R), axis=1)
    assert tests["angle"].statistic == pytest.approx(kstest(angles, angle_law).statistic, abs=1e-9)
    for name, column in (("image of e₁", 0), ("image of e₃", 2)):
        x, y, z = R[:, :, column].T
        counts, *_ = np.histogram2d(
            z, np.arctan2(y, x), bins=[4, 5], range=[[-1, 1], [-np.pi, np.pi]]
        )
        assert tests[name].statistic == pytest.approx(np.sum((counts - 50) ** 2 / 50), rel=1e-12)
    back = np.swapaxes(R, 1, 2)
    for name, turn in {
        "angle to next": back[::2] @ R[1::2],
        "angle to half": back[:500] @ R[500:],
    }.items():
        found = kstest(np.linalg.norm(rb.log_so3(turn), axis=1), angle_law)
        assert tests[name].statistic == pytest.approx(found.statistic, abs=1e-9)
        assert tests[name].p_value == pytest.approx(found.pvalue, rel=1e-6)
    deviation = abs(trace.mean()) * np.sqrt(1000)
    assert tests["E tr"].p_value == pytest.approx(2 * norm.sf(deviation), rel=1e-9)
    deviation = abs((trace**2).mean() - 1) * np.sqrt(1000 / 2)
    assert tests["E tr²"].p_value == pytest.approx(2 * norm.sf(deviation), rel=1e-9)
    nulls = [test.null for test in tests.values()]
    assert nulls[:2] == ["normal, mean 0, sd 0.032", "normal, mean 1, sd 0.045"]
    assert nulls[2:4] == ["Kolmogorov, n = 1000", "χ², 19 degrees of freedom"]
    assert nulls[5:] == ["Kolmogorov, n = 500"] * 2


def test_poles_and_the_date_line_belong_to_a_cell():
    """40 images of e₁ at each pole, and 40 on the date line: three of the 20 cells are full."""
    up, down = np.eye(3)[[2, 1, 0]], np.eye(3)[[2, 1, 0]] * [[1], [1], [-1]]
    back = np.array([[-0.8, 0, 0.6], [0, 1, 0], [0.6, 0, 0.8]])
    for sign in (0.0, -0.0):
        date_line = back.copy()
        date_line[1, 0] = sign
        R = np.array([up, down, date_line] * 40)
        expected = 6
        want = (3 * (40 - expected) ** 2 + 17 * expected**2) / expected
        found = rb.sampling.uniformity_tests(R)["image of e₁"]
        assert found.statistic == pytest.approx(want, rel=1e-12)
        assert found.null == "χ², 19 degrees of freedom"


def test_bad_arguments_are_named():
    for shape in [(99, 3, 3), (3, 3), (2, 100, 3, 3)]:
        with pytest.raises(ValueError, match=r"R: shape \(n, 3, 3\) with n >= 100 wanted, got"):
            rb.sampling.uniformity_tests(np.zeros(shape))
    with pytest.raises(ValueError, match=r"R: shape \(\.\.\., 3, 3\) wanted, got \(100, 4\)"):
        rb.sampling.uniformity_tests(np.zeros((100, 4)))
    with pytest.raises(ValueError, match=r"R\[0, 0, 0\] is nan"):
        rb.sampling.uniformity_tests(np.full((100, 3, 3), np.nan))
