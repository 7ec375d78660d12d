"""Tables of poses in text files: their lines, the meanings of their columns, and exact times."""

from __future__ import annotations

import csv
import logging
import os
import re
from collections.abc import Collection, Sequence
from contextlib import suppress
from decimal import Context, Decimal
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import as_positive, as_single
from rbcourse._numerics import Array

File: TypeAlias = str | os.PathLike[str]
Columns: TypeAlias = dict[str, int]
"""The place of each column by its meaning."""

POSITION, QUATERNION = ["x", "y", "z"], ["qw", "qx", "qy", "qz"]
FORMATS = {
    "csv": ["time", *POSITION, *QUATERNION],
    "euroc": ["time", *POSITION, *QUATERNION],
    "tum": ["time", *POSITION, "qx", "qy", "qz", "qw"],
    "kitti": ["r11", "r12", "r13", "x", "r21", "r22", "r23", "y", "r31", "r32", "r33", "z"],
}
"""The meanings of the columns in files without names of columns."""
VELOCITIES = {
    "wx body [rad/s]": "wx",
    "wy body [rad/s]": "wy",
    "wz body [rad/s]": "wz",
    "vx body [m/s]": "vx",
    "vy body [m/s]": "vy",
    "vz body [m/s]": "vz",
}
"""The meanings of the columns of velocities, which have exactly these names."""
EXACT = Context(prec=60)
DIGITS = {"s": 0, "ms": 3, "us": 6, "ns": 9}
"""The units of time, and their decimal places as fractions of a second."""
LENGTHS = {"m": 1.0, "cm": 100.0, "mm": 1000.0}
"""The units of length in a metre."""
_SPELLINGS = {
    "s": "s sec secs second seconds",
    "ms": "ms msec millisecond milliseconds",
    "us": "us µs μs usec microsecond microseconds",
    "ns": "ns nsec nanosecond nanoseconds",
    "m": "m meter meters metre metres",
    "cm": "cm centimeter centimeters centimetre centimetres",
    "mm": "mm millimeter millimeters millimetre millimetres",
}
_UNITS = {word: unit for unit, words in _SPELLINGS.items() for word in words.split()}
_MEANINGS = {
    "nanoseconds": r"(.*_)?(nsec|nsecs|nanosec|nanosecs|nanoseconds)",
    "time": r"(.*_)?(time|times|timestamp|timestamps|stamp|t|sec|secs|seconds)",
    "": r"((.*_)?(p|pos|position|t|trans|translation|location)(_.*)?_?)?(?P<axis>[xyz])",
    "q": r"(.*_)?(q|quat|quaternion|orientation|rot|rotation|attitude)(_.*)?_?(?P<axis>[wxyz])",
}
"""The meanings of columns, by their names in small letters, with _ between words and no unit.

A group "axis" is a part of the meaning.
"""
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_MISSING = {"", "nan", "na", "n/a", "null", "none", "inf", "+inf", "-inf"}
_LOG = logging.getLogger("rbcourse.files")


class Recording(NamedTuple):
    """The rows of a file that are kept.

    Parameters
    ----------
    file : str or Path
        The file.
    lines : list of int
        The number of the line of each row.
    stamps : list of Decimal
        The exact times in s, which increase.
    columns : dict of ndarray
        The columns by their meanings, as in `FORMATS` and `VELOCITIES`; positions are in m.
    """

    file: File
    lines: list[int]
    stamps: list[Decimal]
    columns: dict[str, Array]

    def place(self, i: int | np.intp) -> str:
        """Return the place of a row, for messages."""
        return f"{self.file}, line {self.lines[i]}"


class _Rows(NamedTuple):
    """The lines of a file that hold numbers; `separator` is None for white space.

    There are as many names as columns, or none. No cell is quoted.
    """

    file: File
    lines: list[int]
    texts: list[str]
    separator: str | None
    names: list[str]

    def place(self, i: int | np.intp) -> str:
        return f"{self.file}, line {self.lines[i]}"

    def cells(self, i: int) -> list[str]:
        return [cell.strip() for cell in self.texts[i].split(self.separator)]


