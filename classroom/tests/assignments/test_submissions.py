"""A student's work is found in a notebook, whatever program or accident changed the file."""

import copy
import json
import re

import nbformat
import numpy as np
import pytest
from tiny_set import ANSWERS, answered, cell

from rbclassroom.assignments.locked_cells import grade_id
from rbclassroom.assignments.submissions import Refused, count_found, read_notebook, restore

TITLE, IMPORTS, SQUARE, SQUARE_TEST, HALF, HALF_TEST, QUESTION, WORDS = range(8)
STUB = "# YOUR CODE HERE\nraise NotImplementedError()"
GOOD = {**ANSWERS, "words-answer": "It is: 2 × 2 > 0."}


def markdown(source, **fields):
    return {"cell_type": "markdown", "id": "own", "metadata": {}, "source": source, **fields}


def code(source, **fields):
    fields = {"outputs": [], "execution_count": None, **fields}
    return {"cell_type": "code", "id": "own", "metadata": {}, "source": source, **fields}


def of_every_cell(change):
    """Return a change of a notebook that changes each cell."""

    def changed(notebook):
        for at, each in enumerate(notebook["cells"]):
            change(each, at)

    return changed


def without_marks(each, at=0):
    each["metadata"] = {}


def without_fields(each, at=0):
    for key in ("id", "outputs", "execution_count"):
        each.pop(key, None)


def from_colab(each, at):
    each["metadata"] = {"id": each.pop("id"), "cellView": "form", "outputId": "5f-1"}


def from_deepnote(each, at):
    each["metadata"] = {"cell_id": f"0{at}-abc", "deepnote_cell_type": each["cell_type"]}
    each |= {"id": f"{at:032x}", "block_group": "x"}


def as_version_3(notebook):
    cells = notebook.pop("cells")
    for each in cells:
        each.pop("id")
        if each["cell_type"] == "code":
            each |= {"input": each.pop("source"), "language": "python", "collapsed": False}
            each["prompt_number"] = each.pop("execution_count")
    cells[TITLE] |= {"cell_type": "heading", "level": 1, "source": ["A tiny set"]}
    notebook |= {"nbformat": 3, "nbformat_minor": 0, "worksheets": [{"cells": cells}]}


def as_version_5(notebook):
    notebook |= {"nbformat": 5, "nbformat_minor": 0, "language": "python", "signature": "abc"}
    notebook["metadata"] = {"kernelspec": {"name": 3}, "widgets": None}


def without_types(each, at):
    del each["cell_type"]


def with_odd_fields(each, at):
    """Add fields of nteract and Kaggle, and fields that are not valid."""
    each["metadata"] |= {"inputHidden": False, "_uuid": "8f2839", "trusted": True, "editable": True}
    each |= {"outputExpanded": False, "id": "a b/ü" * 30 + str(at % 2)}
    each["attachments"] = {"a.png": "x", "b.png": None}
    if each["cell_type"] == "code":
        image = {"output_type": "display_data", "data": {"image/png": ["iVBO", "Rw"], "x": {}}}
        each |= {"outputs": [image, {"output_type": "pyout"}, None], "execution_count": "7"}


def as_lines_without_ends(each, at):
    each["source"] = "".join(each["source"]).split("\n")


def with_crlf_and_spaces(each, at):
    each["source"] = [line.replace("\n", "  \r\n") for line in each["source"]] + ["\r\n"]


def text(each):
    return "".join(each["source"])


def merged(one, two):
    """Return a change that merges a cell with the next, with the marks of one of them."""

    def change(notebook):
        above, below = notebook["cells"][one : one + 2]
        source = f"{text(above)}\n\n{text(below)}"
        notebook["cells"][one : one + 2] = [{**(above, below)[two], "source": source}]

    return change


def split(at, where):
    """Return a change that splits a cell behind a text; JupyterLab gives both parts its marks."""

    def change(notebook):
        whole, source = notebook["cells"][at], text(notebook["cells"][at])
        middle = source.index(where) + len(where)
        parts = [{**copy.deepcopy(whole), "source": s} for s in (source[:middle], source[middle:])]
        parts[1]["id"] = "new"
        notebook["cells"][at : at + 1] = parts

    return change


def removed(*places):
    def change(notebook):
        notebook["cells"] = [c for at, c in enumerate(notebook["cells"]) if at not in places]

    return change


def in_added_cell(at, place, stub=STUB, keep=True):
    """Return a change that writes an answer into an added cell, and leaves or deletes its own."""

    def change(notebook):
        given = notebook["cells"][at]
        added = (code if given["cell_type"] == "code" else markdown)(given["source"])
        given["source"] = stub
        if not keep:
            notebook["cells"].remove(given)
        notebook["cells"].insert(place, added)

    return change


