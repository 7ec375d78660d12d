"""Tables of poses in text files: their lines, the meanings of their columns, and exact times."""

from __future__ import annotations

import csv
import logging
import os
import re
from collections.abc import Collection, Sequence
from contextlib import suppress
from datetime import datetime
from decimal import Context, Decimal
from itertools import pairwise
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import as_positive, as_single
from rbcourse._numerics import Array

File: TypeAlias = str | os.PathLike[str]
Columns: TypeAlias = dict[str, int]
"""The place of each column by its meaning."""

POSITION, QUATERNION = ["x", "y", "z"], ["qw", "qx", "qy", "qz"]
MATRIX = [f"r{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)]
ONE_BASED = {f"r{i}{j}": f"r{i + 1}{j + 1}" for i in (0, 1, 2) for j in (0, 1, 2)}
FORMATS = {
    "csv": ["time", *POSITION, *QUATERNION],
    "euroc": ["time", *POSITION, *QUATERNION],
    "tum": ["time", *POSITION, "qx", "qy", "qz", "qw"],
    "kitti": ["r11", "r12", "r13", "x", "r21", "r22", "r23", "y", "r31", "r32", "r33", "z"],
}
"""The meanings of the columns in files without names of columns."""
VELOCITIES = {f"w{axis} body [rad/s]": f"w{axis}" for axis in "xyz"}
VELOCITIES |= {f"v{axis} body [m/s]": f"v{axis}" for axis in "xyz"}
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
    "time": r"(.*_)?(time|times|datetime|timestamp|timestamps|stamp|t|ts|sec|secs|seconds)",
    "": r"(((.*_)?(pose|pos|position|t|trans|translation|location)|(.*_)?p(_[a-z]{1,2}){0,2})_?)?"
    r"(?P<axis>[xyz])(_(p|pos|position))?",
    "q": r"((.*_)?(quat|quaternion|orientation|rot|rotation|attitude)|(.*_)?q(_[a-z]{1,2}){0,2})_?"
    r"(?P<axis>[wxyz])",
    "r": r"((.*_)?(pose|rot|rotation)_)?r_?(?P<axis>[0-3]{2})",
}
"""The meanings of columns, by their names in small letters, with _ between words and no unit.

A group "axis" is a part of the meaning. Between p or q and the axis, EuRoC has the names of frames.
"""
_OTHER = re.compile(
    r"(.*_)?(std|stddev|err|error|cov|covariance|var|variance|sigma|vel|velocity|rate|linear|angular"
    r"|acc|accel|acceleration|twist|gyr|gyro|mag)(_.*)?|(alpha|a)[xyz]_body_.*"
)
"""Names of columns that hold no pose, although they may contain the name of an axis."""
_AXIS = re.compile(
    r"(^|[\W_])[xyzXYZ]\d*([\W_]|$)|(?<=[a-z])[XYZ](m|cm|mm)?(?![a-z])|^[xyz](pos|loc)|(pos|loc)[xyz]"
)
"""Names of columns that may hold a position, such as x1, posX, CameraX, or xpos."""
_PART_OF_TIME = re.compile(
    r"((.*_)?(time|stamp|timestamp)_)?([munµ]s|[munµ]?secs?|(milli|micro)sec(ond)?s?|mins?|minutes)"
)
"""Names of columns that hold a part of the time, beside a column of seconds."""
_KIND = re.compile(
    r"pose|pos|position|trans|translation|location|quat|quaternion|orientation|rot|rotation"
    r"|attitude|p|q|(t|p|q|pos|rot|quat)?[wxyz]|r|r?[0-3]{2}"
)
"""Words in the names of columns that do not name a body or a frame."""
_ORDER = re.compile(
    r"(?<![^\W_])(q_?[0-3wxyz]|r[wxyz]|w[\s,]*x[\s,]*y[\s,]*z|x[\s,]*y[\s,]*z[\s,]*w"
    r"|w[\s-]*(first|last)|scalar[\s-]*(first|last)|real[\s-]*(first|last))(?![^\W_])",
    re.I,
)
"""Words in a comment that may tell the order of a quaternion."""
_BODIES = "child_frame_id", "frame_id", "device_id", "vehiclename", "vehicle", "body", "object"
_COUNTERS = "id", "name"
"""Names of columns that tell which of several bodies a row belongs to; in each row of one body, the
last two may have another value."""
_SWITCH = {"True", "true", "False", "false", ""}
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_DATE = re.compile(r"(\d{4}-\d\d-\d\d[T ]\d\d:\d\d:\d\d)(\.\d+)?\s*(Z|[+-]\d\d:?\d\d)?", re.ASCII)
"""A date with a time, as in ISO 8601: the second, its fraction, and the time zone."""
_FEW = 0.05  # of the rows may be left out
_SET_BACK = "the clock was set back, or the rows are in another order; split the file"
_MISSING = {"", "nan", "-nan", "nat", "na", "n/a", "#n/a", "null", "none", "inf", "+inf", "-inf"}
_MISSING |= {"-nan(ind)", "1.#qnan"}
LOG = logging.getLogger("rbcourse.files")


