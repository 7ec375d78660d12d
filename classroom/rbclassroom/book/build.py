"""Make the book: its sources from the stored lessons, its pages by Sphinx. Nothing is run."""

import argparse
import http.server
import os
import re
import shutil
import subprocess
import sys
import tempfile
import webbrowser
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from string import Template

import nbformat

from rbclassroom.assignments.handout import pack, release
from rbclassroom.book import reference
from rbclassroom.book.code import code_page
from rbclassroom.book.lessons import (
    Figure,
    Pictures,
    cited_in,
    figures_of,
    living,
    prepared,
    with_buttons,
    without_outputs,
)
from rbclassroom.book.places import MOVED, PAGES, relinked
from rbclassroom.course import ledger
from rbclassroom.course.notebooks import lesson_paths

HERE = Path(__file__).parent
_TAKEN = [
    "CHANGELOG.md",
    "CITATION.cff",
    "CONTRIBUTING.md",
    "LICENSE",
    "README.md",
    "course.py",
    "environment.txt",
    "pyproject.toml",
    "benchmarks/benchmarks.csv",
    "classroom/pyproject.toml",
    "docs/conventions.md",
    "docs/ledger.md",
    "docs/near_optimal.md",
    "docs/near_optimal.py",
    "notebooks/QUESTIONS.md",
    "notebooks/REFERENCES.bib",
    "rbcourse/leading_excess.csv",
    "classroom/rbclassroom/surveys/atlas_intervals.csv",
    "classroom/rbclassroom/surveys/atlas_maps.csv",
]
_KEPT = re.compile(r".*\.(css|html|j2|js|md|mplstyle|py|svg|toml|txt|typed)")
_TO_READ = (
    "*This page is for reading. Get the problem set as a zip from your teacher; teachers make it "
    "with* `python3 course.py handout {name}`."
)
_TAKE = "(*Code*, *Download ZIP*, unpack; or `git clone`)"
_REDIRECT = """<!doctype html>
<meta charset="utf-8"><meta http-equiv="refresh" content="0; url={0}">
<title>Moved</title><p>This page is now <a href="{0}">{0}</a>.</p>
"""
MADE = "made-by-course.txt"
"""A file in the book by which it is known as one."""


