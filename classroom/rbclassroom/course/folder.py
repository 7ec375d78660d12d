"""Facts about the folder of the course: whether it can be written, and the port of its pages."""

import hashlib
import os
from pathlib import Path

COPY = "Copy the course to a folder in which you can write."
LEAST, COUNT = 20_000, 8_000  # systems give ports above 32767 to connections


def require_writable(folder: Path) -> None:
    """Raise ValueError if a folder cannot be written, as on a disk that is shared by a class.

    Windows does not tell this in advance.
    """
    if not os.access(folder, os.W_OK):
        raise ValueError(f"You cannot write to the folder {folder.resolve()}.\n{COPY}")


def port_of(folder: Path) -> int:
    """Return the port for the pages of a folder, which depends only on the folder's path.

    A browser stores answers and settings for an address with its port, and finds them again only
    at the same port.
    """
    digest = hashlib.sha256(os.fsencode(folder.resolve())).digest()
    return LEAST + int.from_bytes(digest[:8], "big") % COUNT
