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
    assert np.abs(R.mT @ R - np.eye(n)).max() < 8 * n * EPS
    assert np.all(np.linalg.det(R) > 0)


def assert_nearest(R, M, W=None):
    """RᵀM, or RᵀMW, symmetric, its two smallest eigenvalues sum to 0 or more: nearest."""
    S, n = R.mT @ M, M.shape[-1]
    bound = 8 * n * EPS * np.linalg.norm(M, axis=(-2, -1))
    if W is not None:
        S, bound = S @ W, 2 * bound * np.linalg.norm(W, axis=(-2, -1))  # M W is rounded already
    assert np.all(np.linalg.norm(S - S.mT, axis=(-2, -1)) <= bound)
    if n > 1:
        assert np.all(oracles.two_smallest_eigenvalues(S) >= -bound)


@pytest.mark.parametrize("n", DIMENSIONS)
@pytest.mark.source("BK Prop. 2", "RR 1.4", "RR (4)", "RR (5)")
def test_the_projection_is_a_member_and_the_nearest_and_a_rotation_stays(n):
    rng = np.random.default_rng(n)
    M, others = awkward.matrices(n, rng), members(n, rng)
    R = rb.project_so(M)
    assert_members(R)
    assert_nearest(R, M)
    best = np.linalg.norm(M - R, axis=(-2, -1))
    away = np.linalg.norm(M - others[:, None], axis=(-2, -1))
    assert np.all(best <= away + 4 * n * EPS * (1 + best))
    assert np.abs(rb.project_so(others) - others).max() < 8 * n * EPS


@pytest.mark.source("BK Prop. 2", "errata 2")
def test_the_printed_projection_is_a_reflection_where_the_determinant_is_negative():
    M = np.diag([3.0, 2.0, -1.0])
    U, _, Vt = np.linalg.svd(M)
    assert np.linalg.det(U @ Vt) < 0
    assert np.array_equal(rb.project_so(M), np.eye(3))


@pytest.mark.source("BK Prop. 3")
def test_the_projection_is_invariant_on_both_sides():
    rng = np.random.default_rng(3)
    M, L = rng.normal(size=(40, 3, 3)), members(3, rng)
    R = rb.project_so(M)
    bound = 40 * EPS * condition(M, R)[:, None, None]
    assert np.all(np.abs(rb.project_so(L @ M) - L @ R) < bound)
    assert np.all(np.abs(rb.project_so(M @ L) - R @ L) < bound)


@pytest.mark.parametrize("n", [2, 3, 4])
@pytest.mark.source("BK 4")
def test_the_weighted_projection_is_the_nearest_in_its_own_metric(n):
    """For weights of condition numbers up to 1e6; √tr(XᵀX W) is a root of a sum of squares."""
    rng = np.random.default_rng(n)
    Q = np.linalg.qr(rng.normal(size=(1000, n, n)))[0]
    W = (Q * 10.0 ** rng.uniform(-3, 3, size=(1000, 1, n))) @ Q.mT
    W /= np.trace(W, axis1=-2, axis2=-1)[:, None, None]
    M = np.resize(awkward.matrices(n, rng), (1000, n, n))
    R = rb.project_so_weighted(M, W)
    assert_members(R)
    assert_nearest(R, M, W)
    M, root = rng.normal(size=(1000, n, n)), np.linalg.cholesky(W)
    best = np.linalg.norm((M - rb.project_so_weighted(M, W)) @ root, axis=(-2, -1))
    for other in members(n, rng):
        assert np.all(best <= np.linalg.norm((M - other) @ root, axis=(-2, -1)) + 1e-9)


def test_a_weighted_projection_turns_with_its_weight():
    rng = np.random.default_rng(5)
    M, W, L = rng.normal(size=(40, 3, 3)), np.diag([1, 2, 5]), members(3, rng)
    R = rb.project_so_weighted(M, W)
    assert np.abs(rb.project_so_weighted(L @ M, W) - L @ R).max() < 1e-12
    assert np.abs(rb.project_so_weighted(M @ L, L.mT @ W @ L) - R @ L).max() < 1e-12
    assert np.abs(rb.project_so_weighted(M @ L, W) - R @ L).max() > 0.1


