"""Collect submissions from the downloads of an LMS into the folders that nbgrader reads.

The date of a file is often the date of the download: a file with a date up to the due date was in
time, but a file with a later date need not be late.
"""

import csv
import io
import json
import re
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Iterator
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import Any

import nbformat
from nbformat import NotebookNode

from rbclassroom.assignments.downloads import File, find_files, find_owners, written
from rbclassroom.assignments.submissions import (
    Refused,
    count_found,
    count_written,
    read_notebook,
    restore,
)
from rbcourse.files import replace_file

LISTS = ["collected", "unchanged", "renamed", "late", "duplicates", "ignored", "another set"]
LISTS += ["fewer answers", "not gradable", "unmatched", "refused", "nothing usable"]
LISTS += ["not on the roster", "missing"]
OWN = "source", "private", "release", "handouts", "submitted", "autograded", "feedback"
NOT_OF_A_SET = "it is not a notebook of a handout; ask for the answers in a copy of the handout"
Row = tuple[str, str, str]  # a list, a file or student in this list, and the reason
Group = tuple[str, str, str]  # a set, a student, and the student's number or folder in the LMS
Owner = tuple[str, str]  # the number and the name of a student in the LMS


def collect(folder: Path, assignments: Path, due: datetime | None = None) -> list[Row]:
    """Copy the notebooks in a folder to ``submitted/``, and return a row for each file.

    If a student has several files for a set, the newest is used, and of files with the same date
    the one with more answers. A file in ``submitted/`` is replaced only by a newer one.
    ``submitted/report.csv`` stores the rows, and keeps those of other sets and other students from
    earlier runs.
    """
    if not folder.is_dir():
        raise ValueError(f"folder: an existing folder is wanted, got {folder}")
    _refuse_own_folders(folder.resolve(), assignments.resolve())
    sets, roster = _read_sets(assignments), _read_roster(assignments / "students.csv")
    submitted, owners = assignments / "submitted", read_owners(assignments)
    ids = {row["id"] for row in roster}
    groups, rows, labels = _grouped(folder, sets, roster)
    for who in sorted(ids & {*labels}):  # also students without a usable file in this download
        for name in sets:
            rows += _renamed(f"{who}/{name}", labels[who], owners, assignments)
    for group, uploads in groups.items():
        name, *_, number = group
        *others, best = uploads
        owner = best.about["id"], best.about["name"]
        who = _folder_of(group, [*groups], owner, owners, ids)
        rows += _renamed(f"{who}/{name}", owner, owners, assignments)
        owners[f"{who}/{name}"] = owner
        labels[who] = owner
        rows += [("duplicates", other.label, _why_not(other, best)) for other in others]
        dates = [each.about["date"] for each in uploads if each.content == best.content]
        dates += _date_of_same(best, submitted / who / name)
        rows.append(_take(best, submitted / who / name))
        fuller = [other.label for other in others if _rank(other)[3] > _rank(best)[3]]
        if fuller:
            why = f"{fuller[-1]} has more answers; look which one counts"
            rows.append(("fewer answers", f"{who}, {name}", why))
        if best.why:
            rows.append(("another set", f"{who}, {name}", best.why))
        if why := _why_refused(best, sets[name]):
            rows.append(("not gradable", f"{who}, {name}", why))
        if late := _why_late(best.about | {"date": min(dates)}, due):
            rows.append(("late", f"{who}, {name}", late))
        if roster and who not in ids:
            rows.append(("not on the roster", who, f"{best.about['name']} ({number})"))
    rows += _namesakes(groups, submitted)
    names = sorted({name for name, *_ in groups})
    for name in names:
        for row in roster:
            if not (submitted / row["id"] / name / f"{name}.ipynb").exists():
                who = f"{row.get('first_name', '')} {row.get('last_name', '')}".strip()
                rows.append(("missing", f"{row['id']}, {name}", who))
    # before there was a roster, the label was made from the name and the number
    seen = {*labels, *(f"{name} {number}".strip() for number, name in labels.values())}
    seen |= {what for _, what, _ in rows}
    before = [row for row in read_report(assignments) if _still_holds(row, names, seen)]
    now = [dict(zip(("list", "what", "why"), row, strict=True)) for row in rows]
    lines = [*before, *(row | {"sets": " ".join(names)} for row in now)]
    owners |= {what: labels[what] for kind, what, _ in rows if kind == "nothing usable"}
    submitted.mkdir(exist_ok=True)
    replace_file(submitted / "owners.json", json.dumps(owners).encode())
    write_csv(submitted / "report.csv", lines or [{"list": "", "what": "", "why": "", "sets": ""}])
    return rows


