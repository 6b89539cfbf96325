"""Several buses of one program, python-can's own helpers, and others on the same CAN bus."""

from __future__ import annotations

import queue
import threading
import time

import can
import pytest

from netem.wire.errors import NodeFailure
from tests.firmware_sim.can_interface.can_bench import MS, a_bus, arrival

# --- several buses, own messages, closing

def test_two_buses_of_one_program_hear_the_same_with_filters_of_their_own(robots):
    heard = {}

    def main():
        every, ones = a_bus(), a_bus(can_filters=[{"can_id": 1, "can_mask": 0x7FF}])
        time.sleep(0.1)
        heard["every"] = [every.recv(0).arbitration_id for _ in range(3)]
        heard["ones"] = [ones.recv(0).arbitration_id for _ in range(2)] + [ones.recv(0)]

    robots.alone(main, [(MS, arrival(can_id)) for can_id in (1, 2, 1)])

    assert heard == {"every": [1, 2, 1], "ones": [1, 1, None]}


def test_own_messages_come_back_when_they_got_through(robots):
    """500 kbit/s: the sender is told with the last bit of the frame, one bit (2 us) after the others have it."""
    heard = {}

    def sender():
        own, other = a_bus(receive_own_messages=True), a_bus()
        own.send(can.Message(arbitration_id=5, is_extended_id=False))
        other.send(can.Message(arbitration_id=6, is_extended_id=False))
        for name, bus in (("own", own), ("other", other)):
            heard[name] = []
            while (message := bus.recv(0.1)) is not None:
                heard[name].append((message.arbitration_id, message.is_rx, message.timestamp))

    def listener():
        heard["listener"] = [(message.arbitration_id, message.is_rx, message.timestamp)
                             for message in (a_bus().recv(), ) if message]

    robots.run({"a": sender, "b": listener}, own_frames_to=("a",))

    (first, is_rx, heard_s), = heard["listener"]
    assert (first, is_rx) == (5, True)
    assert [entry[:2] for entry in heard["own"]] == [(5, False), (6, False)]
    assert [entry[:2] for entry in heard["other"]] == [(5, False)]
    assert heard["own"][0][2] == heard["other"][0][2] == pytest.approx(heard_s + 2e-6, abs=1e-9)


def test_own_messages_need_the_scenarios_word(robots):
    with pytest.raises(can.CanInitializationError, match=r'own_frames_to = \["robot"\] under \[media.can0\]'):
        robots.alone(lambda: a_bus(receive_own_messages=True))


@pytest.mark.parametrize("act", [
    lambda bus: bus.recv(0),
    lambda bus: bus.send(can.Message()),
    lambda bus: bus.send_periodic(can.Message(), 0.1),
])
def test_a_bus_that_was_shut_down_is_of_no_use(robots, act):
    def main():
        with a_bus() as bus:
            bus.send_periodic(can.Message(arbitration_id=1), 0.1)
        bus.shutdown()
        time.sleep(1.0)
        act(bus)

    with pytest.raises(can.CanOperationError, match="the bus was shut down"):
        robots.alone(main)


def test_nothing_is_sent_periodically_after_the_shutdown(robots):
    def main():
        with a_bus() as bus:
            bus.send_periodic(can.Message(arbitration_id=1), 0.1)
            time.sleep(0.25)
        time.sleep(1.0)

    offers, _ = robots.alone(main)

    assert [time_ns for time_ns, _ in offers] == [0, 100 * MS, 200 * MS]


def test_a_bus_that_was_shut_down_collects_nothing_any_more(robots):
    def main():
        a_bus(rx_queue_size=1).shutdown()
        time.sleep(1.0)

    _, counters = robots.alone(main, [(k * MS, arrival(k)) for k in range(1, 6)])

    assert not any(counters.values())


def test_a_daemon_that_listens_ends_with_the_program(robots):
    heard = []

    def main():
        with a_bus() as bus:
            threading.Thread(target=lambda: heard.extend(bus), daemon=True).start()
            time.sleep(0.1)

    def silent():
        bus = a_bus()
        threading.Thread(target=lambda: [bus.send(message) for message in bus], daemon=True).start()
        time.sleep(0.1)

    robots.alone(main, [(150 * MS, arrival(1))])
    offers, _ = robots.alone(silent, [(50 * MS, arrival(1)), (150 * MS, arrival(2))])

    assert heard == []
    assert [time_ns for time_ns, _ in offers] == [50 * MS]