@dataclass
class Sources:
    """The sources of the pages, as they are written to a folder.

    Attributes
    ----------
    root, folder, extra : Path
        The folder of the course, and those that are written to: one for the sources, one for what
        is copied to the book.
    repository : str
        Where Binder finds the lessons on GitHub, ``owner/name``; empty if it does not.
    shown : dict of str to str
        What the pages in ``pages/`` show at their places.
    """

    root: Path
    folder: Path
    extra: Path
    repository: str = ""
    shown: dict[str, str] = field(default_factory=dict)

    def read(self, path: str) -> str:
        """Return a file of the course."""
        return (self.root / path).read_text(encoding="utf-8")

    def put(self, page: str, text: str) -> None:
        """Write the source of a page."""
        _write(self.folder / page, text)

    def put_lessons(self) -> list[Figure]:
        """Write the lessons and their run sheets; return the figures that they draw."""
        pictures, figures = Pictures(self.root, self.extra / "lessons"), list[Figure]()
        cited, lessons, sheets = {}, list[str](), list[str]()
        for path in lesson_paths(self.root / "notebooks"):
            page, notebook = f"lessons/{path.name}", nbformat.read(path, as_version=4)
            title = notebook.cells[0].source.splitlines()[0].removeprefix("# ")
            short = f"{path.stem[:2]} {title.partition(':')[0]}"
            if path.stem != "00_start_here":  # it is about the installation
                lessons.append(f"{short} <lessons/{path.stem}>")
            figures += figures_of(path.stem, notebook)
            cited[path.stem] = cited_in(notebook)
            shown, sheet = prepared(f"notebooks/{path.name}", page, self.root, pictures)
            self.put(page, nbformat.writes(with_buttons(shown, path.name, self.repository)))
            if sheet:
                sheets.append(f"{short} <{path.stem}>")
                self.put(f"teach/{path.stem}.md", f"# Run sheet: {title}\n\n{sheet}\n")
            _write(self.extra / page, nbformat.writes(without_outputs(notebook)) + "\n")
        self.shown |= {
            "lessons": "\n".join(lessons),
            "sheets": "\n".join(sheets),
            "works": reference.works(cited),
        }
        return figures

    def put_problem_sets(self) -> None:
        """Write the problem sets as students get them."""
        assignments = self.root / "notebooks" / "assignments"
        names = sorted(path.stem for path in assignments.glob("source/ps*/ps*.ipynb"))
        for name in names:
            released = release(name, assignments)[f"{name}.ipynb"].decode()
            notebook = nbformat.reads(released, as_version=4)
            title, _, rest = notebook.cells[0].source.partition("\n")
            notebook.cells[0].source = f"{title}\n\n{_TO_READ.format(name=name)}\n{rest}"
            self.put(f"problems/{name}.ipynb", nbformat.writes(notebook))
        sets = [f"Problem set {name[2:]} <problems/{name}>" for name in names]
        links = [f"- [](../problems/{name}.ipynb)" for name in names]
        self.shown |= {"sets": "\n".join(sets), "set_links": "\n".join(links)}

    def put_package(self, figures: list[Figure]) -> None:
        """Write the pages of modules and code, and the figures."""
        groups = reference.modules(self.root)
        for name in (name for names in groups.values() for name in names):
            self.put(f"package/{name}.rst", reference.module_page(name, self.root))
        for old, new in MOVED.items():
            _write(self.extra / f"package/{old}.html", _REDIRECT.format(f"{new}.html"))
        for path in reference.shown_code(self.root):
            name = path.relative_to(self.root).as_posix()
            page = self.extra / "code" / name.replace(".py", ".html")
            _write(page, code_page(name, self.root))
        explorers = shutil.ignore_patterns("explorers")
        shutil.copytree(self.root / "figures", self.extra / "figures", ignore=explorers)
        self.shown |= {
            "modules": reference.module_tables(groups, self.root),
            "ledger": reference.ledger_tables(ledger.collect(self.root), figures),
            "figures": reference.gallery(figures, self.root),
        }

    def put_files(self) -> None:
        """Write the pages that are files of the course."""
        for path, page in PAGES.items():
            text = self.read(path)
            if path == "README.md":
                rows = re.findall(r"^\| \[\d\d .*", text, re.MULTILINE)
                self.shown["table"] = relinked("\n".join(rows), path, "lessons/index.md")
                text = "# Install and run\n\n" + text[text.index("## Start") :]
                take = '(<a href="course.zip">course.zip</a>, then unpack; '
                take += "it has what `lab`, `lecture`, `check` and `figures` need"
                if self.repository:
                    take += f"; or `git clone https://github.com/{self.repository}`"
                text = text.replace(_TAKE, f"{take})")
            if path == "notebooks/QUESTIONS.md":
                text = reference.folded_answers(text)
            self.put(page, relinked(text, path, page))

    def put_course(self) -> None:
        """Write ``course.zip``, which runs: the package, the lessons without outputs, `course.py`.

        The problem sets, with model answers and hidden tests, are left out; the check that students
        run before they submit is in the package.
        """
        homes = "rbcourse", "classroom/rbclassroom"
        inside = (path for home in homes for path in (self.root / home).rglob("*.*"))
        package = [path.relative_to(self.root).as_posix() for path in inside]
        names = [*_TAKEN, *(name for name in package if _KEPT.fullmatch(name) and "/." not in name)]
        files = {name: (self.root / name).read_bytes() for name in names}
        for path in (self.extra / "lessons").glob("*.ipynb"):
            files[f"notebooks/{path.name}"] = path.read_bytes()
        packed = pack({f"rbcourse/{name}": content for name, content in files.items()})
        (self.extra / "course.zip").write_bytes(packed)

    def put_fronts(self) -> None:
        """Write the start page and the pages that lead to others."""
        self.put("scene.html", living("cube", self.root))
        for path in (HERE / "pages").rglob("*.md"):
            text = Template(path.read_text(encoding="utf-8")).substitute(self.shown)
            self.put(path.relative_to(HERE / "pages").as_posix(), text)

    def put_linked(self) -> None:
        """Copy the files without a page that pages link to."""
        for page in [*self.folder.rglob("*.md"), *self.folder.rglob("*.ipynb")]:
            text = page.read_text(encoding="utf-8")
            for name in re.findall(r"\]\((?:\.\./)*files/([^)#]+)", text):
                target = self.folder / "files" / name
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(self.root / name, target)


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8", newline="\n")


