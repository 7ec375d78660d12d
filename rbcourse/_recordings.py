"""Recordings of poses in text files: complete rows, exact times, and their units."""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence
from contextlib import suppress
from datetime import datetime
from decimal import Context, Decimal
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rbcourse._checks import as_positive, as_single
from rbcourse._columns import DIGITS, LOG, POSITION, QUATERNION, Columns, layout
from rbcourse._numerics import Array
from rbcourse._tables import DATE, File, Rows, numbers, read_rows, text_lines, to_number

EXACT = Context(prec=60)
_FEW = 0.05  # of the rows may be left out
_MOVED = 0.3  # of the rows may repeat a time with another pose
_SET_BACK = (
    "the clock was set back, a time before is wrong, or the rows are in another order; split the "
    "file, or delete the wrong row"
)


class Recording(NamedTuple):
    """The rows of a file that are kept."""

    file: File
    lines: list[int]  # the number of the line of each row
    stamps: list[Decimal]  # the exact times in s, which increase
    columns: dict[str, Array]  # by their meanings, as in `FORMATS`, `VELOCITIES`; positions in m

    def place(self, i: int | np.intp) -> str:
        """Return the place of a row, for messages."""
        return f"{self.file}, line {self.lines[i]}"


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
    timed = times is not None or rate is not None
    rows = read_rows(file, named)
    columns, stated, metre = layout(rows, form if isinstance(form, str) else None, unit, timed)
    if rate is not None and unit is not None:
        raise ValueError("unit: not with rate, which is in Hz")
    if "time" in columns and rows.has_dates(columns["time"]):
        if unit is not None:
            raise ValueError(f"unit: not with dates, which {rows.place(0)} has")
        rows, stated = _with_seconds(rows, columns["time"]), "s"
    known = unit or stated
    table = numbers(rows, list(columns.values()))
    found = dict(zip(columns, table.T, strict=True))
    for name in POSITION:
        if name in found and metre != 1:
            found[name] /= metre
    lost = _lost(found)
    if lost and "nan" not in skip:
        raise ValueError(_why_lost(rows, found, lost[0]))
    kept = sorted({*range(len(table))} - {*lost})
    if not kept:
        raise ValueError(f"{file}: no row has all its numbers")
    if timed:
        given = _given_times(times, rate, len(table), known or "s")
        stamps = [given[i] for i in kept]
    else:
        stamps = _stamps(rows, kept, columns, known or "s")
    if unit != "s" and rate is None:
        _check_unit(rows.place(kept[0]), stamps, known)
    ordered, more = _increasing(rows, kept, stamps, skip)
    _check_repeated(rows, table, kept, more["repeated"])
    for kind, which in {"nan": lost, **more}.items():
        if which:
            some = ", ".join(str(rows.lines[i]) for i in which[:8]) + ", …" * (len(which) > 8)
            LOG.warning("%s: left out %s rows (%d), in line %s", file, kind, len(which), some)
    columns_kept = {name: column[[*ordered]] for name, column in found.items()}
    return Recording(file, [rows.lines[i] for i in ordered], [*ordered.values()], columns_kept)


def _lost(found: dict[str, Array]) -> list[int]:
    """Return the rows without all numbers; many programs write a quaternion 0 for a lost body."""
    complete = np.isfinite([*found.values()]).all(axis=0)
    if "qw" in found:
        complete &= np.any([found[name] for name in QUATERNION], axis=0)
    lost: list[int] = np.flatnonzero(~complete).tolist()
    return lost


def _why_lost(rows: Rows, found: dict[str, Array], i: int) -> str:
    missing = [name for name, column in found.items() if not np.isfinite(column[i])]
    why = f"the number of {missing[0]} is missing" if missing else "the quaternion is 0"
    return f"{rows.place(i)}: {why} in {rows.texts[i][:60]!r}; skip='nan' leaves such rows out"


def _check_repeated(rows: Rows, table: Array, kept: Sequence[int], repeated: Sequence[int]) -> None:
    """Refuse many rows that have the time of the row before, and another pose."""
    moved = sum(not np.array_equal(table[i], table[i - 1]) for i in repeated)
    if moved > _MOVED * len(kept):
        raise ValueError(
            f"{rows.file}: {moved} of {len(kept)} rows have the time of a row before, and another "
            "pose: they may be of several bodies, or the clock has too few digits; if format= is a "
            "list of names with '-' for the column of the times, rate= or times= gives other times"
        )


def _increasing(
    rows: Rows, kept: Sequence[int], stamps: Sequence[Decimal], skip: Collection[str]
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


def _seconds(cell: str) -> str:
    """Return a date as the exact seconds since 1970, in UTC if it has no zone; or another cell."""
    found = DATE.fullmatch(cell.strip())
    if not found:
        return cell
    second, fraction, zone = found.groups("")
    with suppress(ValueError):  # of a day such as February 30
        whole = Decimal(int(datetime.fromisoformat(second + (zone or "Z")).timestamp()))
        return f"{EXACT.add(whole, Decimal(fraction or 0)):f}"
    return cell


def _with_seconds(rows: Rows, column: int) -> Rows:
    """Return the rows with seconds in place of the dates in a column."""
    texts = []
    for text in rows.texts:
        cells = text.split(rows.separator, column + 1)
        cells[column : column + 1] = map(_seconds, cells[column : column + 1])
        texts.append((rows.separator or " ").join(cells))
    return rows._replace(texts=texts)


def _stamps(rows: Rows, kept: Sequence[int], columns: Columns, unit: str) -> list[Decimal]:
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
