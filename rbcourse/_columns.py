"""The meanings of the columns of a table of poses, by their names or their order."""

from __future__ import annotations

import logging
import re
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

if TYPE_CHECKING:
    from rbcourse._tables import Rows

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
UNITS = {word: unit for unit, words in _SPELLINGS.items() for word in words.split()}
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
_BODIES = "child_frame_id", "frame_id", "device_id", "vehiclename", "vehicle", "body", "object"
_COUNTERS = "id", "name"
"""Names of columns that tell which of several bodies a row belongs to; in each row of one body, the
last two may have another value."""
_SWITCH = {"True", "true", "False", "false", ""}
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
LOG = logging.getLogger("rbcourse.files")


def meaning(name: str) -> tuple[str | None, str | None]:
    """Return the meaning and the unit of a column, as far as its name tells them."""
    if name in VELOCITIES:
        return VELOCITIES[name], None
    bracket = re.fullmatch(r"(.*?)\s*[\[(]([^\])]*)[\])]\s*", name)
    words = _words(bracket[1] if bracket else name)
    unit = bracket[2].strip().lower() if bracket else ""
    if re.fullmatch(_MEANINGS["nanoseconds"], "_".join(words)):
        return "nanoseconds", None
    if not unit and len(words) > 1 and words[-1] in UNITS:
        unit = words.pop()
    plain = "_".join(words)
    for kind, pattern in _MEANINGS.items():
        if (found := re.fullmatch(pattern, plain)) and not _OTHER.fullmatch(plain):
            return kind + found.groupdict().get("axis", ""), UNITS.get(unit, unit) or None
    return None, None


