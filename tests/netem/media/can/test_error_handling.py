"""Error frames, their consequences and how a bus gets out of them; lengths and counters: test_against_bit_level.py."""

from itertools import pairwise
from math import sqrt
from random import Random

import pytest

from netem.core.fate import Fate
from netem.media.can.bit_errors import BitErrorSettings, ScriptedBit
from netem.media.can.error_message import state_after, state_message
from netem.media.can.fault_confinement import FaultConfinement, State
from netem.media.can.frame import CanFrame, pack, unpack
from tests.netem.media.can.bit_by_bit import encode
from tests.netem.media.can.can_bench import BIT, MS, CanBench

FRAME = CanFrame(0x123, b"12345678")
BITS = len(encode(FRAME))


def scripted(*hits: tuple[int, int], **more: object) -> BitErrorSettings:
    return BitErrorSettings(scripted=tuple(ScriptedBit(*hit) for hit in hits), **more)  # type: ignore[arg-type]


def test_a_frame_that_was_hit_is_sent_again_and_arrives_once() -> None:
    bench = CanBench(bit_errors=scripted((0, 30))).run((0, "a", FRAME), (400 * BIT, "b", FRAME))

    assert [name for _, name, _ in bench.arrivals] == ["b", "c", "a", "c"]
    assert bench.fates("a", "b") == [Fate.DELIVERED]
    assert bench.bus.counters()["can"] | {"busy_us": 0} == {"transmissions": 3, "error_frames": 1, "collisions": 0,
                                                            "busy_us": 0}
    assert bench.kinds() == ["CAN error frame"]


def test_a_hit_last_bit_of_the_end_of_frame_is_a_frame_received_twice() -> None:
    bench = CanBench(bit_errors=scripted((0, -1)), own_frames_to=("a",)).run((0, "a", FRAME))

    second_ns = (BITS + 6 + 8 + 3 + BITS) * BIT
    assert bench.arrivals == [(BITS * BIT - BIT, "b", pack(FRAME)), (BITS * BIT - BIT, "c", pack(FRAME)),
                              (second_ns - BIT, "b", pack(FRAME)), (second_ns - BIT, "c", pack(FRAME)),
                              (second_ns, "a", pack(FRAME))]
    assert [(row["receiver"], row["copy"]) for row in bench.rows()] == [("b", 0), ("c", 0), ("b", 1), ("c", 1),
                                                                        ("a", 0)]


def test_a_frame_of_higher_priority_goes_before_the_repetition() -> None:
    bench = CanBench(bit_errors=scripted((0, 30))).run((0, "a", FRAME), (5, "b", CanFrame(0x100)))

    assert [unpack(data).can_id for _, name, data in bench.arrivals if name == "c"] == [0x100, 0x123]


def test_an_error_passive_sender_leaves_the_bus_to_others_for_eight_bits() -> None:
    """16 hits take TEC to 128: of those who wait then, the one of lower priority starts first. A receiver of the frame
    before has nothing to wait for, and TEC 127 is error-active again."""
    bench = CanBench(bit_errors=scripted(*((attempt, 40) for attempt in range(16))))

    bench.run((0, "a", FRAME), (1, "a", FRAME), (2, "b", CanFrame(0x700)))

    rows = sorted(bench.rows(receiver="c"), key=lambda row: row["on_air_ns"])
    assert [row["sender"] for row in rows] == ["b", "a", "a"]
    assert [after["on_air_ns"] - before["end_ns"] for before, after in pairwise(rows)] == [3 * BIT] * 2
    assert bench.bus.error_counters("a") == (126, 0, State.ERROR_ACTIVE)
    assert [kind for kind in bench.kinds("a") if kind.startswith("error-")] == ["error-passive", "error-active"]


def test_an_error_passive_sender_alone_waits_for_eleven_bits() -> None:
    bench = CanBench(bit_errors=scripted(*((attempt, 40) for attempt in range(18))))

    bench.run((0, "a", FRAME), (1, "a", FRAME))

    first, second = bench.rows("a", "c")
    assert bench.bus.error_counters("a") == (144 - 2, 0, State.ERROR_PASSIVE)
    assert second["on_air_ns"] == first["end_ns"] + 11 * BIT


