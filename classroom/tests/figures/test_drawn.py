"""Each figure of the lessons shows the numbers of its table and labels them; nothing is clipped.

A figure of `FIGURES` is drawn on axes of its own. It returns the expected numbers, by the title of
their axes and the label of their artist; its description; and words of the description.
"""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from shown import numbers_of

import rbcourse as rb
from rbclassroom.figures import (
    lesson03,
    lesson04,
    lesson05,
    lesson06,
    lesson08,
    lesson09,
    lesson13,
    lesson14,
)

T = np.linspace(0, 1, 21)
STEP = rb.exp_so3([0.01, 0.02, -0.03])
M = np.random.default_rng(1).normal(size=(30, 2, 2))
M = M[np.linalg.det(M) > 0.1]
SIGMA = np.array([0.3, 0.6, 0.9])
ENDS = np.eye(3), rb.exp_so3(SIGMA), SIGMA, SIGMA + np.array([1, 0, 0])
CURVES = {
    "optimum": rb.minimum_acceleration_so3(*ENDS),
    "projection": rb.projected_cubic_so3(*ENDS),
}
MOMENTS = np.array([1.0, 2, 3])
STARTS = {"axis 1": [2, 0.01, 0.01], "axis 2": [0.01, 2, 0.01], "axis 3": [0.01, 0.01, 2]}
TIMES = np.linspace(0, 24, 481)
TURNS, SPINS = rb.geodesic_flow(np.diag(MOMENTS), np.eye(3), list(STARTS.values()), TIMES)
ANGLE, MESH = np.meshgrid(np.arange(1, 23) * np.pi / 24, T[::5], indexing="ij")
FAMILY = {"angle [rad]": ANGLE, "t [1]": MESH, "theta [1]": rb.projected_line.theta(MESH, ANGLE)}
TWO = {
    name: make(np.eye(3), rb.exp_so3([0, 0, 2]))
    for name, make in (("geodesic", rb.geodesic_so3), ("projected line", rb.projected_line_so3))
}
PATHS = {name: curve(T) @ [1, 0, 0] for name, curve in TWO.items()}
SPEEDS = {name: np.linalg.norm(curve(T, 1), axis=-1) for name, curve in TWO.items()}
G = rb.metrics.box_inertia([0.3, 0.2, 0.03])
LAWS = [rb.minimum_acceleration_so3(*ENDS, *inertia) for inertia in ((), (G,))]
LAWS = [*LAWS, rb.minimum_torque_so3(*ENDS, G)]
LAWS = dict(zip(("as if a ball", "least acceleration", "least torque"), LAWS, strict=True))
FIGURES = {}


def figure(*kinds):
    """Put a function into `FIGURES` that draws on axes of these projections, one above another."""

    def put(draw):
        FIGURES[draw.__name__] = kinds, draw
        return draw

    return put


@figure(None)
def angles(ax):
    t = np.linspace(0, 1, 11)
    letters = {"α": -t, "β": -t, "γ": 2 * t}
    table = {"t [1]": t} | {f"slow {name} [rad]": angle for name, angle in letters.items()}
    lesson03.draw_angles([ax], table)
    held = {f"slow, {name}": [t, np.degrees(angle)] for name, angle in letters.items()}
    words = "slow: β goes to -57 degrees, and the middle half of α's change takes 50.0 %"
    return held, lesson03.describe_angles(table), [words]


@figure(None)
def drift(ax):
    ways = {"a": (STEP, None), "b": (STEP, rb.project_so), "c": (np.eye(3) + STEP / 9, None)}
    data = lesson04.drift_table(200, ways)
    lesson04.draw_drift(ax, data)
    words = f"After 200 products it is, a: {data['a [1]'][-1]:.0e}"
    held = {name: [data["steps [1]"], data[f"{name} [1]"]] for name in ways}
    return held, lesson04.describe_drift(data), [words]


@figure(None, None)
def shadows(*axes):
    points = lesson04.shadows(M)
    table = lesson04.shadow_table(points)
    lesson04.draw_shadows(axes, points)
    held = {}
    for name in ("nearest rotation", "Gram–Schmidt"):
        xy = [[table[f"{which} {axis} [1]"] for axis in "xy"] for which in ("M", name)]
        held[name] = [*xy[0], *xy[1], *np.moveaxis(xy, 0, 2).reshape(-1, 2)]  # dots, dots, lines
    z, m = M[:, 0] @ [1, -1j] + M[:, 1] @ [1j, 1], M[:, 0] @ [1, 1j] + M[:, 1] @ [1j, -1]
    off = np.degrees(np.abs(np.angle((z + m) / z))).max()
    words = f"{len(M)} matrices", f"by up to {off:.0f} degrees"
    return held, lesson04.describe_shadows(points), words


