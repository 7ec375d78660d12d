"""Test the rules of a vote, and thirty phones that vote in a lecture."""

import asyncio
import json
import re
import signal
import socket
import sys
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from urllib.parse import urlencode, urlsplit

import pytest
from nbformat.v4 import new_markdown_cell
from tiny import ask, lecture, lesson_at

pytest.importorskip("segno", reason="slides are made in the environment of the book")

from rbclassroom.course.folder import port_of
from rbclassroom.lecture import votes as module
from rbclassroom.lecture.serve import find_lesson, main
from rbclassroom.lecture.votes import Guests, find_address, open_votes

OPTIONS = ["one", "two <b>2</b>", "three", "four"]


def test_a_lesson_is_found_by_its_number(tmp_path, monkeypatch):
    path = lesson_at(tmp_path)
    assert find_lesson("01", path.parent) == find_lesson("1", path.parent) == path
    for number in ("2", "11", "plane", ""):
        with pytest.raises(ValueError, match=f"no lesson {number}; the lessons are: 01"):
            find_lesson(number, path.parent)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["lecture", "7"])
    with pytest.raises(SystemExit, match=r"^There is no lesson 7; the lessons are: 01\.$"):
        main()


def test_slides_have_the_same_address_at_each_start(tmp_path):
    """The speaker view stores its layout by address. A second lecture has another address."""
    lesson_at(tmp_path, new_markdown_cell("# Tiny"))
    first = f"http://127.0.0.1:{port_of(tmp_path / 'notebooks')}/slides/01_tiny.html"
    for _ in range(2):
        with lecture(tmp_path) as (address, _), lecture(tmp_path) as (other, _):
            assert address == first != other
            assert "<h1>Tiny</h1>" in ask(address)[1]
            assert "<h1>Tiny</h1>" in ask(other)[1]


@pytest.mark.parametrize(
    "address",
    ["", "0.0.0.0", "224.0.0.1", "255.255.255.255", "192.0.2.77", "::1", "06", "a.org"],
)
def test_an_address_of_another_machine_is_refused(address, monkeypatch):
    def nowhere():
        raise OSError("Network is unreachable")

    monkeypatch.setattr(module, "find_address", nowhere)
    where = address or "this machine, which has no network"
    with pytest.raises(ValueError, match=f"Phones cannot vote at {where}: "):
        open_votes(address)


def test_the_detected_address_belongs_to_this_machine():
    try:
        address = find_address()
    except OSError:
        return  # the machine has no network
    with socket.socket() as probe:
        probe.bind((address, 0))


def test_a_class_of_two_hundred_joins_from_one_address_in_half_a_minute():
    clock = [0.0]
    guests, waiting = Guests(lambda: clock[0]), 200
    for second in range(0, 31, 3):  # a page that has to wait tries again after 3 s
        clock[0] = second
        waiting = [guests.join("192.0.2.1") for _ in range(waiting)].count("")
    assert waiting == 0
    assert len(guests.phones) == 200


def test_a_program_at_one_address_cannot_keep_others_out():
    clock = [0.0]
    guests = Guests(lambda: clock[0])
    own = guests.join("192.0.2.1")
    for attempt in range(500):
        clock[0] = 0.6 * attempt / 500
        guests.join("192.0.2.1")
    assert len(guests.phones) <= 60 + 5
    assert own in guests.phones
    assert all(guests.join(f"192.0.2.{number}") for number in range(2, 200))
    for second in range(1, 3600):
        clock[0] = second
        for _ in range(10):
            guests.join("192.0.2.1")
    assert len(guests.phones) == 500 + 198


def test_joins_and_open_connections_of_a_program_block_no_phone(monkeypatch):
    """All connections have the same address, as in a class behind a router."""
    monkeypatch.setattr(module, "CONNECTIONS", 20)
    monkeypatch.setattr(module, "AT_ONCE", 5)
    monkeypatch.setattr(module, "EACH_SECOND", 1e-6)

    def attacked(url, ballot):
        cookies = [ask(url)[2] for _ in range(2)]  # two phones join before the vote
        ballot.begin("Poll 1", "Which <b>way</b>?", OPTIONS)
        opened = [ask(url)[0] for _ in range(500)]
        assert (opened.count(200), opened.count(503)) == (3, 497)
        assert "tries again" in ask(url)[1]
        there = urlsplit(url)
        half = [socket.create_connection((there.hostname, there.port)) for _ in range(100)]
        for one in half[::2]:
            one.sendall(b"GET / HTTP/1.1\r\nHost: ")
        for letter, cookie in zip("BC", cookies, strict=True):
            body = urlencode({"choice": letter, "vote": ballot.key})
            assert ask(url, "POST", body, **FORM, Cookie=cookie)[0] == 303
            assert f"You voted {letter}." in ask(url, Cookie=cookie)[1]
        ballot.close()
        assert (ballot.counts, ballot.votes) == ({"B": 1, "C": 1}, {})
        for one in half:
            one.close()

    async def serve():
        url, ballot = open_votes("127.0.0.1")
        await asyncio.to_thread(attacked, url, ballot)

    asyncio.run(serve())


