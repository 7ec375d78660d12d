"""Spins, momenta and carried arrows."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import rbcourse as rb
from rbclassroom.figures import lesson08

MOMENTS = np.array([1.0, 2, 3])
TIMES = np.linspace(0, 24, 481)
STARTS = {"axis 1": [2, 0.01, 0.01], "axis 2": [0.01, 2, 0.01], "axis 3": [0.01, 0.01, 2]}


@pytest.fixture(scope="module")
def turning():
    """Orientations and angular velocities of the three spins, shape (times, spins, ...)."""
    return rb.geodesic_flow(np.diag(MOMENTS), np.eye(3), list(STARTS.values()), TIMES)


@pytest.fixture(scope="module")
def spins(turning):
    return {name: turning[1][:, k] for k, name in enumerate(STARTS)}


@pytest.fixture
def space():
    fig, ax = plt.subplots(subplot_kw={"projection": "space"})
    yield ax
    plt.close(fig)


@pytest.mark.source("BK (8)")
def test_spins_are_drawn_with_a_line_for_each_component(spins):
    fig, axes = plt.subplots(1, 3)
    lines = lesson08.draw_spins(axes, TIMES, spins)
    assert len(lines) == 9
    for k, name in enumerate(STARTS):
        assert axes[k].get_title() == name
        for i in range(3):
            assert np.array_equal(lines[3 * k + i].get_ydata(), spins[name][:, i])
    assert len({(line.get_color(), line.get_linestyle()) for line in lines}) == 3
    plt.close(fig)


def test_the_description_counts_flips(spins):
    said = lesson08.describe_spins(spins)
    flips = np.count_nonzero(np.diff(np.sign(spins["axis 2"][:, 1])))
    assert flips >= 1
    assert f"axis 1: it stays; axis 2: it changes its sign {flips} times; axis 3: it stays" in said


@pytest.mark.source("BK (8)")
def test_momenta_lie_on_the_sphere_on_paths_of_equal_energy(space, turning):
    L = lesson08.momentum_directions(MOMENTS, turning[1])
    table = lesson08.momentum_table(L)
    assert np.array_equal(np.stack([table[f"{axis} [1]"] for axis in "xyz"], axis=-1), L)
    assert L.shape == (3, 481, 3)
    assert np.abs(np.linalg.norm(L, axis=-1) - 1).max() < 1e-14
    energy = (L**2 / MOMENTS).sum(axis=-1)
    assert np.abs(energy - energy[:, :1]).max() < 1e-9
    assert np.array_equal(table["path [1]"][:, 0], [0, 1, 2])
    lines = lesson08.draw_momenta(space, L)
    for line, path in zip(lines, L, strict=True):
        assert np.array_equal(np.transpose(line.get_data_3d()), path)
    assert len({line.get_color() for line in lines}) == 3
    said = lesson08.describe_momenta(L)
    assert "Black: the 1 that pass close to axis 2." in said
    assert "none round axis 2" in said


def test_the_book_turns_and_its_pin_with_it(space, turning):
    edges = np.array([2.0, 1, 0.5])
    turns, _ = turning
    update = lesson08.moving_book(space, TIMES, turns[:, 1], edges)
    flat = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * edges / 2
    for i in (0, 40, 100, 120, 130, 160):
        artists = update(i)
        book, pin, clock = artists
        assert clock.get_text() == f"t = {TIMES[i]:.1f}"
        corners = np.unique(book.corners[:6].reshape(-1, 3).round(12), axis=0)
        assert np.abs(np.sort(corners, 0) - np.sort(flat @ turns[i, 1].T, 0)).max() < 1e-11
        foot, tip = np.transpose(pin.get_data_3d())
        assert np.abs(foot - edges[1] / 2 * turns[i, 1, :, 1]).max() < 1e-14
        assert np.abs(np.cross(tip, foot)).max() < 1e-14
        assert tip @ foot > foot @ foot


def test_the_description_of_the_book_says_when_it_turns_over():
    t = np.linspace(0, 4, 41)
    over = rb.exp_so3(np.outer(np.where(t > 1.95, np.pi, 0), [1, 0, 0]))
    upright = rb.exp_so3([np.pi / 2, 0, 0])
    said = lesson08.describe_book(t, over @ upright)
    assert "It starts up, and turns over at t = 2.0." in said
    still = np.broadcast_to(upright, over.shape)
    assert "It starts up, and stays there." in lesson08.describe_book(t, still)
    level = np.broadcast_to(np.eye(3), over.shape)
    assert "It starts down, and stays there." in lesson08.describe_book(t, level)


@pytest.mark.source("BK (9)")
def test_a_parallel_arrow_turns_by_half_of_the_body():
    turned = np.radians([0, 90, 180])
    fig, axes = plt.subplots(1, 3)
    arrows = lesson08.draw_carried(axes, turned)
    tips = np.array([arrow.get_xydata()[1] for arrow in arrows]).reshape(3, 3, 2)
    angles = np.degrees(np.arctan2(tips[..., 1], tips[..., 0])) % 360
    assert angles == pytest.approx(30 + np.outer([0, 90, 180], [0, 0.5, 1]))
    data = lesson08.carried_table(turned)
    assert data["parallel x [1]"] == pytest.approx(tips[:, 1, 0])
    assert "0, 90, 180 degrees" in lesson08.describe_carried(turned)
    plt.close(fig)
