"""The four ways between two orientations, and the belt, agree with their definitions."""

import numpy as np
import pytest
from sweeps import assert_box, assert_seen, made, off, points, read_off, reads, sweep

import rbcourse as rb

X, Y, Z = np.eye(3)
BOX = np.array([0.65, 0.4, 0.125])
PANELS = {  # the limits of each picture in pixels, below its name
    "ZYX angles": ((0, 280), (190, 358)),
    "matrix entries": ((280, 560), (190, 358)),
    "quaternions": ((0, 280), (0, 168)),
    "rotation vectors": ((280, 560), (0, 168)),
}


def ways(angles, t):
    """Return the matrices of the four ways between two triples of angles, without quaternions."""
    ends = [rb.exp_so3(a * Z) @ rb.exp_so3(b * Y) @ rb.exp_so3(c * X) for a, b, c in angles]
    (a, b, c), (r0, r1) = angles[0] + t * (angles[1] - angles[0]), map(rb.log_so3, ends)
    turn = rb.log_so3(ends[0].T @ ends[1])
    return ends, {
        "ZYX angles": rb.exp_so3(a * Z) @ rb.exp_so3(b * Y) @ rb.exp_so3(c * X),
        "matrix entries": (1 - t) * ends[0] + t * ends[1],
        "quaternions": ends[0] @ rb.exp_so3(t * turn),
        "rotation vectors": rb.exp_so3((1 - t) * r0 + t * r1),
    }


@pytest.mark.source("RR 2.1", "RR 2.2", "BK 2.5")
def test_four_ways_lead_from_the_start_to_the_goal():
    for v, said, artists in sweep("interpolation", t=0.3):
        angles = np.radians(
            [[v[f"{name}{i}"] for name in ("yaw", "pitch", "roll")] for i in (0, 1)]
        )
        ends, wanted = ways(angles, v["t"])
        apart = np.degrees(rb.angle_between(*ends))
        for way, M in wanted.items():
            box = artists[way]
            if way == "quaternions" and apart > 179.99:  # there are two short arcs
                M = box.corners[:6].mean(axis=1)[:3].T / BOX
                assert off(M @ M.T, np.eye(3)) < 1e-12
                assert np.degrees(rb.angle_between(ends[0], M)) == pytest.approx(180 * v["t"])
            assert_box(box, M, BOX, turned=1e-7)  # half of the digits are lost at half-turns
            path, start, goal, nose = (
                points(artists[f"{way} {part}"]) for part in ("path", "start", "goal", "nose")
            )
            for line, place in ((path, 0), (start, 0), (path, -1), (goal, -1)):
                assert off(line[place], ends[place][:, 0]) < 1e-7
            assert off(nose, np.outer([0.65, 1], M[:, 0])) < 1e-7
            assert_seen(box.axes, np.concatenate([path, nose, *box.corners]), *PANELS[way])
        assert reads(said["quaternions"], apart)
        assert reads(said["matrix entries"], np.linalg.det(wanted["matrix entries"]))
        t = np.linspace(0, 1, 1001)[:, None]
        blended = rb.matrix_from_zyx(angles[0] + t * (angles[1] - angles[0]))
        travelled = np.degrees(rb.angle_between(blended[:-1], blended[1:]).sum())
        assert reads(said["ZYX angles"], travelled)
        for way in ("ZYX angles", "rotation vectors"):  # no way is shorter than the short arc
            assert float(said[way].split("°")[0]) > apart - 0.51


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
    turns = [four.artists[way].corners[:6].mean(axis=1)[:3].T / BOX for way in PANELS]
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
        (
            90,
            1,
            (
                "turned by 90°",
                "0.71",
                "still twisted by 90°",
                "impossible: the plate would have to",
            ),
        ),
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
