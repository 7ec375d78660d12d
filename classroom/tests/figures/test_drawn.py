"""Test the descriptions of the lessons' figures, and drawn parts that no CSV contains.

When a lesson draws a figure, the figure is compared with the stored one. tests/shown.py checks that
the artists hold the numbers of the CSV, are labelled, and are not clipped.
"""

import numpy as np
import pytest
from matplotlib.figure import Figure
from shown import numbers, numbers_of

import rbcourse as rb
from rbclassroom.figures import (
    FORMS,
    lesson03,
    lesson04,
    lesson05,
    lesson06,
    lesson08,
    lesson09,
    lesson12,
    lesson13,
    lesson14,
    lesson15,
    vectors,
)
from rbcourse.draw import described

MARGINS = {
    "family": np.array(["random"] * 4 + ["Figure 5", "no turn", "no turn"]),
    "projection margin [1]": np.array([0.1, 0.15, 1.5, 1.9, 1.7, 2.0, 2.0]),
    "projection excess [1]": np.array([1000.0, 300.0, 0.2, np.nan, 0.7, 0.5, 1.5]),
    "quaternion margin [1]": np.array([0.6, 0.9, 1.0, 1.0, 1.0, 1.0, 1.0]),
    "quaternion excess [1]": np.array([30.0, 0.2, 0.02, 0.01, 0.04, 0.4, 0.9]),
}


def axes_of(*kinds):
    """Return the axes of a new figure, with the given projections."""
    fig = Figure()
    return [fig.add_subplot(2, 3, k, projection=kind) for k, kind in enumerate(kinds, 1)]


def check_held(axes, held):
    """Check that artists with the given title and label hold the given numbers."""
    for (title, label), columns in held.items():
        artists = [x for ax in axes if ax.get_title() == title for x in ax.get_children()]
        found = list(numbers_of([x for x in artists if str(x.get_label()).startswith(label)]))
        for column in columns:
            same = [numbers for numbers in found if len(numbers) == len(column)]
            assert any(np.allclose(column, numbers, 1e-14, 1e-14, True) for numbers in same), label


def check_said(said, *words):
    for word in words:
        assert word in said


@pytest.mark.source("RR (8)", "RR 2.1")
def test_descriptions_of_turns_state_their_numbers():
    t = np.linspace(0, 1, 11)
    angles = {"t [1]": t, "slow α [rad]": -t, "slow β [rad]": -t, "slow γ [rad]": 2 * t}
    words = "slow: β goes to -57 degrees, and the middle half of α's change takes 50.0 %"
    check_said(lesson03.describe_angles(angles), words)
    words = "turned: x along +y, y along −x, z along +z."
    check_said(lesson03.describe_turns(["turned"], rb.exp_so3([[0, 0, np.pi / 2]])), words)


@pytest.mark.source("BK Prop. 2", "RR 1.4")
def test_descriptions_of_projected_matrices_state_their_numbers():
    matrices = {"M": np.array([[2.0, 0.5], [0, -1]]), "turned": np.array([[0, -1], [1.0, 0]])}
    words = "then those of turned, with M's behind in grey. M mirrors.", "turned turns, 2.87 away"
    check_said(lesson04.describe_columns(matrices), *words)
    points = vectors("{} {} [1]", numbers("lesson04_shadows"), "xy")
    (x, y), (a, b) = points["M"].T, points["Gram–Schmidt"].T
    off = np.degrees(np.abs(np.arctan2(x * b - y * a, x * a + y * b))).max()
    check_said(lesson04.describe_shadows(points), "24 matrices", f"by up to {off:.0f} degrees")
    frames = lesson04.frame_table(np.diag([2.0, 1]), [0, np.pi / 8, np.pi / 4])
    words = "nearest rotation from 0 to 0 rad; Gram–Schmidt from 0 to -0.322 rad"  # atan(1/2) − π/4
    check_said(described("Angles.", frames), words)
    far = lesson04.frame_table(np.array([[-1, 0.3], [0.3, -1]]), np.linspace(0, 6, 50))
    assert np.abs(np.abs(far["nearest rotation [rad]"]) - np.pi).max() < 1e-12


