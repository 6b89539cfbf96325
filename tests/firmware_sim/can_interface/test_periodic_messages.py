"""`bus.send_periodic` in virtual time."""

from __future__ import annotations

import time

import can
import pytest
from can.interfaces.socketcan.socketcan import dissect_can_frame

from firmware_sim.can_interface.bus import CyclicSendTask
from tests.firmware_sim.can_interface.can_bench import MS, a_bus


def sent_by(robots, main, **rest):
    offers, _ = robots.alone(main, **rest)
    return [(time_ns // MS, dissect_can_frame(data)[3]) for time_ns, data in offers]


def test_periodic_messages_go_out_in_turn_and_on_time(robots):
    def main():
        bus = a_bus()
        task = bus.send_periodic([can.Message(arbitration_id=1, data=[k]) for k in range(2)], 0.3)
        assert isinstance(task, CyclicSendTask)
        time.sleep(1.0)
        task.modify_data([can.Message(arbitration_id=1, data=[k + 7]) for k in range(2)])
        time.sleep(0.3)
        task.stop()
        time.sleep(0.5)
        task.start()
        time.sleep(0.1)

    assert sent_by(robots, main) == [(0, b"\0"), (300, b"\1"), (600, b"\0"), (900, b"\1"), (1200, b"\7"), (1800, b"\7")]


@pytest.mark.parametrize(("duration", "count"), [(1.0, 10), (0.95, 10), (0.1, 1), (None, 30)])
def test_periodic_messages_last_as_long_as_was_asked(robots, duration, count):
    """At 0, 0.1, ... before `duration`, so ceil(duration / period) of them."""
    def main():
        a_bus().send_periodic(can.Message(arbitration_id=1), 0.1, duration)
        time.sleep(2.95)

    assert [at for at, _ in sent_by(robots, main)] == [100 * k for k in range(count)]


def test_periodic_messages_follow_the_robots_oscillator_without_drift(robots):
    def main():
        a_bus().send_periodic(can.Message(arbitration_id=1), 1e-3)
        time.sleep(0.9995)

    offers, _ = robots.alone(main, drift_ppm=-50.0, tick_ns=7_000)

    reads_ns = [-(-k * MS // 7_000) * 7_000 for k in range(1000)]          # the first tick at or after k ms
    assert [time_ns for time_ns, _ in offers] == [-(-reading * 10**6 // (10**6 - 50)) for reading in reads_ns]


def test_periodic_messages_are_what_they_were_when_started(robots):
    def main():
        message = can.Message(arbitration_id=1, data=[1])
        a_bus().send_periodic(message, 0.1)
        message.data[0] = 2
        time.sleep(0.15)

    assert sent_by(robots, main) == [(0, b"\1"), (100, b"\1")]


def test_a_callback_may_change_each_periodic_message(robots):
    def count_up(message):
        message.data[0] += 1

    def main():
        a_bus().send_periodic(can.Message(arbitration_id=1, data=[0]), 0.1, modifier_callback=count_up)
        time.sleep(0.35)

    assert sent_by(robots, main) == [(0, b"\1"), (100, b"\2"), (200, b"\3"), (300, b"\4")]


def test_a_task_without_autostart_waits_for_its_start(robots):
    def main():
        task = a_bus().send_periodic(can.Message(arbitration_id=1, data=[1]), 0.1, autostart=False)
        time.sleep(0.2)
        task.start()
        time.sleep(0.05)

    assert sent_by(robots, main) == [(200, b"\1")]
