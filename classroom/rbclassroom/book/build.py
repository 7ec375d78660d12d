"""Make the book from the stored lessons: write its sources, and let Sphinx make its pages.

No code of the lessons is run.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections import defaultdict
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import nbformat
from jinja2 import Environment, FileSystemLoader

from rbclassroom.assignments.handout import pack, release
from rbclassroom.book import lessons, places, reference
from rbclassroom.book.citations import listed, names, with_citations
from rbclassroom.book.lessons import write
from rbclassroom.book.places import CONTENTS, PAGES, relinked
from rbclassroom.book.serve import serve
from rbclassroom.course import ledger, options
from rbclassroom.course.folder import require_writable
from rbclassroom.course.notebooks import lesson_paths
from rbclassroom.explorers import recorded
from rbclassroom.lecture.deck import write as write_decks
from rbclassroom.lecture.slides import deck_of
from rbclassroom.live import engine, pages

HERE = Path(__file__).parent
TEMPLATES = Environment(
    loader=FileSystemLoader(HERE / "pages"), trim_blocks=True, keep_trailing_newline=True
)
TEMPLATES.globals |= {"ledger": ledger, "places": places, "reference": reference}
_KEPT = re.compile(r".*\.(css|html|j2|js|md|mplstyle|py|svg|toml|ttf|txt|typed)")
_TO_READ = """
*This page is for reading. Your teacher can give you the problem set as a zip file. Teachers make \
this file with* `python3 course.py handout {name}`.
"""
_TO_SOLVE = """
**You can solve it here**, with nothing to install. Write your answers and press *Check*, which \
tells you what is wrong. At the end, download `{name}.ipynb`, the file to hand in. Until then this \
browser keeps your answers. If you prefer Jupyter, ask your teacher for the set as a zip file.
"""
_MOVED = """<!DOCTYPE html>
<html lang="en">
<meta charset="utf-8">
<title>A new address</title>
<link rel="canonical" href="{new}">
<noscript><meta http-equiv="refresh" content="0; url={new}"></noscript>
<script>location.replace("{new}" + location.hash)</script>
<p>This page is now at <a href="{new}">{new}</a>.</p>
</html>
"""
LIVE = "_static/live"
"""The folder of the book with the files for running Python in its pages."""
MADE = "made-by-course.txt"
"""The file that identifies a folder as a book made by this module, and lists the files made."""
HEAD = "This is the book of rbcourse. course.py made these files, and can make them again:"


@dataclass
class Sources:
    """The sources of the book in `folder`, and files in `extra` that are copied to the book.

    If `repository` is not empty, Binder takes the lessons from this GitHub repository,
    ``owner/name``. `live` tells whether Python runs in the pages. `shown` has data for the
    templates in ``pages/``.
    """

    root: Path
    folder: Path
    extra: Path
    repository: str = ""
    live: bool = False
    shown: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def works(self) -> dict[str, str]:
        """A dict that maps the keys of the cited works to their names."""
        return names(self.read("notebooks/REFERENCES.bib"))

    def read(self, path: str) -> str:
        """Return the text of a file of the course."""
        return (self.root / path).read_text(encoding="utf-8")

    def put(self, page: str, text: str) -> None:
        """Write the source of a page, and copy the linked files that have no page."""
        write(self.folder / page, text)
        for name in re.findall(r"\]\((?:\.\./)*files/([^)#]+)", text):
            target = self.folder / "files" / name
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(self.root / name, target)

    def rendered(self, template: str, **further: Any) -> str:
        """Return a template in ``pages/``, filled with the data of the book."""
        return TEMPLATES.get_template(template).render(
            self.shown, repository=self.repository, **further
        )

    def put_lessons(self) -> None:
        """Write the lessons, their run sheets and their slides."""
        figures, works, shown = list[lessons.Figure](), defaultdict(list), []
        where = self.extra / "lessons"
        readme = self.read("README.md")
        decks = {path.stem: deck_of(path) for path in lesson_paths(self.root / "notebooks")}
        pictures = sorted((self.root / "figures").glob("*.png"))
        known = {path.read_bytes(): f"../figures/{path.name}" for path in pictures}
        for path in lesson_paths(self.root / "notebooks"):
            page, notebook = f"lessons/{path.name}", nbformat.read(path, as_version=4)
            write(self.extra / page, nbformat.writes(lessons.without_outputs(notebook)) + "\n")
            title = notebook.cells[0].source.splitlines()[0].removeprefix("# ")
            figures += lessons.figures_of(path.name, notebook)
            for work in lessons.cited_in(notebook):
                works[work].append(path.stem)
            drawing = decks[path.stem].shown[0].picture
            sheet, sheet_page = decks[path.stem].sheet, f"teach/{path.stem}.md"
            at = sheet_page if sheet else ""
            lessons.prepare(notebook, path.name, self.root, known, where, at)
            lessons.add_buttons(notebook, path.name, self.repository)
            if self.live:
                pages.mark_lesson(notebook, path.stem)
            self.put(page, nbformat.writes(notebook))
            if sheet:
                text = relinked(sheet, f"notebooks/{path.name}", sheet_page)
                self.put(sheet_page, f"# Run sheet: {title}\n\n{text}\n")
            row = re.search(rf"^\| \[.*\]\(.*{path.name}\) \| (.*) \| (.*) \|$", readme, re.M)
            question, minutes = row.groups() if row else ("", "")
            shown.append(
                {
                    "stem": path.stem,
                    "number": path.stem[:2],
                    "name": title.partition(":")[0],
                    "sheet": sheet,
                    "question": question,
                    "minutes": minutes,
                    "drawing": re.sub('role="img" aria-label=".*?"', 'aria-hidden="true"', drawing),
                }
            )
        self.shown |= {"lessons": shown, "figures": figures, "works": sorted(works.items())}

        def ready(deck: str) -> str:
            there = "../lessons/pictures"
            stills = lessons.with_picture_files(deck, known, where, loading="eager")
            stills = stills.replace('src="pictures', f'src="{there}')
            return lessons.with_script_files(stills, where, there)

        write_decks(decks, self.extra / "slides", ready)

    def put_problem_sets(self) -> None:
        """Write the problem sets as students receive them."""
        assignments = self.root / "notebooks" / "assignments"
        names = sorted(path.stem for path in assignments.glob("source/ps*/ps*.ipynb"))
        for name in names:
            group = CONTENTS["sets"][name].split()
            card = next(each for each in self.shown["lessons"] if each["number"] == group[-1])
            files = {path: data.decode() for path, data in release(name, assignments).items()}
            released = files.pop(f"{name}.ipynb")
            given, notebook = (nbformat.reads(released, as_version=4) for _ in range(2))
            title, _, rest = notebook.cells[0].source.partition("\n")
            told = (_TO_SOLVE if self.live else _TO_READ).format(name=name)
            told = f'{told}\n<figure class="lead">{card["drawing"]}</figure>\n'
            notebook.cells[0].source = f"{title}\n{told}{rest}"
            if self.live:
                pages.mark_problems(notebook)
                data = json.dumps({"notebook": given, "files": files}, ensure_ascii=False)
                write(self.extra / LIVE / "pages" / f"{name}.json", data)
            self.put(f"problems/{name}.ipynb", nbformat.writes(notebook))
        self.shown["sets"] = names

    def put_package(self) -> None:
        """Write the pages of modules and of their code, and copy the figures."""
        modules = reference.modules(self.root)
        for module in (each for some in modules.values() for each in some):
            page = self.rendered("module.rst.j2", module=module)
            self.put(f"package/{module['name']}.rst", page)
        found = ledger.collect(self.root)
        for path in reference.shown_code(self.root, found):
            code, up = reference.coloured(self.read(path)), "../" * (path.count("/") + 1)
            page = self.rendered("code.html.j2", path=path, up=up, code=code)
            write(self.extra / "code" / path.replace(".py", ".html"), page)
        shutil.copytree(self.root / "figures", self.extra / "figures")
        files = {path.name for path in (self.root / "figures").iterdir()}
        addresses = reference.addresses(modules)
        self.shown |= {"modules": modules, "addresses": addresses, "found": found, "files": files}

    def put_files(self) -> None:
        """Write the pages that show files of the course, such as its glossary."""
        for path, page in PAGES.items():
            text = self.read(path)
            if path == "README.md":
                lessons, more = text.index("## Lessons"), text.index("## More of the package")
                part = text[text.index("## Use the package") : lessons] + text[more:]
                self.shown["package"] = relinked(part, path, page)
                continue  # the part is shown by a template
            if path == "notebooks/QUESTIONS.md":
                text = reference.folded_answers(text)
            text = with_citations(text, self.works, listed(text), "references.html")
            # Sphinx would use the environment `split`, which cannot contain \tag
            tagged = r"\$\$(.*?\\tag\{\d+\})\$\$"
            text = re.sub(tagged, r"\\begin{equation*}\n\1\n\\end{equation*}", text)
            self.put(page, relinked(text, path, page))

    def put_course(self) -> None:
        """Write ``course.zip``: packages, lessons without outputs, their slides, and `course.py`.

        Readers can run the course from this zip. It does not contain the problem sets, because they
        have model answers and hidden tests. It contains the check that students run before they
        submit.
        """
        homes = "rbcourse", "classroom/rbclassroom", "notebooks/slides"
        inside = (path for home in homes for path in (self.root / home).rglob("*.*"))
        package = [path.relative_to(self.root).as_posix() for path in inside]
        names = [
            *CONTENTS["course"]["files"],
            *(name for name in package if _KEPT.fullmatch(name) and "/." not in name),
        ]
        files = {name: (self.root / name).read_bytes() for name in names}
        for path in (self.extra / "lessons").glob("*.ipynb"):
            files[f"notebooks/{path.name}"] = path.read_bytes()
        packed = pack({f"rbcourse/{name}": content for name, content in files.items()})
        (self.extra / "course.zip").write_bytes(packed)

    def put_moved(self) -> None:
        """Write a page at each old address that leads to the new one, with the same heading."""
        for old, new in CONTENTS["moved"].items():
            write(self.extra / old, _MOVED.format(new=new))

    def put_fronts(self) -> None:
        """Write the pages that have a template: the start page, the lists and the instructions."""
        cube = recorded.living("cube").replace("<figure>", '<figure class="hero">', 1)
        where = self.extra / "lessons", "lessons/pictures"
        self.put("scene.html", lessons.with_script_files(cube, *where))
        for path in (HERE / "pages").rglob("*.md"):
            page = path.relative_to(HERE / "pages").as_posix()
            text = self.rendered(page)
            self.put(page, with_citations(text, self.works, listed(text), "references.html"))


def write_sources(
    root: Path, folder: Path, extra: Path, repository: str = "", pyodide: Path | None = None
) -> None:
    """Write all sources of the book to `folder` and `extra`, see `Sources`.

    `pyodide` is a folder with the files of Pyodide; if it is given, Python runs in the pages.
    """
    sources = Sources(root, folder, extra, repository, live=pyodide is not None)
    if pyodide:
        engine.write(root, extra / LIVE, pyodide)
    sources.put_lessons()
    sources.put_problem_sets()
    sources.put_package()
    sources.put_files()
    sources.put_course()
    sources.put_moved()
    sources.put_fronts()


def build(root: Path, book: Path, repository: str = "", pyodide: Path | None = None) -> None:
    """Make the book of a course, in a new folder or in the folder of an older book.

    Files in the folder that this function did not make are kept. If it fails or is interrupted, the
    older book remains. See `Sources` for `repository`, and `write_sources` for `pyodide`.
    """
    shown, book = book, book.resolve()
    require_writable(book.parent)
    if book.exists() and not (book / MADE).exists():
        raise ValueError(f"{book} is not a book made by this command; move it away or delete it")
    recorded.record_all()
    with tempfile.TemporaryDirectory(dir=book.parent, prefix=".book-") as folder:
        sources, extra, pages = (Path(folder, name) for name in ("sources", "extra", "pages"))
        print("Reading the lessons ...", flush=True)
        write_sources(root, sources, extra, repository, pyodide)
        print("Making the pages ...", flush=True)
        words = ["-b", "html", "-W", "--keep-going", "-q", "-j", "2", "-c", str(HERE)]
        subprocess.run(
            [sys.executable, "-m", "sphinx", *words, "-d", f"{folder}/read", sources, pages],
            cwd=root,
            env={**os.environ, "PYTHONHASHSEED": "0", "RBCOURSE_BOOK_EXTRA": str(extra)},
            check=True,
        )
        for needless in (pages / ".buildinfo", *pages.rglob("*.map")):
            needless.unlink()
        (pages / "_sources").rmdir()
        (pages / ".nojekyll").touch()  # without this file, GitHub Pages omits _static
        made = sorted(path.relative_to(pages) for path in pages.rglob("*") if path.is_file())
        names = [path.as_posix() for path in made]
        (pages / MADE).write_text("\n".join([HEAD, *names, ""]), encoding="utf-8")
        size = sum(path.stat().st_size for path in pages.rglob("*") if path.is_file())
        html = sum(path.suffix == ".html" for path in made)
        kept = replace(book, pages, Path(folder, "old"))
    if kept:
        listed = ", ".join(kept[:3]) + ", ..." * (len(kept) > 3)
        print(f"Files in {shown} that this command did not make are kept: {listed}")
    print(f"{shown / 'index.html'}: {html} pages, {size / 1e6:.1f} MB")


def replace(book: Path, pages: Path, old: Path) -> list[str]:
    """Put new pages in place of a book; copy the files that `build` did not make, and return them.

    The folder of the book is moved to `old`, and moved back if the new one cannot be put in its
    place.
    """
    made = set((book / MADE).read_text("utf-8").splitlines()[1:]) if book.exists() else set()
    made.add(MADE)
    kept = []
    for path in sorted(book.rglob("*")):
        name, target = path.relative_to(book).as_posix(), pages / path.relative_to(book)
        if name in made:
            continue
        if path.is_dir() and not path.is_symlink():
            target.mkdir(parents=True, exist_ok=True)
        elif os.path.lexists(target):
            raise ValueError(f"{path} would be replaced by a page of the book; move it away")
        else:
            shutil.copy2(path, target, follow_symlinks=False)
            kept.append(name)
    try:
        if book.exists():
            book.rename(old)
        pages.rename(book)
    except BaseException:
        if old.exists() and not book.exists():
            old.rename(book)
        raise
    return kept


def main() -> None:
    """Make the book in the folder of the course."""
    asked, _ = options.parse("book")
    book = Path("book")
    try:
        build(Path(), book, asked.repository, engine.fetch() if asked.live else None)
        if asked.serve:
            serve(book)
    except (OSError, ValueError) as error:
        sys.exit(str(error))
    except subprocess.CalledProcessError:
        sys.exit("Sphinx could not make the pages; its messages are above.")
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