def read_recording(
    file: File,
    form: str | None,
    unit: str | None,
    times: File | ArrayLike | None,
    rate: float | None,
    skip: Collection[str],
) -> Recording:
    """Read the rows of a file with poses; the arguments are those of `read_path`."""
    rows = _read_rows(file)
    timed = times is not None or rate is not None
    columns, stated, length = _named(rows) if rows.names else _unnamed(rows, form, timed)
    _check_times(rows, columns, timed)
    if form == "euroc" or any(name.lower().startswith("p_rs_r") for name in rows.names):
        stated = stated or "ns"
    unit = unit or stated
    table = _numbers(rows, list(columns.values()))
    found = dict(zip(columns, table.T, strict=True))
    for name in POSITION:
        if name in found and length != 1:
            found[name] /= length

    complete = np.isfinite(table).all(axis=1)
    if "qw" in found:  # many programs write zeros where they have lost the body
        complete &= np.any([found[name] for name in QUATERNION], axis=0)
    dropped = {"nan": np.flatnonzero(~complete).tolist()}
    if dropped["nan"] and "nan" not in skip:
        i = dropped["nan"][0]
        raise ValueError(
            f"{rows.place(i)}: a number is missing or the quaternion is 0 in "
            f"{rows.texts[i][:60]!r}; skip='nan' leaves such rows out"
        )
    if not complete.any():
        raise ValueError(f"{file}: no row has all its numbers")
    kept: list[int] = np.flatnonzero(complete).tolist()

    if timed:
        given = _given_times(times, rate, len(table), unit or "s")
        stamps = [given[i] for i in kept]
    else:
        stamps = _stamps(rows, kept, columns, unit or "s")
    if unit is None:
        _check_unit(rows.place(kept[0]), stamps)
    dropped |= {"repeated": [], "unordered": []}
    ordered, increasing, last = list[int](), list[Decimal](), Decimal("-inf")
    for i, stamp in zip(kept, stamps, strict=True):
        if stamp > last:
            ordered.append(i)
            increasing.append(stamp)
            last = stamp
            continue
        kind, why = ("repeated", "equal to") if stamp == last else ("unordered", "earlier than")
        if kind not in skip:
            raise ValueError(
                f"{rows.place(i)}: the time {stamp:f} is {why} the time {last:f} of a row before; "
                f"skip={kind!r} leaves such rows out"
            )
        dropped[kind].append(i)
    for kind, which in dropped.items():
        if which:
            some = ", ".join(str(rows.lines[i]) for i in which[:8]) + ", …" * (len(which) > 8)
            _LOG.warning("%s: left out %s rows (%d), in line %s", file, kind, len(which), some)
    columns_kept = {name: column[ordered] for name, column in found.items()}
    return Recording(file, [rows.lines[i] for i in ordered], increasing, columns_kept)


def text_lines(file: File) -> list[str]:
    """Return the lines of a text file, without blank lines at the end.

    A last line without a line end raises ValueError, because the file may have been cut there.
    """
    with open(file, "rb") as stream:
        content = stream.read()
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = len(re.split(rb"\r\n|\n|\r", content[: error.start]))
        raise ValueError(
            f"{file}, line {line}: the text is not in UTF-8; save the file as text in UTF-8"
        ) from error
    if text and text.rstrip(" \t")[-1:] not in ("\n", "\r"):
        line = len(re.split("\r\n|\n|\r", text))
        raise ValueError(
            f"{file}, line {line}: the line has no line end, so the file may be cut; if it is "
            "complete, add a line end"
        )
    return text.rstrip(" \t\r\n").replace("\r\n", "\n").replace("\r", "\n").split("\n")


def split_line(place: str, line: str, separator: str = ",") -> list[str]:
    """Return the cells of a line, which may be quoted."""
    try:
        row = next(csv.reader([line], delimiter=separator, strict=True), [])
    except csv.Error as error:
        raise ValueError(f"{place}: {error}") from error
    return [cell.strip(" \t") for cell in row]