def test_a_can_fd_frame_says_that_its_sender_is_error_passive() -> None:
    frame = CanFrame(0x123, b"12", fd=True, bit_rate_switch=True)
    bench = CanBench(data_bit_rate_bps=2_000_000, bit_errors=scripted(*((attempt, 20) for attempt in range(18))))

    bench.run((0, "a", frame), (100 * MS, "b", frame))

    assert [unpack(data).error_state for _, name, data in bench.arrivals if name == "c"] == [True, False]


def test_a_node_alone_gets_no_acknowledgement_and_is_not_bus_off() -> None:
    bench = CanBench(["a"], end_ns=1000 * MS).run((0, "a", FRAME))

    attempts = bench.bus.counters()["a"]["can.no_acknowledgement"]
    assert bench.bus.error_counters("a") == (128, 0, State.ERROR_PASSIVE)
    assert attempts == bench.counted["transmissions"] > 3000
    assert bench.kinds("a") == ["no acknowledgement", "error-passive"]


def test_others_that_are_all_bus_off_do_not_acknowledge() -> None:
    bench = CanBench("ab", recovery="never", end_ns=100 * MS,
                     bit_errors=scripted(*((attempt, 40) for attempt in range(32))))

    bench.run((0, "b", FRAME), (50 * MS, "a", CanFrame(0x10)))

    assert bench.fates("b", "a") == [Fate.BUS_OFF]
    assert bench.bus.error_counters("a") == (128, 32, State.ERROR_PASSIVE)
    assert bench.fates("a", "b") == [Fate.UNFINISHED]


# --- bus-off

DEAD = [(attempt, 40) for attempt in range(32)]         # 32 x 8 = 256


def attempts_ns(bench: CanBench) -> int:
    return next(time_ns for time_ns, _, kind, _ in bench.events if kind == "bus-off")


def test_bus_off_drops_what_waits_and_what_is_handed_out_until_recovery() -> None:
    bench = CanBench(bit_errors=scripted(*DEAD), end_ns=100 * MS)

    bench.run((0, "a", FRAME), (1, "a", FRAME), (5 * MS, "a", FRAME), (50 * MS, "a", FRAME))

    assert attempts_ns(bench) < 5 * MS < attempts_ns(bench) + 128 * 11 * BIT
    assert bench.fates("a", "b") == [Fate.BUS_OFF] * 3 + [Fate.DELIVERED]
    assert {row["cause"] for row in bench.rows("a", "b")[:3]} == {"sender"}
    assert [kind for kind in bench.kinds("a") if kind != "CAN error frame"] == ["error-passive", "bus-off",
                                                                                "error-active"]


def test_bus_off_can_keep_what_waits_until_recovery() -> None:
    bench = CanBench(bit_errors=scripted(*DEAD), at_bus_off="keep", end_ns=100 * MS)

    bench.run((0, "a", FRAME), (5 * MS, "a", FRAME))

    assert attempts_ns(bench) < 5 * MS
    assert bench.fates("a", "b") == [Fate.DELIVERED, Fate.DELIVERED]


@pytest.mark.parametrize("delay_ns", [0, 5 * MS])
def test_an_idle_bus_lets_recover_after_128_times_11_bits(delay_ns: int) -> None:
    bench = CanBench(bit_errors=scripted(*DEAD), restart_delay_ns=delay_ns, end_ns=100 * MS)

    bench.run((0, "a", FRAME))

    recovered_ns = bench.events[-1][0]
    last_frame_ns = attempts_ns(bench)
    flag_ns = recovered_ns - delay_ns - 128 * 11 * BIT - last_frame_ns
    assert bench.events[-1][2] == "error-active"
    assert 6 * BIT <= flag_ns <= 12 * BIT                   # counting starts with the error delimiter


def test_a_busy_bus_lets_recover_after_128_frames() -> None:
    """Frames in a row: each ends in one run of 11 recessive bits, and so does the error frame."""
    bench = CanBench(bit_errors=scripted((0, 40)), end_ns=200 * MS, queue_frames=300, queue="fifo")
    faults = bench.bus._controllers["a"].faults
    faults.transmit_errors, faults.state = 248, State.ERROR_PASSIVE

    bench.run((0, "a", CanFrame(0x001)), *((1, "b", CanFrame(0x100 + k)) for k in range(200)))

    recovered_ns = bench.events[-1][0]
    between = [row for row in bench.rows("b", "c") if row["end_ns"] <= recovered_ns]
    assert bench.events[-1][2] == "error-active"
    assert len(between) == 127
    assert recovered_ns == between[-1]["end_ns"] + 3 * BIT