@figure(None)
def frames(ax):
    data = lesson04.frame_table(np.diag([2.0, 1]), [0, np.pi / 8, np.pi / 4])
    lesson04.draw_frames(ax, data)
    names = "nearest rotation", "Gram–Schmidt"
    held = {name: [np.degrees(data[f"{x} [rad]"]) for x in ("frame", name)] for name in names}
    words = "nearest rotation finds 0.0 degrees in every frame; Gram–Schmidt finds -18.4 to 0.0"
    return held, lesson04.describe_frames(data), [words]


@figure(None, None, None)
def histograms(*axes):
    many = {"a": rb.sample_rotation(5000, rng=2), "b": rb.exp_so3(np.zeros((10, 3)))}
    bins = lesson05.histograms(many)
    *_, law = lesson05.draw_histograms(axes, bins)
    for ax, (edges, densities) in zip(axes, bins.values(), strict=True):
        for stairs, name in zip(ax.patches, many, strict=True):
            values, at, _ = stairs.get_data()
            assert stairs.get_label() == name
            assert np.array_equal(values, densities[name])
            assert np.array_equal(at, edges)
        x, y = ax.lines[0].get_data()
        want = (1 - np.cos(x)) / np.pi if ax is axes[0] else np.full_like(x, 0.5)
        assert np.abs(y - want).max() < 1e-4
    words = "height of the image of e₃, b: 95 %", "angle, b: 100 %"
    return {"the law": law.get_data()}, lesson05.describe_histograms(bins), words


@figure(None)
def family(ax):
    lines = lesson06.draw_family(ax, FAMILY)
    assert len({str(line._dash_pattern) for line in lines}) == len(lines) == 6
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("time t", "θ")
    rows = {"π/6": 3, "π/3": 7, "π/2": 11, "2π/3": 15, "5π/6": 19, "11π/12": 21}
    held = {name: [MESH[row], FAMILY["theta [1]"][row]] for name, row in rows.items()}
    assert [text.get_text() for text in ax.get_legend().get_texts()] == list(rows)
    words = "for 22 angles", "for the largest angle, 11π/12 rad, it is 0, 0.0439, 0.5, 0.956, 1."
    return held, lesson06.describe_family(FAMILY), words


@figure(None)
def family_of_one(ax):
    one = {name: column[5:6] for name, column in FAMILY.items()}
    assert len(lesson06.draw_family(ax, one)) == 1
    return {"π/4": [one["theta [1]"][0]]}, lesson06.describe_family(one), ["for 1 angles"]


@figure(None)
def chord(ax):
    z = np.array([1, 0.5 + 0.5j, 1j])
    x, y = np.array([[z.real, z.imag], [(z / abs(z)).real, (z / abs(z)).imag]]).swapaxes(0, 1)
    table = dict(zip("txyab", [[0, 0.5, 1], x[0], y[0], x[1], y[1]], strict=True))
    lesson06.draw_chord(ax, table)
    names = "equal steps on the chord", "their projections on the circle"
    held = {name: [x[i], y[i]] for i, name in enumerate(names)}
    return held, lesson06.describe_chord(table), ["over 90 degrees, cut into 2 equal steps"]


@figure("space", None)
def paths(sphere, ax):
    lines = lesson06.draw_paths(sphere, PATHS), lesson06.draw_speeds(ax, T, SPEEDS)
    for path, speed in zip(*lines, strict=True):
        assert path.get_color() == speed.get_color()
        assert np.array_equal(path.get_data_3d(), PATHS[speed.get_label()].T)
    words = "the geodesic takes the steps 57, 57 degrees; its speed is 2.00 at the start"
    words = words, "0.91 at the start, 3.11 in the middle, 0.91 at the end"
    held = {name: [T, speed] for name, speed in SPEEDS.items()}
    return held, lesson06.describe_paths(PATHS, SPEEDS), words


