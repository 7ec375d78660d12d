"""Test Python in the pages of the book, for lessons and problem sets."""

import base64
import csv
import html
import io
import re
import shutil
import zipfile
from functools import partial
from http.server import ThreadingHTTPServer
from pathlib import Path
from textwrap import indent
from threading import Thread

import nbformat
import pytest
from pages import watched
from playwright.sync_api import expect
from quick import quick_for
from test_problems import SETS, SOURCE, TABLES, TESTS, cells, head
from test_sets_graded import regions

from rbclassroom.assignments.check import check
from rbclassroom.assignments.collect import collect
from rbclassroom.assignments.grade import grade
from rbclassroom.assignments.handout import release
from rbclassroom.book.lessons import joined
from rbclassroom.book.polls import VOTE
from rbclassroom.book.serve import Handler
from rbclassroom.live import engine
from rbclassroom.live.pages import LEFT_OUT

ROOT = Path(__file__).parents[3]
LESSONS = sorted((ROOT / "notebooks").glob("[0-9][0-9]_*.ipynb"))
RUN = """async ([cell, page]) => {
  const set = page && (await (await fetch(`${rbcourseEngine.folder}pages/${page}.json`)).json());
  let out = [];
  await rbcourseEngine.run({ files: set?.files, ...cell }, (kind, content) => {
    if (kind === "clear") out = [];
    else if (kind !== "loaded") out.push([kind, content]);
  });
  return out.map(([kind, content]) =>
    [kind, kind === "html" ? /alt="([^"]*)"/.exec(content)?.[1] ?? "" : content]);
}"""
OUTPUTS = ":is(.outputs pre, .outputs .hint, .outputs figure)"


@pytest.fixture(scope="module")
def address(book):
    """Return the address at which this machine serves the book."""
    handler = partial(Handler, directory=str(book))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


@pytest.fixture(scope="module")
def run(context, address):
    """Return a function that runs a cell and returns its outputs.

    It is called as ``run(above, source, page)``.
    """
    with watched(context) as page:
        page.goto(f"{address}/lessons/00_start_here.html")
        yield lambda above, source, name="": page.evaluate(
            RUN, [{"above": above, "source": source}, name]
        )


def shown(text):
    """Return text as a terminal shows it: a carriage return goes back to the start of the line."""
    return "\n".join(line.rstrip("\r").rpartition("\r")[2] for line in text.split("\n")).strip()


def told(outputs):
    """Return the texts of stored outputs, and the descriptions of stored pictures."""
    texts, pictures = "", []
    for output in outputs:
        data = output.get("data", {})
        picture = re.search(r'alt="([^"]*)"', data.get("text/html", ""))
        if picture:
            pictures.append(html.unescape(picture[1]))
        else:
            texts += output.text if output.output_type == "stream" else data["text/plain"]
    return shown(texts), pictures


@pytest.mark.parametrize("path", quick_for(["01"], LESSONS))
def test_each_cell_gives_its_stored_text_unless_it_is_an_exception(run, path):
    """Cells on the list of exceptions must give a different text. Slow cells are not run."""
    listed, notebook = LEFT_OUT.get(path.stem, {}), nbformat.read(path, as_version=4)
    cells = [cell for cell in joined(notebook.cells) if cell.cell_type == "code"]
    differ = set()
    for at, cell in enumerate(cells):
        here = cell.id != "opening" and "_explorer(" not in cell.source
        if not here or VOTE.search(cell.source):  # they need Jupyter
            continue
        if listed.get(cell.id, "").startswith("takes"):
            differ.add(cell.id)
            continue
        found = run([each.source for each in cells[:at]], cell.source)
        text = shown("".join(content for kind, content in found if kind not in ("html",)))
        pictures = [html.unescape(content) for kind, content in found if kind == "html"]
        if (text, pictures) != told(cell.outputs):
            differ.add(cell.id)
            print(cell.id, repr(text[-300:]), pictures)
    assert differ == listed.keys()


def test_at_least_250_cells_can_be_run(book):
    pages = [path.read_text("utf-8") for path in (book / "lessons").glob("[0-9]*.html")]
    assert sum(len(re.findall(r"\btag_try-", page)) for page in pages) >= 250


