"""course.py makes .venv, also after interruptions, and runs the tasks."""

import errno
import os
import re
import runpy
import shutil
import signal
import subprocess
import sys
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace

import psutil
import pytest

import course
from rbclassroom.course import lab, options

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize(
    ("words", "version", "message"),
    [
        (["--help"], (3, 10, 13), r"rbcourse needs Python 3\.11 or newer, .*3\.10 \(.*\)\."),
        (["figure"], None, r"(?s).*There is no task 'figure'\. Choose from: lab, check.*"),
    ],
)
def test_an_old_python_and_an_unknown_task_are_reported(
    words, version, message, monkeypatch, capsys
):
    monkeypatch.setattr(sys, "argv", ["course.py", *words])
    monkeypatch.setattr(sys, "version_info", version or sys.version_info)
    monkeypatch.setattr(signal, "signal", lambda *_: None)
    with pytest.raises(SystemExit) as left:
        runpy.run_path(str(ROOT / "course.py"), run_name="__main__")
    said = capsys.readouterr()
    assert re.fullmatch(message, (said.err or str(left.value.code)).strip())
    assert said.out == ""


def test_tasks_are_listed_if_none_is_given(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["course.py"])
    course.main()
    said = capsys.readouterr().out
    for task in course.TASKS:
        assert re.search(rf"^ +{task} +\w", said, re.MULTILINE), task
    with pytest.raises(course.SetUpError, match=r"^no network\n$"):
        course.patiently(sys.executable, "-c", "import sys; sys.exit('no network')")


@pytest.fixture
def done(tmp_path, monkeypatch):
    """Give course.py a new folder, where it only records its commands; return their list."""
    done, site = [], tmp_path / ".venv" / "lib" / "site-packages"

    def pretend(*command, **_):
        command = [str(word) for word in command]
        done.append(command)
        if "venv" in command:
            assert course.read_stamp() == {"unfinished": True}
            for path in (Path(course.python()), site / "numpy.py"):
                path.parent.mkdir(parents=True)
                path.touch()

    for path in course.LISTS.values():
        (tmp_path / path).parent.mkdir(exist_ok=True)
        (tmp_path / path).write_text("numpy")
    monkeypatch.setattr(course, "ROOT", tmp_path)
    monkeypatch.setattr(course, "VENV", tmp_path / ".venv")
    monkeypatch.setattr(course, "DISCARDED", tmp_path / ".venv-discarded")
    monkeypatch.setattr(course, "site_packages", lambda: site)
    monkeypatch.setattr(course, "UV", "uv")
    monkeypatch.setattr(course, "patiently", pretend)
    return done


def installed(done):
    return [command[command.index("-r") + 1 :: 2] for command in done if "-r" in command]


def test_a_list_is_installed_again_only_if_it_changes(done):
    for environment in ("lessons", "lessons", "teach", "test", "test", "lessons"):
        course.set_up(environment)
    lessons, teach, book, test = course.LISTS.values()
    assert installed(done) == [[lessons], [teach], [book, test]]
    (course.ROOT / teach).write_text("scipy")
    course.set_up("teach")
    assert teach in installed(done)[3]
    assert sum("venv" in command for command in done) == 1


DISTURBED = {
    "the environment has changed": lambda: (course.ROOT / "environment.txt").write_text("scipy"),
    "its Python is gone": lambda: Path(course.python()).unlink(),
    "it was interrupted": lambda: course.write_stamp({"unfinished": True}),
    "its stamp is damaged": lambda: (course.VENV / course.STAMP).write_bytes(b"\xff"),
    "its stamp is a list": lambda: (course.VENV / course.STAMP).write_text('["files"]'),
    "it is empty": lambda: shutil.rmtree(course.VENV) or course.VENV.mkdir(),
    "it was discarded": lambda: course.VENV.rename(course.DISCARDED),
}


@pytest.mark.parametrize("disturb", DISTURBED.values(), ids=DISTURBED)
def test_the_environment_is_made_again_if_needed(done, disturb):
    course.set_up("lessons")
    (course.VENV / "old").touch()
    disturb()
    course.set_up("lessons")
    assert sum("venv" in command for command in done) == 2
    assert not (course.VENV / "old").exists()
    assert not course.DISCARDED.exists()