@pytest.mark.source("RR 2")
def test_histograms_count_all_draws_and_show_the_exact_distributions():
    many = {"a": rb.sample_rotation(5000, rng=2), "b": rb.exp_so3(np.zeros((10, 3)))}
    # rounding makes some heights exceed 1
    many["b"][:, 2, 2] += np.finfo(float).eps * np.arange(-5, 5)
    bins, axes = lesson05.histograms(many), axes_of(None, None, None)
    lesson05.draw_histograms(axes, bins)
    for ax, (edges, densities) in zip(axes, bins.values(), strict=True):
        check_held([ax], {("", name): [density] for name, density in densities.items()})
        shares = np.array(list(densities.values())) @ np.diff(edges)
        assert shares == pytest.approx([1, 1], rel=1e-12)
        x, y = ax.lines[0].get_data()
        want = (1 - np.cos(x)) / np.pi if ax is axes[0] else np.full_like(x, 0.5)
        assert np.abs(y - want).max() < 1e-4
    words = "height of the image of e₃, b: 95 %", "angle, b: 100 %"
    check_said(lesson05.describe_histograms(bins), *words)


def test_lines_that_are_not_in_the_table_are_labelled():
    chord, torques = map(numbers, ("lesson06_chord", "lesson13_torques"))
    first, second, *others = axes_of(None, None, None, None, None)
    lesson06.draw_chord(first, chord)
    _, x, y, *arc = chord.values()
    check_held([first], {("", "equal steps on the chord"): [x, y], ("", "their proj"): arc})
    scale = np.array([0.25, 0.5, 1])
    lesson09.draw_excess(second, {"scale [1]": scale, "one excess [1]": scale**4})
    check_held([second], {("", "slope 4"): [scale, scale**4 / 100]})
    lesson13.draw_torques(others, torques)
    laws = vectors("{} {} [N m]", torques).items()
    check_held(
        others, {(law, r"$\Vert\tau\Vert$"): [np.linalg.norm(x, axis=-1)] for law, x in laws}
    )


def test_descriptions_of_curves_state_their_numbers():
    table = numbers("lesson06_same_path")
    paths = vectors("{} {} [1]", table)
    speeds = {name: table[f"{name} speed [rad]"] for name in paths}
    words = f"the geodesic takes the steps {', '.join(['15'] * 10)} degrees; its speed is 2.57 at"
    check_said(lesson06.describe_paths(paths, speeds), words)
    check_said(lesson06.describe_chord(numbers("lesson06_chord")), "spans 150 degrees")
    torques = numbers("lesson13_torques")
    largest = np.linalg.norm(vectors("{} {} [N m]", torques)["least torque"], axis=-1).max()
    check_said(lesson13.describe_torques(torques), f"least torque: {largest:.2g} N m")
    rough = {"t [s]": [0, 1, 2], "x [m/s]": [1e-17, np.nan, -1 / 3], "y [1]": [9e5, 2, 0.1]}
    words = "Rough. While t goes from 0 to 2 s: x from 0 to -0.333 m/s; y from 9e+05 to 0.1."
    assert described("Rough.", rough) == words


@pytest.mark.source("BK (8)", "BK (9)")
def test_descriptions_of_free_and_carried_bodies_state_their_numbers():
    """The paths are circles about axes 1 and 3. One circle about axis 1 passes close to axis 2."""
    spins = vectors("{} w{} [rad]", numbers("lesson08_spins"), "123")
    flips = np.count_nonzero(np.diff(np.sign(spins["axis 2"][:, 1])))
    kept = "it keeps its sign"
    words = f"axis 1: {kept}; axis 2: it changes its sign {flips} times; axis 3: {kept}"
    check_said(lesson08.describe_spins(spins), words)
    a = np.linspace(0, 2 * np.pi, 41)
    near, far = ([np.sqrt(1 - r * r) + 0 * a, r * np.cos(a), r * np.sin(a)] for r in (0.3, 0.995))
    paths = np.swapaxes([near, near[::-1], far], 1, 2)
    words = "2 go round axis 1, 1 round axis 3, none round axis 2. Black: the 1 that"
    check_said(lesson08.describe_momenta(paths), words)
    check_said(lesson08.describe_carried(np.radians([0, 90, 180])), "After 0, 90, 180 degrees")


