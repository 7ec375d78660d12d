"""Moving pictures of failures, one for the first screen of each lesson.

Each function returns an animation with a number that states what the failure costs. Where two
motions are compared, the left panel shows the failure.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from numpy.typing import ArrayLike

import rbcourse as rb
from rbclassroom.figures import lesson13, lesson16
from rbcourse import Array, Curve
from rbcourse.draw import arm, bodies, plane, spheres
from rbcourse.draw.animate import Animation, Update, animate
from rbcourse.draw.save import COLOURS, PALE

FRAMES = 50
T = np.linspace(0, 1, FRAMES)
"""The times of the frames of a motion that takes the time 1."""
DID, MEANT = "what the program did", "what was meant"
_I, _REST = np.eye(3), np.zeros(3)
_STYLES = ["default", "rbcourse.rbcourse"]
_RED = COLOURS["path"]


@contextmanager
def _panels(*kinds: str, foot: float = 0.13) -> Iterator[tuple[Figure, list[Any]]]:
    """Yield a figure in the style of the course, and axes with these Matplotlib projections.

    A part `foot` of the height, below the axes, is for notes.
    """
    with plt.style.context(_STYLES):
        fig = Figure(figsize=(7, 2.9), dpi=80)
        fig.set_layout_engine("constrained", rect=(0, foot, 1, 1 - foot))
        axes = [fig.add_subplot(1, len(kinds), k + 1, projection=x) for k, x in enumerate(kinds)]
        yield fig, axes


def _animation(
    fig: Figure,
    lesson: int,
    alt: str,
    moves: Sequence[Update],
    notes: Sequence[Sequence[str]],
    still: int,
    seconds: float = 5.0,
) -> Animation:
    """Return a figure as an animation; `notes` has the texts of each panel, one for each frame."""
    texts = [fig.text((k + 0.5) / len(notes), 0.03, "", ha="center") for k in range(len(notes))]

    def update(i: int) -> list[Any]:
        for text, said in zip(texts, notes, strict=True):
            text.set_text(said[i])
        return [artist for move in moves for artist in move(i)] + texts

    name = f"opening{lesson:02}"
    return animate(fig, name, alt, update, len(notes[0]), seconds, still, gif=False)


def _compare(
    lesson: int,
    alt: str,
    motions: Mapping[str, Array],
    notes: Sequence[Sequence[str]],
    still: int,
    reach: float = 1.1,
) -> Animation:
    """Return an animation of a box that is mapped by two series of 3 × 3 matrices."""
    with _panels("space", "space") as (fig, axes):
        moves = [
            _turning(ax, *motion, reach) for ax, motion in zip(axes, motions.items(), strict=True)
        ]
        return _animation(fig, lesson, alt, moves, notes, still)


def _turning(ax: Any, title: str, M: Array, reach: float = 1.1, target: Any = None) -> Update:
    """Draw a box that is mapped by 3 × 3 matrices, a pointer along its axis x, and a target.

    The dots are the places of the tip of the pointer, one for each frame.
    """
    box = bodies.draw_box(ax, _placed(M)[0], 1)
    pointer = ax.plot([], [], [], color=_RED, lw=3)[0]
    trail = ax.plot([], [], [], ".-", color=_RED, lw=1, ms=5)[0]
    aim = ax.plot([], [], [], "o", color=COLOURS["optimum"], ms=9)[0]
    bodies.set_turning(ax, reach, zoom=1.45)
    ax.view_init(elev=30, azim=-55)
    ax.set_title(title)

    def update(i: int) -> list[Any]:
        bodies.move_box(box, _placed(M)[i], np.array([1.2, 0.8, 0.35]))
        pointer.set_data_3d(*np.outer([0, 1.1], M[i, :, 0]).T)
        trail.set_data_3d(*1.1 * M[: i + 1, :, 0].T)
        if target is not None:
            aim.set_data_3d(*1.1 * target[i, :, None])
        return [box, pointer, trail, aim]

    return update


def _flying(ax: Any, title: str, poses: Array, edges: ArrayLike, places: Array) -> Update:
    """Draw a box that moves in space, its goal, and a dot at its place in each frame.

    The axes show all `places`, shape (n, 3).
    """
    sides = np.asarray(edges, float)
    goal, box = (bodies.draw_box(ax, poses[-1], sides) for _ in range(2))
    goal.set(colours=["none"] * 7, edgecolor=PALE)
    trail = ax.plot([], [], [], ".-", color=_RED, lw=1, ms=5)[0]
    low, high = places.min(axis=0) - 0.6 * sides, places.max(axis=0) + 0.6 * sides
    bodies.draw_ground(ax, low, high)
    ax.fit(low, high, zoom=1.35)
    ax.view_init(elev=25, azim=-60)
    ax.set_title(title)

    def update(i: int) -> list[Any]:
        bodies.move_box(box, poses[i], sides)
        trail.set_data_3d(*poses[: i + 1, :3, 3].T)
        return [box, trail]

    return update


def _growing(ax: Any, t: Array, curves: Mapping[str, Array]) -> Update:
    """Draw curves over time, in these colours, up to the present frame."""
    lines = [ax.plot([], [], color=colour, lw=1.5)[0] for colour in curves]
    ax.set(xlim=(t[0], t[-1]), xlabel="time (s)")

    def update(i: int) -> list[Any]:
        seen = 1 + i * (len(t) - 1) // (FRAMES - 1)
        for line, values in zip(lines, curves.values(), strict=True):
            line.set_data(t[:seen], values[:seen])
        return lines

    return update


def _placed(M: Array) -> Array:
    """Return 4 × 4 matrices from 3 × 3 matrices, which need not be rotations."""
    A = np.zeros((len(M), 4, 4))
    A[:, :3, :3], A[:, 3, 3] = M, 1
    return A


def _said(form: str, values: ArrayLike) -> list[str]:
    """Return values as texts, one for each frame."""
    return [form.format(x + 0.0).replace("-", "−") for x in np.round(values, 6)]


def _costly(
    lesson: int, what: str, curves: Mapping[str, Curve], good: str, still: int
) -> Animation:
    """Return an animation of two curves on SO(3), with the ratio of their costs."""
    cost = np.divide(*(rb.acceleration_cost(curve) for curve in curves.values()))
    said = f"costs {cost:.0f} times as much"
    alt = f"{what}; this {said} as another motion between the same ends."
    motions = {name: curve(T) for name, curve in curves.items()}
    return _compare(lesson, alt, motions, [FRAMES * [said], FRAMES * [good]], still)


def gripper_that_flips() -> Animation:
    """Lesson 0: a gripper turns the long way round; the number is its turn in degrees."""
    q0, q1 = rb.quaternion_from_matrix(rb.exp_so3([[0, 0, 2.9], [0, 0, 3.4]]))
    blend = rb.quaternion.project_quaternion(q0 + T[:, None] * (q1 - q0))
    paths = {DID: blend, MEANT: rb.slerp(q0, q1, T)}
    motions = {name: rb.matrix_from_quaternion(q) for name, q in paths.items()}
    steps = [rb.angle_between(R[:-1], R[1:]) for R in motions.values()]
    turned = [np.degrees(np.append(0, np.cumsum(x))) for x in steps]
    long, short = (f"{x[-1]:.0f}°" for x in turned)
    alt = f"A gripper turns by {long} to an orientation that is only {short} away."
    return _compare(0, alt, motions, [_said("turned by {:.0f}°", x) for x in turned], -1)


def car_that_slides() -> Animation:
    """Lesson 1: a car slides; the number is the angle between its nose and its way in degrees."""
    goal = [5, 2.5, np.pi / 2]
    wrong = rb.planar.interpolate_planar([0, 0, 0], goal, FRAMES - 1)
    straight, bend = [2.5 / 20, 0, 0], [2.5 * np.pi / 58, 0, np.pi / 58]  # in one frame
    plan = 20 * [(straight, 1)] + 29 * [(bend, 1)]
    right = rb.planar.propagate_planar([0, 0, 0], plan, frame="body")
    slip = np.degrees(np.abs(wrong[:, 2] - np.arctan2(goal[1], goal[0])))
    alt = f"A car slides sideways: it moves at up to {slip.max():.0f}° to its nose."
    with _panels("rectilinear", "rectilinear") as (fig, axes):
        shown = [0, 16, 33, -1]
        moves = [plane.moving_route(*x, 1.2, shown) for x in zip(axes, (wrong, right), strict=True)]
        for ax, title in zip(axes, (DID, "what a car can do"), strict=True):
            ax.set(title=title, xlim=(-0.8, 5.7), ylim=(-0.7, 3.2))
            ax.set_axis_off()
        notes = [_said("slides at {:.0f}° to its nose", x) for x in (slip, 0 * slip)]
        return _animation(fig, 1, alt, moves, notes, -1)


def hand_that_hits_a_glass() -> Animation:
    """Lesson 2: the hand of an arm hits a glass; the number is the length of its path in m."""
    ends = np.radians([[-20, 20], [160, 120]])
    wrong = rb.arm.interpolate_joints(*ends, FRAMES - 1)
    tips = rb.arm.arm_forward_kinematics(wrong).joints[:, -1]
    line = tips[0] + T[:, None] * (tips[-1] - tips[0])
    right = np.unwrap(rb.arm.arm_inverse_kinematics(line)[:, 0], axis=0)
    steps = [np.linalg.norm(np.diff(x, axis=0), axis=1) for x in (tips, line)]
    covered = [np.append(0, np.cumsum(x)) for x in steps]
    far, near = (f"{x[-1]:.1f} m" for x in covered)
    alt = f"The hand of an arm hits a glass: its path is {far} long instead of {near}."
    with _panels("rectilinear", "rectilinear") as (fig, axes):
        moves = [arm.moving_arm(*x, [0, -1]) for x in zip(axes, (wrong, right), strict=True)]
        glasses = [Circle(tips[FRAMES // 2], 0.3, fc="white", ec="black", zorder=5) for _ in axes]
        for ax, title, glass in zip(axes, (DID, MEANT), glasses, strict=True):
            ax.set(title=title, ylim=(-2.3, 3.8))
            ax.set_axis_off()
            ax.add_patch(glass)

        def colour(i: int) -> list[Any]:
            glasses[0].set_facecolor(_RED if i >= FRAMES // 2 - 1 else "white")
            return glasses[:1]

        notes = [_said("the hand covers {:.1f} m", x) for x in covered]
        return _animation(fig, 2, alt, [*moves, colour], notes, -1)


def camera_that_loses_its_target() -> Animation:
    """Lesson 3: a camera loses its target; the number is its largest error in degrees."""
    t, limit = np.linspace(0, 4, 491), np.radians(60)  # s, rad/s
    pitch = rb.exp_so3(-np.pi / 4 * t[:, None] * _I[1])
    wanted = pitch @ rb.exp_so3(-np.radians(1) * _I[2])
    angles = np.unwrap(rb.zyx_from_matrix(wanted), axis=0)
    for i, step in enumerate(np.diff(t), start=1):
        low, high = angles[i - 1] - limit * step, angles[i - 1] + limit * step
        angles[i] = np.clip(angles[i], low, high)
    motions = {"what the motors did": rb.matrix_from_zyx(angles)[::10], MEANT: wanted[::10]}
    off = np.degrees(rb.angle_between(*motions.values()))
    alt = f"A camera loses its target, which passes overhead: it is up to {off.max():.0f}° off."
    target = motions[MEANT][:, :, 0]
    with _panels("space", "space") as (fig, axes):
        panels = zip(axes, motions.items(), strict=True)
        moves = [_turning(ax, *motion, target=target) for ax, motion in panels]
        notes = [_said("off by {:.0f}°", x) for x in (off, 0 * off)]
        return _animation(fig, 3, alt, moves, notes, int(off.argmax()), seconds=4.0)


def box_that_grows() -> Animation:
    """Lesson 4: a box in a simulation grows; the number is its growth in percent."""
    factor, M = _I + rb.hat_so3([0.015, -0.04, 0.025]), np.stack([_I, _I])
    kept = [M]
    for _ in range(FRAMES - 1):
        M = M @ np.linalg.matrix_power(factor, 8)
        M = np.stack([M[0], rb.project_so(M[1])])
        kept.append(M)
    grown = 100 * np.linalg.svd(kept, compute_uv=False)[..., 0] - 100
    alt = f"A box in a simulation grows by {grown[-1, 0]:.0f} % in {8 * (FRAMES - 1)} steps."
    motions = dict(zip((DID, "with repairs"), np.swapaxes(kept, 0, 1), strict=True))
    return _compare(4, alt, motions, [_said("grown by {:.0f} %", x) for x in grown.T], -1, 1.6)


def spray_robot() -> Animation:
    """Lesson 5: most paint is near the poles; the number is the share of dots there in percent."""
    samplers = rb.sampling.sample_rotation_naive, rb.sample_rotation
    samples = [sample(1000, rng=40)[:, :, 0] for sample in samplers]  # directions of a nozzle
    counts = np.arange(1, FRAMES + 1) * 1000 // FRAMES
    near = [np.abs(x[:, 2]) > np.cos(np.radians(30)) for x in samples]
    shares = [100 * x.cumsum()[counts - 1] / counts for x in near]
    alt = (
        f"A robot sprays dots on a ball: {shares[0][-1]:.0f} % of them are within 30° of a pole, "
        f"where {100 - 100 * np.cos(np.radians(30)):.0f} % of the area is."
    )
    with _panels("space", "space") as (fig, axes):
        dots = [_ball(*x) for x in zip(axes, ("three random angles", "uniform"), strict=True)]

        def spray(i: int) -> list[Any]:
            for dot, x in zip(dots, samples, strict=True):
                dot.set_data_3d(*x[: counts[i]].T)
            return dots

        notes = [_said("{:.0f} % near the poles", x) for x in shares]
        return _animation(fig, 5, alt, [spray], notes, -1)


def _ball(ax: Any, title: str) -> Any:
    """Draw a ball with circles at 30° from its poles; return dots without places."""
    spheres.draw_sphere(ax)
    ax.view_init(elev=45, azim=-60)
    ax.set_title(title)
    turn, black = np.linspace(0, 2 * np.pi, 49), COLOURS["optimum"]
    for angle in np.radians([30, 150]):
        ring = np.sin(angle) * np.array([np.cos(turn), np.sin(turn)])
        ax.plot(*ring, np.cos(angle), color=black, lw=1.5)
    return ax.plot([], [], [], "o", ms=3, mew=0, color=_RED)[0]


def box_that_shrinks() -> Animation:
    """Lesson 6: a box shrinks while it turns; the number is its least width in percent."""
    goal, t = rb.exp_so3([0, 0, np.radians(150)]), np.linspace(0, 1, 51)
    line = _I + t[:, None, None] * (goal - _I)
    width = 100 * np.linalg.svd(line, compute_uv=False)[:, -1]
    alt = f"A box that should only turn by 150° shrinks to {width.min():.0f} % of its width."
    motions = {"straight line of matrices": line, "rotations": rb.geodesic(_I, goal)(t)}
    notes = [_said("{:.0f} % of its width", x) for x in (width, 100 + 0 * width)]
    return _compare(6, alt, motions, notes, 25)


def wrench_that_leaves_its_bolt() -> Animation:
    """Lesson 7: a nut leaves its bolt sideways; the number is its largest distance in cm."""
    hand, turn = rb.pose_from_coordinates([[0, 0, 0, 0.3, 0, 0], [0, 0, np.radians(150), 0, 0, 0]])
    t, ends = np.linspace(0, 1, 51), (hand, turn @ hand)
    nuts = [curve(*ends)(t) @ rb.inverse_se3(hand) for curve in (rb.geodesic, rb.screw)]
    off = [100 * np.linalg.norm(A[:, :3, 3], axis=1) for A in nuts]
    alt = f"A wrench leaves its bolt: the nut is up to {off[0].max():.0f} cm beside the bolt."
    with _panels("space", "space") as (fig, axes):
        moves = [_wrench(*x) for x in zip(axes, (DID, MEANT), nuts, strict=True)]
        notes = [_said("{:.0f} cm off the bolt", x) for x in off]
        return _animation(fig, 7, alt, moves, notes, 25)


def _wrench(ax: Any, title: str, nuts: Array) -> Update:
    """Draw a bolt, and a nut with a handle that moves."""
    bolt = bodies.draw_box(ax, np.eye(4), np.array([0.04, 0.04, 0.2]))
    bolt.set(colours=["0.6"] * 7)
    handle = rb.pose_from_components(_I, [0.17, 0, 0])
    parts = [(np.eye(4), np.array([0.1, 0.1, 0.05])), (handle, np.array([0.26, 0.04, 0.03]))]
    boxes = [bodies.draw_box(ax, nuts[0], edges) for _, edges in parts]
    trail = ax.plot([], [], [], ".-", color=_RED, lw=1, ms=5)[0]
    ax.fit([-0.25, -0.05, -0.12], [0.25, 0.25, 0.12], zoom=1.75)
    ax.view_init(elev=40, azim=-90)
    ax.set_title(title)

    def update(i: int) -> list[Any]:
        for box, (place, edges) in zip(boxes, parts, strict=True):
            bodies.move_box(box, nuts[i] @ place, edges)
        trail.set_data_3d(*(nuts[: i + 1] @ [0.3, 0, 0, 1])[:, :3].T)
        return [*boxes, trail]

    return update


def book_that_turns_over() -> Animation:
    """Lesson 8: a free book turns over; the number is the time of its first turn in s."""
    edges, t = np.array([0.20, 0.13, 0.03]), np.linspace(0, 5.9, 60)  # m, s
    J, spins = edges @ edges - edges**2, np.array([[0.2, 4, 0.2], [0.2, 0.2, 4]])
    momentum = J * spins / np.linalg.norm(J * spins, axis=1, keepdims=True)
    axis = np.cross(momentum, _I[2])
    sine = np.linalg.norm(axis, axis=1)
    upright = rb.exp_so3((np.arctan2(sine, momentum[:, 2]) / sine)[:, None] * axis)
    R, _ = rb.connection.geodesic_flow(np.diag(J), upright, spins, t)
    height = R[:, 0, 2, 1]
    i = int((height < 0).argmax())
    over = np.interp(0, height[[i, i - 1]], t[[i, i - 1]])
    alt = (
        f"A book that spins about its middle axis turns over after {over:.1f} s, without a torque."
    )
    with _panels("space", "space") as (fig, axes):
        titles = "about the middle axis", "about the shortest axis"
        moves = [_book(*x, edges) for x in zip(axes, titles, R.swapaxes(0, 1), strict=True)]
        clock = _said("{:.1f} s", t)
        notes = [
            [f"{x}, turned over at {over:.1f} s" if k >= i else x for k, x in enumerate(clock)]
        ]
        return _animation(fig, 8, alt, moves, [*notes, clock], i + 6, seconds=6.0)


def _book(ax: Any, title: str, R: Array, edges: Array) -> Update:
    """Draw a book that turns; the end of its middle axis is orange."""
    book, poses = bodies.draw_box(ax, _placed(R)[0], edges), _placed(R)
    book.set(colours=["#E6F0FB", COLOURS["x"], *["#E6F0FB"] * 4, COLOURS["z"]])
    reach = 0.5 * float(np.linalg.norm(edges))
    ax.fit(np.full(3, -reach), np.full(3, reach), zoom=1.5)
    ax.view_init(elev=30, azim=-55)
    ax.set_title(title)

    def update(i: int) -> list[Any]:
        bodies.move_box(book, poses[i], edges)
        return [book]

    return update


def turn_that_snaps() -> Animation:
    """Lesson 9: a gripper snaps round; the number is the cost, divided by the least cost."""
    ends = _I, rb.exp_so3([0, 0, np.radians(170)]), _REST, _REST
    curves = {"projected cubic": rb.projected_cubic(*ends)}
    curves |= {"least acceleration": rb.minimum_acceleration(*ends)}
    what = "A gripper that turns by 170° snaps round in the middle"
    return _costly(9, what, curves, "turns smoothly", 26)


def cube_that_comes_from_another_side() -> Animation:
    """Lesson 10: a cube arrives from another side; the number is its largest distance in m."""
    A0, A1 = rb.pose_from_coordinates([[0] * 6, [np.pi / 6, 2 * np.pi / 3, np.pi / 2, 8, 10, 12]])
    w, d_dot = np.array([[1.0, 2, 3], [2, 1, 1]]), np.array([[1.0, 1, 1], [20, 0, 20]])
    S0, S1 = rb.twist_from_rates([A0, A1], w, d_dot)
    wrong = np.concatenate([w[1], d_dot[1]])
    ways = [rb.minimum_acceleration(A0, A1, S0, S)(T) for S in (wrong, S1)]
    off = np.linalg.norm((ways[0] - ways[1])[:, :3, 3], axis=1)
    alt = f"A cube arrives from another side than was meant: it is up to {off.max():.1f} m off."
    with _panels("space", "space") as (fig, axes):
        places = np.concatenate(ways)[:, :3, 3]
        moves = [
            _flying(*x, 3 * np.ones(3), places) for x in zip(axes, (DID, MEANT), ways, strict=True)
        ]
        notes = [_said("off by {:.1f} m", x) for x in (off, 0 * off)]
        return _animation(fig, 10, alt, moves, notes, int(off.argmax()))


def turn_that_goes_back() -> Animation:
    """Lesson 11: a gripper turns back; the number is the cost, divided by that of a Bézier curve."""
    w = [0, 0, -3]
    ends = _I, rb.exp_so3([0, 0, np.radians(170)]), w, w
    curves = {"exponential cubic": rb.closed_forms.exponential_cubic(*ends)}
    curves |= {"Bézier": rb.closed_forms.bezier(*ends)}
    what = "A gripper brakes, turns back and brakes again"
    return _costly(11, what, curves, "keeps turning", -1)


def solver_at_a_local_minimum() -> Animation:
    """Lesson 12: a solver finds a local minimum; the number is its cost over the least known."""
    diagonal = np.array([1, 1, 0]) / np.sqrt(2)
    ends = _I, rb.exp_so3(np.radians(135) * diagonal), [0, 0, 4], [-4, 0, 0]
    curves = {"what the solver found": rb.optimum.stationary(rb.projected_cubic(*ends))}
    curves |= {"the best known motion": rb.minimum_acceleration(*ends)}
    what = "A solver finds a motion that is only a local minimum"
    return _costly(12, what, curves, "the least known cost", -1)


def book_taken_for_a_ball() -> Animation:
    """Lesson 13: a book turns as if it were a ball; the number is the added torque in percent."""
    edges, turn = np.array([0.30, 0.20, 0.03]), np.radians(150) * np.ones(3) / np.sqrt(3)
    book, ends = rb.Body.box(edges), (_I, rb.exp_so3(turn), _REST, _REST)
    curves = rb.minimum_acceleration(*ends), rb.minimum_torque(*ends, body=book)
    cost = np.divide(*(rb.torque_cost(curve, body=book) for curve in curves))
    torque = [np.linalg.norm(lesson13.torques(c, book.inertia, T), axis=1) for c in curves]
    more = f"costs {100 * cost - 100:.0f} % more torque"
    alt = f"A book that is turned as if it were a ball {more}."
    with _panels("space", "space", foot=0.22) as (fig, axes):
        titles = "as if it were a ball", "least torque"
        moves = [
            _turning(ax, title, c(T)) for ax, title, c in zip(axes, titles, curves, strict=True)
        ]
        bars = [fig.add_artist(Line2D([], [], lw=9, color=_RED)) for _ in axes]

        def show(i: int) -> list[Any]:
            for x, bar, values in zip((0.1, 0.6), bars, torque, strict=True):
                bar.set_data([x, x + 0.3 * values[i] / np.max(torque)], [0.17, 0.17])
            return bars

        notes = [FRAMES * [more], FRAMES * ["costs the least torque"]]
        return _animation(fig, 13, alt, [*moves, show], notes, 0)


def camera_that_jolts() -> Animation:
    """Lesson 14: a camera jolts at each mark; the number is the largest jump of ω in rad/s."""
    times, t = np.array([0.0, 1, 2, 4]), np.linspace(0, 4, 393)  # s
    R = rb.matrix_from_zyx(np.radians([[-60, 0, 0], [-10, 40, 0], [50, -40, 30], [90, 20, 0]]))
    curve = rb.chain(times, R, leg=rb.geodesic)
    legs = curve([0.5, 1.5, 3], 1)
    jump = f"jumps by up to {np.linalg.norm(np.diff(legs, axis=0), axis=1).max():.1f} rad/s"
    alt = f"A camera jolts at each mark: its angular velocity {jump}."
    with _panels("space", "rectilinear") as (fig, axes):
        w = {COLOURS[x]: part for x, part in zip("xyz", curve(t, 1).T, strict=True)}
        moves = [_turning(axes[0], "", curve(4 * T)), _growing(axes[1], t, w)]
        axes[1].set(ylim=(-1.3, 2), title="angular velocity (rad/s)")
        for x, value in zip("xyz", legs[1], strict=True):
            axes[1].text(1.5, value + 0.1, f"${x}$", color=COLOURS[x], ha="center")
        return _animation(fig, 14, alt, moves, [FRAMES * [f"the angular velocity {jump}"]], -1, 4.0)


def tool_at_one_rate() -> Animation:
    """Lesson 15: a tool is slow everywhere; the number is its time over that of the fastest."""
    turned, stops = [0, 0, 2], [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [-1, 1, 0]]
    poses = rb.pose_from_components(rb.exp_so3([_REST, _REST, turned, turned, turned]), stops)
    limits = {"angular_speed": 2, "speed": 3, "angular_acceleration": 4.8, "acceleration": 8}
    path = rb.projected_spline(np.arange(5.0), poses)
    used = rb.limits_used(path, **limits)
    even = 4 * max(x if name.endswith("speed") else x**0.5 for name, (x, _) in used.items())
    timed = rb.fastest(path, **limits)
    slow, fast = even * T, np.minimum(even * T, timed.domain[1])
    ratio = f"{even / timed.domain[1]:.1f} times as long"
    alt = f"A tool that moves at one rate takes {ratio} as with the fastest timing."
    with _panels("space", "space") as (fig, axes):
        edges, ways = np.array([0.5, 0.3, 0.15]), (path(4 * T), timed(fast))
        titles = "one rate", "the fastest timing"
        moves = [
            _flying(*x, edges, ways[0][:, :3, 3]) for x in zip(axes, titles, ways, strict=True)
        ]
        notes = [_said("{:.1f} s", t) for t in (slow, fast)]
        notes[0][-1] += f", {ratio}"
        return _animation(fig, 15, alt, moves, notes, int((slow > fast).argmax()), even)


def gripper_that_shakes() -> Animation:
    """Lesson 16: a gripper repeats noise; the number is the error of ω' in rad/s²."""
    hand, rng, t = lesson16.hand(), np.random.default_rng(16), np.linspace(0, 4, 785)
    times = np.linspace(0, 4, 401)  # s
    measured = hand(times) @ rb.exp_so3(rng.normal(scale=0.01, size=(401, 3)))
    spline = rb.projected_spline(times, measured)
    wrong = np.linalg.norm(spline(times, 2) - hand(times, 2), axis=1).max()
    most = np.linalg.norm(hand(t, 2), axis=1).max()
    alt = f"A gripper shakes: its ω' is wrong by up to {wrong:,.0f} rad/s², needed {most:.1f}"
    with _panels("space", "rectilinear") as (fig, axes):
        curves = {_RED: np.linalg.norm(spline(t, 2), axis=1)}
        moves = [_turning(axes[0], "", spline(4 * T)), _growing(axes[1], t, curves)]
        axes[1].set(ylim=(0, 2300), title="angular acceleration (rad/s²)")
        note = f"wrong by up to {wrong:,.0f} rad/s², where the hand needs at most {most:.1f}"
        return _animation(fig, 16, alt, moves, [FRAMES * [note]], -1, 4.0)


def camera_that_turns_back() -> Animation:
    """Lesson 17: a camera turns back between two marks; the number is this turn in degrees."""
    times, t = np.array([0.0, 3, 5, 9]), 5 + 4 * T  # s
    angles = np.radians([[0, 0, 0], [50, -10, 15], [140, 5, 20], [230, 0, 0]])
    R = rb.matrix_from_zyx(angles)
    blend = np.stack([np.interp(t, times, x) for x in rb.zyx_from_matrix(R).T], axis=-1)
    motions = {DID: rb.matrix_from_zyx(blend), MEANT: rb.projected_spline(times, R, "rest")(t)}
    yaw = [np.degrees(np.unwrap(rb.zyx_from_matrix(R)[:, 0])) for R in motions.values()]
    turned = [x - x[0] for x in yaw]
    back, on = (f"{np.abs(x[-1]):.0f}°" for x in turned)
    alt = f"A camera turns back by {back} between its last two marks, instead of on by {on}."
    return _compare(17, alt, motions, [_said("turned by {:.0f}°", x) for x in turned], -1)
