"""The committed figures: all files are present, and their numbers agree with the definitions."""

from functools import partial

import numpy as np
import oracles
import pytest
from optima import ALONG, PAPER
from scipy.integrate import simpson, solve_ivp
from scipy.interpolate import CubicHermiteSpline, make_interp_spline
from shown import FIGURES, numbers

import rbcourse as rb
from rbclassroom import atlas
from rbclassroom.figures import FORMS
from rbcourse.draw.save import UNITS

TABLES = ("paper_fig5_costs",)  # tables without pictures


def columns(data, form, keys="xyz"):
    """Return an array of the columns whose names contain these keys."""
    return np.stack([data[form.format(key)] for key in keys], axis=-1)


def matrices(data, form="R{} [1]"):
    return columns(data, form, [f"{i}{j}" for i in "123" for j in "123"]).reshape(-1, 3, 3)


@pytest.mark.parametrize(
    "name", sorted({file.stem for file in FIGURES.iterdir() if file.is_file()})
)
def test_every_figure_has_complete_files(name):
    plain = "figure", "curve", "frame", "family", "body", "domain"
    for column in numbers(name):
        assert column.endswith(tuple(f" [{unit}]" for unit in UNITS)) or column in plain, column
    files = {file.suffix for file in FIGURES.glob(f"{name}.*")}
    if name in TABLES:
        assert files == {".csv"}
        return
    # lesson 17 tells how to include its figure in an article
    pdf = {".pdf"} if name.startswith(("paper_", "report_", "lesson17_paper")) else set()
    assert files - {".gif"} == {".png", ".csv"} | pdf
    if pdf:
        content = (FIGURES / f"{name}.pdf").read_bytes()
        assert b"/Type3" not in content.replace(b" ", b"")
        assert b"/FontFile2" in content
        assert b"CreationDate" not in content


D, W, LONG = np.pi / 180, 2 * np.pi, np.linalg.norm(PAPER["5"][0])
CHORD = np.exp(150j * D)
SECONDS = np.array([0, 3, 4, 6, 9]) / 9


def circle(angle, radius):
    return radius * np.sin(angle), radius * (1 - np.cos(angle))


def half_turned(t):
    """Return points on a circle that start at 30° and turn by 90° per unit of time."""
    return np.cos((30 + 90 * t) * D), np.sin((30 + 90 * t) * D)


def on_chord(t):
    line = 1 - t + t * CHORD
    arc = line / np.abs(line)
    return line.real, line.imag, arc.real, arc.imag


def report_fig7(t):
    """Go right for 3 s, turn for 1 s, follow the diagonal for 2 s, go right while turning for 3
    s."""
    ways = [0, 3, 3, 5, 8], [0, 0, 0, 2, 2], [0, 0, 45 * D, 45 * D, -90 * D]
    return [np.interp(t, SECONDS, way) for way in ways]


def report_fig9(t):
    """Turn the shoulder, then the elbow, then both in opposite directions, at 45 degrees a
    second."""
    ways, far = ([0, 1, 1, 0], [0, 0, 1, 2]), 135 * D
    return [far * np.interp(3 * t, range(4), way) for way in ways]


GOAL, TURNED, CORNER = 5 + 1j, np.exp(150j * D), -1 - 0.5j


def straight(t):
    """Return the poses of the centre when the corner of the body moves on a straight line."""
    turn = np.exp(150j * D * t)
    centre = CORNER + t * (GOAL + TURNED * CORNER - CORNER) - turn * CORNER
    return centre.real, centre.imag, 150 * D * t


def screwed(t):
    """Return poses on a circle about a fixed point."""
    centre = GOAL / (1 - TURNED) * (1 - np.exp(150j * D * t))
    return centre.real, centre.imag, 150 * D * t


