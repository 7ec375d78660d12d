"""All names of the report are there, with its signatures."""

import inspect

import pytest

from rbcourse import report as rr

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
WANTED = {name: words.split(", ") for words, names in SIGNATURES.items() for name in names}


def test_there_is_nothing_else():
    assert set(rr.__all__) == set(WANTED)


@pytest.mark.parametrize("name", WANTED)
def test_signatures_are_those_of_the_report(name):
    """What the report does not have is keyword-only and may be left out."""
    given = inspect.signature(getattr(rr, name)).parameters.values()
    positional = [p for p in given if p.kind == p.POSITIONAL_OR_KEYWORD]
    assert [p.name for p in positional] == WANTED[name]
    extras = [p for p in given if p not in positional]
    assert all(p.kind == p.KEYWORD_ONLY and p.default is not p.empty for p in extras)
    assert all(p.default == (0.01 if p.name == "epsilon" else p.empty) for p in positional)
