from concurrent.futures import ThreadPoolExecutor

import awkward
import numpy as np
import oracles
import pytest

import rbcourse as rb
from rbcourse import _foam, textbook
from rbcourse._foam import TOGETHER, nearest_rotations

EPS = np.finfo(float).eps
DIMENSIONS = [1, 2, 3, 4, 7]


def members(n, rng, count=40):
    """Return random rotations of Rⁿ, by Householder's QR."""
    Q = np.linalg.qr(rng.normal(size=(count, n, n)))[0]
    Q[..., 0] *= np.linalg.det(Q)[:, None]
    return Q


def assert_members(R):
    n = R.shape[-1]
    assert np.abs(R.mT @ R - np.eye(n)).max(initial=0) < 8 * n * EPS
    assert np.all(np.linalg.det(R) > 0)


def assert_nearest(R, M, W=None):
    """Check that R is the nearest rotation: RᵀM, or RᵀMW, is symmetric, and its two smallest
    eigenvalues sum to 0 or more."""
    S, n = R.mT @ M, M.shape[-1]
    bound = 8 * n * EPS * np.linalg.norm(M, axis=(-2, -1))
    if W is not None:
        # the product M W is already rounded
        S, bound = S @ W, 2 * bound * np.linalg.norm(W, axis=(-2, -1))
    assert np.all(np.linalg.norm(S - S.mT, axis=(-2, -1)) <= bound)
    if n > 1:
        assert np.all(oracles.two_smallest_eigenvalues(S) >= -bound)


def condition(M, R):
    """Return the factor that amplifies rounding: ‖M‖ divided by the sum of the two smallest
    eigenvalues of RᵀM."""
    return np.linalg.norm(M, axis=(-2, -1)) / oracles.two_smallest_eigenvalues(R.mT @ M)


@pytest.mark.parametrize("n", DIMENSIONS)
@pytest.mark.source("BK Prop. 2", "BK Remark 6", "RR 1.4", "RR (4)", "RR (5)")
def test_the_projection_is_the_nearest_rotation(n):
    rng = np.random.default_rng(n)
    M, others = awkward.matrices(n, rng), members(n, rng)
    R = rb.project_so(M)
    assert_members(R)
    assert_nearest(R, M)
    best = np.hypot.reduce(np.abs(M - R), axis=(-2, -1))
    away = np.linalg.norm(M - others[:, None], axis=(-2, -1))
    assert np.all(best <= away + 4 * n * EPS * (1 + best))
    assert np.all(np.abs(rb.distance_to_so(M) - best) <= 20 * n * EPS * (1 + best))
    assert rb.distance_to_so(1e200 * np.eye(n)) == pytest.approx(np.sqrt(n) * 1e200)
    assert np.abs(rb.project_so(others) - others).max() < 8 * n * EPS
    if n > 1:
        M, R, others = M[:40], R[:40], textbook.project_so(M[:40])
        bound = 8 * n * EPS * (1 + condition(M, others))
        assert np.all(np.abs(R - others).max(axis=(-2, -1)) < bound)


@pytest.mark.source("BK Prop. 2", "BK Remark 6", "errata 2", "errata 3")
def test_the_printed_projection_lacks_the_sign():
    for M, distance in ((np.diag([3.0, 1, 1]), 2), (np.diag([3.0, 2, -1]), 3)):
        U, d, Vt = np.linalg.svd(M)
        assert np.linalg.det(U @ Vt) * np.linalg.det(M) > 0
        assert np.array_equal(rb.project_so(M), np.eye(3))
        others = np.linalg.norm(M - members(3, np.random.default_rng(6)), axis=(-2, -1))
        assert others.min() >= distance == pytest.approx(rb.distance_to_so(M), abs=8 * EPS)
        assert abs(((d - 1) ** 2).sum() - distance) > 1


