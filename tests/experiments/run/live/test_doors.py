"""A run whose view and faults are behind TLS doors: who comes in, who is refused, and what its events say of both."""

from __future__ import annotations

import socket
import ssl
import time
from collections.abc import Iterator
from contextlib import chdir, suppress
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
import trustme
from click.testing import CliRunner
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from experiments.run.runner import run
from experiments.scenario import ScenarioError, load
from marconet.command_line import app
from tests.experiments.run.live.view_bench import WITHIN_S, Client, Viewed, client_of, scenario_in, viewed
from tests.free_port import free_port
from tests.netem.gateways.certificate_folders import EXPIRED, make, put

DOORS = {"view": "view", "faults": "network.faults_port"}


class Doors:
    """A run, paused, with two doors, and the operator who watches it."""

    def __init__(self, folder: Path, shown: Viewed, client: Client, faults_port: int) -> None:
        self.folder, self.client, self.url = folder, client, shown.url
        self.address = {"view": f"127.0.0.1:{shown.port}", "faults": f"127.0.0.1:{faults_port}"}
        self.out = shown.out

    def certificate(self, name: str = "", folder: str = "ours") -> ssl.SSLContext:
        """The context of a client that is not ours."""
        context = ssl.create_default_context(cafile=str(self.folder / "ours" / "authority.crt"))
        if name:
            context.load_cert_chain(self.folder / folder / f"{name}.crt", self.folder / folder / f"{name}.key")
        return context

    def marconet(self, *words: str) -> tuple[int, str]:
        """Return the exit code and the output of a command of ours in the folder of the scenario."""
        with chdir(self.folder):
            done = CliRunner().invoke(app, words)
        return done.exit_code, done.output.strip()

    def told(self, kind: str, beginning: str) -> str:
        """Wait for an event of this kind whose detail begins so; return the rest."""
        until_s = time.monotonic() + WITHIN_S
        while time.monotonic() < until_s:
            for update in self.client.updates:
                for _, _, found, detail, _ in update["events"]:
                    if found == kind and detail.startswith(beginning):
                        return str(detail.removeprefix(beginning))
            self.client.until("update")
        raise AssertionError(f"no event {kind}: {beginning}")



@pytest.fixture(scope="module")
def doors(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Doors]:
    folder = tmp_path_factory.mktemp("doors")
    authority = make(folder / "ours", "operator", "second", "r1")
    for name, other, not_after in (("theirs", trustme.CA(), None), ("expired", authority, EXPIRED)):
        (folder / name).mkdir()
        put(folder / name, other, "operator", not_after=not_after)
    port = free_port()
    scenario = scenario_in(folder, 500.0, f'[network]\ntls = "ours"\noperators = ["operator", "second"]\n'
                                          f'faults_port = {port}\n')
    long_path = folder / ("a" * 60) / ("b" * 60)        # longer than the address of a Unix socket can be
    with viewed(scenario, long_path / "run", "--host", "inline") as shown:
        context = ssl.create_default_context(cafile=str(folder / "ours" / "authority.crt"))
        context.load_cert_chain(folder / "ours" / "operator.crt", folder / "ours" / "operator.key")
        with client_of(shown, context) as client:
            client.ask("pause")
            yield Doors(folder, shown, client, port)


def test_an_operator_gets_the_page_with_the_token_at_the_name_of_the_door_only(doors):
    context = doors.certificate("second")

    def get(url: str, **headers: str) -> tuple[int, str]:
        try:
            with urlopen(Request(url, headers=headers), context=context, timeout=WITHIN_S) as answer:
                return answer.status, answer.read().decode()
        except HTTPError as error:
            with error:
                return error.code, error.read().decode()

    assert doors.url.startswith("https://127.0.0.1:")
    status, page = get(doors.url)
    assert (status, page.startswith("<!doctype html>")) == (200, True)
    assert get(doors.url.partition("?")[0])[0] == 401
    assert get(doors.url, Host="evil.example")[0] == 403
    assert get(doors.url, Origin=f"http://{doors.address['view']}")[0] == 403
    assert get(doors.url, Origin=f"https://{doors.address['view']}")[0] == 200
    with pytest.raises(InvalidStatus, match="401"):
        connect(f"wss://{doors.address['view']}/live?token=none", ssl=doors.certificate("operator"))
    assert doors.told("door peer", "view speaks with 127.0.0.1:").endswith("whose certificate is operator's")


def test_an_operator_injects_a_fault_and_is_told_what_is_wrong_with_one(doors):
    address = f"tls://{doors.address['faults']}"
    ours = ["--certificates", "ours"]

    code, said = doors.marconet("fault", address, "kill", "on=b", "restart_after_s=0.5", *ours, "--as", "second")
    assert (code, said.partition(" at ")[0]) == (0, "injected-0: kill"), said
    code, said = doors.marconet("fault", address, "kill", "on=z", *ours)
    assert (code, said) == (2, 'fault: on="z": \'z\' names no node of the scenario: expected one of a, b, c')
    assert (doors.out / "injected.toml").read_text().count("[[faults]]") == 1


