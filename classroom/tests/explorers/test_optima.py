"""What the explorers of minimum acceleration draw and say is what the package computes."""

import numpy as np
import pytest
from mpl_toolkits.mplot3d import proj3d
from sweeps import corners, numbers_in, points, read_off, sweep

import rbcourse as rb
from rbclassroom.explorers import cube_explorer, minimum_acceleration_explorer

SIGMA = np.pi / 6 * np.array([1, 2, 3])
TIMES = np.linspace(0, 1, 61)
KNOWN = {}


@pytest.fixture(scope="module")
def rotations():
    return minimum_acceleration_explorer()


@pytest.fixture(scope="module")
def cubes():
    return cube_explorer()


RIVALS = {
    "projection": rb.projected_cubic_so3,
    "exponential": rb.exponential_cubic_so3,
    "Bézier": rb.bezier_so3,
    "corrected": rb.corrected_bezier_so3,
    "cumulative": rb.cumulative_bezier_so3,
    "quaternion": rb.quaternion_cubic_so3,
    "Cayley": rb.cayley_cubic_so3,
}


def solved(optimum, rival, ends, name="rival"):
    """Both curves of these ends, and the costs of their rotations; each is solved once."""
    key = rival.__name__, str(ends)
    if key not in KNOWN:
        curves = {"optimum": optimum(*ends), name: rival(*ends)}
        costs = [float(rb.acceleration_cost_parts(curve)[0]) for curve in curves.values()]
        KNOWN[key] = curves, costs
    return KNOWN[key]


def check_costs(explorer, low, high, rival="projection"):
    said = read_off(explorer)
    costs = [numbers_in(said[f"cost, {name}"])[0] for name in ("optimum", rival)]
    assert costs == pytest.approx([low, high], abs=5.1e-4)
    if low > 1e-12:
        assert float(said["their ratio"]) == pytest.approx(high / low, abs=5.1e-4)
    else:
        assert said["their ratio"] == "none: the optimum costs nothing"


def apart(curves, t):
    """By how many degrees two motions are turned against each other."""
    best, near = (curve(t) for curve in curves.values())
    return np.degrees(np.linalg.norm(rb.log_so3(np.swapaxes(best, -1, -2) @ near), axis=-1))


@pytest.mark.source("BK (19)", "BK (21)", "BK Fig. 4")
def test_both_curves_and_their_costs(rotations):
    for v in sweep(rotations, k=3.0):
        sigma = v["size"] * SIGMA
        ends = np.eye(3), rb.exp_so3(sigma), sigma, sigma + v["k"] * np.eye(3)[0]
        curves, costs = solved(rb.minimum_acceleration_so3, RIVALS[v["rival"]], ends)
        check_costs(rotations, *costs, v["rival"])
        for name, curve in curves.items():
            lines = [points(rotations.artists[f"{name} {axis}"]) for axis in "xyz"]
            drawn = np.stack([line[:, 1] for line in lines], axis=-1)
            assert np.abs(drawn - rb.log_so3(curve(TIMES))).max() < 1e-12
            if v["rival"] == "Cayley" and name == "rival":
                continue  # it may leave the picture
            assert np.abs(np.diff(drawn, axis=0)).max() < 0.5  # never round the ball of radius π
            low, high = rotations.artists["σ₁"].axes.get_ylim()
            assert low < drawn.min()
            assert drawn.max() < high
        heights = [rotations.artists[f"σ{number}"].get_position()[1] for number in "₁₂₃"]
        assert np.abs(heights - sigma).max() < 1e-15
        for name, curve in curves.items():
            faces, R = corners(rotations.artists[f"{name} box"]), curve(v["t"])
            assert np.abs(faces.mean(axis=1)[:3] - ([0.65, 0.4, 0.125] * R).T).max() < 1e-12
        most = float(read_off(rotations)["apart at most"].rstrip("°"))
        assert most == pytest.approx(apart(curves, TIMES).max(), abs=0.051)


def test_the_costs_of_the_paper(rotations):
    rotations.put(size=1.0, k=5.0)
    assert read_off(rotations)["their ratio"] == "1.174"  # 17 % more, in case (c)
    rotations.put(k=0.0)
    assert read_off(rotations)["cost, projection"] == "0.222 rad²"  # case (a), lesson 9
    assert read_off(rotations)["their ratio"] == "none: the optimum costs nothing"


@pytest.mark.source("BK Fig. 5", "BK 6.3")
def test_both_cubes_their_ways_and_their_costs(cubes):
    for v in sweep(cubes, spin=2.0, t=0.4):
        sigma = v["turn"] * np.pi / 6 * np.array([1, 4, 3])
        A1 = rb.pose_from_coordinates([*sigma, 8, 10, 12])
        ends = np.eye(4), A1, [1, 2, 3], [2, 1, v["spin"]], [1, 1, 1], [1, 5, v["rise"]]
        curves, costs = solved(
            rb.minimum_acceleration_se3, rb.projected_cubic_se3, ends, "projection"
        )
        for name, curve in curves.items():
            boxes = {name: curve(v["t"]), f"{name} goal": A1}
            if name == "optimum":
                boxes["difference"] = boxes[name]
            for box, pose in boxes.items():
                faces = corners(cubes.artists[box])
                assert np.abs(faces.mean(axis=(0, 1)) - pose[:3, 3]).max() < 1e-11
                out = faces.mean(axis=1)[:3] - pose[:3, 3]
                assert np.abs(out - 1.75 * pose[:3, :3].T).max() < 1e-11
            way = points(cubes.artists[f"{name} way"])
            assert np.abs(way - curve(TIMES)[:, :3, 3]).max() < 1e-11
        check_costs(cubes, *costs)
        now = float(read_off(cubes)["apart now"].rstrip("°"))
        best, near = (curve(v["t"])[:3, :3] for curve in curves.values())
        angle = np.degrees(np.linalg.norm(rb.log_so3(best.T @ near)))
        assert now == pytest.approx(angle, abs=0.051)


def test_at_first_it_is_the_figure_of_the_paper(cubes):
    cubes.restart()
    assert cubes.values == {"turn": 1.0, "spin": 1.0, "rise": 3.0, "t": 0.0}
    assert read_off(cubes)["their ratio"] == "1.773"  # 77 % more: lesson 9


def test_no_cube_leaves_its_picture(cubes):
    for v in sweep(cubes, t=1.0):
        for i, name in enumerate(("optimum", "projection")):
            box = cubes.artists[name]
            places = *corners(box).reshape(-1, 3).T, *points(cubes.artists[f"{name} way"]).T
            for x, y, z in (places[:3], places[3:]):
                x, y, _ = proj3d.proj_transform(x, y, z, box.axes.get_proj())
                x, y = box.axes.transData.transform(np.stack([x, y], axis=-1)).T
                assert 280 * i < x.min(), v
                assert x.max() < 280 * (i + 1), v
                assert 20 < y.min() < y.max() < 350, v
