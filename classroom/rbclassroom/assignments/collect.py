"""Collect submissions from the downloads of an LMS into the folders that nbgrader reads.

Every file has a path through folders and zips. The path names the student as Moodle, Blackboard,
Brightspace, ILIAS or Canvas write it; otherwise each folder belongs to one student. Moodle names
files in mod/assign/classes/downloader.php, and Canvas in lib/content_zipper.rb. The date of a file
is often the date of the download: a file with a date up to the due date was in time, but a file
with a later date need not be late.
"""

import contextlib
import csv
import io
import json
import re
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, Any, NamedTuple
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile

import nbformat
from nbformat import NotebookNode

from rbclassroom.assignments.safe_files import write_csv, write_whole
from rbclassroom.assignments.submissions import count_found, read_notebook

CLEAR = [  # each of these patterns matches a whole path, and no other files have such names
    re.compile(rf"(?P<above>(?:.*?/)??){pattern}")
    for pattern in (
        # Moodle: Anna Berg_1234567_assignsubmission_file_/ps1.ipynb
        r"(?P<name>[^/]+?)(?:_(?P<id>\d+))?_assignsubmission_[a-z]+(?:_?/|_)(?P<file>.+)",
        # Blackboard: Set 1_aberg_attempt_2026-11-30-23-59-00_ps1.ipynb
        r"[^/]+?_(?P<name>[^/]+?)_attempt_(?P<date>\d{4}(?:-\d\d){5})(?:_|\.txt)(?P<file>.*)",
        # Brightspace: 397063-2557369 - Anna Berg - Nov 30, 2026 1159 PM/ps1.ipynb
        r"(?P<id>\d+-\d+) ?- ?(?P<name>[^/]+?) ?- ?(?P<date>[^/-]* \d{4} \d{3,4}(?: [AP]M)?)"
        r"(?:/| ?- ?)(?P<file>.+)",
    )
]
ILIAS = re.compile(r"(?P<name>.+_.+)_[^_]+_(?P<id>\d+)")  # a folder: Berg_Anna_aberg_4711
CANVAS = re.compile(  # a file: berganna_LATE_12345_67890_ps1.ipynb, but not 2026_11_30_ps1.ipynb
    r"(?:(?P<name>\d*[^\W\d_].*?)_)??(?P<late>LATE_)?(?P<id>anon_[^_]+|(?!(?:19|20)\d\d_\d\d?_)\d+)"
    r"_(?P<number>\d+)_(?P<file>.+)"
)
DATES = "%Y-%m-%d-%H-%M-%S", "%b %d, %Y %I%M %p"  # of Blackboard and Brightspace
PERSON = re.compile(r"[^\W\d_a-z]\w+[ _]+[^\W\d_a-z]\w+")  # as in "Anna Berg - ps1.ipynb"
GENERIC = {"to_submit", "work", "submissions", "submission", "downloads", "assignments", "email"}
JUNK = re.compile(r"/(__MACOSX|\.ipynb_checkpoints|original)/|/(\._[^/]*|\.DS_Store)$")
FILE_BYTES, UPLOAD_BYTES, DOWNLOAD_BYTES = 30_000_000, 100_000_000, 4_000_000_000
NOBODY = -1  # the level of a notebook that cannot be assigned to a student
DEPTH = 4  # zips in zips
LISTS = ["collected", "unchanged", "late", "duplicates", "unmatched", "refused", "ignored"]
LISTS += ["nothing usable", "not on the roster", "missing"]
Row = tuple[str, str, str]  # a list, a file or student in this list, and the reason


