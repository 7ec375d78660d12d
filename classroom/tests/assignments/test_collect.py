"""Test that downloads from Moodle and Canvas are collected in nbgrader's folder."""

import csv
import io
import json
import os
import shutil
import subprocess
import sys
import zipfile
from collections import defaultdict
from datetime import datetime

import nbformat
import pytest
from nbformat.v4 import new_markdown_cell, new_notebook
from nbgrader.api import Gradebook
from nbgrader.utils import parse_utc
from tiny import MODULE
from tiny_set import write_tiny_set
from traitlets.config import Config

from rbclassroom.assignments import downloads
from rbclassroom.assignments.__main__ import main
from rbclassroom.assignments.autograding import configure
from rbclassroom.assignments.collect import NOT_OF_A_SET, collect, read_owners, read_report
from rbclassroom.assignments.submissions import read_notebook
from rbclassroom.course import options

DAY = (2026, 11, 20, 12, 0, 0)
LATER = (2026, 12, 2, 12, 0, 0)
NEWEST = (2030, 1, 1, 0, 0, 0)
FILES = {"collected", "unchanged", "duplicates", "unmatched", "refused", "ignored"}


@pytest.fixture
def course(tmp_path):
    """Return a course with two problem sets, and an empty folder for downloads."""
    assignments = tmp_path / "notebooks" / "assignments"
    for name in ("ps1", "ps2"):
        path = write_tiny_set(assignments, name)
        path.write_text(path.read_text("utf-8").replace("square", f"{name}_square"), "utf-8")
    (tmp_path / "downloads").mkdir()
    return assignments


def moodle(student, file="ps1.ipynb"):
    return f"{student}_assignsubmission_file/{file}"


def answered(course, words="mine", name="ps1"):
    notebook = nbformat.read(course / "source" / name / f"{name}.ipynb", as_version=4)
    notebook.cells.append(new_markdown_cell(words, id="own"))
    return nbformat.writes(notebook).encode()


def packed(entries, date=DAY, method=zipfile.ZIP_STORED):
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", method) as archive:
        for name, content in entries.items():
            own = isinstance(name, zipfile.ZipInfo)
            entry = name if own else zipfile.ZipInfo(name, date)
            archive.writestr(entry, content, None if own else method)
    return stream.getvalue()


