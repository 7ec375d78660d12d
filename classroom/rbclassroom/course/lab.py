"""Open the lessons in JupyterLab."""

import json
import os
import sys
import warnings
from pathlib import Path
from typing import Any

from rbclassroom.course import options
from rbclassroom.course.folder import COPY, require_writable
from rbclassroom.course.notebooks import copy_lessons
from rbcourse.files import replace_file

TEACHERS = ["@jupyter/nbgrader"]
PARTS = ["formgrader", "validate_assignment", "assignment_list", "course_list"]
OVERRIDES = {
    "@jupyterlab/apputils-extension:notification": {"fetchNews": "false", "checkForUpdates": False},
    "@jupyterlab/filebrowser-extension:browser": {"showLastModifiedColumn": False},
}
STYLE = """[data-jp-theme-light="false"] :is(figure, .rbcourse-explorer) :is(img, canvas) {
  filter: invert(0.93) hue-rotate(180deg);
}
.jp-Notebook .jp-RenderedMarkdown :is(p, ul, ol, blockquote, details) { max-width: 50em; }
.jp-Notebook .jp-RenderedMarkdown table { margin-left: 0; }
"""
STILLS = """from rbclassroom.course.notebooks import before_saving
get_config().ContentsManager.pre_save_hook = before_saving
"""


def configure() -> Path:
    """Write the configuration of JupyterLab into the environment; return its folder.

    The configuration switches off news and the extensions for lecturers, shows full names, and
    encrypts the messages of kernels. It inverts pictures in a dark theme, and saves explorers as
    stills.
    """
    folder = Path(sys.prefix, "share", "rbcourse")
    # in an environment of the user, the files in share/jupyter belong to the user
    _write(folder / "labconfig" / "default_setting_overrides.json", OVERRIDES)
    off = {"disabledExtensions": dict.fromkeys(TEACHERS, True)}
    _write(folder / "labconfig" / "page_config.json", off)
    extensions = {f"nbgrader.server_extensions.{part}": False for part in PARTS}
    server = {
        "jpserver_extensions": extensions,
        "tornado_settings": {"static_custom_path": [str(folder / "custom")]},
        "answer_yes": True,  # Ctrl-C ends the server without asking
    }
    settings = {
        "ServerApp": server,
        # polls open their answers
        "LabApp": {"log_level": "ERROR", "custom_css": True, "expose_app_in_browser": True},
        "KernelManager": {"transport_encryption": "auto"},
    }
    _write(folder / "jupyter_server_config.json", settings)
    replace_file(folder / "jupyter_server_config.py", STILLS.encode())
    (folder / "custom").mkdir(exist_ok=True)
    replace_file(folder / "custom" / "custom.css", STYLE.encode())
    return folder


def _write(path: Path, content: Any) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    replace_file(path, json.dumps(content).encode())


def main() -> None:
    """Open lesson 00 in JupyterLab, which runs until Ctrl-C."""
    known, words = options.parse("lab")
    try:
        require_writable(Path())
        if known.edit:
            os.environ["RBCOURSE_EDIT"] = "1"
        else:
            copy_lessons(Path("notebooks"), Path("work"))
        configured = configure()
    except OSError as error:
        sys.exit(f"{error}\n{COPY}")
    except ValueError as error:
        sys.exit(str(error))
    folder = "notebooks" if known.edit else "work"
    address = f"--LabApp.default_url=/lab/tree/{folder}/00_start_here.ipynb"
    words = [f"--ServerApp.root_dir={Path().resolve()}", "--log-level=ERROR", address, *words]
    if hasattr(os, "geteuid") and os.geteuid() == 0:
        words.append("--allow-root")
    paths = [str(configured), os.environ.get("JUPYTER_CONFIG_PATH")]
    os.environ["JUPYTER_CONFIG_PATH"] = os.pathsep.join(filter(None, paths))
    where = "at the address below" if "--no-browser" in words else "in the browser"
    print(f"JupyterLab opens {where}. To stop it, press Ctrl-C here.", flush=True)
    # JupyterLab causes these warnings, because it reads its configuration twice
    warnings.filterwarnings("ignore", category=DeprecationWarning)
    warnings.filterwarnings("ignore", "Overriding existing pre_save_hook")
    from jupyterlab.labapp import LabApp

    sys.argv[1:] = []
    LabApp.launch_instance(words)


if __name__ == "__main__":
    main()
