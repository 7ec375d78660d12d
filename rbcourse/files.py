"""Paths and plans in files: recordings of poses in many formats, CSV and TUM, and plans as CSV."""

from __future__ import annotations

import os
import shutil
from collections.abc import Collection, Sequence
from contextlib import suppress
from decimal import Decimal
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import as_single
from rbcourse._columns import DIGITS, FORMATS, LOG, MATRIX, POSITION, QUATERNION, VELOCITIES
from rbcourse._docs import described_by
from rbcourse._numerics import Array, blocks
from rbcourse._recordings import EXACT, Recording, read_recording
from rbcourse._tables import File, split_line, text_lines, to_number
from rbcourse.curves.curve import Curve
from rbcourse.planar import Commands, Plan, as_command, as_plan
from rbcourse.projection import is_so, project_so
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

Format: TypeAlias = Literal["csv", "tum", "euroc", "kitti"]
Skip: TypeAlias = Literal["repeated", "nan", "unordered"]
HEADER = ["time [s]", "x [m]", "y [m]", "z [m]", "qw [1]", "qx [1]", "qy [1]", "qz [1]"]
ACCELERATIONS = [
    *(f"alpha{axis} body [rad/s^2]" for axis in "xyz"),
    *(f"a{axis} body [m/s^2]" for axis in "xyz"),
]
PLANAR = {
    "world": ["vx world [m/s]", "vy world [m/s]", "vtheta [rad/s]"],
    "body": ["vx body [m/s]", "vy body [m/s]", "vtheta [rad/s]"],
}
"""The columns of a planar plan before the duration, for each frame."""
DURATION = "duration [s]"
_TOLERANCE = 1e-3  # of quaternion norms and of RᵀR; some programs write only four decimals
_FAST = 100.0  # m/s
_ROUNDED = 0.01  # of norms of quaternions with two decimals


def write_path(
    file: File,
    times: ArrayLike,
    path: Curve | ArrayLike,
    velocities: ArrayLike | None = None,
    accelerations: ArrayLike | None = None,
) -> None:
    """Write a motion or a path of poses or rotations; the file extension selects CSV or TUM.

    The first line has the names of the columns. In CSV, the names have units: time, position,
    quaternion (w, x, y, z), and, if they are known, ω and v, ω' and Rᵀ d'', all in the body frame.
    In TUM, the line is a comment, and each line has a time, position and quaternion (x, y, z, w).
    The first quaternion has w ≥ 0. The signs of the others are chosen so that each quaternion is
    near the previous one. Numbers are written with all digits. An existing file is replaced at
    once. If an argument is malformed, nothing is written.

    Parameters
    ----------
    file : str or Path
        The file name ends in ``.csv``, or for TUM (poses only) in ``.tum`` or ``.txt``.
    times : array_like, shape (N,)
        Increasing times in s.
    path : Curve, or array_like, shape (N, 4, 4) or (N, 3, 3)
        A single curve, which is evaluated at the times, with its velocities and accelerations; or
        poses or rotation matrices.
    velocities : array_like, shape (N, 6) or (N, 3), optional
        Twists (ω, v), or angular velocities ω, in the body frame, in rad/s and m/s.
    accelerations : array_like, shape (N, 6) or (N, 3), optional
        The derivatives (ω', Rᵀ d''), or ω', in the body frame, as ``curve(t, 2)`` returns them.

    Examples
    --------
    >>> import tempfile
    >>> from rbcourse import geodesic, pose_from_coordinates
    >>> c = geodesic(np.eye(4), pose_from_coordinates([0, 0, 3, 2, 0, 0]))
    >>> t = [0, 0.5, 1]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_path(f"{folder}/path.csv", t, c)
    ...     times, poses, twists = read_path(f"{folder}/path.csv")
    >>> bool(np.abs(poses - c(t)).max() < 2e-15)
    True
    """
    tum = _is_tum(file)
    if isinstance(path, Curve):
        if velocities is not None or accelerations is not None:
            raise ValueError("velocities, accelerations: those of the curve are written")
        if path.batch_shape:
            raise ValueError(f"path: a single curve is wanted, got a stack {path.batch_shape}")
        path, *rates = path.state(as_single("times", times, "N"))
        velocities, accelerations = (None, None) if tum else rates
    times, poses, velocities = check_path(times, path, velocities, "path")
    if accelerations is not None:
        if velocities is None:
            raise ValueError("accelerations: they need velocities, which come before them")
        _, columns = velocities.shape
        accelerations = as_single("accelerations", accelerations, "N", columns)
        if len(accelerations) != len(times):
            raise ValueError(
                f"accelerations: {len(times)} are wanted, one for each pose, got "
                f"{len(accelerations)}"
            )
    q = continuous_quaternions(quaternion_from_matrix(poses[:, :3, :3]))
    d = poses[:, :3, 3:].reshape(len(poses), -1)
    if tum:
        if velocities is not None:
            raise ValueError(f"velocities: TUM has no columns for them; {file} must end in .csv")
        if not d.size:
            raise ValueError(f"path: TUM cannot store rotations alone; {file} must end in .csv")
        table, header = np.column_stack([times, d, np.roll(q, -1, axis=-1)]), "timestamp tx ty tz"
        _write_table(file, f"# {header} qx qy qz qw", " ", table)
        return
    rates = [each for each in (velocities, accelerations) if each is not None]
    names = [name for name in HEADER if d.size or not name.endswith("[m]")]
    for given, columns in zip(rates, (list(VELOCITIES), ACCELERATIONS), strict=False):
        names += columns[: given.shape[1]]
    _write_table(file, ",".join(names), ",", np.column_stack([times, d, q, *rates]))


