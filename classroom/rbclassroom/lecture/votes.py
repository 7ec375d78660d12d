"""Anonymous votes on a poll, from phones in the class network; nothing is stored."""

import ipaddress
import secrets
import socket
import string
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tornado.httpserver import HTTPServer
from tornado.web import Application, RequestHandler

PORT = 8000
CONNECTIONS = 200
"""The largest number of connections at the same time; macOS allows a program 256 open files."""
AT_ONCE, EACH_SECOND, PHONES = 60, 5, 500
"""The numbers of phones that may join from one address: at once, later each second, and in all."""

FULL = "Many phones join at this moment. This page tries again by itself."


class Ballot:
    """The current vote on a poll, which is opened, closed and then counted.

    For the vote that was opened last, `key` is a random name, `poll` is the name of the poll, and
    `options` has the text of each letter as HTML. While `open` is true, `votes` has the letter of
    each phone that has voted. After the vote, `counts` has the number of votes for each letter.
    """

    def __init__(self) -> None:
        self.key = self.poll = ""
        self.options: dict[str, str] = {}
        self.open = False
        self.question = ""
        self.votes: dict[str, str] = {}
        self.counts: Counter[str] = Counter()

    def begin(self, poll: str, question: str, options: list[str]) -> None:
        """Open a vote on a poll if no vote is open; its counts will replace the earlier counts."""
        if not self.open:
            self.key, self.poll, self.open = secrets.token_hex(8), poll, True
            self.question = question
            self.options = dict(zip(string.ascii_uppercase, options, strict=False))

    def close(self) -> None:
        """Close and count the vote if it is open, and delete the votes of individual phones."""
        if self.open:
            self.counts = Counter(self.votes.values())
            self.votes, self.open = {}, False

    def state(self) -> dict[str, Any]:
        """Return the poll, whether its vote is open, the number of votes, and the final counts."""
        counts = [] if self.open else [self.counts[letter] for letter in self.options]
        voters = len(self.votes) if self.open else sum(counts)
        return {"poll": self.poll, "open": self.open, "voters": voters, "counts": counts}


class Guests:
    """The phones that have joined a lecture: `phones` has their random names.

    A program can join as many phones. It cannot be told from a class, because all phones behind a
    router or a hotspot have the address of this router. The limits for an address therefore let a
    class of 200 join from one address within half a minute. A single program can still add 60
    votes at once, and 300 each minute; the lecturer sees that there are more votes than people. It
    cannot keep out phones with other addresses or phones that have joined before. `clock` returns
    the time in seconds.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.clock = clock
        self.phones = set[str]()
        self._joined = Counter[str]()  # for each address, the number of phones
        self._due = dict[str, float]()  # when its phones had joined if 5 could join each second

    def join(self, address: str) -> str:
        """Return a new name for a phone, or "" if too many phones with its address have joined."""
        now = self.clock()
        due = max(now, self._due.get(address, 0)) + 1 / EACH_SECOND
        if due - now > AT_ONCE / EACH_SECOND or self._joined[address] == PHONES:
            return ""
        self._due[address] = due
        self._joined[address] += 1
        name = secrets.token_hex(16)
        self.phones.add(name)
        return name


class Phone(RequestHandler):
    """The page of the phones: ``GET`` shows it, and ``POST`` with its form votes.

    A random number in a cookie identifies a phone until the lecture ends. When the vote is closed,
    the page shows the counts. It asks for ``/state`` and reloads if this has changed.
    """

    def initialize(self, ballot: Ballot, guests: Guests) -> None:
        """Store the ballot, the guests, and the name of the phone, which is empty at first."""
        self.ballot, self.guests = ballot, guests
        self.phone = self.get_cookie("phone", "") or ""

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
        if self.phone not in self.guests.phones:
            self.phone = self.guests.join(self.request.remote_ip or "")
            if self.phone:
                self.set_cookie("phone", self.phone, httponly=True, samesite="Lax")
            elif ballot.open:
                self.set_status(503)
                self.set_header("Refresh", "3")
                self.finish('<meta name="viewport" content="width=device-width">' + FULL)
                return
        self.render("phone.html", ballot=ballot, choice=ballot.votes.get(self.phone, ""))

    def post(self) -> None:
        """Record a vote, in place of an earlier one, unless it comes too late; show the page."""
        choice, vote = self.get_body_argument("choice"), self.get_body_argument("vote", "")
        now = self.ballot.open and vote == self.ballot.key
        if now and self.phone in self.guests.phones and choice in self.ballot.options:
            self.ballot.votes[self.phone] = choice
        self.redirect("/", status=303)


class _Server(HTTPServer):
    """A server that closes the oldest connection from the busiest address if it has too many.

    A page needs a connection for some milliseconds only, so this connection asks for no page.
    """

    def initialize(self, *args: Any, **settings: Any) -> None:
        """Begin without connections."""
        super().initialize(*args, **settings)
        self.streams = dict[Any, str]()  # the address of each connection, the oldest first

    def handle_stream(self, stream: Any, address: Any) -> None:
        """Serve a new connection."""
        self.streams = {each: ip for each, ip in self.streams.items() if not each.closed()}
        self.streams[stream] = address[0]
        super().handle_stream(stream, address)
        if len(self.streams) > CONNECTIONS:
            ((busiest, _),) = Counter(self.streams.values()).most_common(1)
            next(each for each, ip in self.streams.items() if ip == busiest).close()


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
        [("/(?:state)?", Phone, {"ballot": ballot, "guests": Guests()})],
        template_path=str(Path(__file__).with_name("static")),
        log_function=lambda handler: None,  # requests are not logged
    )
    limits = {"max_body_size": 1000, "body_timeout": 5, "idle_connection_timeout": 10}
    server = _Server(application, no_keep_alive=True, **limits)
    server.add_socket(found)
    return f"http://{address}:{found.getsockname()[1]}", ballot