class Recording(NamedTuple):
    """The rows of a file that are kept."""

    file: File
    lines: list[int]  # the number of the line of each row
    stamps: list[Decimal]  # the exact times in s, which increase
    columns: dict[str, Array]  # by their meanings, as in `FORMATS`, `VELOCITIES`; positions in m

    def place(self, i: int | np.intp) -> str:
        """Return the place of a row, for messages."""
        return f"{self.file}, line {self.lines[i]}"


class _Rows(NamedTuple):
    """The lines of a file that hold numbers; `separator` is None for white space.

    There are as many names as columns, or none. No cell is quoted. `comment` is a comment that may
    tell the order of the columns, but is not understood.
    """

    file: File
    lines: list[int]
    texts: list[str]
    separator: str | None
    names: list[str]
    comment: str = ""

    def place(self, i: int | np.intp) -> str:
        return f"{self.file}, line {self.lines[i]}"

    def cells(self, i: int) -> list[str]:
        return [cell.strip() for cell in self.texts[i].split(self.separator)]


def read_recording(
    file: File,
    form: str | Sequence[str] | None,
    unit: str | None,
    times: File | ArrayLike | None,
    rate: float | None,
    skip: Collection[str],
) -> Recording:
    """Read the rows of a file with poses; the arguments are those of `read_path`."""
    named = form if isinstance(form, list | tuple) else None
    form = form if isinstance(form, str) else None
    rows = _read_rows(file, named)
    timed = times is not None or rate is not None
    if rows.names:
        columns, stated, length = _named(rows, form, unit)
    else:
        columns, stated, length = _unnamed(rows, form, timed), None, 1.0
    _check_times(rows, columns, timed)
    _check_one_body(rows, columns)
    if rate is not None and unit is not None:
        raise ValueError("unit: not with rate, which is in Hz")
    euroc = form == "euroc" or any(name.lower().startswith("p_rs_r") for name in rows.names)
    if "time" in columns and _has_dates(rows, columns["time"]):
        if unit is not None:
            raise ValueError(f"unit: not with dates, which {rows.place(0)} has")
        rows, stated = _with_seconds(rows, columns["time"]), "s"
    known = unit or stated or ("ns" if euroc else None)
    table = _numbers(rows, list(columns.values()))
    found = dict(zip(columns, table.T, strict=True))
    for name in POSITION:
        if name in found and length != 1:
            found[name] /= length

    complete = np.isfinite(table).all(axis=1)
    if "qw" in found:  # many programs write zeros where they have lost the body
        complete &= np.any([found[name] for name in QUATERNION], axis=0)
    dropped: list[int] = np.flatnonzero(~complete).tolist()
    if dropped and "nan" not in skip:
        i = dropped[0]
        lost = [name for name, column in found.items() if not np.isfinite(column[i])]
        what = f"the number of {lost[0]} is missing" if lost else "the quaternion is 0"
        raise ValueError(
            f"{rows.place(i)}: {what} in {rows.texts[i][:60]!r}; skip='nan' leaves such rows out"
        )
    if not complete.any():
        raise ValueError(f"{file}: no row has all its numbers")
    kept: list[int] = np.flatnonzero(complete).tolist()

    if timed:
        given = _given_times(times, rate, len(table), known or "s")
        stamps = [given[i] for i in kept]
    else:
        stamps = _stamps(rows, kept, columns, known or "s")
    if unit != "s" and rate is None:
        _check_unit(rows.place(kept[0]), stamps, known)
    ordered, more = _increasing(rows, kept, stamps, skip)
    moved = sum(not np.array_equal(table[i], table[i - 1]) for i in more["repeated"])
    if moved > 0.3 * len(kept):
        raise ValueError(
            f"{file}: {moved} of {len(kept)} rows have the time of a row before, and another pose: "
            "they may be of several bodies, or the clock has too few digits; if format= is a list "
            "of names with '-' for the column of the times, rate= or times= gives other times"
        )
    for kind, which in {"nan": dropped, **more}.items():
        if which:
            some = ", ".join(str(rows.lines[i]) for i in which[:8]) + ", …" * (len(which) > 8)
            LOG.warning("%s: left out %s rows (%d), in line %s", file, kind, len(which), some)
    columns_kept = {name: column[[*ordered]] for name, column in found.items()}
    return Recording(file, [rows.lines[i] for i in ordered], [*ordered.values()], columns_kept)