def in_order(*changes):
    def change(notebook):
        for each in changes:
            each(notebook)

    return change


def added(place, cell):
    return lambda notebook: notebook["cells"].insert(place, cell)


def stubbed(at, stub):
    return lambda notebook: notebook["cells"][at].update(source=stub)


def blank_set_above(notebook):
    """Put a set without answers above the student's, as a download into one file does."""
    blank = copy.deepcopy(notebook["cells"])
    for at, stub in ((SQUARE, SQUARE_STUB), (HALF, STUB), (WORDS, "YOUR ANSWER HERE")):
        blank[at]["source"] = stub
    notebook["cells"] = blank + notebook["cells"]


def copied(at, place, source=None, kind=None):
    def change(notebook):
        twin = {**copy.deepcopy(notebook["cells"][at]), "id": "twin"}
        twin["cell_type"] = kind or twin["cell_type"]
        notebook["cells"].insert(place, {**twin, "source": source or twin["source"]})

    return change


def made(kind, *places):
    def change(notebook):
        for at in places:
            each = notebook["cells"][at]
            notebook["cells"][at] = {**each, "cell_type": kind}

    return change


def marked(**marks):
    def change(notebook):
        notebook["cells"][SQUARE_TEST]["metadata"]["nbgrader"] |= marks

    return change


def moved(notebook):
    notebook["cells"].append(notebook["cells"].pop(HALF))


UNCOMMENTED = "def square(x):\n    raise NotImplementedError()"
SQUARE_STUB = "def square(x):\n    # YOUR CODE HERE\n    raise NotImplementedError()"
LOST = "8 cells have lost the marks"
ADDED = "has the text of an added cell"
PLACE = "was found by its function or its place"
CHANGED = "was changed; it is restored"
# The changes that a human reader overlooks: each answer is found. A row has a change, the number
# of added cells that stay, and parts of the remarks.
FOUND = {
    "no metadata": (of_every_cell(without_marks), 0, [LOST]),
    "no ids and no outputs": (of_every_cell(without_fields), 0, []),
    "Colab": (of_every_cell(from_colab), 0, [LOST]),
    "Deepnote": (of_every_cell(from_deepnote), 0, ["5 cells", *[PLACE] * 3]),
    "version 3": (as_version_3, 0, []),
    "version 5": (as_version_5, 0, []),
    "no types": (of_every_cell(without_types), 0, []),
    "odd fields": (of_every_cell(with_odd_fields), 0, []),
    "lines without ends": (of_every_cell(as_lines_without_ends), 0, []),
    "ends of lines of Windows": (of_every_cell(with_crlf_and_spaces), 0, []),
    "answer merged into its test": (merged(SQUARE, 1), 0, [CHANGED, PLACE]),
    "test merged into its answer": (merged(SQUARE, 0), 0, ["was missing"]),
    "answer merged into the test above": (merged(SQUARE_TEST, 0), 0, [CHANGED, PLACE]),
    "test merged into the answer below": (merged(SQUARE_TEST, 1), 0, ["was missing"]),
    "words merged into the question": (merged(QUESTION, 0), 0, [CHANGED, PLACE]),
    "question merged into the words": (merged(QUESTION, 1), 0, ["was missing"]),
    "split function": (split(SQUARE, "(x):\n"), 0, ["was split"]),
    "split function without marks and ids": (
        in_order(split(SQUARE, "(x):\n"), of_every_cell(from_deepnote)),
        0,
        ["5 cells", *[PLACE] * 3],
    ),
    "split words": (split(WORDS, "It is: "), 0, ["was split"]),
    "split test": (split(SQUARE_TEST, "square(2)"), 0, ["was split"]),
    "copied stub": (copied(SQUARE, SQUARE + 1, SQUARE_STUB), 0, []),
    "copied test": (copied(SQUARE_TEST, SQUARE_TEST), 0, []),
    "earlier copy": (copied(SQUARE, SQUARE, "def square(x): x + x"), 1, ["is a copy; another"]),
    "function in an added cell below": (in_added_cell(SQUARE, SQUARE + 1, SQUARE_STUB), 0, [ADDED]),
    "function in the last cell": (in_added_cell(SQUARE, 8, UNCOMMENTED), 0, [ADDED]),
    "number in an added cell": (in_added_cell(HALF, HALF + 1), 0, [ADDED]),
    "words in an added cell": (in_added_cell(WORDS, 8, "YOUR ANSWER HERE"), 0, [ADDED]),
    "answer cell deleted": (in_added_cell(SQUARE, SQUARE, keep=False), 0, [PLACE]),
    "no locked cells": (removed(TITLE, SQUARE_TEST, QUESTION), 0, ["was missing"] * 3),
    "answers as Markdown": (made("markdown", SQUARE, HALF), 0, ["was made a markdown cell"] * 2),
    "raw cells": (made("raw", SQUARE, SQUARE_TEST, WORDS), 0, ["was made a raw cell"] * 3),
    "note that begins with a blank": (added(SQUARE + 1, markdown("  - a note")), 1, []),
    "code that begins with blanks": (added(SQUARE + 1, code("  square(3)")), 1, []),
    "marked note below": (copied(SQUARE, SQUARE + 1, "See above.", "markdown"), 1, ["is a copy"]),
    "marked draft below": (copied(SQUARE, SQUARE + 1, "def square(x): 1", "raw"), 1, ["is a copy"]),
    "marked scratch below": (copied(SQUARE, SQUARE + 1, "  square(3)"), 1, ["is a copy"]),
    "changed copy of a test": (copied(SQUARE_TEST, SQUARE, "square(3)"), 1, ["is a copy"]),
    "blank set above": (blank_set_above, 0, []),
    "function quoted in a note": (
        in_order(
            in_added_cell(SQUARE, SQUARE + 1, SQUARE_STUB),
            added(8, markdown("```\ndef square(x):\n    return 0\n```")),
        ),
        1,
        [ADDED],
    ),
    "words as a note at the end": (
        in_order(added(8, markdown("own")), copied(WORDS, 9, "a note")),
        2,
        ["is a copy"],
    ),
    "lambda in an added cell": (
        in_order(added(SQUARE + 1, code("square = lambda x: x * x")), stubbed(SQUARE, SQUARE_STUB)),
        0,
        [ADDED],
    ),
    "one mark lost, only answers kept": (
        in_order(removed(0, 1, 3, 5, 6), lambda notebook: notebook["cells"][0].update(metadata={})),
        0,
        ["1 cells have lost", "each was missing"],
    ),
    "half of a locked text": (stubbed(IMPORTS, "import math\n\nimport math"), 0, [CHANGED]),
    "another version at the end": (
        added(8, code("def square(x):\n    return 0")),
        1,
        ["defines the function of an answer again, below its test"],
    ),
    "another version above the test": (
        added(SQUARE + 1, code("def square(x):\n    return x * x")),
        1,
        [],
    ),
    "points": (marked(points=20, grade=False), 0, ["has other points or marks; it is restored"]),
    "moved to the end": (moved, 0, ["not in the order"]),
}
FILES = {
    "UTF-16": lambda text: text.encode("utf-16"),
    "Windows-1252": lambda text: text.encode("cp1252"),
}


