import tracemalloc

import awkward
import numpy as np
import oracles
import pytest

import rbcourse as rb

EPS = np.finfo(float).eps
DIMENSIONS = [1, 2, 3, 4, 7]


def members(n, rng):
    """Random rotations of Rⁿ, by Householder's QR."""
    Q = np.linalg.qr(rng.normal(size=(40, n, n)))[0]
    Q[..., 0] *= np.linalg.det(Q)[:, None]
    return Q


def assert_members(R):
    n = R.shape[-1]
    assert np.abs(np.swapaxes(R, -1, -2) @ R - np.eye(n)).max() < 8 * n * EPS
    assert np.all(np.linalg.det(R) > 0)


def assert_nearest(R, M):
    """RᵀM symmetric, its two smallest eigenvalues sum to 0 or more: nearest, by second order."""
    S, n = np.swapaxes(R, -1, -2) @ M, M.shape[-1]
    size = np.linalg.norm(M, axis=(-2, -1))
    skew = np.linalg.norm(S - np.swapaxes(S, -1, -2), axis=(-2, -1))
    assert np.all(skew <= 8 * n * EPS * size)
    if n > 1:
        assert np.all(oracles.two_smallest_eigenvalues(S) >= -8 * n * EPS * size)


@pytest.mark.parametrize("n", DIMENSIONS)
@pytest.mark.source("BK Prop. 2", "RR 1.4", "RR (4)", "RR (5)")
def test_the_projection_is_a_member_and_the_nearest(n):
    M = awkward.matrices(n, np.random.default_rng(n))
    R = rb.project_so(M)
    assert_members(R)
    assert_nearest(R, M)


@pytest.mark.parametrize("n", [2, 3, 4])
@pytest.mark.source("BK Prop. 2")
def test_no_other_rotation_is_nearer(n):
    rng = np.random.default_rng(n)
    M = awkward.matrices(n, rng)
    others = members(n, rng)
    best = np.linalg.norm(M - rb.project_so(M), axis=(-2, -1))
    for other in others:
        assert np.all(best <= np.linalg.norm(M - other, axis=(-2, -1)) + 4 * n * EPS * (1 + best))


@pytest.mark.source("BK Prop. 2", "errata 2")
def test_the_printed_projection_is_a_reflection_where_the_determinant_is_negative():
    M = np.diag([3.0, 2.0, -1.0])
    U, _, Vt = np.linalg.svd(M)
    assert np.linalg.det(U @ Vt) < 0
    assert np.array_equal(rb.project_so(M), np.eye(3))


@pytest.mark.parametrize("n", DIMENSIONS)
def test_rotations_stay(n):
    R = members(n, np.random.default_rng(n))
    assert np.abs(rb.project_so(R) - R).max() < 8 * n * EPS


@pytest.mark.source("BK Prop. 3")
def test_the_projection_is_invariant_on_both_sides():
    rng = np.random.default_rng(3)
    M, L = rng.normal(size=(40, 3, 3)), members(3, rng)
    R = rb.project_so(M)
    gap = oracles.two_smallest_eigenvalues(np.swapaxes(R, -1, -2) @ M)
    bound = 40 * EPS * np.linalg.norm(M, axis=(-2, -1)) / gap
    assert np.all(np.abs(rb.project_so(L @ M) - L @ R).max(axis=(-2, -1)) < bound)
    assert np.all(np.abs(rb.project_so(M @ L) - R @ L).max(axis=(-2, -1)) < bound)


def weights(n, rng, count=1000):
    """Random symmetric positive definite matrices, condition numbers up to 1e6."""
    Q = np.linalg.qr(rng.normal(size=(count, n, n)))[0]
    sizes = 10.0 ** rng.uniform(-3, 3, size=(count, n))
    return (Q * sizes[:, None]) @ np.swapaxes(Q, -1, -2)


def weighted_distance(M, R, W):
    """√tr((M − R)ᵀ(M − R) W): by definition, with W as a sum of squares."""
    return np.linalg.norm((M - R) @ np.linalg.cholesky(W), axis=(-2, -1))