def collected(course, files, due=None):
    """Save files as downloads and collect them; return the rows of the report."""
    folder = course.parents[1] / "downloads"
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    rows = collect(folder, course, due)
    assert before == {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    kept = [[cell.removeprefix("'") for cell in row.values()] for row in read_report(course)]
    kept = [tuple(row[:3]) for row in kept]
    assert kept[len(kept) - len(rows) :] == rows or not rows
    named = [what for kind, what, _ in rows if kind in FILES]
    assert len(named) == len(set(named)), "a file is in more than one list"
    return rows


def of(kind, rows):
    return [(what, why) for name, what, why in rows if name == kind]


def files(course):
    """Return a dict with the text of each collected notebook; the keys are the folders."""
    paths = (course / "submitted").glob("*/*/*.ipynb")
    notebooks = {path: read_notebook(path.read_bytes(), "it") for path in paths}
    return {
        path.parent.relative_to(course / "submitted").as_posix(): notebook.cells[-1].source
        for path, notebook in notebooks.items()
    }


def test_names_never_become_formulas_in_a_spreadsheet(course):
    name = moodle("=cmd' -C calc'!A0_1")
    collected(course, {name: answered(course)})
    report = (course / "submitted" / "report.csv").read_text("utf-8-sig")
    cells = [cell for row in csv.reader(io.StringIO(report)) for cell in row]
    assert f"'{name}" in cells
    assert not [cell for cell in cells if cell.startswith(("=", "+", "-", "@"))]


def test_each_notebook_is_assigned_to_its_problem_set(course):
    empty = nbformat.writes(new_notebook(cells=[new_markdown_cell("mine")])).encode()
    one, two = answered(course), answered(course, name="ps2")
    unmarked = one.replace(b"nbgrader", b"another")
    given = {
        moodle("A_1", "ps1-2.ipynb"): one,
        moodle("B_1", "ps1 (1).ipynb"): one,
        moodle("C_1", "PS1_final.ipynb"): one,
        moodle("D_1", "my_ps2.ipynb"): two,
        moodle("E_1", "homework.ipynb"): one,
        moodle("F_1"): two,
        moodle("G_2"): empty,
        moodle("H_3", "ps12.ipynb"): empty,
        moodle("I_4"): b"no notebook",
        moodle("J_5", "x.ipynb"): unmarked,
        "ps1.ipynb": one,
    }
    rows = collected(course, given)
    why_not = sorted(why for _, why in of("unmatched", rows))
    unnamed = "neither its name nor a folder names a student"
    assert why_not == [NOT_OF_A_SET, NOT_OF_A_SET, unnamed]
    assert "damaged or not a notebook" in of("refused", rows)[0][1]
    other = ("f, ps2", "its name is ps1, its cells are of ps2")
    assert of("another set", rows) == [other]
    wanted = {f"{who}/ps1" for who in "abcej"} | {"d/ps2", "f/ps2"}
    assert files(course).keys() == wanted
    assert dict(of("collected", rows))[moodle("F_1")].endswith(
        "f, ps2: its name is ps1, its cells are of ps2"
    )
    assert [who for who, _ in of("nothing usable", rows)] == ["G 2", "H 3", "I 4"]


def test_a_file_with_the_name_of_another_set_counts_only_without_a_better_one(course):
    one, other = answered(course, "named"), answered(course, "misnamed")
    collected(course, {"a.zip": packed({moodle("A_1"): one}, DAY)})
    collected(course, {"b.zip": packed({moodle("A_1", "ps2.ipynb"): other}, LATER)})
    assert files(course) == {"a/ps1": "named"}


def blank(course):
    """Return the set as it is handed out."""
    notebook = nbformat.read(course / "source" / "ps1" / "ps1.ipynb", as_version=4)
    for cell in notebook.cells:
        if "BEGIN SOLUTION" in cell.source:
            code = "# YOUR CODE HERE\nraise NotImplementedError()"
            cell.source = code if cell.cell_type == "code" else "YOUR ANSWER HERE"
    notebook.cells.append(new_markdown_cell("blank", id="own"))
    return nbformat.writes(notebook).encode()


@pytest.mark.parametrize("solved", ["a.ipynb", "z.ipynb"])
def test_of_two_files_of_a_date_the_one_with_more_answers_is_used(course, solved):
    given = {moodle("A_1", "m.ipynb"): blank(course), moodle("A_1", solved): answered(course)}
    rows = collected(course, {"all.zip": packed(given)})
    assert files(course) == {"a/ps1": "mine"}
    label = f"all.zip: {moodle('A_1', solved)}"
    (why,) = dict(of("duplicates", rows)).values()
    assert why == f"{label}, of the same date, with more answers is used instead"


def test_another_file_of_the_date_of_a_collected_one_is_not_unchanged(course):
    collected(course, {"all.zip": packed({moodle("A_1"): blank(course)})})
    rows = collected(course, {"all.zip": packed({moodle("A_1"): answered(course)})})
    why = "a, ps1: the file collected before has the same date; delete it to use this one"
    assert rows == [("duplicates", f"all.zip: {moodle('A_1')}", why)]
    (course / "submitted" / "a" / "ps1" / "ps1.ipynb").unlink()
    collected(course, {})
    assert files(course) == {"a/ps1": "mine"}


def test_different_encodings_of_a_name_identify_one_student(course):
    content, plain = answered(course), moodle("Jörg Müller_1")
    undeclared = bytearray(packed({plain: content}))
    for mark, at in ((b"PK\x03\x04", 7), (b"PK\x01\x02", 9)):
        undeclared[undeclared.index(mark) + at] &= ~0x08
    parts = moodle("Jo\u0308rg Mu\u0308ller_1")
    rows = collected(course, {"a.zip": bytes(undeclared), "b.zip": packed({parts: content})})
    assert list(files(course)) == ["jörg_müller/ps1"]
    assert len(of("duplicates", rows)) == 1
    assert all("Jörg Müller" in what for _, what, _ in rows)


def test_students_with_the_same_name_are_kept_apart(course):
    collected(course, {moodle("Al Li_11"): answered(course, "first")})
    rows = collected(course, {moodle("Al Li_22"): answered(course, "second")})
    assert of("renamed", rows) == [("submitted/al_li/ps1", "is al_li_11, ps1")]
    assert of("duplicates", rows) == []
    found = files(course)
    assert found["al_li_11/ps1"] == "first"
    assert found["al_li_22/ps1"] == "second"


def test_a_student_keeps_one_id_in_all_sets(course):
    two = answered(course, name="ps2")
    collected(course, {moodle("Al Li_11"): answered(course), moodle("Al Li_99", "ps2.ipynb"): two})
    assert files(course).keys() == {"al_li/ps1", "al_li/ps2"}


def test_students_missing_from_the_roster_or_the_downloads_are_listed(course):
    roster = "id,first_name,last_name,email,lms_user_id\n"
    roster += "s1,Jörg,Müller,,\ns2,Eva,Maria Roth,,\ns3,Al,Li,,500\ns4,Bo,Ek,,\ns5,Al,O'Neil,,\n"
    roster += "s6,Séan,Ó Briain,,\n"
    (course / "students.csv").write_text(roster, "utf-8-sig")
    names = [moodle("Müller Jörg_500"), "mariarotheva_7_1_ps1.ipynb", "renamed_500_2_ps1.ipynb"]
    names += [moodle("Al ONeil_9"), moodle("New One_8"), moodle("Sean O Briain_3")]
    rows = collected(course, dict.fromkeys(names, answered(course)))
    wanted = {f"{who}/ps1" for who in ("new_one", "s1", "s2", "s3", "s5", "s6")}
    assert files(course).keys() == wanted
    assert of("missing", rows) == [("s4, ps1", "Bo Ek")]
    assert of("not on the roster", rows) == [("new_one", "New One (8)")]


def test_rosters_saved_by_spreadsheets_are_read(course):
    roster = course / "students.csv"
    roster.write_text("id;first_name;last_name\ns1;Jörg;Müller\n", "utf-8")
    collected(course, {moodle("Müller Jörg_500"): answered(course)})
    assert list(files(course)) == ["s1/ps1"]
    roster.write_text("id,first_name,last_name\ns1,Jörg,Müller\n", "cp1252")
    with pytest.raises(ValueError, match=r"students\.csv: a CSV file in UTF-8 is wanted"):
        collected(course, {})
    for row in ("../x,A,B,", "a/b,A,B,", ",A,B,"):
        roster.write_text(f"id,first_name,last_name,email\n{row}\n", "utf-8")
        with pytest.raises(ValueError, match="an id that can name a folder is wanted"):
            collected(course, {})


def test_the_file_to_submit_is_found_in_a_zip(course):
    inner = {
        "work/ps1.ipynb": answered(course, "work"),
        "ps1/to_submit/ps1.ipynb": answered(course, "to submit"),
        "ps1/original/ps1.ipynb": answered(course, "original"),
        "ps1/data.csv": b"1",
        "__MACOSX/ps1/._ps1.ipynb": b"junk",
    }
    upload = packed(inner, LATER)
    rows = collected(course, {"m.zip": packed({moodle("A B_1", "x.zip"): upload})})
    assert (len(of("duplicates", rows)), len(of("ignored", rows))) == (1, 3)
    collected(course, {"ek_5_6_up.zip": upload})
    wanted = dict.fromkeys(("a_b/ps1", "ek_5/ps1"), "to submit")
    assert files(course) == wanted


def test_only_unsafe_files_are_refused(course):
    good = answered(course)
    encrypted, broken = (bytearray(packed({moodle(who): good})) for who in ("E_5", "F_6"))
    encrypted[6] |= 1
    encrypted[encrypted.index(b"PK\x01\x02") + 8] |= 1
    broken[200] ^= 0xFF
    bomb = packed({moodle("H_8"): bytes(31_000_000)}, method=zipfile.ZIP_DEFLATED)
    much = packed({f"{k}.mp4": bytes(10**7) for k in range(11)}, method=zipfile.ZIP_DEFLATED)
    link = zipfile.ZipInfo(moodle("C_3"), DAY)
    link.external_attr = 0o120777 << 16
    old = zipfile.ZipInfo("old.ipynb", DAY)
    old.compress_type = zipfile.ZIP_BZIP2  # a short file can hold gigabytes
    entries = {
        f"../{moodle('A_1')}": good,
        f"/tmp/{moodle('B_2')}": good,
        link: b"/etc/passwd",
        f"..\\{moodle('D_4')}": good,
        moodle("G_7", "a.zip"): packed({"a.zip": packed({"ps1.ipynb": good})}),
        moodle("I_9", "a.zip"): b"no zip",
        moodle("J_9", "a.rar"): b"Rar!",
        moodle("L_9", "ps1.zip"): much,
        moodle("M_9", "a.zip"): packed({old: good, "ps1.ipynb": good}),
        moodle("N_9", "a.zip"): packed({"ps1.ipynb": good}, method=zipfile.ZIP_LZMA),
        "K_9_assignsubmission_onlinetext/onlinetext.html": b"words",
        moodle("Good One_10"): good,
    }
    zips = [packed(entries), bytes(encrypted), bytes(broken), bomb, b"PK", b""]
    rows = collected(course, {f"{k}.zip": content for k, content in enumerate(zips)})
    # the path in this file name is ignored; only the student's name is used
    assert files(course).keys() == {f"{who}/ps1" for who in ("a", "b", "d", "g", "m", "good_one")}
    why = [reason for _, reason in of("refused", rows)]
    assert len(why) == 10
    assert why.count("its kind of compression is not accepted; zip it again") == 2
    assert why.count("it contains too many bytes; unpack it by hand") == 1
    for words in ("encrypted", "too large"):
        assert sum(words in reason for reason in why) == 1, words
    assert len(of("ignored", rows)) == 2


def tree(course, paths, above=""):
    """Return files with these paths, in zips where a path has one; notebooks contain their path."""
    given, zips = {}, defaultdict(list)
    for path in paths:
        head, zipped, rest = path.partition(".zip/")
        if zipped:
            zips[f"{head}.zip"].append(rest)
        else:
            given[path] = answered(course, above + path) if "ipynb" in path else b"%PDF-1.7"
    for path, inside in zips.items():
        given[path] = packed(tree(course, inside, f"{above}{path}/"), NEWEST)
    return given


ATTEMPT = "attempt_2026-11-20-12-00-00"
# Each file has a student, or "" if another file of the student counts or it is no notebook.
LAYOUTS = {
    "Moodle": {
        "Anna Berg_1234567_assignsubmission_file_/ps1.ipynb": "anna_berg",
        "Bo Ek_2_assignsubmission_file/in a folder/ps1.ipynb": "bo_ek",
        "Cy Ax_3_assignsubmission_file_ps1.ipynb": "cy_ax",
        "Group A_77_assignsubmission_file/ps1.ipynb": "group_a",
        "---_assignsubmission_file/ps1.ipynb": "student",
        "Con_4_assignsubmission_file/ps1.ipynb": "con_4",
        "Default group_assignsubmission_file/ps1.ipynb": "default_group",
        "Participant_1234567_assignsubmission_file_/ps1.ipynb": "participant_1234567",
        "Jürg Ø'Brien-Łuk_1_assignsubmission_file_/ps1.ipynb": "jürg_øbrien_łuk",
        "王 伟_12_assignsubmission_file_/ps1.ipynb": "王_伟",
    },
    "a student's zip with names as of an LMS": {
        f"{moodle('Al Li_1', 'ps1.zip')}/{moodle('B_2')}": "al_li",
        f"{moodle('Bo Ek_2', 'ps1.zip')}/ps1_2026_11_final.ipynb": "bo_ek",
        f"{moodle('Cy Ax_3', 'ps1.zip')}/img/plot_2026_11_20": "",
        f"{moodle('Cy Ax_3', 'ps1.zip')}/ps1.ipynb": "cy_ax",
    },
    "Canvas": {
        "berganna_12345_67890_ps1.ipynb": "berganna_12345",
        "ekbo_LATE_13_67891_ps1-1.ipynb": "ekbo_13",
        "anon_x7Yz1_67890_ps1.ipynb": "anon_x7yz1",
        "LATE_anon_y7Yz1_67890_ps1.ipynb": "anon_y7yz1",
        "li_5_900_ps1.ipynb": "",
        "li_5_1000_ps1-1.ipynb": "li_5",
    },
    "Canvas, unpacked": {
        "submissions/berganna_12_67890_ps1.ipynb": "berganna_12",
        "submissions/ekbo_LATE_13_67891_ps1-1.ipynb": "",
        "submissions/ekbo_13_67892_ps1.zip/a/hw_1_2_ps1.ipynb": "ekbo_13",
    },
    "Blackboard": {
        f"Set 1_an_smith_{ATTEMPT}_ps1.ipynb": "an_smith",
        f"Set 1_jo_smith_{ATTEMPT}_ps1.ipynb": "jo_smith",
        f"Set 1_a.b_{ATTEMPT}_ps1.ipynb": "a_b",
        f"Set 1_an_smith_{ATTEMPT}_z_a.b_attempt_2026-12-30-12-00-00_ps1.ipynb": "an_smith",
        f"Set_ek_{ATTEMPT}_ps1.ipynb": "",
        "Set_ek_attempt_2026-11-21-12-00-00_a.ipynb": "ek",
        "Set_ek_attempt_2026-11-21-12-00-00.txt": "",
        "Set_old_attempt_0001-01-01-00-00-00_ps1.ipynb": "old",
    },
    "Brightspace": {
        "39-25 - Anna-Lea Berg - Nov 20, 2026 1200 PM/ps1.ipynb": "anna_lea_berg",
        "39-26 - Bo Ek- Nov 20, 2026 1200 PM - ps1.ipynb": "bo_ek",
        "39-27 - Cy Ax - 20 November, 2026 1200/ps1.ipynb": "cy_ax",
        "3-4 - Al Li - Dec 3, 2026 900 AM/ps1.ipynb": "al_li_3_4",
        "3-4 - Al Li - Nov 3, 2026 1000 PM/ps1.ipynb": "",
        "5-4 - Al Li - Dec 3, 2026 900 AM/ps1.ipynb": "al_li_5_4",
    },
    "ILIAS": {
        "Set 1/Submissions/Berg_Anna_aberg_4711/ps1.ipynb": "berg_anna",
        "Set 1/Submissions/von_Ek_Bo_bo.ek_4712/20261120_ps1.ipynb": "von_ek_bo_4712",
        "Set 1/Submissions/von_Ek_Bo_bek_4713/set_1_2/ps1.ipynb": "von_ek_bo_4713",
        "Set 1/Submissions/Ax_Cy_cax_4714/ps1.pdf": "",
    },
}


@pytest.mark.parametrize("packing", ["zip", "loose"])
@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=LAYOUTS)
def test_each_file_is_assigned_to_its_student(course, layout, packing):
    given = tree(course, layout)
    collected(course, given if packing == "loose" else {"ROB_2026_01_all.zip": packed(given)})
    found = files(course)
    assert found.keys() == {f"{student}/ps1" for student in layout.values() if student}
    assert found.keys() == {f"{layout[path]}/ps1" for path in found.values()}
    # the entries of a student's zip have dates from the student's machine
    stamps = [path.read_text() for path in (course / "submitted").rglob("timestamp.txt")]
    assert not [stamp for stamp in stamps if "2030" in stamp]


