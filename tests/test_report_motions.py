"""The report's functions on motions do what the package does, and show it."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure

import rbcourse as rb
from rbcourse import assignment as rr

RNG = np.random.default_rng(9)
PATH, ARM_PATH = RNG.uniform(-3, 3, (12, 3)), RNG.uniform(-3, 3, (12, 2))
PLAN = [([1, 0.5, -1], 2), ([0, 0, 3], 0.5)]


@pytest.mark.source("RR 3.1", "RR (14)", "RR (15)", "RR (16)")
def test_a_body_goes_in_ten_steps_unless_told_otherwise():
    start, goal = PATH[:2]
    path = rr.interpolate_rigid_body(start, goal)
    assert path.shape == (11, 3)
    assert np.abs(path - np.linspace(start, goal, 11)).max() < 1e-15
    assert rr.interpolate_rigid_body(start, goal, steps=3).shape == (4, 3)
    short = rr.interpolate_rigid_body([0, 0, 3], [0, 0, -3], shortest=True)
    assert short[-1, 2] == pytest.approx(2 * np.pi - 3)


@pytest.mark.source("RR 3.2", "RR (17)", "RR (18)", "RR (19)")
def test_a_body_obeys_in_the_frame_of_the_world_unless_told_otherwise():
    path = rr.forward_propagate_rigid_body([0, 0, 0.5], PLAN)
    assert np.array_equal(path, [[0, 0, 0.5], [2, 1, -1.5], [2, 1, 0]])
    in_body = rr.forward_propagate_rigid_body([0, 0, 0.5], PLAN, frame="body")
    assert np.array_equal(in_body, rb.propagate_planar([0, 0, 0.5], PLAN, frame="body"))


@pytest.mark.source("RR 4.1", "RR (20)", "RR (21)", "RR 4.2", "RR (22)", "RR (23)")
def test_an_arm_goes_and_obeys():
    path = rr.interpolate_arm([0.1, 0.2], [1, 2])
    assert np.abs(path - np.linspace([0.1, 0.2], [1, 2], 11)).max() < 1e-15
    assert rr.interpolate_arm([0.1, 0.2], [1, 2], steps=2).shape == (3, 2)
    path = rr.forward_propagate_arm([0, 1], [([1, -1], 2), ([0, 3], 1)])
    assert np.array_equal(path, [[0, 1], [2, -1], [2, 2]])


@pytest.mark.source("RR 3.3", "RR Fig. 6", "RR Fig. 7")
@pytest.mark.parametrize("states", [1, 2, 12])
def test_a_path_is_shown(states, tmp_path):
    figure, animation = rr.visualize_path(PATH[:states])
    assert isinstance(figure, Figure)
    assert len(animation.pictures) == states
    assert animation.alt.startswith("A rectangle goes from (")
    (ax,) = figure.axes
    assert np.array_equal(np.transpose(ax.lines[-2].get_data()), PATH[:states, :2])
    animation.save(tmp_path / "path.gif")
    assert (tmp_path / "path.gif").stat().st_size < 500_000
    assert "<input" in animation._repr_html_()
    plt.close(figure)


@pytest.mark.source("RR 4.3", "RR Fig. 8", "RR Fig. 9")
@pytest.mark.parametrize("states", [1, 2, 12])
def test_an_arm_path_is_shown(states, tmp_path):
    figure, animation = rr.visualize_arm_path(ARM_PATH[:states])
    assert isinstance(figure, Figure)
    assert len(animation.pictures) == states
    assert animation.alt.startswith("An arm with links of 2.0 and 1.5 m turns its joints from")
    links, way = figure.axes[0].lines[-2:]
    tip = rb.arm_forward_kinematics(ARM_PATH[:states]).joints
    assert np.array_equal(np.transpose(way.get_data()), tip[:, -1])
    assert np.array_equal(np.transpose(links.get_data()), tip[-1])
    blue, red = (plt.matplotlib.colors.to_rgb(line.get_color()) for line in (links, way))
    assert np.argmax(blue) == 2
    assert np.argmax(red) == 0
    animation.save(tmp_path / "arm.gif")
    assert (tmp_path / "arm.gif").stat().st_size < 500_000
    plt.close(figure)


def test_of_a_long_path_a_hundred_states_are_frames_and_all_are_drawn():
    t = np.linspace(0, 7, 2501)
    figure, animation = rr.visualize_path(np.transpose([t, np.sin(t), t]))
    assert len(animation.pictures) == 100
    assert len(figure.axes[0].lines[-2].get_xdata()) == 2501
    assert "to (7.0, 0.7) m" in animation.alt
    plt.close(figure)


def test_more_links_need_their_lengths():
    figure, animation = rr.visualize_arm_path(RNG.normal(size=(3, 4)), lengths=[1, 2, 3, 4])
    assert "links of 1.0, 2.0, 3.0 and 4.0 m" in animation.alt
    plt.close(figure)
    with pytest.raises(ValueError, match=r"^lengths: shape \(\.\.\., 4\) wanted, got \(2,\)"):
        rr.visualize_arm_path(RNG.normal(size=(3, 4)))


@pytest.mark.parametrize("length", [0.3, 2])
def test_the_rectangle_is_as_long_as_told(length):
    figure, _ = rr.visualize_path([[0, 0, 0], [9, 1, 0.5]], length=length)
    corners = figure.axes[0].patches[-1].get_xy()
    edges = np.linalg.norm(np.diff(corners, axis=0), axis=1)[:4]
    assert np.allclose(edges, [length, length / 2] * 2)
    plt.close(figure)


def test_bad_input_is_named_and_no_figure_stays_open():
    for call, message in (
        (lambda: rr.interpolate_rigid_body([0, 0], [1, 1, 1]), r"^start_pose: shape \(\.\.\., 3\)"),
        (lambda: rr.interpolate_rigid_body([0, 0, 0], [[1, 1, 1]]), r"^goal_pose: shape \(3\)"),
        (lambda: rr.forward_propagate_rigid_body([0, 0, np.nan], []), r"^start_pose\[2\] is nan"),
        (lambda: rr.forward_propagate_rigid_body([0, 0, 0], [([1, 0], 1)]), r"^plan\[0\] velocity"),
        (lambda: rr.interpolate_arm([0, 0], [1, 1, 1]), r"^goal: shape \(\.\.\., 2\) wanted"),
        (lambda: rr.interpolate_arm([[0, 0]], [1, 1]), r"^start: shape \(n\) wanted"),
        (lambda: rr.forward_propagate_arm([[0, 0]], []), r"^start_pose: shape \(n\) wanted"),
        (lambda: rr.visualize_path(np.zeros((0, 3))), r"^path: shape"),
        (lambda: rr.visualize_path([0, 0, 0]), r"^path: shape"),
        (lambda: rr.visualize_path([[0, 0]]), r"^path: shape"),
        (lambda: rr.visualize_path([[0, 0, np.inf]]), r"^path\[0, 2\] is inf"),
        (lambda: rr.visualize_path([[0, 0, 0]], length=0), r"^length: a number above 0 wanted"),
        (lambda: rr.visualize_path([[0, 0, 0]], length=np.nan), r"^length is nan"),
        (lambda: rr.visualize_arm_path(np.zeros((0, 2))), r"^path: shape"),
        (lambda: rr.visualize_arm_path([0, 0]), r"^path: shape"),
        (lambda: rr.visualize_arm_path([[0, 0]], lengths=[1, -1]), r"^lengths\[1\] is -1"),
    ):
        with pytest.raises(ValueError, match=message):
            call()
    assert plt.get_fignums() == []
