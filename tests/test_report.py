"""All names of the report are there, with its signatures."""

import inspect

import pytest

from rbcourse import report as rr

SIGNATURES = {
    "check_SOn": ["m", "epsilon"],
    "check_quaternion": ["v", "epsilon"],
    "check_SEn": ["m", "epsilon"],
    "correct_SOn": ["m", "epsilon"],
    "correct_quaternion": ["v", "epsilon"],
    "correct_SEn": ["m", "epsilon"],
    "random_rotation_matrix": ["naive"],
    "random_quaternion": ["naive"],
    "visualize_rotation": ["rotation"],
    "visualize": ["quaternion"],
    "interpolate_rigid_body": ["start_pose", "goal_pose"],
    "forward_propagate_rigid_body": ["start_pose", "plan"],
    "visualize_path": ["path"],
    "interpolate_arm": ["start", "goal"],
    "forward_propagate_arm": ["start_pose", "plan"],
    "visualize_arm_path": ["path"],
}


def test_there_is_nothing_else():
    assert set(rr.__all__) == set(SIGNATURES)


@pytest.mark.parametrize("name", SIGNATURES)
def test_signatures_are_those_of_the_report(name):
    """What the report does not have is keyword-only and may be left out."""
    given = inspect.signature(getattr(rr, name)).parameters.values()
    positional = [p for p in given if p.kind == p.POSITIONAL_OR_KEYWORD]
    assert [p.name for p in positional] == SIGNATURES[name]
    extras = [p for p in given if p not in positional]
    assert all(p.kind == p.KEYWORD_ONLY and p.default is not p.empty for p in extras)
    for p in positional:
        assert p.default == (0.01 if p.name == "epsilon" else p.empty)