@pytest.mark.source("BK Prop. 3", "BK 4")
def test_projections_are_invariant():
    """The weighted projection is invariant on both sides if the weight is turned, too. Gram–Schmidt
    is invariant only on the left."""
    rng = np.random.default_rng(3)
    M, L, W = rng.normal(size=(40, 3, 3)), members(3, rng), np.diag([1, 2, 5])
    R, Q = rb.project_so(M), rb.projection.orthonormalize_gram_schmidt(M)
    bound = 40 * EPS * condition(M, R)[:, None, None]
    assert np.all(np.abs(rb.project_so(L @ M) - L @ R) < bound)
    assert np.all(np.abs(rb.project_so(M @ L) - R @ L) < bound)
    assert np.abs(rb.projection.orthonormalize_gram_schmidt(L @ M) - L @ Q).max() < 1e-12
    assert np.abs(rb.projection.orthonormalize_gram_schmidt(M @ L) - Q @ L).max() > 0.1
    R = rb.projection.project_so_weighted(M, W)
    assert np.abs(rb.projection.project_so_weighted(L @ M, W) - L @ R).max() < 1e-12
    assert np.abs(rb.projection.project_so_weighted(M @ L, L.mT @ W @ L) - R @ L).max() < 1e-12
    assert np.abs(rb.projection.project_so_weighted(M @ L, W) - R @ L).max() > 0.1


@pytest.mark.parametrize("n", [2, 3, 4])
@pytest.mark.source("BK 4")
def test_the_weighted_projection_is_the_nearest_rotation_in_its_metric(n):
    """Condition numbers are up to 1e6, and ranks include 1 (a rod) and n − 1 (a flat body).

    The moved points of a flat body determine the rotation.
    """
    rng = np.random.default_rng(n)
    sizes = 10.0 ** rng.uniform(-3, 3, size=(1000, n))
    sizes[:200] = rng.uniform(0.5, 2, size=(200, n))
    sizes[:200, 0] = sizes[200:400, 1:] = 0
    sizes[400:600, 0] *= 1e-12
    sizes /= sizes.sum(axis=1, keepdims=True)
    Q = np.linalg.qr(rng.normal(size=(1000, n, n)))[0]
    W, root = Q * sizes[:, None] @ Q.mT, Q * np.sqrt(sizes)[:, None]
    for M in (np.resize(awkward.matrices(n, rng), Q.shape), rng.normal(size=Q.shape)):
        R = rb.projection.project_so_weighted(M, W)
        assert_members(R)
        assert_nearest(R, M, W)
        best = np.sum(((M - R) @ root) ** 2, axis=(-2, -1))
        bound = 16 * n * EPS * (1 + np.sum(M**2, axis=(-2, -1)))
        for other in members(n, rng, 100):
            assert np.all(best <= np.sum(((M - other) @ root) ** 2, axis=(-2, -1)) + bound)
    R, lost = members(n, rng, 200), rng.normal(size=(200, n, 1)) @ Q[:200, :, :1].mT
    assert np.abs(rb.projection.project_so_weighted(R + lost, W[:200]) - R).max() < 200 * n * EPS


@pytest.mark.parametrize("n", DIMENSIONS)
@pytest.mark.source("BK 4")
def test_gram_schmidt_leaves_an_upper_triangular_matrix(n):
    rng = np.random.default_rng(n)
    M = np.concatenate([rng.normal(size=(40, n, n)), members(n, rng)])
    nearly_flat = members(n, rng) * ([1.0] * (n - 1) + [1e-12]) @ members(n, rng)
    stretched = M * np.geomspace(1e-200, 1e200, n)
    M = np.concatenate([M, nearly_flat, stretched, 1e200 * M, 1e-200 * M])
    Q = rb.projection.orthonormalize_gram_schmidt(M)
    assert np.abs(Q.mT @ Q - np.eye(n)).max() < 8 * n * EPS
    T = Q.mT @ M
    assert np.abs(np.tril(T, -1) / np.abs(M).max(axis=-2, keepdims=True)).max() < 8 * n * EPS
    assert np.all(np.diagonal(T, axis1=-2, axis2=-1) > 0)


def test_dependent_columns_are_refused():
    gram_schmidt, negative = rb.projection.orthonormalize_gram_schmidt, "has a negative eigenvalue"
    weighted, stack = rb.projection.project_so_weighted, [np.eye(3), -np.eye(3), np.eye(3)]
    for function, arguments, message in (
        (gram_schmidt, [np.arange(9).reshape(3, 3)], "M: column 2 depends on the columns before"),
        (gram_schmidt, [np.zeros((1, 1))], "M: column 0 depends"),
        (gram_schmidt, [[np.eye(2), [[0, 1], [0, 1]]]], r"M\[1\]: column 0 depends"),
        (weighted, [np.eye(3), np.diag([1, 0, -1e-13])], f"W {negative}"),
        (weighted, [np.eye(3), np.eye(3) + 1e-5 * np.eye(3, k=1)], "W is not symmetric"),
        (weighted, [np.eye(3), stack], rf"W\[1\] {negative}"),
    ):
        with pytest.raises(ValueError, match=message):
            function(*arguments)


