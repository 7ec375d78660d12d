"""The committed figures: all files are present, and their numbers agree with the definitions."""

from functools import partial

import numpy as np
import oracles
import pytest
from optima import ALONG, PAPER
from scipy.integrate import simpson
from scipy.interpolate import CubicHermiteSpline
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


D, LONG = np.pi / 180, np.linalg.norm(PAPER["5"][0])
SECONDS = np.array([0, 3, 4, 6, 9]) / 9


def circle(angle, radius):
    return radius * np.sin(angle), radius * (1 - np.cos(angle))


def half_turned(t):
    """Return points on a circle that start at 30° and turn by 90° per unit of time."""
    return np.cos((30 + 90 * t) * D), np.sin((30 + 90 * t) * D)


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


ROUTE, JOINTS = ("x [m]", "y [m]", "theta [rad]"), ("theta0 [rad]", "theta1 [rad]")
FLAT = "x [1]", "y [1]"
METRES = "x [m]", "y [m]", "z [m]"
FORMULAS = {
    "report_fig6": (ROUTE, lambda t: (6 * t, 3 * t, 90 * D * t)),
    "report_fig7": (ROUTE, report_fig7),
    "report_fig8": (JOINTS, lambda t: ((150 * t - 20) * D, (110 - 170 * t) * D)),
    "report_fig9": (JOINTS, report_fig9),
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
    """SciPy computes the optimum; a quadrature of the stored accelerations gives both costs."""
    turn, w0, w1 = PAPER["5"]
    solution = oracles.minimum_acceleration(turn, w0, w1)
    t = np.arange(106) / 105
    R = oracles.rotation_of_quaternions(solution.sol(t)[:4])
    d0, d1, v0, v1 = np.zeros(3), np.array([8, 10, 12]), np.ones(3), np.array([1, 5, 3])
    p = CubicHermiteSpline([0, 1], [d0, d1], [v0, v1])
    projected = rb.projected_cubic(np.eye(3), rb.exp_so3(turn), w0, w1)(t)
    costs = []
    for name, drawn in (("paper_fig5a", R), ("paper_fig5b", projected)):
        data = numbers(name)
        w_dot = columns(data, "w{}' [rad]", "123")
        assert np.abs(data["t [1]"] - t).max() < 1e-12
        assert np.array_equal(np.flatnonzero(data["drawn [1]"]), np.arange(0, 106, 15))
        assert np.abs(matrices(data) - drawn).max() < 1e-9
        assert np.abs(columns(data, "{} [m]") - p(t)).max() < 1e-10
        for values, order in (("v", 1), ("a", 2)):
            body = (np.swapaxes(drawn, 1, 2) @ p(t, order)[..., None])[..., 0]
            assert np.abs(columns(data, values + "{} [m]", "123") - body).max() < 1e-8
        costs.append([simpson(2 * np.sum(w_dot**2, 1), x=t), 2396])
    assert np.abs(numbers("paper_fig5a")["w1' [rad]"] - solution.sol(t)[7]).max() < 1e-8
    table = numbers("paper_fig5_costs")
    assert list(table) == ["figure", "curve", "rotation [rad²]", "translation [m²]"]
    figure, curve, *found = table.values()
    assert [*zip(figure, curve, strict=True)] == [("5a", "optimum"), ("5b", "projection")]
    assert np.allclose(np.transpose(found), costs, rtol=1e-3)


@pytest.mark.source("RR 4", "RR 4.1", "RR Fig. 8", "RR Fig. 9")
def test_the_tips_of_arms_agree_with_their_joint_angles():
    """The tip touches the circle, or moves along three arcs."""
    tips = {}
    for name in ("report_fig8", "report_fig9"):
        data = numbers(name)
        theta0, theta1 = (data[f"theta{i} [rad]"] for i in (0, 1))
        elbow = 2 * np.exp(1j * theta0)
        tips[name] = elbow + 1.5 * np.exp(1j * (theta0 + theta1))
        for k, place in ((1, elbow), (2, tips[name])):
            assert np.abs(data[f"x{k} [m]"] + 1j * data[f"y{k} [m]"] - place).max() < 1e-10
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
