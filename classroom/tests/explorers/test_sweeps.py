"""The drawings and the texts of explorers agree with the package at all settings of the sliders."""

from functools import cache

import numpy as np
import pytest
from mpl_toolkits.mplot3d import proj3d
from scipy.linalg import expm
from sweeps import corners, notice, numbers_in, points, read_off, sweep, tell

import rbcourse as rb
from rbclassroom import explorers
from rbclassroom.explorers.paths import POSES, SHARES

TIMES = np.linspace(0, 1, 61)
BOOK = np.array([0.20, 0.13, 0.03])
MOMENTS = 0.5 / 12 * (BOOK @ BOOK - BOOK**2)
START = np.radians([-20, 110])
LAWS = "as if a ball", "least acceleration", "least torque"


@cache
def made(name):
    """An explorer; one of each is enough."""
    return getattr(explorers, f"{name}_explorer")()


def swept(name, **base):
    made(name).restart()
    return sweep(made(name), **base)


def off(found, wanted):
    return np.abs(np.subtract(found, wanted)).max()


def assert_box(box, R, half, place=(0, 0, 0), turned=1e-11, placed=1e-11):
    """A box of these half edges has this orientation and place, but for so much."""
    faces = corners(box)
    assert off(faces.mean(axis=(0, 1)), place) < placed
    assert off(faces.mean(axis=1)[:3] - place, (half * R).T) < turned


def pixels(places, ax):
    """Where places in space, shape (..., 3), are seen in the picture."""
    x, y, _ = proj3d.proj_transform(*np.reshape(places, (-1, 3)).T, ax.get_proj())
    return ax.transData.transform(np.stack([x, y], axis=-1))


@pytest.mark.parametrize(
    ("name", "base", "boxes", "high"),
    [
        (
            "body",
            {"thickness": 30.0},
            dict(zip(LAWS, [[-15, 202], [172, 389], [359, 576]], strict=True)),
            (150, 350),
        ),
        ("screw", {"t": 1.0}, {key: [0, 560] for key in ("geodesic", "screw", "goal")}, (0, 380)),
        ("cube", {"t": 1.0}, {"optimum": [0, 280], "projection": [280, 560]}, (20, 350)),
        ("planar", {"t": 4.0}, {"world outline": None, "body outline": None}, None),
    ],
)
def test_no_body_and_no_way_leaves_its_picture(name, base, boxes, high):
    artists = made(name).artists
    for v in swept(name, **base):
        for key, wide in boxes.items():
            ax = artists[key].axes
            if wide is None:
                places, limits = artists[key].get_xy(), (ax.get_xlim(), ax.get_ylim())
            else:
                places, limits = pixels(corners(artists[key]), ax), (wide, high)
            if name == "cube":
                places = np.append(places, pixels(points(artists[f"{key} way"]), ax), axis=0)
            for (low, most), along in zip(limits, places.T, strict=True):
                assert low < along.min() <= along.max() < most, v


