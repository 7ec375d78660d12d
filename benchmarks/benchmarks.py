"""Compare times with other packages: ``.venv/bin/python benchmarks/benchmarks.py``.

Each function of a task prepares N items, and yields methods that do the same with them, ours first.
The run takes about 15 minutes, and writes the CSV, the figure and the README's table.
"""

import csv
import io
import os
import platform
import re
from decimal import ROUND_DOWN, Context
from functools import partial
from importlib.metadata import version
from pathlib import Path
from timeit import Timer, default_timer

import matplotlib.pyplot as plt
import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline, Slerp

import rbcourse as rb
from rbclassroom.figures import FORMS
from rbcourse import textbook
from rbcourse.files import replace_file

try:
    import roma
    import torch
    from toppra import algorithm, constraint, interpolator
except ImportError:
    roma = torch = None

OURS, MOMENTS = "rbcourse", np.linspace(0, 1, 101)
ALONG, E1 = np.pi / 6 * np.array([1, 2, 3]), np.array([1.0, 0, 0])
ENDS = {  # the boundary conditions of the figures of BK
    case: (np.eye(3), rb.exp_so3(ALONG), ALONG, ALONG + k * E1)
    for case, k in (("4a", 0), ("4b", 1), ("4c", 5))
}
ENDS["5"] = np.eye(3), rb.exp_so3(np.pi / 6 * np.array([1, 4, 3])), [1.0, 2, 3], [2.0, 1, 1]


def nearest_rotation(n, rng):
    """Find the rotations nearest to n noisy matrices with det > 0."""
    M = rb.sample_rotation(n, rng=rng) + 0.1 * rng.standard_normal((n, 3, 3))
    M[np.linalg.det(M) <= 0] *= -1
    yield OURS, lambda: rb.project_so(M)
    yield "textbook", lambda: textbook.project_so(M)
    yield "SciPy", lambda: Rotation.from_matrix(M).as_matrix()
    yield "NumPy, SVD alone", lambda: np.linalg.svd(M).U
    if roma:
        tensor = torch.from_numpy(M)
        yield "RoMa", lambda: roma.special_procrustes(tensor)


def geodesic(n, rng):
    """Evaluate a geodesic at n times; making the curve is not timed."""
    R0, t = rb.sample_rotation(rng=rng), rng.random(n)
    R1 = R0 @ rb.exp_so3([1, -1, 1.5])
    ours, both = rb.geodesic(R0, R1), Rotation.from_matrix([R0, R1])
    theirs = Slerp([0, 1], both)
    yield OURS, lambda: ours(t)
    yield "textbook", lambda: textbook.geodesic(R0, R1, t)
    yield "SciPy", lambda: theirs(t).as_matrix()
    if roma:
        slerp = partial(roma.unitquat_slerp, *map(torch.from_numpy, (*both.as_quat(), t)))
        yield "RoMa", lambda: roma.unitquat_to_rotmat(slerp())


def projected_cubic(n, rng):
    """Evaluate a curve with the ends of BK Figure 5, its velocity and acceleration at n times."""
    t, knots, ours = rng.random(n), np.linspace(0, 1, 5), rb.projected_cubic(*ENDS["5"])
    spline = RotationSpline(knots, Rotation.from_matrix(ours(knots)))
    yield OURS, lambda: [*ours.state(t)]
    yield "textbook", lambda: textbook.projected_cubic(*ENDS["5"], t)
    yield "SciPy, another curve", lambda: [spline(t), spline(t, 1), spline(t, 2)]
    for form, make in list(FORMS.items())[1:]:
        yield f"rbcourse, {form}", partial(make(*ENDS["5"]).state, t)


def random_rotations(n, rng):
    """Sample n rotation matrices."""
    yield OURS, lambda: rb.sample_rotation(n, rng=rng)
    yield "textbook", lambda: textbook.sample_rotation(n, rng)
    yield "SciPy", lambda: Rotation.random(n, rng).as_matrix()


