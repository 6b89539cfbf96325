"""Zenoh programs in processes of their own at the gateways of two robots: what crosses, when, and what does not."""

from __future__ import annotations

import os
import signal
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from random import Random

import pytest

from netem.gateways import FLOODED, GARBAGE, GONE, SPEAKS
from netem.gateways.zenoh import ZenohGateway, ZenohSettings
from tests.netem.gateways.zenoh_between import PATIENCE_S, Between

LEASE_NS = 2_000_000_000         # no stall of a loaded machine takes a token for lost


@pytest.fixture
def between() -> Iterator[Callable[..., Between]]:
    made: list[Between] = []

    def make(**settings: object) -> Between:
        made.append(Between(**{"lease_ns": LEASE_NS, **settings}))       # type: ignore[arg-type]
        return made[-1]

    yield make
    for each in made:
        each.close()


def until(true: Callable[[], bool]) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not true():
        assert time.monotonic() < end_s
        time.sleep(0.002)


def test_a_put_arrives_with_all_that_it_carries_after_the_delay_of_the_medium(between):
    air = between()
    talker, listener = air.client("r1"), air.client("r2")
    listener.do("sub", "demo/**")
    talker.say("matching", "demo/a")
    talker.until("^matching True")
    air.delay_s = 0.2

    begun_s = time.time()
    talker.say("put", "demo/a", "hello")
    stamp = talker.until("^put").split()[1]
    heard = listener.until("^heard").split()

    assert heard[:-2] == ["heard", "demo/a", "hello", "text/plain;own", "attached", "INTERACTIVE_HIGH"]
    assert heard[-2].partition("/")[2] == stamp.partition("/")[2]           # the clock's identifier
    assert abs(int(heard[-2].partition("/")[0]) - int(stamp.partition("/")[0])) <= 2**32 / 1e9 + 1     # 1 ns
    assert float(heard[-1]) - begun_s >= 0.2
    talker.do("delete", "demo/a")
    assert listener.until("^heard").split()[1:3] == ["demo/a", "DELETED"]


def test_a_program_hears_its_own_robot_without_the_medium_and_nothing_twice(between):
    air = between()
    talker, beside, there = air.client("r1"), air.client("r1"), air.client("r2")
    for listener in (beside, there):
        listener.do("sub", "demo/**")
        listener.do("sub", "demo/a")            # a second subscriber, whose key is among those of the first
    talker.say("matching", "demo/a")
    talker.until("^matching True")
    until(lambda: air.gateways["r1"]._others.counts(*_mirror(air, "demo/a")) or
          air.gateways["r1"]._others.counts(*_mirror(air, "demo/**")))
    time.sleep(0.3)

    talker.do("pub", "demo/a", 20, 0.01)
    for listener in (beside, there):
        for _ in range(40):
            listener.until("^heard demo/a")
    air.cut = True
    talker.do("pub", "demo/a", 5, 0.01)
    for _ in range(10):
        beside.until("^heard demo/a")

    until(lambda: air.gateways["r1"].received >= 25)
    time.sleep(0.3)
    assert air.gateways["r1"].received == 25                # one each, whatever is declared
    assert air.gateways["r2"].counters()["messages sent"] == 20
    there.do("alive", "nobody")
    assert sum(line.startswith("heard") for line in there.lines) == 40


def _mirror(air: Between, key: str) -> tuple[object, str]:
    from netem.gateways.zenoh_endpoint import Declared
    from netem.wire.zenoh_messages import Entity
    return Declared(Entity.SUBSCRIBER, key), "demo/a"