@figure(None, None, None)
def spins(*axes):
    spins = {name: SPINS[:, k] for k, name in enumerate(STARTS)}
    lesson08.draw_spins(axes, TIMES, spins)
    held = {f"{name}, ω{'₁₂₃'[i]}": [TIMES, w[:, i]] for name, w in spins.items() for i in range(3)}
    flips = np.count_nonzero(np.diff(np.sign(SPINS[:, 1, 1])))
    assert flips >= 1
    words = f"axis 1: it stays; axis 2: it changes its sign {flips} times; axis 3: it stays"
    return held, lesson08.describe_spins(spins), [words]


@figure("space")
def momenta(ax):
    L = lesson08.momentum_directions(MOMENTS, SPINS)
    lines = lesson08.draw_momenta(ax, L)
    assert len({line.get_color() for line in lines}) == len(L) == 3
    words = "Black: the 1 that pass close to axis 2.", "none round axis 2"
    return {"": np.swapaxes(L, 1, 2).reshape(9, -1)}, lesson08.describe_momenta(L), words


@figure(None, None, None)
def carried(*axes):
    turned = np.radians([0, 90, 180])
    arrows, data = lesson08.draw_carried(axes, turned), lesson08.carried_table(turned)
    tips = np.array([arrow.get_xydata()[1] for arrow in arrows]).reshape(3, 3, 2)
    found = np.degrees(np.arctan2(tips[..., 1], tips[..., 0])) % 360
    assert found == pytest.approx(30 + np.outer([0, 90, 180], [0, 0.5, 1]))
    ends = {name: [data[f"{name} {axis} [1]"] for axis in "xy"] for name in lesson08.CARRIED}
    held = {
        f"turned by {degrees}°, {name}": [[0, x[k]], [0, y[k]]]
        for name, (x, y) in ends.items()
        for k, degrees in enumerate((0, 90, 180))
    }
    return held, lesson08.describe_carried(turned), ["0, 90, 180 degrees"]


@figure("3d", None, None)
def coordinates(space, ax, below):
    table = lesson09.coordinate_table(CURVES, T)
    lines = lesson09.draw_coordinate_paths(space, table)
    assert len({line.get_color() for line in lines}) == 2
    assert len({line.get_linestyle() for line in lines}) == 2
    sigma = {name: rb.log_so3(curve(T)).T for name, curve in CURVES.items()}
    for line, part in zip(
        lesson09.draw_coordinates(ax, table), np.concatenate(list(sigma.values())), strict=True
    ):
        assert np.array_equal(line.get_ydata(), part)
    lesson09.draw_difference(below, table)
    apart = sigma["projection"] - sigma["optimum"]
    held = {f"σ{'₁₂₃'[i]}": [T, part] for i, part in enumerate(apart)} | sigma
    far = np.linalg.norm(apart, axis=0)
    words = f"most at t = {T[far.argmax()]:g}, by {far.max():.2g} rad in length"
    return held, lesson09.describe_coordinates(table), [words]


@figure(None)
def excess(ax):
    scale = np.array([0.25, 0.5, 1])
    columns = {"one": scale**4, "two": 2 * scale**4}
    table = {"scale [1]": scale} | {f"{name} excess [1]": x for name, x in columns.items()}
    *_, slope = lesson09.draw_excess(ax, table)
    assert np.allclose(np.diff(np.log(slope.get_ydata())), 4 * np.log(2))
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
    words = ["one from 3.9e-03 to 1; two from 7.8e-03 to 2"]
    held = {name: [scale, column] for name, column in columns.items()}
    return held, lesson09.describe_excess(table), words


@figure(None, None, None)
def torques(*axes):
    table = lesson13.torque_table(T, LAWS, G)
    lesson13.draw_torques(axes, table)
    held = {}
    for law, curve in LAWS.items():
        torque = lesson13.torques(curve, G, T)
        norm = np.linalg.norm(torque, axis=-1)
        held |= {f"{law}, about {'xyz'[i]}": [T, torque[:, i]] for i in range(3)}
        held[f"{law}, ‖τ‖"] = [T, norm]
    words = f"least torque: at most {norm.max():.2g} N m"
    return held, lesson13.describe_torques(table), [words]


