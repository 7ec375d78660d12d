"""The openings of the lessons: each states the right number."""

import re
from pathlib import Path

import nbformat
import numpy as np
import pytest

import rbcourse as rb
from rbclassroom import openings
from rbclassroom.figures import lesson16

NOTEBOOKS = Path(__file__).parents[2] / "notebooks"
EYE, REST = np.eye(3), np.zeros(3)


def cost_ratio(one, other, *ends):
    return rb.acceleration_cost(one(*ends)) / rb.acceleration_cost(other(*ends))


def turn(degrees, axis=(0, 0, 1)):
    return rb.exp_so3(np.radians(degrees) * np.array(axis) / np.linalg.norm(axis))


def longest_joint_path():
    """The links are 2 m and 1.5 m long; the motors turn from (−20°, 20°) to (160°, 120°)."""
    one, two = np.radians([np.linspace(-20, 160, 51), np.linspace(20, 120, 51)])
    tips = 2 * np.exp(1j * one) + 1.5 * np.exp(1j * (one + two))
    return np.abs(np.diff(tips)).sum()


def largest_lag():
    """The yaw and the roll change by a half-turn at 2 s; yaw, pitch and roll do 60°/s."""
    t = np.linspace(0, 4, 501)
    goal = rb.exp_so3(np.outer(-np.pi * t / 4, EYE[1])) @ turn(-1)
    angles = [rb.zyx_from_matrix(goal[0])]
    for wanted in np.unwrap(rb.zyx_from_matrix(goal), axis=0)[1:]:
        angles.append(angles[-1] + np.clip(wanted - angles[-1], *np.radians([-0.48, 0.48])))
    return np.degrees(rb.angle_between(rb.matrix_from_zyx(angles), goal)).max()


def distance_of_the_cubes():
    """Both motions are cubics; their difference is t²(t − 1) times the difference of velocities."""
    A = rb.exp_so3([np.pi / 6, 2 * np.pi / 3, np.pi / 2])
    return 4 / 27 * np.linalg.norm(A @ [20, 0, 20] - [20, 0, 20])


def factor_of_torque():
    body, ends = rb.Body.box([0.30, 0.20, 0.03]), (EYE, turn(150, [1, 1, 1]), REST, REST)
    best = rb.minimum_torque(*ends, body=body)
    return rb.torque_cost(rb.minimum_acceleration(*ends), body=body) / best.cost


def jumps():
    R = rb.matrix_from_zyx(np.radians([[-60, 0, 0], [-10, 40, 0], [50, -40, 30], [90, 20, 0]]))
    w = rb.log_so3(R[:-1].mT @ R[1:]) / [[1], [1], [2]]
    return np.linalg.norm(w[1:] - w[:-1], axis=1)


def time_of_the_first_turn():
    J, t = np.array([0.13**2 + 0.03**2, 0.2**2 + 0.03**2, 0.2**2 + 0.13**2]), np.arange(0, 3, 0.01)
    R, w = rb.connection.geodesic_flow(np.diag(J), EYE, [0.2, 4, 0.2], t)
    momentum = R[0] @ (J * w[0])
    return t[(R[:, :, 1] @ momentum < 0).argmax()]


def most_needed():
    hand = lesson16.hand()
    return np.linalg.norm(hand(np.linspace(0, 4, 801), 2), axis=1).max()


PROJECTED, BEST = rb.projected_cubic, rb.minimum_acceleration
CUBIC, BEZIER = rb.closed_forms.exponential_cubic, rb.closed_forms.bezier
LESSON_9 = EYE, turn(170), REST, REST
LESSON_11 = EYE, turn(170), [0, 0, -3], [0, 0, -3]
LESSON_12 = EYE, turn(135, [1, 1, 0]), [0, 0, 4], [-4, 0, 0]


def found(*ends):
    return rb.optimum.stationary(rb.projected_cubic(*ends))


SAID = {  # by opening, in the order of the lessons
    "gripper_that_flips": lambda: f"{360 - np.degrees(0.5):.0f}° .* {np.degrees(0.5):.0f}°",
    "car_that_slides": lambda: f"{90 - np.degrees(np.arctan(0.5)):.0f}°",
    "hand_that_hits_a_glass": lambda: f"{longest_joint_path():.1f} m",
    "camera_that_loses_its_target": lambda: f"{largest_lag():.0f}°",
    "box_that_grows": lambda: f"{100 * 1.00245**200 - 100:.0f} %",
    "spray_robot": lambda: f"{100 / 3:.0f} % .* {100 - 100 * np.cos(np.pi / 6):.0f} %",
    "box_that_shrinks": lambda: f"{100 * np.cos(np.radians(75)):.0f} %",
    "wrench_that_leaves_its_bolt": lambda: f"{30 * (1 - np.cos(np.radians(75))):.0f} cm",
    "book_that_turns_over": lambda: f"{time_of_the_first_turn():.1f} s",
    "turn_that_snaps": lambda: f"{cost_ratio(PROJECTED, BEST, *LESSON_9):.0f} times",
    "cube_that_comes_from_another_side": lambda: f"{distance_of_the_cubes():.1f} m",
    "turn_that_goes_back": lambda: f"{cost_ratio(CUBIC, BEZIER, *LESSON_11):.0f} times",
    "solver_at_a_local_minimum": lambda: f"{cost_ratio(found, BEST, *LESSON_12):.0f} times",
    "book_taken_for_a_ball": lambda: f"{100 * factor_of_torque() - 100:.0f} %",
    "camera_that_jolts": lambda: f"{jumps().max():.1f} rad/s",
    "tool_at_one_rate": lambda: "2.3 times",
    "gripper_that_shakes": lambda: f"2131 rad/s².* {most_needed():.1f}",
    "camera_that_turns_back": lambda: f"{360 - 90}° .* {230 - 140}°",
}


@pytest.mark.parametrize("opening", SAID)
def test_each_opening_states_its_number(opening):
    """The test of the lesson compares its stored output with a new one."""
    number = list(SAID).index(opening)
    (path,) = NOTEBOOKS.glob(f"{number:02}_*.ipynb")
    cells = nbformat.read(path, as_version=4).cells
    (cell,) = (cell for cell in cells if f"openings.{opening}()" in cell.source)
    shown = cell.outputs[0].data
    name, _, alt = shown["text/plain"].partition(": ")
    assert name == f"opening{number:02}"
    assert re.search(rf"(?<![\d.]){SAID[opening]()}", alt)
    assert len(shown["text/html"]) < 200_000


def test_each_lesson_has_one_opening():
    docs = [getattr(f, "__doc__", "") or "" for f in vars(openings).values() if callable(f)]
    lessons = [int(m[1]) for m in (re.match(r"Lesson (\d+):", doc) for doc in docs) if m]
    assert lessons == list(range(18))


def test_the_motion_of_the_solver_is_a_local_minimum():
    assert found(*LESSON_12).certified