def test_an_environment_of_another_tool_is_left_alone(done):
    (course.VENV / "lib").mkdir(parents=True)
    message = r"\.venv was not made by course\.py.* '(rm -r|Remove-Item -Recurse) \".*\.venv\"'"
    with pytest.raises(SystemExit, match=message):
        course.set_up("lessons")
    assert (course.VENV / "lib").exists()
    assert done == []


def test_the_environment_in_use_is_not_made_again(done, monkeypatch):
    course.set_up("lessons")
    Path(course.python()).unlink()
    monkeypatch.setattr(sys, "prefix", str(course.VENV))
    with pytest.raises(SystemExit, match="deactivate"):
        course.set_up("lessons")
    assert course.VENV.exists()


def test_pip_installs_the_packages_if_uv_fails(done, monkeypatch):
    monkeypatch.setattr(course, "UV", None)
    listed = "global.index-url='https://a/simple'\nglobal.extra-index-url='b\\nc'\n:env:.no='x'\n"
    monkeypatch.setattr(course.subprocess, "run", lambda *_, **__: SimpleNamespace(stdout=listed))
    assert course.settings_of_pip("pip") == {
        "UV_INDEX_STRATEGY": "unsafe-best-match",
        "UV_DEFAULT_INDEX": "https://a/simple",
        "UV_INDEX": "b c",
    }
    pretend = course.patiently

    def fails(*command, **settings):
        pretend(*command, **settings)
        if command[1] == "pip":
            assert settings["UV_INDEX"] == "b c"
            raise course.SetUpError("no index")

    monkeypatch.setattr(course, "patiently", fails)
    course.set_up("lessons")
    make, fetch, by_uv, by_pip, _ = done
    assert make[1:3] == ["-m", "venv"]
    assert fetch[-1] == "uv"
    assert Path(by_uv[0]).parts[-2:] == ("bin", "uv")
    assert by_pip[:4] == [course.python(), "-m", "pip", "install"]
    assert by_uv[-2:] == by_pip[-2:] == ["-r", "environment.txt"]


@pytest.mark.parametrize(
    ("task", "word", "known"),
    [("handout", "ps9", "ps1"), ("grade", "ps9", "ps1"), ("figures", "99", "03")],
)
def test_an_unknown_set_or_lesson_is_named_before_packages_are_installed(
    task, word, known, done, tmp_path, monkeypatch
):
    (tmp_path / "notebooks/assignments/source/ps1").mkdir(parents=True)
    (tmp_path / "notebooks/assignments/source/ps1/ps1.ipynb").touch()
    (tmp_path / "notebooks/03_rotations.ipynb").touch()
    monkeypatch.setattr(sys, "argv", ["course.py", task, word])
    with pytest.raises(SystemExit, match=f"^{word}: one of {known} is wanted$"):
        course.main()
    assert done == []


@pytest.mark.parametrize("task", course.TASKS)
def test_each_task_passes_its_arguments_to_its_modules(task, done, tmp_path, monkeypatch):
    """Relative paths start at the folder in which the command is typed."""
    ran, here = [], tmp_path / "work"
    here.mkdir()
    (here / "ps1.ipynb").touch()
    words = {
        "lecture": ["01", "--pdf"],
        "handout": ["ps1.ipynb", "--solutions"],
        "check": ["ps1.ipynb"],
        "collect": ["ps1.ipynb", "--due", "2026-12-01"],
        "grade": ["ps1.ipynb"],
        "test": ["ps1.ipynb::Cell 1", "-k", "so3"],
        "figures": ["03", "04"],
    }.get(task, [])
    monkeypatch.setattr(course, "run", lambda *given: ran.append(given))
    monkeypatch.setattr(sys, "argv", ["course.py", task, *words])
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    monkeypatch.chdir(here)
    course.main()
    environment, commands, _ = course.TASKS[task]
    assert [*course.read_stamp()][-1] == environment
    if task in ("check", "collect", "test"):
        words[0] = str(here / words[0])
    assert ran[-1] == (*commands[-1].split(), *words)
    assert [words[0] for words in ran] == [command.split()[0] for command in commands]
    for name, *_ in ran:
        assert find_spec(name), name
    assert os.environ.pop("OPENBLAS_NUM_THREADS", "") == "1"
    assert ("PYTHONDONTWRITEBYTECODE" in os.environ) is not (task in ("test", "figures"))