def _increasing(
    rows: _Rows, kept: Sequence[int], stamps: Sequence[Decimal], skip: Collection[str]
) -> tuple[dict[int, Decimal], dict[str, list[int]]]:
    """Return the increasing times of rows, by row, and the rows that `skip` leaves out."""
    ordered, last = dict[int, Decimal](), Decimal("-inf")
    dropped: dict[str, list[int]] = {"repeated": [], "unordered": []}
    constant = len(stamps) > 2 and len(set(stamps)) == 1
    for number, (i, stamp) in enumerate(zip(kept, stamps, strict=True)):
        if stamp > last:
            ordered[i] = last = stamp
            continue
        kind, why = ("repeated", "equal to") if stamp == last else ("unordered", "earlier than")
        if constant or kind not in skip:
            cure = f"skip={kind!r} leaves such rows out"
            lost = sum(later <= last for later in stamps[number:])
            if kind == "unordered" and lost > max(10, _FEW * len(stamps)):
                cure = _SET_BACK
                wrong, *earlier = [*ordered][:-3:-1]
                before = ordered[earlier[0]] if earlier else Decimal("-inf")
                if before < stamp < stamps[number + 1]:
                    cure = f"the time in line {rows.lines[wrong]} may be wrong; delete this line"
            if constant:
                cure = "all times are equal, so they are not the times of the poses"
            raise ValueError(
                f"{rows.place(i)}: the time {_short(stamp)} is {why} the time {_short(last)} of a "
                f"row before; {cure}"
            )
        dropped[kind].append(i)
    if len(dropped["unordered"]) > max(10, _FEW * len(stamps)):
        raise ValueError(f"{rows.place(dropped['unordered'][0])}: {_SET_BACK}")
    return ordered, dropped


