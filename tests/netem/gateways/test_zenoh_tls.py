"""Real Zenoh programs at gateways with TLS doors: who has the robot's certificate is the robot, and nobody else."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import trustme

from netem.gateways import GONE, REFUSED, SPEAKS
from netem.gateways.certificate_authority import make_certificates
from netem.gateways.zenoh import ZenohSettings
from tests.netem.gateways.certificate_folders import EXPIRED, make, put, zenoh_settings
from tests.netem.gateways.zenoh_between import CLIENT, PATIENCE_S, Between, Client


class Folders:
    def __init__(self, here: Path) -> None:
        self.ours, self.theirs, self.late = here / "ours", here / "theirs", here / "late"
        make_certificates(self.ours, ["r1", "r2"])
        authority = trustme.CA.from_pem(*((self.ours / f"authority.{end}").read_bytes() for end in ("crt", "key")))
        make(self.theirs, "r1")
        make(self.late, authority=authority)
        put(self.late, authority, "r1", not_after=EXPIRED)


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> Folders:
    return Folders(tmp_path_factory.mktemp("certificates"))


@pytest.fixture(scope="module")
def air(folders: Folders) -> Iterator[Between]:
    made = Between(tls=folders.ours)
    yield made
    made.close()


@pytest.fixture
def client(air: Between, folders: Folders) -> Iterator[Callable[..., Client]]:
    made: list[Client] = []

    def make_client(robot: str, folder: Path, name: str) -> Client:
        made.append(air.client(robot, "client", json.dumps(zenoh_settings(folders.ours, name, folder))))
        return made[-1]

    yield make_client
    for each in made:
        each.close()


def until(true: Callable[[], object]) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not true():
        assert time.monotonic() < end_s
        time.sleep(0.002)


def test_a_put_of_the_right_certificate_crosses_the_medium_to_the_other_robot(air, client, folders):
    came = len(air.events(SPEAKS))
    talker, listener = client("r1", folders.ours, "r1"), client("r2", folders.ours, "r2")
    listener.do("sub", "demo/**")
    talker.say("matching", "demo/a")
    talker.until("^matching True")

    talker.say("put", "demo/a", "hello")

    assert listener.until("^heard").split()[1:3] == ["demo/a", "hello"]
    assert len(air.events(SPEAKS)) == came + 2
    assert any("gateways.r1 speaks with 127.0.0.1:" in text and text.endswith("whose certificate is r1's")
               for text in air.events(SPEAKS))
    gone = len(air.events(GONE))
    talker.say("close")
    until(lambda: len(air.events(GONE)) > gone)


@pytest.mark.parametrize(("of", "name", "why"), [
    (None, "", "it showed no certificate; "),
    ("theirs", "r1", "its certificate is from another authority; "),
    ("late", "r1", "its certificate has expired; "),
    ("ours", "r2", "its certificate is r2's; this door is r1's"),
], ids=["none", "another authority's", "expired", "another robot's"])
def test_a_program_without_the_robots_certificate_is_refused_with_an_event_that_says_why(air, folders, of, name, why):
    refused, told = air.gateways["r1"].counters()["connections refused"], len(air.events(REFUSED))
    connected = air.gateways["r1"].counters()["connections"]
    settings = zenoh_settings(folders.ours, name, of and getattr(folders, of)) | {
        "connect/timeout_ms": 500, "connect/exit_on_failure": True}

    done = subprocess.run([sys.executable, str(CLIENT), air.gateways["r1"].locators()[0], "client",
                           json.dumps(settings)], stdin=subprocess.DEVNULL, capture_output=True, text=True,
                          timeout=PATIENCE_S, check=False)

    assert "open" not in done.stdout
    assert done.returncode != 0
    until(lambda: air.events(REFUSED)[told:])
    assert why in air.events(REFUSED)[told]
    assert "gateways.r1 refuses 127.0.0.1:" in air.events(REFUSED)[told]
    assert air.gateways["r1"].counters()["connections refused"] > refused
    assert air.gateways["r1"].counters()["connections"] == connected


def test_another_robot_cannot_publish_as_this_one(air, client, folders):
    """A session of r2 in Zenoh's peer mode, which goes on trying, puts all the while; nothing arrives as r1's."""
    watcher = client("r2", folders.ours, "r2")
    watcher.do("sub", "demo/**")
    received, refused = air.gateways["r1"].received, air.gateways["r1"].counters()["connections refused"]
    intruder = air.client("r1", "peer", json.dumps(zenoh_settings(folders.ours, "r2") | {
        "connect/timeout_ms": 0, "connect/exit_on_failure": False, "listen/endpoints": []}))

    intruder.do("pub", "demo/a", 20, 0.02)
    until(lambda: air.gateways["r1"].counters()["connections refused"] > refused)
    owner = client("r1", folders.ours, "r1")
    owner.say("matching", "demo/a")
    owner.until("^matching True")
    owner.say("put", "demo/a", "mine")

    assert watcher.until("^heard").split()[1:3] == ["demo/a", "mine"]
    assert air.gateways["r1"].received == received + 1


@pytest.mark.parametrize(("settings", "rule"), [
    ({"listen": "tcp/192.168.1.5:7447"}, "write listen = \"tls/192.168.1.5:7447\" and [network] tls"),
    ({"listen": "tls/robot:7447"}, "expected an endpoint"),
    ({"listen": "udp/127.0.0.1:7447"}, "expected an endpoint"),
    ({"listen": "tcp/127.0.0.1:7447", "only_from": ("10.0.0.0/8",)}, "is about a door with TLS"),
    ({"listen": "tls/127.0.0.1:7447", "only_from": ("ten",)}, "expected an IP address or a network"),
])
def test_an_endpoint_that_would_be_open_or_is_none_is_refused(settings, rule):
    with pytest.raises(ValueError, match=r"listen=|only_from=") as caught:
        ZenohSettings(**settings)

    assert rule in str(caught.value)


def test_beyond_the_loopback_tls_needs_no_list_of_addresses():
    door = ZenohSettings(listen="tls/192.168.1.5:7447", only_from=("192.168.1.0/24",)).door("r1")

    assert ZenohSettings(listen="tls/[::]:7447").door("r1") is not None
    assert door is not None
    assert (door.listen, door.admits, door.only_from) == ("192.168.1.5:7447", ("r1",), ("192.168.1.0/24",))
    assert ZenohSettings().door("r1") is None