@figure(None)
def speeds(ax):
    rest = np.zeros(3)
    ends = np.eye(3), rb.exp_so3([0, 0, 1.5]), rest, rest, rest, rest
    curves = {
        "least jerk": rb.minimum_jerk_so3(*ends),
        "projected quintic": rb.projected_quintic_so3(*ends),
    }
    table = lesson13.speed_table(T, curves)
    lesson13.draw_speeds(ax, table)
    held = {name: [T, np.linalg.norm(curve(T, 1), axis=-1)] for name, curve in curves.items()}
    # 30 t² (1 − t)² of 1.5 rad: 1.875 times 1.5 at half time
    return held, lesson13.describe_speeds(table), ["least jerk at most 2.8"]


@figure(None, None)
def profiles(*axes):
    data = {"t [s]": [0, 1, 2], "speed [m/s]": [0, 2.5, 1], "turn [rad/s]": [1, 0, 0.25]}
    lines = lesson14.draw_profiles(axes, data, [0, 1.5])
    columns = list(data.values())[1:]
    for ax, line, label, column in zip(
        axes, lines, ("speed\n(m/s)", "turn\n(rad/s)"), columns, strict=True
    ):
        assert line.axes is ax
        assert ax.get_ylabel() == label
        assert line.get_ydata().tolist() == column
        assert [other.get_xdata()[0] for other in ax.lines if other is not line] == [0, 1.5]
        assert ax.get_ylim()[1] > max(column)
    assert axes[1].get_xlabel() == "time (s)"
    words = (
        "Over time, with dotted lines where poses are reached: speed (m/s), turn (rad/s). "
        "They go: speed up to 2.5 m/s at 1 s; turn up to 1 rad/s at 0 s. "
        "The poses are reached at 0, 1.5 s."
    )
    return {"": data.values()}, lesson14.describe_profiles(data, [0, 1.5]), [words]


@pytest.fixture(params=FIGURES)
def drawn(request):
    """A figure in the style of the course, its axes in the plane, and the expected numbers."""
    kinds, draw = FIGURES[request.param]
    with plt.style.context("rbcourse.rbcourse"):
        assert plt.rcParams["pdf.fonttype"] == 42
        fig = plt.figure(figsize=(9, 4 * len(kinds)))
        grid = fig.add_gridspec(len(kinds))
        axes = [
            fig.add_subplot(spot, projection=kind) for spot, kind in zip(grid, kinds, strict=True)
        ]
        yield fig, [ax for ax, kind in zip(axes, kinds, strict=True) if not kind], *draw(*axes)
    plt.close(fig)


def name_of(artist):
    """The title of the axes of an artist and its label, if it has them."""
    title, label = artist.axes.get_title().partition("\n")[0], str(artist.get_label())
    return ", ".join(part for part in (title, label) if part and not part.startswith("_"))


@pytest.mark.source("RR (8)", "RR 2", "BK (8)", "BK (9)", "BK Fig. 4")
def test_artists_hold_the_numbers_under_their_names_and_the_description_says_them(drawn):
    fig, _, held, said, words = drawn
    artists = [artist for ax in fig.axes for artist in ax.get_children() if artist.axes is ax]
    for name, columns in held.items():
        found = list(numbers_of([x for x in artists if name_of(x) == name]))
        for column in columns:
            assert any(np.array_equal(np.ravel(column), numbers) for numbers in found), name
    for word in words:
        assert word in said


def test_axes_have_labels_and_curves_of_one_axes_have_colours(drawn):
    fig, flat, *_ = drawn
    fig.canvas.draw()
    for ax in flat:
        if ax.axison:
            assert any(other.get_xlabel() for other in flat)
            assert any(other.get_ylabel() for other in flat)
        named = [line for line in ax.lines if not line.get_label().startswith("_")]
        assert len({str(line.get_color()) for line in named}) == len(named)


def test_nothing_is_clipped(drawn):
    fig, flat, *_ = drawn
    fig.canvas.draw()
    box = fig.get_tightbbox().transformed(fig.dpi_scale_trans)
    assert (box.min > -1).all()
    assert (box.max < fig.bbox.max + 1).all()
    for ax in flat:
        for artist in [*ax.lines, *ax.patches]:
            if not artist.get_transform().contains_branch(ax.transData):
                continue
            places = artist.get_path().transformed(artist.get_transform()).vertices
            if ax.get_aspect() == 1:  # a picture: marks are not cut either
                places = artist.get_window_extent().corners()
            assert (places >= ax.bbox.min - 1e-6).all(), artist
            assert (places <= ax.bbox.max + 1e-6).all(), artist
