"""Find the notebooks in Moodle and Canvas downloads.

The names are those that mod/assign/classes/downloader.php of Moodle and lib/content_zipper.rb of
Canvas give. Both write the time of the download into a zip, not that of the upload; older
versions of Moodle may write the upload's.
"""

import contextlib
import io
import re
import stat
import unicodedata
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import IO

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


@dataclass
class Download:
    """A notebook that a student handed in.

    Attributes
    ----------
    label : str
        The file in the folder, and in the zip.
    lms, lms_id, name : str
        ``"moodle"`` or ``"canvas"``; the number of the student there (Moodle numbers a student
        anew in each assignment); the name.
    path : str
        The file as the student named it.
    number : int
        What Canvas gives to each upload, and rises; else 0.
    marked_late : bool
        Whether Canvas marks it.
    date, downloaded : datetime
        Of the file and of the newest file in the same zip, local time.
    content : Path
        Where its content is.
    """

    label: str
    lms: str
    lms_id: str
    name: str
    path: str
    number: int
    marked_late: bool
    date: datetime
    downloaded: datetime
    content: Path


def find(folder: Path, work: Path, rows: list[tuple[str, str, str]]) -> Iterator[Download]:
    """Find the notebooks in a folder, in the zips in it, and in the zips of students."""
    search = _Search(work, rows)
    for path in sorted(folder.rglob("*")):
        name = _shown(path.relative_to(folder).as_posix())
        if path.is_symlink():
            rows.append(("refused", name, "a link"))
        elif path.is_file():
            date = datetime.fromtimestamp(path.stat().st_mtime)
            with path.open("rb") as stream:
                yield from search.look(name, name, stream, (date, date))


def _shown(name: str) -> str:
    """Return a name in composed letters that can be written and stand in a line."""
    name = name.encode("utf-8", "replace").decode("utf-8")
    return re.sub(r"[\x00-\x1f]", "?", unicodedata.normalize("NFC", name))


def _owner(name: str) -> re.Match[str] | None:
    return MOODLE.fullmatch(name) or CANVAS.fullmatch(name)


class _Search:
    """Parameters: where contents go, and where to say what is no notebook of a student."""

    def __init__(self, work: Path, rows: list[tuple[str, str, str]]) -> None:
        self._work, self._rows, self._count = work, rows, 0

    def look(
        self, label: str, name: str, stream: IO[bytes], dates: tuple[datetime, datetime]
    ) -> Iterator[Download]:
        """Look at a file; its name, with the zips that it was in, tells the student."""
        suffix, owner = Path(name).suffix.lower(), _owner(name)
        own = owner["file"] if owner else name
        if JUNK.search(f"/{own}"):
            self._rows.append(("ignored", label, "not to be submitted"))
        elif suffix == ".zip":
            yield from self._look_into(label, name, stream, dates)
        elif suffix in ARCHIVES:
            self._rows.append(("refused", label, "not a zip; unpack it by hand"))
        elif suffix != ".ipynb":
            self._rows.append(("ignored", label, "no notebook"))
        elif not owner:
            self._rows.append(("unmatched", label, "its name names no student"))
        else:
            yield from self._keep(label, owner, stream.read(FILE_BYTES + 1), dates)

    def _keep(
        self,
        label: str,
        owner: re.Match[str],
        content: bytes,
        dates: tuple[datetime, datetime],
    ) -> Iterator[Download]:
        if len(content) > FILE_BYTES:
            self._rows.append(("refused", label, "too large"))
            return
        self._count += 1
        place = self._work / str(self._count)
        place.write_bytes(content)
        parts = {key: value or "" for key, value in owner.groupdict().items()}
        lms = "canvas" if owner.re is CANVAS else "moodle"
        number, late = int(parts.get("number", 0)), bool(parts.get("late"))
        who = (lms, parts["id"], parts["name"], parts["file"])
        yield Download(label, *who, number, late, *dates, place)

    def _look_into(
        self, label: str, name: str, stream: IO[bytes], dates: tuple[datetime, datetime]
    ) -> Iterator[Download]:
        try:
            with zipfile.ZipFile(stream) as archive:
                entries = [entry for entry in archive.infolist() if not entry.is_dir()]
                names = [_entry_name(entry) for entry in entries]
                # the name of a whole download may look like that of an upload
                upload = bool(MOODLE.fullmatch(name)) or (
                    bool(CANVAS.fullmatch(name)) and not any(map(_owner, names))
                )
                fault = _fault_of_zip(name, entries, upload)
                if fault:
                    self._rows.append(("refused", label, fault))
                    return
                newest = max(map(_date, entries))
                for entry, inner in zip(entries, names, strict=True):
                    # what a student packed has the dates of the student's machine
                    when = dates if upload else (_date(entry), newest)
                    full = f"{name}/{inner}" if upload else inner
                    yield from self._look_at(archive, entry, f"{label}: {inner}", full, when)
        except BROKEN as error:
            self._rows.append(("refused", label, f"no zip, or broken: {error}"))

    def _look_at(
        self,
        archive: zipfile.ZipFile,
        entry: zipfile.ZipInfo,
        label: str,
        name: str,
        dates: tuple[datetime, datetime],
    ) -> Iterator[Download]:
        fault, content = _fault(entry), b""
        if not fault and name.lower().endswith((".ipynb", ".zip")):
            try:
                with archive.open(entry) as file:
                    content = file.read()
            except BROKEN as error:
                fault = f"broken: {error}"
        if fault:
            self._rows.append(("refused", label, fault))
        else:
            yield from self.look(label, name, io.BytesIO(content), dates)


def _fault_of_zip(name: str, entries: list[zipfile.ZipInfo], upload: bool) -> str:
    if not entries:
        return "an empty zip"
    size = sum(entry.file_size for entry in entries)
    if upload and (len(entries) > UPLOAD_FILES or size > UPLOAD_BYTES):
        return "unpacked it is too large"
    if upload and name.lower().count(".zip") > 1:
        return "a zip in a zip; unpack it by hand"
    return ""


def _entry_name(entry: zipfile.ZipInfo) -> str:
    """Return the name in a zip; many programs write UTF-8 and do not say so."""
    name = entry.filename
    if not entry.flag_bits & 0x800:
        with contextlib.suppress(UnicodeError):
            name = name.encode("cp437").decode("utf-8")
    return _shown(name)


def _fault(entry: zipfile.ZipInfo) -> str:
    name = entry.orig_filename
    if entry.flag_bits & 1:
        return "encrypted"
    if stat.S_ISLNK(entry.external_attr >> 16):
        return "a link"
    if re.search(r"(^|[/\\])\.\.([/\\]|$)|^[A-Za-z]:|^[/\\]", name):
        return "a name that leads out of its folder"
    return "too large" if entry.file_size > FILE_BYTES else ""


def _date(entry: zipfile.ZipInfo) -> datetime:
    with contextlib.suppress(ValueError):
        return datetime(*entry.date_time)
    return datetime(1980, 1, 1)