@pytest.mark.parametrize("moments", [(1, 2, 3), (1, 1, 2), (0, 1, 1)])
def test_for_a_flat_body_and_a_rod_no_rotation_is_nearer(moments):
    """Among ten thousand at random and small turns of the answer, by the points of a body."""
    rng = np.random.default_rng(6)
    points = np.diag(np.sqrt(sum(moments) / 2 - np.array(moments)))
    for M in rng.normal(size=(10, 3, 3)):
        L = rb.sample_rotation(rng=rng)
        R = rb.project_so_weighted(M, rb.metrics.weight_from_inertia(L @ np.diag(moments) @ L.T))
        assert_members(R)
        turns = R @ rb.exp_so3(rng.normal(size=(1000, 3)) * 10.0 ** rng.uniform(-8, 0, (1000, 1)))
        others = np.concatenate([rb.sample_rotation(10_000, rng=rng), turns])
        away = np.linalg.norm((M - others) @ L @ points, axis=(-2, -1))
        best = np.linalg.norm((M - R) @ L @ points)
        assert best <= away.min() + 16 * EPS * np.linalg.norm(M)


@pytest.mark.parametrize("n", [2, 3, 4])
def test_a_weight_of_rank_n_minus_1_or_all_but_that_determines_the_rotation(n):
    """Points of a flat body that a rotation has moved tell which one it was."""
    rng = np.random.default_rng(n)
    R, L = members(n, rng), members(n, rng)
    W = (L * np.append(rng.uniform(0.5, 2, n - 1), 0)) @ L.mT
    lost = rng.normal(size=(len(R), n, 1)) @ L[..., -1:].mT
    assert np.abs(rb.project_so_weighted(R + lost, W) - R).max() < 200 * n * EPS
    R = rb.project_so_weighted([[1, -0.2], [0, 1]], np.diag([1, 1e-12]))
    assert np.abs(R - np.eye(2)).max() < 1e-12


def test_an_indefinite_or_asymmetric_weight_is_refused():
    for W, message in (
        (np.diag([1, 1, -1]), "W has a negative eigenvalue"),
        (np.diag([1, 0, -1e-13]), "W has a negative eigenvalue"),
        (-np.ones((3, 3)), "W has a negative eigenvalue"),
        (np.eye(3) + 1e-9 * np.eye(3, k=1), "W is not symmetric"),
        ([np.eye(3), -np.eye(3), np.eye(3)], r"W\[1\] has a negative eigenvalue"),
    ):
        with pytest.raises(ValueError, match=message):
            rb.project_so_weighted(np.eye(3), W)


@pytest.mark.parametrize("n", DIMENSIONS)
@pytest.mark.source("BK 4")
def test_gram_schmidt_leaves_a_triangle(n):
    rng = np.random.default_rng(n)
    M = np.concatenate([rng.normal(size=(40, n, n)), members(n, rng)])
    nearly_flat = members(n, rng) * ([1.0] * (n - 1) + [1e-12]) @ members(n, rng)
    scaled = (M * np.geomspace(1e-200, 1e200, n), 1e200 * M, 1e-200 * M)
    M = np.concatenate([M, nearly_flat, *scaled])
    Q = rb.orthonormalize_gram_schmidt(M)
    assert np.abs(Q.mT @ Q - np.eye(n)).max() < 8 * n * EPS
    T = Q.mT @ M
    assert np.abs(np.tril(T, -1) / np.abs(M).max(axis=-2, keepdims=True)).max() < 8 * n * EPS
    assert np.all(np.diagonal(T, axis1=-2, axis2=-1) > 0)
    assert np.array_equal(np.sign(np.linalg.det(Q)), np.linalg.slogdet(M).sign)


@pytest.mark.source("BK 4", "BK Prop. 3")
def test_gram_schmidt_is_invariant_on_the_left_only():
    rng = np.random.default_rng(3)
    M, L = rng.normal(size=(40, 3, 3)), members(3, rng)
    Q = rb.orthonormalize_gram_schmidt(M)
    assert np.abs(rb.orthonormalize_gram_schmidt(L @ M) - L @ Q).max() < 1e-12
    assert np.abs(rb.orthonormalize_gram_schmidt(M @ L) - Q @ L).max() > 0.1


