"""Paths as files: the same poses back, or the line and the reason; read by other parsers too."""

import csv
import re

import numpy as np
import oracles
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

import rbcourse as rb
from rbcourse.files import HEADERS

EPS = np.finfo(float).eps
RNG = np.random.default_rng(111)
N = 40
TIMES = 1305031098.6659 + np.cumsum(10.0 ** RNG.uniform(-6, 3, N))
HALF_TURNS = [oracles.exp_so3(np.pi * e) for e in np.eye(3)]
ROTATIONS = np.stack([*Rotation.random(N - 6, rng=RNG).as_matrix(), *HALF_TURNS, *[np.eye(3)] * 3])
D = RNG.normal(size=(N, 3)) * 10.0 ** RNG.uniform(-9, 9, (N, 1))
POSES = rb.pose_from_components(ROTATIONS, D)
TWISTS = RNG.normal(size=(N, 6)) * 10.0 ** RNG.uniform(-9, 9, (N, 1))
KINDS = {
    "poses and twists": (POSES, TWISTS),
    "poses": (POSES, None),
    "rotations and velocities": (ROTATIONS, TWISTS[:, :3]),
    "rotations": (ROTATIONS, None),
}
FULL = ",".join(HEADERS[True, True])
PLAIN = ",".join(HEADERS[True, False])


@pytest.mark.parametrize(
    ("name", "kind"),
    [("a.csv", kind) for kind in KINDS] + [(f"a.{end}", "poses") for end in ("tum", "txt", "TUM")],
)
def test_a_path_comes_back(tmp_path, name, kind):
    poses, velocities = KINDS[kind]
    rb.write_path(tmp_path / name, TIMES, poses, velocities)
    times, again, twists = rb.read_path(str(tmp_path / name))
    assert np.array_equal(times, TIMES)
    assert np.abs(again[:, :3, :3] - poses[:, :3, :3]).max() < 8 * EPS
    assert np.array_equal(again[:, :3, 3:], poses[:, :3, 3:])
    assert (twists is None) if velocities is None else np.array_equal(twists, velocities)


def test_other_programs_read_a_tum_trajectory(tmp_path):
    """SciPy's quaternions end with the scalar, as those of TUM do."""
    rb.write_path(tmp_path / "path.tum", TIMES, POSES)
    table = np.loadtxt(tmp_path / "path.tum")
    assert np.array_equal(table[:, 0], TIMES)
    got = RigidTransform.from_components(table[:, 1:4], Rotation.from_quat(table[:, 4:]))
    assert np.array_equal(got.translation, POSES[:, :3, 3])
    assert np.abs(got.rotation.as_matrix() - ROTATIONS).max() < 8 * EPS


