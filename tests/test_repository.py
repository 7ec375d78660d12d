"""The files round the package agree with each other, and the package works without them."""

import doctest
import importlib.metadata
import json
import os
import re
import subprocess
import sys
import tomllib
from datetime import date
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from textwrap import dedent
from types import SimpleNamespace
from zipfile import ZipFile

import pytest
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.version import Version

import rbclassroom
import rbcourse

ROOT = Path(__file__).parents[1]
PROJECT, CLASSROOM = (
    tomllib.loads((ROOT / place / "pyproject.toml").read_text("utf-8"))["project"]
    for place in ("", "classroom")
)
LINES = [
    line
    for line in (ROOT / "environment.txt").read_text("utf-8").splitlines()
    if line and not line.startswith("#")
]
PINS = {pin.name: pin.specifier for pin in map(Requirement, LINES[:-2])}


def ranges_of_both():
    """What both distributions require, with the extras that environment.txt contains."""
    extras = PROJECT["optional-dependencies"], CLASSROOM["optional-dependencies"]
    wanted = [*PROJECT["dependencies"], *extras[0]["draw"], *extras[0]["test"]]
    wanted += CLASSROOM["dependencies"]
    wanted += [line for name in ("lessons", "lecture", "grading") for line in extras[1][name]]
    return [range_ for range_ in map(Requirement, wanted) if range_.name != "rbcourse"]


def read(name):
    return (ROOT / name).read_text("utf-8")


def test_the_environment_is_exact_and_ends_with_the_course():
    assert LINES[-2:] == ["-e .", "-e ./classroom"]
    for name, specifier in PINS.items():
        assert re.fullmatch(r"==[\d.]+", str(specifier)), name


def test_the_environment_is_what_the_package_and_its_extras_need():
    ranges = {range_.name: range_.specifier for range_ in ranges_of_both()}
    for_figures, for_speed = {"fonttools", "kiwisolver"}, {"jsonschema"}
    assert set(PINS) - set(ranges) == for_figures | for_speed
    assert set(ranges) <= set(PINS)
    for name, specifier in ranges.items():
        assert specifier.contains(Version(str(PINS[name]).removeprefix("=="))), name
        assert "==" not in str(specifier), name


def test_the_core_needs_numpy_and_scipy_only():
    assert {Requirement(line).name for line in PROJECT["dependencies"]} == {"numpy", "scipy"}


@pytest.mark.parametrize("document", ["README.md", "docs/conventions.md"])
def test_examples_of_documents_run(document, tmp_path, monkeypatch):
    """Their files are written to another folder."""
    monkeypatch.chdir(tmp_path)
    options = {"optionflags": doctest.NORMALIZE_WHITESPACE, "encoding": "utf-8"}
    failed, tried = doctest.testfile(str(ROOT / document), module_relative=False, **options)
    assert tried > 5
    assert not failed


def test_binder_gets_the_same_environment():
    assert read(".binder/requirements.txt").split() == ["-r", "../environment.txt"]


def test_binder_gets_a_python_that_the_package_takes():
    python = read(".binder/runtime.txt").strip().removeprefix("python-")
    assert SpecifierSet(PROJECT["requires-python"]).contains(python)


def test_every_file_has_the_same_version():
    version = rbcourse.__version__
    assert re.search(r"^version: (.*)$", read("CITATION.cff"), re.MULTILINE)[1] == version
    assert re.search(r"^## (\S+)", read("CHANGELOG.md"), re.MULTILINE)[1] == version
    assert rbclassroom.__version__ == version


def test_the_citation_names_both_sources():
    citation = read("CITATION.cff")
    assert "10.1243/0954406021524909" in citation
    for name in ("Belta", "Kumar", "Samayamantula", "Zou"):
        assert f"family-names: {name}" in citation


def test_both_licences_are_stated():
    assert read("LICENSE").startswith("MIT License")
    assert "CC BY 4.0" in read("README.md")


def test_every_file_that_the_readme_points_to_is_there():
    targets = re.findall(r"\]\(([^)#]+?)\)", read("README.md") + read("CONTRIBUTING.md"))
    assert targets
    for target in targets:
        assert target.startswith("https://") or (ROOT / target).exists(), target


def course(*words, code="", folder=ROOT):
    """Run course.py in a new Python, after some other code."""
    source = f"""
        import runpy, sys
        sys.argv[1:] = {list(words)!r}
        {code}
        runpy.run_path({str(ROOT / "course.py")!r}, run_name="__main__")
    """
    return subprocess.run(
        [sys.executable, "-c", dedent(source)], capture_output=True, text=True, cwd=folder
    )


