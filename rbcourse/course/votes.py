"""Votes on a poll, from telephones in the class network: anonymous, and nothing is kept."""

import ipaddress
import secrets
import socket
import string
from collections import Counter
from pathlib import Path
from typing import Any

from jupyter_server.base.handlers import APIHandler
from tornado.escape import json_decode
from tornado.httpserver import HTTPServer
from tornado.web import Application, HTTPError, RequestHandler, authenticated

TEMPLATES = Path(__file__).with_name("lecture_view")
PORT = 8000


class Ballot:
    """One vote at a time: opened, taken, closed, and then counted.

    Attributes
    ----------
    number : int
        How many votes have been opened.
    poll : str
        The name of the poll that was opened last.
    letters : str
        Its options, ``"ABCD"``.
    open : bool
        Whether votes are taken.
    """

    def __init__(self) -> None:
        self.number = 0
        self.poll = ""
        self.letters = ""
        self.open = False
        self._votes: dict[str, str] = {}
        self._counts: Counter[str] = Counter()

    def begin(self, poll: str, options: int) -> None:
        """Open a vote on a poll; what was counted before is forgotten."""
        if self.open:
            raise ValueError(f"The vote on {self.poll} is open; close it first.")
        if not 2 <= options <= 26:
            raise ValueError(f"A poll has 2 to 26 options, not {options}.")
        self.number += 1
        self.poll = poll
        self.letters = string.ascii_uppercase[:options]
        self.open = True

    def vote(self, phone: str, letter: str) -> None:
        """Take the vote of a phone, in place of its last one."""
        if not self.open:
            raise ValueError("No vote is open.")
        if letter not in tuple(self.letters):
            raise ValueError(f"The options are {', '.join(self.letters)}.")
        self._votes[phone] = letter

    def vote_of(self, phone: str) -> str:
        """Return the vote of a phone in this poll; ``""`` if there is none."""
        return self._votes.get(phone, "")

    def close(self) -> None:
        """Close the vote, count it, and forget who voted for what."""
        self._counts = Counter(self._votes.values())
        self._votes.clear()
        self.open = False

    def state(self) -> dict[str, Any]:
        """Return what the lecturer may know: the counts only after the vote has closed."""
        counts = [] if self.open else [self._counts[letter] for letter in self.letters]
        voters = len(self._votes) if self.open else sum(counts)
        return {"poll": self.poll, "open": self.open, "voters": voters, "counts": counts}


class Lecturer(APIHandler):
    """Open, watch and close votes, with the token of the lecture."""

    def initialize(self, ballot: Ballot) -> None:
        """Keep the ballot."""
        self.ballot = ballot

    @authenticated
    def get(self) -> None:
        """Answer with the state."""
        self.finish(self.ballot.state())

    @authenticated
    def post(self) -> None:
        """Open the vote on a poll, ``{"poll": "Poll 1", "options": 4}``, or close it, ``{}``."""
        words = json_decode(self.request.body)
        if words:
            self.ballot.begin(words["poll"], words["options"])
        else:
            self.ballot.close()
        self.get()


class Phone(RequestHandler):
    """The page of the phones: ``GET`` shows it, and ``POST`` with ``choice=B`` votes.

    A phone is known by a random number in a cookie, which is another one for each vote.
    """

    def initialize(self, ballot: Ballot) -> None:
        """Keep the ballot."""
        self.ballot = ballot

    def set_default_headers(self) -> None:
        """Let the page ask this server only, and nobody store it."""
        self.set_header("Content-Security-Policy", "default-src 'self' 'unsafe-inline'")
        self.set_header("Cache-Control", "no-store")
        self.set_header("Referrer-Policy", "no-referrer")

    @property
    def _cookie(self) -> str:
        return f"vote-{self.ballot.number}"

    def get(self, path: str) -> None:
        """Show the options, or that there is nothing to vote on."""
        ballot = self.ballot
        state = f"{ballot.number} {ballot.open}"
        if path == "state":
            self.finish(state)
            return
        phone = self.get_cookie(self._cookie)
        if ballot.open and not phone:
            self.set_cookie(self._cookie, secrets.token_urlsafe(), httponly=True, samesite="Strict")
        choice = ballot.vote_of(phone) if phone else ""
        self.render("phone.html", ballot=ballot, choice=choice, state=state)

    def post(self, path: str) -> None:
        """Take a vote, and show the page again."""
        phone = self.get_cookie(self._cookie)
        if self.ballot.open and not phone:
            raise HTTPError(403, reason="Voting needs cookies, and the page opened before")
        try:
            self.ballot.vote(phone or "", self.get_body_argument("choice"))
        except ValueError as error:
            raise HTTPError(409, reason=str(error)) from error
        self.redirect("/", status=303)


def find_address() -> str:
    """Return the address of this machine in its network, without sending anything.

    Raises
    ------
    OSError
        There is no network.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(("192.0.2.1", 9))  # an address that nobody has
        address: str = probe.getsockname()[0]
        return address


class Phones:
    """The port at which phones vote, at one IPv4 address of this machine.

    Port 8000 is taken, or another where that is in use.

    Attributes
    ----------
    ballot : Ballot
        The votes.
    url : str
        The address of the page.
    """

    def __init__(self, address: str) -> None:
        if ipaddress.IPv4Address(address).is_unspecified:
            raise ValueError("it is every address of this machine; name one")
        try:
            self._socket = socket.create_server((address, PORT))
        except OSError:
            self._socket = socket.create_server((address, 0))
        self._socket.setblocking(False)
        self.url = f"http://{address}:{self._socket.getsockname()[1]}"
        self.ballot = Ballot()
        application = Application(
            [(r"/(state|)", Phone, {"ballot": self.ballot})],
            template_path=str(TEMPLATES),
            log_function=lambda handler: None,  # who asks is not written down
        )
        self._server = HTTPServer(application, max_body_size=1000, idle_connection_timeout=60)

    def start(self) -> None:
        """Answer phones, on the event loop that runs."""
        self._server.add_socket(self._socket)

    def stop(self) -> None:
        """Close the port."""
        self._server.stop()
