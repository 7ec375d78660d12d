"""Write files completely or not at all, and write tables for spreadsheets."""

import csv
import io
from pathlib import Path
from typing import Any

from rbcourse.files import replace_file


def write_whole(path: Path, content: bytes) -> Path:
    """Write a file completely or not at all, and make its folder."""
    path.parent.mkdir(parents=True, exist_ok=True)
    replace_file(path, content)
    return path


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
