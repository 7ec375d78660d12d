"""Write files whole or not at all, and tables that people open in spreadsheets."""

import csv
import io
from pathlib import Path
from typing import Any

FORMULA = ("=", "+", "-", "@", "\t", "\r")


def write_whole(path: Path, content: bytes) -> Path:
    """Write a file, and the folder that it is in; whoever reads it sees the old or the new one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part")
    part.write_bytes(content)
    part.replace(path)
    return path


def quoted(cell: str) -> str:
    """Return a cell that no spreadsheet takes for a formula.

    Examples
    --------
    >>> quoted("=1+1"), quoted("ann")
    ("'=1+1", 'ann')
    """
    return f"'{cell}" if cell.startswith(FORMULA) else cell


def write_csv(path: Path, rows: list[dict[str, Any]]) -> None:
    """Write a table whose columns are the keys of its rows."""
    columns: dict[str, None] = {}
    for row in sorted(rows, key=len, reverse=True):
        columns |= dict.fromkeys(row)
    content = io.StringIO(newline="")
    table = csv.writer(content, lineterminator="\n")
    table.writerow(columns)
    table.writerows([quoted(str(row.get(key, ""))) for key in columns] for row in rows)
    write_whole(path, content.getvalue().encode("utf-8-sig"))  # as Excel wants it


def read_csv(path: Path) -> list[dict[str, str]]:
    """Read a table, whatever its delimiter; none where there is no file."""
    if not path.exists():
        return []
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: save it as CSV in UTF-8 ({error})") from error
    head = text.partition("\n")[0]
    delimiter = max(",;\t", key=head.count)
    table = list(csv.DictReader(io.StringIO(text, newline=""), delimiter=delimiter))
    return [{k: _unquoted((v or "").strip()) for k, v in row.items() if k} for row in table]


def _unquoted(cell: str) -> str:
    return cell[1:] if cell.startswith("'") and cell[1:].startswith(FORMULA) else cell
