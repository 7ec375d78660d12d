"""The files around the package agree with each other, and the package works without them."""

import doctest
import importlib.metadata
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
import warnings
from pathlib import Path
from textwrap import dedent
from zipfile import ZipFile

import numpy as np
import pytest
import recording
import yaml
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name as canonical
from test_recordings import MOTIVE, UR, VICON

import course
import rbclassroom
import rbcourse
from rbclassroom.course import lab, options
from rbcourse.draw.drawing import OPTIONS

ROOT = Path(__file__).parents[1]
PROJECT, CLASSROOM = (
    tomllib.loads((ROOT / place / "pyproject.toml").read_text("utf-8"))["project"]
    for place in ("", "classroom")
)
EXTRAS = {  # each list has these extras of rbcourse and rbcourse-classroom
    "environment.txt": (["draw"], ["lessons"]),
    "classroom/environment-teach.txt": ([], ["grading"]),
    "classroom/environment-book.txt": ([], ["book"]),
    "tests/environment-test.txt": (["test", "lint"], ["browser"]),
}
NAMES = list(EXTRAS)
WITH_CODE = "conventions", "museum", "recording"
LISTS = {name: (ROOT / name).read_text("utf-8").splitlines() for name in NAMES}
PINS = {
    name: [Requirement(line.partition("#")[0]) for line in lines if line[0] not in "#-"]
    for name, lines in LISTS.items()
}


def ranges_of(name):
    """Return the dependencies and the extras from which a list is made."""
    wanted = []
    for project, extras in zip((PROJECT, CLASSROOM), EXTRAS[name], strict=True):
        wanted += project["dependencies"] if name == "environment.txt" else []
        wanted += [line for extra in extras for line in project["optional-dependencies"][extra]]
    return [range_ for range_ in map(Requirement, wanted) if range_.name != "rbcourse"]


def read(name):
    return (ROOT / name).read_text("utf-8")


def test_all_lists_pin_the_same_versions():
    versions = {}
    for name, lines in LISTS.items():
        editable = [line.split("#")[0].strip() for line in lines if line.startswith("-")]
        assert editable == (["-e .", "-e ./classroom"] if name == "environment.txt" else [])
        for pin in PINS[name]:
            assert re.fullmatch(r"==[\w.]+", str(pin.specifier)), pin
            assert versions.setdefault((pin.name, str(pin.marker)), pin.specifier) == pin.specifier
    others = {"nbgrader", "sympy", "sphinx", "pytest", "nbval", "mypy", "ruff", "notebook"}
    assert not {canonical(pin.name) for pin in PINS["environment.txt"]} & others
    peers = [Requirement(line) for line in PROJECT["optional-dependencies"]["peers"]]
    assert all(re.fullmatch(r"==[\d.]+", str(peer.specifier)) for peer in peers)
    assert not {peer.name for peer in peers} & {name for name, _ in versions}


@pytest.mark.parametrize("name", NAMES)
def test_each_list_has_all_requirements(name):
    """Every direct or indirect requirement must be in the list or in a list before it."""
    pins = {canonical(pin.name): pin for other in NAMES for pin in PINS[other]}
    there = {canonical(pin.name) for other in NAMES[: NAMES.index(name) + 1] for pin in PINS[other]}
    ranges = ranges_of(name)
    for range_ in ranges:
        assert range_.specifier.contains(str(pins[canonical(range_.name)].specifier)[2:]), range_
        bounded = any(part.operator == ">=" for part in range_.specifier)
        assert bounded or name not in NAMES[:2], range_
    needed = {canonical(each.name) for each in distributions_for(map(str, ranges))}
    assert needed <= there | {"pip"}


@pytest.mark.parametrize("document", ["README.md", *(f"docs/{x}.md" for x in WITH_CODE)])
def test_examples_in_documents_run(document, tmp_path, monkeypatch):
    """The examples write their files to another folder."""
    shutil.copy(ROOT / "docs/recording.txt", tmp_path)
    (tmp_path / "motive.csv").write_text(MOTIVE)
    (tmp_path / "vicon.csv").write_text(VICON)
    (tmp_path / "ur.csv").write_text(UR)
    monkeypatch.chdir(tmp_path)
    options = {"optionflags": doctest.NORMALIZE_WHITESPACE, "encoding": "utf-8"}
    failed, tried = doctest.testfile(str(ROOT / document), module_relative=False, **options)
    assert tried > 5
    assert not failed


def test_the_example_of_a_recording_is_made_by_its_script():
    """Another processor may round a number in its last digit."""
    stored, made = read("docs/recording.txt").splitlines(), recording.recording().splitlines()
    assert len(stored) == len(made) == 4001
    assert stored[0] == made[0]
    assert np.allclose(np.loadtxt(stored[1:]), np.loadtxt(made[1:]), 0, 2e-7, equal_nan=True)