@pytest.mark.slow
@pytest.mark.parametrize("name", SETS)
def test_reference_answers_pass_and_wrong_ones_get_their_hints(run, name):
    setup = cells(name)["setup"].source, TABLES[name]["helpers"]
    answers = {key: cell.source for key, cell in cells(name).items() if key.endswith("-answer")}
    code = [text for key, text in answers.items() if cells(name)[key].cell_type == "code"]
    missed = {}
    for slug in (slug for of, slug in TESTS if of == name):
        test, (start, function) = cells(name)[f"{slug}-test"].source, head(name, slug)
        found = run([*setup, *code], f"{answers[f'{slug}-answer']}\n{test}", name)
        kinds = {kind for kind, _ in found}
        if kinds - {"html"} != {"text"}:
            missed[slug, "reference"] = found
        visible = re.sub(r"### BEGIN HIDDEN TESTS.*### END HIDDEN TESTS", "", test, flags=re.DOTALL)
        fewer = ["from dataclasses import replace", f"_known = problem({name!r}, {slug!r})"]
        fewer.append(f"assert replace(_known, draws=8000).accepts({function}, 5)")
        for mistake in TABLES[name][slug]["mistakes"]:
            for body in mistake["code"]:
                wrong = start + indent(body.strip(), "    ")
                found = run([*setup, *code], f"{wrong}\n\n{visible}", name)
                # only the first sampler makes as many draws as a student's sampler
                if "law" in TABLES[name][slug]:
                    visible = "\n".join([visible.split("assert")[0], *fewer])
                hints = [text for kind, text in found if kind == "hint"]
                if not hints or not hints[0].startswith(mistake["hint"]):  # an example follows
                    missed[slug, mistake["hint"]] = found
    assert missed == {}


def opened(page, address, name):
    page.goto(f"{address}/{name}")
    page.wait_for_load_state("networkidle")


def test_cells_load_python_only_when_they_run_and_can_be_changed(page, book, address):
    """The first result loads at most 10 MB, and the first figure at most 20 MB. All files are from
    this server."""
    asked = []
    page.on("request", lambda request: asked.append(request))
    page.on("dialog", lambda dialog: dialog.accept())
    opened(page, address, "lessons/06_geodesics.html")
    assert {Path(r.url).name.partition("?")[0] for r in asked if "/live/" in r.url} == {
        *("live.css", "engine.js", "live.js")
    }
    sizes = {path.name: path.stat().st_size for path in (book / "_static/live").glob("*.*")}
    page.locator(".content details").evaluate_all("(all) => all.forEach((x) => { x.open = true; })")
    before = page.locator(".tag_try-cell-04 .cell_output").get_by_role("button").count()
    for cell, most in (("cell-12", 10e6), ("cell-04", 20e6)):
        part = page.locator(f".tag_try-{cell}")
        part.get_by_role("button", name="Try it").click()
        part.locator(OUTPUTS).first.wait_for()
        names = {Path(each.url).name.partition("?")[0] for each in asked if "/live/" in each.url}
        assert sum(sizes.get(name, 0) for name in names) < most
    expect(page.locator(".differences")).to_have_count(1)
    expect(page.locator(".differences")).to_contain_text("32 bits")

    expect(part.locator(".outputs figure canvas")).to_be_visible()  # this picture can be turned
    expect(part.locator(".cell_output canvas")).to_be_visible()
    code = part.locator(".cm-content")
    code.press("ControlOrMeta+a")
    page.keyboard.insert_text("print(1)\nwhile True:\n    pass")
    part.get_by_role("button", name="Run").click()
    part.locator(".outputs pre").wait_for()
    part.get_by_role("button", name="Stop").click()
    expect(part.locator(".outputs .error")).to_have_text("Stopped.")
    code.press("ControlOrMeta+a")
    page.keyboard.insert_text("6 * 7")
    code.press("Shift+Enter")
    expect(part.locator(".outputs pre")).to_have_text("42")
    part.get_by_role("button", name="Reset").click()
    expect(code).to_contain_text("paper.figure_1")
    assert part.locator(".cell_output").first.get_by_role("button").count() == before


def check_outputs_of_two_cells(page):
    """Run two cells at the same time, twice; the outputs appear below their own cells."""
    for number, code in enumerate(("import time\ntime.sleep(2)\nprint('one')", "print('two')")):
        write(page, number, code)
    checks = page.get_by_role("button", name="Check")
    for _ in range(2):  # the first time, Python is still loading
        checks.nth(0).click()
        page.wait_for_timeout(500)
        checks.nth(1).click()
        for number, said in enumerate(("one", "two")):
            shown = page.locator(".outputs").nth(number).locator("pre:not(.error)")
            expect(shown).to_have_text(said)