@pytest.mark.source("errata 36")
def test_the_two_sums_in_the_proof_of_the_projection_are_equal():
    """Between the trace and the sum, our copy has − in place of =."""
    M, R = np.random.default_rng(36).normal(size=(3, 3)), members(3, np.random.default_rng(2))[0]
    U, sigma, Vt = np.linalg.svd(M)
    C = R.T @ U
    trace = np.trace(sum(s * np.outer(v, c) for s, v, c in zip(sigma, Vt, C.T, strict=True)))
    inner = sum(s * (v @ c) for s, v, c in zip(sigma, Vt, C.T, strict=True))
    assert abs(trace - np.trace(M.T @ R)) < 40 * EPS
    assert abs(inner - np.trace(M.T @ R)) < 40 * EPS
    printed = trace - inner
    assert abs(printed - np.trace(M.T @ R)) > 0.5


@pytest.mark.source("BK 2.1", "errata 28")
def test_poses_are_a_closed_subgroup():
    """A closed subset need not be a group: the affine maps {I, 2 x} are closed, but 4 x is not one
    of them."""
    rng = np.random.default_rng(28)
    A, B = (np.tile(np.eye(4), (40, 1, 1)) for _ in range(2))
    for poses in (A, B):
        poses[:, :3, :3], poses[:, :3, 3] = members(3, rng), rng.normal(size=(40, 3))
    for product in (A @ B, rb.inverse_se3(A), np.tile(np.eye(4), (1, 1, 1))):
        assert rb.is_se(product, 1e-13).all()
    closed = [np.eye(4), np.diag([2.0, 2, 2, 1])]  # a finite set is closed
    products = [a @ b for a in closed for b in closed]
    assert not all(any(np.array_equal(p, c) for c in closed) for p in products)
    assert not rb.is_se(closed[1], 1e-13)


@pytest.mark.source("RR 1.4", "RR Fig. 1", "errata 21")
def test_the_reports_example_of_rank_two_has_one_nearest_rotation():
    printed = [-0.75271952, 0.38914789, 0.5310153, -0.38759388, 0.83566435, 0.1403134]
    M = np.arange(1.0, 10).reshape(3, 3)
    R = rb.project_so(M)
    assert np.abs(R[np.triu_indices(3)] - printed).max() < 1e-8
    assert_nearest(R, M)
    # the nearest rotation is unique, although the rank of M is 2
    assert oracles.two_smallest_eigenvalues((R.T @ M)[None]) > 1


@pytest.mark.source("BK 5", "BK Prop. 4", "BK Prop. 5", "RR 1.6", "errata 16")
@pytest.mark.parametrize("n", [2, 3, 4])
def test_the_projected_pose_is_the_nearest_pose(n):
    """The projection is invariant under poses on the left, but only under rotations on the right.

    tr(AᵀA) is n + 1 + dᵀd. The paper prints 4 + dᵀd.
    """
    rng = np.random.default_rng(n)
    B = np.eye(n + 1) + 0.3 * rng.normal(size=(40, n + 1, n + 1))
    A = rb.project_se(B)
    assert_nearest(A[..., :n, :n], B[..., :n, :n])
    assert rb.is_se(A, 1e-14).all()
    d = A[:, :n, n]
    assert np.array_equal(d, B[:, :n, n])
    best = np.linalg.norm(B - A, axis=(-2, -1))
    others = A.copy()
    others[:, :n, :n], others[:, :n, n] = members(n, rng), d[0] + 0.1 * rng.normal(size=d.shape)
    assert np.all(best <= np.linalg.norm(B - others[:, None], axis=(-2, -1)) + 1e-12)
    trace = np.trace(A.mT @ A, axis1=-2, axis2=-1)
    assert np.abs(trace - (n + 1 + np.vecdot(d, d))).max() < 1e-12
    if n != 3:
        assert np.abs(trace - (4 + np.vecdot(d, d))).min() > 0.5
    B[:, n], move, turn, shift = np.eye(n + 1)[n], A[::-1], A.copy(), A[0].copy()
    turn[:, :n, n], shift[:n, :n] = 0, np.eye(n)
    assert np.abs(rb.project_se(move @ B) - move @ A).max() < 1e-13
    assert np.abs(rb.project_se(B @ turn) - A @ turn).max() < 1e-13
    assert np.abs(rb.project_se(B @ shift) - A @ shift).max() > 0.1