def walk(n, rng):
    """Return n times, at 100 Hz, and smooth coordinates of poses, shape (n, 6)."""
    times, knots = np.arange(n) / 100, np.linspace(0, n / 100, 4 + n // 50)
    return times, CubicSpline(knots, rng.normal(0, 0.3, (len(knots), 6)))(times)


def by_scipy(times, poses):
    """Make the curves that are nearest to a projected spline in SciPy."""
    turning = RotationSpline(times, Rotation.from_matrix(poses[:, :3, :3]))
    return turning, CubicSpline(times, poses[:, :3, 3])


def spline_of_poses(n, rng):
    """Evaluate a projected spline of 1,000 poses, with its derivatives, at n times."""
    times, x = walk(1000, rng)
    given, t = (times, rb.pose_from_coordinates(x)), np.linspace(0, times[-1], n + 2)[1:-1]
    motion, theirs, t = rb.projected_spline(*given, "rest"), by_scipy(*given), t.squeeze()
    yield OURS, lambda: motion.state(t)
    yield "SciPy, another curve", lambda: [c(t, k) for c in theirs for k in range(3)]


def recording(n, rng):
    """Make a projected spline through a recording of n poses; smooth the recording; time it."""
    times, x = walk(n, rng)
    poses, noisy = map(rb.pose_from_coordinates, (x, x + rng.normal(0, 1e-3, x.shape)))
    motion, limits = rb.projected_spline(times, poses, "rest"), {"speed": 1, "acceleration": 3}
    yield OURS, lambda: rb.projected_spline(times, poses, "rest")
    yield "SciPy, another curve", lambda: by_scipy(times, poses)
    yield "rbcourse, smoothing", lambda: rb.smoothing_spline(times, noisy)
    yield "rbcourse, fastest timing", lambda: rb.fastest(motion, **limits)


def making(n, rng):
    """Make n projected cubics."""
    ends = *rb.sample_rotation((2, n), rng=rng), *rng.normal(size=(2, n, 3))
    yield OURS, lambda: rb.projected_cubic(*ends)
    yield "rbcourse, Bézier", lambda: rb.closed_forms.bezier(*ends)


def fastest_timing(n, rng):
    """Find the fastest timing of one leg, with limits for each component of the acceleration."""
    leg = rb.geodesic(np.eye(4), rb.exp_se3([0.6, -0.4, 0.5, 0.3, 0.7, -0.2]))
    yield OURS, lambda: rb.fastest(leg, angular_acceleration=3 * [4], acceleration=3 * [3]).duration

    def by_toppra():
        solver = algorithm.TOPPRA(
            [limits], Leg(), gridpoints=np.linspace(0, 1, 1001), solver_wrapper="seidel"
        )
        rate = solver.compute_parameterization(0, 0)[1]
        return np.sum(2 / 1000 / (rate[1:] + rate[:-1]))

    if roma:
        limits = constraint.JointAccelerationConstraint(np.outer([4, 4, 4, 3, 3, 3], [-1, 1]))

        class Leg(interpolator.AbstractGeometricPath):
            dof, path_interval = 6, np.array([0.0, 1.0])

            def __call__(self, s, order=0):
                return leg(s, order) if order else np.zeros((len(s), 6))

        yield "toppra", by_toppra


def one_optimum(n, rng, case):
    """Solve one problem of the paper (BK), and compute 101 rotations; textbook uses `solve_bvp`."""
    yield OURS, lambda: rb.minimum_acceleration(*ENDS[case])(MOMENTS)
    yield "textbook, shooting", lambda: textbook.shoot(*ENDS[case], MOMENTS)
    yield "rbcourse, projected cubic", lambda: rb.projected_cubic(*ENDS[case])(MOMENTS)
    yield "textbook", lambda: textbook.minimum_acceleration(*ENDS[case], MOMENTS)[0]


ALL, SOME = tuple(10**k for k in range(7)), (1, 1000, 10**6)
TASKS = [  # the name of the task, the case, the numbers of items, and the function with its options
    ("nearest rotation", "noisy", ALL, nearest_rotation),
    ("geodesic at N times", "", ALL, geodesic),
    ("projected cubic at N times", "with derivatives", SOME, projected_cubic),
    ("random rotations", "", ALL, random_rotations),
    ("spline of 1,000 poses at N times", "with derivatives", SOME, spline_of_poses),
    ("making N projected cubics", "", (1, 1000, 10**5), making),
    ("motion through a recording of N poses", "100 Hz", (1000, 200_000), recording),
    ("fastest timing", "one leg", (1,), fastest_timing),
    *(("optimum, one problem", case, (1,), one_optimum, case) for case in ENDS),
]

COLUMNS = ("task", "case", "N [1]", "method", "time [s]", "time low [s]", "time high [s]")
COLUMNS += ("times ours [1]", "times ours low [1]", "times ours high [1]", "rounds [1]", "machine")
COLOURS = {OURS: "#0072B2", "textbook": "#000000", "SciPy": "#D55E00", "RoMa": "#009E73"}


def main(tasks=TASKS, folder=Path(__file__).parent, **options):
    """Run tasks, print the results, and write them; `options` are those of `in_turn`."""
    rows, rng, page = [], np.random.default_rng(), folder / "README.md"
    for task, case, sizes, make, *given in tasks:
        for n in sizes:
            methods = dict(make(n, rng, *given))
            times = in_turn(list(methods.values()), **options)
            spreads = np.percentile([times, times / times[:, :1]], [50, 25, 75], axis=1)
            for name, spread in zip(methods, spreads.T, strict=True):
                numbers = [f"{x:.4g}" for x in spread.ravel()]
                rows.append([task, case, str(n), name, *numbers, len(times), machine()])
                print(f"{task}, N = {n}: {name} {numbers[0]} s, {numbers[3]} × ours", flush=True)
    csv.writer(text := io.StringIO(), lineterminator="\n").writerows([COLUMNS, *rows])
    replace_file(folder / "benchmarks.csv", text.getvalue().encode())
    rows = [dict(zip(COLUMNS, row, strict=True)) for row in rows]
    before, _, after = re.split("(?<=<!-- benchmarks -->\n)|(?=<!-- end)", page.read_text("utf-8"))
    replace_file(page, (before + table(rows) + after).encode())
    draw(rows).savefig(picture := io.BytesIO(), metadata={"Software": None})
    replace_file(folder / "benchmarks.png", picture.getvalue())


def in_turn(calls, rounds=9, clock=default_timer):
    """Return seconds per call, shape (rounds, calls); one round if a call takes more than 10 s."""
    timers = [Timer(call, timer=clock) for call in calls]
    first = [timer.autorange() for timer in timers]
    if max(seconds for _, seconds in first) > 10:
        return np.array([[seconds / n for n, seconds in first]])
    pairs = [(timer, n) for timer, (n, _) in zip(timers, first, strict=True)]
    return np.array([[timer.timeit(n) / n for timer, n in pairs] for _ in range(rounds)])


def machine():
    """Return the processor, the number of its threads, and the versions of the packages."""
    file, names = Path("/proc/cpuinfo"), ["numpy", "scipy"]
    known = re.findall(r"model name\s*: (.*)", file.read_text() if file.exists() else "")
    processor = [*known, platform.machine()][0]
    versions = [f"{x} {version(x)}" for x in names + ["roma", "torch", "toppra"] * bool(roma)]
    return "; ".join([processor, f"{os.cpu_count()} threads", *versions])


def table(rows):
    """Return the README's table: for three N, times divided by ours and rounded down."""
    text = "\n| task | N | time divided by ours |\n|---|---|---|\n"
    down = Context(prec=2, rounding=ROUND_DOWN).create_decimal
    for task, case, sizes, *_ in TASKS:
        for n in dict.fromkeys((sizes[0], sizes[len(sizes) // 2], sizes[-1])):
            own = [row for row in rows if [row[x] for x in COLUMNS[:3]] == [task, case, str(n)]]
            told = [f"{down(row['times ours [1]']):f} × {row['method']}" for row in own[1:]]
            text += f"| {task}{case and ', '}{case} | {n:,} | {'; '.join(told)} |\n"
    return text + "\n"


def draw(rows):
    """Return a figure of the time for each item against N."""
    with plt.style.context(["default", "rbcourse.rbcourse"]):
        fig, axes = plt.subplots(3, 2, figsize=(9, 12))
        for ax, task in zip(axes.flat, dict.fromkeys(row["task"] for row in rows), strict=False):
            here = [row for row in rows if row["task"] == task]
            for name in dict.fromkeys(row["method"] for row in here):
                mine = [row for row in here if row["method"] == name]
                n, time = np.array([[float(row[x]) for x in COLUMNS[2:5:2]] for row in mine]).T
                author, *more = name.split(",")
                look = {"color": COLOURS.get(author, "#777777"), "lw": 4 if name == OURS else 1.5}
                ax.plot(n, 1e6 * time / n, "o:" if more else "o-", label=name, **look)
            ax.set(xscale="log", yscale="log", title=task, xlabel="N", ylabel="µs for each")
        lines = {line.get_label(): line for ax in axes.flat for line in ax.lines}
        fig.legend(handles=lines.values(), loc="outside lower center", ncols=3)
    return fig


if __name__ == "__main__":
    plt.switch_backend("Agg")
    main()
