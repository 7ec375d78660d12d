"""Free bodies are drawn as they turn."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import rbcourse as rb
from rbcourse.draw import bodies, tumbling

MOMENTS = np.array([1.0, 2, 3])
TIMES = np.linspace(0, 24, 481)
STARTS = {"axis 1": [2, 0.01, 0.01], "axis 2": [0.01, 2, 0.01], "axis 3": [0.01, 0.01, 2]}
R, W = rb.geodesic_flow(np.diag(MOMENTS), np.eye(3), list(STARTS.values()), TIMES)
SPINS = tumbling.spin_table(TIMES, {name: W[:, k] for k, name in enumerate(STARTS)})


@pytest.fixture
def space():
    fig, ax = plt.subplots(subplot_kw={"projection": "3d"})
    yield ax
    plt.close(fig)


@pytest.mark.source("BK (8)")
def test_spins_are_drawn_with_a_line_for_each_component():
    fig, axes = plt.subplots(1, 3)
    lines = tumbling.draw_spins(axes, SPINS)
    assert len(lines) == 9
    for k, name in enumerate(STARTS):
        assert axes[k].get_title() == name
        for i in range(3):
            assert np.array_equal(lines[3 * k + i].get_ydata(), W[:, k, i])
    assert len({(line.get_color(), line.get_linestyle()) for line in lines}) == 3
    plt.close(fig)


def test_the_description_counts_flips():
    said = tumbling.describe_spins(SPINS)
    flips = np.count_nonzero(np.diff(np.sign(W[:, 1, 1])))
    assert flips >= 1
    assert f"axis 1: it stays; axis 2: it changes its sign {flips} times; axis 3: it stays" in said


@pytest.mark.source("BK (8)")
def test_momenta_lie_on_the_sphere_on_paths_of_equal_energy(space):
    table = tumbling.momentum_table(MOMENTS, W)
    L = np.stack([table[f"{axis} [1]"] for axis in "xyz"], axis=-1)
    assert L.shape == (3, 481, 3)
    assert np.abs(np.linalg.norm(L, axis=-1) - 1).max() < 1e-14
    energy = (L**2 / MOMENTS).sum(axis=-1)
    assert np.abs(energy - energy[:, :1]).max() < 1e-9
    assert np.array_equal(table["path [1]"][:, 0], [0, 1, 2])
    lines = tumbling.draw_momenta(space, table)
    for line, path in zip(lines, L, strict=True):
        drawn = np.transpose(line.get_data_3d())
        shown = ~np.isnan(drawn[:, 0])
        assert np.array_equal(drawn[shown], path[shown])
        e, a = np.radians([space.elev, space.azim])
        eye = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        seen = path @ eye > 0
        assert np.array_equal(shown, seen | np.roll(seen, 1))  # and the step across the edge
    assert len({line.get_color() for line in lines}) == 3
    said = tumbling.describe_momenta(table)
    assert "Black: the 1 that pass close to axis 2." in said
    assert "none round axis 2" in said


def test_the_book_turns_and_its_pin_with_it(space):
    edges = np.array([2.0, 1, 0.5])
    poses = rb.pose_from_components(R[:, 1], np.zeros(3))
    update = tumbling.moving_book(space, bodies.motion_table(TIMES, poses), edges)
    flat = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * edges / 2
    for i in (0, 40, 100, 120, 130, 160):
        artists = update(i)
        (pin,) = [artist for artist in artists if hasattr(artist, "get_data_3d")]
        e, a = np.radians([space.elev, space.azim])
        eye = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        assert (artists[-1] is pin) == (R[i, 1, :, 1] @ eye > 0)  # in front, drawn last
        (book,) = [artist for artist in artists if hasattr(artist, "_faces")]
        (clock,) = [artist for artist in artists if hasattr(artist, "get_text")]
        assert clock.get_text() == f"t = {TIMES[i]:.1f}"
        corners = np.unique(np.asarray(book._faces)[:6, :4].reshape(-1, 3).round(12), axis=0)
        assert np.abs(np.sort(corners, 0) - np.sort(flat @ R[i, 1].T, 0)).max() < 1e-11
        foot, tip = np.transpose(pin.get_data_3d())
        assert np.abs(foot - edges[1] / 2 * R[i, 1, :, 1]).max() < 1e-14
        assert np.abs(np.cross(tip, foot)).max() < 1e-14
        assert tip @ foot > foot @ foot


def test_the_description_of_the_book_says_when_it_turns_over():
    t = np.linspace(0, 4, 41)
    over = rb.exp_so3(np.outer(np.where(t > 1.95, np.pi, 0), [1, 0, 0]))
    upright = rb.exp_so3([np.pi / 2, 0, 0])
    poses = rb.pose_from_components(over @ upright, np.zeros(3))
    said = tumbling.describe_book(bodies.motion_table(t, poses))
    assert "It starts up, and turns over at t = 2.0." in said
    still = bodies.motion_table(t, np.broadcast_to(poses[0], poses.shape))
    assert "It starts up, and stays there." in tumbling.describe_book(still)
    level = bodies.motion_table(t, rb.pose_from_components(np.eye(3), np.zeros((41, 3))))
    assert "It starts down, and stays there." in tumbling.describe_book(level)
