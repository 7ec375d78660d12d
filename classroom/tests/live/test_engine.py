"""Test that Pyodide's files are fetched once, checked, and refused if they are not official."""

import gzip
import hashlib
import json
from pathlib import Path

import pytest

from rbclassroom.live import engine

ROOT = Path(__file__).parents[3]


@pytest.fixture
def made_up(monkeypatch):
    """Make a lock file for two files, and the sources that provide them."""
    official, mirrored, asked = {"a.js": b"1"}, {"a.js": b"1", "b.whl": b"2"}, []
    digests = {name: hashlib.sha256(content).hexdigest() for name, content in mirrored.items()}

    def download(address, path, _):
        asked.append(address)
        if (name := address.removeprefix(engine.OFFICIAL)) not in official:
            raise OSError("no network")
        Path(path).write_bytes(official[name])

    monkeypatch.setattr(engine, "FILES", digests)
    monkeypatch.setattr(engine.pooch, "HTTPDownloader", lambda **_: download)
    monkeypatch.setattr(engine, "_mirror", lambda: mirrored)
    return asked, official


def test_each_file_is_fetched_once_from_the_first_possible_source(made_up, tmp_path):
    asked, _ = made_up
    for _ in "ab":
        assert engine.fetch(tmp_path / "cache") == tmp_path / "cache"
        assert asked == [engine.OFFICIAL + "a.js", engine.OFFICIAL + "b.whl"]
    (tmp_path / "cache" / "a.js").write_bytes(b"damaged")
    engine.fetch(tmp_path / "cache")
    assert (tmp_path / "cache" / "a.js").read_bytes() == b"1"
    assert (tmp_path / "cache" / "b.whl").read_bytes() == b"2"


def test_a_file_that_is_not_official_is_refused(made_up, tmp_path):
    _, official = made_up
    official["a.js"] = b"not the official one"
    with pytest.raises(ValueError, match=r"\(a\.js\) does not match the known hash"):
        engine.fetch(tmp_path / "cache")
    assert list((tmp_path / "cache").iterdir()) == []


def test_the_lock_file_lists_all_files_that_the_pages_load():
    packages = engine.LOCK["packages"]
    needs = {name for each in packages.values() for name in each["depends"]}
    assert needs | set(engine.PACKAGES) == set(packages)
    assert set(engine.LOCK["core"]) > engine.PACKED
    assert all(len(digest) == 64 for digest in engine.FILES.values())


def test_a_site_includes_the_code_of_the_course(tmp_path):
    (tmp_path / "have").mkdir()
    for name in engine.FILES:
        (tmp_path / "have" / name).write_bytes(name.encode())
    for folder in ("one", "two"):
        engine.write(ROOT, tmp_path / folder, tmp_path / "have")
    one, two = tmp_path / "one", tmp_path / "two"
    assert all(path.read_bytes() == (two / path.name).read_bytes() for path in one.iterdir())
    packed = (one / "pyodide.asm.wasm.packed").read_bytes()
    # the packed file stores no time, so that its bytes are always the same
    assert packed[4:8] == bytes(4)
    assert gzip.decompress(packed) == b"pyodide.asm.wasm"
    served = json.loads((one / "pyodide-lock.json").read_text())
    assert "pytz" not in served["packages"]["matplotlib"]["depends"]
    assert "FACTS" not in (one / "worker.js").read_text("utf-8")
