"""The bus, which decides a frame at its start, against stations that see nothing but one bit after the other."""

from __future__ import annotations

import pytest
from hypothesis import example, given, reject, settings
from hypothesis import strategies as st

from netem.media.can.bit_errors import BitErrorSettings, ScriptedBit
from netem.media.can.fault_confinement import State
from netem.media.can.frame import CanFrame, pack, unpack
from tests.examples import examples
from tests.netem.media.can.bit_by_bit import encode
from tests.netem.media.can.bit_level_bus import SecondError, Station, simulate
from tests.netem.media.can.can_bench import BIT, CanBench
from tests.netem.media.can.frames import classical_frames, data_frames


def as_seen(frame: CanFrame) -> CanFrame:
    """With its DLC spelt out, as a receiver reports it."""
    return unpack(pack(frame))


def compare(offers: dict[str, list[tuple[int, CanFrame]]], hits: dict[int, int], *, bits: int,
            errors_before: dict[str, tuple[int, int]] | None = None) -> tuple[CanBench, dict[str, Station]]:
    """Run both; frames taken and counters have to agree. Offers are at whole bits."""
    stations = {name: Station(name, list(frames)) for name, frames in offers.items()}
    bench = CanBench(offers, queue="fifo", end_ns=bits * BIT + 1,
                     bit_errors=BitErrorSettings(scripted=tuple(ScriptedBit(*hit) for hit in hits.items())))
    for name, (tec, rec) in (errors_before or {}).items():
        stations[name].tec, stations[name].rec = tec, rec
        faults = bench.bus._controllers[name].faults
        faults.transmit_errors, faults.receive_errors = tec, rec
        faults.state = State.ERROR_PASSIVE if tec > 127 or rec > 127 else State.ERROR_ACTIVE

    bench.run(*((start * BIT, name, frame) for name, frames in offers.items() for start, frame in frames))
    decided = bench.bus.busy_until_ns // BIT        # the bus counts errors when a frame starts, the stations see them
    try:
        simulate(list(stations.values()), max(bits, decided), hits)
    except SecondError:
        reject()

    for name, station in stations.items():
        heard = [(at_ns // BIT, unpack(data)) for at_ns, receiver, data in bench.arrivals if receiver == name]
        assert heard == [(at, as_seen(frame)) for at, frame in station.taken if at <= bits]
        tec, rec, _ = bench.bus.error_counters(name)
        assert (tec, rec) == (station.tec, station.rec), name
    return bench, stations


@settings(max_examples=examples(60), deadline=None)
@given(data=st.data(), frame=classical_frames, rec=st.sampled_from([0, 1, 126, 127, 140]),
       tec=st.sampled_from([0, 5, 120, 127, 128, 200]))
def test_one_inverted_bit_anywhere(data: st.DataObject, frame: CanFrame, tec: int, rec: int) -> None:
    """Sender error-active or passive, receivers likewise: who takes the frame when, and what the counters say."""
    hit = data.draw(st.integers(0, len(encode(frame)) - 1))
    after = CanFrame(0x7FF, b"after")

    bench, stations = compare({"a": [(0, frame), (0, after)], "b": [], "c": [(400, CanFrame(0x400, b"other"))]},
                              {0: hit}, bits=900, errors_before={"a": (tec, 0), "b": (0, rec)})

    assert len(stations["a"].sent) == 2
    assert bench.counted["error_frames"] == 1


@pytest.mark.parametrize("extended", [False, True])
@pytest.mark.parametrize("passive", [False, True])
def test_every_bit_of_one_frame(extended: bool, passive: bool) -> None:
    """A rival contends. It sends another bit at place 1; hit there, a passive sender falls silent unseen and the rival
    goes on, which the emulator does not model."""
    frame = CanFrame(0x1F, b"\x00\xff\x1e", extended)

    for hit in range(len(encode(frame))):
        if passive and hit == 1:
            continue
        compare({"a": [(0, frame)], "b": [(0, CanFrame(0x700, b"later"))], "c": []}, {0: hit}, bits=500,
                errors_before={"a": (128 * passive, 0)})


@settings(max_examples=examples(25), deadline=None)
@given(frames=st.lists(st.tuples(st.sampled_from("abc"), st.integers(0, 600), classical_frames), min_size=1,
                       max_size=5, unique_by=lambda offer: (offer[2].can_id, offer[2].extended)),
       hits=st.dictionaries(st.integers(0, 4), st.integers(34, 43), max_size=3))
def test_several_nodes_contend_while_bits_are_hit(frames: list[tuple[str, int, CanFrame]],
                                                  hits: dict[int, int]) -> None:
    offers = {name: sorted(((at, frame) for sender, at, frame in frames if sender == name), key=lambda offer: offer[0])
              for name in "abc"}

    compare(offers, hits, bits=2500)


@settings(max_examples=examples(25), deadline=None)
@given(one=data_frames, other=st.binary(min_size=0, max_size=8))
@example(CanFrame(0x100, b"\x01"), b"\x00")
@example(CanFrame(0x100, b"\x01"), b"\x01")
def test_one_identifier_from_two_nodes_at_once(one: CanFrame, other: bytes) -> None:
    """They differ behind bit 14, and an error frame takes 17 bits more: in 450 bits less than 16 of them, so both are
    error-active all the time."""
    twin = CanFrame(one.can_id, other, one.extended)

    bench, stations = compare({"a": [(0, one)], "b": [(0, twin)], "c": []}, {}, bits=450)

    if one.data == other:
        assert len(stations["c"].taken) == bench.counted["transmissions"] == 1
        assert bench.kinds() == ["same frame"]
    else:
        assert bench.counted["collisions"] == bench.counted["error_frames"] == bench.counted["transmissions"] > 1
        assert bench.kinds("a")[0] == bench.kinds("b")[0] == "same identifier"


def test_a_node_alone_repeats_for_ever_and_stays_error_passive() -> None:
    bench, stations = compare({"a": [(0, CanFrame(0x123, b"alone"))]}, {}, bits=4000)

    assert bench.bus.error_counters("a") == (128, 0, State.ERROR_PASSIVE)
    assert stations["a"].sent == []
