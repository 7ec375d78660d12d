"""Tables of numbers in text files: their lines, their separators, and the names of columns."""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from rbcourse._columns import NUMBER, QUATERNION, UNITS, meaning
from rbcourse._numerics import Array

File: TypeAlias = str | os.PathLike[str]
_ORDER = re.compile(
    r"(?<![^\W_])(q_?[0-3wxyz]|r[wxyz]|w[\s,]*x[\s,]*y[\s,]*z|x[\s,]*y[\s,]*z[\s,]*w"
    r"|w[\s-]*(first|last)|scalar[\s-]*(first|last)|real[\s-]*(first|last))(?![^\W_])",
    re.I,
)
"""Words in a comment that may tell the order of a quaternion."""
DATE = re.compile(r"(\d{4}-\d\d-\d\d[T ]\d\d:\d\d:\d\d)(\.\d+)?\s*(Z|[+-]\d\d:?\d\d)?", re.ASCII)
"""A date with a time, as in ISO 8601: the second, its fraction, and the time zone."""
_MISSING = {"", "nan", "-nan", "nat", "na", "n/a", "#n/a", "null", "none", "inf", "+inf", "-inf"}
_MISSING |= {"-nan(ind)", "1.#qnan"}


class Rows(NamedTuple):
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

    def has_dates(self, column: int) -> bool:
        """Tell whether the first cell of a column that is not missing is a date."""
        cells = (
            cell for i in range(len(self.texts)) for cell in self.cells(i)[column : column + 1]
        )
        first = next((cell for cell in cells if cell.lower() not in _MISSING), "")
        return bool(DATE.fullmatch(first))


def read_rows(file: File, named: Sequence[str] | None) -> Rows:
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
    rows = Rows(file, lines, texts, separator, [])
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
    number = float(cell) if NUMBER.fullmatch(cell) else np.nan
    if not np.isfinite(number):
        raise ValueError(f"{place}: a finite number is wanted, got {cell[:40]!r}{hint}")
    return number


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
    return any(NUMBER.fullmatch(word) or word.lower() == "nan" for word in words)


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


def _header(rows: Rows, heads: Sequence[tuple[int, str, bool]]) -> list[str]:
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
            found = {meaning(name)[0] for name in names}
            if len(names) == width and found.issuperset(QUATERNION):
                return names
            continue
        if len(names) != width:
            raise ValueError(f"{place}: {width} names of columns are wanted, got {len(names)}")
        if not units and all(
            name.strip("[]()").lower() in {"", "1", "-", *UNITS} for name in names
        ):
            units = [name.strip("[]()") for name in names]  # below the names
            continue
        return (
            [f"{n} [{u}]" if u else n for n, u in zip(names, units, strict=True)]
            if units
            else names
        )
    return []


def numbers(rows: Rows, chosen: Sequence[int]) -> Array:
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


def _check_widths(rows: Rows, width: int) -> None:
    for i, text in enumerate(rows.texts):
        if (found := len(text.split(rows.separator))) != width:
            raise ValueError(f"{rows.place(i)}: {width} columns are wanted, got {found}")
