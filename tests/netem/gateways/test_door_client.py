"""What a client of ours is told at a door, at what is no door, and by a machine beyond the loopback."""

from __future__ import annotations

import os
import shutil
import socket
import ssl
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from netem.gateways import Door
from netem.gateways.certificate_authority import make_certificates
from netem.gateways.certificates import Certificates
from netem.gateways.door_client import Caller, NotAdmitted, ask_door, door_address
from netem.gateways.tls_front import TlsFront
from tests.free_port import free_port

WITHOUT = """
import socket, ssl, sys
host, port = sys.argv[1].split(":")
context = ssl.create_default_context(cafile=sys.argv[2] + "/authority.crt")
context.set_alpn_protocols(["marconet-check"])      # so that a door says a word to whom it lets in
try:
    with context.wrap_socket(socket.create_connection((host, int(port)), 20), server_hostname=host) as stream:
        print("heard", stream.recv(100))
except (ssl.SSLError, ConnectionResetError):
    print("heard b''")
"""                     # a client of another maker, without a certificate
A_DOOR = """
import sys
from pathlib import Path
from netem.gateways import Door
from netem.gateways.tls_front import TlsFront
front = TlsFront(Path(sys.argv[1]))
door = front.open("test", Door("198.51.100.1:0", ("operator",)), "unix/nothing", print)
print(door.address, flush=True)
sys.stdin.readline()
front.close()
"""
HERE, THERE = "198.51.100.1", "198.51.100.2"    # of no real network (RFC 5737)


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A folder of certificates, and one of another authority."""
    here = tmp_path_factory.mktemp("certificates")
    make_certificates(here / "ours", ["r1", "operator"], ["127.0.0.1", HERE])
    make_certificates(here / "theirs", ["operator"])
    return here / "ours", here / "theirs"


@contextmanager
def door_at(folder: Path, listen: str) -> Iterator[str]:
    """A door for the operator, behind which nobody is; yields its address."""
    front = TlsFront(folder)
    try:
        yield front.open("test", Door(listen, ("operator",)), "unix/nothing", lambda *event: None).address
    finally:
        front.close()


@contextmanager
def server(serve: Callable[[socket.socket], None]) -> Iterator[str]:
    """A server of one connection; yields its address."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        def run() -> None:
            with suppress(OSError):
                connection, _ = listening.accept()
                with connection:
                    serve(connection)

        thread = threading.Thread(target=run)
        thread.start()
        yield f"127.0.0.1:{listening.getsockname()[1]}"
        with suppress(OSError):
            listening.shutdown(socket.SHUT_RDWR)
        thread.join()


def test_a_door_says_whether_it_lets_a_client_in(folders):
    with door_at(folders[0], "127.0.0.1:0") as address:
        assert ask_door(f"tls://{address}", Caller(folders[0], "operator")) == "operator"
        with pytest.raises(NotAdmitted, match="refuses r1: its certificate is r1's; this door is operator's"):
            ask_door(address, Caller(folders[0], "r1"))
        with pytest.raises(NotAdmitted, match="the certificate of the door is from another authority"):
            ask_door(address, Caller(folders[1], "operator"))


def test_a_client_needs_its_own_files_and_the_authority_only(folders, tmp_path):
    for name in ("authority.crt", "operator.crt", "operator.key"):
        shutil.copy(folders[0] / name, tmp_path)

    with door_at(folders[0], "127.0.0.1:0") as address:
        assert ask_door(address, Caller(tmp_path, "operator")) == "operator"


def not_our_door(folder: Path) -> Callable[[socket.socket], None]:
    def serve(connection: socket.socket) -> None:
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(folder / "emulator.crt", folder / "emulator.key")
        with context.wrap_socket(connection, server_side=True) as stream:
            stream.recv(1)

    return serve


def says_nothing(folder: Path) -> Callable[[socket.socket], None]:
    def serve(connection: socket.socket) -> None:
        with Certificates(folder).server_context().wrap_socket(connection, server_side=True) as stream:
            stream.recv(1)

    return serve