def read_path(
    file: File,
    *,
    format: Format | list[str] | tuple[str, ...] | None = None,  # noqa: A002
    unit: Literal["s", "ms", "us", "ns"] | None = None,
    times: File | ArrayLike | None = None,
    rate: float | None = None,
    start: Literal["first"] | str | float | None = None,
    skip: Skip | Collection[Skip] = (),
) -> tuple[Array, Array, Array | None]:
    """Read a path of poses or rotations from a text file: CSV, TUM, EuRoC, TUM-VI or KITTI.

    The content of the file tells its format, not its name. If a line, which may be a comment, names
    the columns, then the names tell which column has the time, x, y, z, and the components of the
    quaternion or of the matrix (r11 to r33, or r00 to r22); units such as [ns] or [mm] in the names
    are converted. Other columns are not read, except those of velocities that `write_path` wrote.
    Without names, 8 columns separated by white space are TUM (time, position, quaternion (x, y, z,
    w)), and 12 are the first three rows of a pose (KITTI). Columns are separated by commas,
    semicolons, tabs or blanks. If semicolons separate them, decimals may have commas. Blank lines
    and comments, which begin with #, may be anywhere. Each rotation is replaced by the nearest one.
    A malformed file is rejected as a whole.

    Parameters
    ----------
    file : str or Path
        A text file in UTF-8.
    format : {"csv", "tum", "euroc", "kitti"} or list of str, optional
        The order of the columns, for files that have no names of columns and can be read in two
        ways. Or a list of names, which replace those of the file: time, x, y, z, and qw, qx, qy, qz
        or r11 to r33, with units as in "x [mm]"; columns with other names, such as "-", are not
        read. Further columns at the end are not read. By default, the content tells the format.
    unit : {"s", "ms", "us", "ns"}, optional
        The unit of the times in the file. By default, the name of the column tells it, EuRoC has
        ns, and all others have s. Dates of ISO 8601, such as 2026-11-30 10:15:00.5+01:00, have no
        unit, and become seconds since 1970; without a time zone, they are read as UTC.
    times : str, Path or array_like, shape (N,), optional
        For files without times: a file with one time in each line, or the times.
    rate : float, optional
        For files without times: the number of poses in a second. The first pose has the time 0.
    start : "first" or number, optional
        The time in s that is subtracted from all times, without rounding before: "first" is the
        time of the first pose. A string has all its digits. Without it, times since 1970 lose 2e-7
        s, since doubles are rounded.
    skip : {"repeated", "nan", "unordered"} or a collection of these, optional
        Rows that are left out: those whose time equals the time before, those with a missing number
        or with a quaternion 0, and those whose time is earlier than a time before. The logger
        ``rbcourse.files`` tells their number and their lines.

    Returns
    -------
    times : ndarray, shape (N,)
        Increasing times in s.
    poses : ndarray, shape (N, 4, 4) or (N, 3, 3)
        Poses, or rotation matrices if the file has no positions.
    velocities : ndarray, shape (N, 6) or (N, 3), or None
        Twists (ω, v), or ω, in the body frame, if `write_path` wrote them.

    Raises
    ------
    ValueError
        If the format is not recognised; if times do not increase, or cannot be in s; if a number is
        missing; if the norm of a quaternion, or an entry of RᵀR, is off by more than 1e-3; or if
        the last line has no line end, since the file may be cut there, except if the last ten
        lines end with equal numbers of decimals. The message names the line, the reason, and the
        argument that helps.

    Examples
    --------
    >>> import tempfile
    >>> path = tempfile.mkdtemp() + "/recording.txt"
    >>> with open(path, "w") as file:
    ...     print("# timestamp tx ty tz qx qy qz qw", file=file)
    ...     print("1403636580.838555648 0 0 0 0 0 0 1", file=file)
    ...     print("1403636580.838555648 0 0 0 0 0 0 1", file=file)
    ...     print("1403636580.843555584 1 0 0 0 0 0.6 0.8", file=file)
    >>> times, poses, velocities = read_path(path, start="first", skip="repeated")
    >>> times, poses.shape, velocities
    (array([0.        , 0.00499994]), (2, 4, 4), None)
    """
    if not isinstance(file, str | os.PathLike):
        raise ValueError(f"file: a path is wanted, got {file!r}")
    if not isinstance(skip, Collection):
        raise ValueError(f"skip: a word or a collection of words is wanted, got {skip!r}")
    skip = [skip] if isinstance(skip, str) else list(skip)
    for name, values, known in (
        ("skip", skip, ["repeated", "nan", "unordered"]),
        ("format", [] if isinstance(format, list | tuple) else [format], [None, *FORMATS]),
        ("unit", [unit], [None, *DIGITS]),
    ):
        if wrong := [value for value in values if value not in known]:
            wanted = ", ".join(repr(each) for each in known if each)
            raise ValueError(f"{name}: one of {wanted} is wanted, got {wrong[0]!r}")
    if isinstance(format, list | tuple) and not all(isinstance(name, str) for name in format):
        raise ValueError(f"format: names of columns are wanted, got {format!r:.60}")
    if times is not None and rate is not None:
        raise ValueError("times, rate: one of them is wanted, got both")
    recording = read_recording(file, format, unit, times, rate, skip)
    columns = recording.columns
    R = _rotations(recording)
    poses = join(R, _stacked(columns, POSITION)) if "x" in columns else R
    rates = [name for name in VELOCITIES.values() if name in columns]
    seconds = _relative(recording, start)
    if "x" in columns:
        _tell_speed(file, seconds, poses[:, :3, 3])
    return seconds, poses, _stacked(columns, rates) if rates else None


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
    _write_table(file, ",".join([*names, DURATION]), ",", np.array(rows, dtype=float))


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
    lines = enumerate(text_lines(file), start=1)
    places = ((f"{file}, line {number}", line) for number, line in lines)
    rows = ((place, split_line(place, line)) for place, line in places)
    place, header = next(rows)
    names = [*_velocities(kind, max(0, len(header) - 1)), DURATION]
    if header != names:
        raise ValueError(f"{place}: {', '.join(names)} are wanted, got {', '.join(header)[:200]!r}")
    return [_command(place, names, cells) for place, cells in rows]


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
    if not isinstance(file, str | os.PathLike):
        raise ValueError(f"file: a path is wanted, got {file!r}")
    suffix = os.path.splitext(file)[1].lower()
    if suffix not in (".csv", ".tum", ".txt"):
        raise ValueError(f"file: a name that ends in .csv, .tum or .txt is wanted, got {file}")
    return suffix != ".csv"


