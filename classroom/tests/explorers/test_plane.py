"""What the explorers of the plane draw is what the package computes, wherever the sliders are."""

import numpy as np
import pytest
from sweeps import notice, numbers_in, points, read_off, sweep, tell

import rbcourse as rb
from rbclassroom.explorers import arm_explorer, planar_explorer

START = np.radians([-20, 110])


@pytest.fixture(scope="module")
def plan():
    return planar_explorer()


@pytest.fixture(scope="module")
def arm():
    return arm_explorer()


def commands(v):
    first = [v["vx1"], v["vy1"], np.radians(v["omega1"])]
    second = [v["vx2"], v["vy2"], np.radians(v["omega2"])]
    return [(first, min(v["t"], 2.0)), (second, max(v["t"] - 2.0, 0.0))]


@pytest.mark.source("RR (17)", "RR (18)", "RR (19)")
def test_both_bodies_are_where_the_plan_leads_them(plan):
    for v in sweep(plan, omega1=45.0, t=4.0):
        for frame in ("world", "body"):
            end = rb.planar.propagate_planar([0, 0, 0], commands(v), frame=frame)[-1]
            way = points(plan.artists[f"{frame} way"])
            assert len(way) == round(v["t"] * 20) + 1
            whole = rb.planar.propagate_planar([0, 0, 0], commands(v | {"t": 4.0}), frame=frame)[-1]
            assert np.abs(points(plan.artists[f"{frame} plan"])[-1] - whole[:2]).max() < 1e-12
            assert np.abs(way[-1] - end[:2]).max() < 1e-12
            corners = plan.artists[f"{frame} outline"].get_xy()[:4]
            assert np.abs(corners.mean(axis=0) - end[:2]).max() < 1e-12
            ahead = corners[1] - corners[0]
            heading = np.array([np.cos(end[2]), np.sin(end[2])])
            assert np.abs(ahead - 1.3 * heading).max() < 1e-12
            said = numbers_in(read_off(plan)[frame])
            assert np.abs(said - [*end[:2], np.degrees(end[2])]).max() <= 0.501
            assert np.abs(said[:2] - end[:2]).max() < 0.0051


def test_the_way_of_the_body_is_the_one_of_all_times_before(plan):
    v = {
        "vx1": 1.0,
        "vy1": -0.5,
        "omega1": 90.0,
        "vx2": -1.0,
        "vy2": 0.2,
        "omega2": -45.0,
        "t": 4.0,
    }
    plan.put(**v)
    for frame in ("world", "body"):
        for k, place in enumerate(points(plan.artists[f"{frame} way"])):
            states = rb.planar.propagate_planar([0, 0, 0], commands(v | {"t": k / 20}), frame=frame)
            assert np.abs(place - states[-1, :2]).max() < 1e-12


def test_no_plan_leads_out_of_the_picture(plan):
    ax = plan.artists["world way"].axes
    for _ in sweep(plan, t=4.0):
        for frame in ("world", "body"):
            corners = plan.artists[f"{frame} outline"].get_xy()
            shown = ax.get_xlim(), ax.get_ylim()
            for (low, high), places in zip(shown, corners.T, strict=True):
                assert low < places.min()
                assert places.max() < high


def test_before_it_is_touched_both_frames_agree(plan):
    plan.restart()
    assert plan.values["t"] == 0
    plan.put(t=4.0)
    ways = [points(plan.artists[f"{frame} way"]) for frame in ("world", "body")]
    assert np.abs(ways[0] - ways[1]).max() < 1e-15


@pytest.mark.source("RR (20)", "RR (21)")
def test_the_arm_and_the_way_of_its_hand(arm):
    for v in sweep(arm, theta0=77.0, theta1=-40.0):
        goal = np.radians([v["theta0"], v["theta1"]])
        q = (1 - v["t"]) * START + v["t"] * goal
        joints = rb.arm.arm_forward_kinematics(q).joints
        assert np.abs(points(arm.artists["links"]) - joints).max() < 1e-14
        assert np.abs(points(arm.artists["goal"])[0] - hand(goal)).max() < 1e-14
        way = points(arm.artists["way"])
        assert np.abs(way[[0, -1]] - [hand(START), joints[-1]]).max() < 1e-14
        said = read_off(arm)
        assert np.abs(numbers_in(said["angles"]) - np.degrees(q)).max() < 0.051
        assert np.abs(numbers_in(said["hand"]) - joints[-1]).max() < 0.0051
        middle = (START + q) / 2
        assert np.abs(way[len(way) // 2] - hand(middle)).max() < 1e-14


def hand(q):
    return rb.arm.arm_forward_kinematics(q).joints[-1]


def test_the_arm_starts_where_its_pale_twin_stays(arm):
    arm.restart()
    pale = arm.artists["links"].axes.lines[0]
    assert arm.values["t"] == 0
    assert np.abs(points(pale) - points(arm.artists["links"])).max() < 1e-15
    assert np.ptp(points(arm.artists["way"]), axis=0).max() < 1e-15  # the poll is not answered


def test_who_sets_a_goal_sees_the_arm_there(arm):
    for name in ("theta0", "theta1"):
        arm.restart()
        arm.controls[name].value = 45.0
        q = np.radians([arm.values["theta0"], arm.values["theta1"]])
        assert arm.values["t"] == 1
        assert np.abs(points(arm.artists["links"])[-1] - hand(q)).max() < 1e-14


def click(arm, place):
    x, y = arm.artists["links"].axes.transData.transform(place)
    box = arm._fig.bbox
    tell(arm, place=[x / box.width, 1 - y / box.height])


@pytest.mark.parametrize("place", [(1, 2), (-2.5, -1), (0.6, -0.1), (3.4, 0)])
@pytest.mark.parametrize("elbow", [110.0, -60.0])
def test_a_click_brings_the_hand_there_with_the_elbow_on_its_side(arm, place, elbow):
    arm.restart()
    arm.put(theta1=elbow)
    click(arm, place)
    assert np.abs(points(arm.artists["links"])[-1] - place).max() < 1e-6
    assert arm.values["theta1"] * elbow > 0
    assert notice(arm) == ""


@pytest.mark.parametrize("place", [(3, 3), (0.1, 0.2)])
def test_a_click_out_of_reach_is_said_and_moves_nothing(arm, place):
    arm.restart()
    before = arm.values
    click(arm, place)
    assert "0.5 to 3.5 m from the base" in notice(arm)
    assert arm.values == before
