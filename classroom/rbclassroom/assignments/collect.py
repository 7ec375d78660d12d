"""Collect submissions from Moodle or Canvas downloads into the folders that nbgrader reads.

The names are those that mod/assign/classes/downloader.php of Moodle and lib/content_zipper.rb of
Canvas give. The date of a file in a download is often that of the download: one that is not after
the due date shows that the file was in time, and a later one shows nothing.
"""

import contextlib
import csv
import io
import re
import unicodedata
import zlib
from collections import Counter, defaultdict
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, Any, NamedTuple
from zipfile import BadZipFile, ZipFile

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
# RuntimeError is raised for a password, NotImplementedError, one of them, for a method
BROKEN = (BadZipFile, zlib.error, EOFError, OSError, RuntimeError, ValueError)
LISTS = ["collected", "unchanged", "late", "duplicates", "unmatched", "refused", "ignored"]
LISTS += ["not on the roster", "missing"]
Row = tuple[str, str, str]  # one of the lists, a file or a student, and why


class Upload(NamedTuple):
    """A notebook that a student handed in; of several the one to take sorts last."""

    number: int  # of Canvas, where they rise
    date: str
    prepared: bool  # made to be submitted
    file: str
    about: dict[str, str]
    content: bytes


def collect(folder: Path, assignments: Path, due: datetime | None = None) -> list[Row]:
    """Put the notebooks of a folder into ``submitted/`` and tell what became of each file.

    Of several files of a student for a set the newest is taken; what is in ``submitted/`` is
    replaced by a newer one only. ``submitted/report.csv`` keeps what is returned.
    """
    if not folder.is_dir():
        raise ValueError(f"{folder}: there is no such folder")
    sets, roster = _read_sets(assignments), _read_roster(assignments / "students.csv")
    submitted, rows = assignments / "submitted", list[Row]()
    groups = defaultdict[tuple[str, str, str], list[Upload]](list)
    for found in _find(folder):
        if not isinstance(found, Upload):
            rows.append(found)
            continue
        name, why = _match(found, sets)
        if why:
            rows.append(("unmatched", found.file, why))
        else:
            groups[name, _student(found.about, roster), found.about["id"]].append(found)
    namesakes = Counter((name, student) for name, student, _ in groups)
    for (name, student), several in namesakes.items():
        if several > 1 and (submitted / student / name).exists():
            why = f"{several} have this name, and now their numbers too; delete this folder"
            rows.append(("duplicates", f"submitted/{student}/{name}", why))
    for (name, student, number), uploads in sorted(groups.items()):
        *others, best = sorted(uploads, key=lambda upload: upload[:4])
        who = student if namesakes[name, student] == 1 else f"{student}_{_plain(number)}"
        rows += [("duplicates", other.file, f"{best.file} is taken") for other in others]
        rows.append(_take(best, submitted / who / name))
        if best.about.get("late"):
            rows.append(("late", f"{who}, {name}", "Canvas marks it"))
        elif due and "number" not in best.about and best.date > _written(due):
            why = f"perhaps: dated {best.date}, which may be the download; look in Moodle"
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
    """Yield the notebooks in a folder, in the zips in it, and in the zips of students."""
    for path in sorted(folder.rglob("*")):
        name = _shown(path.relative_to(folder).as_posix())
        if path.is_symlink():
            yield "refused", name, "a link"
        elif path.is_file():
            with path.open("rb") as stream:
                date = datetime.fromtimestamp(path.stat().st_mtime)
                yield from _look(name, name, stream, date)


def _look(label: str, name: str, stream: IO[bytes], date: datetime) -> Iterator[Upload | Row]:
    """Look at a file; its name, with the zips that it was in, tells the student."""
    suffix, owner = Path(name).suffix.lower(), _owner(name)
    try:
        if JUNK.search(f"/{owner['file'] if owner else name}"):
            yield "ignored", label, "not to be submitted"
        elif suffix == ".zip":
            with ZipFile(stream) as zipped:
                yield from _look_into(zipped, label, name, date)
        elif suffix != ".ipynb":
            yield "ignored", label, "no notebook, and no zip"
        elif not owner:
            yield "unmatched", label, "its name names no student"
        else:
            read_notebook(content := stream.read(), "it")
            about = {key: value or "" for key, value in owner.groupdict().items()}
            number, prepared = int(about.get("number", 0)), "/to_submit/" in f"/{about['file']}"
            yield Upload(number, _written(date), prepared, label, about, content)
    except BROKEN as error:
        yield "refused", label, str(error)


def _look_into(zipped: ZipFile, label: str, name: str, date: datetime) -> Iterator[Upload | Row]:
    entries = [(_shown(e.filename), e) for e in zipped.infolist() if not e.is_dir()]
    # the name of a whole download may look like that of an upload to Canvas
    whole = label == name and not MOODLE.fullmatch(name) and any(_owner(n) for n, _ in entries)
    upload, size = _owner(name) and not whole, sum(entry.file_size for _, entry in entries)
    if upload and (".zip/" in name.lower() or size > UPLOAD_BYTES):
        raise ValueError("it is a zip in a zip, or too much; unpack it by hand")
    for inner, entry in entries:
        wanted = inner.lower().endswith((".ipynb", ".zip"))
        try:
            if wanted and entry.file_size > FILE_BYTES:
                raise ValueError("too large")
            content = zipped.read(entry) if wanted else b""
            # files in a student's zip have the dates of the student's machine
            when = date if upload else datetime(*entry.date_time)
        except BROKEN as error:
            yield "refused", f"{label}: {inner}", str(error)
            continue
        full = f"{name}/{inner}" if upload else inner
        yield from _look(f"{label}: {inner}", full, io.BytesIO(content), when)


