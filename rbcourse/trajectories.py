"""Times, poses and velocities, as curves give them: as arrays, and as files for other programs."""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._numerics import Array, as_finite, as_single
from rbcourse.conversions import matrix_from_quaternion, quaternion_from_matrix
from rbcourse.plans import csv_lines, text_lines, to_number, write_csv, write_text
from rbcourse.projection import is_se, is_so
from rbcourse.quaternion import project_quaternion
from rbcourse.se3 import pose_from_components

Samples = tuple[Array, Array, Array | None]
Rows = Iterator[tuple[str, list[float]]]

TIME = ["time [s]"]
POSITION = ["x [m]", "y [m]", "z [m]"]
QUATERNION = ["qw [1]", "qx [1]", "qy [1]", "qz [1]"]
TURNING = ["wx body [rad/s]", "wy body [rad/s]", "wz body [rad/s]"]
MOVING = ["vx body [m/s]", "vy body [m/s]", "vz body [m/s]"]
HEADERS = {
    (moves, rates): TIME + POSITION * moves + QUATERNION + (TURNING + MOVING * moves) * rates
    for moves in (True, False)
    for rates in (True, False)
}
"""The columns of a CSV file of poses, or of rotations, with velocities or without."""
TUM = ["timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw"]
"""The columns of a TUM trajectory: its quaternions end with the scalar, ours begin with it."""

_TOLERANCE = 1e-3  # of the norm of a quaternion in a file: others write four decimals


def write_path(
    file: str | Path, times: ArrayLike, poses: ArrayLike, velocities: ArrayLike | None = None
) -> None:
    """Write a path of poses or rotations, as CSV or as a TUM trajectory: the name's end tells.

    Parameters
    ----------
    file : str or Path
        ``….csv``; or ``….tum`` or ``….txt`` for TUM. A file that is there is replaced.
    times : array_like, shape (N,)
        In s, increasing.
    poses : array_like, shape (N, 4, 4) or (N, 3, 3)
        Poses, or rotation matrices, to 1e-9: these as CSV only.
    velocities : array_like, shape (N, 6) or (N, 3), optional
        Twists (ω, v), or angular velocities ω: body frame, as curves give them, in rad/s and m/s.
        As CSV only.

    Raises
    ------
    ValueError
        If the path is none, or the format has no place for it; nothing is written.

    See Also
    --------
    read_path : The way back.
    save_path : For the plane and for joints.

    Notes
    -----
    CSV: a line of names with their units and, for velocities, the frame; then a line for each time:
    time, position, quaternion (w, x, y, z), ω, v. TUM: a comment, then a line for each time: time,
    position, quaternion (x, y, z, w), with blanks between them. Numbers have all their digits. The
    first quaternion has w ≥ 0, each other the sign that is nearer to the one before.

    Examples
    --------
    >>> import tempfile
    >>> from rbcourse import geodesic_se3, pose_from_coordinates
    >>> c = geodesic_se3(np.eye(4), pose_from_coordinates([0, 0, 3, 2, 0, 0]))
    >>> t = [0, 0.5, 1]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_path(f"{folder}/path.csv", t, c(t), c(t, 1))
    ...     times, poses, twists = read_path(f"{folder}/path.csv")
    >>> bool(np.abs(poses - c(t)).max() < 2e-15)
    True
    """
    times, poses, velocities = as_samples(times, poses, velocities)
    q = _continuous(quaternion_from_matrix(poses[:, :3, :3]))
    d = poses[:, :3, 3:].reshape(len(poses), -1)
    if _is_tum(file):
        if velocities is not None:
            raise ValueError(f"velocities: TUM has no columns for them; {file} has to end in .csv")
        if not d.size:
            raise ValueError(f"poses: TUM has no rotations alone; {file} has to end in .csv")
        rows = np.column_stack([times, d, np.roll(q, -1, axis=-1)]).tolist()
        lines = ["# " + " ".join(TUM), *(" ".join(map(repr, row)) for row in rows), ""]
        write_text(file, "\n".join(lines))
    else:
        rates = [] if velocities is None else [velocities]
        table = np.column_stack([times, d, q, *rates])
        write_csv(file, HEADERS[d.size > 0, velocities is not None], table.tolist())


