"""Write files whole or not at all, and tables that people open in spreadsheets."""

import csv
import io
import os
from pathlib import Path
from typing import Any


def write_whole(path: Path, content: bytes) -> Path:
    """Write a file, and the folder that it is in; whoever reads it sees the old or the new one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(f".{os.getpid()}.part")
    part.write_bytes(content)
    part.replace(path)
    return path


def quoted(cell: str) -> str:
    """Return a cell that no spreadsheet takes for a formula."""
    return f"'{cell}" if cell.startswith(("=", "+", "-", "@", "\t", "\r")) else cell


def write_csv(path: Path, rows: list[dict[str, Any]]) -> None:
    """Write a table whose columns are the keys of its rows."""
    columns = {key: None for row in sorted(rows, key=len, reverse=True) for key in row}
    content = io.StringIO(newline="")
    table = csv.writer(content, lineterminator="\n")
    table.writerow(columns)
    table.writerows([quoted(str(row.get(key, ""))) for key in columns] for row in rows)
    write_whole(path, content.getvalue().encode("utf-8-sig"))  # as Excel wants it