def text_lines(file: File) -> list[str]:
    """Return the lines of a text file, without blank lines at the end.

    A last line without a line end raises ValueError, because the file may have been cut there, but
    not if the last ten lines end with equal numbers of decimals, since a cut number has fewer.
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
    lines = text.rstrip(" \t\r\n").replace("\r\n", "\n").replace("\r", "\n").split("\n")
    ends = [re.search(r"\.\d{3,}$", line) for line in lines[-10:]]
    decimals = {len(end[0]) if end else 0 for end in ends}
    fixed = len(ends) > 2 and len(decimals) == 1 and 0 not in decimals
    if text and not fixed and text.rstrip(" \t")[-1:] not in ("\n", "\r"):
        line = len(re.split("\r\n|\n|\r", text))
        raise ValueError(
            f"{file}, line {line}: the line has no line end, so the file may be cut; if it is "
            "complete, add a line end"
        )
    return lines


def split_line(place: str, line: str, separator: str = ",") -> list[str]:
    """Return the cells of a line, which may be quoted."""
    try:
        row = next(csv.reader([line], delimiter=separator, strict=True), [])
    except csv.Error as error:
        raise ValueError(f"{place}: {error}") from error
    return [cell.strip(" \t") for cell in row]


def to_number(place: str, cell: str, hint: str = "") -> float:
    """Return a cell as a finite number, or raise a ValueError that names its place."""
    number = float(cell) if _NUMBER.fullmatch(cell) else np.nan
    if not np.isfinite(number):
        raise ValueError(f"{place}: a finite number is wanted, got {cell[:40]!r}{hint}")
    return number


def _seconds(cell: str) -> str:
    """Return a date as the exact seconds since 1970, in UTC if it has no zone; or another cell."""
    found = _DATE.fullmatch(cell.strip())
    if not found:
        return cell
    second, fraction, zone = found.groups("")
    with suppress(ValueError):  # of a day such as February 30
        whole = Decimal(int(datetime.fromisoformat(second + (zone or "Z")).timestamp()))
        return f"{EXACT.add(whole, Decimal(fraction or 0)):f}"
    return cell


def _has_dates(rows: _Rows, column: int) -> bool:
    """Tell whether the first cell of a column that is not missing is a date."""
    cells = (cell for i in range(len(rows.texts)) for cell in rows.cells(i)[column : column + 1])
    first = next((cell for cell in cells if cell.lower() not in _MISSING), "")
    return bool(_DATE.fullmatch(first))


def _with_seconds(rows: _Rows, column: int) -> _Rows:
    """Return the rows with seconds in place of the dates in a column."""
    texts = []
    for text in rows.texts:
        cells = text.split(rows.separator, column + 1)
        cells[column : column + 1] = map(_seconds, cells[column : column + 1])
        texts.append((rows.separator or " ").join(cells))
    return rows._replace(texts=texts)


def _read_rows(file: File, named: Sequence[str] | None) -> _Rows:
    """Read the lines of a file without comments, and the names of its columns if it has them.

    The names in `named` replace those of the file. A comment begins with # or %, or with # after
    and before white space. The names are in the last line before the numbers, or in a comment
    before them.
    """
    every, heads = text_lines(file), list[tuple[int, str, bool]]()
    if every[0].startswith(("Format Version", "Objects")):
        raise ValueError(
            f"{file}, line 1: for files of Motive and Vicon, docs/recording.md has code that reads "
            "them"
        )
    for number, line in enumerate(every, start=1):
        text = line.strip()
        if text and text[0] not in "#%" and _has_number(text):
            break
        if text:
            heads.append((number, text.lstrip("#% \t"), text[0] in "#%"))
    else:
        raise ValueError(f"{file}: a pose is wanted, but the file has no line with numbers")
    kept = [
        (n, line)
        for n, line in enumerate(every[number - 1 :], start=number)
        if line and not line.isspace() and line.lstrip()[0] not in "#%"
    ]
    lines, texts = [n for n, _ in kept], [line.strip(" ") for _, line in kept]
    if any("#" in text for text in texts):
        texts = [re.sub(r"\s#(\s.*)?$", "", text) for text in texts]
    separator, texts = _separated(file, lines, texts)
    rows = _Rows(file, lines, texts, separator, [])
    if named is not None:
        if len(named) > (width := len(rows.cells(0))):
            raise ValueError(
                f"{rows.place(0)}: {len(named)} columns are wanted for format={[*named]}, got "
                f"{width}"
            )
        return rows._replace(names=[*named, *[""] * (width - len(named))])
    names = _header(rows, heads)
    unread = [f"line {n}: {text}" for n, text, _ in heads if not names and _ORDER.search(text)]
    return rows._replace(names=names, comment="".join(unread[:1]))


def _separated(file: File, lines: list[int], texts: list[str]) -> tuple[str | None, list[str]]:
    """Return the separator of the columns, and lines with decimal points and without quotes."""
    separator, decimal_comma = _separator(texts[0])
    if decimal_comma and any("," in text for text in texts):
        for n, text in zip(lines, texts, strict=True):
            if "." in text and re.search(r"(^|[;\s])[+-]?\d*\.\d", text):
                raise ValueError(
                    f"{file}, line {n}: numbers have commas and points, got {text[:60]!r}"
                )
        texts = [text.replace(",", ".") for text in texts]
    if separator and any('"' in text for text in texts):
        cells = [
            split_line(f"{file}, line {n}", text, separator)
            for n, text in zip(lines, texts, strict=True)
        ]
        texts = [separator.join(c.replace(separator, " ") for c in row) for row in cells]
    return separator, texts


def _has_number(text: str) -> bool:
    """Return whether a cell of a line is a number, or NaN."""
    words = re.split(r"[,;\t\"]+" if re.search(r"[,;\t]", text) else r"[\s\"]+", text)
    words = [word.strip() for word in words]
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
    first, units = rows.cells(0), list[str]()
    width = len(first)
    for number, text, comment in reversed(heads):
        place = f"{rows.file}, line {number}"
        if separator := next((mark for mark in ";,\t" if mark in text), None):
            names = split_line(place, text, separator)
            while len(names) > width and not names[-1]:
                names.pop()
        else:  # a unit in brackets belongs to the name before it
            names = re.findall(r"[^\s\[(|]+(?:\s*[\[(][^\])]*[\])])?", text)
        if not first[-1] and len(names) == width - 1:
            names.append("")
        if comment:
            names = names[-width:]  # after words such as "columns:"
            found = {_meaning(name)[0] for name in names}
            if len(names) == width and found.issuperset(QUATERNION):
                return names
            continue
        if len(names) != width:
            raise ValueError(f"{place}: {width} names of columns are wanted, got {len(names)}")
        if not units and all(
            name.strip("[]()").lower() in {"", "1", "-", *_UNITS} for name in names
        ):
            units = [name.strip("[]()") for name in names]  # below the names
            continue
        return (
            [f"{n} [{u}]" if u else n for n, u in zip(names, units, strict=True)]
            if units
            else names
        )
    return []


def _meaning(name: str) -> tuple[str | None, str | None]:
    """Return the meaning and the unit of a column, as far as its name tells them."""
    if name in VELOCITIES:
        return VELOCITIES[name], None
    bracket = re.fullmatch(r"(.*?)\s*[\[(]([^\])]*)[\])]\s*", name)
    words = _words(bracket[1] if bracket else name)
    unit = bracket[2].strip().lower() if bracket else ""
    if re.fullmatch(_MEANINGS["nanoseconds"], "_".join(words)):
        return "nanoseconds", None
    if not unit and len(words) > 1 and words[-1] in _UNITS:
        unit = words.pop()
    plain = "_".join(words)
    for kind, pattern in _MEANINGS.items():
        if (found := re.fullmatch(pattern, plain)) and not _OTHER.fullmatch(plain):
            return kind + found.groupdict().get("axis", ""), _UNITS.get(unit, unit) or None
    return None, None


def _words(name: str) -> list[str]:
    """Return the words of a name such as accX or acc_x."""
    return re.findall(r"[^\W_]+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower())


def _body(name: str) -> str:
    """Return the first word in the name of a column that is not the kind of its number, or ""."""
    words = _words(re.sub(r"[\[(].*", "", name))
    return next((word for word in words if not _KIND.fullmatch(word) and word not in _UNITS), "")


def _named(rows: _Rows, form: str | None, unit: str | None) -> tuple[Columns, str | None, float]:
    """Return the columns that have known names, the unit of time, and the lengths in a metre.

    The unit of time is the given one, or the one in the name of its column.
    """
    found: dict[str, list[int]] = {}
    units: dict[str, str | None] = {}
    for i, name in enumerate(rows.names):
        meaning, named = _meaning(name)
        if meaning:
            found.setdefault(meaning, []).append(i)
            units[meaning] = named
    if "r00" in found:  # the indices begin with 0
        if "r33" in found:
            raise ValueError(
                f"{rows.file}: r00 to r22 or r11 to r33 are wanted, got r00 and r33; format= may "
                "be a list of names for all columns, with '-' for those that are not read"
            )
        found = {ONE_BASED.get(meaning, meaning): places for meaning, places in found.items()}
    if "time" not in found and not rows.names[0] and _has_dates(rows, 0):
        found["time"] = [0]  # the index of pandas
    if "nanoseconds" in found and "time" not in found:
        found["time"], units["time"] = found.pop("nanoseconds"), "ns"
    if len(found.get("time", [])) > 1:  # messages of ROS have a stamp besides the time of receipt
        stamps = [i for i in found["time"] if "stamp" in rows.names[i].lower()]
        found["time"] = stamps or found["time"]
    for meaning, places in found.items():
        if len(places) > 1:
            names = " and ".join(repr(rows.names[i]) for i in places[:2])
            raise ValueError(
                f"{rows.file}: {names} both name a column of {meaning}; format= may be a list of "
                "names for all columns, with '-' for one of these"
            )
    read = {i for places in found.values() for i in places}
    others = [name for i, name in enumerate(rows.names) if i not in read]
    others = [n for n in others if _words(n) and not _OTHER.fullmatch("_".join(_words(n)))]
    if parts := [name for name in others if _PART_OF_TIME.fullmatch("_".join(_words(name)))]:
        raise ValueError(
            f"{rows.file}: {parts[0]} may be a part of the time; write the whole time in one column"
        )
    of_pose = [rows.names[found[x][0]] for x in (*QUATERNION, *MATRIX, *POSITION) if x in found]
    for one, other in pairwise(of_pose):
        if (bodies := (_body(one), _body(other))) and all(bodies) and bodies[0] != bodies[1]:
            raise ValueError(
                f"{rows.file}: {other} and {one} may be of two bodies or frames; format= may be a "
                "list of names for all columns, with x, y, z, qw, qx, qy, qz for one body"
            )
    axes = list(filter(_AXIS.search, others))
    quaternions = "qw" in found or not found.keys() & set(MATRIX)
    wanted = list(QUATERNION if quaternions else MATRIX)
    wanted += POSITION if axes or found.keys() & set(POSITION) else []
    velocities = list(VELOCITIES.values())[: 6 if "x" in found else 3]
    wanted += velocities if found.keys() & set(velocities) else []
    if missing := [meaning for meaning in wanted if meaning not in found]:
        raise ValueError(
            f"{rows.file}: no column has the name {' or '.join(missing)}; format= may be a "
            "list of names for all columns, such as ['time', 'x', 'y', 'z', 'qw', 'qx', 'qy', "
            "'qz']. Files without quaternions need numpy.loadtxt, pose_from_components, and "
            "exp_so3 (rotation vectors) or matrix_from_zyx (yaw, pitch, roll, in rad). The names "
            f"are {', '.join(rows.names)[:300]!r}"
        )
    if "x" not in found and others:
        LOG.warning("%s: rotations without positions; not read: %s", rows.file, ", ".join(others))
    lengths = {units[name] or "m" for name in POSITION if name in found} or {"m"}
    if len(lengths) > 1 or not lengths <= LENGTHS.keys():
        raise ValueError(f"{rows.file}: positions in m, cm or mm are wanted, got {lengths}")
    time = unit or units.get("time")
    if time not in (None, *DIGITS):
        raise ValueError(
            f"{rows.file}: times in s, ms, us or ns are wanted, got {time!r}; unit= gives the unit"
        )
    unused = MATRIX if quaternions else ()
    columns = {meaning: i for meaning, [i] in found.items() if meaning not in unused}
    if form is not None:
        given = {name: i for i, name in enumerate(FORMATS[form])}
        if any(columns[name] != given.get(name) for name in QUATERNION):
            raise ValueError(f"format: {rows.file} has names of columns, in another order")
    return columns, time, LENGTHS[lengths.pop()]


def _unnamed(rows: _Rows, form: str | None, timed: bool) -> Columns:
    """Return the columns of a format."""
    cells, place = rows.cells(0), rows.place(0)
    width = len(cells) - (not cells[-1])  # a separator may be at the end of each line
    if form is None and rows.comment:
        raise ValueError(
            f"{rows.file}: the {width} columns are not recognised in {rows.comment[:99]!r}; "
            "format='tum' reads quaternions (x, y, z, w), and format='csv' (w, x, y, z)"
        )
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
            13: "If these are KITTI poses after a column of times, format= may be "
            f"{['time', *FORMATS['kitti']]}",
            11: "If these are times in ns, positions and quaternions (w, x, y, z), as of "
            "VINS-Fusion, format='euroc' reads them",
            16: "numpy.loadtxt(file).reshape(-1, 4, 4) reads 4 × 4 matrices",
        }
        raise ValueError(
            f"{place}: {width} columns without names are wanted to be 8 (TUM: time, position, "
            "quaternion (x, y, z, w)) or 12 (KITTI: three rows of a pose). "
            + hints.get(
                width,
                "Remove lines before the names of columns, or write names such as "
                "time,x,y,z,qw,qx,qy,qz in the first line",
            )
        )
    meanings = FORMATS[form][1:] if timed and width == 7 else FORMATS[form]
    if width < len(meanings) or (form == "kitti" and width > 12):
        raise ValueError(
            f"{place}: {len(meanings)} columns are wanted for format={form!r}, got {width}"
        )
    return {meaning: i for i, meaning in enumerate(meanings)}


def _check_times(rows: _Rows, columns: Columns, timed: bool) -> None:
    """Check that the times come either from the file or from the arguments."""
    if timed and "time" in columns:
        raise ValueError(f"times, rate: {rows.file} has times, in column {columns['time'] + 1}")
    if not timed and "time" not in columns:
        kind = "is a KITTI file, without times:"
        if rows.names:
            listed = ", ".join(rows.names)[:300]
            kind = "has no column with the name time. If one of the columns with the names "
            kind += f"{listed!r} has the times, format= may be a list of names. Otherwise"
        raise ValueError(
            f"{rows.file} {kind} times= takes a file with a time in each line, or the times, and "
            "rate= the number of poses in a second"
        )


def _check_one_body(rows: _Rows, columns: Columns) -> None:
    """Refuse rows of several bodies, such as frames of ROS.

    Also if a column that is not read has a few words, or has numbers and the name of an id, and
    changes in a quarter of the rows: a state of the recording changes less often.
    """
    for i, name in enumerate(rows.names):
        if i in columns.values() or name.lower() in _COUNTERS or not _words(name):
            continue
        cells = [
            c.strip() for text in rows.texts[:2000] for c in text.split(rows.separator)[i : i + 1]
        ]
        changes = sum(one != other for one, other in pairwise(cells))
        values = {*cells}
        few = 1 < len(values) <= min(20, len(cells) // 3) and not values <= _SWITCH
        named = _words(name)[-1:] == ["id"] or not any(map(_NUMBER.fullmatch, cells))
        if few and named and changes > len(cells) / 4:
            some = ", ".join(sorted(values)[:3])
            raise ValueError(
                f"{rows.file}: {name!r} changes between a few values ({some}), so the rows may be "
                "of several bodies; keep the rows of one, or name the column '-' in format="
            )
    for i, name in enumerate(rows.names):
        if name.lower().rpartition(".")[2] in (*_BODIES, *_COUNTERS):
            values = {text.split(rows.separator)[i].strip() for text in rows.texts}
            if len(values) > 1 and (name.lower() not in _COUNTERS or len(values) < len(rows.texts)):
                some = ", ".join(sorted(values)[:3])
                raise ValueError(
                    f"{rows.file}: {name} has several values ({some}); keep the rows of one"
                )


def _numbers(rows: _Rows, chosen: Sequence[int]) -> Array:
    """Return the numbers in the chosen columns, shape (rows, columns); NaN if they are missing."""
    width = len(rows.cells(0))
    options: dict[str, Any] = {"delimiter": rows.separator, "comments": None, "ndmin": 2}
    with suppress(ValueError):  # of missing or wrong numbers; 10 times as fast as below
        if sorted(chosen) == [*range(width)]:
            every: Array = np.loadtxt(rows.texts, **options)
            return every[:, chosen]
        _check_widths(rows, width)
        return np.loadtxt(rows.texts, usecols=chosen, **options)
    _check_widths(rows, width)
    names = rows.names or [f"column {i + 1}" for i in range(width)]
    table = np.full((len(rows.texts), len(chosen)), np.nan)
    for i, row in enumerate(table):
        cells = rows.cells(i)
        for k, column in enumerate(chosen):
            if cells[column].lower() not in _MISSING:
                dated = re.search(r"\d[:/-]\d", cells[column])
                hint = (
                    "; all times are wanted as in 2026-11-30T10:15:00.5, or none" if dated else ""
                )
                row[k] = to_number(f"{rows.place(i)}, {names[column]}", cells[column], hint)
    return table


def _check_widths(rows: _Rows, width: int) -> None:
    for i, text in enumerate(rows.texts):
        if (found := len(text.split(rows.separator))) != width:
            raise ValueError(f"{rows.place(i)}: {width} columns are wanted, got {found}")


def _stamps(rows: _Rows, kept: Sequence[int], columns: Columns, unit: str) -> list[Decimal]:
    """Return the exact times of the kept rows, in s."""

    def column_of(column: int, digits: int) -> list[Decimal]:
        cells = (rows.texts[i].split(rows.separator, column + 1)[column] for i in kept)
        exact = list(map(Decimal, cells))
        return [EXACT.scaleb(x, -digits) for x in exact] if digits else exact

    stamps = column_of(columns["time"], DIGITS[unit])
    if "nanoseconds" in columns:  # after whole seconds
        parts = column_of(columns["nanoseconds"], 9)
        for i, whole, part in zip(kept, stamps, parts, strict=True):
            if whole % 1 or not 0 <= part < 1:
                raise ValueError(
                    f"{rows.place(i)}: whole seconds, and nanoseconds below 1e9, are wanted in the "
                    f"columns of the times, got {_short(whole)} s and {1e9 * float(part):.12g} ns; "
                    "delete the name of one of them"
                )
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
            to_number(f"{times}, line {n}: one time in each line", cell)
        stamps = [Decimal(cell) for _, cell in cells]
    else:
        stamps = list(map(Decimal, as_single("times", np.asarray(times), "N").tolist()))
    if len(stamps) != count:
        raise ValueError(f"times: {count} are wanted, one for each pose, got {len(stamps)}")
    return [EXACT.scaleb(stamp, -DIGITS[unit]) for stamp in stamps]


def _check_unit(place: str, stamps: Sequence[Decimal], known: str | None) -> None:
    """Refuse times whose unit is not s, or not the unit that is known.

    Times are not in s after the year 5000, or with steps of a quarter of an hour. They may be in
    another unit if ten poses or more have steps of 1 or more, and do not begin between 1990 and
    2090. Steps below 1 µs belong to another unit.
    """
    times = np.array(stamps, dtype=float)
    first, step = abs(times[0]), np.median(np.abs(np.diff(times))) if len(times) > 1 else 0.0
    if known is not None:
        if 0 < step < 1e-6:
            raise ValueError(
                f"{place}: in {known}, the steps of the times have the median {step:.3g} s; unit= "
                "gives another unit, and unit='s' reads them as they are"
            )
        return
    unclear = len(stamps) > 9 and step >= 1 and not 6e8 < first < 4e9
    if not (first >= 1e11 or step >= 1e3 or unclear):
        return
    since_1990 = [unit for unit, digits in DIGITS.items() if 6e8 < first / 10.0**digits < 4e9]
    likely = [unit for unit, digits in DIGITS.items() if 1e-4 <= step / 10.0**digits <= 3]
    units = [*since_1990, *(unit for unit in likely if unit not in since_1990)] or list(DIGITS)
    listed = " or ".join(f"unit={unit!r}" for unit in units[:2] if unit != "s")
    raise ValueError(
        f"{place}: the times begin at {_short(stamps[0])}, and their steps have the median "
        f"{step:.6g}; {listed} converts them to s, and unit='s' reads them as they are"
    )


def _short(stamp: Decimal) -> str:
    """Return a time for a message."""
    text = f"{stamp:f}" if abs(stamp.adjusted()) < 30 else f"{stamp:.6e}"
    return text if len(text) < 40 else f"{text[:40]}…"