def read_path(file: str | Path) -> Samples:
    """Read a path that `write_path` wrote, or a TUM trajectory; all of it, or nothing.

    Parameters
    ----------
    file : str or Path
        ``….csv``, in UTF-8; or ``….tum`` or ``….txt`` for TUM, where blank lines and lines that
        begin with # are passed over.

    Returns
    -------
    times : ndarray, shape (N,)
        In s.
    poses : ndarray, shape (N, 4, 4) or (N, 3, 3)
        Poses; rotation matrices where the file has no positions.
    velocities : ndarray, shape (N, 6) or (N, 3), or None
        Twists (ω, v), or ω, body frame; None where the file has none.

    Raises
    ------
    ValueError
        If there is anything else in the file, or no pose; if times do not increase; if the norm of
        a quaternion differs from 1 by more than 1e-3. The message gives the line and the reason.
    OSError
        If it cannot be read.

    See Also
    --------
    chain : The curve through such poses.

    Notes
    -----
    Files of others give quaternions with few digits: they count as the nearest unit quaternions.
    """
    moves, rows = _tum_rows(file) if _is_tum(file) else _csv_rows(file)
    at, table, last = (4 if moves else 1), [], -math.inf
    for place, row in rows:
        if row[0] <= last:
            raise ValueError(f"{place}: a time after {last} wanted, got {row[0]}")
        norm = math.hypot(*row[at : at + 4])
        if abs(norm - 1) > _TOLERANCE:
            raise ValueError(f"{place}: a quaternion of norm 1 wanted, got one of {norm:.6g}")
        table.append(row)
        last = row[0]
    if not table:
        raise ValueError(f"{file}: a pose wanted, the file ends")
    times, d, q, velocities = np.split(np.array(table), [1, at, at + 4], axis=1)
    R = matrix_from_quaternion(project_quaternion(q))
    poses = pose_from_components(R, d) if moves else R
    return times[:, 0], poses, velocities if velocities.size else None


def as_samples(times: ArrayLike, poses: ArrayLike, velocities: ArrayLike | None = None) -> Samples:
    """Return times, poses or rotations, and velocities if there are any, as arrays.

    Raises
    ------
    ValueError
        If a shape is another, a time is not after the one before, or a matrix is no pose or no
        rotation; the message names the first.
    """
    if np.size(times) == 0:
        raise ValueError("times, poses: one or more wanted, got none")
    times, poses = as_single("times", times, "N"), as_finite("poses", poses, "n", "n")
    size = poses.shape[-1]
    if poses.ndim != 3 or size not in (3, 4):
        raise ValueError(f"poses: shape (N, 4, 4) or (N, 3, 3) wanted, got {poses.shape}")
    if len(times) != len(poses):
        raise ValueError(f"times, poses: as many of each wanted, got {len(times)} and {len(poses)}")
    late = np.flatnonzero(times[1:] <= times[:-1])
    if len(late):
        before, after = times[late[0] :][:2]
        raise ValueError(f"times[{late[0] + 1}] is {after}, a time after {before} is wanted")
    passes = is_so(poses) if size == 3 else is_se(poses)
    if not passes.all():
        what, cure = ("rotation", "project_so") if size == 3 else ("pose", "project_se")
        raise ValueError(f"poses[{np.argmin(passes)}] is no {what} ({cure} gives the nearest)")
    if velocities is not None:
        velocities = as_single("velocities", velocities, "N", 3 if size == 3 else 6)
        if len(velocities) != len(times):
            raise ValueError(f"velocities: {len(times)} wanted, one a pose, got {len(velocities)}")
    return times, poses, velocities


def _is_tum(file: str | Path) -> bool:
    """Tell TUM from CSV."""
    suffix = Path(file).suffix.lower()
    if suffix not in (".csv", ".tum", ".txt"):
        raise ValueError(f"file: a name wanted that ends in .csv, .tum or .txt, got {file}")
    return suffix != ".csv"


def _continuous(q: Array) -> Array:
    """Return quaternions in an order, each with the sign that is nearer to the one before."""
    turned = np.sum(q[1:] * q[:-1], axis=-1) < 0
    signs = np.cumprod(np.where(turned, -1.0, 1.0))
    return q * np.append(1.0, signs)[:, None] + 0.0


def _csv_rows(file: str | Path) -> tuple[bool, Rows]:
    """Return whether there are positions, and the rows of a CSV file."""
    lines = csv_lines(file)
    place, header = next(lines, (f"{file}, line 1", []))
    kind = next((kind for kind, names in HEADERS.items() if names == header), None)
    if kind is None:
        wanted = ", ".join(HEADERS[True, True])
        raise ValueError(
            f"{place}: {wanted} wanted, without positions or velocities for less, "
            f"got {', '.join(header)[:200]!r}"
        )
    return kind[0], (_row(place, header, cells) for place, cells in lines)


def _tum_rows(file: str | Path) -> tuple[bool, Rows]:
    """Return that there are positions, and the rows of a TUM file in the order of the CSV."""
    lines = ((place, line.split()) for place, line in text_lines(file))
    rows = (
        _row(place, TUM, cells) for place, cells in lines if cells and not cells[0].startswith("#")
    )
    return True, ((place, [*row[:4], row[7], *row[4:7]]) for place, row in rows)


def _row(place: str, names: list[str], cells: list[str]) -> tuple[str, list[float]]:
    if len(cells) != len(names):
        raise ValueError(f"{place}: numbers wanted: {len(names)}, got: {len(cells)}")
    numbers = zip(names, cells, strict=True)
    return place, [to_number(f"{place}, {name}", cell) for name, cell in numbers]
