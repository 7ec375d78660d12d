"""Figures as files with reproducible bytes: the pictures and their numbers.

A table is a dict of columns of equal shape, with units in their names:
``{"t [1]": ..., "angle [rad]": ..., "theta [1]": ...}``.
"""

import csv
import html
import io
import logging
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import PlaceHolderLayoutEngine
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from rbcourse.draw.display import Display, Player
from rbcourse.draw.pictures import data_url, drawn, png
from rbcourse.draw.space import scenes
from rbcourse.files import replace_file

# fontTools reports the dates of the fonts of formulas, which come with Matplotlib
logging.getLogger("fontTools").setLevel(logging.ERROR)
Table = Mapping[str, ArrayLike]
UNITS = ("1", "m", "m²", "rad", "rad²", "s", "m/s", "rad/s", "m/s²", "rad/s²", "N m")
"""The units; the name of each column of numbers ends with one of them in brackets."""
SHOWN = 120
"""The number of pixels on a page for an inch of a figure."""

COLOURS = {
    "x": "#D55E00",
    "y": "#009E73",
    "z": "#0072B2",
    "optimum": "#000000",
    "projection": "#AE598E",
    "screw": "#8821D9",
    "reference": "#585858",
    "path": "#BB0000",
}
"""Colours by meaning, the same in all figures; they are distinct for the colour-blind."""
PALE = "#8F8F8F"
"""The colour of the background artists, which has a contrast of 3 on white."""


@dataclass(frozen=True)
class Picture:
    """A saved figure as shown in a notebook: the picture with its description."""

    name: str  # of the files, without the extension
    alt: str  # the description
    caption: str  # its first sentence, and the names of the files, as HTML
    png: bytes  # with a resolution for fine and large screens
    width: int  # displayed, in pixels

    def __repr__(self) -> str:
        return f"{self.name}: {self.alt}"

    def _repr_html_(self) -> str:
        return (
            f'<figure><img width="{self.width}" style="max-width: 100%" '
            f'alt="{html.escape(self.alt)}" src="{data_url(self.png)}"/>'
            f"{self.caption}</figure>"
        )


def caption(alt: str, files: str = "") -> str:
    """Return the caption of a picture: the first sentence of the description, and the file names.

    Examples
    --------
    >>> caption("A turn by 1.5 rad, e.g. Euler's. M is grey.", "turn.png, .csv")
    "<figcaption>A turn by 1.5 rad, e.g. Euler's. <small>turn.png, .csv</small></figcaption>"
    """
    sentence, *_ = re.split(r"(?<=\.)(?<!e\.g\.)(?<!i\.e\.)(?<!cf\.)(?<!vs\.) (?=[A-Z])", alt)
    small = f" <small>{files}</small>" if files else ""
    return f"<figcaption>{html.escape(sentence, quote=False)}{small}</figcaption>"


def save_figure(
    fig: Figure, name: str, data: Table, alt: str, *, pdf: bool = False
) -> Picture | Player:
    """Save a figure as PNG and CSV, close it, and return it for the notebook to show.

    Artists in a `Space` can be turned in the notebook; the files show the initial view. The
    environment variable ``RBCOURSE_FIGURES`` names the folder of the files; the default is
    ``figures`` in the current folder. If the variable is empty, no files are written. The same
    input always gives the same bytes. With 256 colours, the PNG is a third as large, without a
    visible difference.

    Parameters
    ----------
    fig : matplotlib Figure
        The figure.
    name : str
        The name of the files without the extension.
    data : dict of array_like, all of one shape
        The plotted numbers. The names of the columns end with a unit, such as ``"t [s]"``.
    alt : str
        The description of the figure, for readers who do not see it.
    pdf : bool, optional
        Whether to save the figure also as PDF, for printing.
    """
    table, picture = csv_text(data), as_png(fig)
    write_figure(fig, name, table, {"png": picture}, pdf, figures_folder())
    text = caption(alt, f"{name}.png{', .pdf' * pdf}, .csv")
    shown = _turning(fig, name, alt, text) if scenes(fig) else None
    plt.close(fig)
    return shown or Picture(name, alt, text, picture, round(SHOWN * fig.get_figwidth()))