@pytest.mark.parametrize(
    ("paths", "wanted"),
    [
        (["A/Al/ps1.ipynb", "A/Bo/ps1.ipynb", "B/Cy/ps1.ipynb", "B/Di/ps1.ipynb"], "al bo cy di"),
        (["ps1/Al/ps1.ipynb", "ps1/Bo/ps1.ipynb"], "al bo"),
        (["Al/ps1/ps1.ipynb", "Al/ps1/to_submit/ps1.ipynb"], "al"),
        (["Al Li/Work/to_submit/ps1.ipynb"], "al_li"),
        (["set/Al Li - ps1.ipynb", "set/Bo Ek - ps1.ipynb"], ""),
        (["a/set/Al Li - ps1.ipynb", "a/set/Bo Ek - ps1.ipynb"], ""),
        (["A/Al/ps1.ipynb", "B/Al/ps1.ipynb", "B/Bo/ps1.ipynb"], "al_a_al al_b_al bo"),
        (["A/Al/x.ipynb", "A/Bo/x.ipynb", "B/Cy/x.ipynb"], "al bo cy"),
        (["Al/ps1.pdf", "Bo/ps1.ipynb", "Cy/ps1.ipynb"], "bo cy"),
        (["Al.zip/ps1.ipynb", "Bo.zip/ps1.ipynb"], "al bo"),
        (["Al Li/ps1.ipynb", "Li Al/ps1.ipynb", "al_li/ps1.ipynb"], "al_li_1 al_li_2 li_al"),
        (["a.zip/Al/hw_1_2_a.ipynb", "a.zip/Bo/hw_1_2_a.ipynb"], "al bo"),
        (["a.zip/Al/a.ipynb", "a.zip/B_1_2_x/a.ipynb", "a.zip/Cy/b.zip/a.ipynb"], "al b_1_2_x cy"),
        (["Al/hw_1_2_ps1.ipynb", "Al/hw_3_4_ps1.ipynb", "Al/ps1.ipynb", "Bo/ps1.ipynb"], "al bo"),
        (["c/s/Al/2026_1_3_a.ipynb", "c/s/Bo/2026_1_3_a.ipynb", "c/s/Bo/old/a.ipynb"], "al bo"),
        (["Al/a.ipynb", "Al/old/a.ipynb", "Al/b.zip/a.ipynb", "Bo/a.ipynb"], "al bo"),
        (["extra/Wes Wu/ps1.ipynb"], "wes_wu"),
        (["extra/Wes Wu/ps1.ipynb", "Bo Ek/ps1.ipynb"], "bo_ek wes_wu"),
        (["extra/Wes Wu/ps1.ipynb", "bo/work_1/ps1.ipynb"], "bo wes_wu"),
        (["late/wes/ps1.ipynb", "abgabe/Bo/ps1.ipynb"], "bo wes"),
        (["Wes Wu/My Files/ps1.ipynb", "Bo Ek/Abgabe/ps1.ipynb"], "bo_ek wes_wu"),
        (["wes/My Files/ps1.ipynb", "bo/My Files/ps1.ipynb"], "bo wes"),
    ],
)
def test_the_level_of_the_students_is_found(course, paths, wanted):
    """A folder in which folders have notebooks of the same set belongs to a class."""
    collected(course, tree(course, paths))
    assert sorted(files(course)) == [f"{student}/ps1" for student in wanted.split()]