def _refuse_own_folders(folder: Path, assignments: Path) -> None:
    """Refuse a folder in which sets, handouts or collected files would be taken for uploads."""
    own = [assignments / name for name in OWN]
    if folder in (assignments, *assignments.parents) or any(
        path in (folder, *folder.parents) for path in own
    ):
        raise ValueError(
            f"folder: a folder with nothing but downloads is wanted, got {folder}, which has files "
            "of the course; move the downloads into a folder of their own"
        )


def _date_of_same(upload: File, place: Path) -> list[str]:
    """Return the date of the collected file if it has the same content."""
    target, stamp = place / f"{place.name}.ipynb", place / "timestamp.txt"
    same = target.exists() and stamp.exists() and target.read_bytes() == upload.content
    return [stamp.read_text("utf-8").strip()] if same else []


def _still_holds(row: dict[str, str], names: list[str], seen: Collection[str]) -> bool:
    """Tell whether a row of an earlier run is about other sets, or about another student.

    `seen` has the students and the files of this run. A row without sets is from a run that found
    no set.
    """
    sets, student = row["sets"].split(), row["what"].partition(", ")[0]
    if sets and not {*sets} & {*names}:
        return True
    of_students = "late", "nothing usable", "fewer answers", "not gradable", "another set"
    lasting = row["list"] in of_students or not sets
    return lasting and not {student, row["what"]} & {*seen}


def read_report(assignments: Path) -> list[dict[str, str]]:
    """Return the rows of all runs of `collect`, with the sets that each run collected."""
    report = assignments / "submitted" / "report.csv"
    text = report.read_text("utf-8-sig") if report.exists() else ""
    rows = csv.DictReader(io.StringIO(text, newline=""))
    return [{**row, "sets": row.get("sets") or ""} for row in rows]


def _grouped(
    folder: Path, sets: dict[str, list[NotebookNode]], roster: list[dict[str, str]]
) -> tuple[dict[Group, list[File]], list[Row], dict[str, Owner]]:
    """Return the notebooks of each student for each set, the best one last, and further rows.

    The rows are for the other files, and for students without a notebook. The last result has the
    number and the name of all students, by their labels.
    """
    groups = defaultdict[Group, list[File]](list)
    unused = defaultdict[str, list[str]](list)  # the files of each student that are not used
    ids, usable = {row["id"] for row in roster}, set[str]()  # usable: students with a notebook
    files, rows, labels = list(find_files(folder)), list[Row](), dict[str, Owner]()
    others = list[tuple[Row, list[tuple[str, str]]]]()  # with their sets and students
    for file in files:
        file.of_set = "" if file.kind else _set_of(file, sets)
    find_owners(files)
    for file in files:
        name, about = file.of_set, file.about
        if not about:
            why = file.why or "neither its name nor a folder names a student"
            rows.append((file.kind or "unmatched", file.label, why))
            continue
        student, name_and_id = _student(about, roster), f"{about['name']} {about['id']}".strip()
        label = student if student in ids else about["folder"] or name_and_id
        labels[label] = about["id"], about["name"]
        named = _named(Path(about["file"]).stem, sets)
        if file.kind or not name:
            why = file.why or NOT_OF_A_SET
        else:
            if named and name not in named:
                file.why = f"its name is {named[0]}, its cells are of {name}"
            groups[name, student, about["id"] or about["folder"] or about["name"]].append(file)
            usable.add(label)
            continue
        row = file.kind or "unmatched", file.label, why
        others.append((row, [(each, student) for each in named if file.kind != "ignored"]))
        unused[label].append(f"{file.label}: {why}")
    have = {group[:2] for group in groups}
    for (kind, what, why), wanted in others:
        if have & {*wanted}:
            kind, why = "duplicates", f"{why}; another file of the student is used"
        rows.append((kind, what, why))
    for notebooks in groups.values():
        notebooks.sort(key=_rank)
    for who in sorted(unused.keys() - usable):
        rows.append(("nothing usable", who, "; ".join(unused[who])))
    return dict(sorted(groups.items())), rows, labels