def as_png(fig: Figure) -> bytes:
    """Return a figure as a PNG in 256 colours; its text "cuts" has the numbers of `cuts_of`."""
    content = io.BytesIO()
    if fig.get_layout_engine() is None:  # savefig would leave the figure with that of the style
        fig.set_layout_engine(PlaceHolderLayoutEngine(True, True))
    fig.savefig(content, format="png")
    return png(Image.open(content), " ".join(f"{cut:.3f}" for cut in cuts_of(fig)))


def cuts_of(fig: Figure) -> list[float]:
    """Return the places between columns of axes, as fractions of the width of a drawn figure.

    A narrow column, such as the bar of colours, belongs to its left neighbour. There are no cuts if
    a column has less than a fifth of the width, if a text of the figure is over a cut, or if the
    numbers beside an axis belong to another column, too.
    """
    width, columns = fig.bbox.width, list[list[float]]()
    boxes = [box for ax in fig.axes if (box := ax.get_tightbbox())]
    for low, high in sorted((float(box.x0), float(box.x1)) for box in boxes):
        if columns and (low < columns[-1][1] or high - low < width / 8):
            columns[-1][1] = max(columns[-1][1], high)
        else:
            columns.append([low, high])
    cuts = [(left[1] + right[0]) / 2 for left, right in pairwise(columns)]
    over = [each.get_window_extent().intervalx for each in [*fig.texts, *fig.legends]]
    narrow = min(np.diff([0, *cuts, width])) < width / 5
    if (
        narrow
        or any(map(_without_numbers, fig.axes))
        or any(low < cut < high for cut in cuts for low, high in over)
    ):
        return []
    return [float(cut / width) for cut in cuts]


def _without_numbers(ax: Axes) -> bool:
    """Tell whether the numbers of the vertical axis are only beside another axes."""
    sides = ax.yaxis.get_tick_params()
    labels = sides.get("labelleft", True) or sides.get("labelright", False)
    return ax.axison and not labels and bool(ax.get_yticks().size)


