"""Compare new and stored results of a lesson, up to rounding differences of processors.

Results agree under the following conditions. Texts have the same bytes. Numbers in a table differ
by at most 1e-12 of the largest number in their column, or by 2 units of their eleventh digit. In a
picture, at most 1 pixel in 10,000 differs visibly, and at most 12 in a square of 16 × 16. PDF and
GIF files only have to be readable, because they are drawn like the PNG beside them. A browser draws
a living picture from whole numbers. Two living pictures agree if they have the same polygons in the
same styles, and no coordinate differs by more than one unit, 1/8 of a pixel.
"""

import base64
import csv
import difflib
import io
import json
import re
import zlib
from collections.abc import Iterator
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeAlias

import nbformat
import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from PIL import Image, ImageSequence

Numbers: TypeAlias = NDArray[np.int_]
BASE64 = r"base64,([A-Za-z0-9+/=]+)"
LIVING = r'revive\(image, (\{"size":.*\})\);'
PICTURE = re.compile(f"{LIVING}|{BASE64}")
UNIT = 1 / 8
"""The unit of coordinates in living pictures, in pixels."""


def changed_lines(stored: str, again: str) -> Iterator[str]:
    """Yield a diff of two notebooks, with checksums in place of pictures."""
    pictures = rf'revive\(image, \{{\\"size\\":.*\}}\);|{BASE64}'
    texts = stored, reconciled_notebook(stored, again)
    before, after = (re.sub(pictures, _checksum, text).split("\n") for text in texts)
    yield from difflib.unified_diff(before, after, "stored", "again", n=0, lineterm="")


def _checksum(picture: re.Match[str]) -> str:
    return f"picture {zlib.crc32(picture[0].encode()):08x}"


def reconciled_notebook(stored: str, again: str) -> str:
    """Return the new notebook; stored pictures replace new pictures that agree with them."""
    if stored == again:
        return again
    notebook = nbformat.reads(again, as_version=4)
    cells = enumerate(nbformat.reads(stored, as_version=4).cells)
    kept = {cell.get("id", number): cell for number, cell in cells}
    for number, cell in enumerate(notebook.cells):
        before = kept.get(cell.get("id", number), {})
        outputs = (each.get("outputs", []) for each in (before, cell))
        for there, here in zip(*outputs, strict=False):
            one, other = (output.get("data", {}).get("text/html") for output in (there, here))
            if one and other:
                here.data["text/html"] = reconciled(one, other)
    return nbformat.writes(notebook) + "\n"


def reconciled(stored: str, again: str) -> str:
    """Return a new page; stored pictures replace new pictures that agree with them."""
    kept = [match[0] for match in PICTURE.finditer(stored)]
    if len(kept) != len(PICTURE.findall(again)):
        return again
    pictures = iter(kept)

    def choose(found: re.Match[str]) -> str:
        there = next(pictures)
        return there if _same_in_page(there, found[0]) else found[0]

    return PICTURE.sub(choose, again)


def _same_in_page(one: str, other: str) -> bool:
    if one == other:
        return True
    living = [json.loads(match[1]) for text in (one, other) for match in re.finditer(LIVING, text)]
    if len(living) == 2:
        return same_living_pictures(*living)
    contents = (base64.b64decode(text.partition(",")[2]) for text in (one, other))
    return not living and look_the_same(*contents)


def same_living_pictures(one: dict[str, Any], other: dict[str, Any]) -> bool:
    """Tell whether the data of two living pictures of `rbcourse.draw.display.Player` agree."""
    backgrounds = (base64.b64decode(data["background"].partition(",")[2]) for data in (one, other))
    (exact, places), (exact_2, places_2) = map(_contents, (one, other))
    if exact != exact_2 or np.abs(places - places_2).max(initial=0) > 1:
        return False
    return look_the_same(*backgrounds)


def _contents(data: dict[str, Any]) -> tuple[list[Any], NDArray[np.float64]]:
    """Return the exact parts of a living picture, and its coordinates, which may differ by 1.

    Coordinates are in units of 1/8 pixel. The centres and views of scenes, which have two decimals,
    are in units of 0.015.
    """
    styles, texts = json.loads(_inflated(data["known"]))
    rest = data | dict.fromkeys(("states", "known", "background", "rooms"))
    exact = [texts, len(data["rooms"]), rest]
    places = [np.array([[*x["origin"], *x["view"]] for x in data["rooms"]]).ravel() / 0.015]
    for state in split(_inflated(data["states"])):
        exact.append(len(state))
        for style, more, points in polygons(state, styles):
            *look, outlines = style[:8]
            exact.append((look, style[8:], more, points.shape, [len(each) for each in outlines]))
            places.append(points.ravel() / UNIT)
            places += [np.reshape(each, (-1, 2)).cumsum(axis=0).ravel() for each in outlines]
    return exact, np.concatenate(places)


def _inflated(text: str) -> bytes:
    return zlib.decompress(base64.b64decode(text))