ROUTE, JOINTS = ("x [m]", "y [m]", "theta [rad]"), ("theta0 [rad]", "theta1 [rad]")
FLAT = "x [1]", "y [1]"
METRES = "x [m]", "y [m]", "z [m]"
CUTS = [f"{way} {x} [1]" for way in ("line", "arc") for x in "xy"]
FORMULAS = {
    "lesson00_cubes": (METRES, lambda t: (*circle(3 * t, 6), 7 * t)),
    "lesson00_cubes,R": (["21 [1]"], lambda t: [np.sin(3 * t)]),
    "report_fig6": (ROUTE, lambda t: (6 * t, 3 * t, 90 * D * t)),
    "report_fig7": (ROUTE, report_fig7),
    "lesson01_ways,as the numbers say ": (ROUTE, lambda t: (6 * t, 0, (170 - 340 * t) * D)),
    "lesson01_ways,the short way ": (ROUTE, lambda t: (6 * t, 0, (170 + 20 * t) * D)),
    "lesson01_straight,blended by the centre ": (ROUTE, lambda t: (5 * t, t, 150 * D * t)),
    "lesson01_straight,blended by the corner ": (ROUTE, straight),
    "lesson01_straight,screw by the centre ": (ROUTE, screwed),
    "lesson01_straight,screw by the corner ": (ROUTE, screwed),
    "lesson01_frames,world axes ": (ROUTE, lambda t: (W * t, 0, W * t)),
    "lesson01_frames,body axes ": (ROUTE, lambda t: (*circle(W * t, 1), W * t)),
    "lesson02_posture": (JOINTS, lambda t: (30 * D, 45 * D + 0 * t)),
    "lesson02_arrows,elbow at 90° ": (JOINTS, lambda t: (20 * D, 90 * D + 0 * t)),
    "lesson02_arrows,elbow at 10° ": (JOINTS, lambda t: (20 * D, 10 * D + 0 * t)),
    "lesson02_two_spaces,straight for the motors ": (JOINTS, lambda t: (150 * D * t, 60 * D)),
    "report_fig8": (JOINTS, lambda t: ((150 * t - 20) * D, (110 - 170 * t) * D)),
    "report_fig9": (JOINTS, report_fig9),
    "lesson06_chord": (CUTS, on_chord),
    "lesson08_ways,metric (14) ": (METRES, lambda t: (7.2 * t, 0, 4 * t)),
    "lesson08_ways,metric (10) ": (METRES, lambda t: (*circle(8 * t, 0.9), 4 * t)),
    "lesson08_ways,off centre ": (
        METRES,
        lambda t: (0.5 + 7.2 * t - np.cos(8 * t) / 2, 4 * t - np.sin(8 * t) / 2, 4 * t),
    ),
    "lesson08_half,constant in the room ": (FLAT, lambda t: half_turned(0 * t)),
    "lesson08_half,parallel ": (FLAT, lambda t: half_turned(t)),
    "lesson08_half,constant in the body ": (FLAT, lambda t: half_turned(2 * t)),
    "lesson13_jerk,least jerk": ([" [rad]"], lambda t: [LONG * 30 * (t - t * t) ** 2]),
}


@pytest.mark.source("BK (10)", "BK (14)", "BK 2.6", "BK Prop. 6", "beyond BK 5", "RR 3.2", "RR 4")
@pytest.mark.source("RR (14)", "RR (15)", "RR (16)", "RR (17)", "RR (18)", "RR (19)", "RR (20)")
@pytest.mark.source("RR (21)", "RR (22)", "RR (23)", "RR Fig. 6", "RR Fig. 7", "RR Fig. 8")
@pytest.mark.source("RR Fig. 9", "BK (9)")
@pytest.mark.parametrize("place", FORMULAS)
def test_columns_agree_with_formulas(place):
    name, _, prefix = place.partition(",")
    keys, formula = FORMULAS[place]
    data = columns(numbers(name), prefix + "{}", keys)
    want = np.transpose(np.broadcast_arrays(*formula(np.linspace(0, 1, len(data)))))
    assert (np.abs(data - want) < 6e-12 * np.maximum(1, np.abs(want))).all()


@pytest.mark.source("BK Fig. 1")
def test_the_numbers_of_paper_fig1_are_right():
    frame, *values = numbers("paper_fig1").values()
    places, R = np.split(np.transpose(values), [3], axis=1)
    assert list(numbers("paper_fig1"))[1:4] == list(METRES)
    assert frame.tolist() == ["F", "M"]
    assert np.array_equal([*places[0], *R[0]], [0, 0, 0, *np.eye(3).ravel()])
    assert rb.is_so(R.reshape(2, 3, 3), 1e-11).all()


