"""The book has the same address at each start, because browsers store answers by address."""

import socket

import pytest
from tiny import ask, served

from rbclassroom.book import serve as module
from rbclassroom.course.folder import port_of


@pytest.fixture
def book(tmp_path):
    book = tmp_path / "Kurs ä" / "book"
    book.mkdir(parents=True)
    (book / "index.html").write_text("the book")
    return book


def test_the_book_has_the_same_address_after_a_restart(book):
    addresses = set()
    for _ in range(3):
        with served(book) as address:
            assert ask(address)[:2] == (200, "the book")
            assert ask(f"{address}%00")[0] == ask(f"{address}a/%00.html")[0] == 404
            addresses.add(address)
    assert addresses == {f"http://127.0.0.1:{port_of(book)}/"}


def test_ports_depend_on_the_folder_and_are_never_given_to_connections(tmp_path):
    folders = [tmp_path / str(number) / "book" for number in range(1000)]
    ports = [port_of(folder) for folder in folders]
    assert min(ports) >= 20_000
    assert max(ports) < 28_000
    assert len(set(ports)) > 900  # of 8000 ports, 1000 random choices take 940
    assert [port_of(folder) for folder in folders] == ports


def test_a_second_server_of_the_same_book_only_shows_it(book, capsys, monkeypatch):
    shown = []
    monkeypatch.setattr(module.webbrowser, "open", shown.append)
    with served(book) as address:
        module.serve(book)
        assert shown == [address]
        assert f"The book is at {address}, where" in capsys.readouterr().out
        assert ask(address)[0] == 200


def test_a_port_that_another_program_uses_is_named(book):
    why = f"not shown: another program uses port {port_of(book)} of this machine"
    with socket.create_server(("127.0.0.1", port_of(book))), pytest.raises(ValueError, match=why):
        module.serve(book)