def test_descriptions_of_the_atlas_state_its_numbers():
    size, table = np.array([0.25, 1, 3]), {}
    for k, way in enumerate(("projection", "Bézier", "normal"), 1):
        table |= {f"{way} median excess [1]": k * 1e-3 * size**4}
    table["size [rad]"], (ax,) = size, axes_of(None)
    lesson12.draw_growth(ax, table, {2: 0.01})  # it has only the curves in the table
    check_held([ax], {("", "_"): [[0.25, 0.5, 1], [0.01, 0.04, 0.16]]})
    ticks = [tick.get_text() for tick in ax.get_yticklabels()]
    assert all(tick.startswith(r"$\mathregular{10^") for tick in ticks) or not any(
        "$" in x for x in ticks
    )
    assert sum(line.get_transform().contains_branch(ax.transData) for line in ax.lines) == 4
    said = {text.get_text().strip(): text.get_color() for text in ax.texts}
    assert next(iter(said)) == "slope 2"
    assert all(said[line.get_label()] == line.get_color() for line in ax.lines[:3])
    places = np.sort([text.xy[1] for text in ax.texts if hasattr(text, "xy")])
    assert np.diff([-0.035, *places, 1.035]).min() > 0.07 - 1e-9
    words = (
        "6.5e+02 where the margin is below 0.2, and 2.0e-01 where it is above 1",
        "Figure 5: 70 % at 1.700. no turn: 50 % at 2.000, 150 % at 2.000.",
        "least margin of the quaternions is 0.60",
    )
    check_said(lesson12.describe_margins(MARGINS), *words)
    largest = np.abs(numbers("lesson12_deviations")["Bézier d [1]"]).max()
    assert largest == pytest.approx(1 / 16 / 12 / 9, rel=0.02)


def test_each_problem_has_the_marker_of_its_family():
    axes, line, held = axes_of(None, None), np.array([0.02, 0.7]), {}
    lesson12.draw_margins(axes, MARGINS)
    for way in ("projection", "quaternion"):
        points = np.array([MARGINS[f"{way} {name} [1]"] for name in ("margin", "excess")])
        held[way, "no turn"] = points[:, 5:]
        held[way, "Figure 5"] = points[:, 4:5]
        held[way, "random"] = points[:, :4]
    check_held(axes, held | {("projection", "slope −3"): [line, line**-3]})


def test_heat_maps_show_each_cell_at_its_place_and_a_line_at_10_percent():
    # the logarithm of the excess increases with the displacement
    slope = np.linspace(-3, 1, 10)
    data = {"family": np.full(100, "along")}
    data |= {f"{way} excess [1]": 10.0 ** np.repeat(slope, 10) for way in FORMS}
    data["Bézier excess [1]"] = np.zeros(100)
    fig = Figure(figsize=(9, 6))
    lesson12.draw_atlas(fig, data, "median")
    maps = {ax.get_title(): ax for ax in fig.axes if ax.get_title() in FORMS}
    assert list(maps) == ["projection", "quaternion", "Bézier"]
    for way, ax in maps.items():
        places = np.asarray(ax.collections[0].get_coordinates())
        assert places[0, :, 0] == pytest.approx([0, *np.arange(9, 180, 18), 180])
        assert places[:, 0, 1] == pytest.approx([0, *np.arange(0.45, 9, 0.9), 9])
        shown = ax.collections[0].get_array()
        assert np.array_equal(shown[1:-1, 1:-1], data[f"{way} excess [1]"].reshape(10, 10).T)
        assert np.array_equal(shown[:, [0, -1]], shown[:, [1, -2]])  # up to the edges
        assert np.array_equal(shown[[0, -1]], shown[[1, -2]])
        assert bool(ax.texts) == (way == "Bézier")  # "< 0.01 % everywhere"
    for line in maps["projection"].collections[1:]:
        drawn = np.concatenate(line.get_paths()[0].to_polygons(closed_only=False))
        assert drawn[:, 0] == pytest.approx(np.interp(-1, slope, np.arange(9, 180, 18)))
    said = lesson12.describe_atlas(data, "median")
    assert "along the axis: projection 30, 50, 70; quaternion 30, 50, 70; Bézier 100," in said


