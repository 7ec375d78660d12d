"""Programs that run while a test looks at them."""

import re
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory


@contextmanager
def serving(words, folder, env, pattern):
    """Run a module of Python that prints an address; return the match."""
    with TemporaryDirectory(ignore_cleanup_errors=True) as place:
        log = Path(place, "log")
        with log.open("w") as said:
            words = [sys.executable, "-m", *words]
            job = subprocess.Popen(words, cwd=folder, env=env, stdout=said, stderr=said)
        try:
            yield _address(job, log, pattern)
        finally:
            job.terminate()
            try:
                job.wait(60)
            except subprocess.TimeoutExpired:
                job.kill()
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
