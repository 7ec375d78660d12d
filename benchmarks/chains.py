"""What is compared over N: a chain through a thousand poses, beside one of its legs, and SciPy."""

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

import rbcourse as rb
from benchmarks.contest import OURS, Contest, Method

POSES = 1000
LEGS = {"projected cubics": rb.projected_cubic_se3, "geodesics": rb.geodesic_se3}


def chain_of_poses(n, rng, legs):
    """Return the contest of a chain at n times, in their order; only the evaluation is timed."""
    when = np.cumsum(rng.uniform(0.5, 1.5, POSES))
    R = rb.exp_so3(np.cumsum(rng.normal(size=(POSES, 3)) * 0.5, axis=0))
    poses = rb.pose_from_components(R, np.cumsum(rng.normal(size=(POSES, 3)), axis=0))
    t, share = np.linspace(when[0], when[-1], n), np.linspace(0, 1, n)
    motion = rb.chain(when, poses, leg=LEGS[legs])
    one = motion.legs[1]
    turning = RotationSpline(when, Rotation.from_matrix(R))
    path = CubicSpline(when, poses[:, :3, 3])

    def by_scipy():
        A = np.zeros((n, 4, 4))
        A[:, :3, :3], A[:, :3, 3], A[:, 3, 3] = turning(t).as_matrix(), path(t), 1
        return A

    methods = [
        Method(OURS, "chain", lambda: motion(t)),
        Method("rbcourse, one leg", LEGS[legs].__name__, lambda: one(share), same=False),
        Method("SciPy, another curve", "RotationSpline, CubicSpline", by_scipy, same=False),
    ]
    return Contest("chain at N times", legs, n, methods)
