"""What was downloaded from Moodle and Canvas, put where nbgrader looks for it."""

import csv
import io
import os
import subprocess
import sys
import zipfile
from datetime import datetime

import nbformat
import pytest
from nbformat.v4 import new_markdown_cell
from nbgrader.utils import parse_utc
from tiny import MODULE
from tiny_set import write_tiny_set

from rbclassroom.assignments.__main__ import main
from rbclassroom.assignments.collect import collect
from rbclassroom.assignments.writing import quoted

DAY = (2026, 11, 20, 12, 0, 0)
LATER = (2026, 12, 2, 12, 0, 0)
FILES = {"collected", "unchanged", "duplicates", "unmatched", "refused", "ignored"}


@pytest.fixture
def course(tmp_path):
    """A course with two sets, and an empty folder for downloads."""
    assignments = tmp_path / "notebooks" / "assignments"
    for name in ("ps1", "ps2"):
        path = write_tiny_set(assignments, name)
        path.write_text(path.read_text("utf-8").replace("square", f"{name}_square"), "utf-8")
    (tmp_path / "downloads").mkdir()
    return assignments


def answered(course, words="mine", name="ps1"):
    """A notebook of a set, as bytes."""
    notebook = nbformat.read(course / "source" / name / f"{name}.ipynb", as_version=4)
    notebook.cells.append(new_markdown_cell(words, id="own"))
    return nbformat.writes(notebook).encode()


