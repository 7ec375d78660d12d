"""Time a 100-frame GIF of two cubes, beside matplotlib's own writer of the same frames."""

import tempfile
from pathlib import Path
from time import perf_counter

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter

import rbcourse as rb
from rbcourse import animate, bodies

FRAMES = 100


def cubes():
    """Return a new figure, and what moves the cubes on it."""
    t = np.linspace(0, 1, FRAMES)
    A1 = rb.pose_from_coordinates([np.pi / 6, 2 * np.pi / 3, np.pi / 2, 8, 10, 12])
    ways = {"screw": rb.screw_se3(np.eye(4), A1), "geodesic": rb.geodesic_se3(np.eye(4), A1)}
    panes = {"layout": "none", "subplot_kw": {"projection": "3d"}}
    fig, axes = plt.subplots(1, 2, figsize=(8, 4), dpi=80, **panes)
    tables = {name: bodies.motion_table(t, way(t)) for name, way in ways.items()}
    return fig, bodies.moving_cubes(axes, tables, side=2)


def ours():
    """Restore the background, draw what moves, encode with one palette."""
    fig, update = cubes()
    start = perf_counter()
    animate.gif(animate.indexed(animate.render(fig, update, FRAMES)), seconds=4)
    seconds = perf_counter() - start
    plt.close(fig)
    return seconds


def theirs():
    """Draw everything for each frame, as `FuncAnimation` and `PillowWriter` do."""
    fig, update = cubes()
    with tempfile.TemporaryDirectory() as folder:
        start = perf_counter()
        film = FuncAnimation(fig, update, frames=FRAMES)
        film.save(Path(folder) / "cubes.gif", writer=PillowWriter(fps=25), dpi=80)
        seconds = perf_counter() - start
    plt.close(fig)
    return seconds


if __name__ == "__main__":
    rounds = np.array([(ours(), theirs()) for _ in range(5)])
    mine, other = np.median(rounds, axis=0)
    ratio = np.median(rounds[:, 1] / rounds[:, 0])
    print(f"ours {mine:.2f} s, PillowWriter {other:.2f} s, ratio {ratio:.1f}")
