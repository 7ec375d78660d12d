"""Limit the output of a kernel that runs student code."""

import sys
from collections.abc import Callable
from contextlib import nullcontext
from typing import Any

SHOWN = 100_000
ENDED = 10_000_000
OUTPUTS = ("stream", "display_data", "update_display_data", "execute_result")
SENT = ("status", "execute_input", "kernel_info_reply", "shutdown_reply")
CUT = "[output cut: "
NOTE = CUT + "more than {:,} characters]\n"


class TooMuchOutputError(RuntimeError):
    """A cell prints without end."""


def clipped(value: Any, room: int, limit: int | None = None) -> Any:
    r"""Return a value made of dicts, lists and strings with no string longer than the room.

    Examples
    --------
    >>> clipped({"text": "abcdef"}, 3)
    {'text': 'abc[output cut: more than 3 characters]\n'}
    """
    if isinstance(value, dict):
        return {key: clipped(part, room, limit) for key, part in value.items()}
    if isinstance(value, list):
        return [clipped(part, room, limit) for part in value[:1000]]
    if isinstance(value, str) and len(value) > room:
        return value[:room] + NOTE.format(room if limit is None else limit)
    return value


def length(value: Any) -> int:
    """Return how many characters there are in a value made of dicts, lists and strings.

    Examples
    --------
    >>> length({"text/plain": ["ab", "c"]})
    3
    """
    if isinstance(value, dict):
        return sum(map(length, value.values()))
    if isinstance(value, list | tuple):
        return sum(map(length, value))
    return len(value) if isinstance(value, str | bytes | memoryview) else 0


def limited(send: Callable[..., Any], shown: int = SHOWN) -> Callable[..., Any]:
    """Return a way to send messages that cuts the outputs of each cell."""
    used: dict[str, int] = {}

    def bounded(stream: Any, kind: Any, content: Any = None, *args: Any, **kwargs: Any) -> Any:
        message = kind if isinstance(kind, dict) else None
        name = message["msg_type"] if message is not None else kind
        content = message["content"] if message is not None else content
        if name == "execute_input":
            used.clear()
        elif name not in SENT:
            sort, room = ("rich", 20 * shown) if name in OUTPUTS[1:] else ("plain", shown)
            before = used.get(sort, 0)
            now = used[sort] = before + length(content) + length(kwargs.get("buffers") or [])
            if now > room and before > room and name not in ("error", "execute_reply"):
                return None
            if now > room:
                content = _shortened(name, content, max(room - before, 0), room)
                kwargs.pop("buffers", None)
                message = {**message, "buffers": []} if message is not None else None
        if message is not None:
            return send(stream, {**message, "content": content}, *args, **kwargs)
        return send(stream, kind, content, *args, **kwargs)

    return bounded


def _shortened(name: str, content: Any, room: int, limit: int) -> Any:
    if name == "stream":
        return {**content, "text": clipped(content["text"], room, limit)}
    if name in OUTPUTS:  # half a picture, or half a page, is worse than none
        return {**content, "data": {"text/plain": NOTE.format(limit)}, "metadata": {}}
    return clipped(content, 2000)


def load_ipython_extension(shell: Any) -> None:
    """Limit the outputs of a kernel: ``--IPKernelApp.extensions=rbcourse.assignments.quota``.

    A cell that has printed too much to be an oversight is ended by an exception.
    """
    session = shell.kernel.session
    session.send = limited(session.send)
    printed = 0

    def start(*_: object) -> None:
        nonlocal printed
        printed = 0

    vars(shell)["_tee"] = lambda channel: nullcontext()  # it would keep all that is printed
    kind = type(sys.stdout)
    write = kind.write

    def bounded(stream: Any, text: str) -> int:
        nonlocal printed
        printed += len(text)
        if printed > ENDED:
            raise TooMuchOutputError(f"more than {ENDED:,} characters are printed")
        return write(stream, text)

    shell.events.register("pre_run_cell", start)
    setattr(kind, "write", bounded)  # noqa: B010 (a plain assignment has no type)
