"""Anonymous votes on a poll, from phones in the class network; nothing is stored."""

import ipaddress
import secrets
import socket
import string
from collections import Counter
from pathlib import Path
from typing import Any

from tornado.httpserver import HTTPServer
from tornado.web import Application, HTTPError, RequestHandler

TEMPLATES = Path(__file__).with_name("static")
PORT = 8000
MOST = 500
"""The largest number of phones, and of connections at the same time."""


class Ballot:
    """The current vote on a poll, which is opened, closed and then counted.

    For the vote that was opened last, `key` is a random name, `poll` is the name of the poll, and
    `options` has the text of each letter as HTML. Phones can vote while `open` is true. After the
    vote, `counts` has the number of votes for each letter.
    """

    def __init__(self) -> None:
        self.key = self.poll = ""
        self.options: dict[str, str] = {}
        self.open = False
        self._votes: dict[str, str] = {}
        self.counts: Counter[str] = Counter()

    def begin(self, poll: str, options: list[str]) -> None:
        """Open a vote on a poll; the new counts will replace the earlier counts."""
        if self.open:
            raise ValueError(f"The vote on {self.poll} is open; close it first.")
        if not 2 <= len(options) <= 26:
            raise ValueError(f"options: 2 to 26 options are wanted, got {len(options)}")
        self.key = secrets.token_hex(8)
        self.poll = poll
        self.options = dict(zip(string.ascii_uppercase, options, strict=False))
        self.open = True

    def admit(self) -> str:
        """Return a random name for a phone, which is valid until the vote is closed."""
        if len(self._votes) == MOST:
            raise ValueError(f"{MOST} phones have already joined.")
        phone = secrets.token_hex(16)
        self._votes[phone] = ""
        return phone

    def knows(self, phone: str) -> bool:
        """Return whether `phone` is the name of a phone in this vote."""
        return phone in self._votes

    def vote(self, phone: str, letter: str) -> None:
        """Record the vote of an admitted phone, in place of an earlier vote."""
        if letter not in self.options:
            raise ValueError(f"The options are {', '.join(self.options)}.")
        if not self.knows(phone):
            raise ValueError("This phone was not admitted to this vote.")
        self._votes[phone] = letter

    def vote_of(self, phone: str) -> str:
        """Return the last vote of a phone, or ``""`` if it has not voted."""
        return self._votes.get(phone, "")

    def close(self) -> None:
        """Close and count the vote if it is open, and delete the votes of individual phones."""
        if self.open:
            self.counts = Counter(filter(None, self._votes.values()))
            self._votes.clear()
            self.open = False

    def state(self) -> dict[str, Any]:
        """Return the poll, whether its vote is open, the number of votes, and the final counts."""
        counts = [] if self.open else [self.counts[letter] for letter in self.options]
        voters = sum(map(bool, self._votes.values())) if self.open else sum(counts)
        return {"poll": self.poll, "open": self.open, "voters": voters, "counts": counts}


class WithBallot(RequestHandler):
    """A handler that has a ballot."""

    def initialize(self, ballot: Ballot) -> None:
        """Store the ballot."""
        self.ballot = ballot


class Phone(WithBallot):
    """The page of the phones: ``GET`` shows it, and ``POST`` with ``choice=B`` votes.

    A random number in a cookie identifies a phone. Each vote has new cookies. When the vote is
    closed, the page shows the counts.
    """

    def set_default_headers(self) -> None:
        """Restrict the page to content of this server; forbid browsers to store or frame it."""
        here = "default-src 'self' 'unsafe-inline'; form-action 'self'; frame-ancestors 'none'"
        self.set_header("Content-Security-Policy", here)
        self.set_header("Cache-Control", "no-store")
        self.set_header("Referrer-Policy", "no-referrer")

    @property
    def phone(self) -> str:
        """The name of the phone in this vote, or ``""`` if it has none."""
        return self.get_cookie(f"vote-{self.ballot.key}", "") or ""

    def get(self) -> None:
        """Show the options of an open vote; if no vote is open, show the last result, if any."""
        ballot = self.ballot
        if ballot.open and not ballot.knows(self.phone):
            try:
                phone = ballot.admit()
            except ValueError as error:
                raise HTTPError(503, reason=str(error)) from error
            self.set_cookie(f"vote-{ballot.key}", phone, httponly=True, samesite="Strict")
        self.render("phone.html", ballot=ballot, choice=ballot.vote_of(self.phone))

    def post(self) -> None:
        """Record a vote, unless it comes too late, and show the page again."""
        if self.ballot.knows(self.phone):
            try:
                self.ballot.vote(self.phone, self.get_body_argument("choice"))
            except ValueError as error:
                raise HTTPError(400, reason=str(error)) from error
        self.redirect("/", status=303)


class State(WithBallot):
    """The handler that tells which vote is open, so that pages of earlier votes reload."""

    def get(self) -> None:
        """Answer with the key of the vote, or with an empty text if the vote is closed."""
        self.finish(self.ballot.key if self.ballot.open else "")


class _Server(HTTPServer):
    def handle_stream(self, stream: Any, address: Any) -> None:
        if len(self._connections) < MOST:
            super().handle_stream(stream, address)
        else:
            stream.close()


def find_address() -> str:
    """Return the address of this machine in its network, without sending anything.

    Raise OSError if the machine has no network.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(("192.0.2.1", 9))  # an address that is reserved for documentation
        address: str = probe.getsockname()[0]
        return address


class Phones:
    """The server for the votes of phones, at one IPv4 address of this machine.

    The port is 8000, or another one if 8000 is in use. `url` is the address of the page, and
    `ballot` has the votes.
    """

    def __init__(self, address: str) -> None:
        there = ipaddress.IPv4Address(address)
        if there.is_unspecified or there.is_multicast or there.is_reserved:
            raise ValueError("it is not the address of one machine")
        try:
            self._socket = socket.create_server((address, PORT))
        except OSError:
            self._socket = socket.create_server((address, 0))
        self._socket.setblocking(False)
        self.url = f"http://{address}:{self._socket.getsockname()[1]}"
        self.ballot = Ballot()
        application = Application(
            [(r"/", Phone, {"ballot": self.ballot}), (r"/state", State, {"ballot": self.ballot})],
            template_path=str(TEMPLATES),
            log_function=lambda handler: None,  # requests are not logged
        )
        self._server = _Server(
            application, max_body_size=1000, body_timeout=5, idle_connection_timeout=10
        )

    def start(self) -> None:
        """Answer phones on the running event loop, until the process ends."""
        self._server.add_socket(self._socket)
