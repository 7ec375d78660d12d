"""What a run of a lesson gave and what is stored: the same, as far as processors agree."""

import csv
import difflib
import io
import re

import numpy as np
from PIL import Image

BASE64 = r"base64,([A-Za-z0-9+/=]+)"


def changed_lines(stored, again):
    """The lines in which two notebooks differ, pictures left out: processors draw differently."""
    lines = (re.sub(BASE64, "", text).split("\n") for text in (stored, again))
    return difflib.unified_diff(*lines, "stored", "again", n=0, lineterm="")


def stale_figures(drawn, stored):
    """What is wrong with the stored files of the figures that are drawn in a folder."""
    for file in sorted(drawn.iterdir()):
        kept = stored / file.name
        if not kept.exists():
            yield f"{file.name} is not stored"
        elif file.read_bytes() != kept.read_bytes() and not SAME[file.suffix](file, kept):
            yield f"{file.name} is stored otherwise"


def same_pictures(one, other):
    return look_the_same(one.read_bytes(), other.read_bytes())


def same_documents(one, other):
    """Documents that differ do so by right only if picture or numbers differ to the byte."""
    pairs = [[file.with_suffix(end) for file in (one, other)] for end in (".png", ".csv")]
    return any(a.read_bytes() != b.read_bytes() for a, b in pairs)


def same_animations(one, other):
    """Frame by frame, as pictures; the palette may differ by a shade."""
    frames, others = (list(gif_frames(file)) for file in (one, other))
    return len(frames) == len(others) and all(map(look_the_same, frames, others))


def same_tables(one, other):
    """Another processor may round differently: by 1e-12 of the largest number in the column."""
    ours, theirs = (list(csv.reader(io.StringIO(f.read_text("utf-8")))) for f in (one, other))
    if [len(row) for row in ours] != [len(row) for row in theirs]:
        return False
    columns = zip(zip(*ours, strict=True), zip(*theirs, strict=True), strict=True)
    return all(a == b or same_columns(a, b) for a, b in columns)


SAME = {
    ".png": same_pictures,
    ".pdf": same_documents,
    ".gif": same_animations,
    ".csv": same_tables,
}


def look_the_same(one, other):
    """As two processors draw: at most 1 in 10,000 pixels differs visibly, the mean by 0.05."""
    if one == other:
        return True
    share, mean = differing_pixels(one, other)
    return share < 1e-4 and mean < 0.05


def differing_pixels(one, other):
    """The share of pixels that differ visibly, by more than 16 of 255 levels in some colour, and
    the mean difference in levels."""
    a, b = (
        np.asarray(Image.open(io.BytesIO(png)).convert("RGB"), dtype=int) for png in (one, other)
    )
    if a.shape != b.shape:
        return 1.0, 255.0
    difference = np.abs(a - b)
    return (difference.max(axis=-1) > 16).mean(), difference.mean()


def gif_frames(file):
    with Image.open(file) as picture:
        for i in range(picture.n_frames):
            picture.seek(i)
            content = io.BytesIO()
            picture.convert("RGB").save(content, "png")
            yield content.getvalue()


def same_columns(one, other):
    if one[0] != other[0]:
        return False
    ours, theirs = (np.array(column[1:], dtype=float) for column in (one, other))
    allowed = np.maximum(2e-11 * np.abs(theirs), max(1e-12 * np.abs(theirs).max(), 1e-13))
    return np.all(np.abs(ours - theirs) <= allowed)