def test_an_old_python_is_told_so_in_one_line():
    done = course("figures", code="sys.version_info = (3, 10, 13)")
    assert done.returncode == 1
    assert done.stdout == ""
    assert re.fullmatch(r"rbcourse needs Python 3\.11 or newer, .*3\.10 \(.*\)\.\n", done.stderr)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["figure"], "invalid choice: 'figure'"),
        (["lab2"], "invalid choice: 'lab2'"),
        (["lint", "--fix"], "lint takes no --fix"),
        (["test", "--oldest", "--newest"], "not allowed with argument --oldest"),
    ],
)
def test_a_wrong_task_is_named(words, said):
    done = course(*words)
    assert done.returncode == 2
    assert said in done.stderr


def test_without_a_task_the_tasks_are_listed():
    done = course()
    assert done.returncode == 0
    for task in ("lab", "figures", "test"):
        assert re.search(rf"^ +{task} +\w", done.stdout, re.MULTILINE), task


def test_uv_does_not_make_an_environment_of_its_own():
    assert tomllib.loads(read("pyproject.toml"))["tool"]["uv"]["managed"] is False


def course_module():
    spec = spec_from_file_location("course", ROOT / "course.py")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def setting_up(tmp_path, monkeypatch):
    """course.py in a folder of its own, where set-up only writes down what it would run."""
    module, done = course_module(), []

    def pretend(*command):
        done.append(command)
        if "venv" in command:
            assert Path(command[-1], "made-by-course.txt").read_text() == "unfinished"
            python = module.python(Path(command[-1]))
            python.parent.mkdir(parents=True)
            python.touch()

    (tmp_path / "environment.txt").write_text("numpy")
    monkeypatch.setattr(module, "ROOT", tmp_path)
    monkeypatch.setattr(module, "VENV", tmp_path / ".venv")
    monkeypatch.setattr(module, "patiently", pretend)
    return module, done


def test_set_up_is_done_once(setting_up):
    module, done = setting_up
    module.set_up()
    assert len(done) == 3  # environment, packages, fonts
    module.set_up()
    assert len(done) == 3


@pytest.mark.parametrize(
    "disturb",
    [
        lambda module: (module.ROOT / "environment.txt").write_text("scipy"),
        lambda module: module.python(module.VENV).unlink(),
        lambda module: (module.VENV / "made-by-course.txt").write_text("unfinished"),
    ],
    ids=["the environment has changed", "its Python is gone", "it was interrupted"],
)
def test_set_up_is_done_anew_when_needed(setting_up, disturb):
    module, done = setting_up
    module.set_up()
    (module.VENV / "old").touch()
    disturb(module)
    module.set_up()
    assert len(done) == 6
    assert not (module.VENV / "old").exists()


def test_an_environment_of_somebody_else_is_left_alone(setting_up):
    module, done = setting_up
    (module.VENV / "lib").mkdir(parents=True)
    with pytest.raises(
        SystemExit, match=r"\.venv was not made by course\.py.* 'rm -r \"/.*\.venv\"'"
    ):
        module.set_up()
    assert (module.VENV / "lib").exists()
    assert done == []


def test_the_environment_in_use_is_not_made_anew(setting_up, monkeypatch):
    module, _ = setting_up
    module.set_up()
    module.python(module.VENV).unlink()
    monkeypatch.setattr(sys, "prefix", str(module.VENV))
    with pytest.raises(SystemExit, match="deactivate"):
        module.set_up()
    assert module.VENV.exists()


@pytest.mark.parametrize(
    ("words", "wanted"),
    [
        (["handout", "ps1"], ["handout", "ps1"]),
        (["check", "my work/ps1.ipynb"], ["check", "HERE/my work/ps1.ipynb"]),
        (["collect", "in"], ["collect", "HERE/in"]),
        (
            ["collect", "in", "--due", "2026-12-01"],
            ["collect", "HERE/in", "--due", "2026-12-01"],
        ),
        (["grade"], ["grade"]),
        (["grade", "ps1", "ps2"], ["grade", "ps1", "ps2"]),
    ],
)
def test_a_task_for_problem_sets_runs_its_module(setting_up, tmp_path, monkeypatch, words, wanted):
    """Files are those of the folder in which the command is typed."""
    module, _ = setting_up
    ran = []
    monkeypatch.setattr(module, "run", lambda *given: ran.append(list(given)))
    monkeypatch.setattr(sys, "argv", ["course.py", *words])
    monkeypatch.chdir(tmp_path)
    module.main()
    name, *more = [word.replace("HERE", str(tmp_path)) for word in wanted]
    module = "rbclassroom.assignments"
    words = [f"{module}.check"] if name == "check" else [module, name]
    assert ran == [["-m", *words, *map(str, map(Path, more))]]