@pytest.mark.parametrize(("of", "why"), [
    (lambda ours: lambda connection: connection.sendall(b"220 hello, this is a mail server\r\n"),
     "what listens there does not speak TLS"),
    (lambda ours: lambda connection: connection.recv(1 << 16, socket.MSG_WAITALL),
     "no TLS handshake within 0.5 s of the connection"),
    (not_our_door, "speaks TLS, but what listens there is no door of a run"),
    (says_nothing, "no word within 0.5 s of the TLS handshake"),
])
def test_what_is_no_door_is_told_as_that(folders, of: Callable, why):
    with server(of(folders[0])) as address, pytest.raises(NotAdmitted) as caught:
        ask_door(address, Caller(folders[0], "operator"), 0.5)

    assert str(caught.value).startswith(f"{address}: {why}")


def test_where_nobody_listens_is_told_as_that(folders):
    with pytest.raises(NotAdmitted, match="nobody listens there: start the run, or correct the address"):
        ask_door(f"127.0.0.1:{free_port()}", Caller(folders[0], "operator"))


@pytest.mark.parametrize("text", ["", "7600", "127.0.0.1", "127.0.0.1:0", "127.0.0.1:65536", "::1:7600", "[::1:7600",
                                  "tcp://127.0.0.1:7600", "tls://:7600", "host name:7600", "tls://127.0.0.1:٧"])
def test_an_address_that_is_none_is_refused(text):
    with pytest.raises(NotAdmitted, match="expected HOST:PORT of a door"):
        door_address(text)


@pytest.mark.parametrize(("text", "address"), [
    ("tls://192.168.1.5:7600", ("192.168.1.5", 7600)), ("tls/[::1]:7447", ("::1", 7447)),
    ("https://base.local:8000/?token=x", ("base.local", 8000)), ("localhost:1", ("localhost", 1))])
def test_an_address_is_written_as_doors_write_it(text, address):
    assert door_address(text) == address


@pytest.fixture
def two_machines() -> Iterator[tuple[list[str], list[str]]]:
    """The beginnings of commands at HERE and at THERE: two network namespaces, joined by a cable of their own."""
    here, there = f"mar{os.getpid()}a", f"mar{os.getpid()}b"
    steps = [f"netns add {here}", f"netns add {there}",
             f"-n {here} link add eth0 type veth peer name eth0 netns {there}",
             f"-n {here} addr add {HERE}/30 dev eth0", f"-n {here} link set eth0 up",
             f"-n {there} addr add {THERE}/30 dev eth0", f"-n {there} link set eth0 up"]
    if shutil.which("ip") is None:
        pytest.skip("network namespaces need the command ip: apt-get install iproute2")
    try:
        for step in steps:
            done = subprocess.run(["ip", *step.split()], capture_output=True, text=True, check=False)
            if done.returncode:
                pytest.skip(f"network namespaces are not permitted here, they need root: ip {step}: {done.stderr}")
        yield ["ip", "netns", "exec", here], ["ip", "netns", "exec", there]
    finally:
        for name in (here, there):
            subprocess.run(["ip", "netns", "delete", name], capture_output=True, check=False)


def test_another_machine_reaches_a_door_with_a_certificate_and_is_refused_without(folders, two_machines):
    here, there = two_machines
    ours = str(folders[0])
    with subprocess.Popen([*here, sys.executable, "-c", A_DOOR, ours], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                          text=True) as door:
        assert door.stdout is not None
        address = door.stdout.readline().strip()
        told = subprocess.run([*there, sys.executable, "-m", "marconet.command_line", "certificates", "check",
                               f"tls://{address}", "--as", "operator", "--certificates", ours],
                              capture_output=True, text=True, timeout=60, check=False)
        without = subprocess.run([*there, sys.executable, "-c", WITHOUT, address, ours],
                                 capture_output=True, text=True, timeout=60, check=False)
        door.communicate("end\n", timeout=60)

    assert address.startswith(f"{HERE}:")
    assert (told.returncode, told.stdout) == (0, f"tls://{address}: welcome operator\n"), told.stderr
    assert without.stdout == "heard b''\n", without.stderr
