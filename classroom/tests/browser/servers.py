"""Programs that run while a test looks at them."""

import re
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

import psutil


@contextmanager
def serving(words, folder, env, pattern):
    """Run a module of Python that prints an address; return the match, and print what it said."""
    with TemporaryDirectory(ignore_cleanup_errors=True) as place:
        log = Path(place, "log")
        with log.open("w") as said:
            words = [sys.executable, "-m", *words]
            job = subprocess.Popen(words, cwd=folder, env=env, stdout=said, stderr=said)
        try:
            yield _address(job, log, pattern)
        finally:
            _end(job)
            print(log.read_text("utf-8", "replace")[-5000:])  # for a test that fails


def _end(job):
    """End a program and all that it has started, at the latest after a minute."""
    family = [psutil.Process(job.pid)] if job.poll() is None else []
    family += [child for parent in family for child in parent.children(recursive=True)]
    for process in family:
        with suppress(psutil.NoSuchProcess):
            process.terminate()
    for process in psutil.wait_procs(family, 60)[1]:
        process.kill()
    job.wait()


def _address(job, log, pattern):
    while True:
        ended = job.poll() is not None
        text = log.read_text(encoding="utf-8", errors="replace")
        if found := re.search(pattern, text):
            return found
        if ended:
            raise RuntimeError(f"{' '.join(job.args)} has ended: {text}")
        time.sleep(0.05)
