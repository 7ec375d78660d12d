"""Paths and plans in files: CSV with column names and units, or TUM trajectories."""

from __future__ import annotations

import csv
import io
import os
import re
import shutil
from collections.abc import Iterable, Iterator
from contextlib import suppress
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._docs import described_by
from rbcourse._numerics import Array
from rbcourse.planar import Commands, Plan, as_command, as_plan
from rbcourse.quaternion import (
    continuous_quaternions,
    matrix_from_quaternion,
    project_quaternion,
    quaternion_from_matrix,
)
from rbcourse.se3 import check_path, join

__all__ = [
    "load_plan",
    "read_path",
    "replace_file",
    "save_plan",
    "write_path",
]

Lines: TypeAlias = list[tuple[str, str]]
File: TypeAlias = str | os.PathLike[str]
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
"""The columns of a CSV file of poses or of rotations, with or without velocities."""
TUM = ["timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw"]
"""The columns of a TUM trajectory. Its quaternions end with the scalar part; ours begin with it."""
VELOCITIES = {
    "world": ["vx world [m/s]", "vy world [m/s]", "vtheta [rad/s]"],
    "body": ["vx body [m/s]", "vy body [m/s]", "vtheta [rad/s]"],
}
"""The columns of a planar plan before the duration, for each frame."""
DURATION = "duration [s]"
_TOLERANCE = 1e-3  # of quaternion norms; some programs write only four decimals
_PLAIN = re.compile(r"[-+.,eE\d \t\n]*", re.ASCII)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


def write_path(
    file: File, times: ArrayLike, poses: ArrayLike, velocities: ArrayLike | None = None
) -> None:
    """Write a path of poses or rotations; the file extension selects CSV or TUM.

    The first line has the names of the columns. In CSV, the names have units; in TUM, the line is a
    comment. Each further line has a time, position, quaternion, ω and v. Quaternions are (w, x, y,
    z) in CSV and (x, y, z, w) in TUM. The first quaternion has w ≥ 0. The signs of the others are
    chosen so that each quaternion is near the previous one. Numbers are written with all digits. An
    existing file is replaced. If an argument is malformed, nothing is written.

    Parameters
    ----------
    file : str or Path
        The file name ends in ``.csv``, or for TUM (poses without velocities) in ``.tum`` or
        ``.txt``.
    times : array_like, shape (N,)
        Increasing times in s.
    poses : array_like, shape (N, 4, 4) or (N, 3, 3)
        Poses or rotation matrices.
    velocities : array_like, shape (N, 6) or (N, 3), optional
        Twists (ω, v), or angular velocities ω, in the body frame, in rad/s and m/s.

    Examples
    --------
    >>> import tempfile
    >>> from rbcourse import geodesic, pose_from_coordinates
    >>> c = geodesic(np.eye(4), pose_from_coordinates([0, 0, 3, 2, 0, 0]))
    >>> t = [0, 0.5, 1]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_path(f"{folder}/path.csv", t, c(t), c(t, 1))
    ...     times, poses, twists = read_path(f"{folder}/path.csv")
    >>> bool(np.abs(poses - c(t)).max() < 2e-15)
    True
    """
    times, poses, velocities = check_path(times, poses, velocities)
    q = continuous_quaternions(quaternion_from_matrix(poses[:, :3, :3]))
    d = poses[:, :3, 3:].reshape(len(poses), -1)
    if _is_tum(file):
        if velocities is not None:
            raise ValueError(f"velocities: TUM has no columns for them; {file} must end in .csv")
        if not d.size:
            raise ValueError(f"poses: TUM cannot store rotations alone; {file} must end in .csv")
        rows = np.column_stack([times, d, np.roll(q, -1, axis=-1)]).tolist()
        lines = ["# " + " ".join(TUM), *(" ".join(map(repr, row)) for row in rows), ""]
        write_text(file, "\n".join(lines))
    else:
        rates = [] if velocities is None else [velocities]
        table = np.column_stack([times, d, q, *rates])
        write_csv(file, HEADERS[d.size > 0, velocities is not None], table.tolist())