@pytest.mark.parametrize("task", course.TASKS)
def test_help_and_wrong_options_of_a_task_install_nothing(task, done, monkeypatch, capsys):
    for words in (["--help"], ["--nonsense"] * (task not in options.FURTHER)):
        monkeypatch.setattr(sys, "argv", ["course.py", task, *words])
        if words:
            with pytest.raises(SystemExit):
                course.main()
    said = capsys.readouterr()
    assert said.out.startswith(f"usage: course.py {task} [-h]")
    assert task in options.FURTHER or " error: " in said.err
    assert done == []
    assert not course.VENV.exists()


def test_the_options_need_only_the_standard_library():
    code = f"import runpy, sys; runpy.run_path({options.__file__!r})['parse']('lab', ['--help'])"
    said = subprocess.check_output([sys.executable, "-I", "-S", "-c", code], text=True)
    assert "--edit" in said


class CtrlC:
    """Press Ctrl-C at the n-th line that is run in some files, as a function for `sys.settrace`."""

    def __init__(self, moment, files):
        self.left, self.files = moment, files

    def __call__(self, frame, event, _):
        if frame.f_code.co_filename not in self.files:
            return None
        if event == "line":
            self.left -= 1
            if self.left == 0:
                raise KeyboardInterrupt
        return self


@pytest.mark.filterwarnings("ignore::ResourceWarning")  # of files that are open at Ctrl-C
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_start_after_ctrl_c_at_any_moment_makes_a_working_environment(done):
    """The interrupted start renews an environment after an update of the course."""
    course.set_up("lessons")
    moment, ctrl_c = 0, CtrlC(0, ())
    while ctrl_c.left <= 0:  # it was pressed
        moment += 1
        (course.ROOT / "environment.txt").write_text(f"numpy=={moment}")
        before, ctrl_c = sys.gettrace(), CtrlC(moment, {course.__file__, shutil.__file__})
        sys.settrace(ctrl_c)
        with suppress(KeyboardInterrupt, OSError):  # shutil may close a file twice
            course.set_up("lessons")
        sys.settrace(before)
        course.set_up("lessons")
        assert course.read_stamp()["lessons"] == course.fingerprint(course.ROOT / "environment.txt")
        assert not course.DISCARDED.exists()
    assert moment > 50


UV = """
import os, pathlib, subprocess, sys, time
log = pathlib.Path("log.txt").open("a")
print(sys.argv[1], os.getpid(), file=log, flush=True)
if sys.argv[1] == "venv":
    python = sys.argv[sys.argv.index("--python") + 1]
    sys.exit(subprocess.call([python, "-m", "venv", "--without-pip", sys.argv[-1]]))
if pathlib.Path("forever").exists():
    child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
    print("child", child.pid, file=log, flush=True)
    child.wait()
site = next(pathlib.Path(".venv").glob("lib/python*/site-packages"))
for name in ("rbcourse", "rbclassroom"):
    (site / f"{name}.pth").write_text(os.getcwd(), "utf-8")
for i in range(100):
    (site / f"module{i}.py").write_text("")
"""


@pytest.fixture
def started(tmp_path):
    """Return a function that starts a task in a small course whose uv installs empty modules.

    The path of the course has spaces and umlauts.
    """
    folder = tmp_path / "Kurs \N{LATIN SMALL LETTER A WITH DIAERESIS} 1"
    lab = "import matplotlib.pyplot, module1, os; print('works', os.getpid(), flush=True)"
    texts = {
        "course.py": (ROOT / "course.py").read_text("utf-8"),
        course.OPTIONS.relative_to(ROOT): course.OPTIONS.read_text("utf-8"),
        "environment.txt": "numpy",
        "matplotlib/__init__.py": "",
        "matplotlib/pyplot.py": "",
        "classroom/rbclassroom/course/lab.py": lab,
        "uv.py": UV,
        "uv": f'#!/bin/sh\nexec "{sys.executable}" uv.py "$@"\n',
    }
    for name, text in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, "utf-8")
    (folder / "uv").chmod(0o755)
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}

    def heed():  # a shell that runs the tests in the background lets them ignore Ctrl-C
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    def start(**further):
        environment = os.environ | {"UV": str(folder / "uv"), "PYTHONPATH": ""} | further
        words = [sys.executable, str(folder / "course.py"), "lab"]
        settings = {"cwd": folder, "env": environment, "text": True, "preexec_fn": heed}
        return subprocess.Popen(words, **settings, **streams)

    start.folder, start.log = folder, lambda: (folder / "log.txt").read_text().split()
    (folder / "log.txt").touch()
    return start


