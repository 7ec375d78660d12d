"""Read the problems of a set from the file ``NAME.json`` beside its notebook."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from rbclassroom.assignments.marking import Drawing, Mistake, Problem
from rbclassroom.assignments.marking_samplers import LAWS, Sampler
from rbclassroom.assignments.student_code import NotYet


def problem(name: str, slug: str) -> Problem | Sampler:
    """Return the problem `slug` of the set `name`, whose folder must be the current folder.

    If the table of the set is beside the folder, as in the course, the data are updated first.
    """
    if Path("..", f"{name}.toml").is_file():
        from rbclassroom.assignments.tables import update

        update(Path.cwd())
    file = Path(f"{name}.json")
    if not file.is_file():
        raise NotYet(f"{file} is missing. Copy it from the handout into this folder.")
    data = json.loads(file.read_text("utf-8"), object_hook=_as_array)[slug]
    data["mistakes"] = [Mistake(**mistake) for mistake in data["mistakes"]]
    if law := data.pop("law", None):
        return Sampler(**LAWS[law], **data)
    return (Drawing if data.pop("drawing") else Problem)(**data)


def _as_array(found: dict[str, Any]) -> Any:
    return np.array(found["array"]) if found.keys() == {"array"} else found
