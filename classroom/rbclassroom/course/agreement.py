"""Compare the results of a run of a lesson with the stored ones, up to rounding.

Processors round differently. Text is the same to the byte. Numbers in a table differ by at most
1e-12 of the largest in their column, or by 2 units of their eleventh digit. Of the pixels of a
picture at most 1 in 10,000 differs visibly, and at most 12 in a square of 16 × 16. A living
picture, which a browser draws from whole numbers, has the same polygons in the same styles, and no
coordinate differs by more than one unit, 1/8 of a pixel.
"""

import base64
import csv
import difflib
import io
import json
import re
import zlib
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeAlias

import nbformat
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageSequence

Numbers: TypeAlias = NDArray[np.int_]
Polygon: TypeAlias = tuple[Any, bool, NDArray[np.float64]]
BASE64 = r"base64,([A-Za-z0-9+/=]+)"
LIVING = r'revive\(image, (\{"size":.*\})\);'
LIVING_IN_JSON = r'revive\(image, \{\\"size\\":.*\}\);'
PICTURE = re.compile(f"{LIVING}|{BASE64}")
UNIT = 1 / 8
"""The unit of places in living pictures, in pixels."""


def changed_lines(stored: str, again: str) -> Iterator[str]:
    """Yield the lines in which two notebooks differ, as a diff; pictures are shortened."""
    lines = (
        re.sub(LIVING_IN_JSON + "|" + BASE64, _checksum, text)
        for text in (stored, reconciled_notebook(stored, again))
    )
    before, after = (text.split("\n") for text in lines)
    yield from difflib.unified_diff(before, after, "stored", "again", n=0, lineterm="")


def _checksum(picture: re.Match[str]) -> str:
    return f"picture {zlib.crc32(picture[0].encode()):08x}"


def reconciled_notebook(stored: str, again: str) -> str:
    """Return a notebook that was run again, with the stored pictures where they are the same."""
    if stored == again:
        return again
    notebook = nbformat.reads(again, as_version=4)
    cells = enumerate(nbformat.reads(stored, as_version=4).cells)
    kept = {cell.get("id", number): cell for number, cell in cells}
    for number, cell in enumerate(notebook.cells):
        before = kept.get(cell.get("id", number), {})
        pairs = zip(before.get("outputs", []), cell.get("outputs", []), strict=False)
        for there, here in pairs:
            one, other = (output.get("data", {}).get("text/html") for output in (there, here))
            if one and other:
                here.data["text/html"] = reconciled(one, other)
    return nbformat.writes(notebook) + "\n"


def reconciled(stored: str, again: str) -> str:
    """Return a page that was made again, with the stored pictures where they are the same."""
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
    living = [re.fullmatch(LIVING, text) for text in (one, other)]
    if living[0] and living[1]:
        return same_living_pictures(*(json.loads(match[1]) for match in living if match))
    if living[0] or living[1]:
        return False
    return look_the_same(*(base64.b64decode(text.partition(",")[2]) for text in (one, other)))


def same_living_pictures(one: dict[str, Any], other: dict[str, Any]) -> bool:
    """Tell whether the data of two living pictures agree, see `rbcourse.draw.display.Player`."""
    compared = {"states", "known", "background", "rooms"}
    if one.keys() != other.keys() or any(one[key] != other[key] for key in one.keys() - compared):
        return False
    backgrounds = (base64.b64decode(data["background"].partition(",")[2]) for data in (one, other))
    (styles, texts), (styles_2, texts_2) = (json.loads(_inflated(x["known"])) for x in (one, other))
    states, states_2 = (split(_inflated(data["states"])) for data in (one, other))
    return (
        texts == texts_2
        and len(states) == len(states_2)
        and _same_rooms(one, other)
        and look_the_same(*backgrounds)
        and all(
            same_drawings(polygons(state, styles), polygons(state_2, styles_2))
            for state, state_2 in zip(states, states_2, strict=True)
        )
    )


def _same_rooms(one: dict[str, Any], other: dict[str, Any]) -> bool:
    """Tell whether centres and views agree, to one unit of their second decimal place."""
    a, b = (np.array([[*x["origin"], *x["view"]] for x in data["rooms"]]) for data in (one, other))
    return a.shape == b.shape and bool((np.abs(a - b) < 0.015).all())


def _inflated(text: str) -> bytes:
    return zlib.decompress(base64.b64decode(text))


def split(content: bytes) -> list[Numbers]:
    """Return the states of `rbcourse.draw.display.joined`, an array of numbers each."""
    count = int(np.frombuffer(content, "<u4", 1)[0])
    sizes = np.frombuffer(content, "<u4", count, 4)
    numbers = np.frombuffer(content, "<i2", offset=4 * (count + 1))
    if sizes.sum() != len(numbers):
        raise ValueError(f"content: {sizes.sum()} numbers wanted, got {len(numbers)}")
    ends = np.cumsum(sizes, dtype=int).tolist()
    return [numbers[start:end] for start, end in pairwise([0, *ends])]


