"""Time a million random rotations, beside SciPy's."""

from statistics import median
from time import perf_counter

import numpy as np
from scipy.spatial.transform import Rotation

import rbcourse as rb

COUNT, ROUNDS = 1_000_000, 15
SAMPLERS = {
    "sample_quaternion": lambda rng: rb.sample_quaternion(COUNT, rng=rng),
    "sample_rotation": lambda rng: rb.sample_rotation(COUNT, rng=rng),
    "Rotation.random": lambda rng: Rotation.random(COUNT, rng=rng),
    "Rotation.random, as_matrix": lambda rng: Rotation.random(COUNT, rng=rng).as_matrix(),
}


def seconds(sampler, seed):
    """Return how long one call takes."""
    rng = np.random.default_rng(seed)
    start = perf_counter()
    sampler(rng)
    return perf_counter() - start


if __name__ == "__main__":
    rounds = [
        {name: seconds(sampler, seed) for name, sampler in SAMPLERS.items()}
        for seed in range(ROUNDS)
    ]
    theirs = median(once["Rotation.random"] for once in rounds)
    for name in SAMPLERS:
        ours = median(once[name] for once in rounds)
        print(
            f"{name:27} {1e9 * ours / COUNT:4.0f} ns each, {theirs / ours:.2f} times SciPy's speed"
        )
