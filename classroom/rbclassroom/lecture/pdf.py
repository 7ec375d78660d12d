"""Print slides as PDF."""

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from rbcourse.files import replace_file

BROWSERS = ["chromium-headless-shell", "chromium", "chromium-browser"]
BROWSERS += ["google-chrome", "chrome", "msedge"]
BROWSERS += ["/Applications/Google Chrome.app/Contents/MacOS/Google Chrome"]
BROWSERS += ["/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge"]
BROWSERS += [r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe"]
BROWSERS += [r"C:\Program Files\Google\Chrome\Application\chrome.exe"]
"""Programs that print a page as PDF; the first has no window, and is the fastest."""


def print_pdf(address: str, pdf: Path) -> None:
    """Print slides as PDF with a browser that is based on Chromium."""
    named = os.environ.get("BROWSER", "")
    found = next(filter(None, map(shutil.which, (named, *BROWSERS))), None)
    if not found:
        names = "Chromium, Google Chrome or Microsoft Edge"
        raise ValueError(f"To print, install {names}, or set BROWSER to the path of one of them.")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        made = Path(profile, "slides.pdf")
        words = ["--headless", "--disable-gpu", "--no-first-run", "--no-pdf-header-footer"]
        if hasattr(os, "geteuid") and os.geteuid() == 0:
            words.append("--no-sandbox")  # Chromium has no sandbox for the administrator
        words += [f"--user-data-dir={profile}", f"--print-to-pdf={made}"]
        try:
            job = [found, *words, f"{address}?print-pdf&hold"]
            subprocess.run(job, capture_output=True, timeout=120)
            replace_file(pdf, made.read_bytes())
        except (subprocess.TimeoutExpired, OSError) as error:
            raise ValueError(f"{found} could not print the slides: {error!r}") from error
    print(f"{pdf}: {pdf.stat().st_size / 1e6:.1f} MB")