def test_other_programs_read_the_csv(tmp_path):
    rb.write_path(tmp_path / "path.csv", TIMES, POSES, TWISTS)
    with open(tmp_path / "path.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))

    def columns(name, letters="xyz"):
        return np.array([[float(row[name.replace("*", x)]) for x in letters] for row in rows])

    assert np.array_equal(columns("time [s]", "-")[:, 0], TIMES)
    got = Rotation.from_quat(columns("q* [1]", "wxyz"), scalar_first=True).as_matrix()
    assert np.abs(got - ROTATIONS).max() < 8 * EPS
    assert np.array_equal(columns("* [m]"), POSES[:, :3, 3])
    twists = np.hstack([columns("w* body [rad/s]"), columns("v* body [m/s]")])
    assert np.array_equal(twists, TWISTS)


def test_files_are_plain(tmp_path):
    R = rb.matrix_from_quaternion([[0.6, 0, 0.8, 0], [1, 0, 0, 0]])
    A = rb.pose_from_components(R, [[1, 2, -0.0], [3, 4, 5]])
    rb.write_path(tmp_path / "path.tum", [0, 0.5], A)
    text = (tmp_path / "path.tum").read_bytes().decode("ascii")
    assert re.fullmatch(
        r"# timestamp tx ty tz qx qy qz qw\n"
        r"0\.0 1\.0 2\.0 -?0\.0 0\.0 0\.[78]\d+ 0\.0 0\.[56]\d*\n"
        r"0\.5 3\.0 4\.0 5\.0 0\.0 0\.0 0\.0 1\.0\n",
        text,
    )
    rb.write_path(tmp_path / "path.csv", [2], np.eye(3)[None], [[1, 2, 3]])
    assert (tmp_path / "path.csv").read_bytes().decode("ascii") == (
        "time [s],qw [1],qx [1],qy [1],qz [1],"
        "wx body [rad/s],wy body [rad/s],wz body [rad/s]\n"
        "2.0,1.0,0.0,0.0,0.0,1.0,2.0,3.0\n"
    )


def test_quaternions_go_on_without_a_change_of_sign_and_zeros_have_no_minus(tmp_path):
    """Three turns about an axis: w passes zero, and no component jumps."""
    t = np.linspace(0, 6 * np.pi, 200)
    rb.write_path(tmp_path / "path.csv", t, rb.exp_so3(t[:, None] * [0.6, 0, 0.8]))
    q = np.loadtxt(tmp_path / "path.csv", delimiter=",", skiprows=1)[:, 1:]
    assert q[0, 0] == 1
    assert np.abs(np.diff(q, axis=0)).max() < 0.05
    rb.write_path(tmp_path / "path.csv", [0, 1, 2], rb.exp_so3([[0, 0, 0], [0, 0, 4], [0, 0, 2]]))
    assert "-0.0," not in (tmp_path / "path.csv").read_text("utf-8")


def test_files_of_other_programs_are_read(tmp_path):
    """Comments, blank lines, tabs, four digits; a mark of the byte order, CRLF, blanks, quotes."""
    text = "# ground truth\n# timestamp tx ty tz qx qy qz qw\n\n1305031098.6659\t1 2 3 "
    (tmp_path / "a.txt").write_text(text + "0.6574 0.6126 -0.2949 -0.3248 \n\n", "utf-8")
    times, poses, _ = rb.read_path(tmp_path / "a.txt")
    assert times.tolist() == [1305031098.6659]
    want = Rotation.from_quat([0.6574, 0.6126, -0.2949, -0.3248]).as_matrix()
    assert np.abs(poses[0, :3, :3] - want).max() < 8 * EPS
    (tmp_path / "b.tum").write_text("0 0 0 0 0 0 0 1.0009\n", "utf-8")
    assert np.array_equal(rb.read_path(tmp_path / "b.tum")[1][0], np.eye(4))
    text = "\ufeff" + PLAIN.replace(",", " , ") + '\r\n"0",1, 2 ,3,1,0,0,0\r\n\r\n'
    (tmp_path / "a.csv").write_bytes(text.encode())
    pose = rb.read_path(tmp_path / "a.csv")[1][0]
    assert np.array_equal(pose, rb.pose_from_components(np.eye(3), [1, 2, 3]))


GOOD = "0 0 0 0 0 0 0 1\n"
NUMBER = "a finite number wanted, got"
UNIT = "a quaternion of norm 1 wanted, got one of"
COLUMNS = ", line 1: the columns must be time [s], "


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("a.tum", "", ": a pose wanted, the file ends"),
        ("a.tum", "# timestamp tx ty tz qx qy qz qw\n", ": a pose wanted, the file ends"),
        ("a.tum", GOOD + "1 0 0 0 0 0 1\n", ", line 2: numbers wanted: 8, got: 7"),
        ("a.tum", "# x\n\n" + GOOD + "1 0 0 0 0 0 0 1 9\n", ", line 4: numbers wanted: 8, got: 9"),
        ("a.tum", GOOD.replace(" ", ","), ", line 1: numbers wanted: 8, got: 1"),
        ("a.tum", GOOD + GOOD, ", line 2: a time after 0.0 wanted, got 0.0"),
        ("a.tum", "0 0 x 0 0 0 0 1\n", f", line 1, ty: {NUMBER} 'x'"),
        ("a.tum", GOOD + "1 0 0 0 0 0 0 0\n", f", line 2: {UNIT} 0"),
        ("a.tum", "0 0 0 0 0 0 0 1.0011\n", f", line 1: {UNIT} 1.0011"),
        ("a.tum", GOOD + "\udcff\n", ", line 2: no text in UTF-8"),
        ("a.csv", "", COLUMNS),
        ("a.csv", "0,0,0,0,1,0,0,0\n", COLUMNS),
        ("a.csv", FULL.replace("body", "world") + "\n", COLUMNS),
        ("a.csv", FULL.replace("qw", "qx") + "\n", COLUMNS),
        ("a.csv", PLAIN + "\n", ": a pose wanted, the file ends"),
        ("a.csv", PLAIN + "\n0,0,0,0,1,0,0,0\n\n1,0,0,0,1,0,0,0\n", ", line 3: numbers wanted: 8"),
        ("a.csv", PLAIN + "\n0,0,0,0,1,0,0,0\n0,0,0,0,1,0,0,0\n", ", line 3: a time after 0.0"),
        ("a.csv", PLAIN + "\n0,0,0,0,0,0,0,0\n", f", line 2: {UNIT} 0"),
    ],
)
def test_a_bad_file_gives_the_line_and_the_reason(tmp_path, name, text, reason):
    file = tmp_path / name
    file.write_bytes(text.encode(errors="surrogateescape"))
    with pytest.raises(ValueError, match=f"^{re.escape(f'{file}{reason}')}"):
        rb.read_path(file)