def _rank(file: File) -> tuple[bool, int, str, int, bool, str]:
    """Order the notebooks of a student for a set; the last one is used."""
    prepared = "/to_submit/" in f"/{file.about['file']}"  # the student's check wrote the file
    written = count_written(read_notebook(file.content, "it"))
    # Canvas gives larger numbers to later uploads
    upload = int(file.about["number"] or 0)
    return not file.why, upload, file.about["date"], written, prepared, file.label


def _why_not(other: File, best: File) -> str:
    """Return why another file of the student is not used."""
    same = ", of the same date," * (_rank(other)[:3] == _rank(best)[:3])
    more = " with more answers" * (bool(same) and _rank(other)[3] < _rank(best)[3])
    return f"{best.label}{same}{more} is used instead"


def _why_refused(file: File, sets: list[NotebookNode]) -> str:
    """Return why `grade` will refuse a notebook, or "" if it fits one of the sets of this name."""
    why = ""
    for one in sets:
        try:
            restore(read_notebook(file.content, file.label), one)
        except Refused as error:
            why = str(error)
        else:
            return ""
    return why


def _namesakes(groups: Iterable[Group], submitted: Path) -> Iterator[Row]:
    """Yield a row for each folder that was collected before another student had the same name."""
    for (name, student), count in Counter(group[:2] for group in groups).items():
        if count > 1 and (submitted / student / name).exists():
            why = f"{count} students have this name, and now numbered folders; delete this one"
            yield "duplicates", f"submitted/{student}/{name}", why


def _folder_of(
    group: Group, groups: list[Group], owner: Owner, owners: dict[str, Owner], ids: set[str]
) -> str:
    """Return the name of a student's folder; it has a number if others have the same name."""
    name, student, number = group
    same = [other[2] for other in groups if other[:2] == group[:2]]
    is_another = owners.get(f"{student}/{name}", owner)[0] != owner[0]
    if len(same) == 1 and (student in ids or not is_another):
        return student
    plain = [_plain(each) for each in same]
    are_apart = len({*plain}) == len(plain)
    return f"{student}_{_plain(number) if are_apart else same.index(number) + 1}"


def _renamed(key: str, owner: Owner, owners: dict[str, Owner], assignments: Path) -> Iterator[Row]:
    """Move work that was collected before the student was on the roster to ``student/set``.

    The points and comments of graded work, and its feedback, move, too.
    """
    who, _, name = key.rpartition("/")
    same = [old for old, known in owners.items() if owner[0] and known == owner and old != key]
    for old in (old for old in same if old.endswith(f"/{name}")):
        del owners[old]
        submitted = assignments / "submitted"
        if (submitted / key).exists() or not (submitted / old).exists():
            why = f"the same student as {who}, {name}; delete this folder if it is there"
            yield "duplicates", f"submitted/{old}", why
            continue
        _rename_in_gradebook(old, key, assignments / "gradebook.db")
        for folder in ("autograded", "feedback", "submitted"):
            if (assignments / folder / old).exists():
                (assignments / folder / who).mkdir(exist_ok=True)
                (assignments / folder / old).rename(assignments / folder / key)
                with suppress(OSError):  # it has other sets
                    (assignments / folder / old).parent.rmdir()
        owners[key] = owner
        yield "renamed", f"submitted/{old}", f"is {who}, {name}"


def _rename_in_gradebook(old: str, new: str, path: Path) -> None:
    """Give the points and comments of a ``student/set`` to another student."""
    if not path.exists():
        return
    from nbgrader.api import Gradebook, MissingEntry  # this import takes a second

    (before, _, name), (after, _, _) = old.rpartition("/"), new.rpartition("/")
    with Gradebook(f"sqlite:///{path.resolve()}") as gradebook, suppress(MissingEntry):
        submission = gradebook.find_submission(name, before)
        submission.student = gradebook.update_or_create_student(after)
        gradebook.db.commit()


