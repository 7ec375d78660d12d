"""Find the files in the downloads of an LMS, and the student of each file.

Every file has a path through folders and zips. The path names the student as Moodle, Blackboard,
Brightspace, ILIAS or Canvas write it; otherwise one folder belongs to each student. Moodle names
files in mod/assign/classes/downloader.php, and Canvas in lib/content_zipper.rb.
"""

import contextlib
import io
import re
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, Any
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile

from rbclassroom.assignments.submissions import read_notebook

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
DAYS, TIMES = ("%b %d", "%B %d", "%d %b", "%d %B"), ("%I%M %p", "%H%M")
DATES = ["%Y-%m-%d-%H-%M-%S"]  # of Blackboard
DATES += [f"{day}, %Y {time}" for day in DAYS for time in TIMES]  # of Brightspace
PERSON = re.compile(r"[^\W\d_a-z]\w+[ _]+[^\W\d_a-z]\w+")  # as in "Anna Berg - ps1.ipynb"
GENERIC = {"to_submit", "work", "submissions", "submission", "downloads", "assignments", "email"}
GENERIC |= {"late", "abgabe", "abgaben"}  # no names of students
JUNK = re.compile(r"/(__MACOSX|\.ipynb_checkpoints|original)/|/(\._[^/]*|\.DS_Store)$")
FILE_BYTES, UPLOAD_BYTES, DOWNLOAD_BYTES = 30_000_000, 100_000_000, 4_000_000_000
UNKNOWN = -1  # the level of a notebook that cannot be assigned to a student
DEPTH = 4  # zips in zips


@dataclass
class File:
    """A file in a download, which holds a notebook if `kind` is empty."""

    parts: tuple[str, ...]  # the folders, zips and names on its path
    dates: tuple[datetime | None, ...]  # of the parts that are files or zips
    label: str
    kind: str = ""  # of the row in the report
    why: str = ""
    content: bytes = b""
    of_set: str = ""  # the set of a notebook
    about: dict[str, str] = field(default_factory=dict)  # the student: name, id and so on


def find_files(folder: Path) -> Iterator[File]:
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
                    yield from _look(File(parts, dates, label), stream, [DOWNLOAD_BYTES])
            except OSError as error:
                yield File(parts, dates, label, "refused", str(error.strerror))


def _look(file: File, stream: IO[bytes], room: list[int], depth: int = 0) -> Iterator[File]:
    """Yield a file, or the files in a zip; `room` has the number of bytes that may be read."""
    suffix = Path(file.parts[-1]).suffix.lower()
    try:
        if JUNK.search("/" + "/".join(file.parts)):
            file.kind, file.why = "ignored", "it is not a file to submit"
        elif suffix == ".zip" and depth == DEPTH:
            raise ValueError("it is a zip in too many zips; unpack it by hand")
        elif suffix == ".zip":
            with ZipFile(stream) as zipped:
                yield from _look_into(zipped, file, room, depth)
            return
        else:
            content = stream.read(FILE_BYTES + 1)
            if len(content) > FILE_BYTES:
                raise ValueError("it is too large")
            read_notebook(content, "it")  # a browser may have added .json or .txt to its name
            file.content = content
    except Exception as error:  # a damaged zip raises many kinds of errors
        file.kind, file.why = "refused", str(error) or type(error).__name__
        if isinstance(error, ValueError) and suffix not in (".ipynb", ".zip"):
            script = "; ask for the notebook, .ipynb" if suffix == ".py" else ""
            file.kind, file.why = "ignored", f"it is neither a notebook nor a zip{script}"
    yield file


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
        found = File((*file.parts, *inner), dates, f"{file.label}: {name}")
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
            found.kind, found.why = "refused", str(error) or type(error).__name__
            yield found
        else:
            yield from _look(found, io.BytesIO(content), room, depth + 1)


