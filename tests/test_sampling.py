import os
import subprocess
import sys

import mpmath as mp
import numpy as np
import oracles
import pytest
from scipy.integrate import quad
from scipy.spatial.transform import Rotation
from scipy.stats import chi2, kstest, norm

import rbcourse as rb
from rbcourse import textbook
from rbcourse.sampling import angle_law, arvo_rotation, shoemake_quaternion, uniformity_tests

EPS = np.finfo(float).eps
NAIVE = rb.sampling.sample_rotation_naive, rb.sampling.sample_quaternion_naive
SAMPLERS = rb.sample_rotation, rb.sample_quaternion, *NAIVE
SHARES = [0, 6e-7, 0.25, 0.5, 0.75, 1 - 6e-7, 1 - 2.0**-53]
CORNERS = np.array(np.meshgrid(*3 * [SHARES])).reshape(3, -1).T


@pytest.mark.parametrize("sampler", SAMPLERS)
@pytest.mark.source("RR 2.1", "RR 2.2", "RR (7)", "RR (8)", "RR (9)", "RR (13)")
def test_draws_of_any_shape_are_rotations(sampler):
    before, core = np.random.get_state(), sampler(rng=3).shape  # noqa: NPY002
    draws = sampler(20_000, rng=1)
    defect = draws.mT @ draws - np.eye(3) if core == (3, 3) else np.linalg.norm(draws, axis=-1) - 1
    assert np.abs(defect).max() < 8 * EPS
    assert core == (4,) or np.linalg.det(draws).min() > 0
    assert sampler().shape == core
    for size in (7, np.int64(7), (2, 3), [2, 3], 0, (2, 0), ()):
        leading = (size,) if np.ndim(size) == 0 else tuple(size)
        assert sampler(size).shape == (*leading, *core)
    assert np.array_equal(sampler((4, 5000), rng=1).reshape(draws.shape), draws)
    one_by_one = np.random.default_rng(1)
    assert np.abs([sampler(rng=one_by_one) for _ in range(20)] - draws[:20]).max() < 4 * EPS
    assert not np.array_equal(sampler(3), sampler(3))
    after = np.random.get_state()  # noqa: NPY002
    assert all(np.array_equal(a, b) for a, b in zip(before, after, strict=True))


@pytest.mark.source("RR 2.1", "RR (9)", "RR (10)", "RR (11)", "RR 2.2", "RR (13)")
@pytest.mark.parametrize("name", ["sample_rotation", "sample_quaternion"])
def test_fast_draws_equal_the_draws_of_the_textbook(name):
    """The generator ends in the same state as the textbook's, after one block or several."""

    class Given(np.random.Generator):
        def random(self, size):
            return CORNERS.reshape(size)

    fast, slow, given = getattr(rb, name), getattr(textbook, name), Given(np.random.PCG64())
    assert np.abs(fast(len(CORNERS), rng=given) - slow(len(CORNERS), given)).max() < 8 * EPS
    for count in (0, 1, 7, 5000, 5001, 20_000):
        rng, other = np.random.default_rng(21), np.random.default_rng(21)
        draws, want = fast(count, rng=rng), slow(count, other)
        assert draws.shape == want.shape
        assert np.abs(draws - want).max(initial=0) < 8 * EPS
        assert rng.random() == other.random()


@pytest.mark.source("RR (9)", "RR (10)", "RR (11)", "errata 18")
def test_the_printed_matrix_is_always_a_reflection():
    x = np.random.default_rng(2).random((500, 3))
    theta, phi, z = x.T * [[2 * np.pi], [2 * np.pi], [1]]
    V = np.array([np.cos(phi) * np.sqrt(z), np.sin(phi) * np.sqrt(z), np.sqrt(1 - z)]).T
    M = np.eye(3) - 2 * np.einsum("ni,nj->nij", V, V)
    B = rb.exp_so3(theta[:, None] * [0, 0, 1])
    assert np.abs(np.linalg.det(M @ B) + 1).max() < 16 * EPS
    R = arvo_rotation(x)
    assert np.abs(R + M @ B).max() < 8 * EPS
    assert np.abs(M @ B @ np.diag([-1, 1, 1]) - R @ np.diag([1, -1, -1])).max() < 8 * EPS


