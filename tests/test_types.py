"""Test that type checkers accept the documented examples and refuse planted mistakes."""

import doctest
from pathlib import Path

import pytest
from mypy import api

ROOT = Path(__file__).parents[1]
MISTAKES = {
    "c(0.5, 4)": '"Literal[4]"',
    'rb.projected_spline([0, 1], poses, "rests")': "\"Literal['rests']\"",
    "rb.fastest(c, speeds=1)": 'Unexpected keyword argument "speeds"',
    'limits: rb.Limits = {"aceleration": 2}': 'Extra key "aceleration"',
    "rb.geodesic_so3": 'no attribute "geodesic_so3"',
}


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """Return the messages of mypy --strict on the examples and on the mistakes, by file."""
    folder = tmp_path_factory.mktemp("types")
    for document in ("README.md", "docs/conventions.md", "docs/recording.md"):
        text = (ROOT / document).read_text(encoding="utf-8")
        examples = "".join(each.source for each in doctest.DocTestParser().get_examples(text))
        name = Path(document).stem + "_examples.py"
        (folder / name).write_text(examples, encoding="utf-8")
    head = "import numpy as np\nimport rbcourse as rb\nposes = np.stack([np.eye(4)] * 2)\n"
    head += "c = rb.projected_spline([0, 1], poses)\n"
    (folder / "mistakes.py").write_text(head + "\n".join(MISTAKES), encoding="utf-8")
    options = ["--strict", "--config-file", "", "--untyped-calls-exclude", "pytransform3d"]
    options += ["--ignore-missing-imports", "--cache-dir", str(folder / "cache")]
    report, errors, _ = api.run([*options, *map(str, sorted(folder.glob("*.py")))])
    assert not errors
    lines = [line for line in report.splitlines() if ": error:" in line]
    return {name: [x for x in lines if name in x] for name in ("examples", "mistakes")}


def test_the_examples_of_the_documents_have_no_type_errors(found):
    assert found["examples"] == []


@pytest.mark.parametrize(("line", "mistake"), [*enumerate(MISTAKES, start=5)])
def test_a_planted_mistake_is_refused(found, line, mistake):
    [message] = [x for x in found["mistakes"] if f"mistakes.py:{line}:" in x]
    assert MISTAKES[mistake] in message