@pytest.mark.parametrize(
    ("path", "wanted"),
    [
        ("extra/wes/ps1.ipynb", "extra, ps1 (or is “wes” the student?)"),
        ("extra/Wes Wu/ps1.ipynb", "wes_wu, ps1"),
        ("Wes Wu/version/ps1.ipynb", "wes_wu, ps1"),
        ("wes/ps1/work/ps1.ipynb", "wes, ps1"),
    ],
)
def test_a_row_says_if_the_folder_of_the_student_is_uncertain(course, path, wanted):
    rows = collected(course, {moodle("A_1"): answered(course), path: answered(course)})
    assert (path, wanted) in of("collected", rows)


def test_folders_are_named_after_ids_or_names_of_the_roster(course):
    (course / "students.csv").write_text("id,first_name,last_name\ns1,Al,Li\ns2,Bo,Ek\ns3,Cy,Ax\n")
    entries = {f"{name}/ps1.ipynb": answered(course) for name in ("s1", "Ek, Bo", "cy ax")}
    collected(course, entries)
    assert files(course).keys() == {"s1/ps1", "s2/ps1", "s3/ps1"}


def test_a_namesake_in_a_later_download_does_not_replace_the_first(course):
    collected(course, {moodle("Al Li_11"): answered(course, "first")})
    shutil.rmtree(course.parents[1] / "downloads")
    collected(course, {moodle("Al Li_22"): answered(course, "second")})
    assert files(course) == {"al_li/ps1": "first", "al_li_22/ps1": "second"}


