"""The belt agrees with its definition, and the ways between two orientations differ."""

import numpy as np
import pytest
from sweeps import assert_box, assert_seen, made, off, points, read_off, reads, sweep

import rbcourse as rb

X, Y, Z = np.eye(3)
BOX = np.array([0.65, 0.4, 0.125])
WAYS = "ZYX angles", "matrix entries", "quaternions", "rotation vectors"


def test_the_first_ways_differ_and_the_blended_matrix_is_squashed():
    four = made("interpolation")
    four.restart()
    assert four.values["t"] == 0.5
    assert read_off(four) == {
        "ZYX angles": "301° in all",
        "matrix entries": "not a rotation, determinant 0.39",
        "quaternions": "102° in all",
        "rotation vectors": "271° in all",
    }
    turns = [four.artists[way].corners[:6].mean(axis=1)[:3].T / BOX for way in WAYS]
    zyx, _, short, vectors = turns
    for pair in ((zyx, short), (zyx, vectors), (short, vectors)):
        assert np.degrees(rb.angle_between(*pair)) > 50
    assert off(rb.project_so(turns[1]), short) < 1e-12
    four.put(yaw1=-150.0, pitch1=0.0, roll1=180.0)
    assert read_off(four)["matrix entries"] == "not a rotation, determinant 0.00"
    assert read_off(four)["its box"] == "squashed to a line"


def belt(turn, untwist):
    """Return the wanted cross-sections of the belt: points at x = 0.12, 0 and -0.12."""
    heights = [1.03, *np.linspace(1, 0.28, 37), 0.03]
    shares = [0, *np.linspace(0, 1, 37), 1]
    A, sections = rb.exp_so3(np.pi * untwist * X), []
    for r, share in zip(heights, shares, strict=True):
        half = rb.exp_so3(np.radians(turn) / 2 * share * Z)
        across = np.array([[0.12, 0, r], [0, 0, r], [-0.12, 0, r]])
        sections.append(across @ (half @ A @ half @ A.T).T)
    return np.array(sections)


def drawn(artists):
    """Return the drawn cross-sections of the belt, shape (n, 3, 3)."""
    left, right = np.split(artists["belt"].corners[:-1], 2)
    assert np.array_equal(left[:, 1:3], right[:, [0, 3]])
    above = np.concatenate([left[:, :2], right[:, 1:2]], axis=1)
    below = np.concatenate([left[:, :1:-1], right[:, 2:3]], axis=1)
    assert np.array_equal(above[1:], below[:-1])
    return np.concatenate([above, below[-1:]])


@pytest.mark.source("BK 2.5", "RR 2.2")
def test_the_belt_joins_the_ceiling_to_the_plate():
    for v, said, artists in sweep("double_cover", turn=720.0):
        u, turn = v["untwist"] * (v["turn"] == 720), np.radians(v["turn"])
        sections, R = drawn(artists), rb.exp_so3(turn * Z)
        assert off(sections, belt(v["turn"], u)) < 1e-14
        for end, fixed, height in ((0, np.eye(3), 1.03), (-1, R, 0.03)):
            ends = np.array([[0.12, 0, height], [0, 0, height], [-0.12, 0, height]])
            assert off(sections[end], ends @ fixed.T) < 1e-14
        assert_box(artists["plate"], R, [0.22, 0.15, 0.03], turned=1e-14)
        assert off(points(artists["front"]), np.outer([0.22, 0.396], R[:, 0])) < 1e-14
        q = [np.cos(turn / 2), 0, 0, np.sin(turn / 2)]
        assert reads(said["quaternion"], q)
        path = points(artists["path"])
        assert off(path[0], [1, 0]) < 1e-14
        assert off(path[-1], points(artists["q"])) < 1e-14
        assert off(path[-1], [q[0], q[3]]) < 1e-14
        inside = (1 - np.cos(np.pi * u)) / 2  # the path is a circle through 1
        assert off(np.hypot(path[:, 0] - inside, path[:, 1]), 1 - inside) < 1e-14
        if v["turn"] not in (0, 720):
            assert said["belt"].removeprefix("still ") == f"twisted by {v['turn']:.0f}°"
            assert said["to untwist it"].startswith("impossible: the plate would have to turn")


@pytest.mark.parametrize(
    ("turn", "untwist", "texts"),
    [
        (0, 0, ("as at the start", "1.00", "straight", "not needed: q = 1")),
        (90, 1, ("turned by 90°", "0.71", "still twisted by 90°", "impossible: the plate")),
        (360, 0.5, ("as at the start", "-1.00", "still twisted by 360°", "impossible: the plate")),
        (720, 0, ("as at the start", "1.00", "twisted by 720°", "possible, as q = 1")),
        (720, 0.5, ("as at the start", "1.00", "partly untwisted", "possible, as q = 1")),
        (720, 1, ("as at the start", "1.00", "straight", "possible, as q = 1")),
    ],
)
def test_the_belt_can_be_untwisted_only_after_two_turns(turn, untwist, texts):
    plate = made("double_cover")
    plate.put(turn=float(turn), untwist=float(untwist))
    for text, wanted in zip(read_off(plate).values(), texts, strict=True):
        assert text.startswith(wanted)
    straight = off(drawn(plate.artists), belt(0, 0)) < 1e-14
    assert straight == (read_off(plate)["belt"] == "straight")


def test_the_belt_moves_without_jumps_and_stays_in_sight():
    plate = made("double_cover")
    plate.restart()
    assert plate.values == {"turn": 360, "untwist": 0}
    states = [(turn, 0.0) for turn in plate.steps] + [(720.0, k / 20) for k in range(1, 21)]
    before = belt(0, 0)
    for turn, untwist in states:
        plate.state(turn=turn, untwist=untwist)
        now = drawn(plate.artists)
        # the middle line never meets itself, as its distance from the plate's centre decreases
        assert np.diff(np.linalg.norm(now[:, 1], axis=1)).max() < -0.01
        assert np.abs(now - before).max() < 0.25
        assert_seen(plate.artists["belt"].axes, now, (0, 330), (5, 375))
        before = now