@pytest.mark.parametrize(
    ("name", "values", "said"),
    [
        ("body", {}, {"acceleration": "1.00, 1.00, 1.30 × the least"}),
        ("body", {}, {"torque": "1.11, 1.11, 1.00 × the least"}),
        (
            "body",
            {"about": "the diagonal x + y + z"},
            {
                "acceleration": "1.36, 1.00, 1.04 × the least",
                "torque": "1.62, 1.03, 1.00 × the least",
            },
        ),
        ("cube", {}, {"their ratio": "1.773"}),  # 77 % more: lesson 9, the figure of the paper
        ("minimum_acceleration", {"size": 1.0, "k": 5.0}, {"their ratio": "1.174"}),  # case (c)
        (  # case (a)
            "minimum_acceleration",
            {"size": 1.0, "k": 0.0},
            {
                "cost, projection": "0.222 rad²",
                "their ratio": "none: the optimum costs nothing",
            },
        ),
        ("flip", {"axis": "axis 1", "off": 4.0, "t": 8.0}, {"turned over": "0 times"}),
        ("flip", {"axis": "axis 2", "off": 4.0, "t": 8.0}, {"turned over": "2 times"}),
        ("flip", {"axis": "axis 2", "off": 4.0, "t": 3.0}, {"turned over": "once"}),
        ("flip", {"axis": "axis 3", "off": 4.0, "t": 8.0}, {"turned over": "0 times"}),
        (
            "screw",
            {"angle": 0.0, "x": 1.0, "z": -1.0, "t": 1.0},
            {"its axis through": "none", "slide along it": "all of the way"},
        ),
        ("rotation", {"alpha": 0.0, "beta": 0.0, "gamma": 0.0}, {"axis": "any"}),
        (
            "projection",
            {"e12": 0.8, "e23": 0.0, "e33": -1.0, "pull": 1.0},
            {"M to Gram–Schmidt": "none: M is flat", "nearest?": None},
        ),
        (
            "projection",
            {"e12": 0.0, "e33": -2.0, "pull": 1.0},
            {"nearest?": "several are equally near"},
        ),
        ("projection", {"e12": 0.0, "e33": -1.9, "pull": 1.0}, {"nearest?": None}),
        ("random", {"number": 80.0}, {"p-values": "from 100 rotations on"}),
    ],
)
def test_examples_of_the_lessons_and_singular_settings_are_said(name, values, said):
    explorer = made(name)
    explorer.restart()
    explorer.put(**values)
    assert {key: read_off(explorer).get(key) for key in said} == said
    assert notice(explorer) == ""


def test_no_answer_of_a_poll_is_seen_before_it_is_touched():
    for name in ("theta", "planar", "arm", "cube", "projection", "flip"):
        made(name).restart()
    theta, plan, arm = (made(name) for name in ("theta", "planar", "arm"))
    one, other = (points(theta.artists[name])[:, 1] for name in ("theta", "f"))
    assert off(one, other) > 0.15  # of the height of the axes
    assert theta.values["angle"] not in (90, 150)
    assert made("cube").values == {"turn": 1.0, "spin": 1.0, "rise": 3.0, "t": 0.0}
    assert off(tips("projection", "nearest"), np.eye(3)) < 1e-15
    assert arm.values["t"] == plan.values["t"] == 0
    links, way = (points(arm.artists[name]) for name in ("links", "way"))
    assert off(points(arm.artists["links"].axes.lines[0]), links) < 1e-15  # on its pale twin
    assert np.ptp(way, axis=0).max() < 1e-15
    plan.put(t=4.0)
    assert off(*(points(plan.artists[f"{frame} way"]) for frame in ("world", "body"))) < 1e-15


AXES = {"the diagonal x + y + z": [1, 1, 1], "x,": [1, 0, 0], "y,": [0, 1, 0], "z,": [0, 0, 1]}


@cache
def turned_books(about, turn, thickness):
    """The three curves, the inertia, and both costs of each over the least; solved once."""
    (axis,) = (np.array(x, float) for name, x in AXES.items() if about.startswith(name))
    G = rb.metrics.box_inertia([0.3, 0.2, thickness / 100])
    goal = rb.exp_so3(np.radians(turn) * axis / np.linalg.norm(axis))
    ends = np.eye(3), goal, np.zeros(3), np.zeros(3)
    curves = [
        rb.minimum_acceleration_so3(*ends),
        rb.minimum_acceleration_so3(*ends, G),
        rb.minimum_torque_so3(*ends, G),
    ]
    costs = np.array([[f(c, G) for c in curves] for f in (rb.acceleration_cost, rb.torque_cost)])
    return curves, G, costs / costs.min(axis=1, keepdims=True)


@pytest.mark.source("beyond BK 3", "beyond BK 4")
def test_three_books_their_torques_and_their_costs():
    books = made("body")
    for v in swept("body", t=0.4):
        curves, G, costs = turned_books(v["about"], v["turn"], v["thickness"])
        half = 4.2 * np.array([0.3, 0.2, v["thickness"] / 100]) / 2
        for law, curve in zip(LAWS, curves, strict=True):
            assert_box(books.artists[law], curve(v["t"]), half)
            t, torque = points(books.artists[f"{law} torque"])[1:-1].T
            w, h = curve(t, 1), 1e-5
            rate = (curve(t + h, 1) - curve(t - h, 1)) / (2 * h)
            assert off(torque, np.linalg.norm(rate @ G + np.cross(w, w @ G), axis=-1)) < 1e-6
            assert points(books.artists[f"{law} torque"])[:, 1].max() < 0.3
        for name, ratios in zip(("acceleration", "torque"), costs, strict=True):
            assert numbers_in(read_off(books)[name]) == pytest.approx(ratios, abs=5.1e-3)


