"""The openings of the lessons: each states the right number."""

import re
from pathlib import Path

import nbformat
import numpy as np

import rbcourse as rb
from rbclassroom import openings

NOTEBOOKS = Path(__file__).parents[2] / "notebooks"
EYE, REST = np.eye(3), np.zeros(3)


def cost_ratio(one, other, *ends):
    return rb.acceleration_cost(one(*ends)) / rb.acceleration_cost(other(*ends))


def turn(degrees, axis=(0, 0, 1)):
    return rb.exp_so3(np.radians(degrees) * np.array(axis) / np.linalg.norm(axis))


PROJECTED, BEST = rb.projected_cubic, rb.minimum_acceleration
LESSON_9 = EYE, turn(170), REST, REST
LESSON_12 = EYE, turn(135, [1, 1, 0]), [0, 0, 4], [-4, 0, 0]


def found(*ends):
    return rb.optimum.stationary(rb.projected_cubic(*ends))


SAID = {  # by opening; these numbers have short formulas
    "gripper_that_flips": lambda: f"{360 - np.degrees(0.5):.0f}° .* {np.degrees(0.5):.0f}°",
    "car_that_slides": lambda: f"{90 - np.degrees(np.arctan(0.5)):.0f}°",
    "box_that_grows": lambda: f"{100 * 1.00245**200 - 100:.0f} %",
    "spray_robot": lambda: f"{100 / 3:.0f} % .* {100 - 100 * np.cos(np.pi / 6):.0f} %",
    "box_that_shrinks": lambda: f"{100 * np.cos(np.radians(75)):.0f} %",
    "wrench_that_leaves_its_bolt": lambda: f"{30 * (1 - np.cos(np.radians(75))):.0f} cm",
    "turn_that_snaps": lambda: f"{cost_ratio(PROJECTED, BEST, *LESSON_9):.0f} times",
    "solver_at_a_local_minimum": lambda: f"{cost_ratio(found, BEST, *LESSON_12):.0f} times",
    "camera_that_turns_back": lambda: f"{360 - 90}° .* {230 - 140}°",
}


def test_each_lesson_has_an_opening_that_states_its_number():
    """The last test of each lesson compares the stored opening with a new one."""
    said = dict(SAID)
    for number, path in enumerate(sorted(NOTEBOOKS.glob("[0-9][0-9]_*.ipynb"))):
        cells = nbformat.read(path, as_version=4).cells
        (cell,) = (cell for cell in cells if cell.id == "opening")
        opening = re.search(r"openings\.(\w+)\(\)", cell.source)[1]
        assert getattr(openings, opening).__doc__.startswith(f"Lesson {number}:")
        shown = cell.outputs[0].data
        name, _, alt = shown["text/plain"].partition(": ")
        assert name == f"opening{number:02}"
        assert re.search(rf"(?<![\d.]){said.pop(opening, lambda: '')()}", alt), opening
        assert len(shown["text/html"]) < 200_000
    assert not said


def test_the_motion_of_the_solver_is_a_local_minimum():
    assert found(*LESSON_12).certified