TWO = [0, 1]


@pytest.mark.parametrize(
    ("name", "times", "poses", "velocities", "message"),
    [
        ("a.tum", TWO, POSES[:2], TWISTS[:2], r"velocities: TUM has no columns .*\.csv$"),
        ("a.txt", TWO, ROTATIONS[:2], None, r"poses: TUM has no rotations alone; .*\.csv$"),
        (
            "a.dat",
            TWO,
            POSES[:2],
            None,
            r"file: a name .* in \.csv, \.tum or \.txt, got .*dat",
        ),
        ("a", TWO, POSES[:2], None, r"file: a name wanted that ends in"),
        ("a.csv", [1, 0], POSES[:2], None, r"times\[1\] is 0.0, a time after 1.0 is wanted"),
        ("a.csv", [0], POSES[:2], None, r"times, poses: as many of each wanted, got 1 and 2"),
        ("a.csv", TWO, 2 * POSES[:2], None, r"poses\[0\] is no pose \(project_se gives"),
        ("a.csv", TWO, POSES[:2, :2], None, r"poses: shape"),
        ("a.csv", TWO, POSES[:2], TWISTS[:2, :3], r"velocities: shape"),
        ("a.csv", TWO, POSES[:2], TWISTS[:2] * np.nan, r"velocities\[0, 0\] is nan"),
        ("a.csv", [], np.zeros((0, 4, 4)), None, r"times, poses: one or more wanted, got none"),
    ],
)
def test_malformed_paths_are_not_written(tmp_path, name, times, poses, velocities, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        rb.write_path(tmp_path / name, times, poses, velocities)
    assert list(tmp_path.iterdir()) == []


def test_files_of_another_kind_or_none_are_not_read(tmp_path):
    with pytest.raises(ValueError, match=r"^file: a name wanted"):
        rb.read_path(tmp_path / "a.bag")
    with pytest.raises(FileNotFoundError):
        rb.read_path(tmp_path / "a.csv")


def test_of_a_curve_written_at_its_joints_with_velocities_the_same_curve_is_chained(tmp_path):
    t, A = [0, 0.5, 2], rb.pose_from_coordinates(RNG.normal(size=(3, 6)))
    c = rb.chain(t, A)
    rb.write_path(tmp_path / "a.csv", t, c(t), c(t, 1))
    again = rb.chain(*rb.read_path(tmp_path / "a.csv"))
    times = np.linspace(0, 2, 50)
    for order in range(3):
        assert np.abs(again(times, order) - c(times, order)).max() < 1e-12