@pytest.mark.source("BK Fig. 2", "BK Fig. 3")
@pytest.mark.parametrize(
    ("name", "column", "order"),
    [("2a", "theta", 0), ("2b", "theta_dot", 1), ("3a", "f", 0), ("3b", "f_dot", 1)],
)
def test_the_numbers_of_paper_fig2_and_fig3_are_right(name, column, order):
    data = numbers(f"paper_fig{name}")
    angle, t, value = (data[key] for key in ("angle [rad]", "t [1]", f"{column} [1]"))
    assert np.allclose(np.unique(angle), np.arange(1, 23) * np.pi / 24, rtol=1e-11)
    assert np.allclose(np.unique(t), np.linspace(0, 1, 101), atol=1e-11)
    oracle = getattr(oracles, column.removesuffix("_dot"))
    for i in range(0, len(t), 37):
        assert value[i] == pytest.approx(oracle(t[i], angle[i], order), rel=1e-9, abs=1e-10)


@pytest.mark.source("BK Fig. 4", "BK (21)")
@pytest.mark.parametrize(("name", "extra"), [("4a", 0), ("4b", 1), ("4c", 5)])
def test_the_numbers_of_paper_fig4_are_right(name, extra):
    """SciPy computes the optimum; the projection must satisfy its definition."""
    data = numbers(f"paper_fig{name}")
    t, w1 = data["t [1]"], ALONG + np.array([extra, 0, 0])
    best, near = (columns(data, f"{x} sigma{{}} [rad]", "123") for x in ("optimum", "projection"))
    solution = oracles.minimum_acceleration(ALONG, ALONG, w1)
    want = oracles.rotation_of_quaternions(solution.sol(t)[:4])
    assert np.abs(np.array([oracles.exp_so3(s) for s in best]) - want).max() < 1e-9
    R1 = oracles.exp_so3(ALONG)
    V0, V1 = np.cross(ALONG, np.eye(3)).T, R1 @ np.cross(w1, np.eye(3)).T
    u = t[:, None, None]
    M = np.eye(3) + V0 * u + (3 * (R1 - np.eye(3)) - 2 * V0 - V1) * u**2
    M = M + (2 * (np.eye(3) - R1) + V0 + V1) * u**3
    S = np.array([oracles.exp_so3(s).T for s in near]) @ M
    assert np.abs(S - np.swapaxes(S, -1, -2)).max() < 1e-10
    assert oracles.two_smallest_eigenvalues(S).min() > 1


@pytest.mark.source("BK Fig. 5", "BK 6.3")
def test_the_numbers_of_paper_fig5_are_right():
    turn, w0, w1 = PAPER["5"]
    solution = oracles.minimum_acceleration(turn, w0, w1)
    t = np.arange(106) / 105
    R = oracles.rotation_of_quaternions(solution.sol(t)[:4])
    d0, d1, v0, v1 = np.zeros(3), np.array([8, 10, 12]), np.ones(3), np.array([1, 5, 3])
    p = CubicHermiteSpline([0, 1], [d0, d1], [v0, v1])
    costs = []
    for name in ("paper_fig5a", "paper_fig5b"):
        data = numbers(name)
        w, w_dot = (columns(data, f"w{{}}{x} [rad]", "123") for x in ("", "'"))
        drawn = R if name == "paper_fig5a" else matrices(data)
        assert np.abs(data["t [1]"] - t).max() < 1e-12
        assert np.array_equal(np.flatnonzero(data["drawn [1]"]), np.arange(0, 106, 15))
        assert np.abs(matrices(data) - drawn).max() < 1e-9
        assert np.abs(columns(data, "{} [m]") - p(t)).max() < 1e-10
        for values, order in (("v", 1), ("a", 2)):
            body = (np.swapaxes(drawn, 1, 2) @ p(t, order)[..., None])[..., 0]
            assert np.abs(columns(data, values + "{} [m]", "123") - body).max() < 1e-8
        # Splines through the numbers of the file give the angular velocity and acceleration of R.
        entries = make_interp_spline(t, drawn.reshape(-1, 9), 7)
        rate = np.swapaxes(drawn, 1, 2) @ entries(t, 1).reshape(-1, 3, 3)
        assert np.abs(rb.vee_so3(rate) - w)[5:-5].max() < 1e-4
        assert np.abs(make_interp_spline(t, w, 7)(t, 1) - w_dot)[5:-5].max() < 1e-3
        costs.append([simpson(2 * np.sum(w_dot**2, 1), x=t), 2396])
    assert np.abs(numbers("paper_fig5a")["w1' [rad]"] - solution.sol(t)[7]).max() < 1e-8
    projected = rb.projected_cubic(np.eye(3), rb.exp_so3(turn), w0, w1)(t)
    assert np.abs(drawn - projected).max() < 1e-11
    table = numbers("paper_fig5_costs")
    assert list(table) == ["figure", "curve", "rotation [rad²]", "translation [m²]"]
    figure, curve, *found = table.values()
    assert [*zip(figure, curve, strict=True)] == [("5a", "optimum"), ("5b", "projection")]
    assert np.allclose(np.transpose(found), costs, rtol=1e-3)