RANGES = """
[project]
dependencies = ["numpy>=2.0"]
optional-dependencies.draw = ["pillow>=11"]
optional-dependencies.test = ["mpmath>=1.2"]
optional-dependencies.lint = ["ruff==0.1"]
"""
RANGES_OF_CLASSROOM = """
[project]
dependencies = ["rbcourse[draw]", "tqdm>=4"]
optional-dependencies.lessons = ["jupyter>=1.1"]
optional-dependencies.lecture = ["voila>=0.5.8,<0.6"]
optional-dependencies.grading = ["nbgrader>=0.9,!=0.9.1"]
"""
BOUNDS = ["numpy==2.0", "pillow==11", "mpmath==1.2", "tqdm==4", "jupyter==1.1", "voila==0.5.8"]
BOUNDS += ["nbgrader==0.9"]
BOTH = ["-e", "./[draw,test]", "-e", "./classroom[lessons,lecture,grading]"]


def write_ranges(root):
    (root / "pyproject.toml").write_text(RANGES)
    (root / "classroom").mkdir()
    (root / "classroom" / "pyproject.toml").write_text(RANGES_OF_CLASSROOM)


@pytest.mark.parametrize(
    ("releases", "folder", "installed"),
    [
        ([], ".venv", ["-r", "environment.txt"]),
        (["--oldest"], ".venv-oldest", [*BOTH, *BOUNDS]),
        (["--newest"], ".venv-newest", BOTH),
    ],
)
def test_tests_run_in_the_environment_that_is_asked_for(
    setting_up, monkeypatch, releases, folder, installed
):
    """With what is stored only where it was drawn; with the further words, last, everywhere."""
    module, done = setting_up
    monkeypatch.setattr(module, "TOO_NEW", False)
    write_ranges(module.ROOT)
    ran = []
    monkeypatch.setattr(module, "run_in", lambda venv, *words: ran.append((venv, words)))
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    monkeypatch.setattr(sys, "argv", ["course.py", "test", *releases, "-q", "tests/test_so3.py"])
    module.main()
    ((venv, words),) = ran
    assert venv == module.ROOT / folder
    assert {path.name for path in module.ROOT.iterdir() if path.is_dir()} == {folder, "classroom"}
    assert done[1][-len(installed) :] == tuple(installed)
    assert all(str(module.python(venv)) in command for command in done[1:])
    assert words[:2] == ("-m", "pytest")
    assert words[-2:] == ("-q", "tests/test_so3.py")
    assert "PYTHONDONTWRITEBYTECODE" not in os.environ
    left_out = [word for word in words if word.startswith("--deselect=")]
    stored = ["notebooks", "tests/test_notebooks.py"]
    assert left_out == [f"--deselect={path}" for path in stored if releases]


@pytest.mark.parametrize("releases", ["oldest", "newest"])
def test_an_environment_of_a_range_is_made_once_a_day(setting_up, monkeypatch, releases):
    module, done = setting_up
    monkeypatch.setattr(module, "TOO_NEW", False)
    write_ranges(module.ROOT)
    for day, commands in ((1, 3), (1, 3), (2, 6)):
        today = SimpleNamespace(today=lambda day=day: date(2026, 1, day))
        monkeypatch.setattr(module, "date", today)
        module.set_up_range(releases)
        assert len(done) == commands


def test_a_python_without_the_oldest_releases_is_refused(setting_up, monkeypatch):
    module, done = setting_up
    monkeypatch.setattr(module, "TOO_NEW", True)
    with pytest.raises(SystemExit, match=r"^The oldest releases are to be had for Python 3\.11"):
        module.set_up_range("oldest")
    assert done == []


def test_every_range_has_a_lower_bound_which_is_tested():
    wanted = sorted(ranges_of_both(), key=lambda range_: range_.name)
    bounds = [Requirement(line) for line in course_module().lower_bounds()]
    assert len({bound.name for bound in bounds}) == len(bounds)
    bounds.sort(key=lambda bound: bound.name)
    for range_, bound in zip(wanted, bounds, strict=True):
        (lowest,) = [part for part in range_.specifier if part.operator == ">="]
        assert (bound.name, str(bound.specifier)) == (range_.name, f"=={lowest.version}")
        assert range_.specifier.contains(lowest.version)


