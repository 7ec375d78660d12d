"""Collect submissions from Moodle or Canvas downloads into the folders that nbgrader reads.

The date of a file in a download is often that of the download. So one that is not after the due
date shows that the file was in time, and a later one shows nothing.
"""

import argparse
import csv
import io
import logging
import re
import sys
import tempfile
import unicodedata
import warnings
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import nbformat

from rbcourse.assignments.downloads import Download, find
from rbcourse.assignments.restore import grade_id

# of unknown and anonymous students, and names that Windows does not allow for a folder
NOT_ALONE = ("", "participant", "aux", "con", "nul", "prn")
LISTS = (
    *("collected", "unchanged", "late", "duplicates", "unmatched", "refused", "ignored"),
    *("not on the roster", "missing"),
)
RECORD = [
    *("student", "assignment", "lms", "lms_id", "lms_file", "name"),
    *("file", "date", "downloaded", "late"),
]


@dataclass
class _File:
    """A download, with the set and the student that it was found to be of."""

    of: Download
    assignment: str
    student: str = ""

    def order(self) -> tuple[Any, ...]:
        """Sort by upload; in one by what was made to be submitted, and by the number of a copy."""
        copy = re.search(r"[-_ (](\d{1,3})\)?$", Path(self.of.path).stem)
        prepared = "/to_submit/" in f"/{self.of.path}"
        return (*self.age(), prepared, int(copy[1]) if copy else 0, self.of.date, self.of.path)

    def age(self) -> tuple[int, str]:
        return self.of.number, _written(self.of.downloaded)


Rows = list[tuple[str, str, str]]
Record = dict[tuple[str, str], dict[str, str]]


def collect(folder: Path, assignments: Path, due: datetime | None = None) -> Rows:
    """Put the notebooks of a folder into ``submitted/`` and tell what became of each file.

    Of several files of a student for a set the newest is taken; what is in ``submitted/`` is
    replaced by a newer one only. ``submitted/collected.csv`` keeps who is who in Moodle and
    Canvas, ``submitted/report.csv`` what is returned.
    """
    if not folder.is_dir():
        raise ValueError(f"{folder}: there is no such folder")
    sets, roster = _read_sets(assignments), _read_roster(assignments / "students.csv")
    submitted = assignments / "submitted"
    submitted.mkdir(exist_ok=True)
    record, rows = _read_record(submitted / "collected.csv"), Rows()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as work:
        found = [_match(download, sets, rows) for download in find(folder, Path(work), rows)]
        files = [file for file in found if file]
        _name_students(files, roster, record)
        for own in _grouped(files):
            rows += _tell_late(own[-1], due)
            rows += _take(own, submitted, record)
            # at once: what is in submitted/ and the record of it belong together
            _write_csv(submitted / "collected.csv", [RECORD, *map(dict.values, record.values())])
    rows += _compare_with_roster(files, roster, submitted)
    _write_csv(submitted / "report.csv", [("list", "what", "why"), *rows])
    return rows


def _read_sets(assignments: Path) -> dict[str, set[str]]:
    """Return the names of the cells of each set."""
    sets: dict[str, set[str]] = {}
    for place in ("source", "private", "release"):
        for path in sorted((assignments / place).glob("*/*.ipynb")):
            if path.stem == path.parent.name:
                try:
                    sets.setdefault(path.stem, set()).update(_ids(path))
                except ValueError as error:
                    raise ValueError(f"{path}: {error}") from error
    if not sets:
        raise ValueError(f"{assignments}: no problem sets in source/ here")
    return sets


def _ids(path: Path) -> set[str]:
    """Return the names of the cells of a notebook; raise a ValueError for another file."""
    try:
        with warnings.catch_warnings():  # on cells without ids
            warnings.simplefilter("ignore")
            logging.disable()
            cells = nbformat.reads(path.read_text(encoding="utf-8-sig"), as_version=4).cells
            return {grade_id(cell) for cell in cells} - {""}
    except Exception as error:  # whatever nbformat stumbles over
        words = (str(error).splitlines() or [""])[0]
        raise ValueError(f"damaged, or no notebook: {words[:80]}") from error
    finally:
        logging.disable(logging.NOTSET)


def _read_roster(path: Path) -> list[dict[str, str]]:
    rows = _read_csv(path)
    for row in rows:
        if not re.fullmatch(r"[^\s./\\:*?\"<>|][^/\\:*?\"<>|]*", row.get("id", "")):
            raise ValueError(f"{path.name}: a row has no id, or one that names no folder: {row}")
    return rows


