"""The committed figures: complete, and their numbers against the definitions."""

import csv
import re
from pathlib import Path

import numpy as np
import oracles
import pytest
from scipy.integrate import simpson, solve_ivp
from scipy.interpolate import CubicHermiteSpline, make_interp_spline

import rbcourse as rb
from rbclassroom.surveys import atlas, body_atlas
from rbclassroom.surveys.survey import survey
from rbcourse.draw.save import UNITS

FIGURES = Path(__file__).parents[1] / "figures"
TABLES = "paper_fig5_costs", "lesson13_atlas_intervals"  # without pictures
NAIVE = rb.sampling.sample_rotation_naive, rb.sampling.sample_quaternion_naive
HAAR = rb.sample_rotation, rb.sample_quaternion


def committed(name):
    with (FIGURES / f"{name}.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    return rows[0], rows[1:]


def numbers(name):
    header, rows = committed(name)
    return dict(zip(header, np.array(rows, dtype=float).T, strict=True))


def test_letters_have_18_pixels_in_the_lecture_view():
    """There a figure is 992 pixels wide, or as high as the screen lets it: 652, players 599."""
    for path in FIGURES.glob("*.pdf"):
        box = re.search(rb"/MediaBox \[ ?0 0 ([\d.]+) ([\d.]+)", path.read_bytes())
        width, height = map(float, box.groups())  # in points, as the 12 of the smallest letters
        most = 599 if path.with_suffix(".gif").exists() else 652
        assert 12 * min(992, most * width / height) / width >= 18, path.name


def test_fonts_in_documents_are_what_journals_take():
    documents = sorted(FIGURES.glob("*.pdf"))
    assert documents
    for document in documents:
        content = document.read_bytes()
        assert b"/Type3" not in content.replace(b" ", b""), document.name
        assert b"/FontFile2" in content, document.name
        assert b"CreationDate" not in content, document.name


def test_every_figure_has_its_files_and_units_in_every_column():
    names = {file.stem for file in FIGURES.iterdir() if file.is_file()}
    for name in names:
        files = {file.suffix for file in FIGURES.glob(f"{name}.*")}
        assert files - {".gif"} == {".png", ".pdf", ".csv"} or name in TABLES
        for column in committed(name)[0]:
            assert column.endswith(tuple(f" [{unit}]" for unit in UNITS)) or column in (
                "figure",
                "curve",
                "frame",
                "family",
                "body",
                "domain",
            ), column


@pytest.mark.source("BK Fig. 1")
def test_the_data_of_paper_fig1():
    header, rows = committed("paper_fig1")
    values = np.array([row[1:] for row in rows], dtype=float)
    assert header[1:4] == ["x [m]", "y [m]", "z [m]"]
    assert [row[0] for row in rows] == ["F", "M"]
    R = values[:, 3:].reshape(2, 3, 3)
    assert np.array_equal(
        values[0], np.eye(4)[:3, [3, 0, 1, 2]].T.ravel()[[0, 1, 2, *range(3, 12)]]
    )
    assert rb.is_so(R, 1e-11).all()


@pytest.mark.parametrize(
    ("name", "column", "order"),
    [
        pytest.param("paper_fig2a", "theta", 0, marks=pytest.mark.source("BK Fig. 2")),
        pytest.param("paper_fig2b", "theta_dot", 1, marks=pytest.mark.source("BK Fig. 2")),
        pytest.param("paper_fig3a", "f", 0, marks=pytest.mark.source("BK Fig. 3")),
        pytest.param("paper_fig3b", "f_dot", 1, marks=pytest.mark.source("BK Fig. 3")),
    ],
)
def test_the_data_of_paper_fig2_and_fig3(name, column, order):
    data = numbers(name)
    angle, t, value = data["angle [rad]"], data["t [1]"], data[f"{column} [1]"]
    assert np.allclose(np.unique(angle), np.arange(1, 23) * np.pi / 24, rtol=1e-11)
    assert np.allclose(np.unique(t), np.linspace(0, 1, 101), atol=1e-11)
    oracle = getattr(oracles, column.removesuffix("_dot"))
    for i in range(0, len(t), 37):
        assert value[i] == pytest.approx(oracle(t[i], angle[i], order), rel=1e-9, abs=1e-10)


@pytest.mark.source("BK Prop. 6")
def test_the_data_of_the_chord():
    t, x, y, arc_x, arc_y = numbers("lesson06_chord").values()
    chord = (1 - t) + t * np.exp(1j * np.radians(150))
    assert np.abs(x + 1j * y - chord).max() < 1e-11
    assert np.abs(arc_x + 1j * arc_y - chord / np.abs(chord)).max() < 1e-11


@pytest.mark.source("BK Cor. 1")
def test_the_data_of_the_same_path():
    data = numbers("lesson06_same_path")
    t, geodesic, projected = (
        data["t [1]"],
        *(
            np.array([data[f"{name} {axis} [1]"] for axis in "xyz"])
            for name in ("geodesic", "projected line")
        ),
    )
    angle = np.linalg.norm([1.2, 1.7, 1.5])
    assert np.abs(np.linalg.norm([geodesic, projected], axis=1) - 1).max() < 1e-11
    turned = np.arccos(np.clip(geodesic.T @ geodesic[:, 0], -1, 1))
    assert np.abs(turned - angle * t).max() < 1e-5  # the cosine forgets small angles
    normal = np.cross(geodesic[:, 0], geodesic[:, -1])
    assert np.abs(normal @ projected).max() < 1e-11
    assert np.abs(data["geodesic speed [rad]"] - angle).max() < 1e-11
    slope = [oracles.theta(x, angle, 1) for x in t]
    assert np.abs(data["projected line speed [rad]"] / angle - slope).max() < 1e-9


SIGMA = np.pi / 6 * np.array([1, 2, 3])


@pytest.mark.source("BK Fig. 4", "BK (21)")
@pytest.mark.parametrize(("name", "extra"), [("4a", 0), ("4b", 1), ("4c", 5)])
def test_the_data_of_paper_fig4(name, extra):
    """The optimum by SciPy; the projection by the definition of the nearest rotation."""
    data = numbers(f"paper_fig{name}")
    t, w1 = data["t [1]"], SIGMA + np.array([extra, 0, 0])
    best, near = (
        np.array([data[f"{curve} sigma{i} [rad]"] for i in (1, 2, 3)]).T
        for curve in ("optimum", "projection")
    )
    solution = oracles.minimum_acceleration(SIGMA, SIGMA, w1)
    want = oracles.rotation_of_quaternions(solution.sol(t)[:4])
    assert np.abs(np.array([oracles.exp_so3(s) for s in best]) - want).max() < 1e-9
    R1 = oracles.exp_so3(SIGMA)
    V0, V1 = np.cross(SIGMA, np.eye(3)).T, R1 @ np.cross(w1, np.eye(3)).T
    u = t[:, None, None]
    M = np.eye(3) + V0 * u + (3 * (R1 - np.eye(3)) - 2 * V0 - V1) * u**2
    M = M + (2 * (np.eye(3) - R1) + V0 + V1) * u**3
    S = np.array([oracles.exp_so3(s).T for s in near]) @ M
    assert np.abs(S - np.swapaxes(S, -1, -2)).max() < 1e-10
    assert oracles.two_smallest_eigenvalues(S).min() > 1


@pytest.mark.source("BK Fig. 5", "BK 6.3")
def test_the_data_of_paper_fig5():
    w0, w1 = np.array([1, 2, 3]), np.array([2, 1, 1])
    turn = np.pi / 6 * np.array([1, 4, 3])
    solution = oracles.minimum_acceleration(turn, w0, w1)
    t = np.arange(106) / 105
    R = oracles.rotation_of_quaternions(solution.sol(t)[:4])
    d0, d1, v0, v1 = np.zeros(3), np.array([8, 10, 12]), np.ones(3), np.array([1, 5, 3])
    p = CubicHermiteSpline([0, 1], [d0, d1], [v0, v1])
    costs = []
    for name in ("paper_fig5a", "paper_fig5b"):
        data = numbers(name)
        read = {kind: np.stack([data[k] for k in data if k[0] == kind], axis=1) for kind in "Rva"}
        w, w_dot = (
            np.stack([data[f"w{i}{x} [rad]"] for i in (1, 2, 3)], axis=1) for x in ("", "'")
        )
        drawn = R if name == "paper_fig5a" else read["R"].reshape(-1, 3, 3)
        assert np.abs(data["t [1]"] - t).max() < 1e-12
        assert np.array_equal(np.flatnonzero(data["drawn [1]"]), np.arange(0, 106, 15))
        assert np.abs(read["R"].reshape(-1, 3, 3) - drawn).max() < 1e-9
        assert np.abs(np.stack([data[f"{x} [m]"] for x in "xyz"], axis=1) - p(t)).max() < 1e-10
        for values, order in (("v", 1), ("a", 2)):
            body = (np.swapaxes(drawn, 1, 2) @ p(t, order)[..., None])[..., 0]
            assert np.abs(read[values] - body).max() < 1e-8
        # The velocity of R, and its derivative, by splines through the numbers of the file.
        entries = make_interp_spline(t, drawn.reshape(-1, 9), 7)
        rate = np.swapaxes(drawn, 1, 2) @ entries(t, 1).reshape(-1, 3, 3)
        assert np.abs(rb.vee_so3(rate) - w)[5:-5].max() < 1e-4
        assert np.abs(make_interp_spline(t, w, 7)(t, 1) - w_dot)[5:-5].max() < 1e-3
        costs.append([simpson(2 * np.sum(w_dot**2, 1), x=t), 2396])
    assert np.abs(numbers("paper_fig5a")["w1' [rad]"] - solution.sol(t)[7]).max() < 1e-8
    projected = rb.projected_cubic_so3(np.eye(3), rb.exp_so3(turn), w0, w1)(t)
    assert np.abs(drawn - projected).max() < 1e-11
    header, rows = committed("paper_fig5_costs")
    assert header == ["figure", "curve", "rotation [rad²]", "translation [m²]"]
    assert [row[:2] for row in rows] == [["5a", "optimum"], ["5b", "projection"]]
    assert np.array([row[2:] for row in rows], float) == pytest.approx(np.array(costs), rel=1e-3)


@pytest.mark.source("BK 1", "BK 7")
def test_the_excess_falls_with_the_fourth_power_of_the_excursion():
    scale, *families = numbers("lesson09_excursion").values()
    assert len(families) == 3
    for excess in families:
        slope = np.diff(np.log(excess[:4])) / np.diff(np.log(scale[:4]))
        assert np.abs(slope - 4).max() < 0.1


@pytest.mark.source("RR Fig. 4", "RR Fig. 5")
@pytest.mark.parametrize("name", ["report_fig4", "report_fig5"])
def test_the_data_of_the_random_rotations_of_the_report(name):
    data = numbers(name)
    for sample, (matrices, quaternions) in (("three angles", NAIVE), ("uniform", HAAR)):
        if name == "report_fig4":
            R = matrices(100, rng=4)
        else:
            R = oracles.rotation_of_quaternions(quaternions(100, rng=6).T)
        for vector, v in (("v0", [0, 0, 1]), ("v1", [0, 0.2, 1])):
            drawn = np.array([data[f"{sample} {vector} {axis} [1]"] for axis in "xyz"]).T
            assert np.abs(drawn - R @ v).max() < 1e-11


@pytest.mark.source("RR 2")
def test_the_histograms_of_lesson_5():
    data = numbers("lesson05_histograms")
    for sample, draw in (("three angles", NAIVE[0]), ("uniform", HAAR[0])):
        R = draw(20_000, rng=7)
        for column, values in (("height of e₁", R[:, 2, 0]), ("height of e₃", R[:, 2, 2])):
            density, _ = np.histogram(values, np.linspace(-1, 1, 21), density=True)
            assert np.allclose(data[f"{column}, {sample} [1]"][:-1], density, atol=1e-9)
        angles = np.linalg.norm(rb.log_so3(R), axis=1)
        density, _ = np.histogram(angles, np.linspace(0, np.pi, 21), density=True)
        assert np.allclose(data[f"angle, {sample} [1]"][:-1], density, atol=1e-3)


@pytest.mark.source("RR (8)")
def test_the_angles_near_gimbal_lock_of_lesson_3():
    """Yaw from the nose in the room, roll from how far the body's y leans."""
    data = numbers("lesson03_gimbal")
    t = data["t [1]"]
    for miss in (30, 5, 1):
        m = np.radians(miss)
        angles = [data[f"missed by {miss}° {letter} [rad]"] for letter in "αβγ"]
        nose = np.array(
            [np.cos(m) * np.cos(np.pi * t), -np.sin(m) + 0 * t, np.cos(m) * np.sin(np.pi * t)]
        )
        assert (
            np.abs(
                np.exp(1j * angles[0]) * np.hypot(nose[0], nose[1]) - nose[0] - 1j * nose[1]
            ).max()
            < 1e-11
        )
        assert np.abs(np.sin(angles[1]) + nose[2]).max() < 1e-11
        R = rb.matrix_from_zyx(np.transpose(angles))
        assert np.abs(R[:, :, 0] - nose.T).max() < 1e-11
        assert np.abs(R[:, 1, 1] - np.cos(m)).max() < 1e-11  # the room's y is kept by the turn
        assert angles[1].min() == pytest.approx(-np.pi / 2 + m, abs=1e-6)


def test_the_ways_of_lesson_3():
    data = numbers("lesson03_ways")

    def path(name):
        return np.array(
            [data[f"{name} R{i}{j} [1]"] for i in (1, 2, 3) for j in (1, 2, 3)]
        ).T.reshape(-1, 3, 3)

    turned = {}
    for name in ("short way", "long way", "angles blended"):
        R = path(name)
        assert np.abs(R[0] - path("short way")[0]).max() < 1e-11
        assert np.abs(R[-1] - path("short way")[-1]).max() < 1e-11
        turned[name] = np.linalg.norm(rb.log_so3(np.swapaxes(R[:-1], 1, 2) @ R[1:]), axis=1)
    assert np.ptp(turned["short way"]) < 1e-9
    assert np.ptp(turned["long way"]) < 1e-9
    assert (turned["short way"] + turned["long way"]).sum() == pytest.approx(2 * np.pi, abs=1e-8)
    assert turned["short way"].sum() < turned["angles blended"].sum()


def test_the_order_of_turns_of_lesson_3():
    _, rows = committed("lesson03_order")
    R = np.array([row[4:] for row in rows], dtype=float).reshape(-1, 3, 3)
    quarter_x, quarter_z = [[1, 0, 0], [0, 0, -1], [0, 1, 0]], [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    want = [np.eye(3), quarter_z, np.dot(quarter_x, quarter_z)]
    want += [np.eye(3), quarter_x, np.dot(quarter_z, quarter_x)]
    assert np.abs(R - want).max() < 1e-12


@pytest.mark.source("BK Prop. 2", "RR 1.4", "errata 2")
def test_the_columns_of_lesson_4():
    data = numbers("lesson04_columns")

    def matrix(name):
        return np.array([data[f"{name} x [1]"], data[f"{name} y [1]"]])

    M, printed, nearest = matrix("M"), matrix("U Vᵀ"), matrix("nearest rotation")
    assert np.linalg.det(printed) == pytest.approx(-1, abs=1e-10)
    turns = np.linspace(0, 2 * np.pi, 3601)
    away = [np.linalg.norm(M - [[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) for a in turns]
    assert np.linalg.norm(M - nearest) <= min(away) + 1e-10
    assert np.linalg.norm(M - printed) < np.linalg.norm(M - nearest)
    assert np.linalg.norm(M - matrix("column negated")) > np.linalg.norm(M - nearest) + 0.3


@pytest.mark.source("RR 1.4")
def test_the_drift_of_lesson_4():
    data = numbers("lesson04_drift")
    w = np.linalg.norm([0.003, -0.008, 0.005])
    first = data["I + hω̂ [1]"]
    expected = np.sqrt(2) * ((1 + w**2) ** data["steps [1]"] - 1)
    assert np.allclose(first, expected, rtol=0.02)
    assert data["rounded step, repaired [1]"].max() < 1e-5
    assert data["rounded step [1]"][-1] > 1e-3


@pytest.mark.source("BK Prop. 2", "BK 4")
def test_the_data_of_the_shadows():
    """z to z/|z| by the nearest rotation, to (z + m)/|z + m| by Gram–Schmidt, |m| = 0.35."""
    data = numbers("lesson04_shadows")
    M, nearest, gram_schmidt = (
        data[f"{name} x [1]"] + 1j * data[f"{name} y [1]"]
        for name in ("M", "nearest rotation", "Gram–Schmidt")
    )
    assert np.abs(nearest - M / abs(M)).max() < 1e-11
    assert np.abs(abs(gram_schmidt) - 1).max() < 1e-11
    missed = np.abs((M * gram_schmidt.conj()).imag)  # from M to the line of the answer
    assert missed.max() < 0.35 + 1e-11
    assert len(M) == 24


@pytest.mark.source("BK Prop. 3")
def test_the_data_of_the_frames():
    frame, nearest, gram_schmidt = numbers("lesson04_frames").values()
    assert np.ptp(nearest) < 1e-11
    assert nearest[0] == pytest.approx(np.arctan2(0.5 + 0.1, 1.1 + 0.8), abs=1e-11)
    x, y = np.array([[1.1, -0.1], [0.5, 0.8]]) @ [np.cos(frame), np.sin(frame)]  # first column
    assert np.abs(np.exp(1j * gram_schmidt) - np.exp(1j * (np.arctan2(y, x) - frame))).max() < 1e-10


EDGES = np.array([0.20, 0.13, 0.03])
MOMENTS = 0.5 / 12 * (EDGES @ EDGES - EDGES**2)


def euler(start, t):
    """Euler's equation by SciPy, for the book of lesson 8."""
    return solve_ivp(
        lambda _, w: np.cross(MOMENTS * w, w) / MOMENTS,
        (0, t[-1]),
        start,
        "DOP853",
        t_eval=t,
        rtol=1e-12,
        atol=1e-13,
    ).y


@pytest.mark.source("BK (8)")
def test_the_data_of_the_spins():
    data = numbers("lesson08_spins")
    for k in range(3):
        w = np.array([data[f"axis {k + 1} w{i} [rad]"] for i in (1, 2, 3)])
        start = np.where(np.arange(3) == k, 4, 0.2)
        assert np.abs(w - euler(start, data["t [1]"])).max() < 1e-8


@pytest.mark.source("BK (8)")
def test_the_data_of_the_book():
    """It turns, at first nearly about its middle axis; the momentum is up and stays."""
    data = numbers("lesson08_book")
    R = np.stack([data[f"R{i}{j} [1]"] for i in (1, 2, 3) for j in (1, 2, 3)], axis=-1)
    R, t = R.reshape(-1, 3, 3), data["t [1]"]
    assert rb.is_so(R, 1e-11).all()
    momentum = np.einsum("tij,jt->ti", R, MOMENTS[:, None] * euler([0.2, 4, 0.2], t))
    size = np.linalg.norm(MOMENTS * [0.2, 4, 0.2])
    assert np.abs(momentum - [0, 0, size]).max() < 1e-9 * size
    assert data["R32 [1]"][0] > 0.99
    assert (data["R32 [1]"] < -0.99).any()


@pytest.mark.source("BK (8)")
def test_the_data_of_the_momenta():
    data = numbers("lesson08_momenta")
    L = np.stack([data[f"{axis} [1]"] for axis in "xyz"], axis=-1).reshape(24, -1, 3)
    assert np.abs(np.linalg.norm(L, axis=-1) - 1).max() < 1e-11
    energy = (L**2 / MOMENTS).sum(axis=-1)
    assert np.abs(energy / energy[:, :1] - 1).max() < 1e-10
    back = np.linalg.norm(L[:, 40:] - L[:, :1], axis=-1).min(axis=1)
    assert back.max() < 0.1  # all paths are closed, within a step


@pytest.mark.source("BK (10)", "BK (14)", "BK 2.6")
def test_the_data_of_the_three_ways_straight_on():
    data = numbers("lesson08_ways")
    t = data["metric (14) t [1]"]
    paths = {
        name: np.array([data[f"{name} {axis} [m]"] for axis in "xyz"])
        for name in ("metric (14)", "metric (10)", "off centre")
    }
    still = 0 * t
    assert np.abs(paths["metric (14)"] - [1.8 * t, still, t]).max() < 1e-10
    circle = [0.9 * np.sin(2 * t), 0.9 * (1 - np.cos(2 * t)), t]
    assert np.abs(paths["metric (10)"] - circle).max() < 1e-10
    centre = paths["off centre"] + 0.5 * np.array([np.cos(2 * t), np.sin(2 * t), still])
    assert np.abs(centre - [0.5 + 1.8 * t, t, t]).max() < 1e-10


@pytest.mark.source("BK 2.6")
def test_the_data_of_the_cube_of_the_start():
    data = numbers("lesson00_cubes")
    angle = 3 * data["t [1]"]
    circle = [6 * np.sin(angle), 6 * (1 - np.cos(angle)), 7 * data["t [1]"]]
    assert np.abs(np.array([data[f"{axis} [m]"] for axis in "xyz"]) - circle).max() < 1e-10
    assert np.abs(data["R21 [1]"] - np.sin(angle)).max() < 1e-11


def route(data, name=""):
    return np.stack([data[f"{name}{key}"] for key in ("x [m]", "y [m]", "theta [rad]")], axis=-1)


@pytest.mark.source("RR Fig. 6", "RR (14)", "RR (15)", "RR (16)")
def test_the_data_of_report_fig6():
    t = np.linspace(0, 1, 51)
    even = np.transpose([6 * t, 3 * t, np.pi / 2 * t])
    assert np.abs(route(numbers("report_fig6")) - even).max() < 1e-11


@pytest.mark.source("RR Fig. 7", "RR (17)", "RR (18)", "RR (19)")
def test_the_data_of_report_fig7():
    """Right for 3 s, turn for 1 s, along the diagonal for 2 s, right while turning for 3 s."""
    t = np.arange(91) / 10
    x = np.interp(t, [0, 3, 4, 6, 9], [0, 3, 3, 5, 8])
    y = np.interp(t, [0, 4, 6, 9], [0, 0, 2, 2])
    theta = np.interp(t, [0, 3, 4, 6, 9], np.radians([0, 0, 45, 45, -90]))
    assert np.abs(route(numbers("report_fig7")) - np.transpose([x, y, theta])).max() < 1e-11


@pytest.mark.source("RR (16)")
def test_the_data_of_the_long_way_and_the_short_way():
    data, t = numbers("lesson01_ways"), np.linspace(0, 1, 49)
    for name, end in {"as the numbers say": -170, "the short way": 190}.items():
        even = np.transpose([6 - 6 * t, 0 * t, np.radians(170 + (end - 170) * t)])
        assert np.abs(route(data, f"{name} ") - even).max() < 1e-11


@pytest.mark.source("RR 3.2")
def test_the_data_of_the_two_frames():
    data, t = numbers("lesson01_frames"), np.linspace(0, 2 * np.pi, 65)
    assert np.abs(route(data, "world ") - np.transpose([t, 0 * t, t])).max() < 1e-10
    circle = np.transpose([np.sin(t), 1 - np.cos(t), t])
    assert np.abs(route(data, "body ") - circle).max() < 1e-10


@pytest.mark.source("RR 3.1")
def test_the_data_of_what_is_straight():
    """By the corner: the corner runs straight. The screw: every point keeps its distance from one
    centre, found here from the start and the goal alone."""
    data, t = numbers("lesson01_straight"), np.linspace(0, 1, 41)
    by = {
        f"{way} {point}": route(data, f"{way} by the {point} ")
        for way in ("blended", "screw")
        for point in ("centre", "corner")
    }
    goal = np.array([5, 1, np.radians(150)])
    assert np.abs(by["blended centre"] - t[:, None] * goal).max() < 1e-10
    corner = {
        name: path[:, :2] @ [1, 1j] + np.exp(1j * path[:, 2]) * (-1 - 0.5j)
        for name, path in by.items()
    }
    straight = corner["blended corner"]
    assert np.abs(straight - (straight[0] + t * (straight[-1] - straight[0]))).max() < 1e-10
    for path in by.values():
        assert np.abs(path[[0, -1]] - [[0, 0, 0], goal]).max() < 1e-10
        assert np.abs(path[:, 2] - t * goal[2]).max() < 1e-10
    centre = (5 + 1j) / (1 - np.exp(1j * goal[2]))
    for points in (by["screw centre"][:, :2] @ [1, 1j], corner["screw corner"]):
        turned = centre + np.exp(1j * t * goal[2]) * (points[0] - centre)
        assert np.abs(points - turned).max() < 1e-10
    assert np.abs(by["screw centre"] - by["screw corner"]).max() < 1e-10
    apart = np.abs((by["blended centre"] - by["blended corner"])[:, :2] @ [1, 1j]).max()
    assert apart == pytest.approx(abs(-1 - 0.5j) * (1 - np.cos(goal[2] / 2)), abs=1e-3)


def configurations(data, name=""):
    """The angles of a path of the arm, after a check that its ends belong to them."""
    theta0, theta1 = (data[f"{name}theta{i} [rad]"] for i in (0, 1))
    elbow = 2 * np.exp(1j * theta0)
    tip = elbow + 1.5 * np.exp(1j * (theta0 + theta1))
    for k, place in ((1, elbow), (2, tip)):
        assert np.abs(data[f"{name}x{k} [m]"] + 1j * data[f"{name}y{k} [m]"] - place).max() < 1e-10
    return np.degrees(np.transpose([theta0, theta1])), tip


@pytest.mark.source("RR 4")
def test_the_data_of_the_posture():
    angles, _ = configurations(numbers("lesson02_posture"))
    assert np.abs(angles - [[30, 45]]).max() < 1e-9


@pytest.mark.source("RR 4")
def test_the_data_of_the_arrows():
    for name, elbow in {"elbow at 90° ": 90, "elbow at 10° ": 10}.items():
        angles, _ = configurations(numbers("lesson02_arrows"), name)
        assert np.abs(angles - [[20, elbow]]).max() < 1e-9


@pytest.mark.source("RR Fig. 8", "RR (20)", "RR (21)")
def test_the_data_of_report_fig8():
    angles, tip = configurations(numbers("report_fig8"))
    assert np.abs(angles - np.linspace([-20, 110], [130, -60], 61)).max() < 1e-9
    assert abs(tip).max() > 3.499  # touches the circle


@pytest.mark.source("RR Fig. 9", "RR (22)", "RR (23)")
def test_the_data_of_report_fig9():
    """45 degrees a second: the shoulder, the elbow, both opposite ways; three arcs of the tip."""
    t = np.arange(91) / 10
    angles, tip = configurations(numbers("report_fig9"))
    shoulder = np.interp(t, [0, 3, 6, 9], [0, 135, 135, 0])
    elbow = np.interp(t, [0, 3, 6, 9], [0, 0, 135, 270])
    assert np.abs(angles - np.transpose([shoulder, elbow])).max() < 1e-9
    centres = 0, 2 * np.exp(0.75j * np.pi), -1.5j
    for part, centre, radius in zip((0, 30, 60), centres, (3.5, 1.5, 2), strict=True):
        assert np.abs(abs(tip[part : part + 31] - centre) - radius).max() < 1e-10


@pytest.mark.source("RR 4.1")
def test_the_data_of_the_two_spaces():
    data, t = numbers("lesson02_two_spaces"), np.linspace(0, 1, 401)
    angles, tip = configurations(data, "straight for the motors ")
    assert np.abs(angles - np.transpose([150 * t, 0 * t + 60])).max() < 1e-9
    _, line = configurations(data, "straight for the hand ")
    assert np.abs(line - (tip[0] + t * (tip[-1] - tip[0]))).max() < 2e-4


@pytest.mark.source("BK 1", "BK 7")
@pytest.mark.parametrize(("name", "share"), [("median", 0.5), ("ninety", 0.9)])
def test_a_cell_of_the_atlas_is_what_its_hundred_problems_cost(name, share):
    header, rows = committed(f"lesson12_{name}_across")
    assert len(rows) == 100
    cell = 100 + 4 * 10 + 5  # after those along the axis: 81°, 4.95 rad
    data = dict(zip(header, rows[cell - 100], strict=True))
    assert data["family"] == "across"
    middle = [np.radians(81), 4.95, 100]
    assert [float(data[x]) for x in header[1:4]] == pytest.approx(middle)
    ends = atlas.atlas_problems(100, rng=11).take(slice(100 * cell, 100 * cell + 100))
    best = rb.acceleration_cost(rb.minimum_acceleration_so3(*ends))
    for way in ("projection", "exponential", "Bézier", "cumulative", "quaternion", "Cayley"):
        excess = np.sort(rb.acceleration_cost(atlas.WAYS[way](*ends)) / best - 1)
        assert float(data[f"{way} excess [1]"]) == pytest.approx(
            excess[int(100 * share) - 1], rel=1e-3
        )


@pytest.mark.source("beyond BK 10")
def test_near_a_geodesic_deviations_are_multiples_of_each_other():
    """Across the axis: t²(1 − t)²/12 and −t²(1 − t)² u/10 of the projection, as derived."""
    data = numbers("lesson12_deviations")
    t = data["t [1]"]
    d, e = (t * (1 - t)) ** 2 / 12, -((t * (1 - t)) ** 2) * (2 * t - 1) / 10
    shares = {"projection": (1, 1), "quaternion": (1 / 4, -1 / 4), "Bézier": (1 / 9, -1 / 9)}
    for way, (of_d, of_e) in shares.items():
        assert data[f"{way} d [1]"] == pytest.approx(of_d * d, abs=2e-5)
        assert data[f"{way} e [1]"] == pytest.approx(of_e * e, abs=2e-5)
    assert data["exponential d [1]"] == pytest.approx(0 * t, abs=2e-5)
    assert data["exponential e [1]"] == pytest.approx(
        -((t * (1 - t)) ** 2) * (t + 2) / 30, abs=1e-4
    )


POWERS = {"cumulative": 2, "corrected": 8}


@pytest.mark.source("BK 1", "BK 7")
def test_all_but_two_of_the_closed_forms_have_the_fourth_power():
    data = numbers("lesson12_growth")
    for way in atlas.WAYS:
        median = data[f"{way} median excess [1]"][:3]
        slope = np.diff(np.log(median)) / np.diff(np.log(data["size [rad]"][:3]))
        assert slope == pytest.approx([POWERS.get(way, 4)] * 2, abs=0.5), way


def test_the_excess_of_a_projection_grows_with_the_third_power_of_the_margin():
    header, rows = committed("lesson12_margins")
    columns = dict(zip(header, zip(*rows, strict=True), strict=True))
    some = np.array(columns["family"]) == "random"
    margin, excess = (
        np.array(columns[f"projection {name} [1]"], dtype=float)[some]
        for name in ("margin", "excess")
    )
    low = margin < 0.3
    slope, _ = np.polyfit(np.log(margin[low]), np.log(excess[low]), 1)
    assert low.sum() > 25
    assert slope == pytest.approx(-3, abs=0.3)


@pytest.mark.source("beyond BK 3", "beyond BK 6", "beyond BK 7")
@pytest.mark.parametrize("body", body_atlas.BODIES)
def test_a_cell_of_the_atlas_of_bodies_is_what_its_problems_cost(body):
    table, cell = body_atlas.stored("maps"), 3 * 10 + 3  # 63°, 3.15 rad
    data = {name: column[table["body"] == body][cell] for name, column in table.items()}
    middle = [np.radians(63), 3.15, 200]
    assert [data[x] for x in list(data)[1:4]] == pytest.approx(middle)
    ends = body_atlas.body_problems(200, 31).take(slice(200 * cell, 200 * cell + 200))
    G = body_atlas.BODIES[body]
    best = rb.acceleration_cost(rb.minimum_acceleration_so3(*ends, G), G)
    for curve, make in {
        "weighted": lambda *few: rb.weighted_cubic_so3(*few, G),
        "normal": lambda *few: rb.normal_cubic_so3(*few, G),
        "Bézier": rb.bezier_so3,
        "projection": rb.projected_cubic_so3,
        "ball's optimum": rb.minimum_acceleration_so3,
    }.items():
        excess = np.sort(rb.acceleration_cost(make(*ends), G) / best - 1)
        for name, place in (("median", 99), ("90 %", 179)):
            stored = data[f"{curve} {name} [1]"]
            assert stored == pytest.approx(excess[place], rel=2e-3, abs=1e-6)


def test_the_intervals_are_those_of_the_problems():
    """All 800 problems of the small domain, for the book and one of the other seeds."""
    table = body_atlas.stored("intervals")
    seed, body, domain = (table[key] for key in ("seed [1]", "body", "domain"))
    here = (seed == 32) & (body == "book") & (domain == "small")
    rows = [{name: column[k] for name, column in table.items()} for k in np.flatnonzero(here)]
    assert [row["curve"] for row in rows] == list(body_atlas.CURVES)
    problems, G = body_atlas.body_problems(200, 32), body_atlas.BODIES["book"]
    ends = problems.take(body_atlas.domain("small", 200))
    found = survey(ends, inertia=G, ways=body_atlas.curves_for("book"))
    excess = body_atlas.with_choices(atlas.excesses(ends, found, G))
    for row in rows:
        x = np.sort(excess[row["curve"]])
        assert row["problems [1]"] == 800
        assert row["median [1]"] == pytest.approx(np.median(x), rel=1e-3, abs=1e-8)
        # of 800 independent draws 372 to 428 are below the median, with 95 %
        low, high = (row[f"median {end} [1]"] for end in ("low", "high"))
        assert [low, high] == pytest.approx(x[[371, 428]], rel=0.02, abs=1e-7)


def test_the_atlas_of_bodies_has_three_seeds_and_all_its_problems():
    data = body_atlas.stored("intervals")
    assert sorted(set(data["seed [1]"])) == [31, 32, 33]
    everything = data["problems [1]"][data["domain"] == "all"]
    assert everything.tolist() == [20000] * (9 * len(body_atlas.CURVES))


@pytest.mark.source("beyond BK 1", "beyond BK 3", "beyond BK 4")
def test_the_book_of_lesson_13_is_turned_by_its_torques():
    """Euler's equation with the stored torques, from rest, leads to the stored goal, at rest."""
    torques, poses = numbers("lesson13_torques"), numbers("lesson13_book")
    G, t = rb.metrics.box_inertia([0.3, 0.2, 0.03]), torques["t [s]"]
    diagonal = rb.exp_so3(np.radians(150) * np.ones(3) / np.sqrt(3))
    for law in ("as if a ball", "least acceleration", "least torque"):
        columns = [torques[f"{law} {axis} [N m]"] for axis in "xyz"]
        torque = make_interp_spline(t, np.transpose(columns), k=5)

        def euler(t, y, torque=torque):
            R, w = y[:9].reshape(3, 3), y[9:]
            rate = np.linalg.solve(G, torque(t) - np.cross(w, G @ w))
            return np.concatenate([(R @ rb.hat_so3(w)).ravel(), rate])

        end = solve_ivp(euler, (0, 1), [*np.eye(3).ravel(), 0, 0, 0], rtol=1e-10, atol=1e-12)
        R, w = end.y[:9, -1].reshape(3, 3), end.y[9:, -1]
        assert np.abs(R - diagonal).max() < 1e-6, law
        assert np.abs(w).max() < 1e-6, law
        stored = [poses[f"{law} R{i}{j} [1]"][-1] for i in "123" for j in "123"]
        assert np.abs(R.ravel() - stored).max() < 1e-6, law


@pytest.mark.source("beyond BK 6", "beyond BK 7")
def test_what_knows_the_body_has_the_fourth_power():
    data = numbers("lesson13_growth")
    powers = {"projection": 2, "Bézier": 2, "weighted": 4, "normal": 4}
    for way, power in powers.items():
        median = data[f"{way} median excess [1]"][:3]
        slope = np.diff(np.log(median)) / np.diff(np.log(data["size [rad]"][:3]))
        assert slope == pytest.approx([power] * 2, abs=0.5), way


@pytest.mark.source("beyond BK 5")
def test_the_speeds_of_lesson_13_go_the_whole_way():
    data = numbers("lesson13_jerk")
    t, angle = data["t [1]"], np.linalg.norm(np.pi / 6 * np.array([1, 4, 3]))
    exact = angle * 30 * t**2 * (1 - t) ** 2
    assert np.abs(data["least jerk [rad]"] - exact).max() < 1e-9
    assert simpson(data["projected quintic [rad]"], x=t) == pytest.approx(angle, abs=1e-6)