@pytest.mark.parametrize("missing", [False, True])
def test_bench_goes_on_without_what_does_not_install(setting_up, monkeypatch, capsys, missing):
    module, done = setting_up
    module.set_up()
    write_ranges(module.ROOT)
    ran, pretend = [], module.patiently

    def fails(*command):
        if missing and command[-1] == "./.[peers]":
            raise module.SetUpError("no such package")
        pretend(*command)

    monkeypatch.setattr(module, "patiently", fails)
    monkeypatch.setattr(module, "run", lambda *given: ran.append(given))
    monkeypatch.setattr(sys, "argv", ["course.py", "bench"])
    capsys.readouterr()
    for _ in range(2):
        module.main()
    assert ran == [("-m", "benchmarks")] * 2
    assert len(done) == 4 - missing  # what is there is not installed again
    assert capsys.readouterr().out.count("no such package\nThe run goes on") == 2 * missing


@pytest.mark.parametrize(("edit", "folder"), [(False, "work"), (True, "notebooks")])
def test_lab_opens_the_first_lesson_and_has_nothing_of_teachers(
    edit, folder, tmp_path, monkeypatch
):
    module, ran = course_module(), []
    monkeypatch.setattr(module, "VENV", tmp_path)
    monkeypatch.setattr(module, "run", lambda *given: ran.append(list(given)))
    monkeypatch.setenv("JUPYTER_CONFIG_PATH", "")
    monkeypatch.setenv("RBCOURSE_EDIT", "")  # so that it is removed again
    module.open_lab(edit, ["--no-browser"])
    assert ([*ran[0][:2], "copy"] == ran[0]) is not edit
    address = f"/lab/tree/{folder}/00_start_here.ipynb"
    assert f"--LabApp.default_url={address}" in ran[-1]
    assert (ROOT / address.removeprefix("/lab/tree/").replace("work", "notebooks")).is_file()
    assert ran[-1][-1] == "--no-browser"
    configuration = Path(os.environ["JUPYTER_CONFIG_PATH"])
    page = json.loads((configuration / "labconfig" / "page_config.json").read_text())
    assert page["disabledExtensions"]["@jupyter/nbgrader"]
    assert page["disabledExtensions"]["@voila-dashboards/jupyterlab-preview"]
    server = json.loads((configuration / "jupyter_server_config.json").read_text())
    extensions = importlib.metadata.distribution("nbgrader").locate_file("nbgrader")
    off = server["ServerApp"]["jpserver_extensions"]
    there = {path.name for path in Path(extensions, "server_extensions").glob("[a-z]*")}
    assert {name.rpartition(".")[2] for name in off} == there | {"server_extension"}
    assert not any(off.values())
    assert not off["voila.server_extension"]
    (styles,) = server["ServerApp"]["tornado_settings"]["static_custom_path"]
    assert "invert" in Path(styles, "custom.css").read_text()


def test_what_a_command_said_last_is_kept_when_it_fails():
    module = course_module()
    with pytest.raises(module.SetUpError, match=r"^no network\n$"):
        module.patiently(sys.executable, "-c", "import sys; sys.exit('no network')")


def test_the_last_lesson_cites_what_the_citation_file_has():
    shown = re.sub(r"[{}]", "", read("notebooks/14_take_it_away.ipynb"))
    both, _ = read("CITATION.cff").split("- type: report")
    said = dict(re.findall(r"^\W*([a-z-]+): (.*)$", both, re.MULTILINE))
    for name in ("version", "family-names", "given-names", "volume", "issue", "start", "year"):
        assert said[name] in shown, name
    assert said["doi"] in shown
    assert said["title"] in shown


def test_the_peers_of_the_benchmarks_are_exact_and_not_in_the_environment():
    extras = PROJECT["optional-dependencies"]
    peers = [Requirement(line) for line in extras["peers"]]
    assert {peer.name for peer in peers} == {"roma", "torch"}
    assert not {peer.name for peer in peers} & set(PINS)
    assert all(re.fullmatch(r"==[\d.]+", str(peer.specifier)) for peer in peers)


def test_the_readme_has_a_row_for_every_task():
    tasks = re.findall(r'add_parser\("(\w+)"', read("course.py"))
    assert len(tasks) > 10
    readme = read("README.md")
    for task in tasks:
        assert re.search(rf"^\| `python3 course\.py {task}\b", readme, re.MULTILINE), task


