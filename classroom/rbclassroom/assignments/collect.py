"""Collect submissions from Moodle or Canvas downloads into the folders that nbgrader reads.

Moodle names the files in mod/assign/classes/downloader.php, and Canvas in lib/content_zipper.rb.
The date of a file is often the date of the download. A file with a date up to the due date was in
time; a file with a later date need not be late.
"""

import contextlib
import csv
import io
import re
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, Any, NamedTuple
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile

from rbclassroom.assignments.locked_cells import decode, grade_id, read_notebook
from rbclassroom.assignments.safe_files import write_csv, write_whole

MOODLE = re.compile(
    r"(?:.*?/)??(?P<name>[^/]+?)(?:_(?P<id>\d+))?_assignsubmission_[a-z]+(?:_?/|_)(?P<file>.+)"
)
CANVAS = re.compile(
    r"(?:.*?/)??(?:(?P<name>[^/]+?)_)??(?P<late>LATE_)?(?P<id>\d+|anon_[^/_]+)"
    r"_(?P<number>\d+)_(?P<file>.+)"
)
JUNK = re.compile(r"/(__MACOSX|\.ipynb_checkpoints|original)/|/(\._[^/]*|\.DS_Store)$")
FILE_BYTES, UPLOAD_BYTES = 30_000_000, 100_000_000
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
    unused = defaultdict[str, list[str]](list)  # files of each student that hold no notebook
    for found in _find(folder):
        if not isinstance(found, Upload):
            rows.append(found)
            for owner in filter(None, map(_owner, found[1].split(": "))):
                unused[f"{owner['name'] or ''} {owner['id'] or ''}".strip()].append(found[1])
            continue
        name, why = _match(found, sets)
        if why:
            rows.append(("unmatched", found.file, why))
        else:
            groups[name, _student(found.about, roster), found.about["id"]].append(found)
    for uploads in groups.values():
        unused.pop(f"{uploads[0].about['name']} {uploads[0].about['id']}".strip(), None)
    rows += [("nothing usable", who, ", ".join(names)) for who, names in sorted(unused.items())]
    namesakes = Counter((name, student) for name, student, _ in groups)
    for (name, student), several in namesakes.items():
        if several > 1 and (submitted / student / name).exists():
            why = f"{several} students have this name, and now numbered folders; delete this one"
            rows.append(("duplicates", f"submitted/{student}/{name}", why))
    for (name, student, number), uploads in sorted(groups.items()):
        *others, best = sorted(uploads, key=lambda upload: upload[:4])
        who = student if namesakes[name, student] == 1 else f"{student}_{_plain(number)}"
        rows += [("duplicates", other.file, f"{best.file} is used instead") for other in others]
        rows.append(_take(best, submitted / who / name))
        if best.about.get("late"):
            rows.append(("late", f"{who}, {name}", "Canvas marks it as late"))
        elif due and "number" not in best.about and best.date > _written(due):
            why = f"perhaps: {best.date} may be the date of the download; look in Moodle"
            rows.append(("late", f"{who}, {name}", why))
        if roster and who not in {row["id"] for row in roster}:
            rows.append(("not on the roster", who, f"{best.about['name']} ({number})"))
    for name in sorted({name for name, *_ in groups}):
        for row in roster:
            if not (submitted / row["id"] / name / f"{name}.ipynb").exists():
                words = f"{row.get('first_name', '')} {row.get('last_name', '')}".strip()
                rows.append(("missing", f"{row['id']}, {name}", words))
    lines = [dict(zip(("list", "what", "why"), row, strict=True)) for row in rows]
    write_csv(submitted / "report.csv", lines or [{"list": "", "what": "", "why": ""}])
    return rows


def _find(folder: Path) -> Iterator[Upload | Row]:
    """Yield the notebooks in a folder, in its zips, and in students' zips inside these."""
    for path in sorted(folder.rglob("*")):
        name = _shown(path.relative_to(folder).as_posix())
        if path.is_symlink():
            yield "refused", name, "it is a link"
        elif path.is_file():
            with path.open("rb") as stream:
                date = datetime.fromtimestamp(path.stat().st_mtime)
                yield from _look(name, name, stream, date)


def _look(label: str, name: str, stream: IO[bytes], date: datetime) -> Iterator[Upload | Row]:
    """Yield the notebooks in a file, or the reason why it is not used.

    `name` is the path of the file through all zips, and identifies the student.
    """
    suffix, owner = Path(name).suffix.lower(), _owner(name)
    try:
        if JUNK.search(f"/{owner['file'] if owner else name}"):
            yield "ignored", label, "it is not a file to submit"
            return
        if suffix == ".zip":
            with ZipFile(stream) as zipped:
                yield from _look_into(zipped, label, name, date)
            return
        content = stream.read(FILE_BYTES + 1)
        large = len(content) > FILE_BYTES
        if suffix != ".ipynb" and (large or not _holds_notebook(content)):
            yield "ignored", label, "it is neither a notebook nor a zip"
        elif large:
            raise ValueError("it is too large")
        elif not owner:
            yield "unmatched", label, "its name does not contain a student"
        else:
            read_notebook(content, "it")
            about = {key: value or "" for key, value in owner.groupdict().items()}
            number, prepared = int(about.get("number", 0)), "/to_submit/" in f"/{about['file']}"
            yield Upload(number, _written(date), prepared, label, about, content)
    except Exception as error:  # a damaged zip raises many kinds of errors
        yield "refused", label, str(error) or type(error).__name__