def submitted(release, change=None):
    """Return a student's file, as a dict."""
    right = answered(release, **{key.removesuffix("-answer"): v for key, v in GOOD.items()})
    notebook = json.loads(nbformat.writes(right))
    if change:
        change(notebook)
    return notebook


def restored(release, content):
    notebook = read_notebook(content, "ps0.ipynb")
    remarks = restore(notebook, nbformat.reads(release, as_version=4))
    nbformat.validate(notebook)
    return notebook, remarks


def check_found(release, content, added=0):
    notebook, remarks = restored(release, content)
    original = nbformat.reads(release, as_version=4)
    found = {grade_id(each): each for each in notebook.cells if grade_id(each)}
    for given in original.cells:
        name = grade_id(given)
        wanted = copy.deepcopy(given)
        wanted.source = GOOD.get(name, given.source)
        lambda_ = name == "square-answer" and "lambda" in found[name].source
        assert found[name].source.split() == wanted.source.split() or lambda_, name
        assert {**found[name], "source": ""} == {**wanted, "source": ""}
    assert len(notebook.cells) == len(original.cells) + added
    assert not any("\r" in each.source for each in notebook.cells)
    return notebook, remarks


@pytest.mark.parametrize("name", FOUND)
def test_every_answer_is_found(release, name):
    change, added, said = FOUND[name]
    content = json.dumps(submitted(release, change)).encode()
    notebook, remarks = check_found(release, content, added)
    assert len(remarks) == len(said), remarks
    assert all(any(part in remark for remark in remarks) for part in said), remarks
    names = [grade_id(each) for each in notebook.cells if grade_id(each)]
    original = nbformat.reads(release, as_version=4)
    assert names == [*map(grade_id, original.cells)] or name == "moved to the end"