def test_gram_schmidt_refuses_dependent_columns():
    for M, message in (
        ([[1, 2], [2, 4]], "M: column 1 depends on the columns before it"),
        (np.arange(1, 10).reshape(3, 3), "M: column 2 depends"),
        (np.zeros((1, 1)), "M: column 0 depends"),
        ([np.eye(2), [[0, 1], [0, 1]]], r"M\[1\]: column 0 depends"),
    ):
        with pytest.raises(ValueError, match=message):
            rb.orthonormalize_gram_schmidt(M)


@pytest.mark.parametrize("n", DIMENSIONS)
@pytest.mark.source("BK Remark 6", "errata 3")
def test_the_distance_is_the_distance_to_the_nearest(n):
    M = awkward.matrices(n, np.random.default_rng(n))
    wanted = np.hypot.reduce(np.abs(M - rb.project_so(M)), axis=(-2, -1))
    assert rb.distance_to_so(1e200 * np.eye(n)) == pytest.approx(np.sqrt(n) * 1e200)
    assert np.all(np.abs(rb.distance_to_so(M) - wanted) <= 20 * n * EPS * (1 + wanted))


@pytest.mark.source("BK Remark 6", "errata 3")
def test_the_printed_distance_is_its_square_and_forgets_the_sign():
    for M in (np.diag([3.0, 1, 1]), np.diag([1.0, 1, -1])):
        printed = ((np.linalg.svd(M)[1] - 1) ** 2).sum()
        others = np.linalg.norm(M - members(3, np.random.default_rng(6)), axis=(-2, -1))
        assert rb.distance_to_so(M) == pytest.approx(2, abs=8 * EPS)
        assert others.min() >= 2
        assert abs(printed - 2) > 1


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


@pytest.mark.source("BK 4")
def test_no_matrix_and_no_multiple_of_the_identity_as_weight_is_too_large_or_too_small():
    M = np.random.default_rng(7).uniform(-1, 1, size=(20, 3, 3))
    awkward_ones = awkward.matrices(3, np.random.default_rng(3))
    for scale in (1.0, 2.0**1023, 2.0**-1000):
        assert np.array_equal(rb.project_so(scale * M), rb.project_so(M))
        weighted = rb.project_so_weighted(awkward_ones, scale * np.eye(3))
        assert np.array_equal(weighted, rb.project_so(awkward_ones))
    assert_members(rb.project_so(np.full((3, 3), 5e-324)))


@pytest.mark.source("BK 5", "BK Prop. 4", "BK Prop. 5", "RR 1.6", "errata 16")
@pytest.mark.parametrize("n", [2, 3, 4])
def test_the_nearest_pose_is_the_nearest_and_keeps_the_translation(n):
    """Against other poses, and with tr(AᵀA) = n + 1 + dᵀd, where the paper prints 4 + dᵀd."""
    rng = np.random.default_rng(n)
    B = np.eye(n + 1) + rng.normal(size=(40, n + 1, n + 1))
    A = rb.project_se(B)
    assert_nearest(A[..., :n, :n], B[..., :n, :n])
    assert rb.is_se(A, 1e-14).all()
    assert np.array_equal(A[..., :n, n], B[..., :n, n])
    assert np.all(A[..., n, :] == np.eye(n + 1)[n])
    best = np.linalg.norm(B - A, axis=(-2, -1))
    for other in members(n, rng):
        pose = np.eye(n + 1)
        pose[:n, :n], pose[:n, n] = other, B[0, :n, n] + 0.1 * rng.normal(size=n)
        assert np.all(best <= np.linalg.norm(B - pose, axis=(-2, -1)) + 1e-12)
    trace, d = np.trace(A.mT @ A, axis1=-2, axis2=-1), A[:, :n, n]
    assert np.abs(trace - (n + 1 + np.vecdot(d, d))).max() < 1e-12
    if n != 3:
        assert np.abs(trace - (4 + np.vecdot(d, d))).min() > 0.5