@pytest.mark.parametrize(
    ("date", "late"),
    [
        ("Dec 2, 2026 1030 PM", "handed in at 2026-12-02 22:30:00"),
        ("December 2, 2026 930 AM", "handed in at 2026-12-02 09:30:00"),
        ("2 December, 2026 2230", "handed in at 2026-12-02 22:30:00"),
        ("2 Dec, 2026 1030 PM", "handed in at 2026-12-02 22:30:00"),
        ("1 December, 2026 2358", ""),
        ("2 décembre, 2026 2230", "perhaps: the date in its name was not read"),
    ],
)
def test_late_work_is_found_by_dates_in_names(course, date, late):
    """The date of the file itself is long before the due date."""
    name = f"39-25 - Anna Berg - {date}/ps1.ipynb"
    rows = collected(course, {name: answered(course)}, datetime(2026, 12, 1, 23, 59))
    found = [why for kind, _, why in rows if kind == "late"]
    assert len(found) == bool(late)
    assert all(late in why for why in found)


def test_a_due_date_without_a_time_is_the_end_of_the_day():
    assert options.date("2026-12-01") == datetime(2026, 12, 1, 23, 59, 59)
    assert options.date("2026-12-01 00:00") == datetime(2026, 12, 1)


def test_odd_dates_do_not_lose_a_file(course):
    zipped = bytearray(packed({moodle("A_1"): answered(course), moodle("B_2"): answered(course)}))
    at = zipped.index(b"PK\x01\x02")
    zipped[at + 12 : at + 16] = bytes(4)  # a date of zero
    collected(course, {"all.zip": bytes(zipped)})
    assert files(course).keys() == {"a/ps1", "b/ps1"}


