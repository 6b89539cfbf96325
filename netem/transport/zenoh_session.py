"""The adapter to Eclipse Zenoh 1.x: sessions on this machine, senders and receivers of whole messages.

- Endpoints are explicit, multicast scouting and gossip are off: nothing is discovered, so a run works in a container.
- The emulator listens on port 0 and reads the port that the system chose from Zenoh's admin space.
- Each connection to the emulator proves that it knows the run's secret before a message passes: Zenoh's user and
  password, of which only a keyed hash of a number that is new for each connection is sent (docs/decisions/0016).
- Every key is declared for as long as it is in use: Zenoh keeps the route of a declared key, and computes that of any
  other for each message.
- Every message has congestion control BLOCK and express. Messages are received from a FIFO handler, so that no callback
  runs Python code.
- The low-latency transport (no priorities) does not fragment, so longer messages are sent in parts. Each part begins
  with four bytes that belong to the run and one that says whether more parts follow. A part that begins otherwise is
  received as an empty message, which no decoder accepts.
"""

from __future__ import annotations

import json
import os
import secrets
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from hashlib import blake2b
from typing import Final

from netem.wire.zenoh_runtime import ONE_THREAD

os.environ.setdefault("ZENOH_RUNTIME", ONE_THREAD)

import zenoh

BATCH_BYTES: Final = 4_096         # Zenoh clears a buffer of this size for every message that comes in
MAX_PART_BYTES: Final = 3_500
TOKEN_BYTES: Final = 4
USER: Final = "member"             # of every run; the password alone is secret
JOIN_WITHIN_MS: Final = 20_000     # a node tries again if connections without authentication take all places
MOST_STRANGERS: Final = 300        # connections not authenticated yet; each takes a file descriptor
STRANGERS_WITHIN_MS: Final = 3_000  # time after which such a connection is closed
CLOSE_WITHIN_S: Final = 2.0
ENTRANCES: Final = ((zenoh, "open", "opening a Zenoh session"), (zenoh, "scout", "scouting for Zenoh"))


class NotReachable(Exception):
    """No session subscribed to a key in time, or Zenoh does not listen on the loopback."""


def _config(*, listen: str | None, connect: str | None, usrpwd: dict[str, str]) -> zenoh.Config:
    settings = {
        "mode": "peer",
        "listen/endpoints": [listen] if listen else [],
        "connect/endpoints": [connect] if connect else [],
        "connect/exit_on_failure": True,
        "connect/timeout_ms": JOIN_WITHIN_MS,
        "connect/retry": {"period_init_ms": 50, "period_max_ms": 500, "period_increase_factor": 2.0},
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "adminspace/enabled": listen is not None,
        "transport/link/tx/batch_size": BATCH_BYTES,
        "transport/shared_memory/enabled": False,
        "transport/unicast/qos/enabled": False,
        "transport/unicast/lowlatency": True,
        "transport/unicast/accept_pending": MOST_STRANGERS,
        "transport/unicast/accept_timeout": STRANGERS_WITHIN_MS,
        "transport/auth/usrpwd": usrpwd,
    }
    config = zenoh.Config()
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return config


class Sender:
    """Publishes whole messages to one key, in order."""

    def __init__(self, session: zenoh.Session, key: str, token: bytes) -> None:
        self.key = key
        self._last, self._more = token + b"\0", token + b"\1"
        self._declared = session.declare_keyexpr(key)
        self._put = (publisher := session.declare_publisher(
            self._declared, congestion_control=zenoh.CongestionControl.BLOCK, express=True)).put
        self._publisher = publisher

    def send(self, message: bytes) -> None:
        if len(message) <= MAX_PART_BYTES:
            self._put(self._last + message)
            return
        for start in range(0, len(message), MAX_PART_BYTES):
            more = start + MAX_PART_BYTES < len(message)
            self._put((self._more if more else self._last) + message[start:start + MAX_PART_BYTES])

    def await_subscriber(self, timeout_s: float, give_up: Callable[[], bool] = lambda: False) -> None:
        """Return when somebody has subscribed to the key; messages sent before that are lost.

        Raises `NotReachable` after `timeout_s`, or as soon as `give_up` returns true.
        """
        deadline_s = time.monotonic() + timeout_s
        while not self._matching():
            if time.monotonic() > deadline_s or give_up():
                raise NotReachable(f"{self.key}: nobody subscribed within {timeout_s} s")
            time.sleep(0.001)


    def _matching(self) -> bool:
        return bool(getattr(self._publisher, "matching_status").matching)       # noqa: B009  # its stub is wrong