def split(content: bytes) -> list[Numbers]:
    """Return the states in the output of `rbcourse.draw.display.joined`, as arrays of numbers."""
    count = int(np.frombuffer(content, "<u4", 1)[0])
    sizes = np.frombuffer(content, "<u4", count, 4)
    numbers = np.frombuffer(content, "<i2", offset=4 * (count + 1))
    if sizes.sum() != len(numbers):
        raise ValueError(f"content: {sizes.sum()} numbers are wanted, got {len(numbers)}")
    ends = np.cumsum(sizes, dtype=int).tolist()
    return [numbers[start:end] for start, end in pairwise([0, *ends])]


def polygons(state: Numbers, styles: list[Any]) -> list[tuple[Any, bool, NDArray[np.float64]]]:
    """Return the polygons in a state of `rbcourse.draw.display.Display.record`.

    Each polygon is a tuple: its style, whether it is filled together with the polygon before it,
    and its points in pixels. Polygons in space have styles with more than eight parts, and points
    with three coordinates.
    """
    found, i = [], 0
    while i < len(state):
        style, count = styles[state[i]], int(state[i + 1])
        size = 3 if len(style) > 8 else 2
        end = i + 2 + size * abs(count)
        places = UNIT * state[i + 2 : end].astype(int).reshape(-1, size).cumsum(axis=0)
        found.append((style, count < 0, places))
        i = end
    return found


def stale_figures(drawn: Path, stored: Path) -> list[str]:
    """Return the names of drawn files that are not stored, or that differ from the stored ones."""
    return [file.name for file in sorted(drawn.iterdir()) if not _is_stored(file, stored)]


def _is_stored(file: Path, folder: Path) -> bool:
    try:
        drawn, kept = file.read_bytes(), (folder / file.name).read_bytes()
        if file.suffix == ".csv":
            return same_tables(drawn, kept)
        if file.suffix == ".png":
            return look_the_same(drawn, kept)
        return all(map(_is_readable, (drawn, kept)))
    except (OSError, ValueError):  # the stored file is missing or damaged
        return False


def _is_readable(content: bytes) -> bool:
    """Tell whether this is a complete PDF, or a picture whose frames can all be decoded."""
    if content.startswith(b"%PDF-"):
        return content.rstrip().endswith(b"%%EOF")
    with Image.open(io.BytesIO(content)) as picture:
        return all(frame.convert("RGB") for frame in ImageSequence.Iterator(picture))


@lru_cache  # a figure is compared in its file and in its notebook
def look_the_same(one: bytes, other: bytes) -> bool:
    """Tell whether two pictures agree up to rounding.

    A pixel differs visibly if a colour differs by more than 16 of 255 levels. At most 1 pixel in
    10,000 may differ visibly, and at most 12 in a square of 16 × 16; a different letter changes
    about thirty pixels. The mean difference has to be below 0.05 levels. The cuts between columns
    of axes, which are stored with the picture, may differ by a hundredth of the width.
    """
    if one == other:
        return True
    opened = [Image.open(io.BytesIO(content)) for content in (one, other)]
    cuts, cuts_2 = (np.array(each.info.get("cuts", "").split(), float) for each in opened)
    first, second = (np.asarray(each.convert("RGBA")) for each in opened)
    if first.shape != second.shape or cuts.shape != cuts_2.shape:
        return False
    if np.abs(cuts - cuts_2).max(initial=0) > 0.01:
        return False
    difference = np.abs(first.astype(int) - second)
    visibly = difference.max(axis=-1) > 16
    in_squares = np.pad(visibly.astype(int), 15)
    for axis in (0, 1) if visibly.any() else ():
        in_squares = sliding_window_view(in_squares, 16, axis).sum(axis=-1)
    return bool(difference.mean() < 0.05 and visibly.mean() < 1e-4 and in_squares.max() <= 12)


def same_tables(one: bytes, other: bytes) -> bool:
    """Tell whether two CSV files agree up to 1e-12 times the largest number in each column."""
    ours, theirs = (list(csv.reader(io.StringIO(table.decode()))) for table in (one, other))
    if [len(row) for row in ours] != [len(row) for row in theirs]:
        return False
    columns = zip(zip(*ours, strict=True), zip(*theirs, strict=True), strict=True)
    return all(a == b or _same_columns(a, b) for a, b in columns)


def _same_columns(one: tuple[str, ...], other: tuple[str, ...]) -> bool:
    if one[0] != other[0]:
        return False
    try:
        ours, theirs = (np.array(column[1:], dtype=float) for column in (one, other))
    except ValueError:  # the columns contain words that differ
        return False
    largest = np.abs(theirs).max(initial=0, where=np.isfinite(theirs))
    allowed = np.maximum(2e-11 * np.abs(theirs), max(1e-12 * largest, 1e-13))
    return bool(np.all((np.abs(ours - theirs) <= allowed) | (np.isnan(ours) & np.isnan(theirs))))
