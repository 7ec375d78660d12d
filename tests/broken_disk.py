"""Let writing fail in the middle of a file, as a full disk or Ctrl-C does."""

import builtins
import errno
import io
import os
from contextlib import contextmanager

import pytest

FAILURES = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)), KeyboardInterrupt()


class HalfWritten:
    """A file that stores half of the first content, and then raises an error."""

    def __init__(self, stream, error):
        self.stream, self.error = stream, error

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stream.close()

    def __getattr__(self, name):
        return getattr(self.stream, name)

    def write(self, content):
        self.stream.write(content[: len(content) // 2])
        self.stream.flush()
        raise self.error


@contextmanager
def broken(error, folder):
    """Let each write to a file in a folder fail."""
    true = io.open

    def opened(file, mode="r", *more, **named):
        stream = true(file, mode, *more, **named)
        here = not isinstance(file, int) and os.path.abspath(file).startswith(str(folder))
        return HalfWritten(stream, error) if here and set("wxa") & set(mode) else stream

    with pytest.MonkeyPatch.context() as patch:
        for module in (builtins, io):
            patch.setattr(module, "open", opened)
        yield


def contents(folder):
    """Return the contents of all files in a folder."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def check_all_or_nothing(write, folder):
    """Call a function whose writes to a folder fail, and check that no file there changes."""
    before = contents(folder)
    for error in FAILURES:
        with broken(error, folder), pytest.raises(type(error)):
            write()
        assert contents(folder) == before