def _words(name: str) -> list[str]:
    """Return the words of a name such as accX or acc_x."""
    return re.findall(r"[^\W_]+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower())


def _body(name: str) -> str:
    """Return the first word in the name of a column that is not the kind of its number, or ""."""
    words = _words(re.sub(r"[\[(].*", "", name))
    return next((word for word in words if not _KIND.fullmatch(word) and word not in UNITS), "")


class Layout(NamedTuple):
    """The columns to read, the unit of the times if it is known, and the lengths in a metre."""

    columns: Columns
    unit: str | None = None
    metre: float = 1.0


def layout(rows: Rows, form: str | None, unit: str | None, timed: bool) -> Layout:
    """Return the columns of a table; `timed` tells that the times are not in the file."""
    found = _named(rows, form, unit) if rows.names else Layout(_unnamed(rows, form, timed))
    _check_times(rows, found.columns, timed)
    _check_one_body(rows, found.columns)
    if form == "euroc" or any(name.lower().startswith("p_rs_r") for name in rows.names):
        return found._replace(unit=found.unit or "ns")
    return found


def _named(rows: Rows, form: str | None, unit: str | None) -> Layout:
    """Return the columns that have known names.

    The unit of time is the given one, or the one in the name of its column.
    """
    found, units = _found(rows)
    _check_parts(rows, found)
    quaternions = "qw" in found or not found.keys() & set(MATRIX)
    _check_complete(rows, found, quaternions)
    lengths = {units[name] or "m" for name in POSITION if name in found} or {"m"}
    if len(lengths) > 1 or not lengths <= LENGTHS.keys():
        raise ValueError(f"{rows.file}: positions in m, cm or mm are wanted, got {lengths}")
    time = unit or units.get("time")
    if time not in (None, *DIGITS):
        raise ValueError(
            f"{rows.file}: times in s, ms, us or ns are wanted, got {time!r}; unit= gives the unit"
        )
    unused = MATRIX if quaternions else ()
    columns = {meaning: i for meaning, i in found.items() if meaning not in unused}
    if form is not None:
        given = {name: i for i, name in enumerate(FORMATS[form])}
        if any(columns[name] != given.get(name) for name in QUATERNION):
            raise ValueError(f"format: {rows.file} has names of columns, in another order")
    return Layout(columns, time, LENGTHS[lengths.pop()])


def _found(rows: Rows) -> tuple[Columns, dict[str, str | None]]:
    """Return the place of each meaning, and the unit in the name of its column."""
    places: dict[str, list[int]] = {}
    units: dict[str, str | None] = {}
    for i, name in enumerate(rows.names):
        known, unit = meaning(name)
        if known:
            places.setdefault(known, []).append(i)
            units[known] = unit
    if "r00" in places:  # the indices begin with 0
        if "r33" in places:
            raise ValueError(
                f"{rows.file}: r00 to r22 or r11 to r33 are wanted, got r00 and r33; format= may "
                "be a list of names for all columns, with '-' for those that are not read"
            )
        places = {ONE_BASED.get(known, known): where for known, where in places.items()}
    if "time" not in places and not rows.names[0] and rows.has_dates(0):
        places["time"] = [0]  # the index of pandas
    if "nanoseconds" in places and "time" not in places:
        places["time"], units["time"] = places.pop("nanoseconds"), "ns"
    if len(places.get("time", [])) > 1:  # messages of ROS have a stamp besides the time of receipt
        stamps = [i for i in places["time"] if "stamp" in rows.names[i].lower()]
        places["time"] = stamps or places["time"]
    for known, where in places.items():
        if len(where) > 1:
            names = " and ".join(repr(rows.names[i]) for i in where[:2])
            raise ValueError(
                f"{rows.file}: {names} both name a column of {known}; format= may be a list of "
                "names for all columns, with '-' for one of these"
            )
    return {known: i for known, [i] in places.items()}, units


def _unread(rows: Rows, found: Columns) -> list[str]:
    """Return the names that have no known meaning, without those of errors and velocities."""
    names = [name for i, name in enumerate(rows.names) if i not in found.values()]
    return [n for n in names if _words(n) and not _OTHER.fullmatch("_".join(_words(n)))]


def _check_parts(rows: Rows, found: Columns) -> None:
    """Refuse a time in two columns, and a pose whose columns may be of two bodies."""
    for name in _unread(rows, found):
        if _PART_OF_TIME.fullmatch("_".join(_words(name))):
            raise ValueError(
                f"{rows.file}: {name} may be a part of the time; write the whole time in one column"
            )
    of_pose = [rows.names[found[x]] for x in (*QUATERNION, *MATRIX, *POSITION) if x in found]
    for one, other in pairwise(of_pose):
        if (bodies := (_body(one), _body(other))) and all(bodies) and bodies[0] != bodies[1]:
            raise ValueError(
                f"{rows.file}: {other} and {one} may be of two bodies or frames; format= may be a "
                "list of names for all columns, with x, y, z, qw, qx, qy, qz for one body"
            )


def _check_complete(rows: Rows, found: Columns, quaternions: bool) -> None:
    """Refuse incomplete rotations, positions and velocities; tell if there are no positions."""
    others = _unread(rows, found)
    positions = found.keys() & set(POSITION) or any(map(_AXIS.search, others))
    velocities = list(VELOCITIES.values())[: 6 if "x" in found else 3]
    wanted = list(QUATERNION if quaternions else MATRIX)
    wanted += POSITION if positions else []
    wanted += velocities if found.keys() & set(velocities) else []
    if missing := [known for known in wanted if known not in found]:
        raise ValueError(
            f"{rows.file}: no column has the name {' or '.join(missing)}; format= may be a "
            "list of names for all columns, such as ['time', 'x', 'y', 'z', 'qw', 'qx', 'qy', "
            "'qz']. Files without quaternions need numpy.loadtxt, pose_from_components, and "
            "exp_so3 (rotation vectors) or matrix_from_zyx (yaw, pitch, roll, in rad). The names "
            f"are {', '.join(rows.names)[:300]!r}"
        )
    if "x" not in found and others:
        LOG.warning("%s: rotations without positions; not read: %s", rows.file, ", ".join(others))


def _unnamed(rows: Rows, form: str | None, timed: bool) -> Columns:
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


def _check_times(rows: Rows, columns: Columns, timed: bool) -> None:
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


def _check_one_body(rows: Rows, columns: Columns) -> None:
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
        named = _words(name)[-1:] == ["id"] or not any(map(NUMBER.fullmatch, cells))
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
