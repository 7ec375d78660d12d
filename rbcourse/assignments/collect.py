"""Collect submissions from Moodle or Canvas downloads into the folders that nbgrader reads.

The names are those that mod/assign/classes/downloader.php of Moodle and lib/content_zipper.rb of
Canvas give. The date of a file in a download is often that of the download: one that is not after
the due date shows that the file was in time, and a later one shows nothing.
"""

import argparse
import contextlib
import io
import re
import sys
import unicodedata
import zipfile
import zlib
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, Any

from rbcourse.assignments.restore import decode, grade_id, read_notebook
from rbcourse.assignments.writing import read_csv, write_csv, write_whole

MOODLE = re.compile(
    r"(?:.*?/)??(?P<name>[^/]+?)(?:_(?P<id>\d+))?"
    r"_assignsubmission_(?P<kind>[a-z]+)(?:_?/|_)(?P<file>.+)"
)
CANVAS = re.compile(
    r"(?:.*?/)??(?:(?P<name>[^/]+?)_)??(?P<late>LATE_)?(?P<id>\d+|anon_[^/_]+)"
    r"_(?P<number>\d+)_(?P<file>.+)"
)
JUNK = re.compile(r"/(__MACOSX|\.ipynb_checkpoints|original)/|/(\._[^/]*|\.DS_Store)$")
ARCHIVES = (".rar", ".7z", ".gz", ".tgz", ".tar", ".bz2", ".xz")
FILE_BYTES, UPLOAD_BYTES, UPLOAD_FILES = 30_000_000, 100_000_000, 1000
# RuntimeError is raised for a password, NotImplementedError, one of them, for a method
BROKEN = (zipfile.BadZipFile, zlib.error, EOFError, OSError, RuntimeError, ValueError)
# of unknown and anonymous students, and names that Windows does not allow for a folder
NOT_ALONE = ("", "participant", "aux", "con", "nul", "prn")
LISTS = ["collected", "unchanged", "late", "duplicates", "unmatched", "refused", "ignored"]
LISTS += ["not on the roster", "missing"]
Rows = list[tuple[str, str, str]]
Record = dict[tuple[str, str], dict[str, str]]


@dataclass
class Upload:
    """A notebook that a student handed in, as `collected.csv` lists it.

    `lms_id` is the number of the student in the LMS (Moodle numbers a student anew in each
    assignment), `lms_file` what Canvas gives to each upload, and rises; `downloaded` is the date
    of the newest file in the same zip.
    """

    student: str
    assignment: str
    lms: str
    lms_id: str
    lms_file: str
    name: str
    file: str
    date: str
    downloaded: str
    late: str

    def __post_init__(self) -> None:
        self.path, self.text, self.note = "", "", ""

    def order(self) -> tuple[Any, ...]:
        """Sort by upload; in one by what was made to be submitted, and by the number of a copy."""
        copy = re.search(r"[-_ (](\d{1,3})\)?$", Path(self.path).stem)
        prepared = "/to_submit/" in f"/{self.path}"
        return (*_age(asdict(self)), prepared, int(copy[1]) if copy else 0, self.date, self.path)


def _age(row: dict[str, str]) -> tuple[int, str]:
    return int(row["lms_file"] or 0), row["downloaded"]


def collect(folder: Path, assignments: Path, due: datetime | None = None) -> Rows:
    """Put the notebooks of a folder into ``submitted/`` and tell what became of each file.

    Of several files of a student for a set the newest is taken; what is in ``submitted/`` is
    replaced by a newer one only. ``submitted/collected.csv`` keeps who is who in Moodle and
    Canvas, ``submitted/report.csv`` what is returned.
    """
    if not folder.is_dir():
        raise ValueError(f"{folder}: there is no such folder")
    sets, roster = _read_sets(assignments), _read_roster(assignments / "students.csv")
    submitted, rows = assignments / "submitted", Rows()
    submitted.mkdir(exist_ok=True)
    record = _read_record(submitted / "collected.csv")
    uploads = [upload for upload in find(folder, rows) if _match(upload, sets, rows)]
    groups = defaultdict[tuple[str, str], list[Upload]](list)
    claimed = {key: row["lms_id"] for key, row in record.items()}
    for upload in sorted(uploads, key=Upload.order):
        upload.student = _student(upload, roster, claimed)
        groups[upload.assignment, upload.student].append(upload)
    for key in sorted(groups):
        rows += _tell_late(groups[key][-1], due)
        rows += _take(groups[key], submitted, record)
        # at once: what is in submitted/ and the record of it belong together
        write_csv(submitted / "collected.csv", list(record.values()))
    rows += _compare_with_roster(uploads, roster, submitted)
    lines = [dict(zip(("list", "what", "why"), row, strict=True)) for row in rows]
    write_csv(submitted / "report.csv", lines or [{"list": "", "what": "", "why": ""}])
    return rows