def test_recovery_can_be_left_to_nobody() -> None:
    bench = CanBench(bit_errors=scripted(*DEAD), recovery="never", end_ns=100 * MS)

    bench.run((0, "a", FRAME), (90 * MS, "a", FRAME), (90 * MS, "b", FRAME))

    assert bench.fates("a", "b") == [Fate.BUS_OFF, Fate.BUS_OFF]
    assert [(row["receiver"], row["fate"], row["cause"]) for row in bench.rows("b")] == [
        ("a", "bus off", "receiver"), ("c", "delivered", "")]


# --- one identifier from two nodes

def test_one_identifier_with_different_data_ends_as_the_error_counters_say() -> None:
    """16 frames destroyed while both are error-active; then the flag of the recessive one is passive: the other gets
    through, and after it the silenced one (Cho and Shin 2016, section 4)."""
    one, other = CanFrame(0x123, b"\x01"), CanFrame(0x123, b"\x00")     # b sends dominant where they differ

    bench = CanBench(end_ns=100 * MS).run((0, "a", one), (0, "b", other))

    assert bench.counted["collisions"] == 17
    assert bench.counted["error_frames"] == 16
    assert [(name, unpack(data).data) for _, name, data in bench.arrivals] == [("c", b"\0"), ("b", b"\1"), ("c", b"\1")]
    assert [(row["sender"], row["receiver"], row["fate"]) for row in bench.rows()] == [
        ("b", "a", "deaf"), ("b", "c", "delivered"), ("a", "b", "delivered"), ("a", "c", "delivered")]
    assert bench.bus.error_counters("a")[0] == 16 * 8 + 8 - 1
    assert bench.bus.error_counters("b")[0] == 16 * 8 - 1
    assert bench.kinds("a")[:2] == ["same identifier", "CAN error frame"]


def test_equal_frames_at_one_instant_are_one_frame_on_the_bus_and_all_copies_have_a_fate() -> None:
    bench = CanBench(own_frames_to=("a", "b")).run((0, "a", FRAME), (0, "b", FRAME))

    assert sorted((row["sender"], row["receiver"], row["fate"]) for row in bench.rows()) == [
        ("a", "a", "delivered"), ("a", "b", "deaf"), ("a", "c", "delivered"),
        ("b", "a", "collided"), ("b", "b", "delivered"), ("b", "c", "collided")]
    assert [name for _, name, _ in bench.arrivals] == ["c", "a", "b"]
    assert bench.kinds() == ["same frame"]


# --- what a node is told

def test_a_node_is_told_its_controllers_changes_of_state() -> None:
    bench = CanBench(bit_errors=scripted(*DEAD), error_messages_to=("a",), end_ns=100 * MS).run((0, "a", FRAME))

    told = [unpack(data) for _, name, data in bench.arrivals if name == "a"]
    assert all(message.error for message in told)
    assert [(message.can_id & 0x1FF, message.data[1], message.data[6]) for message in told] == [
        (0x004, 0x20, 128), (0x040, 0, 255), (0x100, 0, 0)]
    assert bench.kinds("a")[-1] == "error-active"
    assert bench.ledger.finish().rows == 2                  # messages are nobody's frames


def test_a_state_message_says_by_which_counter() -> None:
    assert unpack(state_message(FaultConfinement(0, 130, State.ERROR_PASSIVE), State.ERROR_ACTIVE)).data[1] == 0x10
    assert unpack(state_message(FaultConfinement(9, 119, State.ERROR_ACTIVE), State.ERROR_PASSIVE)).data == bytes(
        (0, 0x40, 0, 0, 0, 0, 9, 119))


@pytest.mark.parametrize("before", list(State))
@pytest.mark.parametrize("faults", [FaultConfinement(), FaultConfinement(128, 0, State.ERROR_PASSIVE),
                                    FaultConfinement(3, 130, State.ERROR_PASSIVE),
                                    FaultConfinement(256, 0, State.BUS_OFF)])
def test_a_state_message_is_read_as_it_was_written(faults: FaultConfinement, before: State) -> None:
    heals = before is State.BUS_OFF and faults.state is not State.BUS_OFF       # RESTARTED: always error-active

    after = state_after(unpack(state_message(faults, before)), before)

    assert after is (State.ERROR_ACTIVE if heals else faults.state)


# --- by chance

