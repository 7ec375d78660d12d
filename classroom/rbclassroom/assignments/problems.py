"""Read the problems of a set from the file ``NAME.json`` beside its notebook."""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from rbclassroom.assignments.marking import Drawing, Mistake, NotYet, Problem
from rbclassroom.assignments.marking_samplers import LAWS, Sampler


def problem(name: str, slug: str) -> Problem | Sampler:
    """Return the problem `slug` of the set `name`, in whose folder the kernel was started.

    If the table of the set is beside the folder, as in the course, the data are updated first.
    """
    folder = start_folder()
    if (folder.parent / f"{name}.toml").is_file():
        from rbclassroom.assignments.tables import update

        update(folder)
    files = [place / f"{name}.json" for place in (folder, Path.cwd())]
    file = next((file for file in files if file.is_file()), None)
    if not file:
        raise NotYet(f"{name}.json is missing. Copy it from the handout into this folder.")
    return made(loaded(file.read_text("utf-8"))[slug])


def loaded(text: str) -> dict[str, Any]:
    """Return the data of a set from the text of its file."""
    data: dict[str, Any] = json.loads(text, object_hook=_as_array)
    return data


def made(data: dict[str, Any]) -> Problem | Sampler:
    """Return a problem from its data; `read`, `keep` and `doc` are for other modules."""
    data = {key: value for key, value in data.items() if key not in ("read", "keep", "doc")}
    data["mistakes"] = [Mistake(**mistake) for mistake in data["mistakes"]]
    if law := data.pop("law", None):
        return Sampler(**LAWS[law], **data)
    return (Drawing if data.pop("drawing") else Problem)(**data)


def start_folder() -> Path:
    """Return the folder in which the kernel was started; the code of a student may leave it."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    return Path(shell.starting_dir) if shell else Path.cwd()


def _as_array(found: dict[str, Any]) -> Any:
    return np.array(found["array"]) if found.keys() == {"array"} else found
