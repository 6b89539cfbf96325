"""python-can's interface `marconet`: found by its plugins, and its bytes are those of `socketcan`."""

from __future__ import annotations

from importlib.metadata import entry_points

import can
import pytest
from can.interfaces.socketcan.socketcan import build_can_frame, dissect_can_frame
from hypothesis import given
from hypothesis import strategies as st

from firmware_sim.can_interface.bus import MarconetBus
from tests.firmware_sim.can_interface.can_bench import MS, a_bus, messages, per_test

# --- being found

def test_python_can_finds_it_by_its_own_plugins():
    (plugin,) = [found for found in entry_points(group="can.interface") if found.name == "marconet"]

    assert plugin.load() is MarconetBus
    assert can.interfaces.BACKENDS["marconet"] == (plugin.module, plugin.attr)
    assert "marconet" in can.VALID_INTERFACES


def test_outside_of_a_run_it_says_how_to_get_into_one():
    with pytest.raises(can.CanInitializationError, match=r"only inside a run.*marconet run my_scenario\.toml"):
        can.Bus(interface="marconet", channel="can0")

    assert can.detect_available_configs("marconet") == []


def test_it_detects_the_can_buses_of_its_node(robots):
    found = []

    robots.alone(lambda: found.append(can.detect_available_configs("marconet")), ports=["can0", "radio", "can1"])

    assert found == [[{"interface": "marconet", "channel": channel} for channel in ("can0", "can1")]]


def test_the_only_can_bus_needs_no_name(robots):
    found = []

    robots.alone(lambda: found.append(can.Bus(interface="marconet").channel_info), ports=["can0", "radio"])

    assert found == ["marconet channel 'can0' of node 'robot'"]


@pytest.mark.parametrize(("channel", "ports", "complaint"), [
    ("can7", ["can0"], r"node robot: channel='can7' is no CAN bus of this node; it has \"can0\""),
    ("radio", ["radio"], "channel='radio' is no CAN bus of this node; it has none"),
    (None, ["can0", "can1"], 'it has "can0", "can1"; name one of them'),
])
def test_a_channel_that_is_not_there_is_named_with_those_that_are(robots, channel, ports, complaint):
    with pytest.raises(can.CanInitializationError, match=complaint):
        robots.alone(lambda: can.Bus(interface="marconet", channel=channel), ports=ports)


# --- bytes

@per_test
@given(messages())
def test_what_is_sent_is_what_socketcan_would_send(robots, message):
    offers, _ = robots.alone(lambda: a_bus(fd=True).send(message))

    ((time_ns, data),) = offers
    theirs = build_can_frame(message)
    flags_kept = data[:5] + (data[5:6] if message.is_fd else theirs[5:6])
    assert time_ns == 0
    assert flags_kept + data[8:] == theirs[:6] + theirs[8:]
    assert dissect_can_frame(data) == dissect_can_frame(theirs)


@per_test
@given(messages())
def test_what_arrives_is_the_message_that_socketcan_would_have_sent(robots, message):
    heard = []

    robots.alone(lambda: heard.append(a_bus(fd=True).recv()), [(5 * MS, build_can_frame(message))])

    message.timestamp = 0.005
    message.channel = "can0"
    assert heard[0].equals(message, timestamp_delta=None)
    assert heard[0].timestamp == 0.005


@per_test
@given(st.binary(max_size=80))
def test_bytes_that_are_no_frame_are_counted_and_nothing_else(robots, data):
    heard = []

    def main():
        bus = a_bus(fd=True)
        while (message := bus.recv(1.0)) is not None:
            heard.append(message)

    _, counters = robots.alone(main, [(MS, data)])

    assert len(heard) + counters.get("can0.malformed", 0) == 1


@pytest.mark.parametrize(("message", "fd", "complaint"), [
    (can.Message(arbitration_id=1, data=bytes(12), is_fd=True), False, "opened without fd=True"),
    (can.Message(arbitration_id=1, data=bytes(9)), True, "data of 9 bytes"),
    (can.Message(arbitration_id=1, data=bytes(65), is_fd=True), True, "data of 65 bytes"),
    (can.Message(arbitration_id=0x800, is_extended_id=False), True, "0x800.*expected 11 bits"),
    (can.Message(arbitration_id=1 << 29), True, "expected 29 bits"),
    (can.Message(arbitration_id=1, data=bytes(8), dlc=3), True, "dlc=3"),
])
def test_what_no_frame_can_be_is_refused_when_it_is_sent(robots, message, fd, complaint):
    with pytest.raises(can.CanOperationError, match=complaint):
        robots.alone(lambda: a_bus(fd=fd).send(message))
