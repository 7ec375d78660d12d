"""Test the report's functions: names, examples and figures."""

import inspect

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure

import rbcourse as rb
from rbcourse import report as rr

EPS = np.finfo(float).eps
RNG = np.random.default_rng(9)
SIGNATURES = {
    "m, epsilon": ["check_SOn", "check_SEn", "correct_SOn", "correct_SEn"],
    "v, epsilon": ["check_quaternion", "correct_quaternion"],
    "naive": ["random_rotation_matrix", "random_quaternion"],
    "rotation": ["visualize_rotation"],
    "quaternion": ["visualize"],
    "start_pose, goal_pose": ["interpolate_rigid_body"],
    "start_pose, plan": ["forward_propagate_rigid_body", "forward_propagate_arm"],
    "start, goal": ["interpolate_arm"],
    "path": ["visualize_path", "visualize_arm_path"],
}
NINE = [[1, 2, 3], [4, 5, 6], [7, 8, 9]]
TRIPLES = [
    (rr.check_SOn, rr.correct_SOn, np.eye(3)),
    (rr.check_quaternion, rr.correct_quaternion, np.eye(4)[0]),
    (rr.check_SEn, rr.correct_SEn, np.eye(3)),
]
PATH, ARM_PATH = RNG.uniform(-3, 3, (12, 3)), RNG.uniform(-3, 3, (12, 2))
PLAN = [([1, 0.5, -1], 2), ([0, 0, 3], 0.5)]


def test_names_and_signatures_agree_with_the_report():
    """Parameters that are not in the report are keyword-only and optional."""
    wanted = {name: words.split(", ") for words, names in SIGNATURES.items() for name in names}
    assert {x for x in rr.__all__ if not x.startswith("figure_")} == set(wanted)
    for name, words in wanted.items():
        given = inspect.signature(getattr(rr, name)).parameters.values()
        positional = [p for p in given if p.kind == p.POSITIONAL_OR_KEYWORD]
        assert [p.name for p in positional] == words
        assert all(p.default == (0.01 if p.name == "epsilon" else p.empty) for p in positional)
        extras = [p for p in given if p not in positional]
        assert all(p.kind == p.KEYWORD_ONLY and p.default is not p.empty for p in extras)


@pytest.mark.source("RR 1.4", "RR (4)", "RR (5)", "RR Fig. 1", "errata 21")
@pytest.mark.source("RR 1.5", "RR (6)", "RR Fig. 2", "RR 1.6", "RR Fig. 3")
def test_the_examples_give_the_results_printed_in_the_report():
    """Valid integer arguments are returned unchanged. The first invalid argument is singular."""
    quarter = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    valid = (rr.correct_SOn, np.eye(3)), (rr.correct_quaternion, [1, 0, 0, 0])
    for correct, given in (*valid, (rr.correct_SEn, quarter)):
        corrected = correct(np.array(given, dtype=int))
        assert np.array_equal(corrected, given)
        assert corrected.dtype == int
    printed = [
        [-0.75271952, 0.38914789, 0.5310153],
        [0.38914789, -0.38759388, 0.83566435],
        [0.5310153, 0.83566435, 0.1403134],
    ]
    assert np.abs(rr.correct_SOn(NINE) - printed).max() < 0.5e-8
    assert np.linalg.matrix_rank(NINE) == 2
    assert np.abs(rr.correct_quaternion([2, 2, 0, 0]) - [0.70710678, 0.70710678, 0, 0]).max() < 5e-9
    assert np.array_equal(rr.correct_quaternion([10, 10, 10, 10]), [0.5] * 4)
    corrected = rr.correct_SEn([[3, 2, 4], [2, 3, 2], [0, 1, 1]])
    assert np.abs(corrected - [[1, 0, 4], [0, 1, 2], [0, 0, 1]]).max() < 1e-15
    assert np.array_equal(np.delete(corrected, [0, 1, 3, 4]), [4, 2, 0, 0, 1])
    assert np.array_equal(rr.correct_SOn([[-5]]), [[1]])  # a reflection
    assert np.array_equal(rr.correct_SEn([[-5, 7], [2, 3]]), [[1, 7], [0, 1]])