@pytest.mark.parametrize("name", FILES)
def test_files_in_other_encodings_are_read(release, name):
    content = FILES[name](json.dumps(submitted(release), ensure_ascii=False))
    assert check_found(release, content)[1] == []


def test_a_damaged_letter_is_replaced_and_its_cell_is_named(release):
    def change(notebook):
        notebook["cells"][WORDS]["source"] = "It is \ud83d."
        notebook["cells"].insert(1, markdown("\udc00"))

    notebook, remarks = restored(release, json.dumps(submitted(release, change)).encode())
    assert cell(notebook, "words-answer").source == "It is ?."
    end = "has a damaged letter, which is replaced by “?”"
    title = "of “A tiny set”"
    assert remarks == [f"cell 2, added cell {title} {end}", f"cell 9, answer {title} {end}"]


def test_pictures_with_one_name_and_in_other_cells_are_kept(release):
    """JupyterLab names every pasted picture image.png."""

    def change(notebook):
        shown, words = "![x](attachment:image.png)", notebook["cells"][WORDS]
        one, two = ({"image.png": {"image/png": each}} for each in ("AAAA", "BBBB"))
        words["source"] = "YOUR ANSWER HERE"
        notebook["cells"].append(markdown(f"one {shown}", attachments=one))
        notebook["cells"].append(markdown(f"two {shown}", attachments=two))
        question = notebook["cells"][QUESTION]
        question["source"], question["attachments"] = f"{text(question)}\n\n{shown}", one

    notebook, _ = restored(release, json.dumps(submitted(release, change)).encode())
    words = cell(notebook, "words-answer")
    names = re.findall(r"attachment:([\w.-]+)", words.source)
    shown = [words.attachments[name]["image/png"] for name in names]
    assert shown == ["AAAA", "AAAA", "BBBB"]


def test_a_very_deep_cell_is_kept(release):
    """Python raises RecursionError or MemoryError for it, not SyntaxError."""
    text = "    x = " + "a." * 10**5 + "a"
    content = json.dumps(submitted(release, added(SQUARE + 1, code(text)))).encode()
    notebook, remarks = check_found(release, content, added=1)
    assert (notebook.cells[SQUARE + 1].source, remarks) == (text, [])


def test_an_answer_in_the_cell_of_another_answer_counts(release):
    """The empty answer would define the function again, without its text."""

    def change(notebook):
        half, square = notebook["cells"][HALF], notebook["cells"][SQUARE]
        imports = notebook["cells"][IMPORTS]
        half["source"], square["source"] = f"{GOOD['square-answer']}\n\nhalf = 0.5", SQUARE_STUB
        notebook["cells"][IMPORTS : IMPORTS + 1] = [imports, half]
        del notebook["cells"][HALF + 1]

    notebook, remarks = restored(release, json.dumps(submitted(release, change)).encode())
    assert cell(notebook, "square-answer").source.startswith("# This answer is in another cell")
    assert any("is empty; another cell has its function" in remark for remark in remarks)


def test_texts_in_locked_cells_become_added_cells(release):
    def change(notebook):
        notebook["cells"][IMPORTS]["source"] = "import math\nimport cmath"
        notebook["cells"][SQUARE_TEST]["source"] = "print(square(3))"
        notebook["cells"][QUESTION]["source"] = ""

    notebook, remarks = restored(release, json.dumps(submitted(release, change)).encode())
    added = [(at, each.source) for at, each in enumerate(notebook.cells) if not grade_id(each)]
    assert added == [(2, "import cmath"), (4, "print(square(3))")]
    assert cell(notebook, "imports").source == "import math"
    assert [remark.partition(" was changed")[2] for remark in remarks] == [
        "; it is restored, and its other text is in an added cell",
        "; it is restored, and its other text is in an added cell",
        "; it is restored",
    ]


def damaged(notebook, rng):
    """Damage a notebook in several ways that keep all texts of the student."""
    for _ in range(rng.integers(1, 6)):
        cells = notebook["cells"]
        at, kind = int(rng.integers(len(cells) - 1)), rng.integers(7)
        source = text(cells[at])
        if kind == 0:
            of_every_cell(without_marks)(notebook)
        elif kind == 1:
            for each in cells:
                each.pop("id", None)
        elif kind == 2 and not re.search("OWN", source):
            removed(at)(notebook)
        elif kind == 3 and "\n" in source:
            split(at, source.split("\n")[0])(notebook)
        elif kind == 4:
            merged(at, int(rng.integers(2)))(notebook)
        elif kind == 5:
            cells.insert(int(rng.integers(len(cells))), cells.pop(at))
        elif kind == 6:
            copied(at, int(rng.integers(len(cells))))(notebook)


