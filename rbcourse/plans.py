"""Plans and paths: what is commanded, and the states that come of it; as arrays and as files.

A plan is a list of commands (velocity, duration). A path is an array of states, one row each.
"""

import csv
import io
import re
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._numerics import Array, as_count, as_single, check_broadcast

Plan: TypeAlias = Iterable[tuple[ArrayLike, float]]
Commands: TypeAlias = list[tuple[Array, float]]

STATES = {"planar": ["x [m]", "y [m]", "theta [rad]"], "joints": ["theta{} [rad]"]}
"""The columns of the path of a planar body and of an arm; joints are numbered from 0."""
VELOCITIES = {
    "world": ["vx world [m/s]", "vy world [m/s]", "vtheta [rad/s]"],
    "body": ["vx body [m/s]", "vy body [m/s]", "vtheta [rad/s]"],
    "joints": ["v{} [rad/s]"],
}
"""The columns of a plan before the duration, for each frame of the plane, and for joints."""
DURATION = "duration [s]"
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


def as_plan(plan: Plan, size: int | str) -> Commands:
    """Return a plan as a list of commands, all of it checked before any is obeyed.

    Parameters
    ----------
    plan : iterable of (velocity, duration)
        Velocities of `size` numbers, durations from 0 up. There may be none.
    size : int or "n"
        How many numbers a velocity has; "n" takes any.

    Returns
    -------
    list of (ndarray, float)

    Raises
    ------
    ValueError
        If the plan, or one of its commands, is none; the message says which and why.

    Examples
    --------
    >>> as_plan([([1, 0], 2)], 2)
    [(array([1., 0.]), 2.0)]
    >>> as_plan([([1, 0], 2), ([1, 0], -2)], 2)
    Traceback (most recent call last):
    ...
    ValueError: plan[1] duration is -2.0, a duration from 0 up is wanted
    """
    try:
        commands = iter(plan)
    except TypeError as error:
        raise ValueError(f"plan: a list of (velocity, duration) wanted, got {plan!r}") from error
    return [_command(f"plan[{i}]", command, size) for i, command in enumerate(commands)]


def interpolate(start: Array, goal: Array, steps: int) -> Array:
    """Return (1 − t) start + t goal at steps + 1 even times t in [0, 1], time first.

    What is the same at both ends stays the same, which rounding would not grant.
    """
    t = np.linspace(0, 1, as_count("steps", steps) + 1)
    batch = check_broadcast(start=(start, 1), goal=(goal, 1))
    t = t.reshape(-1, *[1] * (len(batch) + 1))
    return np.where(start == goal, start, (1 - t) * start + t * goal)


def propagate(start: Array, plan: Plan, move: Callable[[Array, Array], Array] = np.add) -> Array:
    """Return the states from a start on, one more than commands, time first.

    Each comes of the one before it by ``move(state, velocity * duration)``.
    """
    path = [start]
    for i, (velocity, duration) in enumerate(as_plan(plan, start.shape[-1])):
        try:
            with np.errstate(over="raise"):
                path.append(move(path[-1], velocity * duration))
        except FloatingPointError as error:
            raise ValueError(f"plan[{i}] leads beyond all numbers") from error
    return np.array(path)


def save_plan(file: str | Path, plan: Plan, kind: str) -> None:
    """Write a plan as CSV: a line of names with their units, then a line for each command.

    Parameters
    ----------
    file : str or Path
        Where to write; a file that is there is replaced.
    plan : iterable of (velocity, duration)
        Velocities of three numbers in the plane, and of any number for joints; durations from
        0 up, in s. There may be none.
    kind : {"world", "body", "joints"}
        What the velocities are: of the plane, in the frame of the world or of the body, or of
        joints. The names of the columns tell it.

    Raises
    ------
    ValueError
        If the plan, or one of its commands, is none, or the kind is unknown; nothing is written.

    See Also
    --------
    load_plan : The way back, to the same numbers.
    propagate_planar, propagate_joints : What comes of a plan.

    References
    ----------
    RR 3.2, RR 4.2.
    """
    commands = as_plan(plan, "n")  # how many joints there are, the first of them tells
    names = _names(kind, VELOCITIES, commands[0][0].size if commands else 0)
    rows = [[*velocity, duration] for velocity, duration in as_plan(commands, len(names))]
    write_csv(file, [*names, DURATION], rows)


def load_plan(file: str | Path, kind: str) -> Commands:
    """Read a plan that `save_plan` or a spreadsheet wrote; all of it, or nothing.

    Parameters
    ----------
    file : str or Path
        Comma-separated values, UTF-8; the first line has the names of the columns.
    kind : {"world", "body", "joints"}
        As for `save_plan`. A file of another kind is refused: what is meant in one frame is not
        obeyed in the other.

    Returns
    -------
    list of (ndarray, float)

    Raises
    ------
    ValueError
        If there is anything else in the file; the message gives the line and the reason.
    OSError
        If it cannot be read.

    References
    ----------
    RR 3.2, RR 4.2.
    """
    commands = []
    for line, row in _read(file, kind, VELOCITIES, DURATION):
        *velocity, duration = row
        if not velocity:
            raise ValueError(f"{line}: a velocity wanted, there is no column for it")
        commands.append(_command(f"{line}:", (velocity, duration), "n"))
    return commands