def test_liveliness_is_lost_under_a_partition_and_comes_back(between):
    air = between()
    robot, watcher = air.client("r1"), air.client("r2")
    watcher.do("liveliness", "fleet/**")
    robot.do("token", "fleet/r1")
    watcher.until("^alive fleet/r1")

    def sees_it() -> bool:          # the library's answer may be empty within some ms of the first declaration
        watcher.do("alive", "**")
        return "alive now fleet/r1" in watcher.lines

    until(sees_it)

    air.cut = True
    cut_s = time.monotonic()
    watcher.until("^dropped fleet/r1")
    silent_s = time.monotonic() - cut_s
    air.cut = False
    watcher.until("^alive fleet/r1")
    robot.process.kill()
    watcher.until("^dropped fleet/r1")

    # repeated every lease / 4 +- 10 %, so it ends between 0.725 leases and one lease after the cut
    assert silent_s >= 0.7 * LEASE_NS / 1e9
    until(lambda: len(air.events(GONE)) == 1)
    assert len(air.events(SPEAKS)) == 2


def test_a_query_is_answered_by_the_other_robot_and_ends_with_its_final(between):
    air = between()
    asker, one, two = air.client("r1"), air.client("r2"), air.client("r2")
    one.do("queryable", "state/a", "one")
    two.do("queryable", "state/b", "two", "complete")
    until(lambda: len(air.gateways["r1"]._others._confirmed) == 2)

    assert sorted(asker.ask("state/*?x=1", 30))[1:] == ["reply state/a one(x=1,asked)", "reply state/b two(x=1,asked)"]
    assert asker.ask("state/b", 30, "ALL_COMPLETE")[0] == "reply state/b two(,asked)"
    assert len(asker.ask("state/a", 30, "ALL_COMPLETE")) == 1          # got nothing, at once
    assert len(asker.ask("nobody/here", 30)) == 1


def test_a_query_under_a_partition_ends_with_the_time_out_of_its_program(between):
    air = between(lease_ns=60_000_000_000)
    asker, other = air.client("r1"), air.client("r2")
    other.do("queryable", "state/a", "one")
    until(lambda: len(air.gateways["r1"]._others._confirmed) == 1)
    air.cut = True

    found = asker.ask("state/a", 0.5)

    assert found[0] == "error Timeout"
    assert float(found[1].split()[1]) >= 0.45


def test_a_program_that_comes_again_is_heard_again(between):
    air = between()
    listener = air.client("r2")
    listener.do("sub", "demo/**")
    for _ in range(2):
        talker = air.client("r1")
        talker.say("matching", "demo/a")
        talker.until("^matching True")
        talker.do("put", "demo/a", "hello")
        listener.until("^heard demo/a hello")
        talker.process.send_signal(signal.SIGKILL)
        talker.process.wait()

    until(lambda: len(air.events(GONE)) == 2)


def test_peers_of_one_robot_hear_each_other_and_the_other_robot(between):
    air = between()
    talker, beside, there = air.client("r1", "peer"), air.client("r1", "peer"), air.client("r2", "peer")
    for listener in (beside, there):
        listener.do("sub", "demo/**")
    until(lambda: len(air.gateways["r1"]._others._confirmed) == 1)
    time.sleep(0.5)                         # the peers find each other by gossip

    talker.do("put", "demo/a", "hello")

    beside.until("^heard demo/a hello")
    there.until("^heard demo/a hello")


def test_only_the_keys_of_the_gateway_cross(between):
    air = between(keys=("fleet/**",))
    talker, listener = air.client("r1"), air.client("r2")
    listener.do("sub", "**")
    until(lambda: len(air.gateways["r1"]._others._confirmed) == 1)

    talker.do("put", "own/a", "hello")
    talker.do("put", "fleet/a", "hello")
    listener.until("^heard fleet/a")

    assert not any("own/a" in line for line in listener.lines)


def test_a_long_message_crosses_in_fragments(between):
    air = between(longest_bytes=100)
    talker, listener = air.client("r1"), air.client("r2")
    listener.do("sub", "demo/**")
    talker.say("matching", "demo/a")
    talker.until("^matching True")
    before = air.carried

    talker.do("pub", "demo/a", 1, 0, 5000)
    heard = listener.until("^heard")

    assert len(heard) > 5000
    assert air.carried - before > 5000 / 100