@pytest.mark.parametrize("ratio", [1e-4, 5e-4])
def test_the_share_of_destroyed_frames_is_that_of_independent_bits(ratio: float) -> None:
    """1 - (1 - ratio)^bits per transmission; 4 standard errors."""
    bench = CanBench(bit_errors=BitErrorSettings(ratio), queue_frames=3000, queue="fifo")

    bench.run(*((0, "a", FRAME) for _ in range(3000)))

    share = 1 - (1 - ratio) ** BITS
    tries = bench.counted["transmissions"]
    assert abs(bench.counted["error_frames"] / tries - share) < 4 * sqrt(share * (1 - share) / tries)
    assert {(row["number"], row["fate"]) for row in bench.rows("a", "c")} == {(k, "delivered") for k in range(3000)}


@pytest.mark.slow
def test_hits_are_spread_evenly_over_the_bits_of_a_frame() -> None:
    """Places of the first hit, for a small ratio: uniform, so their mean is (BITS - 1)/2 within 4 standard errors. The
    weight of a place falls by (1 - ratio) each, here 1 % over a frame: it shifts the mean by BITS^2 ratio / 12."""
    ratio = 1e-4
    bench = CanBench(bit_errors=BitErrorSettings(ratio), rng_for=lambda place: Random("hits"), queue_frames=40_000,
                     queue="fifo")
    places = []
    first_hit = bench.bus._errors._errors.first_hit
    bench.bus._errors._errors.first_hit = lambda *args: places.append(first_hit(*args)) or places[-1]  # type: ignore

    bench.run(*((0, "a", FRAME) for _ in range(40_000)))

    hits = [place for place in places if place is not None]
    sigma = BITS / sqrt(12 * len(hits))
    assert len(hits) > 300
    assert abs(sum(hits) / len(hits) - (BITS - 1) / 2) < 4 * sigma + BITS**2 * ratio / 12


def test_bits_are_hit_only_within_the_window() -> None:
    bench = CanBench(bit_errors=BitErrorSettings(0.5, during_ns=(10 * MS, 11 * MS)))

    bench.run(*((k * MS, "a", FRAME) for k in range(30)))

    times_ns = [time_ns for time_ns, _, kind, _ in bench.events if kind == "CAN error frame"]
    assert times_ns
    assert all(10 * MS <= time_ns < 11 * MS + BITS * BIT for time_ns in times_ns)


def test_the_stream_of_bit_errors_is_named_by_the_bus() -> None:
    places: list[str] = []

    CanBench(rng_for=lambda place: (places.append(place), Random(0))[1])

    assert places == ["media.can.bit_errors"]


# --- error frames from outside the run

ERROR = pack(CanFrame(0x008, bytes(8), error=True))


def test_an_error_message_of_a_named_node_is_an_error_flag_on_the_idle_bus() -> None:
    bench = CanBench(error_frames_from=("c",)).run((0, "c", ERROR), (1, "a", FRAME))

    # 6 bits of the flag, 6 of the others', 8 of the delimiter, 3 of the intermission; then the frame is on the bus.
    assert [row["on_air_ns"] for row in bench.rows("a", "b")] == [23 * BIT]
    assert bench.fates("a", "b") == [Fate.DELIVERED]
    assert bench.counted["error_frames"] == 1
    assert [bench.bus.error_counters(node)[1] for node in "abc"] == [1, 0, 0]   # b and c counted one down for the frame
    assert bench.rows("c") == []


def test_an_error_flag_waits_for_the_end_of_the_frame_on_the_bus_and_one_follows_another() -> None:
    bench = CanBench(error_frames_from=("c",)).run((0, "a", FRAME), (10 * BIT, "c", ERROR), (11 * BIT, "c", ERROR),
                                                   (12 * BIT, "b", FRAME))

    free_ns = bench.rows("a", "b")[0]["end_ns"] + 3 * BIT
    assert bench.fates("a", "b") == [Fate.DELIVERED]
    assert [row["on_air_ns"] for row in bench.rows("b", "a")] == [free_ns + 2 * 23 * BIT]
    assert bench.counted["error_frames"] == 2


def test_an_error_message_of_any_other_node_is_malformed() -> None:
    bench = CanBench(error_frames_from=("c",)).run((0, "b", ERROR))

    assert bench.fates("b", "a") == [Fate.MALFORMED]
    assert bench.counted["error_frames"] == 0