def to_number(place: str, cell: str) -> float:
    """Return a cell as a finite number, or raise a ValueError that names its place."""
    number = float(cell) if _NUMBER.fullmatch(cell) else np.nan
    if not np.isfinite(number):
        raise ValueError(f"{place}: a finite number is wanted, got {cell[:40]!r}")
    return number


def _read_rows(file: File) -> _Rows:
    """Read the lines of a file without comments, and the names of its columns if it has them.

    A comment begins with #, or at the start of a line with %. The names are in the last line before
    the numbers, or in a comment before them.
    """
    lines, texts, heads = list[int](), list[str](), list[tuple[int, str, bool]]()
    for number, line in enumerate(text_lines(file), start=1):
        text = line.strip(" ")
        comment = text.startswith(("#", "%"))
        if "#" in text and not comment:
            text = text.partition("#")[0]
        if not text.strip():
            continue
        if not comment and (texts or _has_number(text)):
            lines.append(number)
            texts.append(text)
        elif not texts:
            heads.append((number, text.lstrip("#% "), comment))
    if not texts:
        raise ValueError(f"{file}: a pose is wanted, but the file has no line with numbers")
    separator, decimal_comma = _separator(texts[0])
    if decimal_comma:
        texts = [text.replace(",", ".") for text in texts]
    if separator and any('"' in text for text in texts):
        cells = [
            split_line(f"{file}, line {n}", t, separator) for n, t in zip(lines, texts, strict=True)
        ]
        texts = [separator.join(c.replace(separator, " ") for c in row) for row in cells]
    rows = _Rows(file, lines, texts, separator, [])
    return rows._replace(names=_header(rows, heads))


def _has_number(text: str) -> bool:
    """Return whether a cell of a line is a number, or NaN."""
    words = re.split(r"[\s,;\"]+", text)
    return any(_NUMBER.fullmatch(word) or word.lower() == "nan" for word in words)


def _separator(line: str) -> tuple[str | None, bool]:
    """Return the separator of the columns of a line, and whether its decimals have commas."""
    if ";" in line:
        return ";", True
    words = line.split()
    decimal_comma = (
        "." not in line
        and len(words) > 6
        and all(re.fullmatch(r"[^,]+(,[^,]+)?", word) for word in words)
    )
    if "," in line and not decimal_comma:
        return ",", False
    return "\t" if line.strip().count("\t") == len(words) - 1 else None, decimal_comma


def _header(rows: _Rows, heads: Sequence[tuple[int, str, bool]]) -> list[str]:
    """Return the names of the columns, or an empty list."""
    first = rows.cells(0)
    for number, text, comment in reversed(heads):
        place = f"{rows.file}, line {number}"
        if separator := next((mark for mark in ";,\t" if mark in text), None):
            names = split_line(place, text, separator)
        else:  # a unit in brackets belongs to the name before it
            names = re.findall(r"[^\s\[(]+(?:\s*[\[(][^\])]*[\])])?", text)
        if len(names) > len(first) and not names[-1]:
            names.pop()
        if len(names) < len(first) and not first[-1]:
            names.append("")
        fits = len(names) == len(first)
        if not comment and not fits:
            raise ValueError(f"{place}: {len(first)} names of columns are wanted, got {len(names)}")
        if not comment or (fits and {_meaning(name)[0] for name in names}.issuperset(QUATERNION)):
            return names
    return []


def _meaning(name: str) -> tuple[str | None, str | None]:
    """Return the meaning and the unit of a column, as far as its name tells them."""
    if name in VELOCITIES:
        return VELOCITIES[name], None
    bracket = re.fullmatch(r"(.*?)\s*[\[(]([^\])]*)[\])]\s*", name)
    words = re.findall(r"[^\W_]+", (bracket[1] if bracket else name).lower())
    unit = bracket[2].strip().lower() if bracket else ""
    if not unit and len(words) > 1 and words[-1] in _UNITS and words[-1] != "nsec":
        unit = words.pop()
    for kind, pattern in _MEANINGS.items():
        if found := re.fullmatch(pattern, "_".join(words)):
            return kind + found.groupdict().get("axis", ""), _UNITS.get(unit, unit) or None
    return None, None