def _holds_notebook(content: bytes) -> bool:
    """Tell whether a file with any name is a notebook; browsers add .json or .txt to the name."""
    with contextlib.suppress(ValueError):
        text = decode(content).lstrip()
        return text.startswith("{") and ('"cells"' in text or '"worksheets"' in text)
    return False


def _look_into(zipped: ZipFile, label: str, name: str, date: datetime) -> Iterator[Upload | Row]:
    entries = [(_shown(e.filename), e) for e in zipped.infolist() if not e.is_dir()]
    # the name of a complete download may look like an upload to Canvas
    whole = label == name and not MOODLE.fullmatch(name) and any(_owner(n) for n, _ in entries)
    upload, size = _owner(name) and not whole, sum(entry.file_size for _, entry in entries)
    if upload and (".zip/" in name.lower() or size > UPLOAD_BYTES):
        raise ValueError("it contains a zip, or too many bytes; unpack it by hand")
    total = 0
    for inner, entry in entries:
        most = UPLOAD_BYTES if inner.lower().endswith(".zip") else FILE_BYTES
        try:
            # one small block of bzip2 or LZMA can become gigabytes
            if entry.compress_type not in (ZIP_STORED, ZIP_DEFLATED):
                raise ValueError("its kind of compression is not accepted; zip it again")
            with zipped.open(entry) as stream:
                content = stream.read(most + 1)
            # dates in a zip of a student are not used
            when = date if upload else datetime(*entry.date_time)
        except Exception as error:  # a damaged zip raises many kinds of errors
            yield "refused", f"{label}: {inner}", str(error) or type(error).__name__
            continue
        total += len(content)
        if upload and total > UPLOAD_BYTES:
            raise ValueError("it contains a zip, or too many bytes; unpack it by hand")
        full = f"{name}/{inner}" if upload else inner
        yield from _look(f"{label}: {inner}", full, io.BytesIO(content), when)


def _shown(name: str) -> str:
    """Return a name in normal form C, without control characters."""
    with contextlib.suppress(UnicodeError):  # many zips do not declare that their names are UTF-8
        name = name.encode("cp437").decode("utf-8")
    name = name.encode("utf-8", "replace").decode("utf-8")
    return re.sub(r"[\x00-\x1f]", "?", unicodedata.normalize("NFC", name))


def _owner(name: str) -> re.Match[str] | None:
    return MOODLE.fullmatch(name) or CANVAS.fullmatch(name)


def _written(date: datetime) -> str:
    """Return a local time as text that nbgrader reads."""
    return f"{date.astimezone(UTC):%Y-%m-%d %H:%M:%S} UTC"


def _read_sets(assignments: Path) -> dict[str, set[str]]:
    """Return the grade_ids of the cells of each set."""
    sets = defaultdict[str, set[str]](set)
    for path in sorted(assignments.glob("*/*/*.ipynb")):
        if path.parts[-3] in ("source", "private", "release") and path.stem == path.parent.name:
            cells = read_notebook(path.read_bytes(), str(path)).cells
            sets[path.stem] |= {grade_id(cell) for cell in cells} - {""}
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


def _match(upload: Upload, sets: dict[str, set[str]]) -> tuple[str, str]:
    """Return the set that fits a notebook's cells, and a reason if the notebook is not used."""
    cells, stem = read_notebook(upload.content, "it").cells, Path(upload.about["file"]).stem
    shared = {name: len({grade_id(cell) for cell in cells} & own) for name, own in sets.items()}
    named = [s for s in sets if re.search(rf"(?<![^\W_]){re.escape(s)}(?!\d)", stem, re.IGNORECASE)]
    best = max(sets, key=lambda name: (shared[name], name in named))
    if not shared[best]:
        return "", "it is not a notebook of a handout"
    misnamed = named and best not in named
    return best, f"its name is {named[0]}, its cells are of {best}" if misnamed else ""


def _plain(name: str) -> str:
    """Return a name in lower case without apostrophes, which Moodle removes."""
    name = re.sub("['`’]", "", unicodedata.normalize("NFKC", name).casefold())
    return re.sub(r"[\W_]+", "_", name).strip("_")[:60]


def _student(about: dict[str, str], roster: list[dict[str, str]]) -> str:
    """Return a student's id in the roster, or an id made from the name."""
    canvas, plain, number = "number" in about, _plain(about["name"]), _plain(about["id"])
    found = [r["id"] for r in roster if canvas and r.get("lms_user_id") == about["id"]]
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
    text = decode(best.content).encode()
    note = "; it is now stored in UTF-8" * (text != best.content)
    why = f"{place.parent.name}, {place.name}{note}"
    if target.exists():
        # keep a file without a stamp, because it was not collected
        old = stamp.read_text(encoding="utf-8").strip() if stamp.exists() else "later"
        if target.read_bytes() == text or best.date == old:
            return "unchanged", best.file, why
        if best.date < old:
            return "duplicates", best.file, f"{why}: the file collected before is newer"
        why += ": it replaces the file collected before"
    write_whole(target, text)
    write_whole(stamp, f"{best.date}\n".encode())
    return "collected", best.file, why