@pytest.mark.source("RR 1.1", "RR (1)", "RR (2)", "RR 1.2", "RR (3)", "RR 1.3", "BK 2.1")
def test_membership_tests_allow_defects_up_to_atol():
    is_so, is_se, is_unit = rb.is_so, rb.is_se, rb.quaternion.is_unit_quaternion
    assert is_so(members(3, np.random.default_rng(0)), 1e-14).all()
    drifted, A = np.eye(3) + 1e-3, rb.pose_from_components(np.eye(3), [1e6, -2, 3])
    for other in (np.diag([1, 1, -1]), np.diag([2, 0.5]), drifted, [[-1]]):
        assert not is_so(other)
    assert is_so(drifted, atol=0.01)
    assert is_so([[1]])
    assert is_se(A)
    for entry, value in [((3, 0), 1e-3), ((3, 3), 2), ((0, 0), -1), ((0, 3), np.inf)]:
        other = A.copy()
        other[entry] = value
        assert not is_se(other), entry
    assert np.array_equal(is_unit([[0.5, 0.5, 0.5, -0.5], [1, 1e-4, 0, 0]]), [True, False])
    assert np.array_equal(is_unit(np.outer([1.009, 1.011], np.eye(4)[0]), 0.01), [True, False])
    for share, passes in ((0.98, True), (1.02, False)):
        longer = 1 + share * 1e-9
        # M has the determinant 1, and MᵀM has the wanted defect
        stretched = np.diag([longer**0.5, 1 / longer**0.5, 1])
        assert is_so(stretched) == passes
        A[:3, :3] = stretched
        assert is_se(A) == passes
        assert is_unit([longer, 0, 0, 0]) == passes
    for value, atol in ((np.nan, np.inf), (np.inf, np.inf), (-np.inf, 1e-9), (1e200, 1e-9)):
        assert not is_unit(np.full((2, 4), value), atol).any()
        for n in (1, 2, 3):
            assert not is_so(np.full((2, n, n), value), atol).any()
            assert not is_se(np.full((2, n + 1, n + 1), value), atol).any()
    for is_member, one in ((is_so, np.eye(3)), (is_se, np.eye(4)), (is_unit, [1, 0, 0, 0])):
        for atol in (-1e-9, np.nan, [1e-9, 1e-9]):
            with pytest.raises(ValueError, match="atol: a number from 0 up is wanted"):
                is_member(one, atol)


@pytest.mark.parametrize("n", [2, 3, 4])
def test_arrays_of_any_type_and_memory_layout_are_accepted(n):
    M = np.random.default_rng(n).integers(-9, 10, size=(6, 5, n, n)).astype(float)
    R, wide = rb.project_so(M), np.zeros((12, 5, n + 1, 2 * n))
    wide[::-2, ::-1, 1:, ::2] = M
    wide.setflags(write=False)
    for view in (
        wide[::-2, ::-1, 1:, ::2],
        np.moveaxis(np.moveaxis(M, (0, 1), (2, 3)).copy(), (2, 3), (0, 1)),
        np.asfortranarray(M),
        M.mT.copy().mT,
        *(M.astype(kind) for kind in (">f8", "f4", "i1", int)),
        M.tolist(),
    ):
        assert np.array_equal(rb.project_so(view), R)
    off = rb.project_so(np.broadcast_to(M[0, 0], (20, n, n))) - R[0, 0]
    assert np.abs(off).max() < 4 * n * EPS * (1 + condition(M[0, 0], R[0, 0]))


RNG, N = np.random.default_rng(1002), 24
ONE, U, V, NOISE = np.ones(N), members(3, RNG, N), members(3, RNG, N), RNG.normal(size=(N, 3, 3))
SMALL = RNG.uniform(0.05, 1, N)
SINGULAR_VALUES = {
    "reflected": (ONE, (1 + SMALL) / 2, -SMALL / 4),
    "of rank 2": (ONE, SMALL, 0 * SMALL),
    "with equal small ones": (ONE, SMALL, SMALL),
}
for gap in (1e-1, 1e-2, 1e-3, 1e-6):
    SINGULAR_VALUES |= {
        f"both small, gap {gap:.0e}": (ONE, 0.7 * gap * ONE, 0.3 * gap * ONE),
        f"opposite, gap {gap:.0e}": (ONE, 0.5 * ONE, (gap - 0.5) * ONE),
        f"nearly a reflection, gap {gap:.0e}": (ONE, ONE, (gap - 1) * ONE),
    }