@pytest.mark.source("RR 1.1", "RR 1.2", "RR 1.3", "RR (1)", "RR (2)", "RR (3)")
def test_checks_allow_defects_up_to_epsilon():
    for off, within in [(0.0099, True), (0.0101, False)]:
        assert rr.check_quaternion([1 + off, 0, 0, 0]) is within
        bent = np.array([[1, off, 0], [0, 1, 0], [0, 0, 1]])
        assert rr.check_SOn(bent) is rr.check_SEn(bent) is within
        pose = np.eye(4)
        pose[0, 3], pose[3, 1] = 1e6, off
        assert rr.check_SEn(pose) is within
    assert rr.check_SOn([[1, 1e-5], [0, 1]], epsilon=1e-6) is False
    assert rr.check_SOn([[0, 1], [1, 0]], 0.5) is False  # the determinant is −1
    assert rr.check_SOn(NINE, np.inf) is True
    assert rr.check_SOn([[1]]) is rr.check_SEn([[1, 7], [0, 1]]) is True  # in one dimension
    assert rr.check_SOn([[-1]]) is rr.check_SEn([[1]]) is False


@pytest.mark.parametrize(("check", "correct", "good"), TRIPLES)
def test_checks_never_raise_errors(check, correct, good):
    """Malformed and infinite arguments fail the check; valid ones are copied."""
    for thing in (
        *([], [[]], 5, None, "abc", [1, 0, 0], [[1, 0, 0], [0, 1, 0]], [[1, 0], [0]]),
        *(np.full((3, 3), np.nan), [np.inf, 0, 0, 0], [[1j, 0], [0, 1]], np.zeros((0, 0))),
        *([np.eye(3)], np.eye(4)[None, :1]),
    ):
        assert check(thing) is False
    places = [np.arange(9).reshape(3, 3) == k for k in (0, 2, 6)]
    infinite = [np.where(place, np.inf, np.eye(3)) for place in places]
    for thing in ([np.inf, 0, 0, 0], [[np.inf]], np.full((3, 3), np.inf), *infinite):
        assert check(thing, np.inf) is False
    near, far = good + 0.001, good + 0.3
    copy = correct(near)
    assert np.array_equal(copy, near)
    assert not np.shares_memory(copy, near)
    assert check(correct(far), 1e-14)
    assert np.array_equal(far, good + 0.3)
    assert not np.array_equal(correct(near, epsilon=1e-6), near)


def strokes_of(figure):
    strokes = next(line for line in figure.axes[0].lines if line.get_linewidth() == 1.6)
    return np.transpose(strokes.get_data_3d()).reshape(-1, 3, 3)[:, :2]


@pytest.mark.source("RR 2.1", "RR 2.2", "RR Fig. 4", "RR Fig. 5")
@pytest.mark.parametrize("quaternion", [True, False])
def test_random_rotations_agree_with_the_samplers(quaternion, tmp_path):
    """The file of the animation of a hundred rotations is small."""
    one = rr.random_quaternion if quaternion else rr.random_rotation_matrix
    for choice, steps in (({}, 5 if quaternion else 100), ({"naive": True}, 3)):
        naive = bool(choice)
        name = ("quaternion" if quaternion else "rotation") + "_naive" * naive
        R = getattr(rb.sampling, f"sample_{name}")(steps, rng=4)
        assert np.array_equal(one(naive, rng=4), R[0])
        R = rb.matrix_from_quaternion(R) if quaternion else R
        options = {"steps": steps} if steps < 100 else {}
        figure, animation = rr.visualize(quaternion, **choice, rng=4, **options)
        assert isinstance(figure, Figure)
        want = np.stack([R @ [0, 0, 1], R @ [0, 0.2, 1]], axis=1)
        assert np.abs(strokes_of(figure) - want).max() < 8 * EPS
        assert f"random {'quaternions' if quaternion else 'matrices'}" in animation.alt
        assert f"under {steps} random rotations" in animation.alt
        assert len(animation.pictures) == steps + 1
        assert animation.seconds == pytest.approx(max(4, (steps + 1) / 25))
        animation.save(tmp_path / "shown.gif")
        assert (tmp_path / "shown.gif").stat().st_size < 500_000


@pytest.mark.parametrize("function", [rb.exp_so3, rb.quaternion.quaternion_from_rotation_vector])
def test_one_rotation_is_shown_step_by_step(function):
    """An argument within the tolerance is replaced by the nearest rotation."""
    turn = np.array([0.5, 1, -2])
    given = function(turn)
    off = 0.002 * np.diag([1, -1, 2]) @ given if given.ndim == 2 else 0.009 * given
    figure, animation = rr.visualize_rotation(given + off, steps=6)
    R = rb.project_so(given + off) if given.ndim == 2 else rb.exp_so3(turn)
    angle = np.degrees(np.linalg.norm(rb.log_so3(R)))
    assert f"A turn of {angle:.0f} degrees carries the pole of a sphere to (" in animation.alt
    assert len(animation.pictures) == 8
    want = rb.exp_so3(np.linspace(0, 1, 7)[:, None] * rb.log_so3(R))[..., 2]
    assert np.abs(strokes_of(figure)[:, 0] - want).max() < 8 * EPS