def _rotations(recording: Recording) -> Array:
    """Return the nearest rotations of the quaternions or matrices of a recording."""
    columns = recording.columns
    if "r11" in columns:
        M = _stacked(columns, MATRIX).reshape(-1, 3, 3)
        passed = is_so(M, _TOLERANCE)
        if not passed.all():
            raise ValueError(
                f"{recording.place(np.argmin(passed))}: a rotation matrix is wanted, got "
                f"{M[np.argmin(passed)].tolist()}"
            )
        return project_so(M)
    q = _stacked(columns, QUATERNION)
    with np.errstate(over="ignore"):
        norm = np.linalg.norm(q, axis=1)
    if (wrong := np.abs(norm - 1) > _TOLERANCE).any():
        i = np.argmax(wrong)
        hint = "format= may name the columns, if these are not the quaternion"
        if np.abs(norm - 1).max() < _ROUNDED:
            hint = "write more decimals"
        raise ValueError(
            f"{recording.place(i)}: a quaternion of norm 1 is wanted, got one of {norm[i]:.6g}; "
            f"{hint}"
        )
    return matrix_from_quaternion(project_quaternion(q))


def _relative(recording: Recording, start: Any) -> Array:
    """Return the times of a recording after `start`, rounded once."""
    first = Decimal(0)
    if isinstance(start, str) and start == "first":
        first = recording.stamps[0]
    elif start is not None:
        try:
            first = Decimal(start if isinstance(start, int | str | Decimal) else float(start))
        except (ArithmeticError, TypeError, ValueError):
            first = Decimal("nan")
        if not (first.is_finite() and first.adjusted() < 300):
            raise ValueError(f"start: None, 'first' or a time in s is wanted, got {start!r:.60}")
    times = np.array([float(EXACT.subtract(stamp, first)) for stamp in recording.stamps])
    if not np.isfinite(times).all():
        raise ValueError(f"{recording.place(np.argmin(np.isfinite(times)))}: the time is too large")
    if (equal := np.flatnonzero(times[1:] <= times[:-1])).size:
        i = equal[0] + 1
        raise ValueError(
            f"{recording.place(i)}: the time {recording.stamps[i]:f} and the time before are the "
            "same double; start='first' returns times after the first one"
        )
    return times


