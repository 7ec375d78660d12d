"""Servers that run while a test looks at them."""

import re
import subprocess
import time
from contextlib import contextmanager
from tempfile import NamedTemporaryFile


@contextmanager
def serving(words, folder, env, pattern):
    """Run a program that prints an address; return the match."""
    with NamedTemporaryFile("w+", dir=folder, suffix=".log") as log:
        job = subprocess.Popen(words, cwd=folder, env=env, stdout=log, stderr=log)
        try:
            yield _address(job, log, pattern)
        finally:
            job.terminate()
            job.wait()


def _address(job, log, pattern):
    while job.poll() is None:
        log.seek(0)
        if found := re.search(pattern, log.read()):
            return found
        time.sleep(0.05)
    log.seek(0)
    raise RuntimeError(f"{job.args[0]} has ended: {log.read()}")