def _named(rows: _Rows) -> tuple[Columns, str | None, float]:
    """Return the columns that have known names, the unit of time, and the lengths in a metre."""
    found: dict[str, list[int]] = {}
    units: dict[str, str | None] = {}
    for i, name in enumerate(rows.names):
        meaning, unit = _meaning(name)
        if meaning:
            found.setdefault(meaning, []).append(i)
            units[meaning] = unit
    if len(found.get("time", [])) > 1:  # messages of ROS have a stamp besides the time of receipt
        stamps = [i for i in found["time"] if "stamp" in rows.names[i].lower()]
        found["time"] = stamps or found["time"]
    for meaning, places in found.items():
        if len(places) > 1:
            names = " and ".join(repr(rows.names[i]) for i in places[:2])
            raise ValueError(f"{rows.file}: {names} both name a column of {meaning}; rename one")
    wanted = list(QUATERNION)
    wanted += POSITION if found.keys() & set(POSITION) else []
    velocities = list(VELOCITIES.values())[: 6 if "x" in found else 3]
    wanted += velocities if found.keys() & set(velocities) else []
    if missing := [meaning for meaning in wanted if meaning not in found]:
        raise ValueError(
            f"{rows.file}: no column has the name {' or '.join(missing)}; the names are "
            f"{', '.join(rows.names)[:300]!r}. Names such as time, x, y, z, qw, qx, qy, qz are "
            "recognised; for other columns use numpy.loadtxt and pose_from_components"
        )
    lengths = {units[name] or "m" for name in POSITION if name in found} or {"m"}
    if len(lengths) > 1 or not lengths <= LENGTHS.keys():
        raise ValueError(f"{rows.file}: positions in m, cm or mm are wanted, got {lengths}")
    time = units.get("time")
    if time not in (None, *DIGITS):
        raise ValueError(f"{rows.file}: times in s, ms, us or ns are wanted, got {time!r}")
    return {meaning: i for meaning, [i] in found.items()}, time, LENGTHS[lengths.pop()]


def _unnamed(rows: _Rows, form: str | None, timed: bool) -> tuple[Columns, str | None, float]:
    """Return the columns of a format, as `_named` does."""
    width, place = len(rows.cells(0)), rows.place(0)
    if form is None and width == 12:
        form = "kitti"
    elif form is None and width in (8, 8 - timed):
        if rows.separator in (",", ";") and not str(rows.file).lower().endswith(".tum"):
            raise ValueError(
                f"{place}: {width} columns without names: format='tum' reads quaternions (x, y, z, "
                "w), format='csv' (w, x, y, z), and format='euroc' these with times in ns"
            )
        form = "tum"
    if form is None:
        hints = {
            7: "If these are TUM poses without times, times= or rate= gives the times",
            13: "If these are KITTI poses after another column, remove it",
            16: "numpy.loadtxt(file).reshape(-1, 4, 4) reads 4 × 4 matrices",
        }
        raise ValueError(
            f"{place}: {width} columns without names are wanted to be 8 (TUM: time, position, "
            "quaternion (x, y, z, w)) or 12 (KITTI: three rows of a pose). "
            + hints.get(width, "Write names such as time,x,y,z,qw,qx,qy,qz in the first line")
        )
    meanings = FORMATS[form][1:] if timed and width == 7 else FORMATS[form]
    if width < len(meanings) or (form == "kitti" and width > 12):
        raise ValueError(
            f"{place}: {len(meanings)} columns are wanted for format={form!r}, got {width}"
        )
    return {meaning: i for i, meaning in enumerate(meanings)}, None, 1.0


