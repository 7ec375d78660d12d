"""Make docs/recording.txt: a tool that is moved by hand, as a motion-capture system records it.

The tool rests for a second, moves for seven, rests for two, moves for nine, and rests again. There
are 200 poses in a second, with noise of 0.1 mm and 0.1 mrad, stamps since 1970, and random signs of
quaternions. In two rows, the cameras have lost the tool.
"""

from pathlib import Path

import numpy as np

import rbcourse as rb

COUNT, RATE, START, LOST = 4000, 200, 1_700_000_000, (700, 2900)


def true_path(t: rb.Array) -> rb.Array:
    """Return the poses without noise at times in s, shape (N, 4, 4)."""
    way = _step((t - 1) / 7) + _step((t - 10) / 9)
    turns = [0.5 * np.sin(np.pi * way), 0.4 * way * (2 - way), np.pi / 3 * way]
    places = [0.4 + 0.2 * np.cos(np.pi * way), 0.5 * way - 0.5, 0.3 + 0.15 * np.sin(2 * way)]
    return rb.pose_from_coordinates(np.transpose([*turns, *places]))


def recording() -> str:
    """Return the recording, in the format of TUM."""
    rng = np.random.default_rng(78)
    poses = true_path(np.arange(COUNT) / RATE)
    R = poses[:, :3, :3] @ rb.exp_so3(1e-4 * rng.normal(size=(COUNT, 3)))
    d = poses[:, :3, 3] + 1e-4 * rng.normal(size=(COUNT, 3))
    q = rb.quaternion_from_matrix(R) * rng.choice([-1, 1], size=(COUNT, 1))
    lines = ["# timestamp tx ty tz qx qy qz qw"]
    for i, row in enumerate(np.column_stack([d, q[:, [1, 2, 3, 0]]])):
        numbers = ["nan"] * 7 if i in LOST else [f"{x:.7f}" for x in row]
        seconds, thousandths = divmod(1000 * i // RATE, 1000)
        lines.append(" ".join([f"{START + seconds}.{thousandths:03d}", *numbers]))
    return "\n".join([*lines, ""])


def _step(x: rb.Array) -> rb.Array:
    """Return a smooth step from 0 at x = 0 to 1 at x = 1."""
    x = np.clip(x, 0, 1)
    return x**3 * (10 - 15 * x + 6 * x**2)


if __name__ == "__main__":
    Path(__file__).with_name("recording.txt").write_text(recording(), "utf-8", newline="\n")
