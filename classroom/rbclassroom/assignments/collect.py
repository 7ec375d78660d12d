"""Collect submissions from the downloads of an LMS into the folders that nbgrader reads.

The date of a file is often the date of the download: a file with a date up to the due date was in
time, but a file with a later date need not be late.
"""

import csv
import io
import json
import re
import unicodedata
from collections import defaultdict
from collections.abc import Iterable
from datetime import datetime
from pathlib import Path
from typing import Any, NamedTuple

import nbformat
from nbformat import NotebookNode

from rbclassroom.assignments.downloads import File, find_files, find_owners, written
from rbclassroom.assignments.safe_files import write_csv, write_whole
from rbclassroom.assignments.submissions import count_found, read_notebook

LISTS = ["collected", "unchanged", "late", "duplicates", "unmatched", "refused", "ignored"]
LISTS += ["nothing usable", "not on the roster", "missing"]
Row = tuple[str, str, str]  # a list, a file or student in this list, and the reason


class Upload(NamedTuple):
    """An upload by a student; the greatest of several, by their first four fields, is used."""

    number: int  # Canvas gives larger numbers to later uploads
    date: str
    prepared: bool  # whether the student's check wrote the file
    file: str
    about: dict[str, str]
    content: bytes


def collect(folder: Path, assignments: Path, due: datetime | None = None) -> list[Row]:
    """Copy the notebooks in a folder to ``submitted/``, and return a row for each file.

    If a student has several files for a set, the newest is used. A file in ``submitted/`` is
    replaced only by a newer one. ``submitted/report.csv`` stores the rows.
    """
    if not folder.is_dir():
        raise ValueError(f"folder: an existing folder is wanted, got {folder}")
    sets, roster = _read_sets(assignments), _read_roster(assignments / "students.csv")
    submitted, rows = assignments / "submitted", list[Row]()
    groups = defaultdict[tuple[str, str, str], list[Upload]](list)
    unused = defaultdict[str, list[str]](list)  # files of students without a notebook
    files = list(find_files(folder))
    found = ["" if file.kind else _set_of(file, sets) for file in files]
    for file, name, about in zip(files, found, find_owners(files, found), strict=True):
        why = "neither its name nor a folder names a student"
        why = file.why or (_mismatch(name, about, sets) if about else why)
        if about and not why:
            prepared = "/to_submit/" in f"/{about['file']}"
            place, first = (about["date"], prepared, file.label), int(about["number"] or 0)
            upload = Upload(first, *place, about, file.content)
            number = about["id"] or about["folder"] or about["name"]
            groups[name, _student(about, roster), number].append(upload)
            continue
        rows.append((file.kind or "unmatched", file.label, why))
        if about:
            unused[_label(about, roster)].append(f"{file.label}: {why}")
    for uploads in groups.values():
        unused.pop(_label(uploads[0].about, roster), None)
    rows += [("nothing usable", who, "; ".join(reasons)) for who, reasons in sorted(unused.items())]
    numbers = defaultdict[tuple[str, str], list[str]](list)
    for name, student, number in sorted(groups):
        numbers[name, student].append(number)
    stored, before = submitted / "owners.json", read_owners(assignments)
    for (name, student), several in numbers.items():
        if len(several) > 1 and (submitted / student / name).exists():
            why = "students have this name, and now numbered folders; delete this one"
            rows.append(("duplicates", f"submitted/{student}/{name}", f"{len(several)} {why}"))
    for (name, student, number), uploads in sorted(groups.items()):
        *others, best = sorted(uploads, key=lambda upload: upload[:4])
        same, who = numbers[name, student], student
        is_known = student in {row["id"] for row in roster}
        owner = best.about["id"], best.about["name"]
        another = before.get(f"{student}/{name}", owner)[0] != owner[0]
        if len(same) > 1 or (another and not is_known):
            plain = [_plain(each) for each in same]
            apart = len({*plain}) == len(plain)
            who = f"{student}_{_plain(number) if apart else same.index(number) + 1}"
        for key in [key for key, known in before.items() if owner[0] and known == owner]:
            if key.endswith(f"/{name}") and key != f"{who}/{name}":
                rows.append(_move(submitted / key, submitted / who / name))
                del before[key]
        before[f"{who}/{name}"] = owner
        rows += [("duplicates", other.file, f"{best.file} is used instead") for other in others]
        rows.append(_take(best, submitted / who / name))
        if best.about.get("late"):
            rows.append(("late", f"{who}, {name}", "Canvas marks it as late"))
        elif due and not best.about["number"] and best.date > written(due):
            why = f"perhaps: {best.date} may be the date of the download; look in Moodle"
            why = f"handed in at {best.date}" if best.about["exact"] else why
            rows.append(("late", f"{who}, {name}", why))
        if roster and who not in {row["id"] for row in roster}:
            rows.append(("not on the roster", who, f"{best.about['name']} ({number})"))
    for name in sorted({name for name, *_ in groups}):
        for row in roster:
            if not (submitted / row["id"] / name / f"{name}.ipynb").exists():
                words = f"{row.get('first_name', '')} {row.get('last_name', '')}".strip()
                rows.append(("missing", f"{row['id']}, {name}", words))
    lines = [dict(zip(("list", "what", "why"), row, strict=True)) for row in rows]
    write_whole(stored, json.dumps(before).encode())
    write_csv(submitted / "report.csv", lines or [{"list": "", "what": "", "why": ""}])
    return rows