def packed(entries, date=DAY):
    """A zip, as bytes."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, content in entries.items():
            entry = name if isinstance(name, zipfile.ZipInfo) else zipfile.ZipInfo(name, date)
            archive.writestr(entry, content)
    return stream.getvalue()


def collected(course, files, due=None):
    """Collect files that lie in the folder of downloads; return the lists."""
    folder = course.parents[1] / "downloads"
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    rows = collect(folder, course, due)
    assert before == {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    with (course / "submitted" / "report.csv").open(encoding="utf-8", newline="") as stream:
        kept = [tuple(row) for row in csv.reader(stream)][1:]
    assert kept == [tuple(map(quoted, row)) for row in rows] or not rows
    named = [what for kind, what, _ in rows if kind in FILES]
    assert len(named) == len(set(named)), "a file is in one list"
    return rows


def of(kind, rows):
    return [(what, why) for name, what, why in rows if name == kind]


def students(course):
    found = (course / "submitted").glob("*/*/*.ipynb")
    return sorted(path.relative_to(course / "submitted").as_posix() for path in found)


def words_of(course, student, name="ps1"):
    path = course / "submitted" / student / name / f"{name}.ipynb"
    return nbformat.read(path, as_version=4).cells[-1].source


@pytest.mark.parametrize(
    ("entry", "student"),
    [
        ("Anna Berg_1234567_assignsubmission_file_/ps1.ipynb", "anna_berg"),
        ("Anna Berg_1234567_assignsubmission_file/ps1.ipynb", "anna_berg"),
        ("Anna Berg_1234567_assignsubmission_file/in a folder/ps1.ipynb", "anna_berg"),
        ("Anna Berg_1234567_assignsubmission_file_ps1.ipynb", "anna_berg"),
        ("Group A_77_assignsubmission_file/ps1.ipynb", "group_a"),
        ("---_assignsubmission_file/ps1.ipynb", "student"),
        ("Con_3_assignsubmission_file/ps1.ipynb", "con_3"),
        ("Default group_assignsubmission_file/ps1.ipynb", "default_group"),
        ("Participant_1234567_assignsubmission_file_/ps1.ipynb", "participant_1234567"),
        ("Jürg Ø'Brien-Łuk_1_assignsubmission_file_/ps1.ipynb", "jürg_øbrien_łuk"),
        ("王 伟_12_assignsubmission_file_/ps1.ipynb", "王_伟"),
        ("berganna_12345_67890_ps1.ipynb", "berganna_12345"),
        ("berganna_LATE_12345_67890_ps1-1.ipynb", "berganna_12345"),
        ("anon_x7Yz1_67890_ps1.ipynb", "anon_x7yz1"),
        ("LATE_anon_x7Yz1_67890_ps1.ipynb", "anon_x7yz1"),
    ],
)
@pytest.mark.parametrize("packing", ["zip", "loose"])
def test_each_known_name_tells_the_student(entry, student, packing, course):
    content = answered(course)
    files = {"ROB_2026_01_all.zip": packed({entry: content})} if packing == "zip" else {}
    rows = collected(course, files or {entry: content})
    assert students(course) == [f"{student}/ps1/ps1.ipynb"]
    assert [kind for kind, *_ in rows if kind != "late"] == ["collected"]
    assert bool(of("late", rows)) == ("LATE" in entry)
    assert (course / "submitted" / students(course)[0]).read_bytes() == content


def test_nbgrader_reads_the_time(course):
    collected(course, {"a.zip": packed({"A_1_assignsubmission_file/ps1.ipynb": answered(course)})})
    stamp = (course / "submitted" / "a" / "ps1" / "timestamp.txt").read_text("utf-8").strip()
    offset = datetime(*DAY).astimezone().utcoffset()
    assert parse_utc(stamp) == datetime(*DAY) - offset


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_what_is_written_in_another_way_is_stored_in_utf8_and_said(encoding, course):
    content = answered(course, "ü")
    name = "A_1_assignsubmission_file/ps1.ipynb"
    rows = collected(course, {name: content.decode().encode(encoding)})
    assert of("collected", rows) == [(name, "a, ps1; it is stored in UTF-8, which it was not")]
    assert (course / "submitted/a/ps1/ps1.ipynb").read_bytes() == content


def test_no_name_becomes_a_formula_in_a_spreadsheet(course):
    name = "=cmd' -C calc'!A0_1_assignsubmission_file/ps1.ipynb"
    collected(course, {name: answered(course)})
    with (course / "submitted" / "report.csv").open(encoding="utf-8-sig") as stream:
        cells = [cell for row in csv.reader(stream) for cell in row]
    assert f"'{name}" in cells
    assert not [cell for cell in cells if cell.startswith(("=", "+", "-", "@"))]
    assert of("unchanged", collected(course, {}))


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("ps1-2.ipynb", "ps1"),
        ("ps1 (1).ipynb", "ps1"),
        ("PS1_final.ipynb", "ps1"),
        ("my_ps2.ipynb", "ps2"),
        ("homework.ipynb", "ps1"),
    ],
)
def test_the_set_is_told_by_name_and_by_cells(name, found, course):
    content = answered(course, name=found)
    collected(course, {f"A_1_assignsubmission_file/{name}": content})
    assert students(course) == [f"a/{found}/{found}.ipynb"]


def test_what_is_of_no_set_is_unmatched_and_says_why(course):
    other = nbformat.v4.new_notebook(cells=[new_markdown_cell("mine")])
    empty = nbformat.writes(other).encode()
    files = {
        "A_1_assignsubmission_file/ps1.ipynb": answered(course, name="ps2"),
        "B_2_assignsubmission_file/ps1.ipynb": empty,
        "C_3_assignsubmission_file/ps12.ipynb": empty,
        "D_4_assignsubmission_file/ps1.ipynb": b"no notebook",
        "ps1.ipynb": answered(course),
    }
    rows = collected(course, files)
    why = [text for _, text in of("unmatched", rows)]
    assert why[0] == "named ps1, but its cells are of ps2"
    assert why[1] == "its cells are of no set"
    assert why[2] == "its cells are of no set"
    assert why[3] == "its name names no student"
    assert "no notebook" in of("refused", rows)[0][1]
    assert students(course) == []


def test_names_in_utf8_that_is_not_declared_and_in_parts_are_one_student(course):
    plain = "Jörg Müller_1_assignsubmission_file/ps1.ipynb"
    content = answered(course)
    undeclared = bytearray(packed({plain: content}))
    for mark, at in ((b"PK\x03\x04", 7), (b"PK\x01\x02", 9)):
        undeclared[undeclared.index(mark) + at] &= ~0x08
    parts = "Jo\u0308rg Mu\u0308ller_1_assignsubmission_file/ps1.ipynb"
    rows = collected(course, {"a.zip": bytes(undeclared), "b.zip": packed({parts: content})})
    assert students(course) == ["jörg_müller/ps1/ps1.ipynb"]
    assert len(of("duplicates", rows)) == 1
    assert all("Jörg Müller" in what for _, what, _ in rows)


def test_students_of_the_same_name_are_kept_apart_whenever_they_come(course):
    first = {"Al Li_11_assignsubmission_file/ps1.ipynb": answered(course, "first")}
    second = {"Al Li_22_assignsubmission_file/ps1.ipynb": answered(course, "second")}
    collected(course, first)
    rows = collected(course, second)
    why = "2 have this name, and now their numbers too; delete this folder"
    assert of("duplicates", rows) == [("submitted/al_li/ps1", why)]
    assert words_of(course, "al_li_11") == "first"
    assert words_of(course, "al_li_22") == "second"


def test_a_student_has_one_id_in_each_set_though_moodle_numbers_anew(course):
    one = {"Al Li_11_assignsubmission_file/ps1.ipynb": answered(course)}
    two = {"Al Li_99_assignsubmission_file/ps2.ipynb": answered(course, name="ps2")}
    collected(course, one | two)
    assert students(course) == ["al_li/ps1/ps1.ipynb", "al_li/ps2/ps2.ipynb"]


def test_a_roster_of_another_spreadsheet_is_read_or_its_fault_is_named(course):
    roster = course / "students.csv"
    roster.write_text("id;first_name;last_name\ns1;Jörg;Müller\n", "utf-8")
    notebook = {"Müller Jörg_500_assignsubmission_file/ps1.ipynb": answered(course)}
    collected(course, notebook)
    assert students(course) == ["s1/ps1/ps1.ipynb"]
    roster.write_text("id,first_name,last_name\ns1,Jörg,Müller\n", "cp1252")
    with pytest.raises(ValueError, match=r"students\.csv: save it as CSV in UTF-8"):
        collected(course, {})


def test_the_roster_gives_ids_and_tells_who_is_missing(course):
    roster = "id,first_name,last_name,email,lms_user_id\n"
    roster += "s1,Jörg,Müller,,\ns2,Eva,Maria Roth,,\ns3,Al,Li,,500\ns4,Bo,Ek,,\ns5,Al,O'Neil,,\n"
    (course / "students.csv").write_text(roster, "utf-8-sig")
    files = {
        "Müller Jörg_500_assignsubmission_file/ps1.ipynb": answered(course),
        "mariarotheva_7_1_ps1.ipynb": answered(course),
        "renamed_500_2_ps1.ipynb": answered(course),
        "Al ONeil_9_assignsubmission_file/ps1.ipynb": answered(course),
        "New One_8_assignsubmission_file/ps1.ipynb": answered(course),
    }
    rows = collected(course, files)
    assert students(course) == [
        f"{who}/ps1/ps1.ipynb" for who in ("new_one", "s1", "s2", "s3", "s5")
    ]
    assert of("missing", rows) == [("s4, ps1", "Bo Ek")]
    assert of("not on the roster", rows) == [("new_one", "New One (8)")]


@pytest.mark.parametrize("row", ["../x,A,B,", "a/b,A,B,", ",A,B,"])
def test_a_roster_whose_ids_name_no_folder_is_refused(row, course):
    (course / "students.csv").write_text(f"id,first_name,last_name,email\n{row}\n", "utf-8")
    with pytest.raises(ValueError, match="names no folder"):
        collected(course, {})


def test_of_the_zip_of_a_student_what_was_made_to_be_submitted_is_taken(course):
    inner = {
        "work/ps1.ipynb": answered(course, "work"),
        "ps1/to_submit/ps1.ipynb": answered(course, "to submit"),
        "ps1/original/ps1.ipynb": answered(course, "original"),
        "ps1/data.csv": b"1",
        "__MACOSX/ps1/._ps1.ipynb": b"junk",
    }
    upload = packed(inner, LATER)
    rows = collected(course, {"m.zip": packed({"A B_1_assignsubmission_file/x.zip": upload})})
    assert words_of(course, "a_b") == "to submit"
    assert len(of("duplicates", rows)) == 1
    assert len(of("ignored", rows)) == 3
    assert datetime(*DAY).astimezone() == datetime.fromisoformat(
        (course / "submitted/a_b/ps1/timestamp.txt").read_text("utf-8").strip()[:-4] + "+00:00"
    )
    collected(course, {"ek_5_6_up.zip": upload})
    assert words_of(course, "ek_5") == "to submit"


@pytest.mark.parametrize(
    "inner",
    ["Bob Bee_2_assignsubmission_file/ps1.ipynb", "ps1_2026_11_final.ipynb", "img/plot_2026_11_20"],
)
def test_what_a_student_packs_is_of_that_student_whatever_its_name(course, inner):
    upload = packed({"ps1.ipynb": answered(course), inner: answered(course)}, (2030, 1, 1, 0, 0, 0))
    theirs = {"Ann Ay_1_assignsubmission_file/ps1.zip": upload}
    collected(course, {"all.zip": packed(theirs)})
    assert students(course) == ["ann_ay/ps1/ps1.ipynb"]
    collected(course, theirs)
    assert students(course) == ["ann_ay/ps1/ps1.ipynb"]


def test_an_upload_that_holds_too_much_is_refused_at_once(course):
    much = packed({f"{k}.mp4": bytes(10**7) for k in range(11)})
    rows = collected(course, {"Ann Ay_1_assignsubmission_file/ps1.zip": much})
    ((_, why),) = of("refused", rows)
    assert why == "it is a zip in a zip, or too much; unpack it by hand"


def _linked():
    entry = zipfile.ZipInfo("C_3_assignsubmission_file/ps1.ipynb", DAY)
    entry.external_attr = 0o120777 << 16
    return entry


def test_what_is_not_safe_is_refused_and_the_others_are_collected(course):
    good = answered(course)
    encrypted = bytearray(packed({"E_5_assignsubmission_file/ps1.ipynb": good}))
    encrypted[6] |= 1
    encrypted[encrypted.index(b"PK\x01\x02") + 8] |= 1
    broken = bytearray(packed({"F_6_assignsubmission_file/ps1.ipynb": good}))
    broken[200] ^= 0xFF
    bomb = io.BytesIO()
    with zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("H_8_assignsubmission_file/ps1.ipynb", bytes(31_000_000))
    folder = "{}_assignsubmission_file/ps1.ipynb"
    entries = {
        "../" + folder.format("A_1"): good,
        "/tmp/" + folder.format("B_2"): good,
        _linked(): b"/etc/passwd",
        "..\\" + folder.format("D_4"): good,
        "G_7_assignsubmission_file/a.zip": packed({"a.zip": packed({"ps1.ipynb": good})}),
        "I_9_assignsubmission_file/a.zip": b"no zip",
        "J_9_assignsubmission_file/a.rar": b"Rar!",
        "K_9_assignsubmission_onlinetext/onlinetext.html": b"words",
        folder.format("Good One_10"): good,
    }
    files = {"a.zip": packed(entries), "b.zip": bytes(encrypted), "c.zip": bytes(broken)}
    rows = collected(course, files | {"d.zip": bomb.getvalue(), "e.zip": b"PK", "f.zip": b""})
    # a name that leads out leads nowhere: of it only the student is read
    assert students(course) == [f"{who}/ps1/ps1.ipynb" for who in ("a", "b", "d", "good_one")]
    why = dict(of("refused", rows))
    assert len(why) == 8
    for words in ("encrypted", "too large", "it is a zip in a zip"):
        assert sum(words in reason for reason in why.values()) == 1, words
    assert len(of("ignored", rows)) == 2


@pytest.mark.skipif(os.name == "nt", reason="links need a permission there")
def test_links_in_the_folder_are_not_followed(course):
    folder = course.parents[1] / "downloads"
    (folder / "A_1_assignsubmission_file_ps1.ipynb").symlink_to(course / "source/ps1/ps1.ipynb")
    rows = collected(course, {})
    assert of("refused", rows) == [("A_1_assignsubmission_file_ps1.ipynb", "a link")]


def test_of_several_uploads_to_canvas_the_last_is_taken_whatever_the_dates(course):
    names = {"li_5_100_ps1.ipynb": LATER, "li_5_300_ps1-2.ipynb": DAY, "li_5_200_ps1-1.ipynb": DAY}
    zips = {f"{k}.zip": packed({k: answered(course, k)}, when) for k, when in names.items()}
    rows = collected(course, zips)
    assert words_of(course, "li_5") == "li_5_300_ps1-2.ipynb"
    assert len(of("duplicates", rows)) == 2


def test_a_newer_download_replaces_and_an_older_one_does_not(course):
    name = "A_1_assignsubmission_file/ps1.ipynb"
    collected(course, {"a.zip": packed({name: answered(course, "new")}, LATER)})
    rows = collected(course, {"a.zip": packed({name: answered(course, "old")}, DAY)})
    assert words_of(course, "a") == "new"
    assert "what was collected before is newer" in of("duplicates", rows)[0][1]
    newest = (2026, 12, 3, 12, 0, 0)
    rows = collected(course, {"b.zip": packed({name: answered(course, "newest")}, newest)})
    assert words_of(course, "a") == "newest"
    assert "replaces" in of("collected", rows)[0][1]


def test_collecting_twice_changes_nothing(course):
    name = "A_1_assignsubmission_file/ps1.ipynb"
    files = {
        "a.zip": packed({name: answered(course)}),
        "b_2_3_ps2.ipynb": answered(course, "", "ps2"),
    }

    def state():
        paths = (course / "submitted").rglob("*")
        return {p: p.read_bytes() for p in paths if p.is_file() and p.name != "report.csv"}

    assert len(of("collected", collected(course, files))) == 2
    before = state()
    rows = collected(course, {})
    assert [kind for kind, *_ in rows] == ["unchanged", "unchanged"]
    assert state() == before
    again = {"c.zip": packed({name: answered(course)}, LATER)}
    assert of("collected", collected(course, again)) == []
    assert state() == before


def test_what_a_teacher_mended_by_hand_stays(course):
    collected(course, {"a.zip": packed({"A_1_assignsubmission_file/ps1.ipynb": answered(course)})})
    target = course / "submitted" / "a" / "ps1" / "ps1.ipynb"
    target.write_bytes(answered(course, "mended"))
    assert of("unchanged", collected(course, {}))
    assert words_of(course, "a") == "mended"


def test_late_is_what_canvas_marks_and_perhaps_what_is_dated_after_the_due_date(course):
    entries = {
        "A_1_assignsubmission_file/ps1.ipynb": answered(course),
        "b_2_3_ps1.ipynb": answered(course),
        "c_LATE_3_4_ps1.ipynb": answered(course),
    }
    rows = collected(course, {"a.zip": packed(entries, LATER)}, datetime(2026, 12, 1, 23, 59))
    late = dict(of("late", rows))
    assert set(late) == {"a, ps1", "c_3, ps1"}
    assert late["a, ps1"].startswith("perhaps: dated 2026-12-02 12:00")
    assert len(of("collected", rows)) == 3


def test_the_command_prints_each_list(course):
    folder = course.parents[1]
    (folder / "downloads" / "Ö X_1_assignsubmission_file_ps1.ipynb").write_bytes(answered(course))
    (folder / "downloads" / "notes.txt").write_bytes(b"")
    done = subprocess.run(
        [*MODULE, "rbclassroom.assignments", "collect", "downloads", "--due", "2000-01-01 12:00"],
        cwd=folder,
        capture_output=True,
        encoding="ascii",
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
    )
    assert done.stderr == ""
    heads = [line for line in done.stdout.splitlines() if not line.startswith(" ")]
    assert heads == ["collected: 1", "late: 1", "ignored: 1"]


def test_a_folder_that_is_none_is_named(course, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["assignments", "collect", "nowhere"])
    with pytest.raises(SystemExit, match="nowhere: there is no such folder"):
        main()