class File(NamedTuple):
    """A file in a download, which holds a notebook if `kind` is empty."""

    parts: tuple[str, ...]  # the folders, zips and names on its path
    dates: tuple[datetime | None, ...]  # of the parts that are files or zips
    label: str
    kind: str  # of the row in the report
    why: str
    content: bytes = b""


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
    files = list(_find(folder))
    found = ["" if file.kind else _set_of(file, sets) for file in files]
    for file, name, about in zip(files, found, _owners(files, found), strict=True):
        why = (
            _mismatch(name, about, sets)
            if about
            else "neither its name nor a folder names a student"
        )
        why = file.why or why
        if about and not why:
            prepared = "/to_submit/" in f"/{about['file']}"
            place, first = (about["date"], prepared, file.label), int(about["number"] or 0)
            upload = Upload(first, *place, about, file.content)
            number = about["id"] or about["folder"] or about["name"]
            groups[name, _student(about, roster), number].append(upload)
            continue
        rows.append((file.kind or "unmatched", file.label, why))
        if about:
            who = f"{about['name']} {about['id']}".strip()
            unused[who].append(f"{file.label}: {why}")
    for uploads in groups.values():
        unused.pop(f"{uploads[0].about['name']} {uploads[0].about['id']}".strip(), None)
    rows += [("nothing usable", who, "; ".join(reasons)) for who, reasons in sorted(unused.items())]
    numbers = defaultdict[tuple[str, str], list[str]](list)
    for name, student, number in sorted(groups):
        numbers[name, student].append(number)
    stored = submitted / "owners.json"
    before: dict[str, str] = json.loads(stored.read_text("utf-8")) if stored.exists() else {}
    for (name, student), several in numbers.items():
        if len(several) > 1 and (submitted / student / name).exists():
            why = (
                f"{len(several)} students have this name, and now numbered folders; delete this one"
            )
            rows.append(("duplicates", f"submitted/{student}/{name}", why))
    for (name, student, number), uploads in sorted(groups.items()):
        *others, best = sorted(uploads, key=lambda upload: upload[:4])
        same, who = numbers[name, student], student
        is_known = student in {row["id"] for row in roster}
        another = before.get(f"{student}/{name}", best.about["id"]) != best.about["id"]
        if len(same) > 1 or (another and not is_known):
            plain = [_plain(each) for each in same]
            apart = len({*plain}) == len(plain)
            who = f"{student}_{_plain(number) if apart else same.index(number) + 1}"
        before[f"{who}/{name}"] = best.about["id"]
        rows += [("duplicates", other.file, f"{best.file} is used instead") for other in others]
        rows.append(_take(best, submitted / who / name))
        if best.about.get("late"):
            rows.append(("late", f"{who}, {name}", "Canvas marks it as late"))
        elif due and not best.about["number"] and best.date > _written(due):
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


def _find(folder: Path) -> Iterator[File]:
    """Yield the files in a folder, in its zips, and in the zips inside these."""
    for path in sorted(folder.rglob("*")):
        label = _shown(path.relative_to(folder).as_posix())
        parts = tuple(label.split("/"))
        dates = (*[None] * (len(parts) - 1), datetime.fromtimestamp(path.lstat().st_mtime))
        if path.is_symlink():
            yield File(parts, dates, label, "refused", "it is a link")
        elif path.is_file():
            try:
                with path.open("rb") as stream:
                    yield from _look(File(parts, dates, label, "", ""), stream, [DOWNLOAD_BYTES])
            except OSError as error:
                yield File(parts, dates, label, "refused", str(error.strerror))


def _look(file: File, stream: IO[bytes], room: list[int], depth: int = 0) -> Iterator[File]:
    """Yield a file, or the files in a zip; `room` has the number of bytes that may be read."""
    suffix = Path(file.parts[-1]).suffix.lower()
    try:
        if JUNK.search("/" + "/".join(file.parts)):
            yield file._replace(kind="ignored", why="it is not a file to submit")
        elif suffix == ".zip" and depth == DEPTH:
            raise ValueError("it is a zip in too many zips; unpack it by hand")
        elif suffix == ".zip":
            with ZipFile(stream) as zipped:
                yield from _look_into(zipped, file, room, depth)
        else:
            content = stream.read(FILE_BYTES + 1)
            large = len(content) > FILE_BYTES
            if suffix != ".ipynb" and (large or not _holds_notebook(content)):
                yield file._replace(kind="ignored", why="it is neither a notebook nor a zip")
                return
            if large:
                raise ValueError("it is too large")
            read_notebook(content, "it")
            yield file._replace(content=content)
    except Exception as error:  # a damaged zip raises many kinds of errors
        yield file._replace(kind="refused", why=str(error) or type(error).__name__)


