"""Moving pictures of failures, one for the first screen of each lesson.

Each function returns an animation with a number that states the cost of the failure. Where two
motions are compared, the left panel shows the failure.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

import rbcourse as rb
from rbclassroom.figures import lesson13, lesson16
from rbcourse import Array, Curve
from rbcourse.draw import arm, bodies, plane, spheres
from rbcourse.draw.animate import Animation, Update, animate
from rbcourse.draw.drawing import style
from rbcourse.draw.save import COLOURS, PALE

FRAMES = 51
T = np.linspace(0, 1, FRAMES)
"""The times of the frames of a motion that takes the time 1."""
BOTH = "what the program did", "what was meant"
"""The titles of most panels."""
_I, _REST = np.eye(3), np.zeros(3)
_RED = COLOURS["path"]


@contextmanager
def _panels(*kinds: str, foot: float = 0.13) -> Iterator[tuple[Figure, list[Any]]]:
    """Yield a figure in the style of the course, and axes with these Matplotlib projections.

    A fraction `foot` of the height, below the axes, is for notes.
    """
    with style():
        fig = Figure(figsize=(5.8, 2.4), dpi=96)
        fig.set_layout_engine("constrained", rect=(0, foot, 1, 1 - foot))
        axes = [fig.add_subplot(1, len(kinds), k + 1, projection=x) for k, x in enumerate(kinds)]
        yield fig, axes


def _animation(
    fig: Figure,
    lesson: int,
    alt: str,
    moves: Sequence[Update],
    notes: Sequence[Sequence[str]],
    still: int = -1,
    seconds: float = 5.0,
) -> Animation:
    """Return a figure as an animation; `notes` has a text for each frame, panel by panel."""
    texts = [fig.text((k + 0.5) / len(notes), 0.03, "", ha="center") for k in range(len(notes))]

    def update(i: int) -> list[Any]:
        for text, said in zip(texts, notes, strict=True):
            text.set_text(said[i])
        return [artist for move in moves for artist in move(i)] + texts

    name = f"opening{lesson:02}"
    return animate(fig, name, alt, update, len(notes[0]), seconds, still, gif=False)


def _compare(
    draw: Callable[..., Update],
    lesson: int,
    alt: str,
    motions: Any,
    notes: Sequence[Sequence[str]],
    titles: Sequence[str] = BOTH,
    still: int = -1,
    seconds: float = 5.0,
    kind: str = "space",
    **options: Any,
) -> Animation:
    """Return an animation of two motions; ``draw(axes, motion)`` draws each of them."""
    with _panels(kind, kind) as (fig, axes):
        moves = [draw(ax, motion, **options) for ax, motion in zip(axes, motions, strict=True)]
        for ax, title in zip(axes, titles, strict=True):
            ax.set_title(title)
        return _animation(fig, lesson, alt, moves, notes, still, seconds)


def _said(form: str, *values: Any) -> list[list[str]]:
    """Return several series of values as texts."""
    series = ((np.round(x, 6) + 0.0).tolist() for x in values)
    return [[form.format(value).replace("-", "−") for value in x] for x in series]


def _placed(M: Array) -> Array:
    """Return 4 × 4 matrices from 3 × 3 matrices, which need not be rotations."""
    A = np.zeros((len(M), 4, 4))
    A[:, :3, :3], A[:, 3, 3] = M, 1
    return A


def _lengths(places: Array) -> Array:
    """Return the length of a path from its start to each of its points."""
    return np.append(0, np.linalg.norm(np.diff(places, axis=0), axis=1).cumsum())


def _trail(ax: Any, places: Array) -> Update:
    """Draw a dot for each frame, up to the present one, and lines between them."""
    (trail,) = ax.plot([], [], [], ".-", color=_RED, lw=1, ms=5)

    def update(i: int) -> list[Any]:
        trail.set_data_3d(*places[: i + 1].T)
        return [trail]

    return update


def _turning(
    ax: Any,
    M: Array,
    reach: float = 1.1,
    edges: Any = (1.2, 0.8, 0.35),
    target: Array | None = None,
) -> Update:
    """Draw a box that 3 × 3 matrices map, a pointer along its axis x, and the trail of its tip.

    A black dot is at the `target` of the pointer.
    """
    sides, poses = np.asarray(edges), _placed(M)
    box, trail = bodies.draw_box(ax, poses[0], sides), _trail(ax, 1.1 * M[:, :, 0])
    (pointer,) = ax.plot([], [], [], color=_RED, lw=3)
    (dot,) = ax.plot([], [], [], "o", color="black", ms=9)
    bodies.set_turning(ax, reach, zoom=1.45)
    ax.view_init(elev=30, azim=-55)

    def update(i: int) -> list[Any]:
        bodies.move_box(box, poses[i], sides)
        pointer.set_data_3d(*np.outer([0, 1.1], M[i, :, 0]).T)
        if target is not None:
            dot.set_data_3d(*1.1 * target[i, :, None])
        return [box, pointer, dot, *trail(i)]

    return update


def _flying(ax: Any, poses: Array, edges: Array, view: Sequence[float], zoom: float) -> Update:
    """Draw a box that moves in space, its goal, and the trail of its centre."""
    goal, box = (bodies.draw_box(ax, poses[-1], edges) for _ in range(2))
    goal.set(colours=["none"] * 7, edgecolor=PALE)
    places, margin = poses[:, :3, 3], edges.max() / 2
    trail, low, high = _trail(ax, places), places.min(axis=0) - margin, places.max(axis=0) + margin
    bodies.draw_ground(ax, low, high)
    ax.fit(low, high, zoom)
    ax.view_init(*view)

    def update(i: int) -> list[Any]:
        bodies.move_box(box, poses[i], edges)
        return [box, *trail(i)]

    return update


def _growing(ax: Any, t: Array, curves: Mapping[str, Array]) -> Update:
    """Draw curves over time, each in the colour that is its name, up to the present frame."""
    lines = [ax.plot([], [], color=colour, lw=1.5)[0] for colour in curves]
    ax.set(xlim=(t[0], t[-1]), xlabel="time (s)")

    def update(i: int) -> list[Any]:
        seen = 1 + i * (len(t) - 1) // (FRAMES - 1)
        for line, values in zip(lines, curves.values(), strict=True):
            line.set_data(t[:seen], values[:seen])
        return lines

    return update


def gripper_that_flips() -> Animation:
    """Lesson 0: a gripper turns the long way round; the number is its turn in degrees."""
    q0, q1 = rb.quaternion_from_matrix(rb.exp_so3([[0, 0, 2.9], [0, 0, 3.4]]))
    blend = rb.quaternion.project_quaternion(q0 + T[:, None] * (q1 - q0))
    motions = [rb.matrix_from_quaternion(q) for q in (blend, rb.slerp(q0, q1, T))]
    steps = [rb.angle_between(R[:-1], R[1:]) for R in motions]
    turned = [np.degrees(np.append(0, np.cumsum(x))) for x in steps]
    far, near = (f"{x[-1]:.0f}°" for x in turned)
    alt = f"A gripper turns by {far} to an orientation that is only {near} away."
    return _compare(_turning, 0, alt, motions, _said("turned by {:.0f}°", *turned))


def car_that_slides() -> Animation:
    """Lesson 1: a car slides; the number is the angle from its nose to its way in degrees."""
    goal = [5, 2.5, np.pi / 2]
    wrong = rb.planar.interpolate_planar([0, 0, 0], goal, FRAMES - 1)
    straight, bend = [2.5 / 20, 0, 0], [2.5 * np.pi / 60, 0, np.pi / 60]  # in one frame
    plan = 20 * [(straight, 1)] + 30 * [(bend, 1)]
    right = rb.planar.propagate_planar([0, 0, 0], plan, frame="body")
    slip = np.degrees(np.abs(wrong[:, 2] - np.arctan2(goal[1], goal[0])))
    alt = f"A car slides sideways: it moves at up to {slip.max():.0f}° to its nose."
    notes = _said("moves at {:.0f}° to its nose", slip, 0 * slip)
    titles = BOTH[0], "what a car can do"
    return _compare(_car, 1, alt, [wrong, right], notes, titles, kind="rectilinear")


def _car(ax: Any, path: Array) -> Update:
    """Draw a car that moves in the plane."""
    update = plane.moving_route(ax, path, 1.2, [0, 17, 34, -1])
    ax.set(xlim=(-0.8, 5.7), ylim=(-0.7, 3.2))
    ax.set_axis_off()
    return update


def hand_that_hits_a_glass() -> Animation:
    """Lesson 2: the hand of an arm hits a glass; the number is the length of its path in m."""
    ends = np.radians([[-20, 20], [160, 120]])
    wrong = rb.arm.interpolate_joints(ends[0], ends[1], FRAMES - 1)
    tips = rb.arm.arm_forward_kinematics(wrong).joints[:, -1]
    line = tips[0] + T[:, None] * (tips[-1] - tips[0])
    right = np.unwrap(rb.arm.arm_inverse_kinematics(line)[:, 0], axis=0)
    covered = [_lengths(x) for x in (tips, line)]
    far, near = (f"{x[-1]:.1f} m" for x in covered)
    alt = f"The hand of an arm hits a glass: its path is {far} long instead of {near}."
    notes = _said("the hand covers {:.1f} m", *covered)
    place = tips[FRAMES // 2]
    return _compare(_arm, 2, alt, [wrong, right], notes, kind="rectilinear", place=place)


def _arm(ax: Any, path: Array, place: Array) -> Update:
    """Draw an arm that moves, and a glass at a place, which becomes red when the hand hits it."""
    move = arm.moving_arm(ax, path, [0, -1])
    tips = rb.arm.arm_forward_kinematics(path).joints[:, -1]
    hit = np.linalg.norm(tips - place, axis=1) < 0.3
    glass = ax.add_patch(Circle((place[0], place[1]), 0.3, ec="black", zorder=5))
    ax.text(place[0], place[1] - 0.9, "glass", ha="center")
    ax.set(ylim=(-2.3, 3.8))
    ax.set_axis_off()

    def update(i: int) -> list[Any]:
        glass.set_facecolor(_RED if hit[: i + 1].any() else "white")
        return [*move(i), glass]

    return update


def camera_that_loses_its_target() -> Animation:
    """Lesson 3: a camera loses its target; the number is its largest error in degrees."""
    t, limit = np.linspace(0, 4, 501), np.radians(60)  # s, rad/s
    wanted = rb.exp_so3(-np.pi / 4 * t[:, None] * _I[1]) @ rb.exp_so3(-np.radians(1) * _I[2])
    angles = np.unwrap(rb.zyx_from_matrix(wanted), axis=0)
    for i, step in enumerate(limit * np.diff(t), start=1):
        angles[i] = np.clip(angles[i], angles[i - 1] - step, angles[i - 1] + step)
    motions = [rb.matrix_from_zyx(angles)[::10], wanted[::10]]
    off = np.degrees(rb.angle_between(*motions))
    alt = f"A camera loses its target, which passes overhead: it is up to {off.max():.0f}° off."
    look: Any = {"still": int(off.argmax()), "seconds": 4.0, "target": motions[1][:, :, 0]}
    return _compare(_turning, 3, alt, motions, _said("off by {:.0f}°", off, 0 * off), **look)


def box_that_grows() -> Animation:
    """Lesson 4: a box in a simulation grows; the number is its growth in percent."""
    steps = np.linalg.matrix_power(_I + rb.hat_so3([0.015, -0.04, 0.025]), 8)
    wrong, repaired = [_I], [_I]
    for _ in range(FRAMES - 1):
        wrong.append(wrong[-1] @ steps)
        repaired.append(rb.project_so(repaired[-1] @ steps))
    motions = np.array([wrong, repaired])
    grown = 100 * np.linalg.norm(motions, 2, axis=(2, 3)) - 100
    alt = f"A box in a simulation grows by {grown[0, -1]:.0f} % in {8 * (FRAMES - 1)} steps."
    notes, titles = _said("grown by {:.0f} %", *grown), (BOTH[0], "with repairs")
    return _compare(_turning, 4, alt, motions, notes, titles, reach=1.6)


def spray_robot() -> Animation:
    """Lesson 5: most paint is near the poles; the number is the share of dots there in percent."""
    samplers = rb.sampling.sample_rotation_naive, rb.sample_rotation
    dots = [sample(1000, rng=40)[:, :, 0] for sample in samplers]  # directions of a nozzle
    seen, height = 1 + np.arange(FRAMES) * 999 // (FRAMES - 1), np.cos(np.radians(30))
    shares = [100 * np.cumsum(np.abs(x[:, 2]) > height)[seen - 1] / seen for x in dots]
    where = f"within 30° of a pole, where {100 - 100 * height:.0f} % of the area is"
    alt = f"A robot sprays dots on a ball: {shares[0][-1]:.0f} % of them are {where}."
    notes, titles = _said("{:.0f} % near the poles", *shares), ("three random angles", "uniform")
    return _compare(_ball, 5, alt, dots, notes, titles, seen=seen)


def _ball(ax: Any, dots: Array, seen: Array) -> Update:
    """Draw a ball with circles at 30° from its poles; a frame shows the first `seen` dots."""
    spheres.draw_sphere(ax)
    ax.view_init(elev=45, azim=-60)
    turn = np.linspace(0, 2 * np.pi, 49)
    for angle in np.radians([30, 150]):
        ring = np.sin(angle) * np.array([np.cos(turn), np.sin(turn)])
        ax.plot(*ring, np.cos(angle), color="black", lw=1.5)
    (paint,) = ax.plot([], [], [], "o", ms=3, mew=0, color=_RED)

    def update(i: int) -> list[Any]:
        paint.set_data_3d(*dots[: seen[i]].T)
        return [paint]

    return update


def box_that_shrinks() -> Animation:
    """Lesson 6: a box shrinks while it turns; the number is its least width in percent."""
    goal = rb.exp_so3([0, 0, np.radians(150)])
    line = _I + T[:, None, None] * (goal - _I)
    width = 100 * np.linalg.svd(line, compute_uv=False)[:, -1]
    alt = f"A box that should only turn by 150° shrinks to {width.min():.0f} % of its width."
    motions, titles = [line, rb.geodesic(_I, goal)(T)], ("straight line of matrices", "rotations")
    notes = _said("{:.0f} % of its width", width, 100 + 0 * width)
    return _compare(_turning, 6, alt, motions, notes, titles, FRAMES // 2)


def wrench_that_leaves_its_bolt() -> Animation:
    """Lesson 7: a nut leaves its bolt sideways; the number is its largest distance in cm."""
    hand, turn = rb.pose_from_coordinates([[0, 0, 0, 0.3, 0, 0], [0, 0, np.radians(150), 0, 0, 0]])
    curves = [join(hand, turn @ hand) for join in (rb.geodesic, rb.screw)]
    nuts = [curve(T) @ rb.inverse_se3(hand) for curve in curves]
    off = [100 * np.linalg.norm(A[:, :3, 3], axis=1) for A in nuts]
    alt = f"A wrench leaves its bolt: the nut is up to {off[0].max():.0f} cm beside the bolt."
    return _compare(_wrench, 7, alt, nuts, _said("{:.0f} cm off the bolt", *off), still=FRAMES // 2)


def _wrench(ax: Any, nuts: Array) -> Update:
    """Draw a bolt, a nut with a handle that moves, and the trail of the hand."""
    foot = rb.pose_from_components(_I, [0, 0, 0.06])
    bolt = bodies.draw_box(ax, foot, np.array([0.04, 0.04, 0.06]))
    bolt.set(colours=["0.5"] * 7)
    nut, edges = bodies.draw_box(ax, nuts[0], 0.1), np.array([0.1, 0.1, 0.05])
    (handle,) = ax.plot([], [], [], color=COLOURS["z"], lw=7)
    ends = nuts @ np.array([[0.05, 0, 0, 1], [0.3, 0, 0, 1]]).T
    trail = _trail(ax, ends[:, :3, 1])
    ax.fit([-0.3, -0.27, -0.05], [0.32, 0.33, 0.1], zoom=1.5)
    ax.view_init(elev=50, azim=-90)

    def update(i: int) -> list[Any]:
        bodies.move_box(nut, nuts[i], edges)
        handle.set_data_3d(*ends[i, :3])
        return [nut, handle, *trail(i)]

    return update


def book_that_turns_over() -> Animation:
    """Lesson 8: a free book turns over; the number is the time of its first turn in s."""
    edges, t = np.array([0.20, 0.13, 0.03]), np.linspace(0, 5.9, 60)  # m, s
    J, spins = edges @ edges - edges**2, np.array([[0.2, 4, 0.2], [0.2, 0.2, 4]])
    axis = np.cross(J * spins, _I[2])  # this turn makes the angular momentum vertical
    sine = np.linalg.norm(axis, axis=1, keepdims=True)
    upright = rb.exp_so3(np.arctan2(sine, (J * spins)[:, 2:]) * axis / sine)
    R, _ = rb.connection.geodesic_flow(np.diag(J), upright, spins, t)
    i = int((R[:, 0, 2, 1] < 0).argmax())
    over = np.interp(0, R[[i, i - 1], 0, 2, 1], t[[i, i - 1]])
    alt = f"A book that spins about its middle axis turns over after {over:.1f} s, without torque."
    titles, notes = ("about one axis", "about another axis"), _said("{:.1f} s", t, t)
    notes[0][i:] = [f"{said}, turned over at {over:.1f} s" for said in notes[0][i:]]
    motions = R.swapaxes(0, 1)
    return _compare(_book, 8, alt, motions, notes, titles, i + 9, seconds=6.0, edges=edges)


def _book(ax: Any, R: Array, edges: Array) -> Update:
    """Draw a book that turns; one end of its middle axis is orange, and the other end is green."""
    reach, page = np.full(3, 0.5 * np.linalg.norm(edges)), "#E6F0FB"
    book = bodies.draw_box(ax, _placed(R)[0], edges)
    book.set(colours=[page, COLOURS["x"], page, page, COLOURS["y"], page, COLOURS["z"]])
    ax.fit(-reach, reach, zoom=1.5)
    ax.view_init(elev=30, azim=-55)

    def update(i: int) -> list[Any]:
        bodies.move_box(book, _placed(R)[i], edges)
        return [book]

    return update


def _costly(lesson: int, alt: str, curves: Mapping[str, Curve], good: str, still: int) -> Animation:
    """Return an animation of two curves on SO(3), with the ratio of their costs."""
    ratio = np.divide(*map(rb.acceleration_cost, curves.values()))
    notes = [FRAMES * [f"costs {ratio:.0f} times as much"], FRAMES * [good]]
    alt = f"{alt} It {notes[0][0]} as another motion between the same ends."
    motions = [curve(T) for curve in curves.values()]
    return _compare(_turning, lesson, alt, motions, notes, [*curves], still)


def turn_that_snaps() -> Animation:
    """Lesson 9: a gripper snaps round; the number is its cost over the least cost."""
    ends = _I, rb.exp_so3([0, 0, np.radians(170)]), _REST, _REST
    curves = {"projected cubic": rb.projected_cubic(*ends)}
    curves["least acceleration"] = rb.minimum_acceleration(*ends)
    alt = "A motion that turns a gripper by 170° snaps round in the middle."
    return _costly(9, alt, curves, "turns smoothly", 27)


def cube_that_comes_from_another_side() -> Animation:
    """Lesson 10: a cube comes from another side; the number is its largest distance in m."""
    A0, A1 = rb.pose_from_coordinates([6 * [0.0], [np.pi / 6, 2 * np.pi / 3, np.pi / 2, 8, 10, 12]])
    w0, w1, d0_dot, d1_dot = np.array([[1.0, 2, 3], [2, 1, 1], [1, 1, 1], [20, 0, 20]])
    S0, S1 = rb.twist_from_rates([A0, A1], [w0, w1], [d0_dot, d1_dot])
    wrong = np.concatenate([w1, d1_dot])
    motions = [rb.minimum_acceleration(A0, A1, S0, S)(T) for S in (wrong, S1)]
    off = np.linalg.norm((motions[0] - motions[1])[:, :3, 3], axis=1)
    alt = f"A cube comes from another side than was meant, and is up to {off.max():.1f} m off."
    notes = _said("off by {:.1f} m", off, 0 * off)
    look: Any = {"edges": 3 * np.ones(3), "view": (20, -22), "zoom": 1.3}
    return _compare(_flying, 10, alt, motions, notes, still=int(off.argmax()), **look)


def turn_that_goes_back() -> Animation:
    """Lesson 11: a gripper turns back; the number is its cost over that of a Bézier curve."""
    ends = _I, rb.exp_so3([0, 0, np.radians(170)]), [0, 0, -3], [0, 0, -3]
    curves = {"exponential cubic": rb.closed_forms.exponential_cubic(*ends)}
    curves["Bézier"] = rb.closed_forms.bezier(*ends)
    alt = "A motion of a gripper brakes, turns back and brakes again."
    return _costly(11, alt, curves, "keeps turning", -1)


def solver_at_a_local_minimum() -> Animation:
    """Lesson 12: a solver finds a local minimum; the number is its cost over the least known."""
    turn = np.radians(135) * np.array([1, 1, 0]) / np.sqrt(2)
    ends = _I, rb.exp_so3(turn), [0, 0, 4], [-4, 0, 0]
    curves = {"what the solver found": rb.optimum.stationary(rb.projected_cubic(*ends))}
    curves["the best known motion"] = rb.minimum_acceleration(*ends)
    alt = "A solver finds a motion that is only a local minimum."
    return _costly(12, alt, curves, "the least known cost", -1)


def book_taken_for_a_ball() -> Animation:
    """Lesson 13: a book turns as if it were a ball; the number is the added torque in percent."""
    edges, turn = np.array([0.30, 0.20, 0.03]), np.radians(150) * np.ones(3) / np.sqrt(3)
    book, ends = rb.Body.box(edges), (_I, rb.exp_so3(turn), _REST, _REST)
    curves = rb.minimum_acceleration(*ends), rb.minimum_torque(*ends, body=book)
    ratio = np.divide(*(rb.torque_cost(curve, body=book) for curve in curves))
    torque = [np.linalg.norm(lesson13.torques(c, book.inertia, T), axis=1) for c in curves]
    titles = "as if it were a ball", "as a book"
    more = f"costs {100 * ratio - 100:.0f} % more torque"
    alt = f"A book that is turned as if it were a ball {more} than at best."
    with _panels("space", "space", foot=0.22) as (fig, axes):
        moves = [_turning(ax, c(T), edges=4 * edges) for ax, c in zip(axes, curves, strict=True)]
        for ax, title in zip(axes, titles, strict=True):
            ax.set_title(title)
        moves.append(_bars(fig, 0.3 * np.array(torque) / np.max(torque)))
        notes = [FRAMES * [more], FRAMES * ["costs the least torque"]]
        return _animation(fig, 13, alt, moves, notes, 34)


def _bars(fig: Figure, lengths: Array) -> Update:
    """Draw bars below two panels; the unit of their lengths is the width of the figure."""
    bars = [Line2D([], [], lw=9, color=_RED) for _ in range(2)]
    for bar in bars:
        fig.add_artist(bar)

    def update(i: int) -> list[Any]:
        for left, bar, length in zip((0.1, 0.6), bars, lengths[:, i], strict=True):
            bar.set_data([left, left + length], [0.17, 0.17])
        return bars

    return update


def camera_that_jolts() -> Animation:
    """Lesson 14: a camera jolts at each mark; the number is the largest jump of ω in rad/s."""
    times, t = np.array([0.0, 1, 2, 4]), np.linspace(0, 4, 401)  # s
    R = rb.matrix_from_zyx(np.radians([[-60, 0, 0], [-10, 40, 0], [50, -40, 30], [90, 20, 0]]))
    curve = rb.chain(times, R, leg=rb.geodesic)
    legs = curve([0.5, 1.5, 3], 1)
    jump = np.linalg.norm(np.diff(legs, axis=0), axis=1).max()
    note = f"angular velocity jumps by up to {jump:.1f} rad/s"
    with _panels("space", "rectilinear") as (fig, (space, ax)):
        w = {COLOURS[x]: part for x, part in zip("xyz", curve(t, 1).T, strict=True)}
        moves = [_turning(space, curve(4 * T)), _growing(ax, t, w)]
        space.set_title("the camera")
        ax.set(ylim=(-1.3, 2), title="angular velocity (rad/s)")
        for x, value in zip("xyz", legs[1], strict=True):
            ax.text(1.5, value + 0.1, f"${x}$", color=COLOURS[x], ha="center")
        alt = f"A camera jolts at each mark: its {note}."
        return _animation(fig, 14, alt, moves, [FRAMES * [f"The {note}"]], seconds=4.0)


def tool_at_one_rate() -> Animation:
    """Lesson 15: a tool is slow everywhere; the number is its time over that of the fastest."""
    stops = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [-1, 1, 0]]
    poses = rb.pose_from_components(rb.exp_so3(np.outer([0, 0, 2, 2, 2], _I[2])), stops)
    limits: Any = {"angular_speed": 2, "speed": 3, "angular_acceleration": 4.8, "acceleration": 8}
    path = rb.projected_spline(np.arange(5.0), poses)
    used, fastest = rb.limits_used(path, **limits), rb.fastest(path, **limits)
    even = 4 * max(x if name.endswith("speed") else x**0.5 for name, (x, _) in used.items())
    slow, fast = even * T, np.minimum(even * T, fastest.domain[1])
    ratio = f"{even / fastest.domain[1]:.1f} times as long"
    alt = f"A tool that moves at one rate takes {ratio} as with the fastest timing."
    notes, titles = _said("{:.1f} s", slow, fast), (f"one rate: {ratio}", "the fastest timing")
    look: Any = {"edges": np.array([0.5, 0.3, 0.15]), "view": (30, -70), "zoom": 1.35}
    motions, still = [path(4 * T), fastest(fast)], int((slow > fast).argmax())
    return _compare(_flying, 15, alt, motions, notes, titles, still, even, **look)


def gripper_that_shakes() -> Animation:
    """Lesson 16: a gripper repeats noise; the number is the error of ω' in rad/s²."""
    hand, noise = lesson16.hand(), np.random.default_rng(16).normal(scale=0.01, size=(401, 3))
    times, t = np.linspace(0, 4, 401), np.linspace(0, 4, 801)  # s
    spline = rb.projected_spline(times, hand(times) @ rb.exp_so3(noise))
    a, needed = spline(t, 2), hand(t, 2)
    wrong, most = (np.linalg.norm(x, axis=1).max() for x in (a - needed, needed))
    note = f"wrong by up to {wrong:.0f} rad/s²; the hand needs at most {most:.1f}"
    with _panels("space", "rectilinear") as (fig, (space, ax)):
        curves = {_RED: np.linalg.norm(a, axis=1), "black": np.linalg.norm(needed, axis=1)}
        moves = [_turning(space, spline(4 * T)), _growing(ax, t, curves)]
        space.set_title("the gripper")
        ax.set(ylim=(0, 2300), title="angular acceleration (rad/s²)")
        alt = f"A gripper repeats a recording. Its angular acceleration is {note}."
        return _animation(fig, 16, alt, moves, [FRAMES * [note]], seconds=4.0)


def camera_that_turns_back() -> Animation:
    """Lesson 17: a camera turns back between two marks; the number is this turn in degrees."""
    times, t = np.array([0.0, 3, 5, 9]), 5 + 4 * T  # s
    R = rb.matrix_from_zyx(np.radians([[0, 0, 0], [50, -10, 15], [140, 5, 20], [230, 0, 0]]))
    angles = rb.zyx_from_matrix(R)  # in (−180°, 180°]
    blend = rb.matrix_from_zyx(np.stack([np.interp(t, times, x) for x in angles.T], axis=-1))
    motions = [blend, rb.projected_spline(times, R, "rest")(t)]
    yaw = [np.degrees(np.unwrap(rb.zyx_from_matrix(R)[:, 0])) for R in motions]
    turned = [x - x[0] for x in yaw]
    back, on = (f"{abs(x[-1]):.0f}°" for x in turned)
    alt = f"A camera turns back by {back} between its last two marks, instead of on by {on}."
    return _compare(_turning, 17, alt, motions, _said("turned by {:.0f}°", *turned), seconds=4.0)
