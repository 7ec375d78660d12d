"""What is compared over N: nearest rotations, curves at N times, N random rotations."""

from functools import partial

import numpy as np
from scipy.spatial.transform import Rotation, RotationSpline, Slerp

import rbcourse as rb
from benchmarks import references
from benchmarks.contest import OURS, Contest, Method
from rbcourse import textbook

SAMPLE = 100
"""So many of the N items are held against the truth."""

TURN, W0, W1 = np.pi / 6 * np.array([1, 4, 3]), np.array([1.0, 2, 3]), np.array([2.0, 1, 1])


def nearest_rotation(n, peers, rng):
    """Return the contest of the rotations nearest to n noisy ones, all with det > 0."""
    M = noisy(n, rng)
    few = _few(n)
    error = references.against(lambda: references.nearest_rotations(M[few])[0], few)
    return Contest(
        "nearest rotation",
        "noisy",
        n,
        [
            *projections(M, peers),
            Method("NumPy, SVD alone", "svd", lambda: np.linalg.svd(M), same=False),
        ],
        error,
        in_and_out=2 * M.nbytes,
    )


def projections(M, peers):
    """Return the methods for the rotations nearest to M (n, 3, 3)."""
    methods = [
        Method(OURS, "project_so", lambda: rb.project_so(M)),
        Method("textbook", "svd, with the sign", lambda: textbook.project_so(M)),
        Method("SciPy", "from_matrix, as_matrix", lambda: Rotation.from_matrix(M).as_matrix()),
    ]
    if "roma" in peers:
        roma, tensor = peers["roma"], peers["torch"].from_numpy(M)
        methods.append(
            Method("RoMa", "special_procrustes", lambda: roma.special_procrustes(tensor))
        )
    if "rotations" in peers:
        polar = peers["rotations"].robust_polar_decomposition
        each = Method("pytransform3d", "robust_polar_decomposition", lambda: [polar(A) for A in M])
        methods.append(each)
    return methods


def noisy(n, rng):
    """Return n random rotations with noise of 0.1 in each entry, of positive determinant."""
    M = rb.sample_rotation(n, rng=rng) + 0.1 * rng.standard_normal((n, 3, 3))
    left_handed = np.linalg.det(M) <= 0
    M[left_handed] *= -1
    return M


def kinds(n, rng):
    """Return the kinds of matrices (n, 3, 3) that have a nearest rotation, ever less sharply."""
    spread, gap = rng.random((n, 1)), 10 ** rng.uniform(-6, -3, (n, 1))
    values = {
        "reflected": np.array([3.0, 2, -1]) - spread,
        "rank 2": np.concatenate([1 + spread, spread + 0.1, 0 * spread], axis=1),
        "nearly degenerate": np.concatenate([np.ones((n, 1)), spread, gap - spread], axis=1),
    }
    turned = {name: _turned(s, rng) for name, s in values.items()}
    return {"noisy": noisy(n, rng), "random": rng.standard_normal((n, 3, 3)), **turned}


def _turned(s, rng):
    U, V = rb.sample_rotation(len(s), rng=rng), rb.sample_rotation(len(s), rng=rng)
    return U * s[:, None, :] @ V


def scaled_errors(peers, rng, n=SAMPLE):
    """Yield (kind, method, error) of the nearest rotation; what refuses has the error None.

    The error is the largest distance to the truth, times the sum of the two smallest eigenvalues of
    S = RᵀM, over eps ‖M‖: a method that rounds well has a few, whatever the matrix.
    """
    for kind, M in kinds(n, rng).items():
        truth, gaps = references.nearest_rotations(M)
        scale = np.abs(gaps) / (np.finfo(float).eps * np.linalg.norm(M, axis=(1, 2)))
        for method in projections(M, peers):
            try:
                found = np.asarray(method.call())
            except ValueError:
                yield kind, method.name, None
            else:
                yield kind, method.name, (references.distances(found, truth) * scale).max()


def geodesic(n, peers, rng):
    """Return the contest of the geodesic at n times; only the evaluation is timed."""
    R0, t = rb.sample_rotation(rng=rng), rng.random(n)
    R1 = R0 @ rb.exp_so3([1, -1, 1.5])
    ours, ends = rb.geodesic_so3(R0, R1), Rotation.from_matrix([R0, R1])
    theirs = Slerp([0, 1], ends)
    methods = [
        Method(OURS, "geodesic_so3", lambda: ours(t)),
        Method("textbook", "R0 exp(σ̂ t), with log", lambda: textbook.geodesic_so3(R0, R1, t)),
        Method("SciPy", "Slerp, as_matrix", lambda: theirs(t).as_matrix()),
        Method("SciPy, as Rotation", "Slerp", lambda: theirs(t), Rotation.as_matrix),
        *_slerps(ends.as_quat(), t, peers),
    ]
    few = _few(n)
    error = references.against(lambda: references.geodesic(R0, R1, t[few]), few)
    return Contest("geodesic at N times", "", n, methods, error)


