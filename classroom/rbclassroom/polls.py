"""The buttons of polls in notebooks; in the book and on slides the options are buttons."""

from pathlib import Path
from typing import Any

import anywidget
import traitlets


class Poll(anywidget.AnyWidget):
    """A button for each letter; in JupyterLab a choice opens the answer (see poll.js)."""

    _esm = Path(__file__).with_name("poll.js").read_text(encoding="utf-8")
    letters: Any = traitlets.List().tag(sync=True)

    def _repr_mimebundle_(self, **kwargs: Any) -> Any:
        """Return the buttons, and a text for readers without a kernel."""
        data, metadata = super()._repr_mimebundle_(**kwargs) or ({}, {})
        still = "<small>To vote, run this cell (Shift + Enter).</small>"
        return {"text/html": still, **data}, metadata

    def __repr__(self) -> str:
        """Return the letters."""
        return f"poll: {', '.join(self.letters)}"


def buttons(letters: str) -> Poll:
    """Return the buttons of a poll, such as ``buttons("ABC")``, for the cell above its answer."""
    return Poll(letters=list(letters))