class Receiver:
    """Receives whole messages on a key expression; `senders` are the keys that it matches, if it is a pattern."""

    def __init__(self, session: zenoh.Session, key: str, token: bytes, senders: Sequence[str]) -> None:
        self._declared = [session.declare_keyexpr(sender) for sender in senders]
        self._receive = session.declare_subscriber(key).recv
        self._last, self._more = token + b"\0", token + b"\1"
        self._parts: dict[str, list[bytes]] = {}
        self._only_key = "" if "*" in key else key      # the key of every message, "" if `key` is a pattern

    def receive(self) -> tuple[str, bytes]:
        """Wait for the next message and return (key, message); b"" for one that no `Sender` of this run has sent."""
        while True:
            sample = self._receive()
            key, data = self._only_key or str(sample.key_expr), sample.payload.to_bytes()
            lead, part = data[:TOKEN_BYTES + 1], data[TOKEN_BYTES + 1:]
            if lead == self._last:
                if self._parts and (earlier := self._parts.pop(key, None)):
                    part = b"".join([*earlier, part])
                return key, part
            if lead != self._more:
                return key, b""
            self._parts.setdefault(key, []).append(part)


def new_secret() -> str:
    """256 random bits, too many to be guessed from the hash that passes over the connection."""
    return secrets.token_hex(32)


class Session:
    """A Zenoh session of one process of a run; close it, or use it in a `with` statement."""

    def __init__(self, secret: str, *, connect: str | None = None) -> None:
        """Connect to an endpoint such as tcp/127.0.0.1:40123; without one, listen on a port that the system chooses.

        `secret` is the password that the processes of the run share. Zenoh reads it from a file, here one in memory.
        """
        self._token = blake2b(secret.encode(), digest_size=TOKEN_BYTES).digest()
        if connect is not None:
            self.endpoint = connect
            self._session = zenoh.open(_config(listen=None, connect=connect,
                                               usrpwd={"user": USER, "password": secret}))
            return
        with _in_memory(f"{USER}:{secret}\n") as dictionary:
            self._session = zenoh.open(_config(listen="tcp/127.0.0.1:0", connect=None,
                                               usrpwd={"dictionary_file": dictionary}))
        self.endpoint = self._listening_on()

    def _listening_on(self) -> str:
        for reply in self._session.get(f"@/{self._session.info.zid()}/peer"):
            if reply.ok is not None:
                for locator in json.loads(reply.ok.payload.to_string())["locators"]:
                    if locator.startswith("tcp/127.0.0.1:"):
                        return str(locator)
        raise NotReachable("Zenoh listens on no loopback port")

    def sender(self, key: str) -> Sender:
        return Sender(self._session, key, self._token)

    def receiver(self, key: str, *senders: str) -> Receiver:
        """Subscribe to `key`; if it is a pattern, `senders` are the keys on which messages will arrive."""
        return Receiver(self._session, key, self._token, senders)

    def close(self) -> None:
        """Close the session, waiting up to `CLOSE_WITHIN_S` until all messages have been sent."""
        closing = threading.Thread(target=self._session.close, name="closing Zenoh", daemon=True)
        closing.start()
        closing.join(CLOSE_WITHIN_S)

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


@contextmanager
def _in_memory(text: str) -> Iterator[str]:
    """Yield the path of a file in memory with this text, which only this process can open."""
    file = os.memfd_create("users", os.MFD_CLOEXEC)
    try:
        os.write(file, text.encode())
        yield f"/proc/self/fd/{file}"
    finally:
        os.close(file)