@pytest.mark.parametrize("n", [2, 3, 4])
@pytest.mark.source("BK 4")
def test_the_weighted_projection_is_the_nearest_in_its_own_metric(n):
    rng = np.random.default_rng(n)
    W, matrices = weights(n, rng), awkward.matrices(n, rng)
    W /= np.trace(W, axis1=-2, axis2=-1)[:, None, None]
    M = np.resize(matrices, (1000, n, n))
    R = rb.project_so_weighted(M, W)
    assert_members(R)
    assert_nearest_of_products(R, M, W)
    M = rng.normal(size=(1000, n, n))
    best = weighted_distance(M, rb.project_so_weighted(M, W), W)
    for other in members(n, rng):
        assert np.all(best <= weighted_distance(M, other, W) + 1e-9)


def assert_nearest_of_products(R, M, W):
    """RᵀMW symmetric, its two smallest eigenvalues sum to 0 or more; M W is rounded already."""
    S, n = np.swapaxes(R, -1, -2) @ M @ W, M.shape[-1]
    size = np.linalg.norm(M, axis=(-2, -1)) * np.linalg.norm(W, axis=(-2, -1))
    skew = np.linalg.norm(S - np.swapaxes(S, -1, -2), axis=(-2, -1))
    assert np.all(skew <= 16 * n * EPS * size)
    assert np.all(oracles.two_smallest_eigenvalues(S) >= -16 * n * EPS * size)


@pytest.mark.source("BK 4")
def test_with_the_identity_as_weight_it_is_the_projection():
    M = awkward.matrices(3, np.random.default_rng(3))
    for factor in (1.0, 2.0**1023, 2.0**-1000):
        assert np.array_equal(rb.project_so_weighted(M, factor * np.eye(3)), rb.project_so(M))


def test_a_weighted_projection_turns_with_its_weight():
    rng = np.random.default_rng(5)
    M, W, L = rng.normal(size=(40, 3, 3)), np.diag([1, 2, 5]), members(3, rng)
    R = rb.project_so_weighted(M, W)
    turned = np.swapaxes(L, -1, -2) @ W @ L
    assert np.abs(rb.project_so_weighted(L @ M, W) - L @ R).max() < 1e-12
    assert np.abs(rb.project_so_weighted(M @ L, turned) - R @ L).max() < 1e-12
    assert np.abs(rb.project_so_weighted(M @ L, W) - R @ L).max() > 0.1


def test_a_weight_may_be_all_but_flat():
    R = rb.project_so_weighted([[1, -0.2], [0, 1]], np.diag([1, 1e-12]))
    assert np.abs(R - np.eye(2)).max() < 1e-12


@pytest.mark.parametrize("moments", [(1, 2, 3), (1, 1, 2), (0, 1, 1)])
def test_for_a_flat_body_and_a_rod_no_rotation_is_nearer(moments):
    """Among a hundred thousand at random and small turns of the answer, by the points of a body."""
    rng = np.random.default_rng(6)
    half = sum(moments) / 2
    points = np.diag(np.sqrt([half - moment for moment in moments]))
    for M in rng.normal(size=(10, 3, 3)):
        L = rb.sample_rotation(rng=rng)
        body = L @ points
        R = rb.project_so_weighted(M, rb.metrics.weight_from_inertia(L @ np.diag(moments) @ L.T))
        assert_members(R[None])
        best = np.linalg.norm((M - R) @ body)
        turns = R @ rb.exp_so3(rng.normal(size=(1000, 3)) * 10.0 ** rng.uniform(-8, 0, (1000, 1)))
        for others in (rb.sample_rotation(10_000, rng=rng), turns):
            away = np.linalg.norm((M - others) @ body, axis=(-2, -1))
            assert best <= away.min() + 16 * EPS * np.linalg.norm(M)


@pytest.mark.parametrize("n", [2, 3, 4])
def test_a_weight_of_rank_n_minus_1_determines_the_rotation(n):
    """Points of a flat body that a rotation has moved tell which one it was."""
    rng = np.random.default_rng(n)
    R, L = members(n, rng), members(n, rng)
    weights = np.append(rng.uniform(0.5, 2, n - 1), 0)
    W = (L * weights) @ np.swapaxes(L, -1, -2)
    lost = rng.normal(size=(len(R), n, 1)) @ np.swapaxes(L[..., -1:], -1, -2)
    assert np.abs(rb.project_so_weighted(R + lost, W) - R).max() < 200 * n * EPS