def _read_csv(path: Path) -> list[dict[str, str]]:
    if not path.exists():
        return []
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: save it as CSV in UTF-8 ({error})") from error
    head = text.partition("\n")[0]
    delimiter = max(",;\t", key=head.count)
    table = list(csv.DictReader(io.StringIO(text, newline=""), delimiter=delimiter))
    return [{k: (v or "").strip() for k, v in row.items() if k} for row in table]


def _read_record(path: Path) -> Record:
    rows = _read_csv(path)
    missing = [column for column in RECORD if rows and column not in rows[0]]
    if missing:
        raise ValueError(f"{path}: the columns {', '.join(missing)} are missing; restore them")
    return {(row["student"], row["assignment"]): row for row in rows}


def _match(download: Download, sets: dict[str, set[str]], rows: Rows) -> _File | None:
    """Find out of which set a file is, by its name and by its cells."""
    try:
        ids = _ids(download.content)
    except ValueError as error:
        rows.append(("unmatched", download.label, str(error)))
        return None
    shared = {name: len(ids & own) for name, own in sets.items()}
    stem = Path(download.path).stem
    named = [s for s in sets if re.search(rf"(?<![^\W_]){re.escape(s)}(?!\d)", stem, re.IGNORECASE)]
    best = max(sets, key=lambda name: (shared[name], name in named))
    name = max(named or [best], key=lambda name: shared[name])
    if not named and not shared[best]:
        why = "neither its name nor its cells are of a set"
    elif sets[name] and shared[name] < max(1, shared[best]):
        why = f"named {name}, but its cells are {f'of {best}' if shared[best] else 'of no set'}"
    else:
        return _File(download, name)
    rows.append(("unmatched", download.label, why))
    return None


def _plain(name: str) -> str:
    """Return a name in small letters of ASCII; of other scripts the numbers of the letters."""
    plain = ""
    for letter in unicodedata.normalize("NFKD", name).casefold():
        if letter.isascii():
            # Moodle takes apostrophes out of names
            plain += letter if letter.isalnum() else "" if letter in "'`" else "_"
        elif letter != "’" and not unicodedata.combining(letter):
            plain += f"_u{ord(letter):x}_" if letter.isalnum() else "_"
    return re.sub("_+", "_", plain).strip("_")[:60]


def _on_roster(of: Download, roster: list[dict[str, str]]) -> list[str]:
    """Return the ids of the roster that a file may be of.

    Canvas numbers persons, and writes the last name first, without spaces.
    """
    found = [row["id"] for row in roster if row.get("lms_user_id") == of.lms_id]
    if found and of.lms == "canvas":
        return found
    found = []
    for row in roster:
        words = row.get("last_name", ""), row.get("first_name", "")
        if of.lms == "canvas":
            same = _plain("".join(words)).replace("_", "") == _plain(of.name).replace("_", "")
        else:
            same = sorted(_plain(" ".join(words)).split("_")) == sorted(_plain(of.name).split("_"))
        found += [row["id"]] * (same and bool(_plain(of.name)))
    return found


def _name_students(files: list[_File], roster: list[dict[str, str]], record: Record) -> None:
    """Give each file the id of its student; who shares a name in a set gets the number too."""
    known = {
        _person(row["lms"], row["lms_id"], row["name"], set_): student
        for (student, set_), row in record.items()
    }
    persons = defaultdict[tuple[str, str, str], set[str]](set)
    for (student, set_), row in record.items():
        persons[row["lms"], set_, student].add(row["lms_id"])
    for file in files:
        of, found = file.of, _on_roster(file.of, roster)
        person = _person(of.lms, of.lms_id, of.name, file.assignment)
        if len(found) == 1:
            file.student = found[0]
        else:
            plain, number = _plain(of.name), _plain(of.lms_id)
            alone = of.lms == "moodle" and plain not in NOT_ALONE
            own = plain if alone else f"{plain}_{number}".strip("_") or "student"
            file.student = known.get(person, own)
        persons[of.lms, file.assignment, file.student].add(of.lms_id)
    for file in files:
        if len(persons[file.of.lms, file.assignment, file.student]) > 1:
            person = _person(file.of.lms, file.of.lms_id, file.of.name, file.assignment)
            file.student = known.get(person, f"{file.student}_{_plain(file.of.lms_id)}")


def _person(lms: str, number: str, name: str, assignment: str) -> tuple[str, ...]:
    """Return what is the same for a student each time; Moodle's numbers are those of a set."""
    return (lms, number) if lms == "canvas" else (lms, number, name, assignment)


def _grouped(files: list[_File]) -> list[list[_File]]:
    """Return the files of each student for each set, the newest last."""
    groups = defaultdict[tuple[str, str], list[_File]](list)
    for file in sorted(files, key=_File.order):
        groups[file.assignment, file.student].append(file)
    return [groups[key] for key in sorted(groups)]