def test_who_is_no_operator_is_told_so_and_an_event_says_it(doors):
    address = f"tls://{doors.address['faults']}"
    why = "its certificate is r1's; this door is operator's or second's"

    code, said = doors.marconet("fault", address, "kill", "on=b", "--certificates", "ours", "--as", "r1")
    assert (code, said) == (2, f"{address}: refuses r1: {why}")
    code, said = doors.marconet("certificates", "check", doors.url, "--certificates", "ours", "--as", "r1")
    assert (code, said) == (2, f"{doors.url}: refuses r1: {why}")
    for door in DOORS:
        host, port = doors.address[door].split(":")
        with socket.create_connection((host, int(port)), WITHIN_S) as plain, \
                doors.certificate("r1").wrap_socket(plain, server_hostname=host) as stream:
            assert stream.recv(100) == b""
        assert why in doors.told("door peer refused", f"{DOORS[door]} refuses 127.0.0.1:")


@pytest.mark.parametrize("door", DOORS)
@pytest.mark.parametrize(("name", "folder", "why"), [
    ("", "", "it showed no certificate; "),
    ("operator", "theirs", "its certificate is from another authority; "),
    ("operator", "expired", "its certificate has expired; "),
])
def test_the_events_say_who_was_refused_and_why(doors, door, name, folder, why):
    host, port = doors.address[door].split(":")
    with socket.create_connection((host, int(port)), WITHIN_S) as plain:
        context = doors.certificate(name, folder)
        me = plain.getsockname()
        with suppress(ssl.SSLError, ConnectionError), context.wrap_socket(plain, server_hostname=host) as stream:
            stream.sendall(b"GET / HTTP/1.1\r\n\r\n")
            assert stream.recv(100) == b""

    assert doors.told("door peer refused", f"{DOORS[door]} refuses {me[0]}:{me[1]}: ").startswith(why)


@pytest.mark.parametrize(("words", "problem"), [
    (["fault", "tls://127.0.0.1:1", "kill", "on=b"],
     "tls://127.0.0.1:1: a door with TLS needs --certificates FOLDER, with the certificate and key of operator"),
    (["fault", "run", "kill", "--certificates", "ours"],
     "--certificates is for a run on another machine, as tls://192.168.1.5:7600"),
    (["fault", "tls://127.0.0.1", "kill", "--certificates", "ours"],
     "tls://127.0.0.1: expected HOST:PORT of a door, as tls://192.168.1.5:7600"),
    (["fault", "tls://127.0.0.1:1", "kill", "--certificates", "expired"], "expired/authority.crt: is missing"),
])
def test_what_is_wrong_with_a_fault_command_is_told(doors, words, problem):
    code, said = doors.marconet(*words)

    assert (code, said.partition(";")[0]) == (2, problem)


@pytest.mark.parametrize(("network", "problem"), [
    ('listen = "192.168.1.5"', 'network.listen="192.168.1.5": without TLS the emulator\'s own doors listen at '),
    ('listen = "base.local"\ntls = "ours"', 'network.listen="base.local": expected an IP address of this machine'),
    ("faults_port = 7600", "network.faults_port=7600: faults come through a door with TLS only"),
    ('faults_port = 65536\ntls = "ours"', "network.faults_port=65536: expected a port from 1 to 65535"),
    ('operators = []\ntls = "ours"', "network.operators=[]: expected the common names"),
    ('tls = "none"', "is no folder; make new ones with marconet certificates new"),
])
def test_check_refuses_doors_that_are_not_locked(doors, network, problem):
    path = doors.folder / "refused.toml"
    path.write_text((doors.folder / "faults.toml").read_text().partition("[network]")[0] + f"[network]\n{network}\n")

    with pytest.raises(ScenarioError) as caught:
        load(path)

    assert len(str(caught.value).splitlines()) == 1
    assert problem in str(caught.value)


def test_a_port_in_use_is_told_before_the_run(doors):
    port = doors.address["faults"].partition(":")[2]

    with pytest.raises(OSError) as caught:
        run(load(doors.folder / "faults.toml"), host="inline", out=doors.folder / "second", real_time=True)

    assert str(caught.value).startswith(
        f"network.faults_port: cannot listen on 127.0.0.1:{port}: Address already in use; end the ")


def test_a_run_that_takes_no_faults_says_that_its_door_for_them_is_closed(doors, tmp_path):
    short = doors.folder / "short.toml"
    short.write_text((doors.folder / "faults.toml").read_text().replace("length_s = 500.0", "length_s = 0.1"))

    warnings = run(load(short), host="inline", out=tmp_path / "run", report=False).summary.warnings

    assert [warning.partition(": is not open: ")[0] for warning in warnings] == [
        f"network.faults_port={doors.address['faults'].partition(':')[2]}"]