@pytest.mark.parametrize(
    ("W", "message"),
    [
        (np.diag([1, 1, -1]), "W has a negative eigenvalue"),
        (np.diag([1, 0, -1e-13]), "W has a negative eigenvalue"),
        (-np.ones((3, 3)), "W has a negative eigenvalue"),
        (np.eye(3) + 1e-9 * np.eye(3, k=1), "W is not symmetric"),
        (np.eye(2), r"W: shape \(\.\.\., 3, 3\) wanted, got \(2, 2\)"),
        ([np.eye(3), -np.eye(3), np.eye(3), np.eye(3)], r"W\[1\] has a negative eigenvalue"),
        (np.ones((2, 1, 1)) * np.eye(3), r"broadcast: M \(4,\), W \(2,\)"),
        (np.full((3, 3), np.inf), r"W\[0, 0\] is inf"),
    ],
)
def test_what_is_no_weight_is_refused(W, message):
    with pytest.raises(ValueError, match=message):
        rb.project_so_weighted([np.eye(3)] * 4, W)


@pytest.mark.parametrize("n", DIMENSIONS)
@pytest.mark.source("BK 4")
def test_gram_schmidt_leaves_a_triangle(n):
    rng = np.random.default_rng(n)
    M = np.concatenate([rng.normal(size=(40, n, n)), members(n, rng)])
    nearly_flat = np.diag([1.0] * (n - 1) + [1e-12])
    M = np.concatenate([M, members(n, rng) @ nearly_flat @ members(n, rng), 1e200 * M, 1e-200 * M])
    Q = rb.orthonormalize_gram_schmidt(M)
    assert np.abs(np.swapaxes(Q, -1, -2) @ Q - np.eye(n)).max() < 8 * n * EPS
    T = np.swapaxes(Q, -1, -2) @ M
    sizes = np.abs(M).max(axis=-2, keepdims=True)
    assert np.abs(np.tril(T, -1) / sizes).max() < 8 * n * EPS
    assert np.all(np.diagonal(T, axis1=-2, axis2=-1) > 0)
    assert np.array_equal(np.sign(np.linalg.det(Q)), np.linalg.slogdet(M).sign)


def test_gram_schmidt_of_columns_of_any_size():
    M = np.array([[3, 1, 0], [4, 0, 0], [0, 0, 2]]) * [1e-200, 1, 1e200]
    wanted = np.array([[0.6, 0.8, 0], [0.8, -0.6, 0], [0, 0, 1]])
    assert np.abs(rb.orthonormalize_gram_schmidt(M) - wanted).max() < 4 * EPS


@pytest.mark.source("BK 4", "BK Prop. 3")
def test_gram_schmidt_is_invariant_on_the_left_only():
    rng = np.random.default_rng(3)
    M, L = rng.normal(size=(40, 3, 3)), members(3, rng)
    Q = rb.orthonormalize_gram_schmidt(M)
    assert np.abs(rb.orthonormalize_gram_schmidt(L @ M) - L @ Q).max() < 1e-12
    assert np.abs(rb.orthonormalize_gram_schmidt(M @ L) - Q @ L).max() > 0.1


@pytest.mark.parametrize(
    ("M", "message"),
    [
        ([[1, 2], [2, 4]], "M: column 1 depends on the columns before it"),
        (np.arange(1, 10).reshape(3, 3), "M: column 2 depends"),
        (np.zeros((1, 1)), "M: column 0 depends"),
        ([np.eye(2), [[0, 1], [0, 1]]], r"M\[1\]: column 0 depends"),
    ],
)
def test_gram_schmidt_refuses_dependent_columns(M, message):
    with pytest.raises(ValueError, match=message):
        rb.orthonormalize_gram_schmidt(M)