def test_a_flood_is_bounded_counted_and_told_once(between):
    air = between(most_per_s=100)
    talker, listener = air.client("r1"), air.client("r2")
    listener.do("sub", "demo/**")
    talker.say("matching", "demo/a")
    talker.until("^matching True")

    talker.do("pub", "demo/a", 3000, 0)
    gateway = air.gateways["r1"]
    until(lambda: gateway.received + gateway.flooded + gateway._endpoint.overflowed == 3000)

    assert gateway.received < 3000
    assert len(air.events(FLOODED)) == 1
    assert "raise most_per_s" in air.events(FLOODED)[0]


def test_frames_that_are_none_of_zenohs_are_counted_and_told_once(between):
    air = between()
    gateway, rng = air.gateways["r1"], Random(1)

    for _ in range(1000):
        gateway.send(rng.randbytes(rng.randrange(40)))

    assert gateway.counters()["malformed frames"] > 900
    assert len(air.events(GARBAGE)) == 1


@pytest.mark.parametrize("count", [500, pytest.param(100_000, marks=pytest.mark.slow)])
def test_garbage_on_the_port_changes_nothing(between, count):
    air = between()
    talker, listener = air.client("r1"), air.client("r2")
    listener.do("sub", "demo/**")
    address = air.gateways["r1"].locators()[0].removeprefix("tcp/").split(":")
    rng = Random(2)

    for _ in range(count):
        with closing(socket.create_connection((address[0], int(address[1])), timeout=PATIENCE_S)) as stranger:
            head = rng.choice((b"", rng.randbytes(2), rng.randrange(1, 60).to_bytes(2, "little")))
            stranger.sendall(head + rng.randbytes(rng.randrange(60)))
    talker.say("matching", "demo/a")
    talker.until("^matching True")
    talker.do("put", "demo/a", "hello")

    listener.until("^heard demo/a hello")
    assert air.gateways["r1"].received == 1


def test_a_port_in_use_is_told_with_a_remedy():
    with closing(socket.create_server(("127.0.0.1", 0))) as taken:
        listen = f"tcp/127.0.0.1:{taken.getsockname()[1]}"

        with pytest.raises(OSError, match=rf"gateways\.r1: cannot listen on {listen}: .*in use.*another port"):
            ZenohGateway("r1", "air", ZenohSettings(listen=listen))


def test_a_program_that_reads_nothing_does_not_hold_up_the_gateway(between):
    air = between()
    talker, stopped, listener = air.client("r1"), air.client("r2"), air.client("r2")
    for each in (stopped, listener):
        each.do("sub", "demo/**")
    talker.say("matching", "demo/a")
    talker.until("^matching True")
    os.kill(stopped.process.pid, signal.SIGSTOP)
    longest_s = 0.0
    send = air.gateways["r2"].send

    def timed(frame: bytes) -> None:
        nonlocal longest_s
        begun_s = time.monotonic()
        send(frame)
        longest_s = max(longest_s, time.monotonic() - begun_s)

    air.gateways["r2"].send = timed             # type: ignore[method-assign]
    talker.do("pub", "demo/a", 300, 0.002, 60_000)
    os.kill(stopped.process.pid, signal.SIGCONT)

    for _ in range(300):
        listener.until("^heard demo/a")
    assert longest_s < 0.5                      # a put that waits takes up to 1 s


def test_wrong_settings_are_refused_with_the_rule():
    for settings, rule in (({"listen": "127.0.0.1:7447"}, "expected an endpoint, an IP address"),
                           ({"listen": "tcp/0.0.0.0:7447"}, "beyond the loopback"),
                           ({"keys": ("a//b",)}, "keys=a//b: no key expression: empty chunks"),
                           ({"keys": ()}, "nothing would be carried"),
                           ({"lease_ns": 5}, "lease_ns=5: expected at least")):
        with pytest.raises(ValueError, match=rule):
            ZenohSettings(**settings)           # type: ignore[arg-type]