@pytest.mark.source("RR 2.1", "RR 2.2", "RR (12)", "RR (13)", "errata 17")
def test_quaternions_agree_with_the_report():
    s, x1, x2 = (x := np.random.default_rng(4).random((50, 3))).T
    t1, t2, inner, outer = 2 * np.pi * x1, 2 * np.pi * x2, np.sqrt(1 - s), np.sqrt(s)
    printed = [np.cos(t2) * outer, np.sin(t1) * inner, np.cos(t1) * inner, np.sin(t2) * outer]
    assert np.abs(shoemake_quaternion(x) - np.transpose(printed)).max() < 2 * EPS
    (ca, cb, cc), (sa, sb, sc) = np.cos(np.pi * x.T), np.sin(np.pi * x.T)
    w, x = ca * cb * cc + sa * sb * sc, sa * cb * cc - ca * sb * sc
    y, z = ca * sb * cc + sa * cb * sc, ca * cb * sc - sa * sb * cc
    printed = np.transpose([w, x, y, z])
    R, q = (sampler(50, rng=4) for sampler in NAIVE)
    assert oracles.between_rotations(q, printed).max() < 4 * EPS
    assert oracles.between_rotations(rb.quaternion_from_matrix(R), printed).min() > 1e-3
    turns = 2 * np.pi * np.stack([s, x1, x2])[:, :, None] * np.eye(3)[::-1, None]
    first, second, third = rb.exp_so3(turns)  # these turns are about z, y and x
    assert np.abs(R - first @ second @ third).max() < 4 * EPS


def test_bad_arguments_are_refused():
    sizes = -1, (2, -3), 2.5, "2", (2, 1.5), {}, b"ab", True, (2, True)
    bad = [(sampler, {"size": size}, "size: ") for sampler in SAMPLERS for size in sizes]
    seeds, wanted = (-1, 0.5, "seed", object()), "rng: a Generator, a seed or None is wanted"
    bad += [(sampler, {"rng": seed}, wanted) for sampler in SAMPLERS for seed in seeds]
    for draw in (arvo_rotation, shoemake_quaternion):
        bad += [(draw, {"x": [0, x, 0]}, rf"x\[1\] is {x}, a number in") for x in (1.5, -0.1)]
    for shape in [(99, 3, 3), (3, 3), (2, 100, 3, 3), (100, 4)]:
        message = r"R: shape \((n|\.\.\.), 3, 3\) .*wanted, got"
        R = np.broadcast_to(np.eye(3), shape) if shape[-1] == 3 else np.zeros(shape)
        bad += [(uniformity_tests, {"R": R}, message)]
    bad += [(angle_law, {"angle": 4}, r"angle is 4.0, an angle in \[0, π\] is wanted")]
    for function, arguments, message in bad:
        with pytest.raises(ValueError, match=f"^{message}"):
            function(**arguments)


def test_other_processors_give_the_same_samples_up_to_rounding():
    """In this test, NumPy does not use the instructions that make its tangent fast."""
    code = "import rbcourse as rb; print(*map(float, rb.sample_rotation(300, rng=8).ravel()))"
    slow = os.environ | {"NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR"}
    words = [sys.executable, "-W", "ignore", "-c", code]
    printed = subprocess.check_output(words, text=True, env=slow)
    drawn = np.array(printed.split(), dtype=float).reshape(300, 3, 3)
    assert np.abs(drawn - rb.sample_rotation(300, rng=8)).max() < 8 * EPS


def failed(R, level=1e-8):
    """Return the names of the statistics with a p-value below the level."""
    return {name for name, test in uniformity_tests(R).items() if test.p_value < level}


def by_shoemake(x):
    return rb.matrix_from_quaternion(shoemake_quaternion(x))


@pytest.mark.source("errata 18")
def test_uniform_rotations_pass_the_tests():
    """Rotations by SciPy, with negated columns, or from half of the quaternions pass, too."""
    count, rng = 50_000, np.random.default_rng(3)
    ours = rb.sample_rotation(4 * count, rng=1)
    for R in (
        ours,
        rb.matrix_from_quaternion(rb.sample_quaternion(4 * count, rng=1)),
        Rotation.random(count, 3).as_matrix(),
        ours[:count] @ np.diag([1, -1, -1]),
        # half of the quaternions suffice, since q and −q are one rotation
        by_shoemake(rng.random((count, 3)) * [1, 0.5, 1]),
    ):
        assert failed(R) == set()
    trace = np.einsum("nii", ours)
    for power, mean, variance in ((1, 0, 1), (2, 1, 2), (4, 3, 82)):
        assert abs((trace**power).mean() - mean) < 5 * np.sqrt(variance / len(trace))


