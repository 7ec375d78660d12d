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


def test_files_of_a_spreadsheet_are_read(tmp_path):
    header = PLAN.replace(",", " , ").replace("\n", "\r\n")
    text = "\ufeff" + header + '"1", 2 ,3e0,+.5\r\n-1,0,0,0\r\n\r\n'
    (tmp_path / "plan.csv").write_bytes(text.encode())
    plan = rb.files.load_plan(tmp_path / "plan.csv", "world")
    assert same(plan, [([1, 2, 3], 0.5), ([-1, 0, 0], 0)])


NUMBER = "a finite number wanted, got"
COLUMNS = "line 1: vx world [m/s], "


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", f"line 1: {PLAN.strip().replace(',', ', ')} wanted, got "),
        ("1,0,0,2\n", COLUMNS),
        (PLAN.replace("world", "body"), COLUMNS),
        (PLAN.replace(",vtheta [rad/s]", ""), COLUMNS),
        ("\n" + PLAN, COLUMNS),
        (PLAN + "1,0,0,2\n1,0,0\n", "line 3: numbers wanted: 4, got: 3"),
        (PLAN + "1,0,0,2,\n", "line 2: numbers wanted: 4, got: 5"),
        (PLAN + "1,0,0,2\n\n1,0,0,2\n", "line 3: numbers wanted: 4, got: 0"),
        (PLAN.replace("\n", "\r") + "1,0,0,2\r1;0;0;2\r", "line 3: numbers wanted: 4, got: 1"),
        (PLAN + "1,0,0,\n", f"line 2, duration [s]: {NUMBER} ''"),
        (PLAN + "1,x,0,2\n", f"line 2, vy world [m/s]: {NUMBER} 'x'"),
        (PLAN + "1,0,0,2\n1,0,nan,2\n", f"line 3, vtheta [rad/s]: {NUMBER} 'nan'"),
        (PLAN + "1e999,0,0,2\n", f"line 2, vx world [m/s]: {NUMBER} '1e999'"),
        (PLAN + "1_0,0,0,2\n", f"line 2, vx world [m/s]: {NUMBER} '1_0'"),
        (PLAN + "1,0,0,2\n1,0,0,-2\n", "line 3: duration is -2.0, a duration from 0 up is wanted"),
        (PLAN + "1,0,0,2\n1,0,0,١\n", f"line 3, duration [s]: {NUMBER} '١'"),
        (PLAN + "1\xa0,0,0,2\n", f"line 2, vx world [m/s]: {NUMBER} '1\\xa0'"),
        (PLAN + "0x1,0,0,2\n", f"line 2, vx world [m/s]: {NUMBER} '0x1'"),
        (PLAN + "x" * 90 + ",0,0,2", f"line 2, vx world [m/s]: {NUMBER} '{'x' * 40}'"),
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


@pytest.mark.parametrize(
    ("plan", "kind", "message"),
    [
        ([([1, 0], 2)], "world", r"plan\[0\] velocity: shape"),
        ([([1, 0], 2), ([1], 2)], "joints", r"plan\[1\] velocity: "),
        ([([1, 0, 0], -2)], "body", r"plan\[0\] duration is -2"),
        ([([1, 2, 3], 1), ([1, 2, 3], np.nan)], "body", r"plan\[1\]"),
        (3, "joints", "plan: a list of"),
        ([], "planar", "kind: one of 'world', 'body', 'joints' wanted, got 'planar'"),
        ([], ["world"], r"kind: one of .* wanted, got \['world'\]"),
    ],
)
def test_malformed_plans_are_not_written_and_no_file_is_changed(tmp_path, plan, kind, message):
    for content in (None, "there"):
        file = tmp_path / f"{content}.csv"
        if content:
            file.write_text(content, "utf-8")
        with pytest.raises(ValueError, match=f"^{message}"):
            rb.files.save_plan(file, plan, kind)
        assert (file.read_text("utf-8") if file.exists() else None) == content


@pytest.mark.parametrize(
    ("text", "kind", "message"),
    [
        ("duration [s]\n1\n", "joints", "line 2: a velocity wanted, there is no column for it"),
        ("", "joints", r"line 1: duration \[s\] wanted, got ''$"),
        (PLAN, "arm", "^kind: one of 'world', .* wanted, got 'arm'"),
    ],
)
def test_joints_need_columns_and_kinds_are_known(tmp_path, text, kind, message):
    (tmp_path / "plan.csv").write_text(text, "utf-8")
    with pytest.raises(ValueError, match=message):
        rb.files.load_plan(tmp_path / "plan.csv", kind)