def _take(files: list[_File], submitted: Path, record: Record) -> Rows:
    """Put the newest of the files of a student in its place, unless what is there is newer."""
    *others, best = files
    content, label = best.of.content.read_bytes(), best.of.label
    key = best.student, best.assignment
    rows = Rows()
    for other in others:
        same = other.of.content.read_bytes() == content
        why = f"{'the same as ' * same}{label}, which is taken"
        rows.append(("duplicates", other.of.label, why))
    place = submitted / best.student / best.assignment
    target, stamp = place / f"{best.assignment}.ipynb", place / "timestamp.txt"
    why, old = ", ".join(key), record.get(key)
    if target.exists():
        if target.read_bytes() == content or (old and _age(old) == best.age()):
            return [*rows, ("unchanged", label, why)]
        if _age(old) > best.age() if old else not _is_newer(best, stamp):
            return [*rows, ("duplicates", label, f"{why}: what was collected before is newer")]
        why += ": replaces what was collected before"
    place.mkdir(parents=True, exist_ok=True)
    for path, text in ((target, content), (stamp, f"{_written(best.of.date)}\n".encode())):
        part = path.with_suffix(".part")
        part.write_bytes(text)
        part.replace(path)
    of = best.of
    values = [*key, of.lms, of.lms_id, str(of.number), of.name, label, _written(of.date)]
    values += [_written(of.downloaded), "LATE" * of.marked_late]
    record[key] = dict(zip(RECORD, values, strict=True))
    return [*rows, ("collected", label, why)]


def _age(row: dict[str, str]) -> tuple[int, str]:
    return int(row["lms_file"]), row["downloaded"]


def _is_newer(file: _File, stamp: Path) -> bool:
    """Tell whether a file is newer than what was put there by other means."""
    return stamp.exists() and _written(file.of.date) > stamp.read_text(encoding="utf-8").strip()


def _written(date: datetime) -> str:
    """Return a local time as nbgrader reads it."""
    return f"{date.astimezone(UTC):%Y-%m-%d %H:%M:%S} UTC"


def _tell_late(file: _File, due: datetime | None) -> Rows:
    who = f"{file.student}, {file.assignment}"
    if file.of.marked_late:
        return [("late", who, "Canvas marks it")]
    if due and file.of.lms != "canvas" and file.of.date.astimezone(UTC) > due.astimezone(UTC):
        why = f"dated {file.of.date:%Y-%m-%d %H:%M}, which may be the download; look in Moodle"
        return [("late", who, f"perhaps: {why}")]
    return []


def _compare_with_roster(files: list[_File], roster: list[dict[str, str]], submitted: Path) -> Rows:
    ids = {row["id"] for row in roster}
    others = {
        (f.student, f"{f.of.name} ({f.of.lms} {f.of.lms_id})")
        for f in files
        if roster and f.student not in ids
    }
    rows = [("not on the roster", student, name) for student, name in sorted(others)]
    for name in sorted({file.assignment for file in files}):
        for row in roster:
            if not (submitted / row["id"] / name / f"{name}.ipynb").exists():
                who = f"{row.get('first_name', '')} {row.get('last_name', '')}".strip()
                rows.append(("missing", f"{row['id']}, {name}", who))
    return rows


def _write_csv(path: Path, rows: Iterable[Iterable[str]]) -> None:
    part = path.with_suffix(".part")
    with part.open("w", encoding="utf-8-sig", newline="") as stream:  # as Excel wants it
        csv.writer(stream).writerows(rows)
    part.replace(path)


def main() -> None:
    """Collect a folder: ``python -m rbcourse.assignments.collect FOLDER``, in the course."""
    parser = argparse.ArgumentParser(prog="python -m rbcourse.assignments.collect")
    parser.add_argument("folder", type=Path, help="with what was downloaded from Moodle and Canvas")
    parser.add_argument("--due", type=datetime.fromisoformat, help='"2026-12-01 23:59"')
    if isinstance(sys.stdout, io.TextIOWrapper):  # a console may not know every letter
        sys.stdout.reconfigure(errors="replace")
    known = parser.parse_args()
    try:
        rows = collect(known.folder, Path("notebooks/assignments"), known.due)
    except (OSError, ValueError) as error:
        sys.exit(str(error))
    for kind in LISTS:
        own = [f"  {what}: {why}" for name, what, why in rows if name == kind]
        if own or kind == "collected":
            print(f"{kind}: {len(own)}", *own, sep="\n")


if __name__ == "__main__":
    main()
