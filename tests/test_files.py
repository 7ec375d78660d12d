import os
import re

import numpy as np
import oracles
import pytest
from broken_disk import check_all_or_nothing
from scipy.spatial.transform import Rotation

import rbcourse as rb
from rbcourse.files import load_plan, replace_file, save_plan

EPS = np.finfo(float).eps
RNG = np.random.default_rng(111)
N = 40
TIMES = 1305031098.6659 + np.cumsum(10.0 ** RNG.uniform(-6, 3, N))
HALF_TURNS = [oracles.exp_so3(np.pi * e) for e in np.eye(3)]
ROTATIONS = np.stack([*Rotation.random(N - 6, RNG).as_matrix(), *HALF_TURNS, *[np.eye(3)] * 3])
D, TWISTS = (RNG.normal(size=(N, k)) * 10.0 ** RNG.uniform(-9, 9, (N, 1)) for k in (3, 6))
POSES = rb.pose_from_components(ROTATIONS, D)
PLAIN = "time [s],x [m],y [m],z [m],qw [1],qx [1],qy [1],qz [1]"
RATES = ",wx body [rad/s],wy body [rad/s],wz body [rad/s]"
FULL = f"{PLAIN}{RATES},vx body [m/s],vy body [m/s],vz body [m/s]"
PLAN = "vx world [m/s],vy world [m/s],vtheta [rad/s],duration [s]\n"


def test_a_written_path_can_be_read_back(tmp_path):
    for poses, velocities, endings in (
        (POSES, TWISTS, ["csv"]),
        (POSES, None, ["csv", "tum", "txt", "TUM"]),
        (ROTATIONS, TWISTS[:, :3], ["csv"]),
        (ROTATIONS, None, ["csv"]),
    ):
        for file in (tmp_path / f"a.{ending}" for ending in endings):
            rb.write_path(file, TIMES, poses, velocities)
            times, again, twists = rb.read_path(str(file))
            assert np.array_equal(times, TIMES)
            assert np.abs(again[:, :3, :3] - poses[:, :3, :3]).max() < 8 * EPS
            assert np.array_equal(again[:, :3, 3:], poses[:, :3, 3:])
            assert twists is velocities or np.array_equal(twists, velocities)


@pytest.mark.source("RR 3.2", "RR 4.2")
def test_loading_a_saved_plan_restores_every_digit(tmp_path):
    for kind, plan in {
        "world": [(RNG.normal(size=3) * 10.0**k, 10.0**-k) for k in range(-9, 9)],
        "body": [([1, 0, -0.5], 2), ([0.1, 1 / 3, np.pi], 0)],
        "joints": [(RNG.normal(size=5), 0.1), ([0, -0.0, 1e-300, 1e300, 7], 3)],
    }.items():
        save_plan(tmp_path / "plan.csv", plan, kind)
        again = load_plan(str(tmp_path / "plan.csv"), kind)
        assert [(v.tolist(), d) for v, d in again] == [(list(v), d) for v, d in plan]
        save_plan(str(tmp_path / "plan.csv"), [], kind)
        assert load_plan(tmp_path / "plan.csv", kind) == []
    save_plan(tmp_path / "plan.csv", [([1, 0, 0.25], 2)], "world")
    assert (tmp_path / "plan.csv").read_bytes() == f"{PLAN}1.0,0.0,0.25,2.0\n".encode()
    save_plan(tmp_path / "plan.csv", [([1, 0], 2)], "joints")
    text = "v0 [rad/s],v1 [rad/s],duration [s]\n1.0,0.0,2.0\n"
    assert (tmp_path / "plan.csv").read_bytes() == text.encode()


def test_other_programs_read_a_written_path(tmp_path):
    """SciPy and TUM put the scalar last. The signs of quaternions do not jump."""
    tum, csv = tmp_path / "path.tum", tmp_path / "path.csv"
    rb.write_path(tum, TIMES, POSES)
    rb.write_path(csv, TIMES, POSES, TWISTS)
    assert tum.read_bytes().startswith(b"# timestamp tx ty tz qx qy qz qw\n13050")
    assert csv.read_bytes().startswith(FULL.encode() + b"\n13050")
    assert b"\r" not in tum.read_bytes() + csv.read_bytes()
    assert b"-0.0," not in csv.read_bytes()
    tum, table = np.loadtxt(tum), np.loadtxt(csv, delimiter=",", skiprows=1)
    assert table[0, 4] > 0
    assert np.all(np.vecdot(table[1:, 4:8], table[:-1, 4:8]) >= 0)
    assert np.array_equal(table[:, 8:], TWISTS)
    for rows, q in ((tum, tum[:, 4:]), (table, np.roll(table[:, 4:8], -1, axis=1))):
        assert np.array_equal(rows[:, 0], TIMES)
        assert np.array_equal(rows[:, 1:4], POSES[:, :3, 3])
        assert np.abs(Rotation.from_quat(q).as_matrix() - ROTATIONS).max() < 8 * EPS
    rb.write_path(csv, [2], np.eye(3)[None], [[1, 2, 3]])
    header = PLAIN.replace("x [m],y [m],z [m],", "") + RATES
    assert csv.read_bytes() == f"{header}\n2.0,1.0,0.0,0.0,0.0,1.0,2.0,3.0\n".encode()


