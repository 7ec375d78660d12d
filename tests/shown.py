"""Compare the numbers that the artists of a figure hold with the CSV of the figure.

A kernel that runs `record` (see conftest.py) writes all numbers that the artists hold in each
saved figure. For an animation, it writes the numbers of all frames. The kernel stops with an error
if a figure is clipped or has no labels. `not_shown` looks for the columns of the CSV among these
numbers. If a title or a label names a column, only the artists with this title or label count.
"""

import csv
import os
import pickle
import re
from collections import defaultdict
from pathlib import Path

import numpy as np

STARTUP = """
__import__("sys").path.insert(0, {tests!r})
__import__("shown").record({folder!r})
"""
# In these CSV columns, not every value must appear as a number in the picture. Each entry maps a
# pattern for "figure, column" to the share of the values that must still appear.
SHARES = {
    # these extra columns need not be drawn
    r"paper_fig5[ab], (drawn \[1\]|[wva]\d'? \[(rad|m)\])": 0,
    r"paper_fig5[ab], R\d\d \[1\]": 0.7,  # two of the eight cubes are omitted
    # the picture shows these columns by the order of points, or by colours
    r".*, (.* )?(t \[(1|s)\]|path \[1\]|frame|family|body|problems \[1\])": 0,
    r".*, (.* )?theta\d? \[rad\]": 0,  # the positions of links and corners show this column
    r"paper_fig[23][ab], .*": 0.3,  # the picture has six curves, and a surface with fewer points
    r"lesson02_two_spaces, .* [xy]1 \[m\]": 0,  # the elbow is drawn three times
    # the picture shows the path of the corner, and not the path of the centre
    r"lesson01_straight, .* by the corner .*": 0,
    r"lesson08_half, turn \[rad\]": 0,  # the body is turned by this angle
    r"lesson0[78]_ways, .* R\d\d \[1\]": 0,  # only the frames at the ends are drawn
    # the place of the cell in the map shows both values
    r"lesson1[23]_(median|ninety|cheaper|atlas), (displacement|end velocity) .*": 0,
    # three curves have maps; the ball and the book, but not the brick
    r"lesson12_(median|ninety), (exponential|corrected|cumulative|Cayley) excess .*": 0,
    r"lesson13_atlas, three median .*": 0,
    r"lesson13_atlas, .* median .*": 0.6,
}
FIGURES = Path(__file__).parents[1] / "figures"
LETTERS = str.maketrans("ω₁₂₃", "w123", "$")  # labels have ω₁ and $x$, columns have w1 and x
BAR = "<colorbar>"
GETTERS = "get_data", "get_data_3d", "get_segments", "get_xy", "get_offsets", "get_array"


def columns(file):
    """Return a dict of the columns of a CSV, as text."""
    with file.open(encoding="utf-8", newline="") as lines:
        header, *rows = csv.reader(lines)
    return dict(zip(header, np.array(rows).T, strict=True))


def numbers(name):
    """Return a dict of the columns of a committed figure; columns without a unit are text."""
    table = columns(FIGURES / f"{name}.csv")
    return {key: x.astype(float) if key.endswith("]") else x for key, x in table.items()}


def record(folder):
    """Make saved figures write their displayed data into a folder, and check their layout."""
    from rbcourse.draw import animate, save

    write_figure, animate_, frames = save.write_figure, animate.animate, {}

    def written(fig, name, *files):
        pools = pooled([*frames.pop(fig, []), *by_names(fig.findobj())])
        (Path(folder) / f"{name}.pickle").write_bytes(pickle.dumps(pools))
        write_figure(fig, name, *files)
        check_looks(fig)

    def animated(fig, name, alt, update, count, *more, **options):
        frames[fig] = [pair for i in range(count) for pair in by_names(update(i))]
        return animate_(fig, name, alt, update, count, *more, **options)

    for module in (save, animate):
        module.write_figure = written
    animate.animate = animated


def pooled(pairs):
    """Return a dict from each name to its sorted numbers."""
    pools = defaultdict(list)
    for key, values in pairs:
        pools[key].append(values)
    return {key: np.unique(np.concatenate(values)) for key, values in pools.items()}


def by_names(artists):
    """Yield each array of numbers that artists hold, together with each of its names."""
    for artist in artists:
        title = title_of(getattr(artist, "axes", None))
        label = str(artist.get_label()).removeprefix("about ").translate(LETTERS)
        for values in numbers_of([artist]):
            for key in {"", f"title {title}", f"label {label}", f"label {title} {label}"}:
                yield key, values[np.isfinite(values)]


def title_of(ax):
    """Return the first line of the title of an Axes, or "" if any Axes of the figure has none."""
    if not hasattr(ax, "get_title"):
        return ""
    others = [other for other in ax.figure.axes if other.axison and other.get_label() != BAR]
    return ax.get_title().partition("\n")[0] if all(x.get_title() for x in others) else ""