@pytest.mark.source("errata 17")
def test_deliberate_errors_are_detected():
    """The deliberate errors are an angle in [0, π), a missing root, one stream for two numbers, and
    repeated draws."""
    naive, q = (sampler(40_000, rng=1) for sampler in NAIVE)
    for R in (naive, rb.matrix_from_quaternion(q)):
        assert failed(R, 1e-6) >= {"E tr²", "angle", "image of e₁", "image of e₃"}
        assert abs(uniformity_tests(R)["E tr²"].statistic - 7 / 8) < 0.02
    x, R = np.random.default_rng(0).random((20_000, 3)), rb.sample_rotation(10_000, rng=0)
    streams = [x[:, numbers] for numbers in ([1, 1, 2], [2, 1, 2], [0, 2, 2])]
    arvo = x * [0.5, 1, 1], x * [1, 0.5, 1], x ** [1, 1, 2], *streams
    shoemake = x * [1, 0.5, 0.5], x ** [2, 1, 1], *streams
    repeated = np.repeat(R, 2, axis=0), np.tile(R, (2, 1, 1)), np.tile(R[0], (100, 1, 1))
    for k, R in enumerate([*map(arvo_rotation, arvo), *map(by_shoemake, shoemake), *repeated]):
        assert failed(R) != set(), k


def test_the_angle_is_distributed_as_the_area_of_spherical_caps():
    """The distribution function is (a − sin a)/π. The relative error of this formula is a few
    eps/a²; for tiny a, it is the error of the approximation a³/(6π)."""
    for a in (0.1, 1.0, 2.5, np.pi):
        cap, _ = quad(lambda u: np.sin(u) ** 2, 0, a / 2)
        assert angle_law(a) == pytest.approx(cap / (np.pi / 4), rel=1e-12)
    for a in (0, 1e-160, 1e-9, 9.99e-5, 1e-4, 1.01e-4, 5e-4, 1e-3, 9e-3, 0.01, 0.9, 2.0, 3.1):
        with mp.workdps(400):
            want = (mp.mpf(a) - mp.sin(a)) / mp.pi
            assert abs(angle_law(a) - want) <= EPS * (4 * want + a)
    assert angle_law(1e-8) == pytest.approx(1e-24 / (6 * np.pi), rel=1e-12)


def test_the_statistics_agree_with_scipy():
    R = rb.sample_rotation(1000, rng=9)
    tests, trace, back = uniformity_tests(R), np.einsum("nii", R), R.mT
    for name, values, mean, variance in (("E tr", trace, 0, 1), ("E tr²", trace**2, 1, 2)):
        assert tests[name].statistic == pytest.approx(values.mean(), rel=1e-14, abs=1e-15)
        deviation = abs(values.mean() - mean) * np.sqrt(1000 / variance)
        assert tests[name].p_value == pytest.approx(2 * norm.sf(deviation), rel=1e-9)
    sphere = {"bins": [4, 5], "range": [[-1, 1], [-np.pi, np.pi]]}
    for name, column in (("image of e₁", 0), ("image of e₃", 2)):
        x, y, z = R[:, :, column].T
        counts, *_ = np.histogram2d(z, np.arctan2(y, x), **sphere)
        assert tests[name].statistic == pytest.approx(np.sum((counts - 50) ** 2 / 50), rel=1e-12)
        assert tests[name].p_value == pytest.approx(chi2.sf(tests[name].statistic, 19), rel=1e-9)
    turns = {"": R, " to next": back[::2] @ R[1::2], " to half": back[:500] @ R[500:]}
    for name, turn in turns.items():
        found, test = kstest(rb.angle_between(np.eye(3), turn), angle_law), tests[f"angle{name}"]
        assert test.statistic == pytest.approx(found.statistic, abs=1e-9)
        assert test.p_value == pytest.approx(found.pvalue, rel=1e-6)
    nulls = [test.null for test in tests.values()]
    assert nulls[1:3] == ["normal, mean 1, sd 0.045", "Kolmogorov, n = 1000"]
    assert nulls[4:6] == ["χ², 19 degrees of freedom", "Kolmogorov, n = 500"]
    # 40 images of e₁ are at each pole and 40 on the date line, so three of the 20 cells are full.
    up, down = [[0, 0, 1], [0, -1, 0], [1, 0, 0]], [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    for sign in (0.0, -0.0):
        date_line = [[-0.8, 0, 0.6], [sign, -1, 0], [0.6, 0, 0.8]]
        found = uniformity_tests([up, down, date_line] * 40)["image of e₁"]
        assert found.statistic == pytest.approx((3 * (40 - 6) ** 2 + 17 * 6**2) / 6, rel=1e-12)
