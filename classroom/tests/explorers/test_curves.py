"""What the explorers of geodesics, screws and spins draw is what the package computes."""

import numpy as np
import pytest
from mpl_toolkits.mplot3d import proj3d
from scipy.linalg import expm
from sweeps import corners, notice, numbers_in, points, read_off, sweep

import rbcourse as rb
from rbclassroom.explorers import flip_explorer, screw_explorer, theta_explorer

EDGES = np.array([0.20, 0.13, 0.03])
MOMENTS = 0.5 / 12 * (EDGES @ EDGES - EDGES**2)


@pytest.fixture(scope="module")
def line():
    return theta_explorer()


@pytest.fixture(scope="module")
def bolt():
    return screw_explorer()


@pytest.fixture(scope="module")
def book():
    return flip_explorer()


@pytest.mark.source("BK Prop. 6", "BK Cor. 1", "BK Cor. 2")
def test_curves_dots_and_chord(line):
    t = np.linspace(0, 1, 101)
    for v in sweep(line, angle=100.0, t=0.3):
        a = np.radians(v["angle"])
        for name, curve in (("theta", rb.projected_line.theta), ("f", rb.projected_line.f)):
            drawn = points(line.artists[name])
            assert np.abs(drawn - np.stack([t, curve(t, a)], axis=-1)).max() < 1e-14
            assert (
                np.abs(points(line.artists[f"{name} now"]) - [v["t"], curve(v["t"], a)]).max()
                < 1e-14
            )
        first, last = points(line.artists["chord"])
        on = points(line.artists["line"])[0]
        assert np.abs(on - (first + v["t"] * (last - first))).max() < 1e-14
        shadow, even = (points(line.artists[name])[0] for name in ("shadow", "even"))
        assert np.abs(shadow - on / np.linalg.norm(on)).max() < 1e-12
        assert turned(first, last) == pytest.approx(a)
        assert turned(first, even) == pytest.approx(v["t"] * a, abs=1e-12)
        said = [float(text) for text in read_off(line).values()]
        known = [
            rb.projected_line.theta(v["t"], a),
            rb.projected_line.theta(v["t"], a, 1),
            rb.projected_line.f(v["t"], a),
            np.linalg.norm(on),
        ]
        assert np.abs(np.array(said) - known).max() < 5.1e-4
        arc = points(line.artists["arc"])
        assert np.abs(np.linalg.norm(arc, axis=1) - 1).max() < 1e-14
        assert np.abs(arc[[0, -1]] - [first, last]).max() < 1e-14
        assert np.abs(points(line.artists["ray"]) - [[0, 0], shadow]).max() < 1e-14


def test_at_first_both_curves_are_seen_and_no_angle_of_a_poll(line):
    line.restart()
    one, other = (points(line.artists[name])[:, 1] for name in ("theta", "f"))
    assert np.abs(one - other).max() > 0.15  # of the height of the axes
    assert line.values["angle"] not in (90, 150)


def turned(one, other):
    """The angle from one direction to another, clockwise."""
    return -np.angle(complex(*other) / complex(*one))


@pytest.mark.source("BK (10)", "BK (14)")
def test_both_bodies_and_the_axis(bolt):
    for v in sweep(bolt, tilt=35.0, t=0.6):
        tilt = np.radians(v["tilt"])
        r = np.radians(v["angle"]) * np.array([np.sin(tilt), 0, np.cos(tilt)])
        d = np.array([v["x"], 0, v["z"]])
        goal = rb.pose_from_components(rb.exp_so3(r), d)
        r = rb.log_so3(goal[:3, :3])  # of a half-turn, either
        along = expm(v["t"] * rb.hat_se3(rb.log_se3(goal)))
        geodesic = rb.pose_from_components(rb.exp_so3(v["t"] * r), v["t"] * d)
        for name, pose in (("screw", along), ("geodesic", geodesic)):
            faces = corners(bolt.artists[name])
            assert np.abs(faces.mean(axis=(0, 1)) - pose[:3, 3]).max() < 1e-12
            out = faces.mean(axis=1)[:3] - pose[:3, 3]
            assert (
                np.abs(out - 0.4 * pose[:3, :3].T).max() < 1e-7
            )  # half-turns lose half the digits
            assert (
                np.abs(
                    points(bolt.artists[f"{name} way"])[[0, -1]] - [[0, 0, 0], pose[:3, 3]]
                ).max()
                < 1e-12
            )
        assert np.abs(corners(bolt.artists["goal"]).mean(axis=(0, 1)) - d).max() < 1e-12
        said = read_off(bolt)
        for name in ("geodesic", "screw"):
            turned = float(said[f"turned, {name}"].rstrip("°"))
            assert turned == pytest.approx(v["t"] * abs(v["angle"]), abs=0.051)
        apart = np.linalg.norm(along[:3, 3] - geodesic[:3, 3])
        assert numbers_in(said["origins apart"])[0] == pytest.approx(apart, abs=0.0051)
        if 0 < abs(v["angle"]) < 180:
            axis = points(bolt.artists["axis"])
            moved = axis @ goal[:3, :3].T + goal[:3, 3]
            steps = moved - axis  # the same for all points of the axis, and along it
            assert np.abs(steps[0] - steps[1]).max() < 1e-10
            assert np.abs(np.cross(steps[0], axis[1] - axis[0])).max() < 1e-10
            through = axis.mean(axis=0)
            assert np.abs(numbers_in(said["its axis through"]) - through).max() < 0.051
            assert ("not in sight" in said["its axis through"]) == (np.linalg.norm(through) > 3)
            slide = numbers_in(said["slide along it"])[0] * np.radians(abs(v["angle"]))
            assert abs(slide) == pytest.approx(np.linalg.norm(steps[0]), abs=0.0051 * np.pi)