def _shown(name: str) -> str:
    """Return a name in composed letters that can be written and stand in a line."""
    with contextlib.suppress(UnicodeError):  # many zips are in UTF-8 and do not say so
        name = name.encode("cp437").decode("utf-8")
    name = name.encode("utf-8", "replace").decode("utf-8")
    return re.sub(r"[\x00-\x1f]", "?", unicodedata.normalize("NFC", name))


def _owner(name: str) -> re.Match[str] | None:
    return MOODLE.fullmatch(name) or CANVAS.fullmatch(name)


def _written(date: datetime) -> str:
    """Return a local time as nbgrader reads it."""
    return f"{date.astimezone(UTC):%Y-%m-%d %H:%M:%S} UTC"


def _read_sets(assignments: Path) -> dict[str, set[str]]:
    """Return the names of the cells of each set."""
    sets = defaultdict[str, set[str]](set)
    for path in sorted(assignments.glob("*/*/*.ipynb")):
        if path.parts[-3] in ("source", "private", "release") and path.stem == path.parent.name:
            cells = read_notebook(path.read_bytes(), str(path)).cells
            sets[path.stem] |= {grade_id(cell) for cell in cells} - {""}
    if not sets:
        raise ValueError(f"{assignments}: no problem sets in source/ here")
    return sets


def _read_roster(path: Path) -> list[dict[str, str]]:
    """Return the rows of the roster, with any delimiter; no rows if there is no roster."""
    if not path.exists():
        return []
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: save it as CSV in UTF-8 ({error})") from error
    delimiter = max(",;\t", key=text.partition("\n")[0].count)
    table = csv.DictReader(io.StringIO(text, newline=""), delimiter=delimiter)
    rows = [{key: (value or "").strip() for key, value in row.items() if key} for row in table]
    for row in rows:
        if not re.fullmatch(r"[^\s./\\:*?\"<>|][^/\\:*?\"<>|]*", row.get("id", "")):
            raise ValueError(f"{path.name}: a row has no id, or one that names no folder: {row}")
    return rows


def _match(upload: Upload, sets: dict[str, set[str]]) -> tuple[str, str]:
    """Return the set of a file, by its cells and its name, or the reason why there is none."""
    cells, stem = read_notebook(upload.content, "it").cells, Path(upload.about["file"]).stem
    shared = {name: len({grade_id(cell) for cell in cells} & own) for name, own in sets.items()}
    named = [s for s in sets if re.search(rf"(?<![^\W_]){re.escape(s)}(?!\d)", stem, re.IGNORECASE)]
    best = max(sets, key=lambda name: (shared[name], name in named))
    if not shared[best]:
        return "", "its cells are of no set"
    return (
        best,
        "" if best in named or not named else f"named {named[0]}, but its cells are of {best}",
    )


def _plain(name: str) -> str:
    """Return a name in small letters and digits; Moodle takes apostrophes out of names."""
    name = re.sub("['`’]", "", unicodedata.normalize("NFKC", name).casefold())
    return re.sub(r"[\W_]+", "_", name).strip("_")[:60]


def _student(about: dict[str, str], roster: list[dict[str, str]]) -> str:
    """Return a student's id in the roster, or an id made from the name."""
    canvas, plain, number = "number" in about, _plain(about["name"]), _plain(about["id"])
    found = [r["id"] for r in roster if canvas and r.get("lms_user_id") == about["id"]]
    key: Any = "".join if canvas else sorted  # Canvas writes the last name first, without spaces
    for row in roster if plain and not found else ():
        words = _plain(f"{row.get('last_name', '')} {row.get('first_name', '')}")
        found += [row["id"]] * (key(words.split("_")) == key(plain.split("_")))
    if len(found) == 1:
        return found[0]
    # of an unknown or anonymous student, or a name that Windows does not allow for a folder
    alone = plain not in ("", "participant", "aux", "con", "nul", "prn") and not canvas
    return plain if alone else f"{plain}_{number}".strip("_") or "student"


def _take(best: Upload, place: Path) -> Row:
    """Put a file in its place, unless a newer one is there."""
    target, stamp = place / f"{place.name}.ipynb", place / "timestamp.txt"
    text = decode(best.content).encode()
    note = "; it is stored in UTF-8, which it was not" * (text != best.content)
    why = f"{place.parent.name}, {place.name}{note}"
    if target.exists():
        # without a stamp it was put there by other means
        old = stamp.read_text(encoding="utf-8").strip() if stamp.exists() else "later"
        if target.read_bytes() == text or best.date == old:
            return "unchanged", best.file, why
        if best.date < old:
            return "duplicates", best.file, f"{why}: what was collected before is newer"
        why += ": replaces what was collected before"
    write_whole(target, text)
    write_whole(stamp, f"{best.date}\n".encode())
    return "collected", best.file, why