def test_zips_in_zips_are_read_up_to_a_limit(course):
    content = packed({"ps1.ipynb": answered(course)})
    for depth in range(5):
        entries = {moodle(f"{'ABCDE'[depth]}_{depth}", "w.zip"): content}
        rows = collected(course, {f"{depth}.zip": packed(entries)})
        content = packed({"w.zip": content})
    assert files(course).keys() == {"a/ps1", "b/ps1", "c/ps1"}
    assert "too many zips" in of("refused", rows)[-1][1]


def test_the_name_of_a_class_zip_can_look_like_an_upload(course):
    collected(course, {"ROB_3_01_all.zip": packed({"ek_5_6_ps1.ipynb": answered(course)})})
    assert list(files(course)) == ["ek_5/ps1"]


def test_a_zip_that_declares_a_smaller_size_is_refused(course, monkeypatch):
    monkeypatch.setattr(downloads, "UPLOAD_BYTES", 10_000)
    inner = packed({"a.txt": bytes(6000), "b.txt": bytes(6000)}, method=zipfile.ZIP_DEFLATED)
    inner = bytearray(inner)
    at = -1
    while (at := inner.find(b"PK\x01\x02", at + 1)) >= 0:
        inner[at + 24 : at + 28] = (100).to_bytes(4, "little")
    rows = collected(course, {"all.zip": packed({moodle("A_1", "w.zip"): bytes(inner)})})
    assert len(of("refused", rows)) >= 1


def test_a_student_of_the_roster_keeps_the_folder_with_another_number(course):
    (course / "students.csv").write_text("id,first_name,last_name\ns1,Al,Li\n")
    for number in "11", "22":
        collected(course, {moodle(f"Al Li_{number}"): answered(course, number)})
        shutil.rmtree(course.parents[1] / "downloads")
        assert files(course).keys() == {"s1/ps1"}


def test_notebooks_are_recognised_by_their_content(course):
    names, text = ["ps1.ipynb.json", "ps1.ipynb.txt", "ps1 (2)", "ps1.JSON"], answered(course)
    contents = [text, *(text.decode().encode(each) for each in ("utf-8-sig", "utf-16", "utf-8"))]
    loose = {moodle(f"A{name}_1", name): each for name, each in zip(names, contents, strict=True)}
    inside = {moodle(f"B{name}_2", "w.zip"): packed({name: text}) for name in names}
    assert len(of("collected", collected(course, loose | inside))) == 8
    stored = sorted(path.read_bytes() for path in (course / "submitted").glob("a*/*/*.ipynb"))
    assert stored == sorted(contents)


def test_students_who_handed_in_nothing_usable_are_listed(course):
    good = answered(course)
    entries = {
        moodle("A B_1", "essay.pdf"): b"%PDF-1.7",
        moodle("A B_1", "ps1.py"): b"print(1)",
        moodle("C_2", "work.zip"): packed({"ps1.html": b"<html>"}),
        moodle("D_3", "ps1.ipynb"): b"{}",
        moodle("E_4", "notes.pdf"): b"%PDF-1.7",
        moodle("E_4", "ps1.ipynb"): good,
    }
    rows = collected(course, {"all.zip": packed(entries), "readme.txt": b"words"})
    found = dict(of("nothing usable", rows))
    assert [*found] == ["A B 1", "C 2", "D 3"]
    assert found["A B 1"].count("essay.pdf") == found["A B 1"].count("ps1.py") == 1
    assert files(course).keys() == {"e/ps1"}


def test_a_namesake_without_a_notebook_is_listed(course):
    entries = {"A/Al/ps1.pdf": b"%PDF-1.7", "A/Bo/ps1.ipynb": answered(course)}
    entries |= {f"B/{name}/ps1.ipynb": answered(course) for name in ("Al", "Cy")}
    rows = collected(course, entries | {"A/Di/ps1.ipynb": answered(course)})
    assert [who for who, _ in of("nothing usable", rows)] == ["A/Al"]
    assert files(course).keys() == {f"{who}/ps1" for who in ("al", "bo", "cy", "di")}


@pytest.mark.skipif(os.name == "nt", reason="links need a permission on Windows")
def test_symbolic_links_are_not_followed(course):
    folder = course.parents[1] / "downloads"
    (folder / "A_1_assignsubmission_file_ps1.ipynb").symlink_to(course / "source/ps1")
    rows = collected(course, {})
    assert of("refused", rows) == [("A_1_assignsubmission_file_ps1.ipynb", "it is a link")]


def test_only_newer_downloads_replace_collected_files(course):
    name, two = moodle("A_1"), answered(course, "", "ps2")
    first = {"a.zip": packed({name: answered(course, "new")}, LATER), "b_2_3_ps2.ipynb": two}
    assert len(of("collected", collected(course, first))) == 2
    before = files(course)
    assert [kind for kind, *_ in collected(course, {})] == ["unchanged", "unchanged"]
    rows = collected(course, {"a.zip": packed({name: answered(course, "old")}, DAY)})
    assert "the file collected before is newer" in of("duplicates", rows)[0][1]
    assert files(course) == before
    rows = collected(course, {"b.zip": packed({name: answered(course, "newest")}, NEWEST)})
    assert "replaces" in of("collected", rows)[0][1]
    assert files(course)["a/ps1"] == "newest"
    (course / "submitted/a/ps1/ps1.ipynb").write_bytes(answered(course, "corrected by hand"))
    why = dict(of("duplicates", collected(course, {})))[f"b.zip: {name}"]
    assert "has the same date; delete it" in why
    assert files(course)["a/ps1"] == "corrected by hand"