def write_sources(root: Path, folder: Path, extra: Path, repository: str = "") -> None:
    """Write all that the book is made of to two folders, see `Sources`."""
    sources = Sources(root, folder, extra, repository)
    figures = sources.put_lessons()
    sources.put_problem_sets()
    sources.put_package(figures)
    sources.put_files()
    sources.put_course()
    sources.put_fronts()
    sources.put_linked()


def build(root: Path, book: Path, repository: str = "") -> None:
    """Make the book of a course, in a folder that is not there or is an older book."""
    if book.exists() and not (book / MADE).exists():
        raise ValueError(f"{book} is no book that was made here: move it away or delete it")
    with tempfile.TemporaryDirectory(dir=book.absolute().parent, prefix=".book-") as folder:
        sources, extra, pages = (Path(folder, name) for name in ("sources", "extra", "pages"))
        print("Reading the lessons ...", flush=True)
        write_sources(root, sources, extra, repository)
        print("Making the pages ...", flush=True)
        words = ["-b", "html", "-W", "--keep-going", "-q", "-j", "2", "-c", str(HERE)]
        subprocess.run(
            [sys.executable, "-m", "sphinx", *words, "-d", f"{folder}/read", sources, pages],
            cwd=root,
            env={**os.environ, "PYTHONHASHSEED": "0", "RBCOURSE_BOOK_EXTRA": str(extra)},
            check=True,
        )
        (pages / ".buildinfo").unlink()
        (pages / "_sources").rmdir()
        (pages / ".nojekyll").touch()  # or GitHub Pages leaves out _static
        (pages / MADE).write_text("The book of rbcourse; course.py makes it anew.\n")
        if book.exists():
            book.rename(Path(folder, "old"))
        pages.rename(book)
    size = sum(path.stat().st_size for path in book.rglob("*") if path.is_file())
    print(f"{book / 'index.html'}: {len(list(book.rglob('*.html')))} pages, {size / 1e6:.1f} MB")


class _Quiet(http.server.SimpleHTTPRequestHandler):
    """Serves files and does not tell of each."""

    def log_message(self, *_: object) -> None:
        pass


def serve(book: Path) -> None:
    """Show the book in a browser, from this machine, until Ctrl-C."""
    handler = partial(_Quiet, directory=str(book))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        address = f"http://127.0.0.1:{server.server_port}/"
        print(f"The book is at {address}. Stop it here, with Ctrl-C.", flush=True)
        webbrowser.open(address)
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            print()


def main() -> None:
    """Make the book, in the folder of the course."""
    parser = argparse.ArgumentParser(prog="python -m rbclassroom.book.build")
    parser.add_argument("--serve", action="store_true", help="show it in the browser")
    parser.add_argument("--repository", default="", help="owner/name on GitHub, for Binder")
    asked = parser.parse_args()
    if not re.fullmatch(r"([\w.-]+/[\w.-]+)?", asked.repository):
        parser.error(f"--repository: owner/name wanted, got {asked.repository}")
    book = Path("book")
    try:
        build(Path(), book, asked.repository)
    except (OSError, ValueError) as error:
        sys.exit(str(error))
    except subprocess.CalledProcessError:
        sys.exit("The pages could not be made; what Sphinx says stands above.")
    except KeyboardInterrupt:
        sys.exit(130)
    if asked.serve:
        serve(book)


if __name__ == "__main__":
    main()
