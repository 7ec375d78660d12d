"""Show a lesson to a class: in large letters, without code, run afresh, without a network."""

import logging
import os
import re
import secrets
import signal
import socket
import tempfile
import threading
import webbrowser
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import nbformat
import segno
from nbformat import NotebookNode
from tornado.ioloop import IOLoop
from traitlets.config import Config
from voila.app import Voila

from rbclassroom.course.notebooks import lesson_paths
from rbclassroom.course.votes import TEMPLATES, Lecturer, Phones, find_address

HOST = "127.0.0.1"
# of the extensions of JupyterLab only those that draw widgets
WIDGETS = [
    "@jupyter-widgets/jupyterlab-manager",
    "@voila-dashboards/widgets-manager8",
    "anywidget",
]


def find_lesson(number: str, folder: Path) -> Path:
    """Return the lesson of a number."""
    paths = {path.name[:2]: path for path in lesson_paths(folder)}
    if number.zfill(2) not in paths:
        there = ", ".join(paths) or "none; this is run in the folder of the course"
        raise ValueError(f"There is no lesson {number}; there are: {there}.")
    return paths[number.zfill(2)]


def mark_sections(notebook: NotebookNode) -> None:
    """Note in the cells' metadata where a folded section opens, and how many close.

    A section that is stored collapsed reaches to the next heading of its level or a higher one.
    The run sheet has the answers: the class does not see it, the lecturer's window does.
    """
    cells: list[NotebookNode] = []
    levels: list[int] = []
    for cell in notebook.cells:
        level = _heading_level(cell)
        while levels and 0 < level <= levels[-1]:
            levels.pop()
            cells[-1].metadata.lecture.closes += 1
        folded = level and cell.metadata.get("jp-MarkdownHeadingCollapsed", False)
        parts = _heading_and_rest(cell) if folded else [cell]
        for part in parts:
            sheet = cell.source.startswith("## Run sheet")
            part.metadata.lecture = NotebookNode(opens=False, closes=0, sheet=sheet)
        if folded:
            parts[0].metadata.lecture.opens = True
            levels.append(level)
        cells += parts
    if levels:
        cells[-1].metadata.lecture.closes += len(levels)
    notebook.cells = cells


def _heading_level(cell: NotebookNode) -> int:
    """Return the level of the heading that a cell begins with, 0 if it begins with none."""
    match = re.match(r"\s*(#{1,6}) ", cell.source)
    return len(match[1]) if match and cell.cell_type == "markdown" else 0


def _heading_and_rest(cell: NotebookNode) -> list[NotebookNode]:
    heading, _, rest = cell.source.lstrip().partition("\n")
    first = NotebookNode({**cell, "source": heading})
    return [first, *([nbformat.v4.new_markdown_cell(rest)] if rest.strip() else [])]


def _prepare(votes: str, handler: Any, notebook: NotebookNode, cwd: str) -> NotebookNode:
    """Make a notebook ready to be shown; Voila calls this before it runs it."""
    mark_sections(notebook)
    if votes:
        code = segno.make(votes, micro=False).svg_inline(border=2, light="white", omitsize=True)
        notebook.metadata.lecture_votes = NotebookNode(address=votes, code=code)
    if notebook.cells and (title := re.match(r"# (.*)", notebook.cells[0].source)):
        notebook.metadata.title = title[1]
    return notebook


class _Lecture(Voila):  # type: ignore[misc]
    """Voila, and what the lecturer asks about votes."""

    phones: Phones | None = None

    def init_handlers(self) -> list[Any]:
        handlers: list[Any] = super().init_handlers()
        if self.phones:
            handlers.insert(0, ("/votes", Lecturer, {"ballot": self.phones.ballot}))
        return handlers


def serve(path: Path, begin: Callable[[str], None], phones: Phones | None = None) -> None:
    """Serve a lesson until Ctrl-C, or until the event loop is stopped; then end its kernels.

    Nothing of the user's settings is read, and nothing is written but to a temporary folder.
    """
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        _set_environment(Path(folder))
        settings = {
            "VoilaConfiguration": {
                "prelaunch_hook": partial(_prepare, phones.url if phones else ""),
                "strip_sources": False,
                "show_tracebacks": True,
                "allow_template_override": "NO",
                "allow_theme_override": "NO",
                "file_allowlist": [],
                "extension_allowlist": WIDGETS,
            },
            "VoilaExporter": {"exclude_input_prompt": True, "exclude_output_prompt": True},
            "VoilaExecutor": {"timeout": 120},
        }
        app = _Lecture.instance(
            config=Config(settings),
            config_file_paths=[],
            connection_dir_root=folder,
            notebook_path=str(path.resolve()),
            ip=HOST,
            port=_free_port(),
            token=secrets.token_hex(24),
            open_browser=False,
            log_level=logging.ERROR,  # it warns that the lesson is not signed
        )
        logging.getLogger("tornado.general").setLevel(logging.ERROR)
        app.initialize([])
        app.template_paths.insert(0, str(TEMPLATES))
        loop = IOLoop.current()
        loop.add_callback(lambda: begin(f"http://{HOST}:{app.port}/?token={app.token}"))
        if phones:
            app.phones = phones
            phones.start()
        app.start()


def _set_environment(folder: Path) -> None:
    """Point Jupyter, IPython and the lessons to a temporary folder."""
    names = {
        "JUPYTER_CONFIG_DIR": "config",
        "JUPYTER_DATA_DIR": "data",
        "JUPYTER_RUNTIME_DIR": "runtime",
        "IPYTHONDIR": "ipython",
        "RBCOURSE_FIGURES": "figures",
    }
    for variable, name in names.items():
        (folder / name).mkdir()
        os.environ[variable] = str(folder / name)
    for variable in ("JUPYTER_PATH", "JUPYTER_CONFIG_PATH"):
        os.environ.pop(variable, None)
    os.environ["JUPYTER_NO_CONFIG"] = "1"
    profile = folder / "ipython" / "profile_default"
    profile.mkdir()
    # kernels need not say that others on this machine could listen in
    (profile / "ipython_kernel_config.py").write_text("get_config().IPKernelApp.log_level = 40")


def _free_port() -> int:
    with socket.create_server((HOST, 0)) as probe:
        port: int = probe.getsockname()[1]
        return port


def present(path: Path, browser: bool, phones: Phones | None) -> None:
    """Show a lesson in the browser until Ctrl-C."""

    def begin(address: str) -> None:
        print(f"{path.name} is shown at {address}", flush=True)
        if phones:
            print(f"Phones vote at {phones.url}", flush=True)
        print("Stop it with Ctrl-C.", flush=True)
        if browser:
            # some browsers return only when they are closed
            threading.Thread(target=webbrowser.open, args=[address], daemon=True).start()

    signal.signal(signal.SIGINT, signal.default_int_handler)  # also where a script ignores Ctrl-C
    serve(path, begin, phones)


def open_votes(address: str) -> Phones | None:
    """Let phones vote at an address, or at that of this machine in its network, if it has one."""
    try:
        address = address or find_address()
    except OSError:
        print("No network was found: the class votes by show of hands.", flush=True)
        return None
    try:
        return Phones(address)
    except (ValueError, OSError) as error:
        raise ValueError(f"Phones cannot vote at {address}: {error}.") from error