@pytest.mark.source("BK Prop. 6", "BK Cor. 1", "BK Cor. 2")
def test_projected_lines_their_dots_and_their_chord():
    line, t, f = made("theta"), np.linspace(0, 1, 101), rb.projected_line
    for v in swept("theta", angle=100.0, t=0.3):
        a, now = np.radians(v["angle"]), v["t"]
        drawn = {name: points(artist) for name, artist in line.artists.items()}
        for name, curve in (("theta", f.theta), ("f", f.f)):
            assert off(drawn[name], np.stack([t, curve(t, a)], axis=-1)) < 1e-14
            assert off(drawn[f"{name} now"], [now, curve(now, a)]) < 1e-14
        first, last = drawn["chord"]
        (on,), (shadow,), (even,) = (drawn[name] for name in ("line", "shadow", "even"))
        assert off(on, first + now * (last - first)) < 1e-14
        assert off(shadow, on / np.linalg.norm(on)) < 1e-12
        for place, angle in ((last, a), (even, now * a)):  # clockwise
            turned = -np.angle(complex(*place) / complex(*first))
            assert turned == pytest.approx(angle, abs=1e-12)
        known = f.theta(now, a), f.theta(now, a, 1), f.f(now, a), np.linalg.norm(on)
        assert off([float(text) for text in read_off(line).values()], known) < 5.1e-4
        assert off(np.linalg.norm(drawn["arc"], axis=1), 1) < 1e-14
        assert off(drawn["arc"][[0, -1]], [first, last]) < 1e-14
        assert off(drawn["ray"], [[0, 0], shadow]) < 1e-14


@pytest.mark.source("BK (10)", "BK (14)")
def test_a_screw_and_a_geodesic_and_the_axis():
    bolt = made("screw")
    for v in swept("screw", tilt=35.0, t=0.6):
        tilt, angle, d = np.radians(v["tilt"]), abs(v["angle"]), np.array([v["x"], 0, v["z"]])
        r = np.radians(v["angle"]) * np.array([np.sin(tilt), 0, np.cos(tilt)])
        goal = rb.pose_from_components(rb.exp_so3(r), d)
        r = rb.log_so3(goal[:3, :3])  # of a half-turn, either
        along = expm(v["t"] * rb.hat_se3(rb.log_se3(goal)))
        geodesic = rb.pose_from_components(rb.exp_so3(v["t"] * r), v["t"] * d)
        said = read_off(bolt)
        for name, pose in (("screw", along), ("geodesic", geodesic)):
            R, place = pose[:3, :3], pose[:3, 3]
            # half-turns lose half the digits
            assert_box(bolt.artists[name], R, 0.4, place, turned=1e-7, placed=1e-12)
            assert off(points(bolt.artists[f"{name} way"])[[0, -1]], [[0, 0, 0], place]) < 1e-12
            turned = float(said[f"turned, {name}"].rstrip("°"))
            assert turned == pytest.approx(v["t"] * angle, abs=0.051)
        assert off(corners(bolt.artists["goal"]).mean(axis=(0, 1)), d) < 1e-12
        apart = np.linalg.norm(along[:3, 3] - geodesic[:3, 3])
        assert numbers_in(said["origins apart"])[0] == pytest.approx(apart, abs=0.0051)
        if 0 < angle < 180:
            axis = points(bolt.artists["axis"])
            steps = axis @ goal[:3, :3].T + d - axis  # the same for all its points, and along it
            assert off(*steps) < 1e-10
            assert np.abs(np.cross(steps[0], axis[1] - axis[0])).max() < 1e-10
            through = axis.mean(axis=0)
            assert off(numbers_in(said["its axis through"]), through) < 0.051
            assert ("not in sight" in said["its axis through"]) == (np.linalg.norm(through) > 3)
            slide = numbers_in(said["slide along it"])[0] * np.radians(angle)
            assert abs(slide) == pytest.approx(np.linalg.norm(steps[0]), abs=0.0051 * np.pi)