def _look_into(zipped: ZipFile, file: File, room: list[int], depth: int) -> Iterator[File]:
    entries = [entry for entry in zipped.infolist() if not entry.is_dir()]
    # a zip of a student may hold less than the zip of a class
    room = [min(room[0], UPLOAD_BYTES)] if depth else room
    if sum(entry.file_size for entry in entries) > room[0]:
        raise ValueError("it contains too many bytes; unpack it by hand")
    for entry in entries:
        name = _shown(entry.filename)
        inner = [part for part in re.split(r"[/\\]", name) if part not in ("", ".", "..")] or ["?"]
        when = file.dates[-1]
        with contextlib.suppress(ValueError):  # some programs write no date
            when = datetime(*entry.date_time)
        dates = (*file.dates, *[None] * (len(inner) - 1), when)
        found = File((*file.parts, *inner), dates, f"{file.label}: {name}", "", "")
        try:
            # one small block of bzip2 or LZMA can become gigabytes
            if entry.compress_type not in (ZIP_STORED, ZIP_DEFLATED):
                raise ValueError("its kind of compression is not accepted; zip it again")
            most = UPLOAD_BYTES if name.lower().endswith(".zip") else FILE_BYTES
            with zipped.open(entry) as stream:
                content = stream.read(min(most, room[0]) + 1)
            room[0] -= len(content)
            if room[0] < 0:
                raise ValueError("the zip contains too many bytes; unpack it by hand")
        except Exception as error:  # a damaged zip raises many kinds of errors
            yield found._replace(kind="refused", why=str(error) or type(error).__name__)
            continue
        yield from _look(found, io.BytesIO(content), room, depth + 1)


def _holds_notebook(content: bytes) -> bool:
    """Tell whether a file with any name is a notebook; browsers add .json or .txt to the name."""
    with contextlib.suppress(ValueError):
        read_notebook(content, "it")
        return True
    return False


def _owners(files: list[File], found: list[str]) -> list[dict[str, str] | None]:
    """Return for each file the name, the id and so on of its student, or None.

    `found` has the set of each notebook.
    """
    beside = defaultdict[tuple[str, ...], set[str]](set)  # the parts below each path
    for file in files:
        for at in range(len(file.parts) * (not file.kind)):
            beside[file.parts[:at]].add(file.parts[at])
    owners = [_owner(file, beside) for file in files]
    # in the other downloads, one folder belongs to each student
    named = {f.parts[0] for f, owner in zip(files, owners, strict=True) if owner and f.parts[1:]}
    loose = {at: f.parts for at, f in enumerate(files) if f.parts[1:] and f.parts[0] not in named}
    notebooks = {at: parts for at, parts in loose.items() if not files[at].kind}
    levels = {at: k for at, k in _levels(notebooks, 0, found).items() if k != NOBODY}
    above = {parts[: levels[at]] for at, parts in notebooks.items() if at in levels}
    for at, parts in loose.items():
        level = next((k for k in range(len(parts) - 1) if parts[:k] in above), 0)
        if (
            parts[:level] in above
            and levels.get(at, level) == level
            and (at in levels or files[at].kind)
        ):
            about = {
                "name": parts[level].removesuffix(".zip"),
                "folder": "/".join(parts[: level + 1]),
            }
            about["file"] = "/".join(parts[level + 1 :])
            owners[at] = _about(about, files[at], level)
    return owners