def find(folder: Path, rows: Rows) -> Iterator[Upload]:
    """Find the notebooks in a folder, in the zips in it, and in the zips of students."""
    for path in sorted(folder.rglob("*")):
        name = _shown(path.relative_to(folder).as_posix())
        if path.is_symlink():
            rows.append(("refused", name, "a link"))
        elif path.is_file():
            date = datetime.fromtimestamp(path.stat().st_mtime)
            with path.open("rb") as stream:
                yield from _look(name, name, stream, (date, date), rows)


def _shown(name: str) -> str:
    """Return a name in composed letters that can be written and stand in a line."""
    name = name.encode("utf-8", "replace").decode("utf-8")
    return re.sub(r"[\x00-\x1f]", "?", unicodedata.normalize("NFC", name))


def _look(
    label: str, name: str, stream: IO[bytes], dates: tuple[datetime, datetime], rows: Rows
) -> Iterator[Upload]:
    """Look at a file; its name, with the zips that it was in, tells the student."""
    suffix, owner = Path(name).suffix.lower(), MOODLE.fullmatch(name) or CANVAS.fullmatch(name)
    if JUNK.search(f"/{owner['file'] if owner else name}"):
        rows.append(("ignored", label, "not to be submitted"))
    elif suffix == ".zip":
        try:
            with zipfile.ZipFile(stream) as archive:
                yield from _look_into(archive, label, name, dates, rows)
        except BROKEN as error:
            rows.append(("refused", label, f"no zip, or broken: {error}"))
    elif suffix in ARCHIVES:
        rows.append(("refused", label, "not a zip; unpack it by hand"))
    elif suffix != ".ipynb":
        rows.append(("ignored", label, "no notebook"))
    elif not owner:
        rows.append(("unmatched", label, "its name names no student"))
    else:
        parts = {key: value or "" for key, value in owner.groupdict().items()}
        lms = "canvas" if owner.re is CANVAS else "moodle"
        date, downloaded = map(_written, dates)
        late = "LATE" * bool(parts.get("late"))
        who = (lms, parts["id"], parts.get("number", ""), parts["name"], label)
        upload = Upload("", "", *who, date, downloaded, late)
        upload.path, content = parts["file"], stream.read(FILE_BYTES + 1)
        try:
            if len(content) > FILE_BYTES:
                raise ValueError("too large")
            read_notebook(content, "it")
            upload.text = decode(content)
            encoding = content != upload.text.encode()
            upload.note = "; it is stored in UTF-8, which it was not" * encoding
            yield upload
        except ValueError as error:
            rows.append(("unmatched", label, str(error)))


def _look_into(
    archive: zipfile.ZipFile, label: str, name: str, dates: tuple[datetime, datetime], rows: Rows
) -> Iterator[Upload]:
    entries = [entry for entry in archive.infolist() if not entry.is_dir()]
    names = [_entry_name(entry) for entry in entries]
    # the name of a whole download may look like that of an upload
    owned = any(MOODLE.fullmatch(inner) or CANVAS.fullmatch(inner) for inner in names)
    upload = bool(MOODLE.fullmatch(name) or (CANVAS.fullmatch(name) and not owned))
    size = sum(entry.file_size for entry in entries)
    if upload and (len(entries) > UPLOAD_FILES or size > UPLOAD_BYTES):
        rows.append(("refused", label, "unpacked it is too large"))
    elif not entries or (upload and name.lower().count(".zip") > 1):
        rows.append(("refused", label, "a zip in a zip, or an empty one; unpack it by hand"))
    else:
        newest = max(map(_date, entries))
        for entry, inner in zip(entries, names, strict=True):
            # what a student packed has the dates of the student's machine
            when = dates if upload else (_date(entry), newest)
            where, full = f"{label}: {inner}", f"{name}/{inner}" if upload else inner
            wanted = inner.lower().endswith((".ipynb", ".zip"))
            try:
                if wanted and entry.file_size > FILE_BYTES:
                    raise ValueError("too large")
                content = archive.read(entry) if wanted else b""
            except BROKEN as error:
                rows.append(("refused", where, str(error)))
            else:
                yield from _look(where, full, io.BytesIO(content), when, rows)


def _entry_name(entry: zipfile.ZipInfo) -> str:
    """Return the name in a zip; many programs write UTF-8 and do not say so."""
    name = entry.filename
    if not entry.flag_bits & 0x800:
        with contextlib.suppress(UnicodeError):
            name = name.encode("cp437").decode("utf-8")
    return _shown(name)


def _date(entry: zipfile.ZipInfo) -> datetime:
    with contextlib.suppress(ValueError):
        return datetime(*entry.date_time)
    return datetime(1980, 1, 1)


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
    rows = read_csv(path)
    for row in rows:
        if not re.fullmatch(r"[^\s./\\:*?\"<>|][^/\\:*?\"<>|]*", row.get("id", "")):
            raise ValueError(f"{path.name}: a row has no id, or one that names no folder: {row}")
    return rows