@cache
def spun(axis, tilt):
    """The motion of the book, integrated on its own, the momentum upright at the start."""
    i = int(axis[-1]) - 1
    w0 = np.full(3, 4 * np.sin(np.radians(tilt)) / np.sqrt(2))
    w0[i] = 4 * np.cos(np.radians(tilt))
    momentum = MOMENTS * w0 / np.linalg.norm(MOMENTS * w0)
    assert momentum[2] >= 0  # upwards, if only a little
    cross = np.cross(momentum, [0, 0, 1])
    turn = np.linalg.norm(cross)
    start = rb.exp_so3(np.arcsin(turn) * cross / turn) if turn else np.eye(3)
    x, y, _ = start @ [0.8, 0.8, 1]
    start = rb.exp_so3([0, 0, np.radians(-60) - np.arctan2(y, x)]) @ start
    times = np.linspace(0, 8, 201)
    return times, *rb.geodesic_flow(np.diag(MOMENTS), start, w0, times)


@pytest.mark.source("BK (8)")
def test_the_book_and_its_spin():
    book = made("flip")
    for v in swept("flip", axis="axis 2", t=6.0):
        times, R, w = spun(v["axis"], v["off"])
        k = int(np.abs(times - v["t"]).argmin())
        assert times[k] == pytest.approx(v["t"])
        assert_box(book.artists["book"], R[k], BOOK / 2, turned=1e-9)
        for i in range(3):
            drawn = points(book.artists[f"w{i + 1}"])
            assert off(drawn, np.stack([times, w[:, i]], axis=-1)[: k + 1]) < 1e-8
            low, high = points(book.artists[f"axis {i + 1}"])
            assert off(high, (BOOK[i] / 2 + 0.055) * R[k, :, i]) < 1e-9
            assert np.abs(low + high).max() < 1e-15
            place = book.artists[f"number {i + 1}"].get_position_3d()
            assert off(place, (BOOK[i] / 2 + 0.072) * R[k, :, i]) < 1e-9
        said, main = read_off(book), w[k, int(v["axis"][-1]) - 1]
        assert off(numbers_in(said["ω"]), w[k]) < 0.0051
        itself = numbers_in(said[f"of {v['axis']} itself"])[-1]
        assert itself == pytest.approx(main, abs=0.0051)
        momentum = R[k] @ (MOMENTS * w[k])
        assert np.abs(momentum[:2]).max() < 1e-9 * np.linalg.norm(momentum)
        assert momentum[2] > 0
        assert list(book.artists["now"].get_xdata()) == [v["t"], v["t"]]


def test_at_first_all_three_numbers_are_on_the_side_of_the_eye_and_another_axis_starts_anew():
    book = made("flip")
    ax = book.artists["book"].axes
    e, a = np.radians([ax.elev, ax.azim])
    eye = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    for axis in ("axis 1", "axis 2", "axis 3"):
        for tilt in (0.0, 4.0):
            book.put(axis=axis, off=tilt, t=0.0)
            places = [book.artists[f"number {i}"].get_position_3d() for i in (1, 2, 3)]
            assert (places @ eye > 0).all()
    book.put(t=5.0)
    book.controls["axis"].value = "axis 1"
    assert book.values["t"] == 0


RIVALS = {
    "projection": rb.projected_cubic_so3,
    "exponential": rb.exponential_cubic_so3,
    "Bézier": rb.bezier_so3,
    "corrected": rb.corrected_bezier_so3,
    "cumulative": rb.cumulative_bezier_so3,
    "quaternion": rb.quaternion_cubic_so3,
    "Cayley": rb.cayley_cubic_so3,
}
KNOWN = {}


def solved(optimum, rival, ends):
    """Both curves of these ends, and the costs of their rotations; each is solved once."""
    key = rival.__name__, str(ends)
    if key not in KNOWN:
        curves = optimum(*ends), rival(*ends)
        KNOWN[key] = curves, [float(rb.acceleration_cost_parts(curve)[0]) for curve in curves]
    return KNOWN[key]