def read_owners(assignments: Path) -> dict[str, tuple[str, str]]:
    """Return the number and the name in the LMS of each ``student/set`` that was collected."""
    stored = assignments / "submitted" / "owners.json"
    known = json.loads(stored.read_text("utf-8")) if stored.exists() else {}
    return {key: (who, "") if isinstance(who, str) else tuple(who) for key, who in known.items()}


def _move(old: Path, new: Path) -> Row:
    """Move a folder that was collected before the student was on the roster."""
    who = f"{new.parent.name}, {new.name}"
    if new.exists() or not old.exists():
        why = f"the same student as {who}; delete this folder if it is there"
        return "duplicates", f"submitted/{old.parent.name}/{old.name}", why
    new.parent.mkdir(parents=True, exist_ok=True)
    old.rename(new)
    return "renamed", f"submitted/{old.parent.name}/{old.name}", f"is {who}"


def _label(about: dict[str, str], roster: list[dict[str, str]]) -> str:
    """Return how a student is listed: the id in the roster, the folder, or the name and number."""
    student = _student(about, roster)
    if student in {row["id"] for row in roster}:
        return student
    return about["folder"] or f"{about['name']} {about['id']}".strip()


def _read_sets(assignments: Path) -> dict[str, list[NotebookNode]]:
    """Return the notebooks of each set: a private set can have other cells."""
    sets = defaultdict[str, list[NotebookNode]](list)
    for path in sorted(assignments.glob("*/*/*.ipynb")):
        if path.parts[-3] in ("source", "private", "release") and path.stem == path.parent.name:
            sets[path.stem].append(nbformat.read(path, as_version=4))
    if not sets:
        raise ValueError(f"{assignments} has no problem sets in source/")
    return sets


def _read_roster(path: Path) -> list[dict[str, str]]:
    if not path.exists():
        return []
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: a CSV file in UTF-8 is wanted ({error})") from error
    delimiter = max(",;\t", key=text.partition("\n")[0].count)
    table = csv.DictReader(io.StringIO(text, newline=""), delimiter=delimiter)
    rows = [{key: (value or "").strip() for key, value in row.items() if key} for row in table]
    for row in rows:
        if not re.fullmatch(r"[^\s./\\:*?\"<>|][^/\\:*?\"<>|]*", row.get("id", "")):
            raise ValueError(f"{path.name}: an id that can name a folder is wanted, got {row}")
    return rows


def _set_of(file: File, sets: dict[str, list[NotebookNode]]) -> str:
    """Return the set with the most cells in a notebook, or ""."""
    notebook = read_notebook(file.content, "it")
    shared = {name: max(count_found(notebook, one) for one in own) for name, own in sets.items()}
    named = _named(file.parts[-1], sets)
    best = max(sets, key=lambda name: (shared[name], name in named))
    return best if shared[best] else ""


def _named(name: str, sets: Iterable[str]) -> list[str]:
    return [s for s in sets if re.search(rf"(?<![^\W_]){re.escape(s)}(?!\d)", name, re.IGNORECASE)]


def _mismatch(name: str, about: dict[str, str], sets: Iterable[str]) -> str:
    """Return why a notebook is not used for the set that its cells belong to, or ""."""
    named = _named(Path(about["file"]).stem, sets)
    if not name:
        return "it is not a notebook of a handout"
    return f"its name is {named[0]}, its cells are of {name}" if named and name not in named else ""


def _plain(name: str) -> str:
    """Return a name in lower case without apostrophes, which Moodle removes."""
    name = re.sub("['`’]", "", unicodedata.normalize("NFKC", name).casefold())
    return re.sub(r"[\W_]+", "_", name).strip("_")[:60]


def _student(about: dict[str, str], roster: list[dict[str, str]]) -> str:
    """Return a student's id in the roster, or an id made from the name."""
    canvas, plain, number = bool(about["number"]), _plain(about["name"]), _plain(about["id"])
    found = [r["id"] for r in roster if canvas and r.get("lms_user_id") == about["id"]]
    found = found or [r["id"] for r in roster if r["id"] == about["name"]]
    key: Any = "".join if canvas else sorted  # Canvas writes names without spaces, last name first
    for row in roster if plain and not found else ():
        words = _plain(f"{row.get('last_name', '')} {row.get('first_name', '')}")
        found += [row["id"]] * (key(words.split("_")) == key(plain.split("_")))
    if len(found) == 1:
        return found[0]
    # names of unknown Canvas students, and anonymous or reserved names, get a number
    alone = plain not in ("", "participant", "aux", "con", "nul", "prn") and not canvas
    return plain if alone else f"{plain}_{number}".strip("_") or "student"


def _take(best: Upload, place: Path) -> Row:
    """Write an upload to its folder, unless a newer file is there; return a row for the report."""
    target, stamp = place / f"{place.name}.ipynb", place / "timestamp.txt"
    why = f"{place.parent.name}, {place.name}"
    if target.exists():
        # keep a file without a stamp, because it was not collected
        old = stamp.read_text(encoding="utf-8").strip() if stamp.exists() else "later"
        if target.read_bytes() == best.content or best.date == old:
            return "unchanged", best.file, why
        if best.date < old:
            return "duplicates", best.file, f"{why}: the file collected before is newer"
        why += ": it replaces the file collected before"
    write_whole(target, best.content)
    write_whole(stamp, f"{best.date}\n".encode())
    return "collected", best.file, why