@pytest.mark.source("BK 1", "BK 7", "beyond BK 6", "beyond BK 7")
@pytest.mark.parametrize(
    ("name", "count", "off", "others"),
    [
        ("lesson09_excursion", 4, 0.1, {}),
        ("lesson12_growth", 3, 0.5, {"cumulative": 2, "corrected": 8}),
        ("lesson13_growth", 3, 0.5, {"projection": 2, "Bézier": 2}),
    ],
)
def test_the_excess_usually_grows_as_the_fourth_power_of_the_excursion(name, count, off, others):
    size, *_ = (data := numbers(name)).values()
    curves = {key.partition(" median")[0]: x for key, x in data.items()}
    del curves[next(iter(data))]
    assert len(curves) == {"lesson12_growth": len(FORMS), "lesson13_growth": 4}.get(name, 3)
    for curve, excess in curves.items():
        slope = np.diff(np.log(excess[:count])) / np.diff(np.log(size[:count]))
        assert np.abs(slope - others.get(curve, 4)).max() < off, curve


@pytest.mark.source("RR 2", "RR Fig. 4", "RR Fig. 5")
@pytest.mark.parametrize(("sample", "kind"), [("three angles", "_naive"), ("uniform", "")])
def test_stored_random_rotations_agree_with_the_samplers(sample, kind):
    draw = getattr(rb.sampling, f"sample_rotation{kind}")
    quaternions = getattr(rb.sampling, f"sample_quaternion{kind}")(100, rng=6)
    for name, R in (
        ("report_fig4", draw(100, rng=4)),
        ("report_fig5", oracles.rotation_of_quaternions(quaternions.T)),
    ):
        for vector, v in (("v0", [0, 0, 1]), ("v1", [0, 0.2, 1])):
            drawn = columns(numbers(name), f"{sample} {vector} {{}} [1]")
            assert np.abs(drawn - R @ v).max() < 1e-11


@pytest.mark.source("RR 4", "RR 4.1", "RR Fig. 8", "RR Fig. 9")
def test_the_tips_of_arms_agree_with_their_joint_angles():
    """The tips move along a line or along three arcs, or touch the circle."""
    tips = {}
    for name, prefix in (
        ("lesson02_posture", ""),
        ("lesson02_arrows", "elbow at 90° "),
        ("lesson02_arrows", "elbow at 10° "),
        ("lesson02_two_spaces", "straight for the motors "),
        ("lesson02_two_spaces", "straight for the hand "),
        ("report_fig8", ""),
        ("report_fig9", ""),
    ):
        data = numbers(name)
        theta0, theta1 = (data[f"{prefix}theta{i} [rad]"] for i in (0, 1))
        elbow = 2 * np.exp(1j * theta0)
        tips[name] = elbow + 1.5 * np.exp(1j * (theta0 + theta1))
        for k, place in ((1, elbow), (2, tips[name])):
            found = data[f"{prefix}x{k} [m]"] + 1j * data[f"{prefix}y{k} [m]"]
            assert np.abs(found - place).max() < 1e-10
    line, t = tips["lesson02_two_spaces"], np.linspace(0, 1, 401)
    assert np.abs(line - (line[0] + t * (line[-1] - line[0]))).max() < 2e-4
    assert abs(tips["report_fig8"]).max() > 3.499
    centres = 0, 2 * np.exp(0.75j * np.pi), -1.5j
    for start, centre, radius in zip((0, 30, 60), centres, (3.5, 1.5, 2), strict=True):
        arc = tips["report_fig9"][start : start + 31]
        assert np.abs(abs(arc - centre) - radius).max() < 1e-10