def check_costs(said, low, high, rival="projection"):
    costs = [numbers_in(said[f"cost, {name}"])[0] for name in ("optimum", rival)]
    assert costs == pytest.approx([low, high], abs=5.1e-4)
    if low > 1e-12:
        assert float(said["their ratio"]) == pytest.approx(high / low, abs=5.1e-4)
    else:
        assert said["their ratio"] == "none: the optimum costs nothing"


def apart(curves, t):
    """By how many degrees two motions are turned against each other."""
    best, near = (curve(t)[..., :3, :3] for curve in curves)
    return np.degrees(np.linalg.norm(rb.log_so3(np.swapaxes(best, -1, -2) @ near), axis=-1))


@pytest.mark.source("BK (19)", "BK (21)", "BK Fig. 4")
def test_an_optimum_its_rivals_and_their_costs():
    rotations, sigma1 = made("minimum_acceleration"), np.pi / 6 * np.array([1, 2, 3])
    artists = rotations.artists
    for v in swept("minimum_acceleration", k=3.0):
        sigma = v["size"] * sigma1
        ends = np.eye(3), rb.exp_so3(sigma), sigma, sigma + v["k"] * np.eye(3)[0]
        curves, costs = solved(rb.minimum_acceleration_so3, RIVALS[v["rival"]], ends)
        said = read_off(rotations)
        check_costs(said, *costs, v["rival"])
        for name, curve in zip(("optimum", "rival"), curves, strict=True):
            drawn = np.transpose([points(artists[f"{name} {axis}"])[:, 1] for axis in "xyz"])
            assert off(drawn, rb.log_so3(curve(TIMES))) < 1e-12
            assert_box(artists[f"{name} box"], curve(v["t"]), [0.65, 0.4, 0.125], turned=1e-12)
            if v["rival"] != "Cayley" or name != "rival":  # it may leave the picture
                steps = np.abs(np.diff(drawn, axis=0))
                assert steps.max() < 0.5  # never round the ball of radius π
                low, high = artists["σ₁"].axes.get_ylim()
                assert low < drawn.min() <= drawn.max() < high
        heights = [artists[f"σ{number}"].get_position()[1] for number in "₁₂₃"]
        assert off(heights, sigma) < 1e-15
        most = float(said["apart at most"].rstrip("°"))
        assert most == pytest.approx(apart(curves, TIMES).max(), abs=0.051)


@pytest.mark.source("BK Fig. 5", "BK 6.3")
def test_both_cubes_their_ways_and_their_costs():
    cubes, makers = made("cube"), (rb.minimum_acceleration_se3, rb.projected_cubic_se3)
    for v in swept("cube", spin=2.0, t=0.4):
        sigma = v["turn"] * np.pi / 6 * np.array([1, 4, 3])
        A1 = rb.pose_from_coordinates([*sigma, 8, 10, 12])
        ends = np.eye(4), A1, [1, 2, 3], [2, 1, v["spin"]], [1, 1, 1], [1, 5, v["rise"]]
        curves, costs = solved(*makers, ends)
        for name, curve in zip(("optimum", "projection"), curves, strict=True):
            boxes = {name: curve(v["t"]), f"{name} goal": A1}
            if name == "optimum":
                boxes["difference"] = boxes[name]
            for box, A in boxes.items():
                assert_box(cubes.artists[box], A[:3, :3], 1.75, A[:3, 3])
            assert off(points(cubes.artists[f"{name} way"]), curve(TIMES)[:, :3, 3]) < 1e-11
        check_costs(read_off(cubes), *costs)
        now = float(read_off(cubes)["apart now"].rstrip("°"))
        assert now == pytest.approx(apart(curves, v["t"]), abs=0.051)


LEGS = {
    "projected cubics": rb.projected_cubic_se3,
    "optima": rb.minimum_acceleration_se3,
    "projected quintics": rb.projected_quintic_so3,
    "geodesics": rb.geodesic_se3,
}


