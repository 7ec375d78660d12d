"""What the explorer of four poses draws is what the package computes, wherever its sliders are."""

import numpy as np
import pytest
from sweeps import corners, numbers_in, points, read_off, sweep

import rbcourse as rb
from rbclassroom.explorers import chain_explorer
from rbclassroom.explorers.paths import POSES, SHARES

LEGS = {
    "projected cubics": rb.projected_cubic_se3,
    "optima": rb.minimum_acceleration_se3,
    "projected quintics": rb.projected_quintic_so3,
    "geodesics": rb.geodesic_se3,
}


@pytest.fixture(scope="module")
def explorer():
    return chain_explorer()


def motion(leg, share, duration, t):
    times, velocities = duration * SHARES, None
    if leg != "geodesics":
        velocities = share * rb.bessel_velocities(times, POSES) * [[0], [1], [1], [0]]
    return rb.chain(times, POSES, velocities, leg=LEGS[leg])


def test_the_box_and_its_way_are_those_of_the_chain(explorer):
    assert np.array_equal(points(explorer.artists["poses"]), POSES[:, :3, 3])
    for v in sweep(explorer, t=0.4):
        c, now = motion(**v), v["t"] * v["duration"]
        way = points(explorer.artists["way"])
        assert np.abs(way - c(np.linspace(*c.domain, len(way)))[:, :3, 3]).max() < 1e-12
        faces, A = corners(explorer.artists["box"]).reshape(-1, 3), c(now)
        assert np.abs(faces.mean(axis=0) - A[:3, 3]).max() < 1e-12
        local = np.abs((faces - A[:3, 3]) @ A[:3, :3])
        assert np.abs(local - [0.45, 0.3, 0.15]).max() < 1e-12


def test_speeds_and_what_is_read_are_those_of_the_chain(explorer):
    for v in sweep(explorer, t=0.4):
        c, now = motion(**v), v["t"] * v["duration"]
        times = np.linspace(0, v["duration"], 241)
        rates = [np.linalg.norm(c(times, k).reshape(-1, 2, 3), axis=-1) for k in (1, 2)]
        here = np.linalg.norm(c(now, 1).reshape(2, 3), axis=-1)
        for i, name in enumerate(("angular speed (rad/s)", "speed (m/s)")):
            line, dot = (points(explorer.artists[key]) for key in (name, f"{name} now"))
            assert np.abs(line - np.stack([times, rates[0][:, i]], axis=1)).max() < 1e-12
            assert np.abs(dot - [now, here[i]]).max() < 1e-12
            assert line[:, 1].max() < explorer.artists[name].axes.get_ylim()[1]
            joints = explorer.artists[f"{name} joints"].get_segments()
            assert [segment[0, 0] for segment in joints] == list(c.times[1:-1])
        said = read_off(explorer)
        assert np.abs(numbers_in(said["fastest"]) - rates[0].max(axis=0)).max() < 0.0051
        strongest = numbers_in(said["strongest"].replace("²", ""))
        assert np.abs(strongest - rates[1].max(axis=0)).max() < 0.0051
        for key, order in (("ω jumps", 1), ("ω′ jumps", 2)):
            jump = np.linalg.norm(c.jumps(order)[:, :3], axis=1).max()
            assert abs(numbers_in(said[key].replace("²", ""))[0] - jump) < 0.0051


def test_where_the_largest_speeds_are_they_fit(explorer):
    for leg in LEGS:
        for share in (0.0, 1.5):
            explorer.put(leg=leg, share=share, duration=4.0)
            for name in ("angular speed (rad/s)", "speed (m/s)"):
                line = explorer.artists[name]
                assert points(line)[:, 1].max() < line.axes.get_ylim()[1]