def _turning(fig: Figure, name: str, alt: str, text: str) -> Player:
    fig.set_layout_engine("none")  # keeps all artists in place
    fig.set_dpi(min(SHOWN, 1500 // fig.get_size_inches().max()))
    display = Display(fig)
    still = drawn(fig, [], [], zoom=1.25)  # for readers without scripts
    background, states = drawn(fig, [], None), [display.record([])]
    return Player(name, alt, text, still, background, display, states, controls=())


def save_table(name: str, data: Table) -> None:
    """Save numbers as a CSV file in the folder of `save_figure`.

    Parameters
    ----------
    name : str
        The name of the file without the extension.
    data : dict of array_like, all of one shape
        The numbers. The names of the columns end with a unit, such as ``"t [s]"``.
    """
    table = csv_text(data)
    if folder := figures_folder():
        replace_file(folder / f"{name}.csv", table.encode())


def write_figure(
    fig: Figure,
    name: str,
    table: str,
    pictures: Mapping[str, bytes],
    pdf: bool,
    folder: Path | None,
) -> None:
    """Write the CSV, the pictures and, with `pdf`, the PDF of a figure, if a folder is given.

    The keys of `pictures` are endings. All contents are made before the first file is written.
    """
    if folder:
        files = {"csv": table.encode(), **pictures}
        if pdf:
            stream = io.BytesIO()
            fig.savefig(stream, format="pdf", metadata={"CreationDate": None})
            files["pdf"] = stream.getvalue()
        for ending, content in files.items():
            replace_file(folder / f"{name}.{ending}", content)


def figures_folder() -> Path | None:
    """Return the folder for figures (see `save_figure`); create it if it does not exist."""
    named = os.environ.get("RBCOURSE_FIGURES", "figures")
    if not named:
        return None
    Path(named).mkdir(parents=True, exist_ok=True)
    return Path(named)


def csv_text(data: Table) -> str:
    """Return a table as CSV: a line of names, and then numbers with twelve significant digits.

    Examples
    --------
    >>> print(csv_text({"t [1]": [0, 0.5], "angle [rad]": [1 / 3, 2]}), end="")
    t [1],angle [rad]
    0,0.333333333333
    0.5,2
    """
    columns = {name: np.asarray(column) for name, column in data.items()}
    if len({column.shape for column in columns.values()}) > 1:
        shapes = ", ".join(f"{name} {column.shape}" for name, column in columns.items())
        raise ValueError(f"data: columns of one shape are wanted, got {shapes}")
    for name, column in columns.items():
        if column.dtype.kind != "U" and not name.endswith(tuple(f" [{unit}]" for unit in UNITS)):
            units = ", ".join(f"[{unit}]" for unit in UNITS)
            raise ValueError(f"data: {name!r} must end with a space and a unit: one of {units}")
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    cells = (x if x.dtype.kind == "U" else np.strings.mod("%.12g", x) for x in columns.values())
    writer.writerows(zip(*map(np.ravel, cells), strict=True))
    return text.getvalue()


def named_tables(tables: Mapping[str, Table]) -> dict[str, ArrayLike]:
    """Return tables joined into one; each column name begins with the name of its table.

    Parameters
    ----------
    tables : dict of dict of array_like
        Tables by name, as for `save_table`.

    Examples
    --------
    >>> named_tables({"there": {"x [m]": [0, 1]}, "back": {"x [m]": [1, 0]}})
    {'there x [m]': [0, 1], 'back x [m]': [1, 0]}
    """
    return {f"{name} {key}": x for name, table in tables.items() for key, x in table.items()}


def described(sentence: str, data: Table) -> str:
    """Return the description of curves: a sentence, and the range of each column after the first.

    Parameters
    ----------
    sentence : str
        A sentence that says which curves the figure shows.
    data : dict of array_like, shape (n,)
        The table of the figure. Its first column is the abscissa.

    Examples
    --------
    >>> described("Speeds.", {"t [s]": [0, 1, 2], "low [m/s]": [1, 0, 3], "up [1]": [0, 1, 1.5]})
    'Speeds. While t goes from 0 to 2 s: low from 1 to 3 m/s, at least 0; up from 0 to 1.5.'
    """
    (first, x), *columns = data.items()
    parts = [_range(name, np.asarray(y)) for name, y in columns]
    said = _range(first, np.asarray(x)).replace(" from", " goes from")
    return f"{sentence} While {said}: {'; '.join(parts)}."


def _range(name: str, column: NDArray[np.float64]) -> str:
    """Return the first, the last, and further extreme values of a column as text."""
    label, unit = name.removesuffix("]").rsplit(" [", 1)
    known = column[np.isfinite(column)]
    if not len(known):
        return f"{label} is not defined"
    # rounding errors differ between processors
    known = np.where(np.abs(known) < 1e-12 * max(1, np.abs(known).max()), 0, known)
    values = known[0], known[-1], known.min(), known.max()
    first, last, low, high = (f"{x:.3g}" for x in values)
    said = f"{label} from {first} to {last}{'' if unit == '1' else f' {unit}'}"
    said += f", at least {low}" * (low not in (first, last))
    return said + f", at most {high}" * (high not in (first, last))


def in_words(value: float, scale: float) -> str:
    """Return a number as text, with three significant digits relative to `scale`.

    Examples
    --------
    >>> in_words(6.7082, 10), in_words(-1e-17, 10), in_words(3.14159e-6, 5e-6)
    ('6.7', '0', '3.14e-06')
    """
    digits = 2 - int(np.floor(np.log10(scale))) if scale > 0 else 0
    return f"{np.round(float(value), digits) + 0.0:.10g}"
