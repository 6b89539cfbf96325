"""Receiving in virtual time; filters as on `virtual`, CAN FD and error messages as on `socketcan`."""

from __future__ import annotations

import threading
import time

import can
import pytest
from can.interfaces.socketcan.socketcan import build_can_frame
from hypothesis import given
from hypothesis import strategies as st

from firmware_sim.blocking.calls_in_a_row import FIRST_ROW, LATER_ROW, RESOLUTION, SHORTEST_NS
from netem.wire.instants import NEVER_NS
from netem.wire.messages import Grant
from tests.firmware_sim.can_interface.can_bench import MS, a_bus, arrival, identifiers, messages, per_test

# --- receiving

def test_receiving_advances_the_nodes_clock_to_the_frame_or_the_time_out(robots):
    heard = []

    def main():
        bus = a_bus()
        for timeout in (0.01, 0.01, 0, None, 0.5):
            message = bus.recv(timeout)
            heard.append((message and message.arbitration_id, time.monotonic_ns()))

    robots.alone(main, [(15 * MS, arrival(1)), (15 * MS, arrival(2)), (40 * MS, arrival(3))])

    assert heard == [(None, 10 * MS), (1, 15 * MS), (2, 15 * MS), (3, 40 * MS), (None, 540 * MS)]


def test_a_frame_at_the_very_instant_of_the_time_out_is_received(robots):
    heard = []

    robots.alone(lambda: heard.append(a_bus().recv(0.01)), [(10 * MS, arrival(1))])

    assert heard[0].arbitration_id == 1


def test_timestamps_are_the_nodes_local_clock(robots):
    heard = []

    robots.alone(lambda: heard.append(a_bus().recv()), [(100 * MS, arrival(1))], offset_ns=2_000 * MS,
                 drift_ppm=1000.0, tick_ns=1_000)

    assert heard[0].timestamp == 2.1001


def test_what_comes_while_the_program_is_busy_waits_in_its_queue_and_keeps_its_time(robots):
    heard = []

    def main():
        with a_bus() as bus:
            time.sleep(0.1)
            while (message := bus.recv(0)) is not None:
                heard.append((message.arbitration_id, message.timestamp))

    robots.alone(main, [(k * MS, arrival(k)) for k in range(1, 6)])

    assert heard == [(k, k / 1000) for k in range(1, 6)]


def test_a_queue_with_room_for_few_drops_the_oldest_and_counts(robots):
    heard = []

    def main():
        bus = a_bus(rx_queue_size=2)
        time.sleep(0.1)
        heard.extend(bus.recv().arbitration_id for _ in range(2))

    _, counters = robots.alone(main, [(k * MS, arrival(k)) for k in range(1, 6)])

    assert heard == [4, 5]
    assert counters["can0.rx_dropped"] == 3


def test_what_came_before_the_bus_was_opened_is_gone(robots):
    heard = []

    def main():
        time.sleep(0.01)
        heard.append(a_bus().recv(0.1))

    robots.alone(main, [(5 * MS, arrival(1)), (15 * MS, arrival(2))])

    assert [message.arbitration_id for message in heard] == [2]


def test_iteration_goes_on_over_silence(robots):
    heard = []

    def main():
        for message in a_bus():
            heard.append(message.timestamp)

    robots.alone(main, [(1_000 * MS, arrival(1)), (8_500 * MS, arrival(1))])

    assert heard == [1.0, 8.5]


def test_the_promise_is_the_time_out_whatever_was_heard_before_or_is_filtered_out(robots):
    def main():
        bus = a_bus(can_filters=[{"can_id": 1, "can_mask": 0x7FF}])
        while True:
            bus.recv(0.5)

    node = robots.begin("robot", main)
    promises = []

    for deliveries in ([], [(100 * MS, 0, arrival(1))], [(200 * MS, 0, arrival(2))]):
        report = node.advance(Grant(1, 100 * MS * (len(promises) + 1), False, False, deliveries))
        promises.append((report.soft_ns, report.firm_ns))

    assert promises == [(500 * MS, 0), (600 * MS, 0), (600 * MS, 0)]


def test_a_time_out_beyond_all_runs_is_for_ever(robots):
    node = robots.begin("robot", lambda: a_bus().recv(1e15))

    report = node.advance(Grant(1, MS, False, False, []))

    assert (report.soft_ns, report.firm_ns) == (NEVER_NS, 0)


@pytest.mark.parametrize("timeout", [-0.1, float("nan")])
def test_a_time_out_that_is_none_is_refused(robots, timeout):
    with pytest.raises(ValueError, match="expected a finite number of seconds"):
        robots.alone(lambda: a_bus().recv(timeout))


