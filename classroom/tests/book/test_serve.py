"""The book has the same address at each start, because browsers store answers by address."""

import pytest
from tiny import ask, served

from rbclassroom.book.serve import serve
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
            addresses.add(address)
    assert addresses == {f"http://127.0.0.1:{port_of(book)}/"}


def test_ports_depend_on_the_folder_and_are_never_given_to_connections(tmp_path):
    folders = [tmp_path / str(number) / "book" for number in range(1000)]
    ports = [port_of(folder) for folder in folders]
    assert min(ports) >= 20_000
    assert max(ports) < 28_000
    assert len(set(ports)) > 900  # of 8000 ports, 1000 random choices take 940
    assert [port_of(folder) for folder in folders] == ports


def test_a_port_in_use_is_named_with_the_address_of_the_book(book):
    with served(book) as address:
        why = rf"port {port_of(book)} of this machine is in use .* open {address}\.$"
        with pytest.raises(ValueError, match=why):
            serve(book)
        assert ask(address)[0] == 200