@pytest.mark.slow
def test_a_second_visit_uses_stored_files(context, address):
    codes = "import scipy.linalg as la; print(la.expm([[0.0]]))", "import rbcourse; print(1)"
    for visit in range(2):
        with watched(context) as page:
            page.goto(f"{address}/lessons/00_start_here.html")
            for code in codes:
                found = page.evaluate(RUN, [{"above": [], "source": code}, ""])
                assert {kind for kind, _ in found} == {"text"}, (visit, found)
            stored = "async () => (await (await caches.open('rbcourse engine')).keys()).length"
            assert page.evaluate(stored) == 1


def test_pages_opened_as_files_explain_what_is_missing(page, book):
    page.goto((book / "problems/ps1.html").as_uri())
    page.get_by_role("button", name="Check").first.dispatch_event("click")  # formulas move it
    expect(page.locator(".outputs .error").first).to_contain_text("web server")
    page.goto((book / "lessons/04_nearest_rotation.html").as_uri())
    page.locator(".try:visible").first.click()
    expect(page.locator(".outputs .error")).to_contain_text("book --live --serve")


def write(page, number, text):
    """Write an answer into the editor with this number."""
    editor = page.locator(".editor").nth(number)
    editor.get_by_role("textbox").focus()
    words = editor.evaluate("(editor) => Boolean(editor.closest('.answer-in-words'))")
    code = editor.locator("textarea" if words else ".cm-content")
    code.press("ControlOrMeta+a")
    page.keyboard.insert_text(text)


def test_a_set_solved_in_the_book_can_be_graded(page, address, tmp_path, capsys):
    """The answer is wrong once, then right. `check`, `collect` and `grade` accept the file."""
    sources = {key: cell.source for key, cell in cells("ps1").items() if key.endswith("-answer")}
    right = [re.sub(r" *### (BEGIN|END) SOLUTION\n?", "", text) for text in sources.values()]
    opened(page, address, "problems/ps1.html")
    assert page.locator(".editor").count() == len(right)
    check_outputs_of_two_cells(page)
    start, _ = head("ps1", "pose-matrix")
    body = TABLES["ps1"]["pose-matrix"]["mistakes"][0]["code"][0]
    write(page, 0, start + indent(body.strip(), "    "))
    checks = page.get_by_role("button", name="Check")
    checks.first.click()
    expect(page.locator(".hint")).to_contain_text("The body turns the wrong way")
    write(page, 0, "1")
    expect(page.locator(".outputs").first).to_have_class(re.compile("stale"))
    for number, text in enumerate(right):
        write(page, number, text.strip())
    words = page.locator(".answer-in-words").get_by_role("textbox")
    assert words.evaluate("(area) => area.tagName") == "TEXTAREA"  # this answer is not code
    checks.first.click()
    expect(page.locator(".outputs.right")).to_contain_text("The function is correct")
    checks.nth(5).click()
    expect(page.get_by_alt_text("The figure that the cell draws")).to_be_visible()
    expect(page.locator(".kept")).to_contain_text("kept in this browser")
    page.reload()
    expect(page.locator(".outputs.right")).to_have_count(2)
    expect(page.locator(".cm-content").first).to_contain_text("cosine")
    # formulas are typeset after the page is loaded, and move the buttons
    with page.expect_download() as downloading:
        page.get_by_role("button", name="Download ps1.ipynb").dispatch_event("click")
    downloading.value.save_as(tmp_path / "ps1.ipynb")
    expect(page.locator(".kept")).to_contain_text("that you downloaded")
    not_done = "5 of 8 answers are empty or have not passed the check"
    expect(page.locator(".kept")).to_contain_text(not_done)
    page.on("dialog", lambda dialog: dialog.accept())
    page.get_by_role("button", name="Reset").first.dispatch_event("click")
    expect(page.locator(".cm-content").first).to_contain_text("NotImplemented")
    page.get_by_label("Open a downloaded file").set_input_files(tmp_path / "ps1.ipynb")
    expect(page.locator(".cm-content").first).to_contain_text("cosine")
    capsys.readouterr()
    shutil.copytree(SOURCE, tmp_path / "course" / "source")
    shutil.copy(SOURCE.parent / "nbgrader_config.py", tmp_path / "course")
    original = tmp_path / "original" / "ps1.ipynb"
    original.parent.mkdir()
    files = release("ps1", tmp_path / "course")
    original.write_bytes(files["ps1.ipynb"])
    (original.parent / "ps1.json").write_bytes(files["ps1.json"])
    submitted = check(tmp_path / "ps1.ipynb")
    assert "7 of 7 visible tests passed" in capsys.readouterr().out
    uploaded = tmp_path / "downloads" / "Ada Lovelace_123_assignsubmission_file" / "ps1.ipynb"
    # submit the file without a check, and then the checked file
    for file in (tmp_path / "ps1.ipynb", submitted):
        uploaded.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(file, uploaded)
        collect(tmp_path / "downloads", tmp_path / "course")
    grade(["ps1"], tmp_path / "course", without_box=True)
    with (tmp_path / "course" / "ps1-grades.csv").open(encoding="utf-8-sig", newline="") as table:
        (row,) = csv.DictReader(table)
    assert (row["automatic"], row["by hand"], row["remarks"]) == ("17", "tip-words-answer", "")