@pytest.mark.source("BK 1", "BK 7")
def test_a_cell_of_the_atlas_agrees_with_its_hundred_problems():
    # the first 100 cells are along the axis; this one is at 81° and 4.95 rad
    cell = 100 + 4 * 10 + 5
    ends = atlas.atlas_problems(100, rng=11).take(slice(100 * cell, 100 * cell + 100))
    best = rb.acceleration_cost(rb.minimum_acceleration(*ends))
    for name, place in (("median", 49), ("ninety", 89)):
        data = {key: column[cell] for key, column in numbers(f"lesson12_{name}").items()}
        assert data.pop("family") == "across"
        assert list(data.values())[:3] == pytest.approx([np.radians(81), 4.95, 100])
        for way, make in FORMS.items():
            excess = np.sort(rb.acceleration_cost(make(*ends)) / best - 1)[place]
            assert data[f"{way} excess [1]"] == pytest.approx(excess, rel=1e-3, abs=1e-8), way


@pytest.mark.source("beyond BK 3", "beyond BK 6", "beyond BK 7")
@pytest.mark.parametrize("name", atlas.BODIES)
def test_a_cell_of_the_atlas_of_bodies_agrees_with_its_problems(name):
    table, cell = atlas.stored("maps"), 3 * 10 + 3  # this cell is at 63° and 3.15 rad
    data = {key: column[table["body"] == name][cell] for key, column in table.items()}
    assert [data[x] for x in list(data)[1:4]] == pytest.approx([np.radians(63), 3.15, 200])
    ends = atlas.atlas_problems(200, ["any"], rng=31).take(slice(200 * cell, 200 * cell + 200))
    body = atlas.BODIES[name]
    best = rb.minimum_acceleration(*ends, body=body).cost
    makers = {
        "weighted": partial(rb.projected_cubic, body=body),
        "normal": partial(rb.closed_forms.normal_cubic, body=body),
        "Bézier": rb.closed_forms.bezier,
        "long way": partial(rb.closed_forms.bezier, long=True),
        "projection": rb.projected_cubic,
        "ball's optimum": rb.minimum_acceleration,
    }
    excess = {curve: atlas.costs(make, ends, body) / best - 1 for curve, make in makers.items()}
    excess["two Béziers"] = np.minimum(excess["Bézier"], excess.pop("long way"))
    excess["three"] = np.minimum(excess["two Béziers"], excess["normal"])
    for curve, x in excess.items():
        stored = [data[f"{curve} {place} [1]"] for place in ("median", "90 %")]
        assert stored == pytest.approx(np.sort(x)[[99, 179]], rel=2e-3, abs=1e-6)


def test_the_intervals_cover_all_problems_of_three_seeds():
    table = atlas.stored("intervals")
    assert sorted(set(table["seed [1]"])) == [31, 32, 33]
    everything = table["problems [1]"][table["domain"] == "all"]
    assert everything.tolist() == 9 * len(set(table["curve"])) * [20000]


@pytest.mark.source("beyond BK 1", "beyond BK 3", "beyond BK 4")
def test_the_torques_of_lesson_13_turn_its_book_to_the_goal():
    """By Euler's equation, the stored torques take the book from rest to rest at the goal."""
    torques, poses = numbers("lesson13_torques"), numbers("lesson13_book")
    G, t = rb.Body.box([0.3, 0.2, 0.03]).inertia, torques["t [s]"]
    diagonal = rb.exp_so3(np.radians(150) * np.ones(3) / np.sqrt(3))

    def euler(t, y, torque):
        R, w = y[:9].reshape(3, 3), y[9:]
        rate = np.linalg.solve(G, torque(t) - np.cross(w, G @ w))
        return np.concatenate([(R @ rb.hat_so3(w)).ravel(), rate])

    rest = [0, 0, 0]
    for law in ("as if a ball", "least acceleration", "least torque"):
        torque = [make_interp_spline(t, columns(torques, f"{law} {{}} [N m]"), k=5)]
        start = [*np.eye(3).ravel(), *rest]
        end = solve_ivp(euler, (0, 1), start, args=torque, rtol=1e-10, atol=1e-12).y[:, -1]
        for R in (diagonal, matrices(poses, f"{law} R{{}} [1]")[-1]):
            assert np.abs(end - [*R.ravel(), *rest]).max() < 1e-6, law


def test_the_readme_states_the_cost_of_the_projection():
    best, near = numbers("paper_fig5_costs")["rotation [rad²]"]
    readme = (FIGURES.parent / "README.md").read_text("utf-8")
    assert f"costs {100 * (near / best - 1):.0f} % more" in readme