def find_owners(files: list[File]) -> None:
    """Store the number, the name and the dates of the student of each file in `about`."""
    beside = defaultdict[tuple[str, ...], set[str]](set)  # the parts below each path
    for file in files:
        for at in range(len(file.parts) * (not file.kind)):
            beside[file.parts[:at]].add(file.parts[at])
    for file in files:
        file.about = _owner(file, beside)
    # in the other downloads, one folder belongs to each student
    named = {f.parts[0] for f in files if f.about and f.parts[1:]}
    loose = {at: f.parts for at, f in enumerate(files) if f.parts[1:] and f.parts[0] not in named}
    notebooks = {at: parts for at, parts in loose.items() if not files[at].kind}
    found = [file.of_set for file in files]
    levels = {at: k for at, k in _levels(notebooks, 0, found).items() if k != UNKNOWN}
    above = {parts[: levels[at]] for at, parts in notebooks.items() if at in levels}
    alone = len({parts[: levels[at] + 1] for at, parts in notebooks.items() if at in levels}) == 1
    for at, parts in loose.items():
        first = next((k for k in range(len(parts) - 1) if parts[:k] in above), 0)
        level = levels.get(at, first)
        if parts[:level] in above and (at in levels or files[at].kind):
            name, folder = parts[level].removesuffix(".zip"), "/".join(parts[: level + 1])
            about = {"name": name, "folder": folder, "file": "/".join(parts[level + 1 :])}
            below = parts[level + 1 : -1][:1] if alone and not PERSON.search(name) else ()
            for inner in {*below} - GENERIC.union(found):
                about["unsure"] = inner  # a single folder may be around that of the student
            files[at].about = _about(about, files[at], level)


def _levels(notebooks: dict[int, tuple[str, ...]], level: int, found: list[str]) -> dict[int, int]:
    """Return for each notebook which part of its path names the student, if one does.

    `found` has the sets of the files. A folder belongs to a class if folders in it have notebooks
    of the same set, and its student is unknown if its notebooks have the names of several persons.
    If only the folders in a folder have names of persons, each name once, these are the students.
    """
    below = defaultdict[str, dict[int, tuple[str, ...]]](dict)
    for at, parts in notebooks.items():
        if len(parts) > level + 1:
            below[parts[level]][at] = parts
    again = Counter(pair[-1] for pair in {parts[level : level + 2] for parts in notebooks.values()})
    own, deeper, classes = dict[int, int](), dict[int, int](), False
    for folder, inside in below.items():
        direct = {at: parts for at, parts in inside.items() if len(parts) == level + 2}
        under = _levels(inside, level + 1, found)
        students = Counter(
            (found[at], inside[at][: k + 1]) for at, k in under.items() if k != UNKNOWN
        )
        sets = Counter(name for name, _ in students)
        persons = {m[0] for parts in direct.values() if (m := PERSON.search(parts[-1]))}
        inner = {parts[level + 1] for parts in inside.values()}
        named = all(PERSON.search(name) and again[name] == 1 for name in inner)
        is_generic = folder.removesuffix(".zip").casefold() in GENERIC.union(found)
        is_only_around = not direct and named and not PERSON.search(folder)
        is_class = not direct and max(sets.values(), default=0) > 1
        classes = classes or is_class
        if len(persons) > 1 or (not direct and UNKNOWN in under.values()):
            own |= dict.fromkeys(inside, UNKNOWN)
        elif is_generic or is_class or is_only_around:
            own |= under
        else:
            own |= dict.fromkeys(inside, level)
            deeper |= under if not direct else {}
    return own | (deeper if classes else {})


def _owner(file: File, beside: dict[tuple[str, ...], set[str]]) -> dict[str, str]:
    """Return the data of a student in the names that an LMS gives, or an empty dictionary."""
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
    return {}


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
    about = dict.fromkeys(("name", "id", "folder", "unsure", "late", "number", "file", "exact"), "")
    about |= {key: value or "" for key, value in found.items()}
    when = written(next(date for date in file.dates[at:] if date))
    about["exact"] = "no" if about.get("date") else ""
    for form in DATES:
        with contextlib.suppress(ValueError, OverflowError):
            when = written(datetime.strptime(about.get("date", ""), form))
            about["exact"] = "yes"
    return about | {"date": when}


def _shown(name: str) -> str:
    """Return a name in normal form C, without control characters."""
    with contextlib.suppress(UnicodeError):  # many zips do not declare that their names are UTF-8
        name = name.encode("cp437").decode("utf-8")
    name = name.encode("utf-8", "backslashreplace").decode("utf-8")
    return re.sub(r"[\x00-\x1f]", "?", unicodedata.normalize("NFC", name))


def written(date: datetime) -> str:
    """Return a local time as text that nbgrader reads."""
    return f"{date.astimezone(UTC):%Y-%m-%d %H:%M:%S} UTC"
