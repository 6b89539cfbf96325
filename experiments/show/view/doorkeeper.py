"""Which requests a view answers: those from this machine to its loopback address, with the token of the run.

Behind a TLS door, only what is asked of the names of that door.

A page of another site that the same browser shows can reach the loopback address too, so its Origin is refused, and by
the Host header a name of that site which its owner points at 127.0.0.1 (DNS rebinding).
"""

from __future__ import annotations

import secrets
from collections.abc import Sequence
from http import HTTPStatus
from urllib.parse import parse_qs, urlsplit

NAMES = ("127.0.0.1", "localhost")


class Doorkeeper:
    """Admits requests to the view at the loopback's `port`, or behind a TLS door at one of `names` ("host:port")."""

    def __init__(self, token: str, port: int, names: Sequence[str] = ()) -> None:
        self._token = token
        self._hosts = {*names} or {f"{name}:{port}" for name in NAMES}
        self._origins = {f"{'https' if names else 'http'}://{host}" for host in self._hosts}

    def refusal(self, path: str, hosts: Sequence[str], origins: Sequence[str]) -> tuple[HTTPStatus, str] | None:
        """Return why a request is refused, None if it is not; `hosts` and `origins` are the headers of these names."""
        if len(hosts) != 1 or hosts[0] not in self._hosts:
            return HTTPStatus.FORBIDDEN, "the view is at the address that the run printed, and at no other name"
        if len(origins) > 1 or not self._origins.issuperset(origins):
            return HTTPStatus.FORBIDDEN, "pages of other sites may not ask for the view"
        tokens = parse_qs(urlsplit(path).query).get("token", [])
        if len(tokens) != 1 or not secrets.compare_digest(tokens[0].encode(), self._token.encode()):
            return HTTPStatus.UNAUTHORIZED, "the token is missing or wrong: open the address that the run printed"
        return None