def test_files_of_other_programs_are_read(tmp_path):
    """Four decimals of a quaternion are enough; spreadsheets write marks, blanks and quotes."""
    (tmp_path / "a.tum").write_text("0 0 0 0 0 0 0 1.0009\n", "utf-8")
    assert np.array_equal(rb.read_path(tmp_path / "a.tum")[1][0], np.eye(4))
    text = "\ufeff" + PLAIN.replace(",", " , ") + '\r\n"0",1, 2 ,3,1,0,0,0\r\n\r\n'
    (tmp_path / "a.csv").write_bytes(text.encode())
    pose = rb.read_path(tmp_path / "a.csv")[1][0]
    assert np.array_equal(pose, rb.pose_from_components(np.eye(3), [1, 2, 3]))
    text = "\ufeff" + PLAN.replace(",", " , ").strip() + '\r\n"1", 2 ,3e0,+.5\r\n-1,0,0,0\r\n\r\n'
    (tmp_path / "plan.csv").write_bytes(text.encode())
    plan = load_plan(tmp_path / "plan.csv", "world")
    assert [[*v, d] for v, d in plan] == [[1, 2, 3, 0.5], [-1, 0, 0, 0]]


GOOD, ROW, MOVE, WHEEL = "0 0 0 0 0 0 0 1\n", "0,0,0,0,1,0,0,0\n", "1,0,0,2\n", "duration [s]\n1\n"
NUMBER = "a finite number is wanted, got"
UNIT = "a quaternion of norm 1 is wanted, got one of"
BAD_FILES = {
    "a.tum": [
        ("# x\n\n" + GOOD + "1 0 0 0 0 0 0 1 9\n", ", line 4: 8 columns are wanted, got 9"),
        (GOOD + GOOD, ", line 2: the time 0 is equal to the time 0 of a row before; skip='rep"),
        ("0 0 x 0 0 0 0 1\n", f", line 1, column 3: {NUMBER} 'x'"),
        ("0 0 0 0 0 0 0 1.0011\n", f", line 1: {UNIT} 1.0011"),
        ("0 0 0 0 0 0 0 1e308\n", f", line 1: {UNIT} inf"),
    ],
    "a.csv": [
        (ROW, ", line 1: 8 columns without names: format='tum' reads"),
        (PLAIN + "\n", ": a pose is wanted, but the file has no line with numbers"),
        (f"{PLAIN}\n{ROW}1,2\n", ", line 3: 8 columns are wanted, got 2"),
    ],
    "world": [
        ("", f", line 1: {PLAN.strip().replace(',', ', ')} are wanted, got "),
        (PLAN.replace("world", "body"), ", line 1: vx world [m/s], "),
        ("\n" + PLAN, ", line 1: vx world [m/s], "),
        (PLAN + "1,0,0,2,\n", ", line 2: 4 numbers are wanted, got 5"),
        (f"{PLAN}{MOVE}\n{MOVE}", ", line 3: 4 numbers are wanted, got 0"),
        (PLAN.replace("\n", "\r") + "1,0,0,2\r1;0;0;2\r", ", line 3: 4 numbers are wanted, got 1"),
        *(
            (f"{PLAN}1,0,0,1\n1,{cell},0,2\n", f", line 3, vy world [m/s]: {NUMBER} {cell[:40]!r}")
            for cell in ("", "x", "nan", "1e999", "1_0", "١", "1\xa0", "0x1", "x" * 90)
        ),
        (PLAN + "1,0,0,-2\n", ", line 2: duration is -2.0, a duration from 0 up is wanted"),
        (f'{PLAN}{MOVE}"{MOVE}{MOVE}', ", line 3: unexpected end of data"),
        (f"{PLAN}{MOVE}\udcff,0,0,2\n", ", line 3: the text is not in UTF-8"),
        (f"{PLAN}{MOVE}\udcff,0,0,2\n".replace("\n", "\r"), ", line 3: the text is not in UTF-8"),
    ],
    "joints": [
        (WHEEL, ", line 2: a velocity is wanted, but there is no column for it"),
        ("", ", line 1: duration [s] are wanted, got ''"),
    ],
}


@pytest.mark.parametrize("kind", BAD_FILES)
def test_errors_in_files_state_the_line_and_the_reason(tmp_path, kind):
    file = tmp_path / (kind if "." in kind else "plan.csv")
    for text, reason in BAD_FILES[kind]:
        file.write_bytes(text.encode(errors="surrogateescape"))
        with pytest.raises(ValueError, match=f"^{re.escape(f'{file}{reason}')}"):
            rb.read_path(file) if "." in kind else load_plan(file, kind)