def save_path(file: str | Path, path: ArrayLike, kind: str) -> None:
    """Write a path as CSV: a line of names with their units, then a line for each state.

    Parameters
    ----------
    file : str or Path
        Where to write; a file that is there is replaced.
    path : array_like, shape (states, k)
        The poses (x, y, theta) of a planar body, k = 3, or k joint angles.
    kind : {"planar", "joints"}
        Which of the two.

    Raises
    ------
    ValueError
        If the path is none, or the kind is unknown; nothing is written.

    See Also
    --------
    load_path : The way back, to the same numbers.

    References
    ----------
    RR 3.3, RR 4.3.
    """
    states = as_path(path)
    names = _names(kind, STATES, states.shape[1])
    write_csv(file, names, as_single("path", states, "states", len(names)).tolist())


def load_path(file: str | Path, kind: str) -> Array:
    """Read a path that `save_path` or a spreadsheet wrote; all of it, or nothing.

    Parameters
    ----------
    file : str or Path
        Comma-separated values, UTF-8; the first line has the names of the columns.
    kind : {"planar", "joints"}
        As for `save_path`; a file of the other kind is refused.

    Returns
    -------
    ndarray, shape (states, k)

    Raises
    ------
    ValueError
        If there is anything else in the file, or no state; the message gives the line and the
        reason.
    OSError
        If it cannot be read.

    References
    ----------
    RR 3.3, RR 4.3.
    """
    states = [row for _, row in _read(file, kind, STATES)]
    if not states:
        raise ValueError(f"{file}, line 2: a state wanted, the file ends")
    return np.array(states)


def as_path(path: ArrayLike) -> Array:
    """Return a path as an array of shape (states, k), at least one state.

    Raises
    ------
    ValueError
        If it is none; the message names the first entry that is not finite.
    """
    return as_single("path", path, "states", "k")


def _command(name: str, command: tuple[ArrayLike, float], size: int | str) -> tuple[Array, float]:
    try:
        velocity, duration = command
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name}: (velocity, duration) wanted, got {command!r}") from error
    d = float(as_single(f"{name} duration", duration))
    if d < 0:
        raise ValueError(f"{name} duration is {d}, a duration from 0 up is wanted")
    return as_single(f"{name} velocity", velocity, size), d


def _names(kind: str, columns: dict[str, list[str]], joints: int) -> list[str]:
    """Return the names of the columns of a kind, those of joints numbered."""
    if kind not in list(columns):
        wanted = ", ".join(map(repr, columns))
        raise ValueError(f"kind: one of {wanted} wanted, got {kind!r}")
    if kind == "joints":
        return [columns[kind][0].format(i) for i in range(joints)]
    return columns[kind]


def _read(
    file: str | Path, kind: str, columns: dict[str, list[str]], *last: str
) -> Iterator[tuple[str, list[float]]]:
    """Yield the place and the numbers of each line below the first, which has to fit the kind."""
    lines = csv_lines(file)
    place, header = next(lines, (f"{file}, line 1", []))
    names = [*_names(kind, columns, len(header) - len(last)), *last]
    if header != names or not header:
        wanted = ", ".join(names) or columns[kind][0].format(0)
        raise ValueError(f"{place}: {wanted} wanted, got {', '.join(header)[:200]!r}")
    for place, row in lines:
        if len(row) != len(names):
            raise ValueError(f"{place}: numbers wanted: {len(names)}, got: {len(row)}")
        yield place, [to_number(f"{place}, {name}", x) for name, x in zip(names, row, strict=True)]


def csv_lines(file: str | Path) -> Iterator[tuple[str, list[str]]]:
    """Yield the place and the cells of each line of a CSV file."""
    for place, line in text_lines(file):
        try:
            row = next(csv.reader([line], strict=True), [])
        except csv.Error as error:
            raise ValueError(f"{place}: {error}") from error
        yield place, [cell.strip(" \t") for cell in row]


def text_lines(file: str | Path) -> Iterator[tuple[str, str]]:
    """Yield the place and the text of each line of a file; blank lines at its end are none."""
    content = Path(file).read_bytes()
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = len(re.split(rb"\r\n|\n|\r", content[: error.start]))
        raise ValueError(f"{file}, line {line}: no text in UTF-8") from error
    lines = re.split("\r\n|\n|\r", text.rstrip(" \t\r\n"))
    yield from ((f"{file}, line {number}", line) for number, line in enumerate(lines, start=1))


def write_csv(file: str | Path, names: list[str], rows: Iterable[Iterable[float]]) -> None:
    """Write a line of names, then a line for each row, with all digits that numbers need."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    writer.writerows([float(x) for x in row] for row in rows)
    write_text(file, text.getvalue())


def write_text(file: str | Path, text: str) -> None:
    """Write a text file, the same on every system."""
    Path(file).write_text(text, encoding="utf-8", newline="\n")


def to_number(place: str, cell: str) -> float:
    """Return a finite number, or raise a ValueError that says where there is none."""
    number = float(cell) if _NUMBER.fullmatch(cell) else np.nan
    if not np.isfinite(number):
        raise ValueError(f"{place}: a finite number wanted, got {cell[:40]!r}")
    return number