def _why_late(about: dict[str, str], due: datetime | None) -> str:
    """Return why an upload is late, or ""."""
    if about["late"]:
        return "Canvas marks it as late"
    if not due or about["number"]:
        return ""
    if about["exact"] == "no":
        return "perhaps: the date in its name was not read; look in the LMS"
    if about["date"] <= written(due):
        return ""
    date = datetime.fromisoformat(about["date"].replace(" UTC", "+00:00"))
    local = f"{date.astimezone():%Y-%m-%d %H:%M:%S}"
    if about["exact"]:
        return f"handed in at {local}"
    return f"perhaps: {local} may be the date of the download; look in Moodle"


def read_owners(assignments: Path) -> dict[str, Owner]:
    """Return the number and the name in the LMS of each ``student/set`` that was collected."""
    stored = assignments / "submitted" / "owners.json"
    known = json.loads(stored.read_text("utf-8")) if stored.exists() else {}
    return {key: (number, name) for key, (number, name) in known.items()}


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


def _bare(name: str) -> str:
    """Return a plain name without accents, which some systems remove."""
    letters = unicodedata.normalize("NFKD", name)
    return _plain("".join(c for c in letters if not unicodedata.combining(c)))


def _plain(name: str) -> str:
    """Return a name in lower case without apostrophes, which Moodle removes."""
    name = re.sub("['`’]", "", unicodedata.normalize("NFKC", name).casefold())
    return re.sub(r"[\W_]+", "_", name).strip("_")[:60]


def _student(about: dict[str, str], roster: list[dict[str, str]]) -> str:
    """Return a student's id in the roster, or an id made from the name."""
    canvas, number = bool(about["number"]), _plain(about["id"])
    found = [r["id"] for r in roster if canvas and r.get("lms_user_id") == about["id"]]
    found = found or [r["id"] for r in roster if r["id"] == about["name"]]
    key: Any = "".join if canvas else sorted  # Canvas writes names without spaces, last name first
    for spell in _plain, _bare:
        wanted = spell(about["name"])
        for row in roster if wanted and not found else ():
            words = spell(f"{row.get('last_name', '')} {row.get('first_name', '')}")
            found += [row["id"]] * (key(words.split("_")) == key(wanted.split("_")))
    if len(found) == 1:
        return found[0]
    plain = _plain(about["name"])
    # names of unknown Canvas students, and anonymous or reserved names, get a number
    alone = plain not in ("", "participant", "aux", "con", "nul", "prn") and not canvas
    return plain if alone else f"{plain}_{number}".strip("_") or "student"


def _take(best: File, place: Path) -> Row:
    """Write an upload to its folder, unless a newer file is there; return a row for the report."""
    date = best.about["date"]
    target, stamp = place / f"{place.name}.ipynb", place / "timestamp.txt"
    why = f"{place.parent.name}, {place.name}" + f": {best.why}" * bool(best.why)
    if unsure := best.about["unsure"]:
        why += f" (or is “{unsure}” the student?)"
    if target.exists():
        # keep a file without a stamp, because it was not collected
        old = stamp.read_text(encoding="utf-8").strip() if stamp.exists() else "later"
        if target.read_bytes() == best.content:
            return "unchanged", best.label, why
        if date <= old:
            age = "has the same date" if date == old else "is newer"
            kept = f"the file collected before {age}; delete it to use this one"
            return "duplicates", best.label, f"{why}: {kept}"
        why += ": it replaces the file collected before"
    place.mkdir(parents=True, exist_ok=True)
    replace_file(target, best.content)
    replace_file(stamp, f"{date}\n".encode())
    return "collected", best.label, why


def write_csv(path: Path, rows: list[dict[str, Any]]) -> None:
    """Write a CSV table with the keys of the rows as columns; formulas become text."""
    columns = {key: "" for row in sorted(rows, key=len, reverse=True) for key in row}
    content = io.StringIO(newline="")
    table = csv.writer(content, lineterminator="\n")
    for row in (dict(zip(columns, columns, strict=True)), *rows):
        cells = [str(row.get(key, "")) for key in columns]
        formula = ("=", "+", "-", "@", "\t", "\r")
        table.writerow(f"'{cell}" if cell.startswith(formula) else cell for cell in cells)
    replace_file(path, content.getvalue().encode("utf-8-sig"))  # Excel needs the byte order mark