def polygons(state: Numbers, styles: list[Any]) -> list[Polygon]:
    """Return what a state of `rbcourse.draw.display.Display.record` draws.

    Of each polygon: its style, whether it is filled together with the one before it, and its
    places in pixels. In space styles have more than eight parts, and places three numbers.
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


def same_drawings(one: list[Polygon], other: list[Polygon]) -> bool:
    """Tell whether two lists of polygons agree: styles, and places to one unit."""
    return len(one) == len(other) and all(
        (more, places.shape) == (more_2, places_2.shape)
        and _same_styles(style, style_2)
        and np.abs(places - places_2).max(initial=0) <= UNIT
        for (style, more, places), (style_2, more_2, places_2) in zip(one, other, strict=True)
    )


def _same_styles(one: list[Any], other: list[Any]) -> bool:
    """Tell whether two styles agree: exactly, but for the places of a marker's outline."""
    (*look, outlines), (*look_2, outlines_2) = (style[:8] for style in (one, other))
    sizes, sizes_2 = ([len(outline) for outline in each] for each in (outlines, outlines_2))
    return (look, one[8:], sizes) == (look_2, other[8:], sizes_2) and all(
        np.abs(np.subtract(a, b).reshape(-1, 2).cumsum(axis=0)).max(initial=0) <= 1
        for a, b in zip(outlines, outlines_2, strict=True)
    )


def stale_figures(drawn: Path, stored: Path) -> list[str]:
    """Return the names of the files drawn in a folder that are not stored, or stored otherwise."""
    return [file.name for file in sorted(drawn.iterdir()) if not _is_stored(file, stored)]


def _is_stored(file: Path, folder: Path) -> bool:
    kept = folder / file.name
    try:
        same = file.read_bytes() == kept.read_bytes()
        return same or (file.suffix in SAME and SAME[file.suffix](file, kept))
    except (OSError, ValueError):  # it is not there, or damaged
        return False


def same_pictures(one: Path, other: Path) -> bool:
    """Tell whether two PNG files look the same."""
    return look_the_same(one.read_bytes(), other.read_bytes())


def same_documents(one: Path, other: Path) -> bool:
    """Tell whether two PDFs are allowed to differ: if their PNGs or CSVs differ in a byte."""
    pairs = [[file.with_suffix(end) for file in (one, other)] for end in (".png", ".csv")]
    return any(a.read_bytes() != b.read_bytes() for a, b in pairs)


def same_animations(one: Path, other: Path) -> bool:
    """Tell whether all frames of two GIFs look the same, and last as long."""
    (frames, times), (others, other_times) = (
        zip(*_frames(file), strict=True) for file in (one, other)
    )
    return times == other_times and all(map(look_the_same, frames, others))


def same_tables(one: Path, other: Path) -> bool:
    """Tell whether two CSV files agree, to 1e-12 of the largest number in each column."""
    ours, theirs = (list(csv.reader(io.StringIO(f.read_text("utf-8")))) for f in (one, other))
    if [len(row) for row in ours] != [len(row) for row in theirs]:
        return False
    columns = zip(zip(*ours, strict=True), zip(*theirs, strict=True), strict=True)
    return all(a == b or _same_columns(a, b) for a, b in columns)


SAME = {
    ".png": same_pictures,
    ".pdf": same_documents,
    ".gif": same_animations,
    ".csv": same_tables,
}


def look_the_same(one: bytes, other: bytes) -> bool:
    """Tell whether two pictures are as two processors draw them.

    A pixel differs visibly by more than 16 of 255 levels in some colour: at most 1 in 10,000, and
    at most 12 in a square of 16 × 16, where another letter makes some thirty. The mean difference
    is less than 0.05 levels.
    """
    if one == other:
        return True
    a, b = (
        np.asarray(Image.open(io.BytesIO(png)).convert("RGBA"), dtype=int) for png in (one, other)
    )
    if a.shape != b.shape:
        return False
    difference = np.abs(a - b)
    visibly = difference.max(axis=-1) > 16
    if not visibly.any():
        return bool(difference.mean() < 0.05)
    counted = np.pad(
        visibly.astype(int).cumsum(axis=0).cumsum(axis=1), ((16, 15), (16, 15)), "edge"
    )
    counted[:16], counted[:, :16] = 0, 0
    in_squares = counted[16:, 16:] - counted[:-16, 16:] - counted[16:, :-16] + counted[:-16, :-16]
    return bool(visibly.mean() < 1e-4 and difference.mean() < 0.05 and in_squares.max() <= 12)


def _frames(file: Path) -> Iterator[tuple[bytes, Any]]:
    """Yield the frames of a GIF as PNGs, and for how many milliseconds each is shown."""
    with Image.open(file) as picture:
        for frame in ImageSequence.Iterator(picture):
            content = io.BytesIO()
            frame.convert("RGB").save(content, "png")
            yield content.getvalue(), frame.info.get("duration")


def _same_columns(one: tuple[str, ...], other: tuple[str, ...]) -> bool:
    if one[0] != other[0]:
        return False
    try:
        ours, theirs = (np.array(column[1:], dtype=float) for column in (one, other))
    except ValueError:  # words, which are not the same
        return False
    largest = np.abs(theirs).max(initial=0, where=np.isfinite(theirs))
    allowed = np.maximum(2e-11 * np.abs(theirs), max(1e-12 * largest, 1e-13))
    return bool(np.all((np.abs(ours - theirs) <= allowed) | (np.isnan(ours) & np.isnan(theirs))))