FORM = {"Content-Type": "application/x-www-form-urlencoded"}


def vote(url, letters):
    """Open the page as a phone does, and vote once for each letter; return page and cookie."""
    status, page, cookie = ask(url)
    assert status == 200
    assert re.findall(r'value="(.)"', page) == list("ABCD")
    assert all(shown in page for shown in ["Which <b>way</b>?", *OPTIONS])
    (key,) = re.findall(r'name="vote" value="(\w+)"', page)
    for letter in letters:
        body = urlencode({"choice": letter, "vote": key})
        assert ask(url, "POST", body, **FORM, Cookie=cookie)[0] == 303
    page = ask(url, Cookie=cookie)[1]
    assert f"You voted {letters[-1]}." in page
    return page, cookie


def test_the_count_is_hidden_until_the_vote_is_closed(tmp_path):
    lesson_at(
        tmp_path,
        new_markdown_cell("# Tiny"),
        new_markdown_cell("### Poll 1\n\n- **A** · yes\n- **B** · no"),
    )
    with lecture(tmp_path, "--votes", "127.0.0.1") as (address, server):
        url = re.search(r"Phones vote at (\S+)", server.stdout.readline())[1]
        page, token = address.split("?token=")
        assert "<h1>Tiny</h1>" in ask(page)[1]
        desk = page.rpartition("/")[0] + "/votes"

        def state(words=None):
            method, body = ("GET", None) if words is None else ("POST", json.dumps(words))
            status, text, _ = ask(f"{desk}?token={token}", method, body)
            return json.loads(text) if status == 200 else status

        begin = {"poll": "Poll 1", "question": "Which <b>way</b>?", "options": OPTIONS}
        assert "No vote is open" in ask(url)[1]
        for other in ("", "?token=", f"?token={token[:-1]}!", "?token=%C3%A9"):
            assert ask(desk + other)[0] == 403
            assert ask(desk + other, "POST", json.dumps(begin))[0] == 403
        for target in (page, f"{desk}?token={token}"):
            assert ask(target, Host="evil.example")[0] == 403
        root = page.partition("/slides/")[0]
        for odd in (url + "/votes", url + "/%00", root + "/%00", root + "/slides/%00.html"):
            assert ask(odd)[0] == 404
        assert state(begin)["open"]
        late = urlencode({"choice": "A", "vote": ask(url + "/state")[1]})
        letters = ["BA", "DA", *"CCCCCBBBBDDDAAAAAAAAAABCBCBC", "AB"]
        with ThreadPoolExecutor(30) as phones:
            pages, cookies = zip(*phones.map(vote, [url] * len(letters), letters), strict=True)
        assert len(set(cookies)) == len(letters)  # each phone has a random name
        assert not any(re.search(r"\b\d+ votes?\b|<meter", page) for page in pages)
        assert ask(url, "POST", late, **FORM)[0] == 303  # no phone with this cookie was admitted
        assert ask(url, "POST", late, **FORM, Cookie="phone=a")[0] == 303
        odd = late.replace("choice=A", "choice=E")
        assert ask(url, "POST", odd, **FORM, Cookie=cookies[0])[0] == 303
        assert f"You voted {letters[0][-1]}." in ask(url, Cookie=cookies[0])[1]
        now = state(
            {"poll": "Poll 2", "question": "", "options": OPTIONS}
        )  # the vote on poll 1 remains open
        assert now["address"] == url
        assert now["code"].startswith("<svg")
        assert (now["open"], now["voters"], now["counts"]) == (True, len(letters), [])
        counts = Counter(last for *_, last in letters)
        closed = state({})
        assert closed["counts"] == [counts[letter] for letter in "ABCD"]
        assert state({}) == closed  # the second request changes nothing
        result = ask(url)[1]
        assert "Poll 1: the result" in result
        values = re.findall(r'<meter max="(\d+)" value="(\d+)">', result)
        assert values == [(str(len(letters)), str(counts[letter])) for letter in "ABCD"]
        assert ask(url, "POST", late, **FORM, Cookie=cookies[0])[0] == 303  # the vote is closed
        assert state() == closed
        assert ask(url + "/state")[1] == ""
        assert state(begin)["voters"] == 0
        assert ask(url, "POST", late, **FORM, Cookie=cookies[0])[0] == 303
        assert "Tap your answer" in ask(url, Cookie=cookies[0])[1]  # this is another vote
        with socket.create_connection(("127.0.0.1", urlsplit(url).port)):
            end = signal.SIGTERM if sys.platform == "win32" else signal.SIGINT
            server.send_signal(end)
            server.wait()
    for there in (url, page):
        with socket.socket() as probe:
            assert probe.connect_ex(("127.0.0.1", urlsplit(there).port))
