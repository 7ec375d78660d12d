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
N = 40


def rotations(rng, count):
    """Random rotations, by Householder's QR."""
    Q = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    Q[..., 0] *= np.linalg.det(Q)[:, None]
    return Q


def with_singular_values(rng, d):
    """Matrices U diag(d) Vᵀ, of rotations U and V: one for each row of d, the last of any sign."""
    U, V = rotations(rng, len(d)), rotations(rng, len(d))
    return (U * d[:, None]) @ V.mT


def kinds(rng, n):
    """What there is to project, n of each kind."""
    one, s, random = np.ones(n), rng.uniform(0.05, 1, n), rng.normal(size=(n, 3, 3))
    mirrored = with_singular_values(rng, np.stack([one, rng.uniform(0.5, 1, n), -s / 4], axis=1))
    found = {
        "noisy rotations": rotations(rng, n) + 0.1 * random,
        "hardly noisy rotations": rotations(rng, n) + 1e-9 * random,
        "general": rng.normal(size=(n, 3, 3)),
        "reflected": mirrored,
        "of rank 2": with_singular_values(rng, np.stack([one, s, 0 * s], axis=1)),
        "with equal small ones": with_singular_values(rng, np.stack([one, s, s], axis=1)),
    }
    for gap in (1e-1, 1e-2, 1e-3, 1e-6):
        for name, d in {
            "both small": (1, 0.7 * gap, 0.3 * gap),
            "opposite": (1, 0.5, -0.5 + gap),
            "nearly a reflection": (1, 1, -1 + gap),
        }.items():
            found[f"{name}, gap {gap:.0e}"] = with_singular_values(rng, np.tile(d, (n, 1)))
    return found


KINDS = kinds(np.random.default_rng(1993), N)


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
def test_no_kind_of_matrix_is_projected_worse_than_by_the_svd(kind):
    M = KINDS[kind]
    want = np.array([oracles.nearest_rotation(m) for m in M])
    off, svd_off = (np.abs(R - want).max() for R in (rb.project_so(M), textbook.project_so(M)))
    assert off <= svd_off
    R, right = project(M)
    off = np.abs(R - want).max(axis=(-2, -1))[right]
    assert np.all(off <= 2 * EPS * (1 + condition(M, want)[right]))


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_right_is_a_rotation(kind):
    R, right = project(KINDS[kind])
    R = R[right]
    assert np.abs(R.mT @ R - np.eye(3)).max(initial=0) <= 8 * EPS
    assert np.all(np.linalg.det(R) > 0)


def test_what_is_far_from_singular_is_right_and_what_is_near_is_not():
    for kind in ("noisy rotations", "hardly noisy rotations"):
        assert project(KINDS[kind])[1].all()
    for kind, M in KINDS.items():
        if "gap 1e-06" in kind:
            assert not project(M)[1].any()


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
    M = rotations(np.random.default_rng(count), count)
    R, right = project(3 * M)
    assert right.shape == (count,)
    assert right.all()
    assert np.abs(R - M).max(initial=0) <= 8 * EPS


@pytest.mark.parametrize("power", [-900, -300, -1, 1, 300, 900])
def test_powers_of_two_change_no_bit(power):
    M = np.concatenate([M[:10] for M in KINDS.values()])
    (R, right), (scaled, scaled_right) = project(M), project(np.ldexp(M, power))
    assert np.array_equal(right, scaled_right)
    assert np.array_equal(R[right], scaled[right])
    assert np.array_equal(rb.project_so(M), rb.project_so(np.ldexp(M, power)))


def test_powers_of_two_change_no_bit_of_one_matrix():
    for M in KINDS["noisy rotations"][:20]:
        for power in (-900, -40, 40, 900):
            assert np.array_equal(rb.project_so(np.ldexp(M, power)), rb.project_so(M))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 0.0, 1e200, 1e-200])
@pytest.mark.parametrize("count", [5, 30])
def test_what_is_not_finite_or_zero_is_not_right_and_harms_no_other(value, count):
    M = KINDS["noisy rotations"][:count].copy()
    R, right = project(M)
    assert right.all()
    for whole in (True, False):
        broken = M.copy()
        if whole:
            broken[3] = value
        else:
            broken[3, 1, 2] = value
        S, right = project(broken)
        others = np.arange(count) != 3
        assert right[others].all()
        assert np.array_equal(S[others], R[others])
        if not np.isfinite(value) or whole:  # a matrix of equal entries has rank 1
            assert not right[3]


def test_arrays_of_any_layout_are_read_and_written():
    M = KINDS["general"]
    R, right = project(M)
    wide = np.zeros((3, N, 5, 3))
    for view in (
        np.moveaxis(wide[:, :, 2], 1, -1),
        np.moveaxis(wide[::-1, ::-1, 3], 1, -1).swapaxes(0, 1),
        np.empty((3, 3, 2 * N))[..., ::2],
        np.asfortranarray(np.empty((3, 3, N))),
    ):
        given = np.empty((6, 6, N))[::2, ::-2]
        given[...] = np.moveaxis(M, 0, -1)
        before = given.copy()
        assert np.array_equal(nearest_rotations(given, view), right)
        assert np.array_equal(np.moveaxis(view, -1, 0)[right], R[right])
        assert np.array_equal(given, before)
    assert np.count_nonzero(wide[:, :, [0, 1, 4]]) == 0


def test_two_threads_at_once_do_not_disturb_each_other():
    stacks = np.random.default_rng(2).normal(size=(2, 3 * BLOCK, 3, 3))
    wants = [rb.project_so(M) for M in stacks]
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


def test_what_comes_back_is_not_the_workspace():
    M, other = KINDS["noisy rotations"], KINDS["general"]
    R = rb.project_so(M)
    kept = R.copy()
    rb.project_so(other)
    assert np.array_equal(R, kept)
