"""python-can's `AsyncBufferedReader` and `Notifier(loop=...)` in an event loop in virtual time, as on `virtual`."""

from __future__ import annotations

import asyncio
import time

import can
import pytest

from tests.firmware_sim.can_interface.can_bench import MS, a_bus, arrival

COUNT = 20
TIMEOUT_S = 20.0            # of the same program on the wall's clock


def test_a_reader_gets_each_message_at_the_instant_of_its_arrival(robots):
    heard = []

    async def main():
        reader = can.AsyncBufferedReader()
        with a_bus() as bus, can.Notifier(bus, [reader], loop=asyncio.get_running_loop()):
            for _ in range(2):
                message = await reader.get_message()
                heard.append((message.arbitration_id, time.monotonic_ns()))
            with pytest.raises(TimeoutError):
                await asyncio.wait_for(reader.get_message(), 0.01)
            heard.append(time.monotonic_ns())
            async for message in reader:
                heard.append((message.arbitration_id, time.monotonic_ns()))
                break

    robots.alone(main, [(15 * MS, arrival(1)), (15 * MS, arrival(2)), (40 * MS, arrival(3))])

    assert heard == [(1, 15 * MS), (2, 15 * MS), 25 * MS, (3, 40 * MS)]


def test_a_coroutine_as_listener_is_a_task_of_the_loop_and_others_go_on_meanwhile(robots):
    heard, ticks = [], []

    async def listen(message):
        await asyncio.sleep(0.005)
        heard.append((message.arbitration_id, time.monotonic_ns()))

    async def main():
        with a_bus() as bus, can.Notifier(bus, [listen], loop=asyncio.get_running_loop()):
            for _ in range(4):
                await asyncio.sleep(0.01)
                ticks.append(time.monotonic_ns())

    robots.alone(main, [(12 * MS, arrival(1)), (13 * MS, arrival(2))])

    assert heard == [(1, 17 * MS), (2, 18 * MS)]
    assert ticks == [10 * MS, 20 * MS, 30 * MS, 40 * MS]


def test_one_notifier_of_a_loop_serves_two_buses(robots):
    heard = []

    async def main():
        reader = can.AsyncBufferedReader()
        loop = asyncio.get_running_loop()
        with a_bus(channel="can0") as one, a_bus(channel="can1") as other:
            notifier = can.Notifier([one, other], [reader], loop=loop)
            heard.append((await reader.get_message()).channel)
            await loop.run_in_executor(None, notifier.stop)     # which joins threads, so not in the loop itself
            heard.append(time.monotonic_ns())

    robots.alone(main, [(15 * MS, arrival(1))], ports=("can0", "can1"))

    assert heard == ["can0", 1015 * MS]         # a reader looks 1 s after its last message whether it is to stop


def test_the_end_of_the_run_ends_a_loop_that_waits_for_messages(robots):
    ends = []

    async def main():
        reader = can.AsyncBufferedReader()
        bus = a_bus()
        notifier = can.Notifier(bus, [reader], timeout=0.1, loop=asyncio.get_running_loop())
        try:
            await reader.get_message()
        finally:
            notifier.stop()
            bus.shutdown()
            ends.append(time.monotonic_ns() // (100 * MS))

    robots.alone(main, until_ns=1000 * MS)

    assert ends in ([10], [11])                 # at once, or when its reader has looked


async def ping(bus):
    """Send numbers, each after the answer to the one before; returns the answers."""
    reader = can.AsyncBufferedReader()
    notifier = can.Notifier(bus, [reader], timeout=0.05, loop=asyncio.get_running_loop())
    answers = []
    for k in range(COUNT):
        bus.send(can.Message(arbitration_id=0x100, data=[k], is_extended_id=False))
        answers.append(bytes((await asyncio.wait_for(reader.get_message(), TIMEOUT_S)).data))
    notifier.stop()
    return answers


async def pong(bus):
    """Answer each number with its double."""
    done = asyncio.Event()

    async def answer(message):
        await asyncio.sleep(0.001)
        bus.send(can.Message(arbitration_id=0x200, data=[2 * message.data[0]], is_extended_id=False))
        if message.data[0] == COUNT - 1:
            done.set()

    notifier = can.Notifier(bus, [answer], timeout=0.05, loop=asyncio.get_running_loop())
    await asyncio.wait_for(done.wait(), TIMEOUT_S)
    notifier.stop()


def test_two_loops_that_answer_each_other_do_as_on_pythons_virtual_bus(robots):
    found = []

    async def pings():
        with a_bus() as bus:
            found.extend(await ping(bus))

    async def pongs():
        with a_bus() as bus:
            await pong(bus)

    robots.run({"ping": pings, "pong": pongs})

    async def both():
        with can.Bus("loops", interface="virtual") as one, can.Bus("loops", interface="virtual") as other:
            return (await asyncio.gather(ping(one), pong(other)))[0]

    assert found == [bytes([2 * k]) for k in range(COUNT)]
    assert found == asyncio.run(both())