def read_path(file: File) -> tuple[Array, Array, Array | None]:
    """Read a path that `write_path` wrote, or a TUM trajectory.

    A malformed file is rejected as a whole. Each quaternion is replaced by the nearest unit
    quaternion. CSV files are in UTF-8.

    Parameters
    ----------
    file : str or Path
        A file that `write_path` wrote, or a file in TUM format, whose name ends in ``.tum`` or
        ``.txt``. In TUM, blank lines and lines that begin with # are skipped.

    Returns
    -------
    times : ndarray, shape (N,)
        Times in s.
    poses : ndarray, shape (N, 4, 4) or (N, 3, 3)
        Poses, or rotation matrices if the file has no positions.
    velocities : ndarray, shape (N, 6) or (N, 3), or None
        Twists (ω, v), or ω, in the body frame, if the file has them.

    Raises
    ------
    ValueError
        If the file has another format or no pose, if times do not increase, if the norm of a
        quaternion differs from 1 by more than 1e-3, or if the last line has no line end, since the
        file may be cut there. The message names the line and the reason.

    Examples
    --------
    >>> import tempfile
    >>> path = tempfile.mkdtemp() + "/poses.tum"  # lines of time, position and quaternion x y z w
    >>> with open(path, "w") as file:
    ...     print("0 0 0 0 0 0 0 1", file=file)
    ...     print("2 1 0 0 0 0 0.6 0.8", file=file)
    >>> times, poses, velocities = read_path(path)
    >>> times, poses.shape, velocities
    (array([0., 2.]), (2, 4, 4), None)
    """
    tum = _is_tum(file)
    moves, names, lines = _tum_lines(file) if tum else _csv_table(file)
    if not lines:
        raise ValueError(f"{file}: a pose is wanted, but the file ends")
    table = _numbers(names, lines, " " if tum else ",")
    if tum:
        table = table[:, [0, 1, 2, 3, 7, 4, 5, 6]]  # in the order of CSV
    at = 4 if moves else 1
    times, d, q, velocities = np.split(table, [1, at, at + 4], axis=1)
    if (late := np.flatnonzero(times[1:] <= times[:-1])).size:
        before, after = times[late[0] :, 0][:2]
        raise ValueError(f"{lines[late[0] + 1][0]}: a time after {before} is wanted, got {after}")
    with np.errstate(over="ignore"):
        norm = np.linalg.norm(q, axis=1)
    if (wrong := np.abs(norm - 1) > _TOLERANCE).any():
        i = np.argmax(wrong)
        raise ValueError(
            f"{lines[i][0]}: a quaternion of norm 1 is wanted, got one of {norm[i]:.6g}"
        )
    R = matrix_from_quaternion(project_quaternion(q))
    poses = join(R, d) if moves else R
    return times[:, 0], poses, velocities if velocities.size else None


def save_plan(file: File, plan: Plan, kind: str) -> None:
    """Write a plan as CSV: a line of names with units, and then a line for each command.

    An existing file is replaced; if an argument is malformed, nothing is written.
    Source: RR 3.2, RR 4.2.

    Parameters
    ----------
    file : str or Path
        The file to write.
    plan : iterable of (velocity, duration)
        A planar velocity has three numbers, and joint velocities have one for each joint. Durations
        are at least 0, in s.
    kind : {"world", "body", "joints"}
        The kind of velocities: planar velocities in the world or the body frame, or joint
        velocities. The kind determines the names of the columns.

    Examples
    --------
    >>> import tempfile
    >>> path = tempfile.mkdtemp() + "/plan.csv"
    >>> save_plan(path, [([0.5, 0, 0.1], 2.0), ([0, 0.5, 0], 1.0)], "body")
    >>> [(velocity.tolist(), duration) for velocity, duration in load_plan(path, "body")]
    [([0.5, 0.0, 0.1], 2.0), ([0.0, 0.5, 0.0], 1.0)]
    """
    commands = as_plan(plan, "n")  # the first command determines the number of joints
    names = _velocities(kind, commands[0][0].size if commands else 0)
    rows = [[*velocity, duration] for velocity, duration in as_plan(commands, len(names))]
    write_csv(file, [*names, DURATION], rows)


@described_by(save_plan, returns="list of (ndarray, float)")
def load_plan(file: File, kind: str) -> Commands:
    """Read a plan that `save_plan` or a spreadsheet wrote.

    A malformed file, or a plan of another kind, raises ValueError. The message names the line and
    the reason. The commands (velocity, duration) are as in the example of `save_plan`.
    Source: RR 3.2, RR 4.2.

    Parameters
    ----------
    file : str or Path
        A file of comma-separated values in UTF-8. The first line has the names of the columns.
    """
    lines = ((place, _cells(place, line)) for place, line in text_lines(file))
    place, header = next(lines, (f"{file}, line 1", []))
    names = [*_velocities(kind, max(0, len(header) - 1)), DURATION]
    if header != names:
        raise ValueError(f"{place}: {', '.join(names)} are wanted, got {', '.join(header)[:200]!r}")
    rows = (_row(place, names, cells) for place, cells in lines)
    return [_command(place, row) for place, row in rows]


def replace_file(file: File, content: bytes) -> None:
    """Write a file completely or not at all.

    Other programs see either the old or the new content. If writing fails or is interrupted, the
    old file remains. An existing file keeps its permissions. A symbolic link remains, and its
    target is replaced.

    Parameters
    ----------
    file : str or Path
        The folder must exist.
    content : bytes
        The new content.
    """
    target = os.path.realpath(file)
    ordinary = os.path.isfile(target) and os.access(target, os.W_OK)
    if os.path.exists(target) and not ordinary:  # writes to a device or pipe; otherwise raises
        with open(target, "wb") as stream:
            stream.write(content)
        return
    part = os.path.join(os.path.dirname(target), f".{os.urandom(8).hex()}.part")
    try:
        with open(part, "xb") as stream:
            stream.write(content)
        if ordinary:
            shutil.copymode(target, part)
        os.replace(part, target)
    except OSError as error:  # names the file and not its part
        raise OSError(error.errno, error.strerror, os.fspath(file)) from error
    finally:
        with suppress(OSError):
            os.unlink(part)


