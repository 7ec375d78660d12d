"""Votes: the ballot by its rules, and thirty phones at the port of a lecture."""

import json
import re
import socket
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from urllib.parse import urlencode, urlsplit

import pytest
from nbformat.v4 import new_markdown_cell
from tiny import ask, lecture, lesson_at

from rbcourse.course import lecture as module
from rbcourse.course.lecture import open_votes
from rbcourse.course.votes import Ballot, find_address


def test_only_the_last_vote_of_a_phone_counts():
    ballot = Ballot()
    ballot.begin("Poll 1", 4)
    for phone, letter in [("a", "A"), ("b", "C"), ("a", "C"), ("c", "D")]:
        ballot.vote(phone, letter)
    assert ballot.vote_of("a") == "C"
    assert ballot.state() == {"poll": "Poll 1", "open": True, "voters": 3, "counts": []}
    ballot.close()
    assert ballot.state() == {"poll": "Poll 1", "open": False, "voters": 3, "counts": [0, 0, 2, 1]}


def test_nothing_of_a_phone_is_kept_when_the_vote_is_closed():
    ballot = Ballot()
    ballot.begin("Poll 1", 2)
    ballot.vote("telephone", "A")
    ballot.close()
    assert "telephone" not in repr(vars(ballot))
    ballot.begin("Poll 2", 2)
    assert ballot.state()["voters"] == 0
    ballot.close()
    assert ballot.state()["counts"] == [0, 0]


@pytest.mark.parametrize("letter", ["E", "a", "", "AB", "1"])
def test_only_options_of_the_poll_are_taken(letter):
    ballot = Ballot()
    ballot.begin("Poll 1", 4)
    with pytest.raises(ValueError, match="The options are A, B, C, D"):
        ballot.vote("a", letter)


def test_a_vote_that_is_closed_takes_none_and_one_that_is_open_is_not_opened_again():
    ballot = Ballot()
    with pytest.raises(ValueError, match="No vote is open"):
        ballot.vote("a", "A")
    for options in (1, 27):
        with pytest.raises(ValueError, match="2 to 26"):
            ballot.begin("Poll 1", options)
    ballot.begin("Poll 1", 5)
    with pytest.raises(ValueError, match="Poll 1 is open"):
        ballot.begin("Poll 2", 4)


@pytest.mark.parametrize("address", ["0.0.0.0", "192.0.2.77", "06", "example.org"])
def test_an_address_that_is_not_of_this_machine_is_refused(address):
    with pytest.raises(ValueError, match=f"Phones cannot vote at {address}: "):
        open_votes(address)


def test_without_a_network_the_class_votes_by_hand(monkeypatch, capsys):
    def nowhere():
        raise OSError("Network is unreachable")

    monkeypatch.setattr(module, "find_address", nowhere)
    assert open_votes("") is None
    assert "show of hands" in capsys.readouterr().out


def test_the_address_is_looked_up_without_sending_anything():
    try:
        address = find_address()
    except OSError:
        return  # there is no network
    with socket.socket() as probe:
        probe.bind((address, 0))  # it is of this machine


def vote(url, letters):
    """Open the page as a phone does, and vote; once for each letter."""
    status, page, cookie = ask(url)
    assert status == 200
    assert re.findall(r'value="(.)"', page) == list("ABCD")
    form = {"Content-Type": "application/x-www-form-urlencoded", "Cookie": cookie}
    for letter in letters:
        assert ask(url, "POST", urlencode({"choice": letter}), **form)[0] == 303
    page = ask(url, Cookie=cookie)[1]
    assert f"You voted {letters[-1]}." in page
    return page + cookie


def test_thirty_phones_vote_and_nobody_sees_the_count_before_it_is_closed(tmp_path):
    lesson_at(tmp_path, new_markdown_cell("### Poll 1\n\n- **A** · yes\n- **B** · no"))
    with lecture(tmp_path, "--votes", "127.0.0.1") as (address, server):
        url = re.search(r"Phones vote at (\S+)", server.stdout.readline())[1]
        desk = address.replace("/?", "/votes?")

        def state(words=None):
            method, body = ("GET", None) if words is None else ("POST", json.dumps(words))
            return json.loads(ask(desk, method, body)[1])

        assert "No vote is open" in ask(url)[1]
        assert ask(desk.split("?")[0])[0] in (302, 401, 403)
        assert ask(url + "/votes")[0] == 404
        assert ask(url, "POST", urlencode({"choice": "A"}))[0] in (400, 409)
        assert state({"poll": "Poll 1", "options": 4})["open"]
        letters = ["BA", "DA", *"CCCCCBBBBDDDAAAAAAAAAABCBCBC", "AB"]
        with ThreadPoolExecutor(30) as phones:
            seen = list(phones.map(vote, [url] * len(letters), letters))
        assert len({page[-32:] for page in seen}) == len(letters)  # a token each
        assert not any(re.search(r"\b\d+ votes?\b", page) for page in seen)
        assert state() == {"poll": "Poll 1", "open": True, "voters": len(letters), "counts": []}
        closed = state({})
        counts = Counter(last for *_, last in letters)
        assert closed["counts"] == [counts[letter] for letter in "ABCD"]
        assert "Poll 1 is closed" in ask(url)[1]
        old = seen[0][-60:].split("vote-1=")[-1]
        form = {"Content-Type": "application/x-www-form-urlencoded", "Cookie": f"vote-1={old}"}
        assert ask(url, "POST", urlencode({"choice": "A"}), **form)[0] == 409
        assert state() == closed
    port = urlsplit(url).port
    with socket.socket() as probe:
        assert probe.connect_ex(("127.0.0.1", port))