TWO, MOVES = [0, 1], TWISTS[:2]
REFUSED = {
    rb.write_path: [
        ("a.tum", (TWO, POSES[:2], MOVES), r"velocities: TUM has no columns .*\.csv$"),
        ("a.txt", (TWO, ROTATIONS[:2]), r"path: TUM cannot store rotations alone; .*csv$"),
        ("a.dat", (TWO, POSES[:2]), r"file: a name .* in \.csv, \.tum or .*, got .*dat"),
        ("a.csv", ([1, 0], POSES[:2]), r"times\[1\] is 0.0, a time after 1.0 is wanted"),
        ("a.csv", ([0], POSES[:2]), "times, path: equal numbers are wanted, got 1 and 2"),
        ("a.csv", ([], POSES[:0]), "times, path: one or more are wanted, got n"),
        ("a.csv", (TWO, 2 * POSES[:2]), r"path\[0\] is not a pose: its last row is"),
        ("a.csv", (TWO, POSES[:2, :2]), "path: shape"),
        ("a.csv", (TWO, POSES[:2], MOVES[:, :3]), "velocities: shape"),
        ("a.csv", (TWO, POSES[:2], MOVES * np.nan), r"velocities\[0, 0\] is nan"),
    ],
    save_plan: [
        ("a.csv", ([([1, 0], 2)], "world"), r"plan\[0\] velocity: shape"),
        ("a.csv", ([([1, 0], 2), ([1], 2)], "joints"), r"plan\[1\] velocity: "),
        ("a.csv", ([([1, 0, 0], -2)], "body"), r"plan\[0\] duration is -2"),
        ("a.csv", (3, "joints"), "plan: a list of"),
        ("a.csv", ([], "arm"), "kind: one of 'world', 'body', 'joints' is wanted, got 'arm'"),
        ("a.csv", ([], ["world"]), r"kind: one of .* is wanted, got \['world'\]"),
    ],
}


@pytest.mark.parametrize("function", REFUSED)
def test_bad_arguments_change_no_file(tmp_path, function):
    for name, arguments, message in REFUSED[function]:
        for file in (tmp_path / name, tmp_path / f"there_{name}"):
            if "there" in file.name:
                file.write_text("there", "utf-8")
            with pytest.raises(ValueError, match=f"^{message}"):
                function(file, *arguments)
            assert file.exists() == ("there" in file.name)
            assert not file.exists() or file.read_text("utf-8") == "there"


@pytest.mark.parametrize("name", ["a.csv", "a.tum"])
def test_a_file_that_was_cut_inside_its_last_line_is_refused(tmp_path, name):
    """Without its last characters, a number such as 4.1e-18 would be read as 4.1."""
    file = tmp_path / name
    rb.write_path(file, TIMES[:3], POSES[:3])
    complete = file.read_bytes()
    for end in (b"", b"\n", b" \t\n\n", b"\r\n"):
        file.write_bytes(complete[:-1] + (end or b"\n"))
        assert len(rb.read_path(file)[0]) == 3
    for lost in range(1, 5):
        file.write_bytes(complete[:-lost])
        with pytest.raises(ValueError, match=r"line 4: the line has no line end, so the file may"):
            rb.read_path(file)
    save_plan(tmp_path / "plan.csv", [([1, 0, 0.25], 2)], "world")
    (tmp_path / "plan.csv").write_bytes((tmp_path / "plan.csv").read_bytes()[:-1])
    with pytest.raises(ValueError, match="line 2: the line has no line end"):
        load_plan(tmp_path / "plan.csv", "world")


def test_a_replaced_file_keeps_its_permissions_and_links(tmp_path):
    file, link = tmp_path / "a.bin", tmp_path / "link.bin"
    replace_file(file, b"one")
    (plain := tmp_path / "plain.bin").write_bytes(b"")
    assert file.stat().st_mode == plain.stat().st_mode
    file.chmod(0o640)
    mode = file.stat().st_mode
    try:
        link.symlink_to("a.bin")
    except OSError:  # Windows allows links only to some users
        link = file
    replace_file(str(link), b"\0two")
    assert (file.read_bytes(), file.stat().st_mode) == (b"\0two", mode)
    assert link is file or link.is_symlink()


def test_files_that_cannot_be_written_are_named(tmp_path):
    for file in (tmp_path / "no" / "a.csv", tmp_path):
        with pytest.raises(OSError, match=re.escape(repr(str(file)))):
            replace_file(file, b"1")
    kept = tmp_path / "kept.csv"
    kept.write_bytes(b"0")
    kept.chmod(0o444)
    if not os.access(kept, os.W_OK):  # the administrator may write all files
        with pytest.raises(PermissionError):
            replace_file(kept, b"1")
        assert kept.read_bytes() == b"0"
    assert sorted(tmp_path.iterdir()) == [kept]
    kept.chmod(0o644)


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such file")
def test_a_device_is_written_and_not_replaced():
    before = os.stat(os.devnull)
    replace_file(os.devnull, b"1")
    assert os.path.samestat(os.stat(os.devnull), before)


@pytest.mark.parametrize(("ending", "there"), [("csv", True), ("tum", False)])
def test_a_path_is_written_completely_or_not_at_all(tmp_path, ending, there):
    file = tmp_path / f"path.{ending}"
    if there:
        rb.write_path(file, TIMES[:-1], POSES[:-1])
    check_all_or_nothing(lambda: rb.write_path(file, TIMES, POSES), tmp_path)