def _is_tum(file: File) -> bool:
    suffix = os.path.splitext(file)[1].lower()
    if suffix not in (".csv", ".tum", ".txt"):
        raise ValueError(f"file: a name that ends in .csv, .tum or .txt is wanted, got {file}")
    return suffix != ".csv"


def _csv_table(file: File) -> tuple[bool, list[str], Lines]:
    """Return whether a CSV file has positions, the names of its columns, and its other lines."""
    place, first = next(lines := text_lines(file), (f"{file}, line 1", ""))
    header = _cells(place, first)
    kind = next((kind for kind, names in HEADERS.items() if names == header), None)
    if kind is None:
        wanted = ", ".join(HEADERS[True, True])
        raise ValueError(
            f"{place}: the columns must be {wanted}; those of positions or velocities may be left "
            f"out. Got {', '.join(header)[:200]!r}. For other files use numpy.loadtxt and "
            "pose_from_components"
        )
    return kind[0], header, list(lines)


def _tum_lines(file: File) -> tuple[bool, list[str], Lines]:
    """Return True (TUM files have positions), the columns, and the lines that are not comments."""
    lines = ((place, line.strip()) for place, line in text_lines(file))
    return True, TUM, [(place, line) for place, line in lines if line and line[0] != "#"]


def _numbers(names: list[str], lines: Lines, separator: str) -> Array:
    """Return the numbers of lines that are not empty, shape (lines, names)."""
    text = "\n".join(line for _, line in lines)
    if _PLAIN.fullmatch(text):  # fast; otherwise, and after an error, find the first wrong place
        with suppress(ValueError):
            delimiter = None if separator == " " else separator
            table: Array = np.loadtxt(io.StringIO(text), delimiter=delimiter, ndmin=2)
            if table.shape == (len(lines), len(names)) and np.isfinite(table).all():
                return table
    cells = (
        (place, line.split() if separator == " " else _cells(place, line)) for place, line in lines
    )
    return np.array([_row(place, names, row)[1] for place, row in cells])


def _velocities(kind: str, joints: int) -> list[str]:
    if kind == "joints":
        return [f"v{i} [rad/s]" for i in range(joints)]
    if kind in list(VELOCITIES):
        return VELOCITIES[kind]
    wanted = ", ".join(map(repr, [*VELOCITIES, "joints"]))
    raise ValueError(f"kind: one of {wanted} is wanted, got {kind!r}")


def _command(place: str, row: list[float]) -> tuple[Array, float]:
    if len(row) == 1:
        raise ValueError(f"{place}: a velocity is wanted, but there is no column for it")
    return as_command(f"{place}:", (row[:-1], row[-1]), "n")


def _row(place: str, names: list[str], cells: list[str]) -> tuple[str, list[float]]:
    if len(cells) != len(names):
        raise ValueError(f"{place}: {len(names)} numbers are wanted, got {len(cells)}")
    numbers = zip(names, cells, strict=True)
    return place, [to_number(f"{place}, {name}", cell) for name, cell in numbers]


def _cells(place: str, line: str) -> list[str]:
    try:
        row = next(csv.reader([line], strict=True), [])
    except csv.Error as error:
        raise ValueError(f"{place}: {error}") from error
    return [cell.strip(" \t") for cell in row]


def text_lines(file: File) -> Iterator[tuple[str, str]]:
    """Yield the place and the text of each line of a file; blank lines at the end are skipped.

    A last line without a line end raises ValueError, because the file may have been cut there.
    """
    with open(file, "rb") as stream:
        content = stream.read()
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = len(re.split(rb"\r\n|\n|\r", content[: error.start]))
        raise ValueError(f"{file}, line {line}: the text is not in UTF-8") from error
    if text and text.rstrip(" \t")[-1:] not in ("\n", "\r"):
        line = len(re.split("\r\n|\n|\r", text))
        raise ValueError(
            f"{file}, line {line}: the line has no line end, so the file may be cut; if it is "
            "complete, add a line end"
        )
    lines = re.split("\r\n|\n|\r", text.rstrip(" \t\r\n"))
    yield from ((f"{file}, line {number}", line) for number, line in enumerate(lines, start=1))


def write_csv(file: File, names: list[str], rows: Iterable[Iterable[float]]) -> None:
    """Write a line of names, and then a line for each row, with all digits of the numbers."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    writer.writerows([float(x) for x in row] for row in rows)
    write_text(file, text.getvalue())


def write_text(file: File, text: str) -> None:
    """Write a text file with the same bytes on every system."""
    replace_file(file, text.encode())


def to_number(place: str, cell: str) -> float:
    """Return a cell as a finite number, or raise a ValueError that names its place."""
    number = float(cell) if _NUMBER.fullmatch(cell) else np.nan
    if not np.isfinite(number):
        raise ValueError(f"{place}: a finite number is wanted, got {cell[:40]!r}")
    return number