def _slerps(ends, t, peers):
    """Return the peers' methods between two quaternions, their real part last."""
    methods = []
    if "roma" in peers:
        roma, tensor = peers["roma"], peers["torch"].from_numpy
        q0, q1, steps = tensor(ends[0]), tensor(ends[1]), tensor(t)
        matrices = roma.unitquat_to_rotmat
        methods += [
            Method(
                "RoMa",
                "unitquat_slerp, unitquat_to_rotmat",
                lambda: matrices(roma.unitquat_slerp(q0, q1, steps)),
            ),
            Method(
                "RoMa, as quaternions",
                "unitquat_slerp",
                lambda: roma.unitquat_slerp(q0, q1, steps),
                lambda q: np.asarray(matrices(q)),
            ),
        ]
    if "rotations" in peers:
        batch, (p0, p1) = peers["batch_rotations"], np.roll(ends, 1, axis=1)
        slerp = partial(batch.quaternion_slerp_batch, p0, p1, t, shortest_path=True)
        methods += [
            Method(
                "pytransform3d",
                "quaternion_slerp_batch, matrices_from_quaternions",
                lambda: batch.matrices_from_quaternions(slerp()),
            ),
            Method(
                "pytransform3d, as quaternions",
                "quaternion_slerp_batch",
                slerp,
                batch.matrices_from_quaternions,
            ),
        ]
    return methods


def projected_cubic(n, peers, rng):
    """Return the contest of the projected cubic at n times; only the evaluation is timed."""
    ends, t = cubic_ends(), rng.random(n)
    ours, spline = rb.projected_cubic_so3(*ends), _spline()
    R0, R1, w0, w1 = ends
    coefficients = textbook.cubic_coefficients(R0, R1, R0 @ rb.hat_so3(w0), R1 @ rb.hat_so3(w1))
    methods = [
        Method(OURS, "projected_cubic_so3", lambda: ours(t)),
        Method(
            "textbook",
            "project_so of the cubic",
            lambda: textbook.project_so(textbook.polynomial(coefficients, t[:, None, None], 0)),
        ),
        Method("SciPy, another curve", "RotationSpline", lambda: spline(t).as_matrix(), same=False),
    ]
    few = _few(n)
    error = references.against(lambda: references.projected_cubic(*ends, t[few]), few)
    return Contest("projected cubic at N times", "", n, methods, error)


def projected_cubic_with_derivatives(n, peers, rng):
    """Return the same with velocity and acceleration; the error of each is relative."""
    ends, t = cubic_ends(), rng.random(n)
    ours, spline = rb.projected_cubic_so3(*ends), _spline()
    methods = [
        Method(OURS, "projected_cubic_so3", lambda: [ours(t, order) for order in range(3)], _nines),
        Method(
            "textbook",
            "projected_cubic_so3",
            lambda: textbook.projected_cubic_so3(*ends, t),
            _nines,
        ),
        Method(
            "SciPy, another curve",
            "RotationSpline",
            lambda: [spline(t).as_matrix(), spline(t, 1), spline(t, 2)],
            same=False,
        ),
    ]
    few = _few(n)
    error = references.against_orders(
        lambda: references.projected_cubic(*ends, t[few], derivatives=True), few
    )
    return Contest("projected cubic with derivatives", "", n, methods, error)


def cubic_ends():
    """Return R0, R1, w0 and w1 of BK Figure 5."""
    return np.eye(3), rb.exp_so3(TURN), W0, W1


def _spline():
    """Return SciPy's spline through five rotations of the projected cubic."""
    t = np.linspace(0, 1, 5)
    return RotationSpline(t, Rotation.from_matrix(rb.projected_cubic_so3(*cubic_ends())(t)))


def _nines(parts):
    """Return R, w and w' as R, ŵ and ŵ' with nine entries each, shape (n, 3, 9)."""
    R, *rates = parts
    return np.stack([A.reshape(-1, 9) for A in (R, *map(rb.hat_so3, rates))], axis=1)


def _few(n):
    return np.unique(np.linspace(0, n - 1, SAMPLE).astype(int))


def random_rotations(n, peers, rng):
    """Return the contest of n random rotation matrices; the error is that of RᵀR = I."""
    methods = [
        Method(OURS, "sample_rotation", lambda: rb.sample_rotation(n, rng=rng)),
        Method("textbook", "Arvo's rotations", lambda: textbook.sample_rotation(n, rng)),
        Method("SciPy", "random, as_matrix", lambda: Rotation.random(n, rng=rng).as_matrix()),
        Method(
            "SciPy, as Rotation", "random", lambda: Rotation.random(n, rng=rng), Rotation.as_matrix
        ),
        *_torch_samples("random_rotmat", n, peers),
    ]
    return Contest("random rotation matrices", "", n, methods, _not_orthogonal)


def random_quaternions(n, peers, rng):
    """Return the contest of n random unit quaternions; the error is that of ‖q‖ = 1."""
    methods = [
        Method(OURS, "sample_quaternion", lambda: rb.sample_quaternion(n, rng=rng)),
        Method("textbook", "Shoemake's quaternions", lambda: textbook.sample_quaternion(n, rng)),
        Method("SciPy", "random, as_quat", lambda: Rotation.random(n, rng=rng).as_quat()),
        Method(
            "SciPy, as Rotation", "random", lambda: Rotation.random(n, rng=rng), Rotation.as_quat
        ),
        *_torch_samples("random_unitquat", n, peers),
    ]
    return Contest("random quaternions", "", n, methods, _not_unit)


def _torch_samples(name, n, peers):
    if "roma" not in peers:
        return []
    sample, double = getattr(peers["roma"], name), peers["torch"].float64
    return [Method("RoMa", f"{name}, float64", lambda: sample(n, dtype=double))]


def _not_orthogonal(R):
    few = R[_few(len(R))]
    return np.linalg.norm(np.swapaxes(few, -1, -2) @ few - np.eye(3), axis=(-2, -1)).max()


def _not_unit(q):
    return np.abs(np.linalg.norm(q[_few(len(q))], axis=-1) - 1).max()