def test_the_box_its_way_and_its_speeds_are_those_of_the_chain():
    chain = made("chain")
    artists = chain.artists
    assert np.array_equal(points(artists["poses"]), POSES[:, :3, 3])
    fastest = [{"leg": x, "share": s, "duration": 4.0, "t": 0.4} for x in LEGS for s in (0.0, 1.5)]
    for v in [*swept("chain", t=0.4), *fastest]:
        chain.put(**v)
        knots, velocities, now = v["duration"] * SHARES, None, v["t"] * v["duration"]
        if v["leg"] != "geodesics":
            rates = rb.bessel_velocities(knots, POSES)
            velocities = v["share"] * rates * [[0], [1], [1], [0]]
        c = rb.chain(knots, POSES, velocities, leg=LEGS[v["leg"]])
        way, A = points(artists["way"]), c(now)
        assert off(way, c(np.linspace(*c.domain, len(way)))[:, :3, 3]) < 1e-12
        assert_box(artists["box"], A[:3, :3], [0.45, 0.3, 0.15], A[:3, 3], 1e-12, 1e-12)
        times = np.linspace(0, v["duration"], 241)
        rates = [np.linalg.norm(c(times, k).reshape(-1, 2, 3), axis=-1) for k in (1, 2)]
        here = np.linalg.norm(c(now, 1).reshape(2, 3), axis=-1)
        for i, name in enumerate(("angular speed (rad/s)", "speed (m/s)")):
            line, dot = (points(artists[key]) for key in (name, f"{name} now"))
            assert off(line, np.stack([times, rates[0][:, i]], axis=1)) < 1e-12
            assert off(dot, [now, here[i]]) < 1e-12
            assert line[:, 1].max() < artists[name].axes.get_ylim()[1]
            joints = artists[f"{name} joints"].get_segments()
            assert [segment[0, 0] for segment in joints] == list(c.times[1:-1])
        said = {key: numbers_in(text.replace("²", "")) for key, text in read_off(chain).items()}
        assert off(said["fastest"], rates[0].max(axis=0)) < 0.0051
        assert off(said["strongest"], rates[1].max(axis=0)) < 0.0051
        for key, order in (("ω jumps", 1), ("ω′ jumps", 2)):
            jump = np.linalg.norm(c.jumps(order)[:, :3], axis=1).max()
            assert abs(said[key][0] - jump) < 0.0051


def planned(v, t, frame):
    """The states of the two commands of a plan, up to a time."""
    first, second = ([v[f"vx{i}"], v[f"vy{i}"], np.radians(v[f"omega{i}"])] for i in (1, 2))
    commands = [(first, min(t, 2.0)), (second, max(t - 2.0, 0.0))]
    return rb.planar.propagate_planar([0, 0, 0], commands, frame=frame)[-1]


@pytest.mark.source("RR (17)", "RR (18)", "RR (19)")
def test_both_bodies_are_where_the_plan_leads_them():
    plan = made("planar")
    for v in swept("planar", omega1=45.0, t=4.0):
        for frame in ("world", "body"):
            x, y, theta = end = planned(v, v["t"], frame)
            way = points(plan.artists[f"{frame} way"])
            assert len(way) == round(v["t"] * 20) + 1
            whole = planned(v, 4.0, frame)
            assert off(points(plan.artists[f"{frame} plan"])[-1], whole[:2]) < 1e-12
            assert off(way[-1], [x, y]) < 1e-12
            outline = plan.artists[f"{frame} outline"].get_xy()[:4]
            assert off(outline.mean(axis=0), [x, y]) < 1e-12
            assert off(outline[1] - outline[0], [1.3 * np.cos(theta), 1.3 * np.sin(theta)]) < 1e-12
            said = numbers_in(read_off(plan)[frame])
            assert off(said, [*end[:2], np.degrees(theta)]) <= 0.501
            assert off(said[:2], [x, y]) < 0.0051
    names = "vx1", "vy1", "omega1", "vx2", "vy2", "omega2", "t"
    v = dict(zip(names, (1.0, -0.5, 90.0, -1.0, 0.2, -45.0, 4.0), strict=True))
    plan.put(**v)
    for frame in ("world", "body"):
        for k, place in enumerate(points(plan.artists[f"{frame} way"])):
            assert off(place, planned(v, k / 20, frame)[:2]) < 1e-12


def hand(q):
    return rb.arm.arm_forward_kinematics(q).joints[-1]


