"""What the artists of a saved figure show, recorded where a lesson draws it, beside its numbers.

A kernel that runs `record` (see conftest.py) writes for each figure all numbers that its artists
hold, an animation's in all frames. `not_shown` looks for the columns of the CSV among them.
"""

import csv
import os
import re
from pathlib import Path

import numpy as np

STARTUP = """
__import__("sys").path.insert(0, {tests!r})
__import__("shown").record({folder!r})
"""
# What of a CSV need not be in the picture as a number: a pattern of "figure, column", and the share
# that is there all the same.
SHARES = {
    r"paper_fig5[ab], (drawn \[1\]|[wva]\d'? \[(rad|m)\])": 0,  # beside what is drawn
    r".*, (.* )?(t \[(1|s)\]|path \[1\]|frame|family|body|problems \[1\])": 0,  # order, or colour
    r".*, (.* )?theta\d? \[rad\]": 0,  # where links and corners are
    r"paper_fig[23][ab], .*": 0.3,  # six curves, and a surface of fewer points
    r"lesson02_two_spaces, .* [xy]1 \[m\]": 0,  # the elbow, drawn three times
    r"lesson01_straight, .* by the corner .*": 0,  # the corner's way is drawn, not the centre's
    r"lesson08_half, turn \[rad\]": 0,  # of the body
    r"lesson0[78]_ways, .* R\d\d \[1\]": 0,  # frames at the ends only
    r"lesson1[23]_(median_\w+|ninety_\w+|atlas), (displacement|end velocity) .*": 0,  # the cell
}


GETTERS = "get_data", "get_data_3d", "get_segments", "get_xy", "get_offsets", "get_array"


def record(folder):
    """Let figures that are saved write what they show into a folder."""
    import rbcourse.draw
    from rbcourse.draw import animate, save

    save_figure, render, frames = save.save_figure, animate.render, {}

    def saved(fig, name, data, alt):
        numbers = np.concatenate([*frames.pop(fig, []), *numbers_of(fig.findobj())])
        np.save(Path(folder) / f"{name}.npy", np.unique(numbers[np.isfinite(numbers)]))
        return save_figure(fig, name, data, alt)

    def rendered(fig, update, count):
        frames[fig] = [x for i in range(count) for x in numbers_of(update(i))]
        return render(fig, update, count)

    for module in (rbcourse.draw, save, animate):
        module.save_figure = saved
    animate.render = rendered


def numbers_of(artists):
    """The numbers that artists hold, as flat arrays: coordinates, heights, values of a map."""
    for artist in artists:
        held = [getattr(artist, name)() for name in GETTERS if hasattr(artist, name)]
        held += [getattr(artist, name) for name in ("U", "V") if hasattr(artist, name)]
        for segment in getattr(artist, "_segments3d", ()):
            along = np.diff(segment[:2], axis=0)  # of an arrow: its direction
            held += [segment, along, along / (np.linalg.norm(along) or 1)]
            held.append(-held[-1])
        faces = getattr(artist, "corners", None)  # of a body
        if type(artist).__name__ == "Poly3DCollection":
            faces = np.asarray([face[:4] for face in artist._faces])
        if faces is not None:
            held.append(faces)
            if len(faces) == 7:  # a box: where it is, and its axes
                centres = faces[:6].mean(axis=1)
                axes = centres[:3] - centres[3:]
                held += [centres.mean(axis=0), axes / np.linalg.norm(axes, axis=1)[:, None]]
        for values in held:
            for part in values if isinstance(values, list | tuple) else [values]:
                if part is not None and np.size(part):
                    yield np.ma.filled(np.ma.asarray(part, dtype=float), np.nan).ravel()


def not_shown(figures, shown):
    """The columns of the CSV files of figures whose numbers the artists do not hold."""
    for file in sorted(figures.glob("*.csv")):
        if not file.with_suffix(".png").exists():
            continue  # a table beside figures
        pool = np.load(shown / f"{file.stem}.npy")
        with file.open(encoding="utf-8", newline="") as lines:
            header, *rows = csv.reader(lines)
        if "drawn [1]" in header:
            rows = [row for row in rows if row[header.index("drawn [1]")] == "1"]
        for column, cells in zip(header, zip(*rows, strict=True), strict=True):
            place = f"{file.stem}, {column}"
            share = min((s for form, s in SHARES.items() if re.fullmatch(form, place)), default=1)
            if share:
                values = np.unique(np.array(cells, dtype=float))
                lost = [v for v in values if not (held(pool, v) or held(pool, np.degrees(v)))]
                if len(lost) > (1 - share) * len(values):
                    yield f"{place}: {len(lost)} of {len(values)} are not in the picture"


def held(pool, value):
    """Whether a number is in the sorted pool, to the twelve digits of the CSV."""
    near = pool[np.clip(np.searchsorted(pool, value) + np.array([-1, 0]), 0, len(pool) - 1)]
    return bool((np.abs(near - value) <= 1e-11 * max(1, abs(value))).any())


def start_recording(folder, ipython):
    """Let kernels with this IPython folder record into another one; return the IPython folder."""
    startup = Path(ipython) / "profile_default" / "startup"
    startup.mkdir(parents=True)
    text = STARTUP.format(tests=os.path.dirname(__file__), folder=folder)
    (startup / "record.py").write_text(text, "utf-8")
    return ipython
