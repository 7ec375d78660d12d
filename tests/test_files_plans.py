"""Plans as files: the same numbers back, or the line and the reason."""

import re

import numpy as np
import pytest

import rbcourse as rb

RNG = np.random.default_rng(8)
PLANS = {
    "world": [(RNG.normal(size=3) * 10.0**k, 10.0**-k) for k in range(-9, 9)],
    "body": [([1, 0, -0.5], 2), ([0.1, 1 / 3, np.pi], 0)],
    "joints": [(RNG.normal(size=5), 0.1), ([0, -0.0, 1e-300, 1e300, 7], 3)],
}
PLAN = "vx world [m/s],vy world [m/s],vtheta [rad/s],duration [s]\n"


def same(plan, other):
    return len(plan) == len(other) and all(
        np.array_equal(v, w) and d == e for (v, d), (w, e) in zip(plan, other, strict=True)
    )


@pytest.mark.source("RR 3.2", "RR 4.2")
@pytest.mark.parametrize("kind", PLANS)
def test_a_plan_comes_back_to_the_last_digit(tmp_path, kind):
    file = tmp_path / "plan.csv"
    rb.files.save_plan(file, PLANS[kind], kind)
    assert same(rb.files.load_plan(file, kind), PLANS[kind])
    rb.files.save_plan(str(file), [], kind)
    assert rb.files.load_plan(str(file), kind) == []


def test_files_are_plain(tmp_path):
    rb.files.save_plan(tmp_path / "plan.csv", [([1, 0, 0.25], 2)], "world")
    assert (tmp_path / "plan.csv").read_bytes() == (PLAN + "1.0,0.0,0.25,2.0\n").encode()
    rb.files.save_plan(tmp_path / "plan.csv", [([1, 0], 2)], "joints")
    text = "v0 [rad/s],v1 [rad/s],duration [s]\n1.0,0.0,2.0\n"
    assert (tmp_path / "plan.csv").read_text("utf-8") == text


def test_what_a_spreadsheet_writes_is_read(tmp_path):
    text = (
        "\ufeff"
        + PLAN.replace(",", " , ").replace("\n", "\r\n")
        + '"1", 2 ,3e0,+.5\r\n-1,0,0,0\r\n\r\n'
    )
    (tmp_path / "plan.csv").write_bytes(text.encode())
    plan = rb.files.load_plan(tmp_path / "plan.csv", "world")
    assert same(plan, [([1, 2, 3], 0.5), ([-1, 0, 0], 0)])


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", f"line 1: {PLAN.strip().replace(',', ', ')} wanted, got "),
        ("1,0,0,2\n", "line 1: vx world [m/s], "),
        (PLAN.replace("world", "body"), "line 1: vx world [m/s], "),
        (PLAN.replace(",vtheta [rad/s]", ""), "line 1: vx world [m/s], "),
        (PLAN.replace("[rad/s]", "[deg/s]"), "line 1: vx world [m/s], "),
        (PLAN + "1,0,0,2\n1,0,0\n", "line 3: numbers wanted: 4, got: 3"),
        (PLAN + "1,0,0,2,\n", "line 2: numbers wanted: 4, got: 5"),
        (PLAN + "1,0,0,2\n\n1,0,0,2\n", "line 3: numbers wanted: 4, got: 0"),
        (PLAN.replace("\n", "\r") + "1,0,0,2\r1;0;0;2\r", "line 3: numbers wanted: 4, got: 1"),
        ("\n" + PLAN, "line 1: vx world [m/s], "),
        (PLAN + "1,0,0,\n", "line 2, duration [s]: a finite number wanted, got ''"),
        (PLAN + "1,x,0,2\n", "line 2, vy world [m/s]: a finite number wanted, got 'x'"),
        (
            PLAN + "1,0,0,2\n1,0,nan,2\n",
            "line 3, vtheta [rad/s]: a finite number wanted, got 'nan'",
        ),
        (PLAN + "1e999,0,0,2\n", "line 2, vx world [m/s]: a finite number wanted, got '1e999'"),
        (PLAN + "1_0,0,0,2\n", "line 2, vx world [m/s]: a finite number wanted, got '1_0'"),
        (PLAN + "1,0,0,2\n1,0,0,-2\n", "line 3: duration is -2.0, a duration from 0 up is wanted"),
        (PLAN + "1,0,0,2\n1,0,0,١\n", "line 3, duration [s]: a finite number wanted, got '١'"),
        (PLAN + "1\xa0,0,0,2\n", "line 2, vx world [m/s]: a finite number wanted, got '1\\xa0'"),
        (PLAN + "0x1,0,0,2\n", "line 2, vx world [m/s]: a finite number wanted, got '0x1'"),
        (
            PLAN + "x" * 90 + ",0,0,2",
            f"line 2, vx world [m/s]: a finite number wanted, got '{'x' * 40}'",
        ),
        (PLAN + '1,0,0,2\n"1,0,0,2\n1,0,0,2\n', "line 3: unexpected end of data"),
        (PLAN + "1,0,0,2\n\udcff,0,0,2\n", "line 3: no text in UTF-8"),
        (PLAN.replace("\n", "\r") + "1,0,0,2\r\udcff,0,0,2\r", "line 3: no text in UTF-8"),
    ],
)
def test_a_bad_file_gives_the_line_and_the_reason(tmp_path, text, reason):
    file = tmp_path / "plan.csv"
    file.write_bytes(text.encode(errors="surrogateescape"))
    with pytest.raises(ValueError, match=f"^{re.escape(f'{file}, {reason}')}"):
        rb.files.load_plan(file, "world")