@pytest.mark.source("RR (20)", "RR (21)")
def test_the_arm_and_the_way_of_its_hand():
    arm = made("arm")
    for v in swept("arm", theta0=77.0, theta1=-40.0):
        goal = np.radians([v["theta0"], v["theta1"]])
        q = (1 - v["t"]) * START + v["t"] * goal
        joints, way = rb.arm.arm_forward_kinematics(q).joints, points(arm.artists["way"])
        assert off(points(arm.artists["links"]), joints) < 1e-14
        assert off(points(arm.artists["goal"])[0], hand(goal)) < 1e-14
        middle = hand((START + q) / 2)
        assert off(way[[0, len(way) // 2, -1]], [hand(START), middle, joints[-1]]) < 1e-14
        said = read_off(arm)
        assert off(numbers_in(said["angles"]), np.degrees(q)) < 0.051
        assert off(numbers_in(said["hand"]), joints[-1]) < 0.0051


@pytest.mark.parametrize("name", ["theta0", "theta1"])
def test_who_sets_a_goal_sees_the_arm_there(name):
    arm = made("arm")
    arm.restart()
    arm.controls[name].value = 45.0
    q = np.radians([arm.values["theta0"], arm.values["theta1"]])
    assert arm.values["t"] == 1
    assert off(points(arm.artists["links"])[-1], hand(q)) < 1e-14


@pytest.mark.parametrize("place", [(1, 2), (-2.5, -1), (0.6, -0.1), (3.4, 0), (3, 3), (0.1, 0.2)])
@pytest.mark.parametrize("elbow", [110.0, -60.0])
def test_a_click_brings_the_hand_there_with_the_elbow_on_its_side_or_says_why_not(place, elbow):
    arm = made("arm")
    arm.restart()
    arm.put(theta1=elbow)
    before, box = arm.values, arm._fig.bbox
    x, y = arm.artists["links"].axes.transData.transform(place)
    tell(arm, place=[x / box.width, 1 - y / box.height])
    if 0.5 <= np.hypot(*place) <= 3.5:
        assert off(points(arm.artists["links"])[-1], place) < 1e-6
        assert arm.values["theta1"] * elbow > 0
        assert notice(arm) == ""
    else:
        assert "0.5 to 3.5 m from the base" in notice(arm)
        assert arm.values == before


def tips(explorer, name):
    """The columns of a matrix whose axes are drawn."""
    lines = [points(made(explorer).artists[f"{name} {axis}"]) for axis in "xyz"]
    assert all((line[0] == 0).all() for line in lines)
    return np.stack([line[1] for line in lines], axis=-1)


@pytest.mark.source("RR (7)", "RR (8)", "RR 2.1")
def test_box_axes_turns_and_gimbal_lock_belong_to_the_angles():
    orientation, (x, y, z) = made("rotation"), np.eye(3)
    artists = orientation.artists
    for v in swept("rotation"):
        alpha, beta, gamma = np.radians([v["alpha"], v["beta"], v["gamma"]])
        R = rb.exp_so3(alpha * z) @ rb.exp_so3(beta * y) @ rb.exp_so3(gamma * x)
        assert off(tips("rotation", "body"), R) < 1e-14
        assert_box(artists["box"], R, [0.65, 0.4, 0.125], turned=1e-14)
        turns = {"first turn": z, "second turn": rb.exp_so3(alpha * z) @ y, "third turn": R @ x}
        for name, axis in turns.items():
            assert np.abs(np.cross(points(artists[name]), axis)).max() < 1e-14
        one = points(artists["axis"])
        assert off(one @ R.T, one) < 1e-8  # near half-turns the axis has half the digits
        assert one.any() == (np.abs(R - np.eye(3)).max() > 1e-9)
        assert ("gimbal lock" in read_off(orientation)) == (abs(v["beta"]) == 90)
    for beta, sign in ((90.0, 1), (-90.0, -1)):
        orientation.put(alpha=20.0, beta=beta, gamma=50.0)
        before, said = tips("rotation", "body"), read_off(orientation)["gimbal lock"]
        orientation.put(alpha=30.0, gamma=50.0 + sign * 10)
        assert off(tips("rotation", "body"), before) < 1e-14
        assert read_off(orientation)["gimbal lock"] == said
        assert f"{20 - sign * 50}°" in said


def test_all_that_is_read_off_is_the_same_rotation():
    made("rotation").put(alpha=50.0, beta=-30.0, gamma=110.0)
    said, R = read_off(made("rotation")), rb.matrix_from_zyx(np.radians([50, -30, 110]))
    matrix = np.array([line.split() for line in said["matrix"].splitlines()], dtype=float)
    q, axis = (np.array(said[key].split(","), dtype=float) for key in ("quaternion", "axis"))
    angle = np.radians(float(said["angle"].rstrip("°")))
    assert off(matrix, R) <= 0.00051
    assert off(rb.matrix_from_quaternion(rb.project_quaternion(q)), R) < 0.03
    assert off(rb.exp_so3(angle * axis), R) < 0.03
    assert np.degrees(angle) == pytest.approx(np.degrees(np.linalg.norm(rb.log_so3(R))), abs=0.051)


@pytest.mark.source("BK Prop. 2")
def test_matrices_and_their_repairs():
    repairs = made("projection")
    for v in swept("projection", pull=1.0, e23=-0.3):
        M = np.eye(3) + v["pull"] * np.array([[0, v["e12"], 0], [0, 0, v["e23"]], [0, 0, v["e33"]]])
        drawn, R, G = (tips("projection", name) for name in ("M", "nearest", "Gram–Schmidt"))
        S, said = R.T @ M, read_off(repairs)
        assert off(drawn, M) < 1e-15
        assert off(S, S.T) < 1e-14  # nearest, by definition
        assert np.linalg.eigvalsh(S)[:2].sum() > -1e-14
        assert np.linalg.det(R) > 0
        letter = repairs.artists["nearest x letter"].get_position_3d()
        assert off(letter, 1.15 * R[:, 0]) < 1e-14
        singular, det = np.linalg.svd(M, compute_uv=False), np.linalg.det(M)
        assert off(numbers_in(said["singular values"]), singular) < 0.0051
        assert float(said["determinant"]) == pytest.approx(det, abs=0.0051)
        assert float(said["M to nearest"]) == pytest.approx(np.linalg.norm(M - R), abs=5.1e-4)
        if abs(det) < 1e-12:
            assert not G.any()
            assert said["M to Gram–Schmidt"] == "none: M is flat"
            continue
        Q, triangle = np.linalg.qr(M)
        assert off(G, Q * np.sign(np.diag(triangle))) < 1e-12
        if det < 0:
            assert (said["M to Gram–Schmidt"], said["angle between"]) == ("a mirror", "none")
            continue
        assert float(said["M to Gram–Schmidt"]) == pytest.approx(np.linalg.norm(M - G), abs=5.1e-4)
        between = np.degrees(np.linalg.norm(rb.log_so3(R.T @ G)))
        assert float(said["angle between"].rstrip("°")) == pytest.approx(between, abs=0.051)


@pytest.mark.source("RR 2.1", "RR 2.2")
def test_dots_and_histogram_are_of_the_first_rotations():
    sample = made("random")
    samplers = {"three angles": rb.sampling.sample_rotation_naive, "uniform": rb.sample_rotation}
    for v in swept("random"):
        R = samplers[v["sampler"]](2000, rng=int(v["seed"]))[: int(v["number"])]
        e1, said = R[:, :, 0], read_off(sample)
        assert np.array_equal(points(sample.artists["points"]), e1)
        density, edges, _ = sample.artists["histogram"].get_data()
        counts, _ = np.histogram(e1[:, 2], edges)
        assert off(density * np.diff(edges), counts / len(R)) < 1e-14
        caps = 100 * np.mean(np.abs(e1[:, 2]) > 0.5)
        assert numbers_in(said["|height| > ½"])[0] == pytest.approx(caps, abs=0.051)
        assert density.max() < sample.artists["histogram"].axes.get_xlim()[1]
        for name in ("image of e₁", "angle") if len(R) >= 100 else ():
            p = rb.sampling.uniformity_tests(R)[name].p_value
            if p < 1e-6:
                assert said[f"p, {name}"] == "< 1e-6: not uniform"
            else:
                assert float(said[f"p, {name}"]) == pytest.approx(p, rel=0.051)
