"""The report's functions on rotations: its examples, and what it leaves open."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure

import rbcourse as rb
from rbcourse import report as rr

EPS = np.finfo(float).eps
NINE = [[1, 2, 3], [4, 5, 6], [7, 8, 9]]
TRIPLES = [
    (rr.check_SOn, rr.correct_SOn, np.eye(3)),
    (rr.check_quaternion, rr.correct_quaternion, np.eye(4)[0]),
    (rr.check_SEn, rr.correct_SEn, np.eye(3)),
]


def strokes_of(figure):
    strokes = next(line for line in figure.axes[0].lines if line.get_linewidth() == 1.6)
    return np.transpose(strokes.get_data_3d()).reshape(-1, 3, 3)[:, :2]


@pytest.fixture(autouse=True)
def figures_are_closed():
    yield
    plt.close("all")


@pytest.mark.source("RR 1.4", "RR (4)", "RR (5)", "RR Fig. 1", "errata 21")
def test_figure_1():
    assert str(rr.correct_SOn(np.eye(3, dtype=int))) == "[[1 0 0]\n [0 1 0]\n [0 0 1]]"
    printed = [
        [-0.75271952, 0.38914789, 0.5310153],
        [0.38914789, -0.38759388, 0.83566435],
        [0.5310153, 0.83566435, 0.1403134],
    ]
    assert np.abs(rr.correct_SOn(NINE) - printed).max() < 0.5e-8
    assert np.linalg.matrix_rank(NINE) == 2


@pytest.mark.source("RR 1.5", "RR (6)", "RR Fig. 2")
def test_figure_2():
    assert str(rr.correct_quaternion([1, 0, 0, 0])) == "[1 0 0 0]"
    assert np.abs(rr.correct_quaternion([2, 2, 0, 0]) - [0.70710678, 0.70710678, 0, 0]).max() < 5e-9
    assert np.array_equal(rr.correct_quaternion([10, 10, 10, 10]), [0.5] * 4)


@pytest.mark.source("RR 1.6", "RR Fig. 3")
def test_figure_3():
    quarter = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    assert str(rr.correct_SEn(quarter)) == "[[ 0 -1  0]\n [ 1  0  0]\n [ 0  0  1]]"
    corrected = rr.correct_SEn([[3, 2, 4], [2, 3, 2], [0, 1, 1]])
    assert np.abs(corrected - [[1, 0, 4], [0, 1, 2], [0, 0, 1]]).max() < 1e-15
    assert np.array_equal(np.delete(corrected, [0, 1, 3, 4]), [4, 2, 0, 0, 1])


@pytest.mark.source("RR 1.1", "RR 1.2", "RR 1.3", "RR (1)", "RR (2)", "RR (3)")
def test_checks_take_epsilon_as_the_largest_defect():
    for off, within in [(0.0099, True), (0.0101, False)]:
        assert rr.check_quaternion([1 + off, 0, 0, 0]) is within
        bent = np.array([[1, off, 0], [0, 1, 0], [0, 0, 1]])
        assert rr.check_SOn(bent) is rr.check_SEn(bent) is within
        pose = np.eye(4)
        pose[0, 3], pose[3, 1] = 1e6, off
        assert rr.check_SEn(pose) is within
    assert rr.check_SOn([[1, 1e-5], [0, 1]], epsilon=1e-6) is False
    assert rr.check_SOn([[0, 1], [1, 0]], 0.5) is False  # det −1
    assert rr.check_SOn(NINE, np.inf) is True


def test_one_dimension():
    assert rr.check_SOn([[1]]) is rr.check_SEn([[1, 7], [0, 1]]) is True
    assert rr.check_SOn([[-1]]) is rr.check_SEn([[1]]) is False
    assert np.array_equal(rr.correct_SOn([[-5]]), [[1]])  # a reflection
    assert np.array_equal(rr.correct_SEn([[-5, 7], [2, 3]]), [[1, 7], [0, 1]])


@pytest.mark.parametrize("check", [check for check, *_ in TRIPLES])
def test_malformed_and_infinite_arguments_fail_the_checks(check):
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


@pytest.mark.parametrize(
    ("correct", "thing", "message"),
    [
        (rr.correct_SOn, [NINE, NINE], r"m: shape \(n, n\) wanted, got \(2, 3, 3\)"),
        (rr.correct_SOn, [[1, np.nan], [0, 1]], r"^m\[0, 1\] is nan"),
        (rr.correct_quaternion, [[9, 9, 9, 9]], r"v: shape \(4\) wanted, got \(1, 4\)"),
        (rr.correct_quaternion, [0, 0, 0, 0], "^v is zero: it has no direction"),
        (rr.correct_quaternion, [1, np.inf, 0, 0], r"^v\[1\] is inf"),
        (rr.correct_SEn, [[1]], r"m: shape .*n\+1.* wanted, got \(1, 1\)"),
        (rr.correct_SEn, np.full((3, 3), np.inf), r"^m\[0, 0\] is inf"),
    ],
)
def test_arguments_without_a_correction_are_refused(correct, thing, message):
    with pytest.raises(ValueError, match=message):
        correct(thing)


@pytest.mark.parametrize(("check", "correct", "good"), TRIPLES)
def test_valid_arguments_are_copied_and_others_become_valid(check, correct, good):
    near, far = good + 0.001, good + 0.3
    copy = correct(near)
    assert np.array_equal(copy, near)
    assert not np.shares_memory(copy, near)
    assert check(correct(far), 1e-14)
    assert np.array_equal(far, good + 0.3)
    assert not np.array_equal(correct(near, epsilon=1e-6), near)


@pytest.mark.parametrize("function", [f for check, correct, _ in TRIPLES for f in (check, correct)])
def test_bad_tolerances_are_refused(function):
    for epsilon in (-0.1, np.nan, "small", [0.1]):
        with pytest.raises(ValueError, match=r"^epsilon: "):
            function(np.eye(3), epsilon)


@pytest.mark.source("RR 2.1", "RR 2.2")
@pytest.mark.parametrize(("naive", "kind"), [(False, ""), (True, "_naive")])
def test_random_members_are_those_of_the_samplers(naive, kind):
    R = getattr(rb.sampling, f"sample_rotation{kind}")(rng=3)
    q = getattr(rb.sampling, f"sample_quaternion{kind}")(rng=3)
    assert np.array_equal(rr.random_rotation_matrix(naive, rng=3), R)
    assert np.array_equal(rr.random_quaternion(naive, rng=3), q)


@pytest.mark.parametrize("choose", [rr.random_rotation_matrix, rr.random_quaternion, rr.visualize])
def test_a_choice_is_true_or_false(choose):
    for value in (0, 42, "no", None):
        with pytest.raises(ValueError, match="True or False wanted, got"):
            choose(value)


@pytest.mark.source("RR 2.2", "RR Fig. 4", "RR Fig. 5")
@pytest.mark.parametrize("quaternion", [True, False])
def test_a_hundred_random_rotations_are_shown(quaternion, tmp_path):
    figure, animation = rr.visualize(quaternion, rng=4)
    assert isinstance(figure, Figure)
    assert len(animation.pictures) == 101
    assert "under 100 random rotations" in animation.alt
    animation.save(tmp_path / "shown.gif")
    assert (tmp_path / "shown.gif").stat().st_size < 500_000
    _, same = rr.visualize(quaternion, rng=4)
    assert same._repr_html_() == animation._repr_html_()


@pytest.mark.source("RR 2.2", "RR Fig. 4", "RR Fig. 5")
@pytest.mark.parametrize("choice", [{}, {"naive": False}, {"naive": True}])
@pytest.mark.parametrize(("quaternion", "name"), [(False, "rotation"), (True, "quaternion")])
def test_random_rotations_are_shown_as_the_samplers_draw_them(quaternion, name, choice):
    kind = "_naive" if choice.get("naive") else ""
    R = getattr(rb.sampling, f"sample_{name}{kind}")(5, rng=4)
    R = rb.matrix_from_quaternion(R) if quaternion else R
    figure, animation = rr.visualize(quaternion, **choice, rng=4, steps=5)
    want = np.stack([R @ [0, 0, 1], R @ [0, 0.2, 1]], axis=1)
    assert np.abs(strokes_of(figure) - want).max() < 8 * EPS
    assert f"random {'quaternions' if quaternion else 'matrices'}" in animation.alt


def test_within_the_tolerance_the_nearest_rotation_is_shown():
    q = rb.project_quaternion([0.6, 0.5, 0.4, 0.3])
    R = rb.matrix_from_quaternion(q)
    M = R + 0.002 * np.diag([1, -1, 2]) @ R
    for given, nearest in ((M, rb.project_so(M)), (1.009 * q, R)):
        figure, _ = rr.visualize_rotation(given, steps=1)
        assert np.abs(strokes_of(figure)[-1, 0] - nearest[:, 2]).max() < 8 * EPS


@pytest.mark.parametrize(
    ("function", "steps"), [(rb.exp_so3, 6), (rb.quaternion_from_rotation_vector, 249)]
)
def test_one_rotation_is_shown_step_by_step_and_many_steps_take_longer(function, steps):
    figure, animation = rr.visualize_rotation(function([0.5, 1, -2]), steps=steps)
    angle = np.degrees(np.linalg.norm([0.5, 1, -2]))
    assert f"A turn of {angle:.0f} degrees carries the pole of a sphere to (" in animation.alt
    assert len(animation.pictures) == steps + 2
    assert animation.seconds == pytest.approx(max(4, (steps + 2) / 25))
    want = rb.exp_so3(np.linspace(0, 1, steps + 1)[:, None] * [0.5, 1, -2])[..., 2]
    assert np.abs(strokes_of(figure)[:, 0] - want).max() < 8 * EPS


def test_only_rotations_are_shown():
    for bad in (np.eye(2), np.ones((3, 3)), [2, 0, 0, 0], [np.eye(3)]):
        with pytest.raises(ValueError, match=r"^rotation: "):
            rr.visualize_rotation(bad)
    with pytest.raises(ValueError, match=r"^steps: an integer from 1 up wanted, got 0"):
        rr.visualize_rotation(np.eye(3), steps=0)
    assert plt.get_fignums() == []