def _read_record(path: Path) -> Record:
    rows = read_csv(path)
    missing = set(Upload.__annotations__) - set(rows[0] if rows else Upload.__annotations__)
    if missing:
        columns = ", ".join(sorted(missing))
        raise ValueError(f"{path}: the columns {columns} are missing; restore them")
    return {(row["student"], row["assignment"]): row for row in rows}


def _match(upload: Upload, sets: dict[str, set[str]], rows: Rows) -> bool:
    """Find out of which set a file is, by its name and by its cells."""
    cells = read_notebook(upload.text.encode(), "it").cells
    shared = {name: len({grade_id(cell) for cell in cells} & own) for name, own in sets.items()}
    stem = Path(upload.path).stem
    named = [s for s in sets if re.search(rf"(?<![^\W_]){re.escape(s)}(?!\d)", stem, re.IGNORECASE)]
    best = max(sets, key=lambda name: (shared[name], name in named))
    upload.assignment = name = max(named or [best], key=lambda name: shared[name])
    if not named and not shared[best]:
        why = "neither its name nor its cells are of a set"
    elif sets[name] and shared[name] < max(1, shared[best]):
        why = f"named {name}, but its cells are {f'of {best}' if shared[best] else 'of no set'}"
    else:
        return True
    rows.append(("unmatched", upload.file, why))
    return False


def _plain(name: str) -> str:
    """Return a name in small letters and digits; Moodle takes apostrophes out of names."""
    name = re.sub("['`’]", "", unicodedata.normalize("NFKC", name).casefold())
    return re.sub(r"[\W_]+", "_", name).strip("_")[:60]


def _student(
    upload: Upload, roster: list[dict[str, str]], claimed: dict[tuple[str, str], str]
) -> str:
    """Return the id of the student; who shares a name in a set gets the number too."""
    lms, number, plain = upload.lms, _plain(upload.lms_id), _plain(upload.name)
    found = [r["id"] for r in roster if lms == "canvas" and r.get("lms_user_id") == upload.lms_id]
    for row in () if found else roster:
        words = row.get("last_name", ""), row.get("first_name", "")
        same = sorted(_plain(" ".join(words)).split("_")) == sorted(plain.split("_"))
        if lms == "canvas":  # which writes the last name first, without spaces
            same = _plain("".join(words)).replace("_", "") == plain.replace("_", "")
        found += [row["id"]] * (same and bool(plain))
    student = found[0] if len(found) == 1 else plain
    if len(found) != 1 and (lms == "canvas" or plain in NOT_ALONE):
        student = f"{plain}_{number}".strip("_") or "student"
    if claimed.setdefault((student, upload.assignment), upload.lms_id) != upload.lms_id:
        student = f"{student}_{number}"
    return student


def _take(uploads: list[Upload], submitted: Path, record: Record) -> Rows:
    """Put the newest of the files of a student in its place, unless what is there is newer."""
    *others, best = uploads
    rows, key, label = Rows(), (best.student, best.assignment), best.file
    for other in others:
        why = f"{'the same as ' * (other.text == best.text)}{label}, which is taken"
        rows.append(("duplicates", other.file, why))
    place = submitted / best.student / best.assignment
    target, stamp = place / f"{best.assignment}.ipynb", place / "timestamp.txt"
    why, old = ", ".join(key) + best.note, record.get(key)
    if target.exists():
        age = _age(asdict(best))
        if target.read_bytes() == best.text.encode() or (old and _age(old) == age):
            return [*rows, ("unchanged", label, why)]
        # put there by other means: only a date can tell
        newer = stamp.exists() and best.date > stamp.read_text(encoding="utf-8").strip()
        if _age(old) > age if old else not newer:
            return [*rows, ("duplicates", label, f"{why}: what was collected before is newer")]
        why += ": replaces what was collected before"
    write_whole(target, best.text.encode())
    write_whole(stamp, f"{best.date}\n".encode())
    record[key] = asdict(best)
    return [*rows, ("collected", label, why)]


def _tell_late(upload: Upload, due: datetime | None) -> Rows:
    who = f"{upload.student}, {upload.assignment}"
    if upload.late:
        return [("late", who, "Canvas marks it")]
    if due and upload.lms != "canvas" and upload.date > _written(due):
        why = f"dated {upload.date}, which may be the download; look in Moodle"
        return [("late", who, f"perhaps: {why}")]
    return []


def _compare_with_roster(
    uploads: list[Upload], roster: list[dict[str, str]], submitted: Path
) -> Rows:
    ids = {row["id"] for row in roster}
    others = {(u.student, f"{u.name} ({u.lms} {u.lms_id})") for u in uploads}
    rows: Rows = [
        ("not on the roster", *other) for other in sorted(others) if ids and other[0] not in ids
    ]
    for name in sorted({upload.assignment for upload in uploads}):
        for row in roster:
            if not (submitted / row["id"] / name / f"{name}.ipynb").exists():
                who = f"{row.get('first_name', '')} {row.get('last_name', '')}".strip()
                rows.append(("missing", f"{row['id']}, {name}", who))
    return rows


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
