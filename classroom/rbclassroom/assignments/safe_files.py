"""Write files whole or not at all, and tables that people open in spreadsheets."""

import csv
import io
import os
from pathlib import Path
from typing import Any


def write_whole(path: Path, content: bytes) -> Path:
    """Write a file and its folder; a reader sees the old content or the new one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(f".{os.getpid()}.part")
    part.write_bytes(content)
    return part.replace(path)


def write_csv(path: Path, rows: list[dict[str, Any]]) -> None:
    """Write a table for spreadsheets; its columns are the keys of the rows, and none a formula."""
    columns = {key: "" for row in sorted(rows, key=len, reverse=True) for key in row}
    content = io.StringIO(newline="")
    table = csv.writer(content, lineterminator="\n")
    for row in (dict(zip(columns, columns, strict=True)), *rows):
        cells = [str(row.get(key, "")) for key in columns]
        formula = ("=", "+", "-", "@", "\t", "\r")
        table.writerow(f"'{cell}" if cell.startswith(formula) else cell for cell in cells)
    write_whole(path, content.getvalue().encode("utf-8-sig"))  # as Excel wants it