def test_late_files_are_reported(course):
    names = moodle("A_1"), "b_2_3_ps1.ipynb", "c_LATE_3_4_ps1.ipynb", "LATE_anon_d_5_ps1.ipynb"
    names = *names, "Set_ek_attempt_2026-12-03-12-00-00_ps1.ipynb"
    entries = dict.fromkeys(names, answered(course))
    rows = collected(course, {"a.zip": packed(entries, LATER)}, datetime(2026, 12, 1, 23, 59))
    late, stamp = dict(of("late", rows)), (course / "submitted/a/ps1/timestamp.txt").read_text()
    assert set(late) == {"a, ps1", "c_3, ps1", "anon_d, ps1", "ek, ps1"}
    assert late["a, ps1"].startswith("perhaps: 2026-12-02 12:00:00 may be")
    assert late["ek, ps1"].startswith("handed in at 2026-12-03")
    assert len(of("collected", rows)) == 5
    offset = datetime(*LATER).astimezone().utcoffset()
    assert parse_utc(stamp.strip()) == datetime(*LATER) - offset


def test_the_command_prints_each_list(course, monkeypatch):
    folder = course.parents[1]
    (folder / "downloads" / "Ö X_1_assignsubmission_file_ps1.ipynb").write_bytes(answered(course))
    (folder / "downloads" / "notes.txt").write_bytes(b"")
    (folder / "downloads" / "loose.ipynb").write_bytes(answered(course))
    both = dict.fromkeys((moodle("A_2"), moodle("B_3")), answered(course))
    both[moodle("C_4")] = b""
    (folder / "downloads" / "all.zip").write_bytes(packed(both))
    done = subprocess.run(
        [*MODULE, "rbclassroom.assignments", "collect", "downloads", "--due", "2000-01-01 12:00"],
        cwd=folder,
        capture_output=True,
        encoding="ascii",
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
    )
    assert done.stderr == ""
    heads = [line for line in done.stdout.splitlines() if not line.startswith(" ")]
    lists = ["collected: 3", "late, after 2000-01-01 12:00: 3", "ignored: 1", "unmatched: 1"]
    lists += ["nothing usable: 1"]  # with the refused file
    wanted = "3 perhaps late, 1 unmatched, 1 nothing usable"
    assert heads == [*lists, f"Look at these: {wanted}. All rows are in submitted/report.csv."]
    assert "  a, ps1; b, ps1: perhaps: 2026-11-20 12:00:00 may be the date" in done.stdout
    monkeypatch.setattr(sys, "argv", ["assignments", "collect", "nowhere"])
    with pytest.raises(SystemExit, match="folder: an existing folder is wanted, got nowhere"):
        main()


def test_a_roster_that_comes_later_renames_the_folder(course):
    """The student handed in before, and had a folder with an own name."""
    entries = {
        moodle("Ada Lovelace_1001"): answered(course),
        moodle("Paul_7", "a.pdf"): b"%PDF-1.7",
    }
    collected(course, {"all.zip": packed(entries)})
    assert files(course).keys() == {"ada_lovelace/ps1"}
    roster = "id,first_name,last_name\ns1,Ada,Lovelace\ns3,,Paul\n"
    (course / "students.csv").write_text(roster, "utf-8")
    rows = collected(course, {})
    assert of("renamed", rows) == [("submitted/ada_lovelace/ps1", "is s1, ps1")]
    assert [who for who, _ in of("nothing usable", rows)] == ["s3"]
    assert files(course).keys() == {"s1/ps1"}
    owners = {key: owner for key, owner in read_owners(course).items() if "/" in key}
    assert owners == {"s1/ps1": ("1001", "Ada Lovelace")}
    assert of("nothing usable", [(*row.values(),)[:3] for row in read_report(course)]) == [
        ("s3", "all.zip: Paul_7_assignsubmission_file/a.pdf: it is neither a notebook nor a zip")
    ]
    assert of("renamed", collected(course, {})) == []


@pytest.mark.filterwarnings("ignore:Object of type <SubmittedAssignment>")  # nbgrader's own
def test_points_and_feedback_are_kept_when_a_roster_renames_the_folder(course):
    configure(Config())  # nbgrader finds alembic, which makes the gradebook
    files_of_moodle = {moodle("Ada Lovelace_1001"): answered(course)}
    collected(course, files_of_moodle)
    for folder in ("autograded", "feedback"):
        (course / folder / "ada_lovelace" / "ps1").mkdir(parents=True)
    database = f"sqlite:///{course / 'gradebook.db'}"
    with Gradebook(database) as gradebook:
        gradebook.add_assignment("ps1")
        gradebook.add_student("ada_lovelace")
        graded = gradebook.add_submission("ps1", "ada_lovelace").id
    (course / "students.csv").write_text("id,first_name,last_name\ns1,Ada,Lovelace\n", "utf-8")
    (course.parents[1] / "downloads" / moodle("Ada Lovelace_1001")).unlink()
    rows = collected(course, {moodle("Ada Lovelace_1001", "a.pdf"): b"%PDF-1.7"})
    assert of("renamed", rows) == [("submitted/ada_lovelace/ps1", "is s1, ps1")]
    assert of("missing", rows) == []
    with Gradebook(database) as gradebook:
        assert gradebook.find_submission("ps1", "s1").id == graded
        assert [each.student.id for each in gradebook.assignment_submissions("ps1")] == ["s1"]
    for folder in ("autograded", "feedback", "submitted"):
        assert (course / folder / "s1" / "ps1").is_dir()
        assert not (course / folder / "ada_lovelace").exists()


