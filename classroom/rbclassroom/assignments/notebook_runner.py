"""Run a student's notebook with limits on time and output, and keep every error."""

import json
import re
from pathlib import Path
from typing import Any

from nbclient import NotebookClient
from nbclient.exceptions import DeadKernelError
from nbformat import NotebookNode
from nbformat.v4 import new_output
from traitlets import Integer

from rbclassroom.assignments.marking import NO_INPUT, WHY_NO_INPUT
from rbclassroom.course.notebooks import kernel_address

CELL_SECONDS = 30  # the time limit for a cell, in the check and in grading
ROOM = {"stream": 100_000, "data": 2_000_000}  # limits for a cell's outputs, in characters
ALL_OUTPUT = 10_000_000  # characters, for a notebook
DISPLAYS = ("display_data", "execute_result", "update_display_data")
CUT = "the output is too large, and the rest is left out"
ASKED = {"ename": "EOFError", "evalue": WHY_NO_INPUT, "traceback": [WHY_NO_INPUT]}
WIDGET = "application/vnd.jupyter.widget-view+json"


class BoundedClient(NotebookClient):
    """A client for a notebook whose cells may loop or print without end, or end their kernel.

    The kernel keeps its files in `folder`, which has to be set before the start. `slow` has the
    indices of the cells that took too long. `cut` has the indices of the cells whose output is
    incomplete.
    """

    timeout = Integer(CELL_SECONDS, help="the time limit of a cell in seconds").tag(config=True)
    iopub_timeout = Integer(20, help="the time in which an interrupted cell stops").tag(config=True)
    folder = Path()

    def __init__(self, *args: Any, **settings: Any) -> None:
        super().__init__(*args, **settings)
        self.allow_errors = self.interrupt_on_timeout = self.coalesce_streams = True
        why = "the cell took too long; does a loop in the answer never end?"
        slow = {"ename": "TimeoutError", "evalue": why, "traceback": []}
        self.error_on_timeout, self.shutdown_kernel = slow, "immediate"
        limit = "--IPKernelApp.extra_extensions=rbclassroom.assignments.output_limit"
        self.extra_arguments, self.record_timing = ["--log-level=CRITICAL", limit], False

    def reset_execution_trackers(self) -> None:
        """Reset the counts of time and output before a run."""
        super().reset_execution_trackers()
        self.slow, self.cut = list[int](), list[int]()
        self._at, self._left, self._room = -1, ALL_OUTPUT, dict(ROOM)

    def create_kernel_manager(self) -> Any:
        """Return a manager of a kernel whose sockets are files in the folder."""
        manager = super().create_kernel_manager()
        for name, value in kernel_address(str(self.folder)).items():
            setattr(manager, name, value)
        return manager

    async def _async_handle_timeout(self, timeout: int, cell: NotebookNode | None = None) -> Any:
        self.slow.append(self._at)
        self.raise_on_iopub_timeout = True  # a cell that ignores the interrupt cannot be stopped
        return await super()._async_handle_timeout(timeout, cell)

    def process_message(self, msg: dict[str, Any], cell: NotebookNode, cell_index: int) -> Any:
        """Add an output to its cell, unless the cell's output is too large."""
        if cell_index != self._at:
            self._at, self.raise_on_iopub_timeout, self._room = cell_index, False, dict(ROOM)
        kind, content = msg["msg_type"], msg["content"]
        if kind == "error":
            content |= ASKED if content["ename"] == NO_INPUT else {}
            content |= {key: str(content[key])[:5000] for key in ("ename", "evalue")}
            # the file of a syntax error is a number for a cell
            content["evalue"] = re.sub(r"\(\S+, (line \d+)\)$", r"(\1)", content["evalue"])
            content["traceback"] = [str(line)[:5000] for line in content["traceback"][-50:]]
        elif kind == "stream" or kind in DISPLAYS:
            if kind != "stream":  # drop widgets, because they do not work without a kernel
                data, kind = content["data"].items(), "data"
                content["data"] = {k: v for k, v in data if isinstance(v, str) and k != WIDGET}
            size = len(content["text"] if kind == "stream" else json.dumps(content["data"]))
            room = min(self._room[kind], self._left)
            if size > room:
                self.cut += [cell_index] * (cell_index not in self.cut)
                if kind == "data" or not room:
                    return None
                content["text"], size = content["text"][:room], room
            self._room[kind] -= size
            self._left -= size
        return super().process_message(msg, cell, cell_index)

    def handle_comm_msg(self, outs: Any, msg: dict[str, Any], cell_index: int) -> None:
        """Ignore messages of widgets, so that the outputs that a widget captures stay in the cell.

        While nbclient answers an Output widget, it can miss the reply of the cell.
        """

    def on_cell_executed(self, cell: NotebookNode, cell_index: int, execute_reply: Any) -> None:
        """Store the error that the reply names; otherwise a failed test could seem to pass.

        Raise DeadKernelError if the cell calls exit(), which ends the kernel a little later.
        """
        reply = execute_reply["content"]
        if any(request.get("source") == "ask_exit" for request in reply.get("payload", [])):
            raise DeadKernelError("the cell calls exit()")
        if reply["status"] != "ok":
            cell.outputs = [out for out in cell.outputs if out.output_type != "execute_result"]
            empty = {"ename": "Error", "evalue": "the cell was not run", "traceback": []}
            error = {key: reply.get(key, value) for key, value in empty.items()}
            error = ASKED if error["ename"] == NO_INPUT else error
            if not any(out.get("ename") == error["ename"] for out in cell.outputs):
                cell.outputs.append(new_output("error", **error))
        if cell_index in self.cut:
            cell.outputs.append(new_output("stream", name="stdout", text=f"\n({CUT})\n"))
