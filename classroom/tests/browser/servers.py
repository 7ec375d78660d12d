"""Start and end programs that run during a test."""

import re
import subprocess
import sys
from contextlib import contextmanager, suppress
from threading import Thread

import psutil


@contextmanager
def serving(words, folder, env, pattern):
    """Run a Python module that prints an address; yield the match of this address."""
    words = [sys.executable, "-m", *words]
    output = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    lines = []
    with subprocess.Popen(words, cwd=folder, env=env, text=True, errors="replace", **output) as job:
        rest = Thread(target=lambda: lines.extend(job.stdout))
        try:
            for line in job.stdout:
                lines.append(line)
                if found := re.search(pattern, line):
                    break
            else:
                raise RuntimeError(f"{' '.join(words)} has ended: {''.join(lines)}")
            rest.start()
            yield found
        finally:
            _end(job)
            if rest.ident:
                rest.join()
            print("".join(lines)[-5000:])  # pytest shows this text if a test fails


def _end(job):
    """End a program and its descendants; after a minute, kill those that still run."""
    family = [psutil.Process(job.pid)] if job.poll() is None else []
    family += [child for parent in family for child in parent.children(recursive=True)]
    for process in family:
        with suppress(psutil.NoSuchProcess):
            process.terminate()
    for process in psutil.wait_procs(family, 60)[1]:
        process.kill()