def test_a_loop_that_polls_without_a_wait_receives_the_frame_soon_after_it_came(robots):
    """A poll costs 1 us, or a thousandth of the time that the row has taken."""
    heard = []

    def main():
        bus = a_bus()
        while (message := bus.recv(0)) is None:
            pass
        heard.append((message.arbitration_id, time.monotonic_ns()))

    robots.alone(main, [(5 * MS, arrival(1))])

    ((can_id, at_ns),) = heard
    assert can_id == 1
    assert 5 * MS <= at_ns <= 5 * MS + max(LATER_ROW, 5 * MS // RESOLUTION)


def test_sending_in_a_loop_lets_time_pass(robots):
    def main():
        with a_bus() as bus:
            while time.monotonic() < 0.001:
                bus.send(can.Message(arbitration_id=1, is_extended_id=False))

    offers, _ = robots.alone(main)

    assert len(offers) < FIRST_ROW + 1 * MS // SHORTEST_NS
    assert offers[-1][0] <= 1 * MS


# --- a bus that is shut down

def test_a_thread_that_waits_in_recv_learns_at_its_time_out_that_the_bus_was_shut_down(robots):
    learned = []

    def waits(bus, timeout):
        try:
            learned.append(bus.recv(timeout))
        except can.CanOperationError as error:
            learned.append((str(error), time.monotonic()))

    def main():
        bus = a_bus()
        for timeout in (0.125, 0.5):
            threading.Thread(target=waits, args=(bus, timeout)).start()
        time.sleep(0.25)
        bus.shutdown()

    robots.alone(main, [(300 * MS, arrival(1))])

    assert learned == [None, ("marconet channel 'can0' of node 'robot': the bus was shut down", 0.5)]


def test_what_waits_in_a_bus_that_was_shut_down_is_not_received_any_more(robots):
    def main():
        bus = a_bus()
        time.sleep(0.1)
        bus.shutdown()
        bus.recv(0)

    with pytest.raises(can.CanOperationError, match="the bus was shut down"):
        robots.alone(main, [(50 * MS, arrival(1))])


# --- filters, CAN FD, errors

filters = st.lists(st.fixed_dictionaries(
    {"can_id": identifiers(0x1FFFFFFF), "can_mask": st.sampled_from([0, 0x7FF, 0x700, 0xFF, 0x1FFFFFFF])},
    optional={"extended": st.booleans()}), max_size=3)


@per_test
@given(filters, st.lists(messages(fd=False), max_size=8))
def test_filters_let_through_what_they_do_on_virtual(robots, can_filters, sent):
    heard = []

    def main():
        bus = a_bus(can_filters=can_filters)
        time.sleep(1.0)
        while (message := bus.recv(0)) is not None:
            heard.append(message)

    robots.alone(main, [(MS, build_can_frame(message)) for message in sent])
    with (can.Bus(interface="virtual", channel="filters") as sender,
          can.Bus(interface="virtual", channel="filters", can_filters=can_filters) as receiver):
        for message in sent:
            sender.send(message)
        theirs = [message for _ in sent if (message := receiver.recv(0)) is not None]

    assert len(heard) == len(theirs)
    for ours, expected in zip(heard, theirs, strict=True):
        assert ours.equals(expected, timestamp_delta=None, check_channel=False)


def test_filters_may_change_under_way_and_who_is_filtered_out_wakes_nobody(robots):
    heard = []

    def main():
        bus = a_bus(can_filters=[{"can_id": 1, "can_mask": 0x7FF}])
        heard.append(bus.recv().arbitration_id)
        bus.set_filters([{"can_id": 2, "can_mask": 0x7FF}])
        heard.append(bus.recv().arbitration_id)
        bus.set_filters()
        heard.append(bus.recv().arbitration_id)

    robots.alone(main, [(k * MS, arrival(can_id)) for k, can_id in enumerate([2, 1, 1, 2, 9], start=1)])

    assert heard == [1, 2, 9]


def test_can_fd_frames_reach_a_bus_that_was_opened_for_them(robots):
    heard = {}

    def main():
        buses = {fd: a_bus(fd=fd) for fd in (False, True)}
        time.sleep(1.0)
        for fd, bus in buses.items():
            heard[fd] = [message.arbitration_id for _ in range(3) if (message := bus.recv(0)) is not None]
            heard[fd].append(bus.protocol)

    robots.alone(main, [(MS, arrival(1)), (MS, arrival(2, bytes(64), fd=True, bit_rate_switch=True))])

    assert heard == {False: [1, can.CanProtocol.CAN_20], True: [1, 2, can.CanProtocol.CAN_FD]}


def error_message(kind, about=0):
    return arrival(kind, bytes([0, about, 0, 0, 0, 0, 0, 0]), error=True)


def test_error_messages_tell_the_state_and_pass_the_filters(robots):
    """Classes and bits of linux/can/error.h."""
    seen = []

    def main():
        bus = a_bus(can_filters=[{"can_id": 0x7FF, "can_mask": 0x7FF}])
        seen.append((None, bus.state))
        for _ in range(5):
            message = bus.recv()
            assert message.is_error_frame
            seen.append((message.arbitration_id, bus.state))

    robots.alone(main, [(1 * MS, error_message(0x004, 0x10)), (2 * MS, error_message(0x004, 0x40)),
                        (3 * MS, error_message(0x004, 0x20)), (4 * MS, error_message(0x040)),
                        (5 * MS, error_message(0x100))])

    active, passive, off = can.BusState.ACTIVE, can.BusState.PASSIVE, can.BusState.ERROR
    assert seen == [(None, active), (4, passive), (4, active), (4, passive), (0x40, off), (0x100, active)]


def test_error_messages_can_be_left_out_and_the_state_is_known_all_the_same(robots):
    seen = []

    def main():
        bus = a_bus(ignore_rx_error_frames=True)
        seen.append(bus.recv(0.1))
        seen.append(bus.state)

    robots.alone(main, [(MS, error_message(0x040))])

    assert seen == [None, can.BusState.ERROR]


def test_the_state_is_not_the_programs_to_set(robots):
    def main():
        a_bus().state = can.BusState.PASSIVE

    with pytest.raises(NotImplementedError, match="follows from what happens on the bus"):
        robots.alone(main)