def test_a_thread_that_the_node_does_not_know_is_refused(robots):
    from _thread import start_new_thread

    refused = queue.Queue()             # of this thread: real

    def foreign(bus):
        try:
            bus.send(can.Message())
        except can.CanOperationError as error:
            refused.put(str(error))

    robots.alone(lambda: start_new_thread(foreign, (a_bus(),)))

    assert "called in a thread that the node does not know" in refused.get(timeout=10)


# --- python-can's own helpers

def test_a_notifier_calls_its_listeners_in_virtual_time(robots):
    heard = []

    def main():
        def listen(message):
            heard.append((message.arbitration_id, time.monotonic()))

        with a_bus() as bus, can.Notifier(bus, [listen]):
            time.sleep(0.6)
            heard.append(("woke", time.monotonic()))
        heard.append(("stopped", time.monotonic()))

    robots.alone(main, [(500 * MS, arrival(1)), (700 * MS, arrival(2))])

    # it is told to stop at 0.6 s, while it waits for one more message, at most 1 s
    assert heard == [(1, 0.5), ("woke", 0.6), (2, 0.7), ("stopped", 0.7)]


def test_an_exception_in_a_listener_ends_the_node(robots):
    def fail(message):
        raise LookupError("in the listener")

    def main():
        bus = a_bus()
        can.Notifier(bus, [fail])
        time.sleep(5.0)

    with pytest.raises(LookupError, match="in the listener"):
        robots.alone(main, [(MS, arrival(1))])


def test_logs_of_python_can_are_written_to_the_end_of_the_run(robots, tmp_path):
    path = tmp_path / "robot.asc"

    def main():
        with a_bus() as bus, can.Logger(path) as log:
            for message in bus:
                log(message)

    robots.alone(main, [(k * 1000 * MS, arrival(k, bytes(k))) for k in (1, 2, 3)])

    assert [(message.arbitration_id, bytes(message.data)) for message in can.LogReader(path)] == \
        [(k, bytes(k)) for k in (1, 2, 3)]


# --- on a CAN bus with others

def test_lower_identifiers_go_first_and_every_frame_arrives_in_that_order_everywhere(robots):
    heard = {"a": [], "b": [], "c": []}

    def speaker(name, can_ids):
        def main():
            with a_bus() as bus:
                for can_id in can_ids:
                    bus.send(can.Message(arbitration_id=can_id, is_extended_id=False))
                while (message := bus.recv(0.1)) is not None:
                    heard[name].append(message.arbitration_id)
        return main

    robots.run({name: speaker(name, ids) for name, ids in (("a", [9, 3]), ("b", [5, 1]), ("c", []))})

    assert heard == {"a": [1, 5], "b": [3, 9], "c": [1, 3, 5, 9]}


def test_a_threaded_program_and_its_partner_find_each_other_at_the_same_times_in_every_run(robots):
    def once():
        traces = {"robot": [], "drive": []}

        def robot():
            with a_bus() as bus:
                done = threading.Event()

                def listen(message):
                    traces["robot"].append((message.arbitration_id, message.timestamp))
                    if len(traces["robot"]) == 20:
                        done.set()

                bus.send_periodic(can.Message(arbitration_id=0x10, data=[1, 2, 3], is_extended_id=False), 0.01)
                notifier = can.Notifier(bus, [listen])
                done.wait(0.5)
                notifier.stop()

        def drive():
            with a_bus() as bus:
                for message in bus:
                    traces["drive"].append((message.arbitration_id, message.timestamp))
                    time.sleep(0.003)
                    bus.send(can.Message(arbitration_id=0x20, data=message.data, is_extended_id=False))

        conductor = robots.run({"robot": robot, "drive": drive})
        return traces, conductor.windows

    first, second = once(), once()

    assert first == second
    assert len(first[0]["robot"]) >= 20


def test_the_failure_of_a_program_names_its_node(robots):
    def main():
        a_bus().recv(0.25)
        raise LookupError("no such map")

    with pytest.raises(NodeFailure, match=r"node a: its program failed at 250000000 ns: LookupError: no such map"):
        robots.run({"a": main, "b": lambda: None})
