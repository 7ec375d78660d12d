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

PORT = 8000
MOST = 500
"""The largest number of phones, and of connections at the same time."""


class Ballot:
    """The current vote on a poll, which is opened, closed and then counted.

    For the vote that was opened last, `key` is a random name, `poll` is the name of the poll, and
    `options` has the text of each letter as HTML. While `open` is true, `votes` has the letter of
    each phone, or ``""`` before its first vote. After the vote, `counts` has the number of votes
    for each letter.
    """

    def __init__(self) -> None:
        self.key = self.poll = ""
        self.options: dict[str, str] = {}
        self.open = False
        self.votes: dict[str, str] = {}
        self.counts: Counter[str] = Counter()

    def begin(self, poll: str, options: list[str]) -> None:
        """Open a vote on a poll if no vote is open; its counts will replace the earlier counts."""
        if not self.open:
            self.key, self.poll, self.open = secrets.token_hex(8), poll, True
            self.options = dict(zip(string.ascii_uppercase, options, strict=False))

    def close(self) -> None:
        """Close and count the vote if it is open, and delete the votes of individual phones."""
        if self.open:
            self.counts = Counter(filter(None, self.votes.values()))
            self.votes, self.open = {}, False

    def state(self) -> dict[str, Any]:
        """Return the poll, whether its vote is open, the number of votes, and the final counts."""
        counts = [] if self.open else [self.counts[letter] for letter in self.options]
        voters = sum(map(bool, self.votes.values())) if self.open else sum(counts)
        return {"poll": self.poll, "open": self.open, "voters": voters, "counts": counts}


class Phone(RequestHandler):
    """The page of the phones: ``GET`` shows it, and ``POST`` with ``choice=B`` votes.

    A random number in a cookie identifies a phone. Each vote has new cookies. When the vote is
    closed, the page shows the counts. It asks for ``/state`` and reloads if this has changed.
    """

    def initialize(self, ballot: Ballot) -> None:
        """Store the ballot, and the phone's name in this vote, which is empty if it has none."""
        self.ballot = ballot
        self.phone = self.get_cookie(f"vote-{ballot.key}", "") or ""

    def set_default_headers(self) -> None:
        """Restrict the page to content of this server; forbid browsers to store or frame it."""
        here = "default-src 'self' 'unsafe-inline'; form-action 'self'; frame-ancestors 'none'"
        self.set_header("Content-Security-Policy", here)
        self.set_header("Cache-Control", "no-store")
        self.set_header("Referrer-Policy", "no-referrer")

    def get(self) -> None:
        """Show the options of an open vote; if no vote is open, show the last result, if any."""
        ballot = self.ballot
        if self.request.path == "/state":
            self.finish(ballot.key if ballot.open else "")
            return
        if ballot.open and self.phone not in ballot.votes:
            if len(ballot.votes) == MOST:
                raise HTTPError(503, reason=f"{MOST} phones have already joined.")
            self.phone = secrets.token_hex(16)
            ballot.votes[self.phone] = ""
            self.set_cookie(f"vote-{ballot.key}", self.phone, httponly=True, samesite="Strict")
        self.render("phone.html", ballot=ballot, choice=ballot.votes.get(self.phone, ""))

    def post(self) -> None:
        """Record a vote, in place of an earlier one, unless it comes too late; show the page."""
        choice = self.get_body_argument("choice")
        if self.phone in self.ballot.votes and choice in self.ballot.options:
            self.ballot.votes[self.phone] = choice
        self.redirect("/", status=303)


class _Server(HTTPServer):
    def handle_stream(self, stream: Any, address: Any) -> None:
        if len(self._connections) < MOST:
            super().handle_stream(stream, address)
        else:
            stream.close()


def find_address() -> str:
    """Return the address of this machine in its network; raise OSError if there is no network."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(("192.0.2.1", 9))  # reserved for documentation; nothing is sent
        address: str = probe.getsockname()[0]
        return address


def open_votes(address: str) -> tuple[str, Ballot]:
    """Let phones vote; return the address of their page, and the ballot.

    The server uses the running event loop. It has the given IPv4 address of this machine, by
    default its address in the network. The port is 8000, or another one if 8000 is in use.
    """
    try:
        address = address or find_address()
        there = ipaddress.IPv4Address(address)
        if there.is_unspecified or there.is_multicast or there.is_reserved:
            raise ValueError("it is not the address of one machine")
        try:
            found = socket.create_server((address, PORT))
        except OSError:
            found = socket.create_server((address, 0))
    except (ValueError, OSError) as error:
        where = address or "this machine, which has no network"
        raise ValueError(f"Phones cannot vote at {where}: {error}.") from error
    found.setblocking(False)
    ballot = Ballot()
    application = Application(
        [("/(?:state)?", Phone, {"ballot": ballot})],
        template_path=str(Path(__file__).with_name("static")),
        log_function=lambda handler: None,  # requests are not logged
    )
    server = _Server(application, max_body_size=1000, body_timeout=5, idle_connection_timeout=10)
    server.add_socket(found)
    return f"http://{address}:{found.getsockname()[1]}", ballot
