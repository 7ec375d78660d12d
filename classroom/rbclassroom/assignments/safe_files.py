"""Write files completely or not at all, and write tables for spreadsheets."""

import csv
import io
import os
from pathlib import Path
from typing import Any


def write_whole(path: Path, content: bytes) -> Path:
    """Write a file and make its folder; readers see either the old or the new file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(f".{os.getpid()}.part")
    part.write_bytes(content)
    return part.replace(path)


def write_csv(path: Path, rows: list[dict[str, Any]]) -> None:
    """Write a CSV table with the keys of the rows as columns; formulas become text."""
    columns = {key: "" for row in sorted(rows, key=len, reverse=True) for key in row}
    content = io.StringIO(newline="")
    table = csv.writer(content, lineterminator="\n")
    for row in (dict(zip(columns, columns, strict=True)), *rows):
        cells = [str(row.get(key, "")) for key in columns]
        formula = ("=", "+", "-", "@", "\t", "\r")
        table.writerow(f"'{cell}" if cell.startswith(formula) else cell for cell in cells)
    write_whole(path, content.getvalue().encode("utf-8-sig"))  # Excel needs the byte order mark
