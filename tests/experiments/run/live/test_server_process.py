"""The server of a view with a run that these tests play."""

from __future__ import annotations

import json
import socket
import time
from collections.abc import Iterator
from contextlib import suppress

import pytest
from websockets.sync.client import connect

from experiments.run.live.server_process import NoView, ServerProcess
from experiments.show.view.messages import Ask, Scene, Update

BIG = "x" * 500_000
UPDATES = 100           # 50 MB: more than the system buffers for one connection and the server for one page


@pytest.fixture
def server() -> Iterator[ServerProcess]:
    made = ServerProcess(0, None)
    yield made
    made.close()


def update(number: int) -> Update:
    return Update(number, 1.0, False, 1.0, [], [], {}, {}, [(number, "", "big", BIG, 2)], number, None)


def send_all(server: ServerProcess, message: Scene | Update) -> None:
    server.send(message)
    until_s = time.monotonic() + 60
    while not server.takes_more:
        assert time.monotonic() < until_s, "the server does not take what the run sends"
        time.sleep(0.001)


def test_a_page_that_never_reads_is_dropped_and_holds_up_neither_the_run_nor_others(server: ServerProcess) -> None:
    send_all(server, Scene({}))
    address = server.url.replace("http:", "ws:").replace("/?", "/live?")
    path = "/" + address.partition("//")[2].partition("/")[2]
    port = int(address.partition("1:")[2].partition("/")[0])
    with socket.create_connection(("127.0.0.1", port)) as stuck, connect(address, max_size=None) as reader:
        stuck.sendall((f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                       "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n").encode())
        assert json.loads(reader.recv(60))["type"] == "scene"
        time.sleep(0.2)
        seen = []
        for number in range(UPDATES):
            send_all(server, update(number))
            seen.append(json.loads(reader.recv(60))["now_ns"])
        stuck.settimeout(60)
        taken = 0
        with suppress(ConnectionResetError):    # which is an end as well; a connection that is open is a time-out here
            while data := stuck.recv(1 << 20):
                taken += len(data)

    assert seen == list(range(UPDATES))
    assert taken < UPDATES * len(BIG)


@pytest.mark.slow
def test_the_run_is_asked_while_a_page_is_open_and_told_when_none_is(server: ServerProcess) -> None:
    send_all(server, Scene({}))
    address = server.url.replace("http:", "ws:").replace("/?", "/live?")
    with connect(address):
        asked, told = heard(server, 2.5, lambda: server.send(update(1)))
    _, later = heard(server, 4.5, lambda: None)

    # every 0.1 s at the most; a busy machine asks less often
    assert 3 < asked <= 26
    assert (told, later) == ([1], [0])


def test_a_page_that_comes_and_goes_at_once_is_told_too(server: ServerProcess) -> None:
    send_all(server, Scene({}))
    for _ in range(2):
        with connect(server.url.replace("http:", "ws:").replace("/?", "/live?")) as page:
            page.recv(60)
        _, told = heard(server, 4.0, lambda: None)
        assert told == [1, 0]


def test_a_run_that_is_killed_within_a_message_is_told_to_pages(server: ServerProcess) -> None:
    send_all(server, Scene({}))
    with connect(server.url.replace("http:", "ws:").replace("/?", "/live?")) as page:
        assert json.loads(page.recv(60))["type"] == "scene"
        server.socket.send(b'{"type": "update", "now_n')
        server.socket.close()
        end = json.loads(page.recv(60))

    assert (end["type"], end["words"]) == ("end", "The run was broken off: its process has ended.")


def heard(server: ServerProcess, for_s: float, answer: object) -> tuple[int, list[int]]:
    """Return how often the server asked and the numbers of pages that it told, of `for_s`."""
    asked, told = 0, []
    until_s = time.monotonic() + for_s
    while time.monotonic() < until_s:
        for message in server.receive() or []:
            if isinstance(message, Ask):
                asked += 1
                if server.takes_more:
                    answer()        # type: ignore[operator]
            else:
                told.append(message.pages)      # type: ignore[union-attr]
        time.sleep(0.005)
    return asked, told


def test_a_run_that_ends_its_server_needs_no_page(server: ServerProcess) -> None:
    began_s = time.monotonic()
    server.close()

    assert time.monotonic() - began_s < 3.0
    assert server.receive() is None         # and may be closed again


def test_two_servers_do_not_share_a_port_or_a_token(server: ServerProcess) -> None:
    port = int(server.url.partition("1:")[2].partition("/")[0])
    other = ServerProcess(0, None)
    other.close()

    assert other.url.partition("token=")[2] != server.url.partition("token=")[2]
    with pytest.raises(NoView, match=f"--view {port}: cannot listen at 127.0.0.1:{port}"):
        ServerProcess(port, None)