def test_binder_and_the_citation_agree_with_the_package():
    assert read(".binder/requirements.txt").split() == ["-r", "../environment.txt"]
    python = read(".binder/runtime.txt").strip().removeprefix("python-")
    assert SpecifierSet(PROJECT["requires-python"]).contains(python)
    assert {Requirement(line).name for line in PROJECT["dependencies"]} == {"numpy", "scipy"}
    version = rbcourse.__version__
    assert re.search(r"^version: (.*)$", read("CITATION.cff"), re.MULTILINE)[1] == version
    assert re.search(r"^## (\S+)", read("CHANGELOG.md"), re.MULTILINE)[1] == version
    assert rbclassroom.__version__ == version


def test_every_file_that_the_readme_links_to_exists():
    for name in ("README.md", "CONTRIBUTING.md", "docs/authoring.md", "docs/set_up.md"):
        text = re.sub("`[^`\n]+`", "", read(name))
        targets = re.findall(r"\]\(([^)#]+?)\)|^\[\w+\]: (\S+)", text, re.MULTILINE)
        assert targets
        for target in map("".join, targets):
            there = (ROOT / name).parent / target
            assert there.exists() or target.startswith("https://"), target
            assert "OWNER" not in target


def test_uv_does_not_make_an_environment_of_its_own():
    assert tomllib.loads(read("pyproject.toml"))["tool"]["uv"]["managed"] is False
    script = re.search(r"(?s)^# /// script\n(.*?)^# ///\n", read("course.py"), re.MULTILINE)[1]
    header = tomllib.loads(script.replace("# ", ""))
    assert header == {"requires-python": PROJECT["requires-python"]}


@pytest.mark.parametrize(("edit", "folder"), [(False, "work"), (True, "notebooks")])
def test_lab_opens_the_first_lesson_without_the_extensions_for_teachers(
    edit, folder, tmp_path, monkeypatch
):
    copied, opened = [], []
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    monkeypatch.setattr(sys, "argv", ["lab", "--no-browser", *["--edit"] * edit])
    monkeypatch.setattr(lab, "copy_lessons", lambda *paths: copied.append(paths))
    monkeypatch.setattr("jupyterlab.labapp.LabApp.launch_instance", opened.extend)
    monkeypatch.setenv("JUPYTER_CONFIG_PATH", "")
    monkeypatch.setenv("RBCOURSE_EDIT", "")  # pytest will restore this variable after the test
    with warnings.catch_warnings():
        lab.main()
    assert bool(copied) is not edit
    address = f"/lab/tree/{folder}/00_start_here.ipynb"
    assert f"--LabApp.default_url={address}" in opened
    assert (ROOT / address.removeprefix("/lab/tree/").replace("work", "notebooks")).is_file()
    assert "--no-browser" in opened
    configuration = Path(os.environ["JUPYTER_CONFIG_PATH"])
    page = json.loads((configuration / "labconfig" / "page_config.json").read_text())
    assert page["disabledExtensions"]["@jupyter/nbgrader"]
    server = json.loads((configuration / "jupyter_server_config.json").read_text())
    extensions = importlib.metadata.distribution("nbgrader").locate_file("nbgrader")
    off = server["ServerApp"]["jpserver_extensions"]
    there = {path.name for path in Path(extensions, "server_extensions").glob("[a-z]*")}
    assert {name.rpartition(".")[2] for name in off} == there
    assert not any(off.values())


def test_the_last_lesson_agrees_with_the_citation_file():
    shown = read("notebooks/17_take_it_away.ipynb")
    said = dict(re.findall(r"^([a-z-]+): (.*)$", read("CITATION.cff"), re.MULTILINE))
    assert said["version"] in shown


def test_the_book_is_published_only_if_all_tests_pass():
    """The tests run with the oldest Python that the package allows."""
    jobs = yaml.safe_load(read(".github/workflows/tests.yml"))["jobs"]
    assert PROJECT["requires-python"] == f">={jobs['test']['strategy']['matrix']['python'][0]}"
    assert {"run": "python course.py test"} in jobs["test"]["steps"]
    assert jobs["publish"]["needs"] == "test"


@pytest.fixture(scope="module")
def wheels(tmp_path_factory):
    """Build the wheels of rbcourse and of rbcourse-classroom; return their paths."""
    folder = tmp_path_factory.mktemp("wheels")
    code = f"from flit_core import buildapi; print(buildapi.build_wheel({str(folder)!r}))"
    words = [sys.executable, "-c", code]
    return [
        folder / subprocess.check_output(words, cwd=ROOT / place, text=True).strip()
        for place in ("", "classroom")
    ]