@pytest.mark.slow
def test_functions_of_a_set_stay_in_the_browser_for_later_sets(page, address, tmp_path):
    opened(page, address, "problems/ps2.html")
    page.evaluate("localStorage.clear()")  # other tests have used this address
    page.reload()
    own = page.get_by_role("button", name="Download my_motion.py")
    expect(own).to_be_hidden()
    for number, slug in enumerate(("hat", "vee")):
        text = cells("ps2")[f"{slug}-answer"].source
        write(page, number, re.sub(r" *### (BEGIN|END) SOLUTION\n?", "", text).strip())
        page.get_by_role("button", name="Check").nth(number).click()
        expect(page.locator(".outputs.right")).to_have_count(number + 1)
    expect(page.locator(".kept")).to_contain_text("my_motion.py has your hat_so3, vee_so3")
    with page.expect_download() as downloading:
        own.click()
    downloading.value.save_as(tmp_path / "my_motion.py")
    text = (tmp_path / "my_motion.py").read_text("utf-8")
    assert re.findall(r"^def (\w+)", text, re.MULTILINE) == ["hat_so3", "vee_so3"]
    table = page.locator(".tag_try-compare-table")
    table.get_by_role("button", name="Try it").click()
    expect(table.locator(".outputs pre")).to_contain_text("not written")  # log_so3 is empty
    expect(table.locator(".outputs pre")).to_contain_text("SciPy's")
    opened(page, address, "problems/ps8.html")
    expect(page.get_by_role("button", name="Download my_motion.py")).to_be_visible()
    setup = page.locator(".tag_try-setup")
    setup.get_by_role("button", name="Try it").click()
    expect(setup.locator(".outputs pre")).to_contain_text("vee_so3: your own, from my_motion.py")
    expect(setup.locator(".outputs pre")).to_contain_text("exp_so3: the course's")


def test_no_file_of_the_site_reveals_solutions_or_hidden_tests(book):
    """Search for hidden tests, mark schemes and model answers; for some reversed or as base64."""
    kinds = "SOLUTION|HIDDEN TESTS|MARK SCHEME"
    secrets = {line for name in SETS for line in regions(name, kinds) if len(line) >= 30}
    code = [*ROOT.glob("rbcourse/**/*.py"), *ROOT.glob("classroom/rbclassroom/**/*.py")]
    public = "\n".join(path.read_text("utf-8") for path in [*code, *LESSONS])
    secrets = {line for line in secrets if line not in public}
    assert len(secrets) > 200
    some = sorted(secrets)[::5]
    forms = {line.encode() for line in secrets} | {line.encode()[::-1] for line in some}
    shifts = [(b"xyz"[:k] + line.encode(), k) for line in some for k in range(3)]
    forms |= {base64.b64encode(text)[4 if k else 0 : -8] for text, k in shifts}
    others = {*engine.FILES, *map("{}.packed".format, engine.PACKED)}
    for path in book.rglob("*.*"):
        if path.is_file() and path.suffix not in (".png", ".gif") and path.name not in others:
            content = path.read_bytes()
            if path.suffix == ".zip":
                with zipfile.ZipFile(io.BytesIO(content)) as archive:
                    content = b"\n".join(map(archive.read, archive.namelist()))
            assert [form for form in forms if form in content] == [], path