@pytest.mark.source("BK 5", "BK Prop. 5")
def test_the_nearest_pose_is_invariant_under_poses_on_the_left_and_rotations_on_the_right():
    rng = np.random.default_rng(8)
    B = np.eye(4) + 0.3 * rng.normal(size=(40, 4, 4))
    B[:, 3] = [0, 0, 0, 1]
    A = rb.project_se(B)
    move = rb.pose_from_components(members(3, rng), rng.normal(size=(40, 3)))
    turn = rb.pose_from_components(members(3, rng), np.zeros(3))
    shift = rb.pose_from_components(np.eye(3), [1, 0, 0])
    assert np.abs(rb.project_se(move @ B) - move @ A).max() < 1e-13
    assert np.abs(rb.project_se(B @ turn) - A @ turn).max() < 1e-13
    assert np.abs(rb.project_se(B @ shift) - A @ shift).max() > 0.1


@pytest.mark.source("RR 1.1", "RR (1)", "RR (2)", "RR 1.3", "BK 2.1")
def test_membership():
    assert rb.is_so(members(3, np.random.default_rng(0)), 1e-14).all()
    drifted, A = np.eye(3) + 1e-3, rb.pose_from_components(np.eye(3), [1e6, -2, 3])
    for other in (np.diag([1, 1, -1]), np.diag([2, 0.5]), drifted, [[-1]]):
        assert not rb.is_so(other)
    assert rb.is_so(drifted, atol=0.01)
    assert rb.is_so([[1]])
    assert rb.is_se(A)
    for entry, value in [((3, 0), 1e-3), ((3, 3), 2), ((0, 0), -1), ((0, 3), np.inf)]:
        other = A.copy()
        other[entry] = value
        assert not rb.is_se(other), entry


@pytest.mark.parametrize("is_member", [rb.is_so, rb.is_se])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e200])
def test_membership_never_fails_on_values(is_member, value):
    for n in (1, 2, 3) if is_member is rb.is_so else (2, 3):
        for atol in (1e-9, np.inf)[: 1 if np.isfinite(value) else 2]:
            assert not is_member(np.full((2, n, n), value), atol).any()


def condition(M, R):
    """‖M‖ over the sum of the two smallest eigenvalues of RᵀM: what rounding grows by."""
    return np.linalg.norm(M, axis=(-2, -1)) / oracles.two_smallest_eigenvalues(R.mT @ M)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_of_many_matrices_the_first_that_is_not_finite_is_named(value):
    M = np.random.default_rng(9).normal(size=(200_000, 3, 3))
    M[777, 1, 2] = M[778, 0, 0] = M[199_999, 2, 2] = value
    for shape, index in (((-1,), "777"), ((500, 400), "1, 377")):
        with pytest.raises(ValueError, match=rf"^M\[{index}, 1, 2\] is {value}"):
            rb.project_so(M.reshape(*shape, 3, 3))


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
    mixed = [U * d @ V for d in ([1, 0.5, -0.499], [1, 1e-5, 0], [1, 0.6, -0.2])]
    mixed += [factor * good for factor in (1, -1, 2.0**900, 2.0**-900, 1e150, 1e-150)]
    M = rng.permutation(np.concatenate(mixed))
    alone = np.array([rb.project_so(m) for m in M])
    size = condition(M / np.abs(M).max(axis=(-2, -1), keepdims=True), alone)
    M[7], alone[7] = 0, rb.project_so(np.zeros((3, 3)))
    R = rb.project_so(M)
    assert np.all(np.abs(R - alone) < 4 * EPS * (1 + size[:, None, None]))
    assert np.array_equal(R[7], alone[7])
    assert_members(R)


def test_at_most_three_times_the_memory_of_matrices_and_projections_is_taken():
    M = np.random.default_rng(11).normal(size=(300_000, 3, 3))
    tracemalloc.start()
    try:
        R = rb.project_so(M)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert M.nbytes + peak < 3 * (M.nbytes + R.nbytes)


def test_is_so_is_se_and_is_unit_quaternion_pass_defects_up_to_1e_9():
    for share, passes in ((0.98, True), (1.02, False)):
        longer = 1 + share * 1e-9
        stretched = np.diag([longer**0.5, 1 / longer**0.5, 1])  # det 1, defect of MᵀM as wanted
        assert rb.is_so(stretched) == passes
        assert rb.is_se(rb.pose_from_components(stretched, [1, 2, 3])) == passes
        assert rb.is_unit_quaternion([longer, 0, 0, 0]) == passes