@pytest.mark.parametrize("n", DIMENSIONS)
@pytest.mark.source("BK Remark 6", "errata 3")
def test_the_distance_is_the_distance_to_the_nearest(n):
    M = awkward.matrices(n, np.random.default_rng(n))
    nearest = np.abs(M - rb.project_so(M))
    wanted = np.hypot.reduce(nearest.reshape(len(M), -1), axis=-1)
    assert rb.distance_to_so(1e200 * np.eye(n)) == pytest.approx(np.sqrt(n) * 1e200)
    assert np.all(np.abs(rb.distance_to_so(M) - wanted) <= 20 * n * EPS * (1 + wanted))


@pytest.mark.source("BK Remark 6", "errata 3")
def test_the_printed_distance_is_its_square_and_forgets_the_sign():
    for M, corrected in [(np.diag([3.0, 1, 1]), 2), (np.diag([1.0, 1, -1]), 2)]:
        printed = ((np.linalg.svd(M)[1] - 1) ** 2).sum()
        others = np.linalg.norm(M - members(3, np.random.default_rng(6)), axis=(-2, -1))
        assert rb.distance_to_so(M) == pytest.approx(corrected, abs=8 * EPS)
        assert corrected <= others.min()
        assert abs(printed - corrected) > 1


@pytest.mark.source("RR 1.4", "RR Fig. 1", "errata 21")
def test_the_reports_example_of_rank_two_has_one_nearest_rotation():
    printed = [
        [-0.75271952, 0.38914789, 0.5310153],
        [0.38914789, -0.38759388, 0.83566435],
        [0.5310153, 0.83566435, 0.1403134],
    ]
    M = np.arange(1.0, 10).reshape(3, 3)
    R = rb.project_so(M)
    assert np.abs(R - printed).max() < 1e-8
    assert_nearest(R, M)
    assert np.linalg.matrix_rank(M) == 2
    assert oracles.two_smallest_eigenvalues((R.T @ M)[None]) > 1  # so there is no other


def test_no_matrix_is_too_large_or_too_small():
    M = np.random.default_rng(7).uniform(-1, 1, size=(20, 3, 3))
    for scale in (2.0**1023, 2.0**-1000):
        assert np.array_equal(rb.project_so(scale * M), rb.project_so(M))
    assert_members(rb.project_so(np.full((3, 3), 5e-324)))


@pytest.mark.source("BK Prop. 4", "BK Prop. 5", "RR 1.6")
def test_the_nearest_pose_keeps_the_translation():
    rng = np.random.default_rng(4)
    B = rng.normal(size=(5, 2, 4, 4))
    A = rb.project_se(B)
    assert np.array_equal(A[..., :3, 3], B[..., :3, 3])
    assert np.array_equal(A[..., 3, :], np.broadcast_to([0, 0, 0, 1], (5, 2, 4)))
    assert_nearest(A[..., :3, :3], B[..., :3, :3])
    assert rb.is_se(A, 1e-14).all()


@pytest.mark.source("BK 5", "BK Prop. 4", "errata 16")
@pytest.mark.parametrize("n", [2, 3, 4])
def test_the_nearest_pose_is_the_nearest(n):
    """Against other poses, and with tr(AᵀA) = n + 1 + dᵀd, where the paper prints 4 + dᵀd."""
    rng = np.random.default_rng(n)
    B = np.eye(n + 1) + rng.normal(size=(40, n + 1, n + 1))
    B[:, -1] = np.eye(n + 1)[-1]
    A = rb.project_se(B)
    best = np.linalg.norm(B - A, axis=(-2, -1))
    for other in members(n, rng):
        pose = np.eye(n + 1)
        pose[:n, :n], pose[:n, n] = other, B[0, :n, n] + 0.1 * rng.normal(size=n)
        assert np.all(best <= np.linalg.norm(B - pose, axis=(-2, -1)) + 1e-12)
    trace, d = np.trace(np.swapaxes(A, -1, -2) @ A, axis1=-2, axis2=-1), A[:, :n, n]
    assert np.abs(trace - (n + 1 + np.vecdot(d, d))).max() < 1e-12
    if n != 3:
        assert np.abs(trace - (4 + np.vecdot(d, d))).min() > 0.5


