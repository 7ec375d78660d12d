"""Test that Pyodide's files are fetched once, checked, and refused if they are not official."""

import gzip
import hashlib
import json

import pytest

from rbclassroom.live import engine


@pytest.fixture
def made_up(monkeypatch, tmp_path):
    """Make a lock file for two files, and the sources that provide them."""
    contents = {"a.js": b"1", "b.whl": b"2"}
    digests = {name: hashlib.sha256(content).hexdigest() for name, content in contents.items()}
    monkeypatch.setattr(engine, "files", lambda: digests)
    asked = []

    def source(answers):
        def fetched(names):
            """from somewhere"""
            asked.append(list(names))
            yield from ((name, answers[name]) for name in names if name in answers)

        return fetched

    monkeypatch.setattr(engine, "_official", source({"a.js": b"1"}))
    monkeypatch.setattr(engine, "_mirrored", source(contents))
    return asked, lambda answers: monkeypatch.setattr(engine, "_official", source(answers))


def test_each_file_is_fetched_once_from_the_first_possible_source(made_up, tmp_path):
    asked, _ = made_up
    for _ in "ab":
        assert engine.fetch(tmp_path / "cache") == tmp_path / "cache"
        assert asked == [["a.js", "b.whl"], ["b.whl"]]
    (tmp_path / "cache" / "a.js").write_bytes(b"damaged")
    engine.fetch(tmp_path / "cache")
    assert (tmp_path / "cache" / "a.js").read_bytes() == b"1"


def test_a_file_that_is_not_official_is_refused(made_up, tmp_path):
    _, let = made_up
    let({"a.js": b"not the official one"})
    with pytest.raises(engine.EngineError, match=r"a\.js, fetched .*, is not the official file"):
        engine.fetch(tmp_path / "cache")
    assert list((tmp_path / "cache").iterdir()) == []


def test_the_lock_file_lists_all_files_that_the_pages_load():
    lock = engine.lock()
    assert lock["info"]["version"] == engine.VERSION
    assert set(lock["core"]) == set(engine.CORE)
    assert engine._with_needs(engine.PACKAGES) == set(lock["packages"])
    assert all(len(digest) == 64 for digest in engine.files().values())


def test_a_site_includes_the_code_of_the_course(monkeypatch, tmp_path):
    (tmp_path / "have").mkdir()
    for name in engine.files():
        (tmp_path / "have" / name).write_bytes(name.encode())
    for folder in ("one", "two"):
        engine.write(engine.LOCK.parents[3], tmp_path / folder, tmp_path / "have")
    one, two = tmp_path / "one", tmp_path / "two"
    assert all(path.read_bytes() == (two / path.name).read_bytes() for path in one.iterdir())
    packed = (one / "pyodide.asm.wasm.packed").read_bytes()
    # the packed file stores no time, so that its bytes are always the same
    assert packed[4:8] == bytes(4)
    assert gzip.decompress(packed) == b"pyodide.asm.wasm"
    served = json.loads((one / "pyodide-lock.json").read_text())
    assert "pytz" not in served["packages"]["matplotlib"]["depends"]
    assert "FACTS" not in (one / "worker.js").read_text("utf-8")