def _check_times(rows: _Rows, columns: Columns, timed: bool) -> None:
    """Check that the times come either from the file or from the arguments."""
    if timed and "time" in columns:
        raise ValueError(f"times, rate: {rows.file} has times, in column {columns['time'] + 1}")
    if not timed and "time" not in columns:
        kind = "names no column of times" if rows.names else "is a KITTI file, without times"
        raise ValueError(
            f"{rows.file} {kind}: times= takes a file with a time in each line, or the times, and "
            "rate= the number of poses in a second"
        )


def _numbers(rows: _Rows, chosen: Sequence[int]) -> Array:
    """Return the numbers in the chosen columns, shape (rows, columns); NaN if they are missing."""
    width = len(rows.cells(0))
    if rows.separator is None:
        widths = (len(text.split()) for text in rows.texts)
    else:
        widths = (text.count(rows.separator) + 1 for text in rows.texts)
    for i, each in enumerate(widths):
        if each != width:
            raise ValueError(f"{rows.place(i)}: {width} columns are wanted, got {each}")
    with suppress(ValueError):  # of missing or wrong numbers; 10 times as fast as below
        return np.loadtxt(
            rows.texts, delimiter=rows.separator, usecols=chosen, comments=None, ndmin=2
        )
    names = rows.names or [f"column {i + 1}" for i in range(width)]
    table = np.full((len(rows.texts), len(chosen)), np.nan)
    for i, row in enumerate(table):
        cells = rows.cells(i)
        for k, column in enumerate(chosen):
            if cells[column].lower() not in _MISSING:
                row[k] = to_number(f"{rows.place(i)}, {names[column]}", cells[column])
    return table


def _stamps(rows: _Rows, kept: Sequence[int], columns: Columns, unit: str) -> list[Decimal]:
    """Return the exact times of the kept rows, in s."""

    def column_of(column: int, digits: int) -> list[Decimal]:
        cells = (rows.texts[i].split(rows.separator, column + 1)[column] for i in kept)
        exact = list(map(Decimal, cells))
        return [EXACT.scaleb(x, -digits) for x in exact] if digits else exact

    stamps = column_of(columns["time"], DIGITS[unit])
    if "nanoseconds" in columns:  # after whole seconds
        parts = column_of(columns["nanoseconds"], 9)
        stamps = [EXACT.add(whole, part) for whole, part in zip(stamps, parts, strict=True)]
    return stamps


def _given_times(
    times: File | ArrayLike | None, rate: float | None, count: int, unit: str
) -> list[Decimal]:
    """Return exact times in s that are not in the file of the poses."""
    if rate is not None:
        rate = as_positive("rate", rate)
        return [Decimal(i / rate) for i in range(count)]
    if isinstance(times, str | os.PathLike):
        cells = [(n, line.strip()) for n, line in enumerate(text_lines(times), start=1)]
        cells = [(n, cell) for n, cell in cells if cell and cell[0] not in "#%"]
        for n, cell in cells:
            to_number(f"{times}, line {n}", cell)
        stamps = [Decimal(cell) for _, cell in cells]
    else:
        stamps = list(map(Decimal, as_single("times", np.asarray(times), "N").tolist()))
    if len(stamps) != count:
        raise ValueError(f"times: {count} are wanted, one for each pose, got {len(stamps)}")
    return [EXACT.scaleb(stamp, -DIGITS[unit]) for stamp in stamps]


def _check_unit(place: str, stamps: Sequence[Decimal]) -> None:
    """Refuse times that cannot be in s: after the year 5000, or a quarter of an hour apart."""
    times = np.array(stamps, dtype=float)
    first, step = abs(times[0]), np.median(np.abs(np.diff(times))) if len(times) > 1 else 0
    if first >= 1e11:
        unit = "ms" if first < 1e14 else "us" if first < 1e17 else "ns"
    elif step >= 1e3:
        unit = "us" if step < 1e6 else "ns"
    else:
        return
    raise ValueError(
        f"{place}: the times begin at {stamps[0]:f}, and their steps have the median {step:.6g}; "
        f"unit={unit!r} converts them to s, and unit='s' reads them as they are"
    )
