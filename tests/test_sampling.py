"""Samplers: members of the group, the same draws from the same seed, and their twins."""

import os
import subprocess
import sys

import numpy as np
import pytest

import rbcourse as rb
from rbcourse.sampling import arvo_rotation, shoemake_quaternion

EPS = np.finfo(float).eps
SAMPLERS = [
    rb.sample_rotation,
    rb.sampling.sample_rotation_naive,
    rb.sample_quaternion,
    rb.sampling.sample_quaternion_naive,
]
_SHARES = [0, 6e-7, 0.25, 0.5, 0.75, 1 - 6e-7, 1 - 2.0**-53]
CORNERS = np.array(np.meshgrid(*3 * [_SHARES])).reshape(3, -1).T


class Given(np.random.Generator):
    """A generator that hands out given numbers."""

    def __init__(self, numbers):
        super().__init__(np.random.PCG64(0))
        self.numbers = np.asarray(numbers).reshape(-1, 3)

    def random(self, size=None):
        taken, self.numbers = np.split(self.numbers, [int(np.prod(size)) // 3])
        return taken.reshape(size)


def core(sampler):
    return (3, 3) if "rotation" in sampler.__name__ else (4,)


@pytest.mark.source("RR 2.1", "RR 2.2", "RR (7)", "RR (8)", "RR (9)", "RR (13)")
@pytest.mark.parametrize("sampler", SAMPLERS)
def test_draws_are_members(sampler):
    draws = sampler(20_000, rng=1)
    if core(sampler) == (4,):
        assert np.abs(np.linalg.norm(draws, axis=-1) - 1).max() < 4 * EPS
    else:
        assert np.abs(draws.mT @ draws - np.eye(3)).max() < 8 * EPS
        assert np.abs(np.linalg.det(draws) - 1).max() < 8 * EPS


@pytest.mark.parametrize("sampler", SAMPLERS)
def test_sizes_are_numbers_or_shapes_and_the_global_state_is_left_alone(sampler):
    before = np.random.get_state()  # noqa: NPY002
    assert sampler().shape == sampler(rng=3).shape == core(sampler)
    for size in (7, np.int64(7), (2, 3), [2, 3], 0, (2, 0), ()):
        leading = (size,) if np.ndim(size) == 0 else tuple(size)
        assert sampler(size).shape == (*leading, *core(sampler))
    after = np.random.get_state()  # noqa: NPY002
    assert all(np.array_equal(a, b) for a, b in zip(before, after, strict=True))


@pytest.mark.parametrize("sampler", SAMPLERS)
def test_the_same_seed_gives_the_same_draws_in_any_portions(sampler):
    many = sampler((3, 7001), rng=5)
    assert np.array_equal(sampler((3, 7001), rng=5), many)
    assert np.array_equal(sampler((3, 7001), rng=np.random.default_rng(5)), many)
    one_by_one = np.random.default_rng(5)
    for want in many.reshape(-1, *core(sampler))[:20]:
        assert np.abs(sampler(rng=one_by_one) - want).max() < 4 * EPS
    assert not np.array_equal(sampler(3, rng=6), many[0, :3])
    generator = np.random.default_rng(5)
    assert not np.array_equal(sampler(3, rng=generator), sampler(3, rng=generator))
    assert not np.array_equal(sampler(3), sampler(3))


@pytest.mark.source("RR (9)", "RR (10)", "RR (11)", "RR (13)")
@pytest.mark.parametrize(
    ("sampler", "textbook"),
    [(rb.sample_rotation, arvo_rotation), (rb.sample_quaternion, shoemake_quaternion)],
)
def test_the_fast_draws_are_those_of_the_textbook(sampler, textbook):
    want = textbook(np.random.default_rng(5).random((200_000, 3)))
    assert np.abs(sampler(200_000, rng=5) - want).max() < 16 * EPS
    assert np.abs(sampler(len(CORNERS), rng=Given(CORNERS)) - textbook(CORNERS)).max() < 8 * EPS


@pytest.mark.source("RR (9)", "RR (10)", "RR (11)", "errata 18")
def test_the_printed_matrix_is_a_reflection_always_and_its_negative_a_rotation():
    x = np.random.default_rng(2).random((500, 3))
    theta, phi, z = x.T * [[2 * np.pi], [2 * np.pi], [1]]
    V = np.array([np.cos(phi) * np.sqrt(z), np.sin(phi) * np.sqrt(z), np.sqrt(1 - z)]).T
    M = np.eye(3) - 2 * np.einsum("ni,nj->nij", V, V)
    B = rb.exp_so3(theta[:, None] * [0, 0, 1])
    assert np.abs(np.linalg.det(M @ B) + 1).max() < 16 * EPS
    R = arvo_rotation(x)
    assert np.abs(R + M @ B).max() < 8 * EPS
    negated = M @ B @ np.diag([-1, 1, 1])
    assert np.abs(negated - R @ np.diag([1, -1, -1])).max() < 8 * EPS


@pytest.mark.source("RR (12)", "RR (13)")
def test_the_printed_quaternion():
    x = np.random.default_rng(2).random((500, 3))
    s, x1, x2 = x.T
    t1, t2 = 2 * np.pi * x1, 2 * np.pi * x2
    inner, outer = np.sqrt(1 - s), np.sqrt(s)
    printed = [np.cos(t2) * outer, np.sin(t1) * inner, np.cos(t1) * inner, np.sin(t2) * outer]
    assert np.abs(shoemake_quaternion(x) - np.transpose(printed)).max() < 2 * EPS


@pytest.mark.source("RR 2.1", "RR 2.2", "errata 17")
def test_the_naive_ones_turn_by_their_angles_in_the_printed_order():
    angles = 2 * np.pi * np.random.default_rng(4).random((50, 3))
    x, y, z = np.eye(3)
    first, second, third = angles.T[..., None]
    R = rb.exp_so3(first * z) @ rb.exp_so3(second * y) @ rb.exp_so3(third * x)
    assert np.abs(rb.sampling.sample_rotation_naive(50, rng=4) - R).max() < 4 * EPS
    R = rb.exp_so3(third * z) @ rb.exp_so3(second * y) @ rb.exp_so3(first * x)
    q = rb.sampling.sample_quaternion_naive(50, rng=4)
    assert np.abs(rb.matrix_from_quaternion(q) - R).max() < 8 * EPS


@pytest.mark.parametrize("textbook", [arvo_rotation, shoemake_quaternion])
def test_numbers_outside_the_unit_interval_are_refused(textbook):
    assert len(textbook([[0, 0, 0], [1, 1, 1]])) == 2
    for wrong in (1.5, -0.1):
        with pytest.raises(ValueError, match=rf"x\[1\] is {wrong}, a number in \[0, 1\]"):
            textbook([0, wrong, 0])


@pytest.mark.parametrize("sampler", SAMPLERS)
def test_bad_sizes_and_seeds_are_refused(sampler):
    for size in (-1, (2, -3), 2.5, "2", (2, 1.5), {}, b"ab", True, (2, True)):
        with pytest.raises(ValueError, match=r"^size: "):
            sampler(size)
    for rng in (-1, 0.5, "seed", object()):
        with pytest.raises(ValueError, match=r"^rng: a Generator, a seed or None wanted"):
            sampler(rng=rng)


def test_other_processors_draw_the_same_to_rounding():
    """NumPy told to do without the instructions that make its tangent fast."""
    code = "import rbcourse as rb; print(*map(float, rb.sample_rotation(300, rng=8).ravel()))"
    slow = os.environ | {"NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR"}
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code], capture_output=True, text=True, env=slow
    )
    drawn = np.array(done.stdout.split(), dtype=float).reshape(300, 3, 3)
    assert np.abs(drawn - rb.sample_rotation(300, rng=8)).max() < 8 * EPS
