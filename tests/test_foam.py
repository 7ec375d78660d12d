"""Markley's FOAM: against 60 digits, against the SVD, and one block against several."""

import threading

import numpy as np
import oracles
import pytest

import rbcourse as rb
from rbcourse import textbook
from rbcourse._foam import nearest_rotations
from rbcourse.projection import MANY

EPS = np.finfo(float).eps
BLOCK = 5128


def with_singular_values(rng, d):
    """Matrices U diag(d) Vᵀ, of rotations U and V: one for each row of d, the last of any sign."""
    U, V = rb.sample_rotation((2, len(d)), rng=rng)
    return (U * d[:, None]) @ V.mT


def kinds(rng, n=40):
    """Matrices to project, n of each kind."""
    one, s, random = np.ones(n), rng.uniform(0.05, 1, n), rng.normal(size=(n, 3, 3))
    found = {
        "noisy rotations": rb.sample_rotation(n, rng=rng) + 0.1 * random,
        "hardly noisy rotations": rb.sample_rotation(n, rng=rng) + 1e-9 * random,
        "general": rng.normal(size=(n, 3, 3)),
    }
    singular_values = {
        "reflected": (one, rng.uniform(0.5, 1, n), -s / 4),
        "of rank 2": (one, s, 0 * s),
        "with equal small ones": (one, s, s),
    }
    for gap in (1e-1, 1e-2, 1e-3, 1e-6):
        singular_values |= {
            f"both small, gap {gap:.0e}": (one, 0.7 * gap * one, 0.3 * gap * one),
            f"opposite, gap {gap:.0e}": (one, 0.5 * one, (gap - 0.5) * one),
            f"nearly a reflection, gap {gap:.0e}": (one, one, (gap - 1) * one),
        }
    for name, d in singular_values.items():
        found[name] = with_singular_values(rng, np.stack(d, axis=1))
    return found


KINDS = kinds(np.random.default_rng(1993))


def project(M):
    """Return R and what is right of `nearest_rotations`, for matrices (N, 3, 3)."""
    R = np.full(M.shape, np.nan)
    right = nearest_rotations(M.transpose(1, 2, 0), R.transpose(1, 2, 0))
    return R, right


def condition(M, R):
    """‖M‖ over the sum of the two smallest eigenvalues of RᵀM: what rounding grows by."""
    return np.linalg.norm(M, axis=(-2, -1)) / oracles.two_smallest_eigenvalues(R.mT @ M)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.source("BK Prop. 2")
def test_projections_are_rotations_and_not_worse_than_by_the_svd(kind):
    M = KINDS[kind]
    want = np.array([oracles.nearest_rotation(m) for m in M])
    off, svd_off = (np.abs(R - want).max() for R in (rb.project_so(M), textbook.project_so(M)))
    assert off <= svd_off
    R, right = project(M)
    R, bound = R[right], 2 * EPS * (1 + condition(M, want)[right, None, None])
    assert np.all(np.abs(R - want[right]) <= bound)
    assert np.abs(R.mT @ R - np.eye(3)).max(initial=0) <= 8 * EPS
    assert np.all(np.linalg.det(R) > 0)


def test_matrices_far_from_the_singular_set_are_right_and_near_ones_are_not():
    for kind, M in KINDS.items():
        if "noisy" in kind or "1e-06" in kind:
            assert np.all(project(M)[1] == ("noisy" in kind))


@pytest.mark.source("BK Prop. 2")
def test_a_matrix_gets_what_it_gets_alone_by_the_svd():
    """Of three blocks, the last one not full."""
    M = np.random.default_rng(5).normal(size=(2 * BLOCK + 7, 3, 3))
    R, right = project(M)
    assert 0.9 < right.mean() < 1
    many = rb.project_so(M)
    for k in range(0, len(M), 50):
        alone = rb.project_so(M[k])
        assert np.abs(alone - many[k]).max() <= 8 * EPS * (1 + condition(M[k], alone))
    far = condition(M[right], R[right]) < 100
    alone = textbook.project_so(M[right])
    assert np.abs(alone - R[right])[far].max() <= 64 * EPS * 100


@pytest.mark.parametrize(
    "count", [0, 1, MANY - 1, MANY, BLOCK - 1, BLOCK, BLOCK + 1, 2 * BLOCK + 1]
)
def test_every_matrix_of_a_stack_is_projected(count):
    M = rb.sample_rotation(count, rng=count)
    R, right = project(3 * M)
    assert right.shape == (count,)
    assert right.all()
    assert np.abs(R - M).max(initial=0) <= 8 * EPS


@pytest.mark.parametrize("power", [-900, -300, -40, -1, 1, 40, 300, 900])
def test_powers_of_two_change_no_bit(power):
    M = np.concatenate([M[:10] for M in KINDS.values()])
    (R, right), (scaled, scaled_right) = project(M), project(np.ldexp(M, power))
    assert np.array_equal(right, scaled_right)
    assert np.array_equal(R[right], scaled[right])
    for some in (M, *KINDS["noisy rotations"][:20]):
        assert np.array_equal(rb.project_so(some), rb.project_so(np.ldexp(some, power)))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 0.0, 1e200, 1e-200])
@pytest.mark.parametrize("count", [5, 30])
@pytest.mark.parametrize("entries", [3, (3, 1, 2)])
def test_a_matrix_that_is_not_finite_or_of_equal_entries_is_not_right(value, count, entries):
    M = KINDS["noisy rotations"][:count].copy()
    R, right = project(M)
    assert right.all()
    M[entries] = value
    S, right = project(M)
    others = np.arange(count) != 3
    assert right[others].all()
    assert np.array_equal(S[others], R[others])
    if not np.isfinite(value) or entries == 3:  # of rank 1
        assert not right[3]


def test_two_threads_at_once_do_not_disturb_each_other():
    stacks = np.random.default_rng(2).normal(size=(2, 3 * BLOCK, 3, 3))
    wants = [rb.project_so(M) for M in stacks]
    assert not np.shares_memory(*wants)
    started, same = threading.Barrier(2), [[], []]

    def work(k):
        started.wait()
        same[k] += [np.array_equal(rb.project_so(stacks[k]), wants[k]) for _ in range(20)]

    threads = [threading.Thread(target=work, args=(k,)) for k in (0, 1)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert same == [[True] * 20] * 2