@pytest.mark.parametrize("seed", range(100))
def test_no_text_of_a_student_is_lost(release, seed):
    """Each word OWN… is in the restored notebook, and the cells of the set are complete."""

    def change(notebook):
        for at in (SQUARE, HALF, WORDS):
            notebook["cells"][at]["source"] = f"{text(notebook['cells'][at])}\n\n# OWN{at}"
        notebook["cells"].insert(3, markdown("OWN8"))
        notebook["cells"].insert(6, code("# OWN9"))
        damaged(notebook, np.random.default_rng(seed))

    content = json.dumps(submitted(release, change)).encode()
    try:
        notebook, _ = restored(release, content)
    except Refused as refused:
        assert "copy your answers" in str(refused)  # noqa: PT017
        return
    whole = "\n".join(each.source for each in notebook.cells)
    assert {*re.findall(r"OWN\d", content.decode())} == {*re.findall(r"OWN\d", whole)}
    names = sorted(grade_id(each) for each in notebook.cells if grade_id(each))
    original = nbformat.reads(release, as_version=4)
    assert names == sorted(map(grade_id, original.cells))
    for given in original.cells:
        if not given.metadata.nbgrader.solution:
            assert {**cell(notebook, grade_id(given)), "id": given.id} == given
    nbformat.validate(notebook)


def test_answers_without_marks_count_as_cells_of_the_set(release):
    """Another program has kept the text of the code alone; the tests begin with "# %%"."""

    def code_alone(notebook):
        cells = [code(text(each)) for each in notebook["cells"] if each["cell_type"] == "code"]
        for each in cells:
            each["source"] = f"# %%\n{each['source']}"
        notebook["cells"] = cells

    content = json.dumps(submitted(release, code_alone)).encode()
    original = nbformat.reads(release, as_version=4)
    assert 2 * count_found(read_notebook(content, "it"), original) < 8
    notebook, _ = restored(release, content)
    for name in ("square-answer", "half-answer"):
        assert GOOD[name].strip() in cell(notebook, name).source


def of_another_set(each, at):
    each["metadata"]["nbgrader"]["grade_id"] += "-of-another"


def new_notebook_of(*sources):
    def change(notebook):
        notebook["cells"] = [code(source) for source in sources]

    return change


@pytest.mark.parametrize(
    ("change", "named", "found"),
    [
        (of_every_cell(of_another_set), 0, 1),  # one cell defines a function of the set
        (new_notebook_of(*GOOD.values()), 0, 1),
        (new_notebook_of("import math", "half = 0.5"), 1, 1),
        (in_order(removed(0, 1, 2, 3, 5), of_every_cell(without_marks)), 3, 3),
    ],
)
def test_a_notebook_with_too_few_cells_of_the_set_is_refused(release, change, named, found):
    content, original = json.dumps(submitted(release, change)).encode(), nbformat.reads(release, 4)
    assert count_found(read_notebook(content, "it"), original) == named
    with pytest.raises(Refused, match=rf"only {found} of the 8 cells .* copy your answers into a"):
        restored(release, content)


CONFLICT = b'{\n<<<<<<< HEAD\n"a": 1\n=======\n>>>>>>> b\n}'
BROKEN = [b"no json", b'{"cells": 3}', b'{"cells": [3]}', b"[1]", b"3", b"\xff\xfe"]
BROKEN += [b'{"cells": []}', b'{"cells": ' + b"[" * 10**5, b'{"cells": [{"source": 3}]}']
BROKEN += [b'{"cells": [{"source": [3]}]}', b'{"nbformat": 4', b"\x00" * 100, b"9" * 5000]


@pytest.mark.parametrize(
    ("content", "said"),
    [(b" ", "empty"), (b"%PDF-1.7", "a PDF or an archive"), (b"PK\x03", "a PDF or an archive")]
    + [(b'{\n "cells": [\n', "damaged or not a notebook .it stops being JSON in line 3")]
    + [(b'{"cells": []}', r"damaged or not a notebook \(it has no cells\);")]
    + [(content, "damaged or not a notebook") for content in BROKEN],
)
def test_files_without_a_notebook_are_refused(content, said):
    with pytest.raises(Refused, match=f"^my.ipynb is {said}"):
        read_notebook(content, "my.ipynb")
    with pytest.raises(Refused, match=r"^my.ipynb has conflicts of a merge in git"):
        read_notebook(CONFLICT, "my.ipynb")


def test_ends_of_lines_of_all_systems_are_read():
    content = json.dumps({"cells": [{"source": "a\r\nb\rc\n\nd"}]}).encode()
    assert read_notebook(content, "it").cells[0].source == "a\nb\nc\n\nd"
