"""Figures of the two texts, with their numbers, and the command that draws them into files."""

import argparse
import inspect
import re
import shlex
import sys
import textwrap
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.figure import Figure

from rbcourse.draw.animate import Animation, Update, frame_picture, render, save_animation
from rbcourse.draw.display import Player
from rbcourse.draw.save import Picture, Table, as_png, csv_text, save_figure, write_figure
from rbcourse.files import replace_file
from rbcourse.optimum import ConvergenceError

_NEGATIVE = re.compile(r"-[\d.]+(e[+-]?\d+)?", re.I)
OPTIONS: Mapping[str, tuple[int | str | None, str]] = {
    "angles": ("+", "two or more increasing angles, in rad"),
    "rotation": (3, "the rotation vector of the moving frame, in rad"),
    "position": (3, "the origin of the moving frame, in m"),
    "sigma": (3, "the rotation vector of the goal, in rad"),
    "w0": (3, "the angular velocity at the start, in the body frame"),
    "w1": (3, "the angular velocity at the goal, in the body frame"),
    "d": (3, "the position of the goal, in m"),
    "d0_dot": (3, "the velocity at the start, in the fixed frame"),
    "d1_dot": (3, "the velocity at the goal, in the fixed frame"),
    "start": ("+", "x, y and the heading, or the joint angles, in m and rad"),
    "goal": ("+", "the same at the end"),
    "length": (None, "the length of the rectangle, in m"),
    "rng": (None, "the seed of the sample"),
    "steps": (None, "the number of rotations, or of steps"),
}
"""The count of numbers of each option of the command, as in argparse, and its meaning."""


@dataclass(frozen=True, repr=False)
class Drawing:
    """A figure of a text, with the numbers that it shows.

    The `data` are the plotted numbers by the names of their columns, which end with a unit. For an
    animation, `moving` has ``update(i)``, which moves the artists to frame i, the number of frames,
    and their duration in s.
    """

    figure: Figure  # of an animation, its last frame
    name: str  # of its files, without the extension
    data: Table
    alt: str  # a description, for readers who do not see the figure
    moving: tuple[Update, int, float] | None = None

    def __repr__(self) -> str:
        return f"{self.name}: {self.alt}"

    def write(self, folder: str | Path = ".") -> None:
        """Write the figure as PNG and PDF, and its numbers as CSV; the figure is closed.

        The folder is created if it does not exist.
        """
        table = csv_text(self.data)
        Path(folder).mkdir(parents=True, exist_ok=True)
        with style():
            if self.moving is None:
                picture = as_png(self.figure)
            else:
                update, frames, _ = self.moving
                render(self.figure, update, 0)  # lays out the figure
                self.figure.set_layout_engine("none")
                picture = frame_picture(self.figure, update, frames - 1)
            write_figure(self.figure, self.name, table, {"png": picture}, True, Path(folder))
        plt.close(self.figure)

    def save(self) -> Picture | Player | Animation:
        """Write the files of a lesson, and return the figure for the notebook to show.

        The folder is that of `rbcourse.draw.save_figure`. An animation is also written as GIF.
        """
        fig, name, data, alt = self.figure, self.name, self.data, self.alt
        with style():
            if self.moving is None:
                return save_figure(fig, name, data, alt, pdf=True)
            update, frames, seconds = self.moving
            return save_animation(fig, name, data, alt, update, frames, seconds, pdf=True)


def style() -> AbstractContextManager[None]:
    """Return a context in which Matplotlib has the style of the course."""
    context: AbstractContextManager[None] = plt.style.context(["default", "rbcourse.rbcourse"])
    return context


def run(figures: Mapping[str, Callable[..., Drawing]], words: Sequence[str] | None = None) -> None:
    """Draw the figures that a command line names into files.

    Keyword-only parameters of the functions are options. By default, the command line is that of
    the program.
    """
    options = {name: _options(draw) for name, draw in figures.items()}
    parser = argparse.ArgumentParser(
        prog="python -m rbcourse",
        usage="python -m rbcourse FIGURE [FIGURE ...] [--folder FOLDER] [options]",
        description="Draw figures as PNG and PDF, write their numbers as CSV, and a description "
        "with the costs as text.",
        epilog="A name without its last letter stands for all its panels. Options replace the "
        "numbers of the text. Existing files of the same name are replaced.",
    )
    parser.add_argument(
        "figures", nargs="+", metavar="FIGURE", help=f"{', '.join(figures)}, or all of them: all"
    )
    parser.add_argument("--folder", default=".", help="the folder of the files (default: this one)")
    for name in sorted({name for names in options.values() for name in names}):
        count, meaning = OPTIONS[name]
        known = ", ".join(figure for figure, names in options.items() if name in names)
        number = int if name in ("rng", "steps") else float
        told = f"{meaning} ({known})"
        parser.add_argument(f"--{name}", type=number, nargs=count, metavar="X", help=told)
    # numbers such as -1e-3 are no options; with a space before them, argparse knows this
    words = sys.argv[1:] if words is None else words
    spaced = [f" {word}" if _NEGATIVE.fullmatch(word) else word for word in words]
    given = vars(parser.parse_args(spaced))
    asked, folder = [word.lower() for word in given.pop("figures")], given.pop("folder")
    values = {name: value for name, value in given.items() if value is not None}
    for word in asked:
        if word != "all" and not any(name.lower().startswith(word) for name in figures):
            parser.error(f"FIGURE: one of {', '.join(figures)} or all is wanted, got {word}")
    for name, draw in figures.items():
        if not any(word == "all" or name.lower().startswith(word) for word in asked):
            continue
        try:
            if other := values.keys() - options[name]:
                raise ValueError(f"figure {name} has no option --{min(other)}")
            drawing = draw(**values)
            drawing.write(folder)
        except (ValueError, OSError, ConvergenceError) as error:
            parser.error(str(error))
        told = textwrap.fill(drawing.alt, 96)
        text = f"python -m rbcourse {shlex.join(words)}\n\n{told}\n"
        replace_file(Path(folder, f"{drawing.name}.txt"), text.encode())
        print(f"{Path(folder, drawing.name)}: png, pdf, csv, txt", flush=True)
        if "all" not in asked:
            print(textwrap.indent(told, "    "), flush=True)


def _options(draw: Callable[..., Drawing]) -> set[str]:
    """Return the keyword-only parameters that the command line offers."""
    fixed = draw.keywords if isinstance(draw, partial) else {}
    parameters = inspect.signature(draw).parameters.values()
    return {
        p.name
        for p in parameters
        if p.kind == p.KEYWORD_ONLY and p.name not in fixed and p.name != "plan"
    }