def distributions_for(requirements):
    """Return the installed distributions that are required, directly or indirectly."""
    left, asked = [(Requirement(line), {""}) for line in requirements], {}
    while left:
        requirement, extras = left.pop()
        name, marker = canonical(requirement.name), requirement.marker
        if marker and not any(marker.evaluate({"extra": extra}) for extra in extras):
            continue
        wanted = {"", *requirement.extras}
        if name.startswith("rbcourse") or wanted <= asked.get(name, set()):
            continue
        asked[name] = wanted | asked.get(name, set())
        needs = importlib.metadata.requires(name) or []
        left += [(Requirement(line), asked[name]) for line in needs]
    return [importlib.metadata.distribution(name) for name in asked]


NEEDS_PAGES = ["course.lab", "lecture", "book", "live.engine", "explorers.recorded"]
GRADING = "__main__", "autograding", "feedback", "grade", "handout"
NEEDS_GRADING = [f"assignments.{name}" for name in GRADING]
DRAW = [*PROJECT["dependencies"], *PROJECT["optional-dependencies"]["draw"]]
TEACH = list(map(str, ranges_of("classroom/environment-teach.txt")))
IMPORTED = {  # each case lists the installed requirements, and the modules that need more
    "rbcourse": (PROJECT["dependencies"], ["draw", "paper", "report", "__main__"]),
    "rbclassroom": ([*DRAW, *CLASSROOM["dependencies"]], [*NEEDS_PAGES, *NEEDS_GRADING]),
    "rbclassroom[grading]": ([*DRAW, *CLASSROOM["dependencies"], *TEACH], NEEDS_PAGES),
}


@pytest.mark.parametrize("case", IMPORTED)
def test_wheels_import_completely_with_their_declared_dependencies(wheels, tmp_path, case):
    """The environment contains the wheels and links to these distributions, and nothing else.

    The example in the README runs with NumPy and SciPy alone.
    """
    installed, without = IMPORTED[case]
    package = case.partition("[")[0]
    for distribution in distributions_for(installed):
        for top in {file.parts[0] for file in distribution.files} - {"..", "__pycache__"}:
            link = tmp_path / top
            if not link.exists():
                link.symlink_to(distribution.locate_file(top))
    for path in wheels[: 1 + (package == "rbclassroom")]:
        ZipFile(path).extractall(tmp_path)
    code = f"""
        import importlib, pkgutil, sys
        sys.path.insert(0, {str(tmp_path)!r})
        import {package}
        for module in pkgutil.walk_packages({package}.__path__, "{package}."):
            name = module.name.removeprefix("{package}.")
            if not any(f"{{name}}.".startswith(f"{{other}}.") for other in {without!r}):
                importlib.import_module(module.name)
                print(name)
    """
    lines = re.findall(r"^>>> (.*)$", read("README.md"), re.MULTILINE)
    lines = lines if case == "rbcourse" else []
    words = [sys.executable, "-I", "-S", "-W", "ignore", "-c", "\n".join([dedent(code), *lines])]
    done = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path)
    assert done.stderr.splitlines()[-1:] == []
    assert len(done.stdout.split()) > 15
    if lines:
        assert len(lines) <= 16
        header, *rows = (tmp_path / "motion.csv").read_text("utf-8").splitlines()
        assert header.startswith("time [s],x [m],")
        assert len(rows) == 101
        assert rows[40].startswith("2.0,2.0")


def test_wheels_contain_types_and_styles(wheels):
    wanted = {
        "rbcourse": {"py.typed", "rbcourse.mplstyle", "paper.mplstyle"},
        "rbclassroom": {"lecture/static/deck.html", "lecture/static/vendor/LICENSES.txt"},
    }
    for path, (package, files) in zip(wheels, wanted.items(), strict=True):
        names = ZipFile(path).namelist()
        assert {f"{package}/{file}" for file in files} <= set(names)
        tops = {name.split("/")[0] for name in names}
        assert all(top == package or top.endswith(".dist-info") for top in tops)


def test_documents_name_the_tasks_and_options_that_exist():
    pages = ["README.md", "docs/set_up.md", "notebooks/assignments/README.md"]
    teach = (ROOT / "classroom/rbclassroom").glob("book/pages/teach/index.md")  # the book may go
    text = "".join(map(read, [*pages, *teach]))
    known = {"--depth", "--install", "--privileged"}  # of git, wsl and docker
    for task in course.TASKS:
        known.update(*(action.option_strings for action in options.parser(task)._actions))
    known |= {"--folder", *(f"--{name}" for name in OPTIONS)}  # of python -m rbcourse
    assert set(re.findall(r"(?<![\w-])--[a-z][a-z0-9-]*", text)) <= known
    tasks = re.findall(r"course\.py ([a-z]+)", text + read("CONTRIBUTING.md"))
    assert set(tasks) == set(course.TASKS)
