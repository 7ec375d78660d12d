"""Define random problems and functionals for the tests of optima."""

import numpy as np
from scipy.spatial.transform import Rotation

import rbcourse as rb

I3, REST = np.eye(3), np.zeros(3)
ALONG = np.pi / 6 * np.array([1, 2, 3])
PAPER = {  # the rotation vector and the velocities of the paper's figures
    "4b": (ALONG, ALONG, ALONG + I3[0]),
    "4c": (ALONG, ALONG, ALONG + 5 * I3[0]),
    "5": (np.pi / 6 * np.array([1, 4, 3]), np.array([1.0, 2, 3]), np.array([2.0, 1, 1])),
}
BOOK = rb.Body.box([0.3, 0.2, 0.03]).inertia
"""The inertia of a book of 1 kg, 30 cm by 20 cm by 3 cm."""
OPTIMA = {
    "ball": lambda R0, R1, w0, w1, *_: rb.minimum_acceleration(R0, R1, w0, w1),
    "acceleration": lambda R0, R1, w0, w1, G, *_: rb.minimum_acceleration(
        R0, R1, w0, w1, body=rb.Body(G)
    ),
    "torque": lambda R0, R1, w0, w1, G, *_: rb.minimum_torque(R0, R1, w0, w1, body=rb.Body(G)),
    "jerk": lambda R0, R1, w0, w1, _, a0, a1: rb.minimum_jerk(R0, R1, w0, w1, a0, a1),
}
COSTS = {
    "ball": lambda curve, _: rb.acceleration_cost(curve),
    "acceleration": lambda curve, G: rb.acceleration_cost(curve, body=rb.Body(G)),
    "torque": lambda curve, G: rb.torque_cost(curve, body=rb.Body(G)),
    "jerk": lambda curve, _: rb.jerk_cost(curve),
}


def with_inertias(moments, rng):
    axes = Rotation.random(len(moments), rng).as_matrix()
    G = axes @ (moments[:, :, None] * axes.mT)
    return (G + G.mT) / 2


def random_problems(count, seed, turn=3.0, speed=9.0):
    """Return R0, R1, w0, w1, inertias, a0 and a1 of random problems.

    The inertias have moments up to (1, 2, 2.9) about random axes.
    """
    rng = np.random.default_rng(seed)
    vectors = rng.normal(size=(5, count, 3))
    vectors *= rng.random((5, count, 1)) / np.linalg.norm(vectors, axis=-1, keepdims=True)
    sigma, w0, w1, a0, a1 = np.reshape([turn, speed, speed, 20, 20], (5, 1, 1)) * vectors
    moments = 1 + rng.random((count, 3)) * [0, 1, 1.9]
    R0 = Rotation.random(count, rng).as_matrix()
    return [R0, R0 @ rb.exp_so3(sigma), w0, w1, with_inertias(moments, rng), a0, a1]


def bodies(count, seed):
    """Return inertias of bodies whose largest moment is up to ten times the smallest one."""
    rng = np.random.default_rng(seed)
    moments = np.sort(np.exp(rng.uniform(0, np.log(10), (20 * count, 3))), axis=1)
    return with_inertias(moments[moments @ [1, 1, -1] > 0][:count], rng)


def some(problems, which):
    return [x[which] for x in problems]


def times(A, x):
    return (A @ x[..., None])[..., 0]


def deviation(what, G, w, a, b=0):
    """Return u by an independent formula; the cost is the integral of ‖u‖²."""
    if what in ("ball", "jerk"):
        return np.sqrt(2) * (b + np.cross(w, a) / 2 if what == "jerk" else a)
    torque = times(G, a) + np.cross(w, times(G, w))
    return torque if what == "torque" else times(np.linalg.cholesky(np.linalg.inv(G)).mT, torque)