def _levels(notebooks: dict[int, tuple[str, ...]], level: int, found: list[str]) -> dict[int, int]:
    """Return for each notebook which part of its path names the student, if one does.

    `found` has the sets of the files. A folder belongs to a class if folders in it have notebooks
    of the same set, and to nobody if its notebooks have the names of several persons.
    """
    below = defaultdict[str, dict[int, tuple[str, ...]]](dict)
    for at, parts in notebooks.items():
        if len(parts) > level + 1:
            below[parts[level]][at] = parts
    own, deeper, classes = dict[int, int](), dict[int, int](), False
    for folder, inside in below.items():
        direct = {at: parts for at, parts in inside.items() if len(parts) == level + 2}
        under = _levels(inside, level + 1, found)
        students = Counter(
            (found[at], inside[at][: k + 1]) for at, k in under.items() if k != NOBODY
        )
        sets = Counter(name for name, _ in students)
        persons = {m[0] for parts in direct.values() if (m := PERSON.search(parts[-1]))}
        is_class = not direct and max(sets.values(), default=0) > 1
        classes = classes or is_class
        if len(persons) > 1 or (not direct and NOBODY in under.values()):
            own |= dict.fromkeys(inside, NOBODY)
        elif folder.removesuffix(".zip").casefold() in GENERIC.union(found) or is_class:
            own |= under
        else:
            own |= dict.fromkeys(inside, level)
            deeper |= under if not direct else {}
    return own | (deeper if classes else {})


def _owner(file: File, beside: dict[tuple[str, ...], set[str]]) -> dict[str, str] | None:
    """Return the data of a student in the names that an LMS gives, or None."""
    for pattern in CLEAR:
        if match := pattern.fullmatch("/".join(file.parts)):
            return _about(match.groupdict(), file, match["above"].count("/"))
    for at, part in enumerate(file.parts):
        siblings, rest = beside[file.parts[:at]], "/".join(file.parts[at + 1 :])
        several = len(siblings) > 1 and all(map(ILIAS.fullmatch, siblings))
        if rest and several and (match := ILIAS.fullmatch(part)):
            return _about({**match.groupdict(), "file": rest}, file, at)
        inside = beside[file.parts[: at + 1]]  # of a zip
        is_file = not rest or part.lower().endswith(".zip")
        whole = at == 0 and rest and inside and all(map(CANVAS.fullmatch, inside))
        match = CANVAS.fullmatch(part)
        if match and is_file and not whole and _is_class(file.parts[:at], siblings):
            name = "/".join(filter(None, (match["file"], rest)))
            return _about({**match.groupdict(), "file": name}, file, at)
    return None


def _is_class(above: tuple[str, ...], siblings: set[str]) -> bool:
    """Tell whether a path has files of a class, or is the folder of one student.

    A student, too, can give names that look like those of Canvas.
    """
    matches = [CANVAS.fullmatch(name) for name in siblings]
    several = len({match["id"] for match in matches if match}) > 1
    top = not above or (len(above) == 1 and above[0].lower().endswith(".zip"))
    return top or (several and all(matches))


def _about(found: dict[str, Any], file: File, at: int) -> dict[str, str]:
    """Complete the data of a student; the date is that of the upload, not of a file in a zip."""
    about = dict.fromkeys(("name", "id", "folder", "late", "number", "file", "exact"), "")
    about |= {key: value or "" for key, value in found.items()}
    written = _written(next(date for date in file.dates[at:] if date))
    for form in DATES:
        with contextlib.suppress(ValueError, OverflowError):
            written = _written(datetime.strptime(about.get("date", ""), form))
            about["exact"] = "yes"
    return about | {"date": written}


def _shown(name: str) -> str:
    """Return a name in normal form C, without control characters."""
    with contextlib.suppress(UnicodeError):  # many zips do not declare that their names are UTF-8
        name = name.encode("cp437").decode("utf-8")
    name = name.encode("utf-8", "backslashreplace").decode("utf-8")
    return re.sub(r"[\x00-\x1f]", "?", unicodedata.normalize("NFC", name))


def _written(date: datetime) -> str:
    """Return a local time as text that nbgrader reads."""
    return f"{date.astimezone(UTC):%Y-%m-%d %H:%M:%S} UTC"


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