@pytest.mark.source("BK 5", "BK Prop. 5")
def test_the_nearest_pose_is_invariant_under_poses_on_the_left_and_rotations_on_the_right():
    rng = np.random.default_rng(8)
    B = np.eye(4) + 0.3 * rng.normal(size=(40, 4, 4))
    B[:, 3] = [0, 0, 0, 1]
    A, move, turn, shift = rb.project_se(B), *(np.tile(np.eye(4), (3, 40, 1, 1)))
    move[:, :3, :3], move[:, :3, 3] = members(3, rng), rng.normal(size=(40, 3))
    turn[:, :3, :3] = members(3, rng)
    shift[:, 0, 3] = 1
    assert np.abs(rb.project_se(move @ B) - move @ A).max() < 1e-13
    assert np.abs(rb.project_se(B @ turn) - A @ turn).max() < 1e-13
    assert np.abs(rb.project_se(B @ shift) - A @ shift).max() > 0.1


@pytest.mark.source("RR 1.1", "RR (1)", "RR (2)", "BK 2.1")
def test_membership_of_so():
    assert rb.is_so(members(3, np.random.default_rng(0)), 1e-14).all()
    reflected, stretched, drifted = np.diag([1, 1, -1]), np.diag([2, 0.5]), np.eye(3) + 1e-3
    assert not rb.is_so(reflected)
    assert not rb.is_so(stretched)
    assert not rb.is_so(drifted)
    assert rb.is_so(drifted, atol=0.01)
    assert rb.is_so([[1]])
    assert not rb.is_so([[-1]])


@pytest.mark.source("RR 1.3", "BK 2.1")
def test_membership_of_se():
    A = np.eye(4)
    A[:3, 3] = [1e6, -2, 3]
    assert rb.is_se(A)
    for entry, value in [((3, 0), 1e-3), ((3, 3), 2), ((0, 0), -1), ((0, 3), np.inf)]:
        other = A.copy()
        other[entry] = value
        assert not rb.is_se(other), entry


@pytest.mark.parametrize("is_member", [rb.is_so, rb.is_se])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e200])
def test_membership_never_fails_on_values(is_member, value):
    assert not is_member(np.full((2, 3, 3), value)).any()
    if not np.isfinite(value):
        assert not is_member(np.full((2, 2, 2), value), np.inf).any()
        assert not rb.is_so([[value]], np.inf)


def test_stacks_are_the_stack_of_their_members():
    M = np.eye(4) + 0.1 * np.random.default_rng(1).normal(size=(2, 3, 4, 4))
    for i in np.ndindex(2, 3):
        assert np.abs(rb.project_so(M)[i] - rb.project_so(M[i])).max() < 40 * EPS
        assert np.abs(rb.project_se(M)[i] - rb.project_se(M[i])).max() < 40 * EPS
    assert rb.project_so(np.zeros((0, 3, 3))).shape == (0, 3, 3)


def test_arguments_are_left_alone():
    M = np.arange(9.0).reshape(3, 3)
    rb.project_so(M)
    rb.project_se(M)
    assert np.array_equal(M, np.arange(9.0).reshape(3, 3))


def condition(M, R):
    """‖M‖ over the sum of the two smallest eigenvalues of RᵀM: what rounding grows by."""
    return np.linalg.norm(M, axis=(-2, -1)) / oracles.two_smallest_eigenvalues(R.mT @ M)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_of_many_matrices_the_first_that_is_not_finite_is_named(value):
    M = np.random.default_rng(9).normal(size=(200_000, 3, 3))
    M[777, 1, 2] = M[778, 0, 0] = M[199_999, 2, 2] = value
    with pytest.raises(ValueError, match=rf"^M\[777, 1, 2\] is {value}"):
        rb.project_so(M)
    with pytest.raises(ValueError, match=rf"^M\[1, 377, 1, 2\] is {value}"):
        rb.project_so(M.reshape(500, 400, 3, 3))