def test_rows_of_maps_are_bodies_and_columns_are_curves():
    names, excess = (
        ("weighted", "two Béziers", "normal"),
        np.random.default_rng(2).random((2, 3, 100)),
    )
    data = {"body": np.repeat(["ball", "book"], 100)}
    data |= {f"{x} median [1]": excess[:, k].ravel() for k, x in enumerate(names)}
    fig = Figure(figsize=(9, 6))
    lesson13.draw_body_atlas(fig, data, ["book", "ball"])
    *maps, _ = fig.axes
    titles = [ax.get_title() for ax in maps[:3]]
    assert titles == ["weighted\nprojection", "cheaper of\ntwo Béziers", "normal\ncubic"]
    assert [ax.get_ylabel() for ax in maps[::3]] == ["book", "ball"]
    for ax, wanted in zip(maps, excess[::-1].reshape(6, 10, 10), strict=True):
        assert np.array_equal(ax.collections[0].get_array()[1:-1, 1:-1], wanted.T)
    share = 100 * np.mean(excess[1, 0] < 0.1)
    said = lesson13.describe_body_atlas(data, ["book"])
    assert f"book: weighted projection {share:.0f}, cheaper of" in said


def test_profiles_show_the_times_of_poses():
    axes = axes_of(None, None)
    data = {"t [s]": [0, 1, 2], "speed [m/s]": [0, 2.5, 1], "turn [rad/s]": [1, 0, 0.25]}
    lesson14.draw_profiles(axes, data, [0, 1.5])
    assert [ax.get_ylabel() for ax in axes] == ["speed\n(m/s)", "turn\n(rad/s)"]
    assert [line.get_xdata()[0] for ax in axes for line in ax.lines[:2]] == [0, 1.5] * 2
    data = {"t [s]": [0, 1, 2], "speed [m/s]": [0, 0, 0], "turn [rad/s]": [-1, 0, 3]}
    lesson14.draw_profiles(axes, data, [])
    assert [ax.get_ylim() for ax in axes] == [(0, 1), pytest.approx((-1.08, 3.24))]


def test_profiles_agree_with_the_motion():
    poses = rb.pose_from_coordinates([[0, 0, 0, 0, 0, 0], [0, 0, 1, 3, 4, 0], [0, 0, 1, 3, 4, 5]])
    table = lesson14.profile_table(rb.chain([0, 2, 4], poses, leg=rb.geodesic), 1, 5)
    assert table["t [s]"].tolist() == [0, 1, 2, 3, 4]
    assert np.allclose(table["angular speed [rad/s]"], [0.5, 0.5, 0, 0, 0], atol=1e-14)
    assert np.allclose(table["speed [m/s]"], 2.5, atol=1e-14)
    smooth, h = rb.projected_spline([0, 2, 4], poses, "rest", rest_at=[1]), 1e-4
    for t, w, d in zip(*lesson14.profile_table(smooth, 2, 9).values(), strict=True):
        if t not in (0, 2, 4):
            before, now, after = (smooth(t + s)[:3, 3] for s in (-h, 0, h))
            assert d == pytest.approx(np.linalg.norm(after - 2 * now + before) / h**2, abs=1e-5)
            w_dot = (smooth(t + h, 1) - smooth(t - h, 1))[:3] / (2 * h)
            assert w == pytest.approx(np.linalg.norm(w_dot), abs=1e-6)
    with pytest.raises(ValueError, match=r"^motion: a single curve on SE\(3\) is wanted"):
        lesson14.profile_table(rb.geodesic(np.eye(3), np.eye(3)), 1)


@pytest.mark.source("beyond BK 7")
def test_free_motions_are_straight_in_normal_coordinates_to_second_order():
    """Free motions deviate from the lines t w by O(w²) in exponential coordinates, and by O(w³) in
    normal coordinates."""
    book, t = rb.Body.box([0.30, 0.20, 0.03]).inertia, np.linspace(0, 1, 5)
    w = np.array([[0.8, 0.6, 1], [-0.6, 0.8, 1]])
    kinds = "exponential coordinates", "normal coordinates"

    def off(inertia, size):
        """Return how far the two motions are from straight lines, in both kinds of coordinates."""
        lines = vectors("{} {} [rad]", lesson13.normal_table(t, size * w, inertia), "xy")
        for k in (1, 2):
            assert np.allclose(lines[f"straight {k}"], t[:, None] * size * w[k - 1, :2], 1e-15)
        return np.array(
            [[lines[f"{kind} {k}"] - lines[f"straight {k}"] for k in (1, 2)] for kind in kinds]
        )

    whole, half = (np.linalg.norm(off(book, size)[:, :, -1], axis=-1) for size in (0.02, 0.01))
    assert np.log2(whole / half) == pytest.approx(np.array([[2, 2], [3, 3]]), abs=0.05)
    w_dot = -np.cross(w, w @ book) @ np.linalg.inv(book)  # Euler's equations
    want = 0.01**2 / 2 * w_dot[:, :2]
    assert off(book, 0.01)[0, :, -1] == pytest.approx(want, abs=0.03 * np.abs(want).max())
    assert np.abs(off(2 * np.eye(3), 1)).max() < 1e-13  # for a ball, both motions are straight

    data, panes = numbers("lesson13_normal"), axes_of(None, None)
    lesson13.draw_normal(panes, data)
    for ax, kind in zip(panes, kinds, strict=True):
        motions = [np.transpose([data[f"{kind} {k} {x} [rad]"] for x in "xy"]) for k in (1, 8)]
        title = ax.get_title()
        assert title == kind
        check_held([ax], {(title, "free motion"): [*motions[0].T], (title, "_"): [*motions[1].T]})
    words = "8 free motions", "exponential coordinates by up to", "normal coordinates by up to"
    check_said(lesson13.describe_normal(data), *words)


