"""A client of ours at a TLS door of a run: it comes with the certificate of a name, and is told more than "time-out".

    open_stream(address, certificate) --TLS--> door --> what is behind it
    ask_door(address, certificate)    --TLS, "marconet-check"--> door: "welcome NAME" or "refused: why"

With TLS 1.3 the handshake is over for the client before the door has looked at its certificate, so a refusal arrives
with the first bytes that are read.
"""

from __future__ import annotations

import socket
import ssl
from collections.abc import Iterator
from contextlib import contextmanager
from ipaddress import ip_address
from pathlib import Path
from typing import Final, NamedTuple

from netem.gateways.certificates import CHECK, EMULATOR, Certificates, why_not_admitted

WITHIN_S: Final = 5.0
LONGEST_LINE: Final = 4096
SCHEMES: Final = ("tls://", "tls/", "https://")
ADDRESS_RULE: Final = "expected HOST:PORT of a door, as tls://192.168.1.5:7600"


class NotAdmitted(ValueError):
    """A door cannot be reached, or does not let the client in; the text says why and what to do."""

    exit_code = 2


class Caller(NamedTuple):
    """Who comes: the certificate and key of `name` in `folder`, which has authority.crt too."""

    folder: Path
    name: str


def door_address(text: str) -> tuple[str, int]:
    """Return host and port of "HOST:PORT", which may follow tls://, tls/ or https://. Raises NotAdmitted for others."""
    scheme = next((scheme for scheme in SCHEMES if text.startswith(scheme)), "")
    rest = text.removeprefix(scheme).partition("/")[0]
    host, colon, port = rest.rpartition(":")
    number = int(port) if port.isascii() and port.isdigit() and len(port) < 6 else -1
    if not colon or not _is_host(host) or not 0 < number < 65536:
        raise NotAdmitted(f"{text}: {ADDRESS_RULE}")
    return host.strip("[]"), number


def ask_door(address: str, caller: Caller, within_s: float = WITHIN_S) -> str:
    """Return the name under which the door lets the caller in. Raises NotAdmitted with the reason if it does not."""
    silent = f"no word within {within_s:g} s of the TLS handshake: the run's machine is stopped or overloaded"
    with open_stream(address, caller, within_s, asks=True) as stream, told(address, caller, silent):
        line = _line(stream)
    verdict, _, what = line.partition(" ")
    if verdict == "welcome":
        return what
    if verdict == "refused:":
        raise NotAdmitted(f"{address}: refuses {caller.name}: {what}")
    raise NotAdmitted(f"{address}: answers {line[:60]!r}: what listens there is no door of a run; correct the address")


@contextmanager
def open_stream(address: str, caller: Caller, within_s: float = WITHIN_S, *,
                asks: bool = False) -> Iterator[ssl.SSLSocket]:
    """Yield the stream through a door. Raises NotAdmitted as far as the client can tell before anything is read."""
    host, port = door_address(address)
    try:
        context = Certificates(caller.folder, emulators=False).client_context(caller.name)
    except ValueError as error:
        raise NotAdmitted(str(error)) from None
    if asks:
        context.set_alpn_protocols([CHECK])
    with told(address, caller, f"no connection within {within_s:g} s: nobody is at this address, or a firewall is "
               "between; correct the address, or open the port"):
        connection = socket.create_connection((host, port), within_s)
    with connection:
        with told(address, caller, f"no TLS handshake within {within_s:g} s of the connection: what listens there "
                   "does not speak TLS, or the run's machine is stopped; correct the address"):
            stream = context.wrap_socket(connection, server_hostname=EMULATOR)
        with stream:
            if asks and stream.selected_alpn_protocol() != CHECK:
                raise NotAdmitted(f"{address}: speaks TLS, but what listens there is no door of a run; correct the "
                                  "address")
            yield stream


@contextmanager
def told(address: str, caller: Caller, time_out: str) -> Iterator[None]:
    """Raise NotAdmitted for an error of the stream in the `with` block; `time_out` says what was waited for."""
    try:
        yield
    except TimeoutError:
        raise NotAdmitted(f"{address}: {time_out}") from None
    except socket.gaierror as error:
        raise NotAdmitted(f"{address}: no machine has this name ({error.strerror}); correct the address") from None
    except OSError as error:
        raise NotAdmitted(f"{address}: {why_not_admitted(error, caller.name)}") from None


def _line(stream: ssl.SSLSocket) -> str:
    """Return what comes up to the first end of a line. Raises OSError if the door closes the stream without a word."""
    heard = bytearray()
    while b"\n" not in heard and len(heard) < LONGEST_LINE and (data := stream.recv(LONGEST_LINE)):
        heard += data
    if not heard:
        raise ConnectionAbortedError
    return bytes(heard).partition(b"\n")[0].decode(errors="replace")


def _is_host(host: str) -> bool:
    if host.startswith("["):
        host = host[1:-1] if host.endswith("]") else ""
    elif ":" in host:
        return False
    try:
        return bool(ip_address(host))
    except ValueError:
        return bool(host) and host.isascii() and host.replace("-", "").replace(".", "").isalnum()