def test_no_body_leaves_the_picture(bolt):
    for _ in sweep(bolt, t=1.0):
        for name in ("geodesic", "screw", "goal"):
            box = bolt.artists[name]
            x, y, _ = proj3d.proj_transform(*corners(box).reshape(-1, 3).T, box.axes.get_proj())
            x, y = box.axes.transData.transform(np.stack([x, y], axis=-1)).T
            assert 0 < x.min() < x.max() < 560
            assert 0 < y.min() < y.max() < 380


def test_what_does_not_turn_has_no_pitch(bolt):
    bolt.put(angle=0.0, x=1.0, z=-1.0, t=1.0)
    assert read_off(bolt)["its axis through"] == "none"
    assert read_off(bolt)["slide along it"] == "all of the way"
    assert notice(bolt) == ""


@pytest.mark.source("BK (8)")
def test_the_book_and_its_spin(book):
    integrated = {}
    for v in sweep(book, axis="axis 2", t=6.0):
        key = v["axis"], v["off"]
        if key not in integrated:
            integrated[key] = spun(*key)
        times, R, w = integrated[key]
        k = int(np.abs(times - v["t"]).argmin())
        assert times[k] == pytest.approx(v["t"])
        assert (
            np.abs(corners(book.artists["book"]).mean(axis=1)[:3] - (EDGES / 2 * R[k]).T).max()
            < 1e-9
        )
        for i in range(3):
            drawn = points(book.artists[f"w{i + 1}"])
            assert np.abs(drawn - np.stack([times, w[:, i]], axis=-1)[: k + 1]).max() < 1e-8
            low, high = points(book.artists[f"axis {i + 1}"])
            assert np.abs(high - (EDGES[i] / 2 + 0.055) * R[k, :, i]).max() < 1e-9
            assert np.abs(low + high).max() < 1e-15
            place = book.artists[f"number {i + 1}"].get_position_3d()
            assert np.abs(place - (EDGES[i] / 2 + 0.072) * R[k, :, i]).max() < 1e-9
        said = read_off(book)
        assert np.abs(numbers_in(said["ω"]) - w[k]).max() < 0.0051
        main = int(v["axis"][-1]) - 1
        assert numbers_in(said[f"of {v['axis']} itself"])[-1] == pytest.approx(
            w[k, main], abs=0.0051
        )
        momentum = R[k] @ (MOMENTS * w[k])
        assert np.abs(momentum[:2]).max() < 1e-9 * np.linalg.norm(momentum)
        assert momentum[2] > 0
        assert list(book.artists["now"].get_xdata()) == [v["t"], v["t"]]


def spun(axis, off):
    """The motion, integrated on its own, the momentum upright at the start."""
    i = int(axis[-1]) - 1
    w0 = np.full(3, 4 * np.sin(np.radians(off)) / np.sqrt(2))
    w0[i] = 4 * np.cos(np.radians(off))
    momentum = MOMENTS * w0 / np.linalg.norm(MOMENTS * w0)
    cross = np.cross(momentum, [0, 0, 1])
    turn = np.linalg.norm(cross)
    start = rb.exp_so3(np.arcsin(turn) * cross / turn) if turn else np.eye(3)
    x, y, _ = start @ [0.8, 0.8, 1]
    start = rb.exp_so3([0, 0, np.radians(-60) - np.arctan2(y, x)]) @ start
    if momentum[2] < 0:
        raise AssertionError("the momentum was to point upwards, if only a little")
    times = np.linspace(0, 8, 201)
    return times, *rb.geodesic_flow(np.diag(MOMENTS), start, w0, times)


def test_at_first_all_three_numbers_are_on_the_side_of_the_eye(book):
    e, a = np.radians([book.artists["book"].axes.elev, book.artists["book"].axes.azim])
    eye = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    for axis in ("axis 1", "axis 2", "axis 3"):
        for off in (0.0, 4.0):
            book.put(axis=axis, off=off, t=0.0)
            places = [book.artists[f"number {i}"].get_position_3d() for i in (1, 2, 3)]
            assert (places @ eye > 0).all()


def test_only_the_middle_axis_turns_over(book):
    for axis, times in (("axis 1", "0 times"), ("axis 2", "2 times"), ("axis 3", "0 times")):
        book.put(axis=axis, off=4.0, t=8.0)
        assert read_off(book)["turned over"] == times
    book.put(axis="axis 2", t=3.0)
    assert read_off(book)["turned over"] == "once"


def test_another_axis_starts_anew(book):
    book.put(t=5.0)
    book.controls["axis"].value = "axis 3"
    assert book.values["t"] == 0
