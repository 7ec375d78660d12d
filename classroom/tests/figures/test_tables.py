"""The numbers of the lessons' figures are those of the mathematics, and animations follow them."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import rbcourse as rb
from rbclassroom.figures import (
    lesson03,
    lesson04,
    lesson05,
    lesson06,
    lesson08,
    lesson09,
    lesson11,
    lesson13,
    lesson14,
)

T = np.linspace(0, 1, 21)
STEP = rb.exp_so3([0.01, 0.02, -0.03])
M = np.random.default_rng(1).normal(size=(30, 2, 2))
M = M[np.linalg.det(M) > 0.1]
POINTS = np.array([[0, 0], [1, 2], [3, 2.5], [4, 0.5]])
SIGMA = np.pi / 6 * np.array([1, 2, 3])  # BK (21)
ENDS = np.eye(3), rb.exp_so3(SIGMA), SIGMA, SIGMA + np.array([5, 0, 0])
V = np.array([0, -0.8, 0.6])
G = rb.metrics.box_inertia([0.3, 0.2, 0.03])


@pytest.fixture
def axes():
    """In the plane, in the plane, in space."""
    fig = plt.figure()
    kinds = None, None, "space"
    yield [fig.add_subplot(1, 3, k, projection=kind) for k, kind in enumerate(kinds, 1)]
    plt.close(fig)


def places(artist):
    return np.array(artist.get_data_3d() if hasattr(artist, "get_data_3d") else artist.get_data())


def turn_and_mirror(matrices):
    """z and m with M ζ = z ζ + m ζ*, from where M takes 1 and i."""
    one, i = matrices[:, 0, 0] + 1j * matrices[:, 1, 0], matrices[:, 0, 1] + 1j * matrices[:, 1, 1]
    return (one - 1j * i) / 2, (one + 1j * i) / 2


@pytest.mark.source("RR 2.1")
def test_turned_boxes_carry_their_frames(axes):
    R, ax = rb.exp_so3([[0, 0, np.pi / 2]]), axes[2]
    box, *room, x, y, z = lesson03.draw_turns([ax], ["turned"], R)
    assert np.array_equal([np.ptp(places(line), axis=1) for line in room], 2.6 * np.eye(3))
    assert np.abs(np.ptp(box.corners[:6], axis=(0, 1)) - [1.0, 1.6, 0.3]).max() < 1e-15
    for arrow, direction in zip((x, y, z), R[0].T, strict=True):
        start, tip, *_ = places(arrow).T
        assert np.array_equal(start, [0, 0, 0])
        assert np.abs(tip - 1.2 * direction).max() < 1e-15
    assert [ax.get_title(), *(text.get_text() for text in ax.texts)] == ["turned", *"xyz"]
    said = lesson03.describe_turns(["turned"], R)
    assert "turned: x along +y, y along −x, z along +z." in said


def test_a_matrix_in_single_precision_drifts_and_a_repaired_one_does_not():
    ways = {"left alone": (STEP, None), "repaired": (STEP, rb.project_so)}
    counts, alone, repaired = lesson04.drift_table(2000, ways).values()
    assert (counts[0], counts[-1]) == (1, 2000)
    assert np.all(counts[counts > 100] % 100 == 0)
    R, factor = np.eye(3, dtype=np.float32), STEP.astype(np.float32)
    for _ in range(int(counts[20])):
        R = R @ factor
    defect = np.linalg.norm(R.astype(float).T @ R.astype(float) - np.eye(3))
    assert alone[20] == pytest.approx(defect, abs=3e-6)
    assert np.array_equal(alone[counts <= 100], repaired[counts <= 100])
    assert alone[-1] > 5 * repaired[-1]
    assert repaired.max() < 2e-5


def test_a_first_order_step_stretches():
    h = 0.02
    factor = np.eye(3) + rb.hat_so3([0, 0, h])
    defect = lesson04.drift_table(100, {"first": (factor, None)})["first [1]"][-1]
    assert defect == pytest.approx(np.sqrt(2) * ((1 + h * h) ** 100 - 1), rel=1e-3)


@pytest.mark.source("BK Prop. 2", "RR 1.4")
def test_columns_are_arrows_with_the_distances_that_they_miss(axes):
    over, turned = np.array([[2.0, 0.5], [0, -1]]), rb.project_so([[0, -2], [3, 0]])
    matrices = {"M": over, "turned": turned}
    data = lesson04.column_table(matrices)
    assert list(data) == ["M x [1]", "M y [1]", "turned x [1]", "turned y [1]"]
    given, behind, before, *misses = lesson04.draw_columns(axes[:2], matrices)
    for arrows, name in ((given, "M"), (behind, "M"), (before, "turned")):
        assert np.array_equal([arrows.U, arrows.V], [data[f"{name} {axis} [1]"] for axis in "xy"])
        assert np.all(arrows.get_offsets() == 0)
    assert np.array_equal(given.get_facecolors(), before.get_facecolors())
    assert not np.array_equal(given.get_facecolors(), behind.get_facecolors())
    ends = np.array([line.get_xydata() for line in misses])
    assert np.array_equal(ends.swapaxes(0, 1), [over.T, turned.T])
    missed = np.linalg.norm(ends[:, 1] - ends[:, 0])
    titles = "M\nmirrors", f"turned\nturns, misses {missed:.2f}"
    for ax, title in zip(axes, titles, strict=False):
        assert (ax.get_title(), ax.get_xlabel()) == (title, "x")
        assert np.abs(ends).max() < ax.get_xlim()[1]
    said = lesson04.describe_columns(matrices)
    assert "then those of turned, with M's behind in grey. M mirrors." in said
    assert f"turned turns, {missed:.2f} away" in said


@pytest.mark.source("BK Prop. 2")
def test_the_nearest_rotation_lies_on_the_ray_and_gram_schmidt_on_that_of_the_first_column():
    z, m = turn_and_mirror(M)
    first = (z + m) / abs(z + m)
    table = lesson04.shadow_table(lesson04.shadows(M))
    for name, wanted in {"M": z, "nearest rotation": z / abs(z), "Gram–Schmidt": first}.items():
        found = table[f"{name} x [1]"] + 1j * table[f"{name} y [1]"]
        assert np.abs(found - wanted).max() < 1e-14


@pytest.mark.source("BK Prop. 3")
def test_in_turned_frames_the_nearest_rotation_is_one_and_gram_schmidt_finds_others():
    angles = np.linspace(0, 2 * np.pi, 25)
    frame, nearest, gram_schmidt = lesson04.frame_table(M[0], angles).values()
    (z,), (m,) = turn_and_mirror(M[:1])
    assert np.array_equal(frame, angles)
    assert np.abs(nearest - np.angle(z)).max() < 1e-14
    wanted = z + m * np.exp(-2j * angles)  # the mirror part turns twice as fast
    assert np.abs(np.exp(1j * gram_schmidt) - wanted / abs(wanted)).max() < 1e-13
    far = lesson04.frame_table(np.array([[-1, 0.3], [0.3, -1]]), np.linspace(0, 6, 50))
    said = lesson04.describe_frames(far).replace("-", "")
    assert "nearest rotation finds 180.0 degrees in every" in said


@pytest.mark.source("RR 2")
def test_histograms_are_densities():
    rounded = rb.matrix_from_quaternion(
        rb.conversions.quaternion_from_zyx([[k, 0, 0] for k in range(10)])
    )
    rounded[:, 2, 2] += np.finfo(float).eps * np.arange(-5, 5)  # heights beyond 1, by rounding
    rounded[0] = np.eye(3)
    many = {"uniform": rb.sample_rotation(5000, rng=2), "e3 up": rounded}
    data = lesson05.histogram_table(lesson05.histograms(many))
    for column, unit in (("angle", "rad"), ("height of e₁", "1"), ("height of e₃", "1")):
        for name in many:
            density = data[f"{column}, {name} [1]"]
            edges = data[f"{column} [{unit}]"]
            assert np.sum(density[:-1] * np.diff(edges)) == pytest.approx(1, rel=1e-12)
            assert density[-1] == 0
    counts, _ = np.histogram(many["uniform"][:, 2, 0], np.linspace(-1, 1, 21))
    assert np.allclose(data["height of e₁, uniform [1]"][:-1], counts / 500, rtol=1e-12)
    assert data["height of e₃, e3 up [1]"][19] == pytest.approx(10)
    assert data["angle, e3 up [1]"][0] > 0


def test_a_surface_spans_the_table_and_has_the_colours_of_the_curves(axes):
    angle, t = np.meshgrid(np.arange(1, 23) * np.pi / 24, np.linspace(0, 1, 5), indexing="ij")
    table = {"angle [rad]": angle, "t [1]": t, "theta [1]": rb.projected_line.theta(t, angle)}
    (surface,) = lesson06.draw_surface(axes[2].figure.add_subplot(projection="3d"), table)
    faces = [np.asarray(face) for face in surface._faces]
    for axis, column in enumerate(["t [1]", "angle [rad]", "theta [1]"]):
        found = np.concatenate(faces)[:, axis]
        assert (found.min(), found.max()) == (table[column].min(), table[column].max())
    starts = np.array([face[:, 1].min() for face in faces])
    for line, row in zip(lesson06.draw_family(axes[0], table)[:-1], range(3, 20, 4), strict=True):
        colours = surface._facecolor3d[starts == angle[row, 0]]
        assert np.array_equal(colours, np.tile(line.get_color(), (4, 1)))


def test_motions_are_carried_points_and_speeds():
    makers = {"geodesic": rb.geodesic_so3, "projected line": rb.projected_line_so3}
    curves = {name: make(np.eye(3), rb.exp_so3([0, 0, 2])) for name, make in makers.items()}
    paths = {name: curve(T) @ [1, 0, 0] for name, curve in curves.items()}
    speeds = {name: np.linalg.norm(curve(T, 1), axis=-1) for name, curve in curves.items()}
    table, theta = lesson06.path_table(T, paths, speeds), rb.projected_line.theta
    assert np.abs(table["geodesic x [1]"] - np.cos(2 * table["t [1]"])).max() < 1e-15
    assert np.abs(table["projected line y [1]"] - np.sin(2 * theta(T, 2))).max() < 1e-15
    assert np.abs(table["projected line speed [rad]"] - 2 * theta(T, 2, 1)).max() < 1e-14


@pytest.mark.source("BK Fig. 1")
def test_the_moving_frame_shows_both_frames(axes):
    poses = rb.pose_from_coordinates([[0] * 6, [0, 0, np.pi / 2, 1, 2, 3]])
    box, *triads, vector = lesson06.draw_moving_frame(axes[2], ["F", "M"], poses)
    assert len(triads) == 6
    assert np.abs(box.corners[:6].mean(axis=(0, 1)) - [1, 2, 3]).max() < 1e-14
    assert np.abs(np.ptp(box.corners[:6], axis=(0, 1)) - [1.0, 1.4, 0.7]).max() < 1e-14  # turned
    assert np.array_equal(places(vector)[:, :2].T, [[0, 0, 0], [1, 2, 3]])
    fixed, moving = ([f"${axis}_{name}$" for axis in "xyz"] for name in "FM")
    texts = [text.get_text() for text in axes[2].texts]
    assert texts == [*fixed, "{F}", *moving, "{M}", "d"]
    said = lesson06.describe_moving_frame(["F", "M"], poses)
    assert "(1, 2, 3) m" in said
    assert "90 degrees" in said


@pytest.mark.source("BK (8)")
def test_momenta_lie_on_the_sphere_on_paths_of_equal_energy_and_the_book_turns_with_its_pin(axes):
    moments, times, starts = np.array([1.0, 2, 3]), np.linspace(0, 24, 481), 1.99 * np.eye(3) + 0.01
    R, w = rb.geodesic_flow(np.diag(moments), np.eye(3), starts, times)
    L = lesson08.momentum_directions(moments, w)
    number, *table = lesson08.momentum_table(L).values()
    assert np.array_equal(np.stack(table, axis=-1), L)
    assert np.array_equal(number[:, 0], [0, 1, 2])
    assert L.shape == (3, 481, 3)
    assert np.abs(np.linalg.norm(L, axis=-1) - 1).max() < 1e-14
    assert np.abs(np.cross(L, np.swapaxes(moments * w, 0, 1))).max() < 1e-14 * np.abs(w).max() * 3
    energy = (L**2 / moments).sum(axis=-1)
    assert np.abs(energy - energy[:, :1]).max() < 1e-9
    edges = np.array([2.0, 1, 0.5])
    update = lesson08.moving_book(axes[2], times, R[:, 1], edges)
    flat = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * edges / 2
    for i in (0, 40, 100, 120, 130, 160):
        book, pin, clock = update(i)
        assert clock.get_text() == f"t = {times[i]:.1f}"
        corners = np.unique(book.corners[:6].reshape(-1, 3).round(12), axis=0)
        assert np.abs(np.sort(corners, 0) - np.sort(flat @ R[i, 1].T, 0)).max() < 1e-11
        foot, tip = places(pin).T
        assert np.abs(foot - edges[1] / 2 * R[i, 1, :, 1]).max() < 1e-14
        assert np.abs(np.cross(tip, foot)).max() < 1e-14
        assert tip @ foot > foot @ foot


def test_the_description_of_the_book_says_when_it_turns_over():
    t = np.linspace(0, 4, 41)
    over = rb.exp_so3(np.outer(np.where(t > 1.95, np.pi, 0), [1, 0, 0]))
    upright, still = rb.exp_so3([np.pi / 2, 0, 0]), np.broadcast_to(np.eye(3), over.shape)
    for R, fate in (
        (over @ upright, "up, and turns over at t = 2.0."),
        (still @ upright, "up, and stays there."),
        (still, "down, and stays there."),
    ):
        assert f"It starts {fate}" in lesson08.describe_book(t, R)


def test_coordinates_are_rotation_vectors_and_equal_curves_coincide():
    curve = rb.minimum_acceleration_so3(*ENDS)
    curves = {"optimum": curve, "projection": rb.projected_cubic_so3(*ENDS)}
    t, *sigma = lesson09.coordinate_table(curves, T).values()
    assert np.array_equal(t, T)
    assert np.array_equal(sigma, np.concatenate([rb.log_so3(c(T)).T for c in curves.values()]))
    same = lesson09.coordinate_table(dict.fromkeys(curves, curve), T)
    assert lesson09.describe_coordinates(same).endswith("They coincide at all times.")


@pytest.fixture(scope="module")
def level():
    """The points of a level, shape (4 - k, 2 or 3, times), from the table of the construction."""
    table = lesson11.casteljau_table(T, POINTS, ENDS, V)
    return lambda name, k: np.array(
        [
            [
                table[f"{name} level {k} point {j} {axis} [1]"]
                for axis in "xyz"[: 2 + (name != "plane")]
            ]
            for j in range(4 - k)
        ]
    )


def test_casteljaus_points_are_bernsteins_cubic_and_beziers_curve_with_their_controls(level):
    s = 1 - T
    bernstein = np.array([s**3, 3 * s**2 * T, 3 * s * T**2, T**3])
    assert np.abs(level("plane", 3)[0] - POINTS.T @ bernstein).max() < 1e-12
    assert np.abs(level("sphere", 3)[0].T - rb.bezier_so3(*ENDS)(T) @ V).max() < 1e-12
    R0, R1, w0, w1 = ENDS
    controls = R0, R0 @ rb.exp_so3(w0 / 3), R1 @ rb.exp_so3(-w1 / 3), R1
    assert np.abs(np.moveaxis(level("sphere", 0), 2, 0) - controls @ V).max() < 1e-14
    assert np.array_equal(level("plane", 0)[:, :, 3], POINTS)


def test_the_construction_moves_by_its_table_along_lines_and_geodesics(axes, level):
    update = lesson11.moving_casteljau(axes[1:], T, POINTS, ENDS, V)
    words = ["b₀", "b₁", "b₂", "b₃"], ["R₀v", "B₁v", "B₂v", "R₁v"]
    for ax, name, labels in zip(axes[1:], ("plane", "sphere"), words, strict=True):
        assert [text.get_text() for text in ax.texts][:4] == labels
        legs = places(next(line for line in ax.lines if line.get_marker() == "o"))
        for point in level(name, 0)[..., 0]:
            assert np.abs(legs - point[:, None]).max(axis=0).min() < 1e-12
    for i in (0, 4, 20, 7):
        clock, *artists = update(i)
        assert clock.get_text() == f"t = {T[i]:.2f}"
        for name, (*legs, curve, point) in (("plane", artists[:4]), ("sphere", artists[4:])):
            for k, leg in enumerate(legs, 1):
                marked = places(leg)[:, leg.get_markevery()]
                assert np.abs(marked.T - level(name, k)[..., i]).max() < 1e-12
            assert np.array_equal(places(curve), level(name, 3)[0][:, : i + 1])
            assert np.array_equal(places(point)[:, 0], level(name, 3)[0][:, i])
    straight, arc = (places(artists[k]) for k in (1, 5))
    a, b = level("plane", 2)[..., 7]
    assert np.abs(straight - (a[:, None] + np.outer(b - a, np.linspace(0, 1, 33)))).max() < 1e-12
    assert np.abs(np.linalg.norm(arc, axis=0) - 1).max() < 1e-12
    assert np.linalg.svd(arc - arc[:, :1], compute_uv=False)[2] < 1e-12  # a circle, in one plane
    assert np.ptp(np.linalg.norm(np.diff(arc, axis=1), axis=0)) < 1e-12
    first, last = (np.degrees(np.linalg.norm(w) / 3) for w in ENDS[2:])
    said = lesson11.describe_casteljau(ENDS)
    assert f"next are {first:.0f}, " in said
    assert f", {last:.0f} degrees." in said


@pytest.mark.source("beyond BK 1")
@pytest.mark.parametrize(
    ("make", "inertia"),
    [
        (rb.minimum_acceleration_so3, ()),
        (rb.minimum_acceleration_so3, (G,)),
        (rb.minimum_torque_so3, (G,)),
    ],
)
def test_the_torque_changes_the_angular_momentum_in_the_room(make, inertia):
    ends = np.eye(3), rb.exp_so3([1.0, -0.7, 1.2]), np.array([1.0, 2, 0]), np.array([0, -1.0, 2])
    curve, h, inner = make(*ends, *inertia), 1e-5, T[1:-1]

    def momentum(t):
        return (curve(t) @ G @ curve(t, 1)[..., None])[..., 0]

    changes = (momentum(inner + h) - momentum(inner - h)) / (2 * h)
    torque = lesson13.torques(curve, G, inner)
    off = np.abs((curve(inner) @ torque[..., None])[..., 0] - changes).max()
    assert off < 1e-7 * np.abs(torque).max()
    table = lesson13.torque_table(T, {"law": curve}, G)
    assert list(table) == ["t [s]", *(f"law {axis} [N m]" for axis in "xyz")]
    columns = np.transpose(list(table.values())[1:])
    assert np.array_equal(columns, lesson13.torques(curve, G, T))


def test_speeds_and_accelerations_are_those_of_the_motion():
    poses = rb.pose_from_coordinates([[0, 0, 0, 0, 0, 0], [0, 0, 1, 3, 4, 0], [0, 0, 1, 3, 4, 5]])
    table = lesson14.profile_table(rb.chain([0, 2, 4], poses, leg=rb.geodesic_se3), 1, 5)
    assert table["t [s]"].tolist() == [0, 1, 2, 3, 4]
    assert np.allclose(table["angular speed [rad/s]"], [0.5, 0.5, 0, 0, 0], atol=1e-14)
    assert np.allclose(table["speed [m/s]"], 2.5, atol=1e-14)
    smooth, h = rb.chain([0, 2, 4], poses), 1e-4
    for t, w, d in zip(*lesson14.profile_table(smooth, 2, 9).values(), strict=True):
        if t not in (0, 2, 4):
            before, now, after = (smooth(t + s)[:3, 3] for s in (-h, 0, h))
            assert d == pytest.approx(np.linalg.norm(after - 2 * now + before) / h**2, abs=1e-5)
            w_dot = (smooth(t + h, 1) - smooth(t - h, 1))[:3] / (2 * h)
            assert w == pytest.approx(np.linalg.norm(w_dot), abs=1e-6)
    with pytest.raises(ValueError, match=r"^motion: a single curve on SE\(3\) wanted"):
        lesson14.profile_table(rb.geodesic_so3(np.eye(3), np.eye(3)), 1)


def test_columns_that_never_change_or_are_negative_have_axes_too(axes):
    data = {"t [s]": [0, 1, 2], "speed [m/s]": [0, 0, 0], "turn [rad/s]": [-1, 0, 3]}
    lesson14.draw_profiles(axes[:2], data, [])
    assert [ax.get_ylim() for ax in axes[:2]] == [(0, 1), pytest.approx((-1.08, 3.24))]