def test_the_turns_are_natural_splines_through_the_angles():
    data = lesson14.turns_table({"one": (0, 0), "two": (4, 6)})
    t = data["t [s]"]
    for name, goal in (("one", 0.3), ("two", 0.3 + 20 * np.pi)):
        angle, bend = data[f"{name} [rad]"], data[f"{name} bend [rad]"]
        assert angle[[0, -1]] == pytest.approx([0, goal])
        assert np.abs(bend[[0, -1]]).max() < 1e-12
        assert angle - bend == pytest.approx(goal * t / t[-1])
        curvature = np.diff(angle, 2)
        assert np.abs(curvature[[0, -1]]).max() < 0.05 * np.abs(curvature).max()


def test_limit_curves_are_the_largest_admissible_rates():
    """The test tries many changes of the rate at each place."""
    poses = np.eye(4), rb.pose_from_coordinates([1, 0, 1, 2, 1, 0])
    twists = rb.twist_from_rates(poses, [[0, 1, 0], [1, 0, 0]], [[1, 0, 0], [0, 2, 1]])
    path = rb.minimum_acceleration(*poses, *twists)
    limits = {"speed": 1.5, "angular_speed": 0.7, "acceleration": 2.0, "angular_acceleration": 1.0}
    s = np.linspace(0, 1, 9)
    found = lesson15.highest_rates(path, s, limits)
    V, A = (path(s, k).reshape(9, 2, 3) for k in (1, 2))
    speeds = np.min([0.7, 1.5] / np.linalg.norm(V, axis=2), axis=1)
    assert found["speeds"] == pytest.approx(speeds, rel=1e-12)
    ratios = np.linspace(-60, 60, 240_001)[:, None, None]  # u/x
    for i, rate in enumerate(found["accelerations"]):
        norms = np.linalg.norm(V[i] * ratios + A[i], axis=2) / [1.0, 2.0]
        assert rate == pytest.approx(norms.max(axis=1).min() ** -0.5, rel=1e-5)


def test_two_passes_give_the_largest_squared_rates_below_all_limits():
    """The squared rate x_i is the minimum of highest_j + step |i − j| over all j."""
    highest = np.random.default_rng(3).uniform(0.5, 6, 12)
    highest[[0, -1]] = 0
    apart = np.abs(np.subtract.outer(np.arange(12), np.arange(12)))
    back, both = lesson15.two_passes(highest, 0.8)
    assert both == pytest.approx((highest + 0.8 * apart).min(axis=1))
    later = np.where(np.triu(np.ones((12, 12))), highest + 0.8 * apart, np.inf)
    assert back == pytest.approx(later.min(axis=1))


def test_a_used_share_is_a_norm_divided_by_its_limit():
    path = rb.screw(np.eye(4), rb.pose_from_coordinates([0, 0, 2, 3, 0, 0]))
    data = lesson15.share_table(path, {"angular_speed": 4.0, "speed": 5.0})
    assert data["angular speed [1]"] == pytest.approx(0.5)
    assert data["speed [1]"] == pytest.approx(np.linalg.norm(path(0, 1)[3:]) / 5, abs=5e-5)
    check_said(lesson15.describe_shares(data), "angular speed 0 %, speed 0 %; one of them 0 %")