KINDS = {name: U * np.transpose(d)[:, None] @ V for name, d in SINGULAR_VALUES.items()}
KINDS |= {"noisy": U + 0.1 * NOISE, "hardly noisy": U + 1e-9 * NOISE, "general": NOISE}


def by_foam(M):
    """Return R and the flags of `nearest_rotations`, for matrices (N, 3, 3)."""
    R = np.full(M.shape, np.nan)
    right = nearest_rotations(M.transpose(1, 2, 0), R.transpose(1, 2, 0))
    return R, right


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.source("BK Prop. 2")
def test_foam_is_no_less_accurate_than_the_svd(kind):
    M = KINDS[kind]
    want = np.array([oracles.nearest_rotation(m) for m in M])
    off, svd_off = (np.abs(R - want).max() for R in (rb.project_so(M), textbook.project_so(M)))
    assert off <= svd_off
    R, right = by_foam(M)
    if "noisy" in kind or "1e-06" in kind:
        assert np.all(right == ("noisy" in kind))
    bound = 2 * EPS * (1 + condition(M, want)[:, None, None])
    assert np.all((np.abs(R - want) <= bound)[right])
    assert_members(R[right])


@pytest.mark.source("BK Prop. 2")
def test_stacking_matrices_does_not_change_their_projections():
    """They fill more than one block. Some are near the singular set, extreme, or of rank 1 or 0."""
    rng = np.random.default_rng(10)
    kinds = [*KINDS.values(), np.ones((1, 3, 3)), 1e200 * np.ones((1, 3, 3))]
    kinds += [factor * KINDS["noisy"] for factor in (-1, 2.0**900, 2.0**-900, 1e150, 1e-150)]
    M = np.concatenate([*kinds, rng.normal(size=(TOGETHER, 3, 3))])
    M[:3, 1, 2], M[3] = (0, 1e200, 1e-200), 5e-324
    order = rng.permutation(len(M))
    R = rb.project_so(M[order])[np.argsort(order)]
    assert_members(R)
    M, R = M[:600], R[:600]
    alone = np.array([rb.project_so(one) for one in M])
    size = np.abs(condition(M / np.abs(M).max(axis=(1, 2), keepdims=True), alone))
    assert np.all(np.abs(R - alone) < 4 * EPS * (1 + size[:, None, None]))


@pytest.mark.source("BK 4")
@pytest.mark.parametrize("power", [-1000, -300, -40, -1, 1, 40, 300, 1020])
def test_scaling_by_powers_of_two_does_not_change_any_bit(power):
    M = np.concatenate([M[:10] for M in KINDS.values()])
    for some in (M, *M[:20]):
        assert np.array_equal(rb.project_so(some), rb.project_so(np.ldexp(some, power)))
    M = awkward.matrices(3, np.random.default_rng(3))
    weighted = rb.projection.project_so_weighted(M, np.ldexp(np.eye(3), power))
    assert np.array_equal(weighted, rb.project_so(M))
    assert_members(rb.project_so(np.full((3, 3), 5e-324)))


def test_threads_do_not_disturb_each_other():
    stacks = np.random.default_rng(2).normal(size=(2, 15_000, 3, 3))
    wants = [rb.project_so(M) for M in stacks]
    assert not np.shares_memory(*wants)
    with ThreadPoolExecutor(2) as pool:
        for R, want in zip(pool.map(rb.project_so, 20 * [*stacks]), 20 * wants, strict=True):
            assert np.array_equal(R, want)


def test_the_bound_of_a_gap_holds_near_the_singular_set_and_for_equal_values():
    """The gap is the sum of the two smallest signed singular values."""
    rng = np.random.default_rng(8)
    U, V = (rb.sample_rotation(3000, rng=rng) for _ in "UV")
    d = np.sort(rng.random((3000, 3)))[:, ::-1] * [1, 1, -1]
    d[:1000, 2] = (10.0 ** rng.uniform(-12, 0, 1000) - 1) * d[:1000, 1]
    d[1000:2000] = 1 + 10.0 ** rng.uniform(-12, 0, (1000, 1)) * rng.random((1000, 3))
    M = U * d[:, None] @ V
    exact = d.sum(axis=1) - d.max(axis=1)
    found = _foam.gaps(np.ascontiguousarray(np.moveaxis(M, 0, -1)))
    assert (np.abs(found - exact) <= _foam.GAP_ERROR * np.linalg.norm(d, axis=1)).all()
