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

ALL = {"E tr", "E tr²", "angle", "image of e₁", "image of e₃", "angle to next", "angle to half"}


def failed(R, level=1e-8):
    """The statistics that say no."""
    return {name for name, test in rb.sampling.uniformity_tests(R).items() if test.p_value < level}


def by_arvo(change, count=20_000):
    return arvo_rotation(change(np.random.default_rng(0).random((count, 3))))


def by_shoemake(change, count=20_000):
    numbers = change(np.random.default_rng(0).random((count, 3)))
    return rb.matrix_from_quaternion(shoemake_quaternion(numbers))


def by_gram_schmidt(count):
    R = np.linalg.qr(np.random.default_rng(3).normal(size=(count, 3, 3)))
    R = R.Q * np.sign(np.diagonal(R.R, axis1=1, axis2=2))[:, None]
    return R * np.linalg.det(R)[:, None, None]


@pytest.mark.source("errata 18")
@pytest.mark.parametrize(
    "draw",
    [
        lambda: rb.sample_rotation(1_000_000, rng=1),
        lambda: rb.matrix_from_quaternion(rb.sample_quaternion(1_000_000, rng=1)),
        lambda: Rotation.random(100_000, rng=3).as_matrix(),
        lambda: by_gram_schmidt(100_000),
        lambda: rb.sample_rotation(100_000, rng=4) @ np.diag([1, -1, -1]),
        lambda: by_shoemake(lambda x: x * [1, 0.5, 1], 100_000),  # q and −q are one rotation
    ],
    ids=["ours", "quaternions", "SciPy", "Gram, Schmidt", "column negated", "half the quaternions"],
)
def test_uniform_rotations_pass(draw):
    assert failed(draw()) == set()


@pytest.mark.source("errata 17")
def test_naive_draws_fail():
    """Matrices and quaternions alike, though they take their angles the other way round."""
    q = rb.sampling.sample_quaternion_naive(100_000, rng=1)
    R = rb.sampling.sample_rotation_naive(100_000, rng=1)
    for naive in (R, rb.matrix_from_quaternion(q)):
        assert failed(naive, 1e-6) >= {"E tr²", "angle", "image of e₁", "image of e₃"}
        assert abs(rb.sampling.uniformity_tests(naive)["E tr²"].statistic - 7 / 8) < 0.02


FAULTS = {
    "Arvo, θ in [0, π)": lambda: by_arvo(lambda x: x * [0.5, 1, 1]),
    "Arvo, φ in [0, π)": lambda: by_arvo(lambda x: x * [1, 0.5, 1]),
    "Arvo, z without its root": lambda: by_arvo(lambda x: x ** [1, 1, 2]),
    "Shoemake, both angles in [0, π)": lambda: by_shoemake(lambda x: x * [1, 0.5, 0.5]),
    "Shoemake, s without its root": lambda: by_shoemake(lambda x: x ** [2, 1, 1]),
    "every draw twice": lambda: np.repeat(rb.sample_rotation(10_000, rng=0), 2, axis=0),
    "the sample twice": lambda: np.tile(rb.sample_rotation(10_000, rng=0), (2, 1, 1)),
    "one draw only": lambda: np.tile(rb.sample_rotation(rng=1), (100, 1, 1)),
}
for numbers in ([1, 1, 2], [2, 1, 2], [0, 2, 2]):  # one stream used for two of the three
    for draw in (by_arvo, by_shoemake):
        FAULTS[f"{draw.__name__}, numbers {numbers}"] = partial(
            draw, lambda x, numbers=numbers: x[:, numbers]
        )


@pytest.mark.parametrize("fault", FAULTS)
def test_a_deliberate_fault_is_caught(fault):
    assert failed(FAULTS[fault]()) != set()


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
    with pytest.raises(ValueError, match=r"angle is 4.0, an angle in \[0, π\] is wanted"):
        angle_law(4)


def test_the_statistics_are_those_of_scipy():
    R = rb.sample_rotation(1000, rng=9)
    tests = rb.sampling.uniformity_tests(R)
    trace, back = np.einsum("nii", R), R.mT
    for name, values, mean, variance in (("E tr", trace, 0, 1), ("E tr²", trace**2, 1, 2)):
        assert tests[name].statistic == pytest.approx(values.mean(), rel=1e-14, abs=1e-15)
        deviation = abs(values.mean() - mean) * np.sqrt(1000 / variance)
        assert tests[name].p_value == pytest.approx(2 * norm.sf(deviation), rel=1e-9)
    sphere = {"bins": [4, 5], "range": [[-1, 1], [-np.pi, np.pi]]}
    for name, column in (("image of e₁", 0), ("image of e₃", 2)):
        x, y, z = R[:, :, column].T
        counts, *_ = np.histogram2d(z, np.arctan2(y, x), **sphere)
        assert tests[name].statistic == pytest.approx(np.sum((counts - 50) ** 2 / 50), rel=1e-12)
    turns = {"": R, " to next": back[::2] @ R[1::2], " to half": back[:500] @ R[500:]}
    for name, turn in turns.items():
        found, test = kstest(rb.angle_between(np.eye(3), turn), angle_law), tests[f"angle{name}"]
        assert test.statistic == pytest.approx(found.statistic, abs=1e-9)
        assert test.p_value == pytest.approx(found.pvalue, rel=1e-6)
    nulls = [test.null for test in tests.values()]
    assert nulls[:2] == ["normal, mean 0, sd 0.032", "normal, mean 1, sd 0.045"]
    assert nulls[2:4] == ["Kolmogorov, n = 1000", "χ², 19 degrees of freedom"]
    assert nulls[5:] == ["Kolmogorov, n = 500"] * 2


def test_poles_and_the_date_line_belong_to_a_cell():
    """40 images of e₁ at each pole, and 40 on the date line: three of the 20 cells are full."""
    up, down = np.eye(3)[[2, 1, 0]], np.eye(3)[[2, 1, 0]] * [[1], [1], [-1]]
    for sign in (0.0, -0.0):
        date_line = [[-0.8, 0, 0.6], [sign, 1, 0], [0.6, 0, 0.8]]
        found = rb.sampling.uniformity_tests([up, down, date_line] * 40)["image of e₁"]
        assert found.statistic == pytest.approx((3 * (40 - 6) ** 2 + 17 * 6**2) / 6, rel=1e-12)
        assert found.null == "χ², 19 degrees of freedom"


def test_bad_arguments_are_named():
    for shape in [(99, 3, 3), (3, 3), (2, 100, 3, 3), (100, 4)]:
        with pytest.raises(ValueError, match=r"^R: shape \((n|\.\.\.), 3, 3\) .*wanted, got"):
            rb.sampling.uniformity_tests(np.zeros(shape))
    with pytest.raises(ValueError, match=r"^R\[0, 0, 0\] is nan"):
        rb.sampling.uniformity_tests(np.full((100, 3, 3), np.nan))