def test_facts_about_a_set_survive_the_collection_of_another(course):
    """A late file and a student without a notebook stay listed until they hand in another file."""
    late, due = [("late", "c, ps1"), ("nothing usable", "Dee 4")], datetime(2020, 1, 1)

    def kept():
        rows = read_report(course)
        return sorted((row["list"], row["what"]) for row in rows if row["list"] in dict(late))

    folder = course.parents[1] / "downloads"
    entries = {moodle("C_3"): answered(course), moodle("Dee_4", "a.pdf"): b"%PDF-1.7"}
    collected(course, {"one.zip": packed(entries)}, due)
    assert kept() == late
    other = {moodle("E_5", "ps2.ipynb"): answered(course, name="ps2")}
    for entries in (other, {moodle("F_6"): answered(course)}):
        shutil.rmtree(folder)
        collected(course, {"two.zip": packed(entries)})
        assert kept() == late
    assert read_owners(course)["Dee 4"] == ("4", "Dee")
    shutil.rmtree(folder)
    collected(course, {"three.zip": packed({moodle("Dee_4"): answered(course)})})
    assert kept() == late[:1]


def test_rows_of_a_run_without_any_set_are_replaced(course):
    bad = {moodle("Bob_1"): b"", moodle("Carol_2"): b""}
    for _ in range(2):
        rows = collected(course, bad)
        assert len(read_report(course)) == len(rows) == 4
    (course.parents[1] / "downloads" / moodle("Carol_2")).unlink()
    collected(course, {moodle("Bob_1"): answered(course)})
    left = [(row["list"], row["what"]) for row in read_report(course)]
    assert ("nothing usable", "Bob 1") not in left
    assert ("nothing usable", "Carol 2") in left


@pytest.mark.parametrize("place", [".", "source", "submitted", ".."])
def test_folders_of_the_course_are_not_downloads(course, place):
    (course / "submitted").mkdir(exist_ok=True)
    with pytest.raises(ValueError, match="folder: a folder with nothing but downloads is wanted"):
        collect(course / place, course)


def test_the_same_file_in_a_later_download_is_not_late(course):
    """Moodle gives all files the date of the download."""
    folder, work = course.parents[1] / "downloads", answered(course)
    for name, day in (("a", 20), ("b", 28)):
        (folder / f"{name}.zip").write_bytes(
            packed({moodle("A_1"): work}, (2026, 11, day, 12, 0, 0))
        )
        rows = collect(folder, course, datetime(2026, 11, 25))
        assert of("late", rows) == []
    (folder / "a.zip").unlink()
    assert of("late", collect(folder, course, datetime(2026, 11, 25))) == []


def test_a_newer_file_with_fewer_answers_is_named(course):
    folder, full = course.parents[1] / "downloads", answered(course)
    empty = (course / "source" / "ps1" / "ps1.ipynb").read_bytes()
    (folder / "a.zip").write_bytes(packed({moodle("A_1"): full}, (2026, 11, 20, 12, 0, 0)))
    (folder / "b.zip").write_bytes(packed({moodle("A_1"): empty}, (2026, 11, 22, 12, 0, 0)))
    ((who, why),) = of("fewer answers", collect(folder, course))
    assert who == "a, ps1"
    assert "a.zip: A_1_assignsubmission_file/ps1.ipynb has more answers" in why


def test_a_notebook_that_cannot_be_graded_is_named(course):
    folder, work = course.parents[1] / "downloads", json.loads(answered(course))
    work["cells"] = [{**work["cells"][0], "metadata": {}}]
    (folder / "a.zip").write_bytes(packed({moodle("A_1"): json.dumps(work).encode()}))
    rows = collect(folder, course)
    ((who, why),) = of("not gradable", rows)
    assert who == "a, ps1"
    assert "only 1 of the" in why
    assert len(of("collected", rows)) == 1
    (folder / "a.zip").write_bytes(packed({moodle("A_1"): answered(course)}, (2030, 1, 1, 0, 0, 0)))
    assert of("not gradable", collect(folder, course)) == []


def test_a_damaged_file_is_no_longer_refused_if_there_is_a_good_one(course):
    folder = course.parents[1] / "downloads"
    (folder / "a.zip").write_bytes(packed({moodle("A_1"): b"{"}))
    assert len(of("refused", collect(folder, course))) == 1
    (folder / "b.zip").write_bytes(packed({moodle("A_1"): answered(course)}))
    rows = collect(folder, course)
    assert of("refused", rows) == of("nothing usable", rows) == []
    assert "another file of the student is used" in of("duplicates", rows)[0][1]