def numbers_of(artists):
    """Yield flat arrays of the numbers that artists hold: coordinates, heights, values of a map."""
    for artist in artists:
        held = [getattr(artist, name)() for name in GETTERS if hasattr(artist, name)]
        held += [getattr(artist, name) for name in ("U", "V") if hasattr(artist, name)]
        faces = getattr(artist, "corners", None)  # of a body
        if type(artist).__name__ == "Poly3DCollection":
            faces = np.asarray([face[:4] for face in artist._faces])
        if faces is not None:
            held.append(faces)
            if len(faces) == 7:  # a box: its centre and its axes
                centres = faces[:6].mean(axis=1)
                axes = centres[:3] - centres[3:]
                held += [centres.mean(axis=0), axes / np.linalg.norm(axes, axis=1)[:, None]]
        for values in held:
            for part in values if isinstance(values, list | tuple) else [values]:
                if part is not None and np.size(part):
                    yield np.ma.filled(np.ma.asarray(part, dtype=float), np.nan).ravel()


def check_looks(fig):
    """Fail if a figure is clipped, has axes without labels, has curves that look the same, or has
    illegible letters on a slide of 1080 pixels: 13.5 points must be at least 2.5 % of its height.
    """
    width, height = fig.get_size_inches()
    aspect = width / height
    room = min(1744, 755 * aspect) if aspect > 1.85 else min(1210, 880 * aspect)
    assert 13.5 / 72 * room / width >= 26
    flat = [ax for ax in fig.axes if ax.name == "rectilinear"]
    from matplotlib import rcParams

    dpi = fig.dpi
    fig.set_dpi(rcParams["savefig.dpi"])  # sizes of letters, and so the layout, depend on it
    box = fig.get_tightbbox().transformed(fig.dpi_scale_trans)
    assert (box.min > -4).all(), box  # boxes of letters have 4 pixels around a word without descent
    assert (box.max < fig.bbox.max + 4).all(), box
    fig.set_dpi(dpi)
    colours = {}
    for ax in fig.axes:
        named = [line for line in ax.lines if not line.get_label().startswith("_")]
        looks = {(str(line.get_color()), line.get_marker()) for line in named}
        assert len(looks) == len(named), ax
        for line in named:  # equal labels have equal colours
            place = title_of(ax), line.get_label()
            assert colours.setdefault(place, line.get_color()) == line.get_color(), place
    for ax in flat:
        if ax.axison:
            assert any(other.get_xlabel() for other in flat) or fig.get_supxlabel()
            assert any(other.get_ylabel() for other in flat) or fig.get_supylabel()
        for artist in [*ax.lines, *ax.patches]:
            if artist.get_transform().contains_branch(ax.transData):
                places = artist.get_path().transformed(artist.get_transform()).vertices
                if ax.get_aspect() == 1:  # with equal scales, marks must be completely inside
                    places = artist.get_window_extent().corners()
                assert not (places < ax.bbox.min - 1e-6).any(), artist
                assert not (places > ax.bbox.max + 1e-6).any(), artist


def not_shown(figures, shown):
    """Yield the CSV columns that are not shown by the artists of their figure."""
    for file in sorted(figures.glob("*.csv")):
        if not file.with_suffix(".png").exists():
            continue  # a table without a picture
        pools = pickle.loads((shown / f"{file.stem}.pickle").read_bytes())
        yield from lost_columns(file, pools)


def lost_columns(file, pools):
    """Yield the columns of a CSV file that are not among the numbers of a figure."""
    table = columns(file)
    rows = table.get("drawn [1]", np.array("1")) == "1"
    for column, cells in table.items():
        place = f"{file.stem}, {column}"
        share = min((s for form, s in SHARES.items() if re.fullmatch(form, place)), default=1)
        if share:
            pool = pools[name_for(column, pools)]
            values = np.unique(cells[rows].astype(float))
            values = values[np.isfinite(values)]  # NaN is not drawn
            lost = [v for v in values if not (held(pool, v) or held(pool, np.degrees(v)))]
            if len(lost) > (1 - share) * len(values):
                yield f"{place}: {len(lost)} of {len(values)} are not in the picture"


def name_for(column, pools):
    """Return the label that names a column, or a title if no label does, or "" if neither does."""
    plain = column.split(" [")[0]
    for name in (plain, plain.rpartition(" ")[0], plain.removesuffix(" median excess")):
        if name and f"label {name}" in pools:
            return f"label {name}"
    titles = (name for name in pools if f"title {plain}".startswith(f"{name} "))
    return max(titles, key=len, default="")


def held(pool, value):
    """Return whether the sorted pool contains a number; the CSV has twelve digits."""
    near = pool[np.clip(np.searchsorted(pool, value) + np.array([-1, 0]), 0, len(pool) - 1)]
    return bool((np.abs(near - value) <= 1e-11 * max(1, abs(value))).any())


def start_recording(folder, ipython):
    """Let kernels that use the profile folder `ipython` record into `folder`; return `ipython`."""
    startup = Path(ipython) / "profile_default" / "startup"
    startup.mkdir(parents=True)
    text = STARTUP.format(tests=os.path.dirname(__file__), folder=folder)
    (startup / "record.py").write_text(text, "utf-8")
    return ipython
