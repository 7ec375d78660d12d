"""Explorers of the plane: a body that follows a plan, and the two-link arm."""

from typing import Any

import numpy as np

import rbcourse as rb
from rbclassroom.explorers import widgets
from rbclassroom.explorers.explorer import Explorer, new_figure, new_line, numbers
from rbclassroom.explorers.names import new_name, put_name
from rbcourse.arm import LINKS, arm_forward_kinematics, arm_inverse_kinematics, interpolate_joints
from rbcourse.draw.arm import show_reach
from rbcourse.draw.plane import draw_body, move_body
from rbcourse.draw.save import COLOURS, PALE

_STEPS = 80
_LASTS = 2.0  # each command, in s
_BODY = 1.3
_INSIDE = np.array([[-6.5, -4.5], [6.5, 4.5]])  # the places of names
_FRAMES = {"world": (COLOURS["z"], "#D6E6F2", "-"), "body": (COLOURS["x"], "none", "--")}
_RATES = {
    "vx": ("vx (m/s)", 1.0, 1.0, 0.1),
    "vy": ("vy (m/s)", 0.0, 1.0, 0.1),
    "omega": ("vθ (°/s)", 45.0, 90.0, 5.0),
}
"""The label, first value, greatest value and step of each velocity of a command."""
_START = np.radians([-20.0, 110.0])
_BESIDE = np.array([0.5, 0.3])
"""The distances of names from the ends of the second link, as shares of its length."""


def planar_explorer() -> Explorer:
    """Return an explorer of a plan, with velocities in the world frame or in the body frame.

    The plan has two commands of two seconds each (RR 3.2, RR (17), RR (18), RR (19)).
    """
    with new_figure() as fig:
        ax = fig.add_axes((0.11, 0.18, 0.88, 0.79))
        ax.set(xlim=(-7.75, 7.75), ylim=(-4.9, 4.9), xlabel="$x$ (m)", ylabel="$y$ (m)")
        ax.set(aspect="equal", xticks=[-5, 0, 5], yticks=[-4, -2, 0, 2, 4])
        artists: dict[str, Any] = {}
        for frame, (colour, fill, ls) in _FRAMES.items():
            look = {"color": colour, "ls": ls}
            artists[f"{frame} plan"] = new_line(ax, **look, lw=1)
            artists[f"{frame} way"] = new_line(ax, **look)
            artists[f"{frame} name"] = new_name(ax, f"{frame} axes", color=colour)
            outline, nose = draw_body(ax, np.zeros(3), _BODY, colour, fill=fill, ls=ls)
            artists |= {f"{frame} outline": outline, f"{frame} nose": nose}
    controls = {
        f"{name}{i}": widgets.slider(f"{nth} {label}", first, -high, high, step)
        for i, nth in enumerate(("1st", "2nd"), start=1)
        for name, (label, first, high, step) in _RATES.items()
    }
    controls["t"] = widgets.stepped("time t (s)", 3.0, 0.0, 2 * _LASTS, 2 * _LASTS / _STEPS)

    def show(t: float, **velocities: float) -> dict[str, str]:
        now, said, places = round(t / (2 * _LASTS) * _STEPS), {}, list[rb.Array]()
        commands = np.reshape(list(velocities.values()), (2, 3)) * [1, 1, np.pi / 180]
        plan = [(each, 2 * _LASTS / _STEPS) for each in commands for _ in range(_STEPS // 2)]
        for frame in _FRAMES:
            path = rb.planar.propagate_planar(np.zeros(3), plan, frame=frame)
            artists[f"{frame} plan"].set_data(*path[:, :2].T)
            artists[f"{frame} way"].set_data(*path[: now + 1, :2].T)
            body = [artists[f"{frame} outline"], artists[f"{frame} nose"]]
            move_body(body, path[now], _BODY)
            x_y, heading = numbers(path[now, :2], 2), numbers(np.degrees(path[now, 2]), 0)
            said[frame] = f"({x_y}) m, heading {heading}°"
            places.append(path[now, :2])
        up = 1.2 if places[0][1] - places[1][1] > -1e-9 else -1.2  # the higher body's name is above
        for frame, (x, y), beside in zip(_FRAMES, places, (up, -up), strict=True):
            put_name(artists[f"{frame} name"], np.clip([x, y + beside], *_INSIDE))
        return said

    return Explorer("A plan of two commands", fig, artists, controls, show, plays="t")


def arm_explorer() -> Explorer:
    """Return an explorer of the two-link arm: set its angles, or click on a goal for its hand.

    A pale arm shows the start, from which both motors run at constant speeds. If you set a goal,
    the arm is shown at the goal (RR 4, RR 4.1, RR (20), RR (21)).
    """
    with new_figure() as fig:
        ax = fig.add_axes((0.15, 0.18, 0.7, 0.77))
        show_reach(ax)
        ax.set(xticks=[-2, 0, 2], yticks=[-2, 0, 2])
        start = arm_forward_kinematics(_START).joints
        ax.plot(*start.T, "o-", color=PALE, lw=4, ms=8)
        ax.text(start[1, 0], start[1, 1] - 0.6, "start", color=COLOURS["reference"], ha="center")
        red, cross = {"color": COLOURS["path"]}, {"marker": "x", "ls": "", "ms": 12, "mew": 3}
        artists: dict[str, Any] = {
            "way": new_line(ax, **red, lw=2.5),
            "goal": new_line(ax, **red, **cross),
            "goal name": new_name(ax, "goal", **red),
            "links": new_line(ax, marker="o", color=COLOURS["z"], lw=5, ms=9),
            "hand name": new_name(ax, "hand", color=COLOURS["z"]),
        }
    controls = {
        "theta0": widgets.slider("shoulder θ₀ (°)", 130.0, -180.0, 180.0, 1.0),
        "theta1": widgets.slider("elbow θ₁ (°)", -60.0, -180.0, 180.0, 1.0),
        "t": widgets.stepped("time t", 0.0, 0.0, 1.0, 0.01),
    }

    def show(theta0: float, theta1: float, t: float) -> dict[str, str]:
        goal = np.radians([theta0, theta1])
        q = _START + t * (goal - _START)
        way = arm_forward_kinematics(interpolate_joints(_START, q, 60)).joints[:, -1]
        joints = arm_forward_kinematics(q).joints
        artists["links"].set_data(*joints.T)
        artists["way"].set_data(*way.T)
        *_, elbow, end = arm_forward_kinematics(goal).joints
        artists["goal"].set_data(*end[:, None])
        put_name(artists["goal name"], end + _BESIDE * (end - elbow)[::-1] * [1, -1])
        put_name(artists["hand name"], joints[-1] + _BESIDE * (joints[-1] - joints[-2]))
        # at the goal both names would overlap
        artists["hand name"].set_text("hand" if np.linalg.norm(end - joints[-1]) > 0.5 else "")
        angles, hand = numbers(np.degrees(q), 1), numbers(joints[-1], 2)
        return {"angles": f"({angles})°", "hand": f"({hand}) m"}

    def point(x: float, y: float) -> dict[str, float]:
        place = ax.transData.inverted().transform((x, y))
        left, right = np.degrees(arm_inverse_kinematics(place, LINKS))
        theta0, theta1 = left if controls["theta1"].value >= 0 else right
        return {"theta0": theta0, "theta1": theta1, "t": 1.0}

    for name in ("theta0", "theta1"):
        controls[name].observe(lambda _: controls["t"].set_trait("value", 1.0), "value")
    return Explorer("The arm", fig, artists, controls, show, plays="t", point=point)