def test_what_is_none_is_not_written(tmp_path):
    file = tmp_path / "file.csv"
    for call, message in (
        (lambda: rb.files.save_plan(file, [([1, 0], 2)], "world"), r"^plan\[0\] velocity: shape"),
        (
            lambda: rb.files.save_plan(file, [([1, 0], 2), ([1], 2)], "joints"),
            r"^plan\[1\] velocity: ",
        ),
        (lambda: rb.files.save_plan(file, [([1, 0, 0], -2)], "body"), r"^plan\[0\] duration is -2"),
        (lambda: rb.files.save_plan(file, 3, "joints"), r"^plan: a list of"),
        (
            lambda: rb.files.save_plan(file, [], "planar"),
            r"^kind: one of 'world', 'body', 'joints'",
        ),
        (
            lambda: rb.files.save_plan(file, [], ["world"]),
            r"^kind: one of .* wanted, got \['world'\]",
        ),
    ):
        with pytest.raises(ValueError, match=message):
            call()
        assert not file.exists()


def test_joints_need_columns(tmp_path):
    file = tmp_path / "file.csv"
    file.write_text("duration [s]\n1\n", "utf-8")
    with pytest.raises(ValueError, match="line 2: a velocity wanted, there is no column for it"):
        rb.files.load_plan(file, "joints")
    file.write_text("", "utf-8")
    with pytest.raises(ValueError, match=r"line 1: duration \[s\] wanted, got ''$"):
        rb.files.load_plan(file, "joints")


def test_an_unknown_kind_is_refused_by_readers_too(tmp_path):
    rb.files.save_plan(tmp_path / "plan.csv", PLANS["world"], "world")
    with pytest.raises(ValueError, match=r"^kind: one of 'world', .* wanted, got 'arm'"):
        rb.files.load_plan(tmp_path / "plan.csv", "arm")


def test_a_file_that_is_there_survives_a_bad_plan(tmp_path):
    file = tmp_path / "plan.csv"
    rb.files.save_plan(file, PLANS["body"], "body")
    before = file.read_bytes()
    with pytest.raises(ValueError, match=r"^plan\[1\]"):
        rb.files.save_plan(file, [([1, 2, 3], 1), ([1, 2, 3], np.nan)], "body")
    assert file.read_bytes() == before
