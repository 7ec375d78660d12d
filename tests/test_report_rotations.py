"""The report's functions on rotations: its examples, and what it leaves open."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure

import rbcourse as rb
from rbcourse import report as rr

EPS = np.finfo(float).eps
NINE = [[1, 2, 3], [4, 5, 6], [7, 8, 9]]
CHECKS = [rr.check_SOn, rr.check_quaternion, rr.check_SEn]
CORRECTIONS = [rr.correct_SOn, rr.correct_quaternion, rr.correct_SEn]
GOOD = [np.eye(3), np.array([1.0, 0, 0, 0]), np.eye(3)]


@pytest.mark.source("RR 1.4", "RR (4)", "RR (5)", "RR Fig. 1", "errata 21")
def test_figure_1():
    identity = np.eye(3, dtype=int)
    assert str(rr.correct_SOn(identity)) == "[[1 0 0]\n [0 1 0]\n [0 0 1]]"
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
    assert np.array_equal(corrected[2], [0, 0, 1])
    assert np.array_equal(corrected[:2, 2], [4, 2])


@pytest.mark.source("RR 1.1", "RR 1.2", "RR 1.3", "RR (1)", "RR (2)", "RR (3)")
def test_checks_take_epsilon_as_the_largest_defect():
    for off, within in [(0.0099, True), (0.0101, False)]:
        assert rr.check_quaternion([1 + off, 0, 0, 0]) is within
        bent = np.eye(3)
        bent[0, 1] = off
        assert rr.check_SOn(bent) is within
        assert rr.check_SEn(bent) is within
        pose = np.eye(4)
        pose[0, 3], pose[3, 1] = 1e6, off
        assert rr.check_SEn(pose) is within
    assert rr.check_SOn([[1, 1e-5], [0, 1]], epsilon=1e-6) is False
    assert rr.check_SOn([[0, 1], [1, 0]], 0.5) is False  # det −1
    assert rr.check_SOn(NINE, np.inf) is True


def test_one_dimension():
    assert rr.check_SOn([[1]]) is True
    assert rr.check_SOn([[-1]]) is False
    assert np.array_equal(rr.correct_SOn([[-5]]), [[1]])
    assert rr.check_SEn([[1]]) is False
    assert rr.check_SEn([[1, 7], [0, 1]]) is True
    assert np.array_equal(rr.correct_SEn([[-5, 7], [2, 3]]), [[1, 7], [0, 1]])
    with pytest.raises(ValueError, match=r"m: shape .*n\+1.* wanted, got \(1, 1\)"):
        rr.correct_SEn([[1]])


@pytest.mark.parametrize("check", CHECKS)
@pytest.mark.parametrize(
    "thing",
    [
        *([], [[]], 5, None, "abc", [1, 0, 0], [[1, 0, 0], [0, 1, 0]], [[1, 0], [0]]),
        *(np.full((3, 3), np.nan), [np.inf, 0, 0, 0], [[1j, 0], [0, 1]], np.zeros((0, 0))),
        *([np.eye(3)], np.eye(4)[None, :1]),
    ],
    ids=str,
)
def test_what_is_no_member_fails_plainly(check, thing):
    assert check(thing) is False


def test_infinity_fails_whatever_the_tolerance():
    assert rr.check_SOn(np.full((3, 3), np.inf), np.inf) is False
    assert rr.check_SOn([[np.inf]], np.inf) is False
    assert rr.check_quaternion([np.inf, 0, 0, 0], np.inf) is False
    for place in ((0, 0), (0, 2), (2, 0)):
        A = np.eye(3)
        A[place] = np.inf
        assert rr.check_SEn(A, np.inf) is False


@pytest.mark.parametrize(
    ("correct", "thing", "message"),
    [
        (rr.correct_SOn, [[1, 0, 0], [0, 1, 0]], r"m: shape \(n, n\) wanted, got \(2, 3\)"),
        (rr.correct_SOn, [NINE, NINE], r"m: shape \(n, n\) wanted, got \(2, 3, 3\)"),
        (rr.correct_SOn, [[1, np.nan], [0, 1]], r"^m\[0, 1\] is nan"),
        (rr.correct_SOn, [[1, 0], [0]], "m: an array of numbers wanted"),
        (rr.correct_quaternion, [1, 2, 3], r"v: shape \(4\) wanted, got \(3,\)"),
        (rr.correct_quaternion, [[9, 9, 9, 9]], r"v: shape \(4\) wanted, got \(1, 4\)"),
        (rr.correct_quaternion, [0, 0, 0, 0], "^v is zero: it has no direction"),
        (rr.correct_quaternion, [1, np.inf, 0, 0], r"^v\[1\] is inf"),
        (rr.correct_SEn, np.ones((3, 4)), r"m: shape .* wanted, got \(3, 4\)"),
        (rr.correct_SEn, np.full((3, 3), np.inf), r"^m\[0, 0\] is inf"),
    ],
)
def test_what_cannot_be_corrected_is_refused(correct, thing, message):
    with pytest.raises(ValueError, match=message):
        correct(thing)


@pytest.mark.parametrize(("correct", "good"), list(zip(CORRECTIONS, GOOD, strict=True)))
def test_what_is_valid_is_copied_and_what_is_not_becomes_valid(correct, good):
    near = good + 0.001
    copy = correct(near)
    assert np.array_equal(copy, near)
    assert not np.shares_memory(copy, near)
    far = good + 0.3
    assert dict(zip(CORRECTIONS, CHECKS, strict=True))[correct](correct(far), 1e-14)
    assert np.array_equal(far, good + 0.3)
    assert not np.array_equal(correct(near, epsilon=1e-6), near)


def test_a_reflection_becomes_a_rotation():
    for n in (2, 3, 4):
        mirror = np.diag([*np.ones(n - 1), -1.0])
        assert rr.check_SOn(rr.correct_SOn(mirror), 1e-14)


@pytest.mark.parametrize("function", CHECKS + CORRECTIONS)
@pytest.mark.parametrize("epsilon", [-0.1, np.nan, "small", [0.1]])
def test_what_is_no_tolerance_is_refused(function, epsilon):
    with pytest.raises(ValueError, match=r"^epsilon: "):
        function(np.eye(3), epsilon)


@pytest.mark.source("RR 2.1", "RR 2.2")
def test_random_members_are_those_of_the_samplers():
    for naive in (True, False):
        R, q = rr.random_rotation_matrix(naive, rng=3), rr.random_quaternion(naive, rng=3)
        assert rr.check_SOn(R, 1e-14)
        assert rr.check_quaternion(q, 1e-14)
    assert np.array_equal(R, rb.sample_rotation(rng=3))
    assert np.array_equal(q, rb.sample_quaternion(rng=3))
    assert np.array_equal(
        rr.random_quaternion(True, rng=3), rb.sampling.sample_quaternion_naive(rng=3)
    )
    R = rr.random_rotation_matrix(True, rng=3)
    assert np.array_equal(R, rb.sampling.sample_rotation_naive(rng=3))


@pytest.mark.parametrize("value", [0, 42, "no", None])
def test_a_choice_is_true_or_false(value):
    for choose in (rr.random_rotation_matrix, rr.random_quaternion, rr.visualize):
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
    again, same = rr.visualize(quaternion, rng=4)
    assert same._repr_html_() == animation._repr_html_()
    plt.close(figure)
    plt.close(again)


def strokes_of(figure):
    """Where v0 and v1 go, as drawn."""
    strokes = next(line for line in figure.axes[0].lines if line.get_linewidth() == 1.6)
    return np.transpose(strokes.get_data_3d()).reshape(-1, 3, 3)[:, :2]


@pytest.mark.source("RR 2.2", "RR Fig. 4", "RR Fig. 5")
@pytest.mark.parametrize("naive", [True, False])
def test_what_is_shown_is_what_the_samplers_draw(naive):
    v0, v1 = np.array([0.0, 0, 1]), np.array([0, 0.2, 1])
    R = (rb.sampling.sample_rotation_naive if naive else rb.sample_rotation)(5, rng=4)
    figure, animation = rr.visualize(False, naive=naive, rng=4, steps=5)
    assert np.abs(strokes_of(figure) - np.stack([R @ v0, R @ v1], axis=1)).max() < 8 * EPS
    assert "random matrices" in animation.alt
    plt.close(figure)
    q = (rb.sampling.sample_quaternion_naive if naive else rb.sample_quaternion)(5, rng=4)
    R = rb.matrix_from_quaternion(q)
    figure, animation = rr.visualize(True, naive=naive, rng=4, steps=5)
    assert np.abs(strokes_of(figure) - np.stack([R @ v0, R @ v1], axis=1)).max() < 8 * EPS
    assert "random quaternions" in animation.alt
    plt.close(figure)


def test_uniform_is_what_is_shown_by_default():
    figure, _ = rr.visualize(False, rng=4, steps=1)
    assert np.abs(strokes_of(figure)[0, 0] - rb.sample_rotation(rng=4)[:, 2]).max() < 8 * EPS
    plt.close(figure)


def test_many_steps_take_longer():
    figure, animation = rr.visualize_rotation(np.eye(3), steps=249)
    assert len(animation.pictures) == 251
    assert animation.seconds == pytest.approx(251 / 25)
    plt.close(figure)


@pytest.mark.parametrize("shape", ["matrix", "quaternion"])
def test_what_is_within_the_tolerance_is_shown_as_the_nearest_rotation(shape):
    q = rb.project_quaternion([0.6, 0.5, 0.4, 0.3])
    R = rb.matrix_from_quaternion(q)
    given = R + 0.002 * np.diag([1, -1, 2]) @ R if shape == "matrix" else 1.009 * q
    nearest = rb.project_so(given) if shape == "matrix" else R
    figure, _ = rr.visualize_rotation(given, steps=1)
    assert np.abs(strokes_of(figure)[-1, 0] - nearest[:, 2]).max() < 8 * EPS
    plt.close(figure)


@pytest.mark.parametrize(
    "rotation", [rb.exp_so3([0.5, 1, -2]), rb.quaternion_from_rotation_vector([0.5, 1, -2])]
)
def test_one_rotation_is_shown_step_by_step(rotation):
    figure, animation = rr.visualize_rotation(rotation, steps=6)
    angle = np.degrees(np.linalg.norm([0.5, 1, -2]))
    assert f"A turn of {angle:.0f} degrees carries the pole of a sphere to (" in animation.alt
    assert len(animation.pictures) == 8
    assert len(strokes_of(figure)) == 7
    start, end = strokes_of(figure)[[0, -1], 0]
    assert np.abs(start - [0, 0, 1]).max() == 0
    assert np.abs(end - rb.exp_so3([0.5, 1, -2])[:, 2]).max() < 8 * EPS
    plt.close(figure)


def test_only_rotations_are_shown():
    for bad in (np.eye(2), np.ones((3, 3)), [2, 0, 0, 0], [np.eye(3)]):
        with pytest.raises(ValueError, match=r"^rotation: "):
            rr.visualize_rotation(bad)
    with pytest.raises(ValueError, match=r"^steps: an integer from 1 up wanted, got 0"):
        rr.visualize_rotation(np.eye(3), steps=0)
    assert plt.get_fignums() == []
