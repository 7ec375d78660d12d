"""Call a student's function, and report its errors."""

import linecache
import textwrap
import traceback
from typing import Any

EMPTY = "Your function stops at raise NotImplementedError(). Write your answer in place of it."


class NotYet(AssertionError):
    """An error with a message for the student, which a notebook shows without a traceback.

    If the message is a hint, `case` is an example: the right result, and that of the function.
    """

    def __init__(self, message: str, case: str = "") -> None:
        super().__init__(message)
        self.case = case

    def _render_traceback_(self) -> list[str]:
        texts = [textwrap.wrap(text, 80) for text in (str(self), self.case) if text]
        return [line for lines in texts for line in ("", *lines)][1:]


def call_student(function: Any, arguments: tuple[Any, ...], times: int = 1) -> list[Any]:
    """Return the results of a student's function, one for each call.

    Raise `NotYet` if the function raises an error.
    """
    try:
        return [function(*arguments) for _ in range(times)]
    except NotImplementedError as error:
        *_, (frame, _) = traceback.walk_tb(error.__traceback__)
        name = frame.f_code.co_name
        if name != getattr(function, "__name__", name):
            why = f"Your function calls {name}, where nothing is written yet."
            raise NotYet(why) from None
        raise NotYet(EMPTY) from None
    except Exception as error:
        lines = [
            linecache.getline(frame.f_code.co_filename, line).strip()
            for frame, line in traceback.walk_tb(error.__traceback__)
            if frame.f_globals.get("__name__") == "__main__"
        ]
        where = f' at "{lines[-1]}"' if lines and lines[-1] else ""
        raise NotYet(f"Your function stops{where}: {type(error).__name__}: {error}") from None