def _tell_speed(file: File, times: Array, positions: Array) -> None:
    """Log a speed that is so high that the positions may be in mm."""
    speeds = np.linalg.norm(np.diff(positions, axis=0), axis=1) / np.diff(times)
    speed = np.median(speeds) if len(speeds) else 0.0
    if speed > _FAST:
        LOG.warning(
            "%s: the median speed is %.3g m/s; if the positions are in mm, the names of their "
            "columns, or format=, must have [mm]",
            file,
            speed,
        )


def _stacked(columns: dict[str, Array], names: Sequence[str]) -> Array:
    return np.stack([columns[name] for name in names], axis=-1)


def _write_table(file: File, header: str, separator: str, table: Array) -> None:
    """Write a line of names, and then a line for each row, with all digits of the numbers."""
    lines = [header]
    for part in blocks(len(table)):  # lists of Python's numbers take four times the memory
        lines += [separator.join(map(repr, row)) for row in table[part].tolist()]
    replace_file(file, ("\n".join(lines) + "\n").encode())


def _velocities(kind: str, joints: int) -> list[str]:
    if kind == "joints":
        return [f"v{i} [rad/s]" for i in range(joints)]
    if kind in list(PLANAR):
        return PLANAR[kind]
    wanted = ", ".join(map(repr, [*PLANAR, "joints"]))
    raise ValueError(f"kind: one of {wanted} is wanted, got {kind!r}")


def _command(place: str, names: list[str], cells: list[str]) -> tuple[Array, float]:
    if len(cells) != len(names):
        raise ValueError(f"{place}: {len(names)} numbers are wanted, got {len(cells)}")
    row = [to_number(f"{place}, {name}", x) for name, x in zip(names, cells, strict=True)]
    if len(row) == 1:
        raise ValueError(f"{place}: a velocity is wanted, but there is no column for it")
    return as_command(f"{place}:", (row[:-1], row[-1]), "n")
