"""Servers that run while a test looks at them."""

import os
import re
import subprocess
import sys
import time
from contextlib import contextmanager


@contextmanager
def serving(words, folder, env, pattern):
    """Run a module of Python that prints an address; return the match."""
    log = folder / f"{words[0]}-{os.getpid()}.log"
    with log.open("w") as said:
        job = subprocess.Popen(
            [sys.executable, "-m", *words], cwd=folder, env=env, stdout=said, stderr=said
        )
    try:
        yield wait_for(lambda: re.search(pattern, log.read_text()), 60, log.read_text)
    finally:
        job.terminate()
        job.wait(30)


def wait_for(found, seconds, otherwise=str):
    """Return what a function gives as soon as it is true."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if result := found():
            return result
        time.sleep(0.05)
    raise AssertionError(f"not within {seconds} s: {otherwise()}")
