"""The report's functions on motions do what the package does, and show it."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure

import rbcourse as rb
from rbcourse import report as rr
from rbcourse.draw.save import COLOURS

RNG = np.random.default_rng(9)
PATH, ARM_PATH = RNG.uniform(-3, 3, (12, 3)), RNG.uniform(-3, 3, (12, 2))
PLAN = [([1, 0.5, -1], 2), ([0, 0, 3], 0.5)]


@pytest.fixture(autouse=True)
def figures_are_closed():
    yield
    plt.close("all")


def is_saved_small(animation, folder):
    animation.save(folder / "path.gif")
    return (folder / "path.gif").stat().st_size < 500_000


def edges_of(figure):
    return np.linalg.norm(np.diff(figure.axes[0].patches[-1].get_xy(), axis=0), axis=1)[:4]


def way_of(figure):
    way = next(line for line in figure.axes[0].lines if line.get_color() == COLOURS["path"])
    return np.transpose(way.get_data())


@pytest.mark.source("RR 3.1", "RR (14)", "RR (15)", "RR (16)")
@pytest.mark.source("RR 3.2", "RR (17)", "RR (18)", "RR (19)")
def test_a_body_goes_in_ten_steps_and_obeys_in_the_world_unless_told_otherwise():
    start, goal = PATH[:2]
    path = rr.interpolate_rigid_body(start, goal)
    assert np.abs(path - np.linspace(start, goal, 11)).max() < 1e-15
    assert rr.interpolate_rigid_body(start, goal, steps=3).shape == (4, 3)
    short = rr.interpolate_rigid_body([0, 0, 3], [0, 0, -3], shortest=True)
    assert short[-1, 2] == pytest.approx(2 * np.pi - 3)
    path = rr.forward_propagate_rigid_body([0, 0, 0.5], PLAN)
    assert np.array_equal(path, [[0, 0, 0.5], [2, 1, -1.5], [2, 1, 0]])
    in_body = rr.forward_propagate_rigid_body([0, 0, 0.5], PLAN, frame="body")
    assert np.array_equal(in_body, rb.planar.propagate_planar([0, 0, 0.5], PLAN, frame="body"))


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
    assert len(animation.pictures) == len(animation.states) == states
    assert animation.alt.startswith("A rectangle goes from (")
    assert np.array_equal(way_of(figure), PATH[:states, :2])
    assert is_saved_small(animation, tmp_path)
    assert "<script>" in animation._repr_html_()


@pytest.mark.source("RR 4.3", "RR Fig. 8", "RR Fig. 9")
@pytest.mark.parametrize("states", [1, 2, 12])
def test_an_arm_path_is_shown(states, tmp_path):
    figure, animation = rr.visualize_arm_path(ARM_PATH[:states])
    assert isinstance(figure, Figure)
    assert len(animation.pictures) == states
    assert animation.alt.startswith("An arm with links of 2 and 1.5 m turns its joints from")
    links, way = figure.axes[0].lines[-2:]
    tip = rb.arm.arm_forward_kinematics(ARM_PATH[:states]).joints
    assert np.array_equal(np.transpose(way.get_data()), tip[:, -1])
    assert np.array_equal(np.transpose(links.get_data()), tip[-1])
    for line, channel in ((links, 2), (way, 0)):  # blue, and red
        assert np.argmax(plt.matplotlib.colors.to_rgb(line.get_color())) == channel
    assert is_saved_small(animation, tmp_path)


def test_of_a_long_path_forty_states_are_frames_and_all_are_drawn(tmp_path):
    """Whose files are small, though the way covers the plane."""
    t, noise = np.linspace(0, 1, 10_000), RNG.uniform(-1, 1, (2501, 3)) * [1.4, 1, 3]
    dense = np.transpose([1.3 * np.cos(716.9 * t), np.sin(245.86 * t), 50 * t])
    for path, length in ((noise, 1.5), (dense, 0.3), (dense, None)):
        figure, animation = rr.visualize_path(path, length=length)
        assert len(animation.pictures) == 40
        assert len(way_of(figure)) == len(path)
        assert is_saved_small(animation, tmp_path)


def test_six_states_are_pale_and_the_last_is_on_top():
    figure, _ = rr.visualize_path(PATH)
    shown, body = [0, 2, 4, 7, 9, 11], figure.axes[0].patches[-1]
    centres = [patch.get_xy()[:4].mean(axis=0) for patch in figure.axes[0].patches]
    assert np.abs(centres - PATH[[*shown, -1], :2]).max() < 1e-14
    assert all(body.get_zorder() > other.get_zorder() for other in figure.axes[0].lines[:-1])
    figure, _ = rr.visualize_arm_path(ARM_PATH)
    pale = [np.transpose(line.get_data()) for line in figure.axes[0].lines[:-2]]
    assert np.abs(pale - rb.arm.arm_forward_kinematics(ARM_PATH[shown]).joints).max() < 1e-14


@pytest.mark.parametrize("place", [[0, 0], [1.1, 0.7], [1e6, -2e6], [1e14, 0]])
def test_a_body_that_turns_on_the_spot_is_seen(place):
    """Though rounding moves the one that is driven round a circle, and no wrong words are said."""
    spin = rr.interpolate_rigid_body([*place, 0], [*place, 6], steps=50)
    circle = [([2 * np.pi, 0, 2 * np.pi], 1)] * 2
    driven = rr.forward_propagate_rigid_body([*place, 0], circle, frame="body")
    for path in (spin, driven):
        figure, animation = rr.visualize_path(path)
        length = max(1, 1e-12 * np.abs(place).max())
        assert edges_of(figure)[0] == pytest.approx(length, rel=1e-4)
        assert len(set(np.asarray(animation.pictures[0]).ravel())) > 10
        assert "its centre covers 0 m" in animation.alt


@pytest.mark.parametrize(
    ("size", "far"),
    [(1e-6, 0), (0.25, 0), (1e6, 0), (1e-6, 1000), (0.25, 1000), (0.25, 1e9), (1e6, 1e9)],
)
def test_the_rectangle_is_a_fifth_of_the_extent_and_the_words_have_the_scale(size, far):
    path = np.array([[far, 0, 0], [far + 2 * size, size, 0]])
    figure, animation = rr.visualize_path(path)
    extent = path[1, 0] - far
    assert edges_of(figure)[0] == pytest.approx(extent / 5, rel=1e-3)
    assert f"{float(f'{size:.3g}'):.10g}) m, heading" in animation.alt
    covered = np.hypot(extent, size)
    assert f"covers {float(f'{covered:.3g}'):.10g} m" in animation.alt


def test_lengths_of_the_rectangle_and_of_links_may_be_given():
    for length in (0.3, 2):
        figure, _ = rr.visualize_path([[0, 0, 0], [9, 1, 0.5]], length=length)
        assert np.allclose(edges_of(figure), [length, length / 2] * 2)
    _, animation = rr.visualize_arm_path(RNG.normal(size=(3, 4)), lengths=[1, 2, 3, 4])
    assert "links of 1, 2, 3 and 4 m" in animation.alt


@pytest.mark.parametrize(
    ("function", "arguments", "options", "message"),
    [
        (rr.interpolate_rigid_body, ([0, 0], [1, 1, 1]), {}, r"start_pose: shape \(3\)"),
        (rr.interpolate_rigid_body, ([0, 0, 0], [[1, 1, 1]]), {}, r"goal_pose: shape \(3\)"),
        (rr.forward_propagate_rigid_body, ([0, 0, np.nan], []), {}, r"start_pose\[2\] is nan"),
        (rr.interpolate_arm, ([0, 0], [1, 1, 1]), {}, r"goal: shape \(2\) wanted"),
        (rr.interpolate_arm, ([[0, 0]], [1, 1]), {}, r"start: shape \(n\) wanted"),
        (rr.forward_propagate_arm, ([[0, 0]], []), {}, r"start_pose: shape \(n\) wanted"),
        (rr.visualize_path, (np.zeros((0, 3)),), {}, "path: shape"),
        (rr.visualize_path, ([[0, 0]],), {}, "path: shape"),
        (rr.visualize_path, ([[0, 0, np.inf]],), {}, r"path\[0, 2\] is inf"),
        (rr.visualize_path, ([[0, 0, 0]],), {"length": 0}, "length: above 0 wanted, and enough"),
        (rr.visualize_path, ([[1e17, 0, 0]],), {"length": 1}, "length: above 0 wanted, and"),
        (rr.visualize_path, ([[0, 0, 0]],), {"length": np.nan}, "length is nan"),
        (rr.visualize_arm_path, (np.zeros((0, 2)),), {}, "path: shape"),
        (rr.visualize_arm_path, (np.ones((3, 4)),), {}, r"lengths: shape \(4\) wanted, got \(2,\)"),
        (rr.visualize_arm_path, ([[0, 0]],), {"lengths": [1, -1]}, r"lengths\[1\] is -1"),
    ],
)
def test_bad_input_is_named_and_no_figure_stays_open(function, arguments, options, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        function(*arguments, **options)
    assert plt.get_fignums() == []