def built(place, folder):
    code = f"from flit_core import buildapi; buildapi.build_wheel({str(folder)!r})"
    subprocess.run([sys.executable, "-c", code], cwd=ROOT / place, check=True)
    (path,) = folder.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    return built("", tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def classroom_wheel(tmp_path_factory):
    return built("classroom", tmp_path_factory.mktemp("wheel"))


def distributions_for(requirements):
    """The installed distributions that are required, and those that these require in turn."""
    left, asked = [(Requirement(line), {""}) for line in requirements], {}
    while left:
        requirement, extras = left.pop()
        name, marker = requirement.name.lower().replace("_", "-"), requirement.marker
        if marker and not any(marker.evaluate({"extra": extra}) for extra in extras):
            continue
        wanted = {"", *requirement.extras}
        if name.startswith("rbcourse") or wanted <= asked.get(name, set()):
            continue
        asked[name] = wanted | asked.get(name, set())
        needs = importlib.metadata.requires(name) or []
        left += [(Requirement(line), asked[name]) for line in needs]
    return [importlib.metadata.distribution(name) for name in asked]


NEEDS_LECTURE = ["course.lecture", "course.rehearsal", "course.votes"]
NEEDS_GRADING = [f"assignments.{name}" for name in ("__main__", "autograding", "grade", "handout")]
DRAW = [*PROJECT["dependencies"], *PROJECT["optional-dependencies"]["draw"]]
EXTRAS = CLASSROOM["optional-dependencies"]
TEACH = [line for extra in ("lecture", "grading") for line in EXTRAS[extra]]
IMPORTED = {  # what is installed, and the modules that need more
    "rbcourse": (PROJECT["dependencies"], ["draw", "report"]),
    "rbcourse[draw]": (DRAW, []),
    "rbclassroom": (
        [*DRAW, *CLASSROOM["dependencies"]],
        [*NEEDS_LECTURE, *NEEDS_GRADING, "book"],
    ),
    "rbclassroom[lecture,grading]": ([*DRAW, *CLASSROOM["dependencies"], *TEACH], []),
}


@pytest.mark.parametrize("case", IMPORTED)
def test_wheels_import_completely_with_their_declared_dependencies(
    wheel, classroom_wheel, tmp_path, case
):
    """In an environment that has nothing else: links to the distributions, and the wheels."""
    installed, without = IMPORTED[case]
    package = case.partition("[")[0]
    for distribution in distributions_for(installed):
        for top in {file.parts[0] for file in distribution.files} - {"..", "__pycache__"}:
            link = tmp_path / top
            if not link.exists():
                link.symlink_to(distribution.locate_file(top))
    for path in (wheel, classroom_wheel)[: 1 + (package == "rbclassroom")]:
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
    words = [sys.executable, "-I", "-S", "-W", "ignore", "-c", dedent(code)]
    done = subprocess.run(words, capture_output=True, text=True)
    assert done.stderr.splitlines()[-1:] == []
    assert len(done.stdout.split()) > 15


def test_the_five_lines_run_from_the_wheel_with_numpy_and_scipy_alone(wheel, tmp_path):
    five = re.search(r"Five lines.*?```python\n(.*?)```", read("README.md"), re.DOTALL)[1]
    lines = [line.removeprefix(">>> ") for line in five.splitlines() if line.startswith(">>> ")]
    assert len(lines) == 5
    code = f"""
        import sys
        sys.path.insert(0, {str(wheel)!r})
        known = {{"numpy", "scipy", "rbcourse", *sys.stdlib_module_names}}

        class Nothing:
            def find_spec(self, name, path=None, target=None):
                if name.split(".")[0] not in known and not name.startswith("_"):
                    raise ModuleNotFoundError(name)

        sys.meta_path.insert(0, Nothing())
        import rbcourse
        assert rbcourse.__file__.startswith({str(wheel)!r})
    """
    code = "\n".join([dedent(code), *lines])
    done = subprocess.run(
        [sys.executable, "-I", "-c", code], capture_output=True, text=True, cwd=tmp_path
    )
    assert done.stderr == ""
    header, *rows = (tmp_path / "motion.csv").read_text("utf-8").splitlines()
    assert header.startswith("time [s],x [m],")
    assert len(rows) == 101
    assert rows[40].startswith("2.0,2.0")


def test_the_wheel_carries_types_and_style(wheel):
    names = ZipFile(wheel).namelist()
    assert "rbcourse/py.typed" in names
    assert {"rbcourse/rbcourse.mplstyle", "rbcourse/paper.mplstyle"} <= set(names)
    assert not [name for name in names if not name.startswith("rbcourse")]
    drawn = [name for name in names if name.startswith("rbcourse/draw/")]
    assert len(names) - len(drawn) <= 45


def test_the_classroom_carries_its_pages(classroom_wheel):
    names = ZipFile(classroom_wheel).namelist()
    assert "rbclassroom/course/lecture_view/index.html.j2" in names
    assert {name.split("/")[0] for name in names} <= {"rbclassroom"} | {
        name.split("/")[0] for name in names if ".dist-info" in name
    }