@pytest.mark.parametrize("n", [2, 3, 4])
@pytest.mark.parametrize("kind", [int, np.int8, np.float32, bool, list])
def test_numbers_of_any_kind_are_taken(n, kind):
    numbers = np.random.default_rng(n).integers(0, 2, size=(30, n, n)) + np.eye(n, dtype=int)
    M = numbers.tolist() if kind is list else numbers.astype(kind)
    R = rb.project_so(M)
    assert R.dtype == np.float64
    assert np.array_equal(R, rb.project_so(np.array(M, float)))
    assert_nearest(R, np.array(M, float))


@pytest.mark.parametrize("n", [2, 3, 4])
def test_arrays_of_any_layout_are_read_and_left_alone(n):
    M = np.random.default_rng(n).normal(size=(6, 5, n, n))
    R = rb.project_so(M)
    wide = np.zeros((12, 5, n + 1, 2 * n))
    wide[::-2, ::-1, 1:, ::2] = M
    wide.setflags(write=False)
    for view in (
        wide[::-2, ::-1, 1:, ::2],
        np.moveaxis(np.moveaxis(M, (0, 1), (2, 3)).copy(), (2, 3), (0, 1)),
        np.asfortranarray(M),
        M.mT.copy().mT,
        M.astype(">f8"),
    ):
        before = view.copy()
        assert np.array_equal(rb.project_so(view), R)
        assert np.array_equal(view, before)
    assert not np.shares_memory(R, M)
    same = np.broadcast_to(M[0, 0], (20, n, n))
    bound = 4 * n * EPS * (1 + condition(M[0, 0], R[0, 0]))
    assert np.abs(rb.project_so(same) - R[0, 0]).max() < bound


@pytest.mark.source("BK Prop. 2")
def test_in_a_mixed_stack_each_gets_what_it_gets_alone():
    rng = np.random.default_rng(10)
    good = np.eye(3) + 0.1 * rng.normal(size=(20, 3, 3))
    U, V = np.split(members(3, rng), 2)
    mixed = [good, U * [1, 0.5, -0.499] @ V, U * [1, 1e-5, 0] @ V, -good, U * [1, 0.6, -0.2] @ V]
    mixed += [factor * good for factor in (2.0**900, 2.0**-900, 1e150, 1e-150)]
    M = rng.permutation(np.concatenate(mixed))
    alone = np.array([rb.project_so(m) for m in M])
    scale = np.abs(M).max(axis=(-2, -1), keepdims=True)
    size = condition(M / scale, alone)
    zero, M[7] = np.zeros((3, 3)), 0
    R = rb.project_so(M)
    off, others = np.abs(R - alone).max(axis=(-2, -1)), np.arange(len(M)) != 7
    assert np.all(off[others] < 4 * EPS * (1 + size[others]))
    assert np.array_equal(R[7], rb.project_so(zero))
    assert_members(R)


def test_no_more_memory_is_taken_than_three_times_what_goes_in_and_out():
    M = np.random.default_rng(11).normal(size=(300_000, 3, 3))
    tracemalloc.start()
    try:
        R = rb.project_so(M)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert M.nbytes + peak < 3 * (M.nbytes + R.nbytes)


def test_bad_arguments_are_named():
    for function in (rb.project_so, rb.is_so, rb.orthonormalize_gram_schmidt, rb.distance_to_so):
        with pytest.raises(ValueError, match=r"M: shape \(\.\.\., n, n\) wanted, got \(2, 3\)"):
            function(np.zeros((2, 3)))
    with pytest.raises(ValueError, match=r"B: shape .*n\+1\) wanted, got \(1, 1\)"):
        rb.project_se([[1]])
    with pytest.raises(ValueError, match=r"M\[0, 1\] is nan"):
        rb.project_so([[1, np.nan], [0, 1]])


def test_is_so_is_se_and_is_unit_quaternion_pass_defects_up_to_1e_9():
    for share, passes in ((0.98, True), (1.02, False)):
        longer = 1 + share * 1e-9
        stretched = np.diag([longer**0.5, 1 / longer**0.5, 1])  # det 1, defect of MᵀM as wanted
        assert rb.is_so(stretched) == passes
        assert rb.is_se(rb.pose_from_components(stretched, [1, 2, 3])) == passes
        assert rb.is_unit_quaternion([longer, 0, 0, 0]) == passes