@pytest.mark.source("RR 3.1", "RR (14)", "RR (15)", "RR (16)")
@pytest.mark.source("RR 3.2", "RR (17)", "RR (18)", "RR (19)")
@pytest.mark.source("RR 4.1", "RR (20)", "RR (21)", "RR 4.2", "RR (22)", "RR (23)")
def test_paths_have_ten_steps_by_default():
    for interpolate, path in ((rr.interpolate_rigid_body, PATH), (rr.interpolate_arm, ARM_PATH)):
        for steps, options in ((10, {}), (3, {"steps": 3})):
            want = np.linspace(*path[:2], steps + 1)
            assert np.abs(interpolate(*path[:2], **options) - want).max() < 1e-15
    short = rr.interpolate_rigid_body([0, 0, 3], [0, 0, -3], shortest=True)
    assert short[-1, 2] == pytest.approx(2 * np.pi - 3)
    path = rr.forward_propagate_rigid_body([0, 0, 0.5], PLAN)
    assert np.array_equal(path, [[0, 0, 0.5], [2, 1, -1.5], [2, 1, 0]])
    in_body = rr.forward_propagate_rigid_body([0, 0, 0.5], PLAN, frame="body")
    assert np.array_equal(in_body, rb.planar.propagate_planar([0, 0, 0.5], PLAN, frame="body"))
    path = rr.forward_propagate_arm([0, 1], [([1, -1], 2), ([0, 3], 1)])
    assert np.array_equal(path, [[0, 1], [2, -1], [2, 2]])


def edges_of(figure):
    return np.linalg.norm(np.diff(figure.axes[0].patches[-1].get_xy(), axis=0), axis=1)[:4]


def test_lengths_of_links_and_of_a_body_can_be_given():
    _, animation = rr.visualize_arm_path(PATH[:1], lengths=[1, 2, 3])
    assert "links are 1, 2 and 3 m long" in animation.alt
    assert np.allclose(edges_of(rr.visualize_path(PATH[:1], length=0.3)[0]), [0.3, 0.15] * 2)


@pytest.mark.source("RR 3.3", "RR Fig. 6", "RR Fig. 7", "RR 4.3", "RR Fig. 8", "RR Fig. 9")
@pytest.mark.parametrize(("states", "pale"), [(1, [0]), (12, [0, 2, 4, 7, 9, 11])])
def test_paths_of_bodies_and_arms_are_drawn(states, pale):
    """At most six states are drawn pale; the last state is drawn over them."""
    path, arm_path = PATH[:states], ARM_PATH[:states]
    figure, animation = rr.visualize_path(path)
    arm, arm_animation = rr.visualize_arm_path(arm_path)
    for shown, player in ((figure, animation), (arm, arm_animation)):
        assert isinstance(shown, Figure)
        assert len(player.pictures) == len(player.states) == states
    assert animation.alt.startswith("Path of the centre of a rectangle")
    *others, body = figure.axes[0].patches
    centres = [patch.get_xy()[:4].mean(axis=0) for patch in (*others, body)]
    assert np.abs(centres - path[[*pale, -1], :2]).max() < 1e-14
    *noses, way, _ = figure.axes[0].lines
    assert max(nose.get_zorder() for nose in noses) < body.get_zorder() < way.get_zorder()
    assert arm_animation.alt.startswith("Motion of an arm from joint angles of ")
    *others, links, way = (np.transpose(line.get_data()) for line in arm.axes[0].lines)
    joints = rb.arm.arm_forward_kinematics(arm_path).joints
    assert np.array_equal(way, joints[:, -1])
    assert np.array_equal(links, joints[-1])
    assert np.abs(np.array(others) - joints[pale]).max() < 1e-14


def test_the_animation_of_a_long_path_has_forty_frames(tmp_path):
    t = np.linspace(0, 1, 10_000)
    path = np.transpose([1.3 * np.cos(716.9 * t), np.sin(245.86 * t), 50 * t])
    figure, animation = rr.visualize_path(path)
    assert len(animation.pictures) == 40
    assert any(len(line.get_xdata()) == len(path) for line in figure.axes[0].lines)
    animation.save(tmp_path / "shown.gif")
    assert (tmp_path / "shown.gif").stat().st_size < 500_000