posix = pytest.mark.skipif(os.name == "nt", reason="the uv of this test is a script")


@posix
def test_two_first_starts_at_once_make_one_environment(started):
    both = [started(), started()]
    said = [job.communicate()[0] for job in both]
    assert [job.returncode for job in both] == [0, 0], said
    assert all("works" in text for text in said)
    assert [word for word in started.log() if not word.isdigit()] == ["venv", "pip"]


@posix
@pytest.mark.parametrize("name", ["SIGINT", "SIGHUP"])
def test_the_children_of_an_interrupted_start_end(started, name):
    (started.folder / "forever").touch()
    job = started()
    while "child" not in started.log():
        assert job.poll() is None, job.stdout.read()
    job.send_signal(getattr(signal, name))
    said, _ = job.communicate()
    assert job.returncode == (130 if name == "SIGINT" else 143)
    assert "Traceback" not in said
    assert ("The next start continues it." in said) is (name == "SIGINT")
    left = [
        psutil.Process(int(word))
        for word in started.log()
        if word.isdigit() and psutil.pid_exists(int(word))
    ]
    assert psutil.wait_procs(left, 60)[1] == []
    (started.folder / "forever").unlink()
    assert "works" in started().communicate()[0]


@posix
def test_both_packages_are_found_by_ascii_paths(started):
    """Python 3.11 and 3.12 read these files in the encoding of the locale, also in UTF-8 mode."""
    job = started(PYTHONUTF8="1", LC_ALL="de_DE.ISO-8859-1")
    assert "works" in job.communicate()[0]
    site = next(started.folder.glob(".venv/lib/python*/site-packages"))
    for name, folder in (
        ("rbcourse", started.folder),
        ("rbclassroom", started.folder / "classroom"),
    ):
        line = (site / f"{name}.pth").read_bytes().decode("ascii").strip()
        assert not os.path.isabs(line)
        assert (site / line).samefile(folder)
    code = "import rbclassroom.course"
    python = started.folder / ".venv" / "bin" / "python"
    subprocess.run([python, "-c", code], cwd=started.folder.parent, check=True)


@posix
def test_a_damaged_environment_is_reported_and_made_again(started):
    assert "works" in started().communicate()[0]
    (path,) = started.folder.glob(".venv/lib/python*/site-packages/module1.py")
    path.unlink()
    job = started()
    said, _ = job.communicate()
    assert job.returncode == 1
    assert said.endswith(
        "Files of .venv are missing. Run the command again: it makes .venv again.\n"
    )
    assert "works" in started().communicate()[0]


def test_a_folder_that_cannot_be_written_is_reported(started, monkeypatch, capsys):
    def refuse(path, *_, **__):
        raise OSError(errno.EROFS, "Read-only file system", str(path))

    monkeypatch.setattr("builtins.open", refuse)
    monkeypatch.setattr(signal, "signal", lambda *_: None)
    monkeypatch.setattr(sys, "argv", ["course.py", "lab"])
    with pytest.raises(SystemExit, match=r"^The set-up failed"):
        runpy.run_path(str(started.folder / "course.py"), run_name="__main__")
    said = capsys.readouterr().out
    assert re.search(
        r"system: '.*\.venv\.lock'\nCopy the course to a folder in which you can", said
    )


@posix
def test_a_computer_without_a_network_gets_one_sentence(started):
    said = "WARNING: Failed to establish a new connection: [Errno -3]\\nERROR: nothing found"
    file = started.folder / "course.py"
    text = file.read_text("utf-8")
    file.write_text(
        text.replace("    set_up(environment)", f'    raise SetUpError("{said}")'), "utf-8"
    )
    told = started().communicate()[0].strip()
    assert told.startswith("The packages could not be downloaded. Connect this computer")
    assert told.endswith("pip says: WARNING: Failed to establish a new connection: [Errno -3]")


def test_a_course_that_cannot_be_written_is_reported_by_lab(monkeypatch):
    def refuse(*_):
        raise PermissionError(errno.EACCES, "Permission denied", "work")

    monkeypatch.setattr(lab, "copy_lessons", refuse)
    monkeypatch.setattr(sys, "argv", ["lab"])
    with pytest.raises(SystemExit, match="denied: 'work'\nCopy the course to a folder in which"):
        lab.main()
