"""What is compared: for each task the methods, on the same fresh input."""

import subprocess
import sys
import tempfile
from dataclasses import replace
from functools import partial
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter

import rbcourse as rb
from benchmarks.chains import LEGS, chain_of_poses
from benchmarks.closed_forms import closed_forms, closed_forms_with_derivatives
from benchmarks.contest import OURS, Contest, Method
from benchmarks.optima import CASES, one_body, one_optimum, stacked_bodies, stacked_optimum, surveys
from benchmarks.rotations import (
    geodesic,
    nearest_rotation,
    projected_cubic,
    projected_cubic_with_derivatives,
    random_quaternions,
    random_rotations,
)
from rbcourse.draw import animate, bodies

SIZES = tuple(10**k for k in range(7))


def all_contests(peers, rng, sizes=SIZES, cases=tuple(CASES), problems=1000, frames=100):
    """Yield every contest, one after the other: the smaller N first.

    Parameters
    ----------
    peers : dict of str to module
        Those that are installed.
    rng : numpy.random.Generator
        Where the inputs come from.
    sizes : sequence of int, optional
        The N of the tasks that have one.
    cases : sequence of str, optional
        The problems of the paper.
    problems, frames : int, optional
        Of how many problems the stack is, and of how many frames the GIF.
    """
    for task in (
        nearest_rotation,
        geodesic,
        projected_cubic,
        projected_cubic_with_derivatives,
        random_rotations,
        random_quaternions,
    ):
        for n in sizes:
            yield replace(task(n, peers, rng), weigh=n == max(sizes))
    for task in (closed_forms, closed_forms_with_derivatives):
        yield from (task(n, rng) for n in sizes[::3])
    for legs in LEGS:
        yield from (chain_of_poses(n, rng, legs) for n in sizes[::3])
    yield from (one_optimum(case) for case in cases)
    yield stacked_optimum(problems, rng)
    yield from (one_body(case) for case in cases)
    yield stacked_bodies(problems, rng)
    yield surveys(2 * problems, rng)
    yield imports()
    yield cubes(frames)


def imports():
    """Return the contest of a new Python that imports one thing."""
    lines = {
        OURS: "import rbcourse",
        "NumPy": "import numpy",
        "SciPy": "from scipy.spatial.transform import Rotation",
        "Python alone": "pass",
    }
    methods = [
        Method(name, line, partial(subprocess.run, [sys.executable, "-c", line], check=True), _done)
        for name, line in lines.items()
    ]
    return Contest("import", "", 1, methods)


def _done(process):
    return np.array(process.returncode)


def cubes(frames):
    """Return the contest of the GIF of two cubes: ours, and matplotlib's own writer."""
    fig, update = moving_cubes(frames)
    other = moving_cubes(frames)
    methods = [
        Method(
            OURS,
            "animate.gif",
            lambda: animate.gif(animate.indexed(animate.render(fig, update, frames)), seconds=4),
            len,
        ),
        Method("matplotlib", "FuncAnimation, PillowWriter", lambda: film(*other, frames), len),
    ]
    return Contest("cubes as GIF", "", frames, methods)


def moving_cubes(frames):
    """Return a new figure, and what moves the cubes on it."""
    t = np.linspace(0, 1, frames)
    A1 = rb.pose_from_coordinates([np.pi / 6, 2 * np.pi / 3, np.pi / 2, 8, 10, 12])
    ways = {"screw": rb.screw_se3(np.eye(4), A1), "geodesic": rb.geodesic_se3(np.eye(4), A1)}
    panes = {"layout": "none", "subplot_kw": {"projection": "space"}}
    fig, axes = plt.subplots(1, 2, figsize=(8, 4), dpi=80, **panes)
    motions = {name: way(t) for name, way in ways.items()}
    return fig, bodies.moving_boxes(axes, motions, edges=2)


def film(fig, update, frames):
    """Return the GIF as matplotlib writes it: everything is drawn for each frame."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cubes.gif"
        FuncAnimation(fig, update, frames=frames).save(path, writer=PillowWriter(fps=25), dpi=80)
        return path.read_bytes()