@pytest.mark.parametrize("place", [[1.1, 0.7], [1e14, 0]])
def test_a_body_that_turns_on_the_spot_is_visible(place):
    """After a full circle, rounding may move the body; the description does not state this tiny
    length."""
    spin = rr.interpolate_rigid_body([*place, 0], [*place, 6], steps=3)
    circle = [([2 * np.pi, 0, 2 * np.pi], 1)] * 2
    driven = rr.forward_propagate_rigid_body([*place, 0], circle, frame="body")
    for path in (spin, driven):
        figure, animation = rr.visualize_path(path)
        length = max(1, 1e-12 * np.abs(place).max())
        assert edges_of(figure)[0] == pytest.approx(length, rel=1e-4)
        assert len(set(np.asarray(animation.pictures[0]).ravel())) > 10
        assert "its centre covers 0 m" in animation.alt


@pytest.mark.parametrize(("size", "far"), [(1e-6, 1000), (0.25, 1e9), (1e6, 0)])
def test_the_drawn_rectangle_is_a_fifth_of_the_extent(size, far):
    path = np.array([[far, 0, 0], [far + 2 * size, size, 0]])
    figure, animation = rr.visualize_path(path)
    extent = path[1, 0] - far
    assert edges_of(figure)[0] == pytest.approx(extent / 5, rel=1e-3)
    assert f"{float(f'{size:.3g}'):.10g}) m, heading" in animation.alt
    covered = np.hypot(extent, size)
    assert f"covers {float(f'{covered:.3g}'):.10g} m" in animation.alt


EPSILONS = (np.nan, "small")
BAD = [
    *((f, (np.eye(3), x), "epsilon: ") for one in TRIPLES for f in one[:2] for x in EPSILONS),
    (rr.correct_SOn, ([NINE, NINE],), r"m: shape \(n, n\) is wanted, got \(2, 3, 3\)"),
    (rr.correct_SOn, ([[1, np.nan], [0, 1]],), r"m\[0, 1\] is nan"),
    (rr.correct_quaternion, ([[9, 9, 9, 9]],), r"v: shape \(4\) is wanted, got \(1, 4\)"),
    (rr.correct_quaternion, ([0, 0, 0, 0],), "v is zero: it has no direction"),
    (rr.correct_SEn, ([[1]],), r"m: shape .*n\+1.* is wanted, got \(1, 1\)"),
    (rr.random_rotation_matrix, (42,), "naive: True or False is wanted, got 42"),
    (rr.visualize, (None,), "quaternion: True or False is wanted, got"),
    *((rr.visualize_rotation, (x,), "rotation: ") for x in (np.eye(2), NINE, [2, 0, 0, 0])),
    (rr.visualize_rotation, (np.eye(3), {"steps": 0}), "steps: an integer from 1 up is wanted"),
    (rr.interpolate_rigid_body, ([0, 0], [1, 1, 1]), r"start_pose: shape \(3\)"),
    (rr.forward_propagate_rigid_body, ([0, 0, np.nan], []), r"start_pose\[2\] is nan"),
    (rr.interpolate_arm, ([0, 0], [1, 1, 1]), r"goal: shape \(2\) is wanted"),
    (rr.forward_propagate_arm, ([[0, 0]], []), r"start_pose: shape \(n\) is wanted"),
    (rr.visualize_path, ([[0, 0]],), "path: shape"),
    (rr.visualize_path, ([[0, 0, 0]], {"length": 0}), "length: a number above 0, large enough"),
    (rr.visualize_path, ([[1e17, 0, 0]], {"length": 1}), "length: a number above 0, large enough"),
    (rr.visualize_arm_path, (np.ones((3, 4)),), r"lengths: shape \(4\) is wanted, got \(2,\)"),
    (rr.visualize_arm_path, ([[0, 0]], {"lengths": [1, -1]}), r"lengths\[1\] is -1"),
]


@pytest.mark.parametrize(("function", "arguments", "message"), BAD)
def test_bad_arguments_leave_no_figure_open(function, arguments, message):
    options = arguments[-1] if isinstance(arguments[-1], dict) else {}
    with pytest.raises(ValueError, match=f"^{message}"):
        function(*(one for one in arguments if one is not options), **options)
    assert plt.get_fignums() == []
