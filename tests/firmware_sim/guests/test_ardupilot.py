"""ArduPilot as a guest, against a client written from the public description (`ardupilot_client.py`)."""

from __future__ import annotations

import random
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

import marconet
from firmware_sim.guests.ardupilot_frames import read_servos
from tests.firmware_sim.guests.test_px4 import settles_within_m

ARDUPILOT = "firmware_sim.guests.ardupilot:ArduPilotGuest"


@pytest.mark.parametrize("what", ["", *(pytest.param(what, marks=pytest.mark.slow)
                                       for what in ("wide", "noise", "twice"))])
def test_it_takes_off_and_hovers_in_lockstep(fly, what):
    flight = fly("ardupilot", ARDUPILOT, what, answer_within_s=5.0)
    guest = flight.guests[0]
    assert flight.final("z") == pytest.approx(1.5, abs=settles_within_m(4.5, 1.5))
    assert guest["steps_right"]
    assert guest["rest_z"] == pytest.approx(-9.81, abs=1e-6)
    counted = flight.run.counters["v1"]
    assert counted["steps"] == 2000                     # 400 Hz
    assert counted["frames lost"] == 0
    assert counted["frames repeated"] == guest["copies"]            # each copy was answered, and no other
    if what == "twice":
        assert guest["copies"] >= 1999                              # the run ends before the copy of the last
    else:
        assert guest["copies"] <= guest["resent"]                   # what it sent before anybody listened is lost
    assert (counted["unreadable datagrams"] > 1000) == (what == "noise")
    assert guest["heard"] >= 8


@pytest.mark.slow
def test_the_same_flight_has_the_same_hash(fly):
    hashes = {fly("ardupilot", ARDUPILOT, length_s=1.5).run.ledger_hash for _ in range(3)}
    assert len(hashes) == 1
    assert fly("ardupilot", ARDUPILOT, length_s=1.5, host="inline").run.ledger_hash in hashes


@pytest.mark.slow
def test_a_reset_is_an_event(fly):
    flight = fly("ardupilot", ARDUPILOT, "reset", length_s=2.0)
    assert "guest reset" in set(flight.run.events["kind"])
    assert flight.run.counters["v1"]["steps"] == 800


def test_a_guest_that_stops_is_named(fly):
    with pytest.raises(marconet.NodeFailure, match=r"agents\.v1: no frame of servo outputs from ArduPilot on .* within "
                                                   r"0\.5 s; is it stopped"):
        fly("ardupilot", ARDUPILOT, "stops", length_s=2.0, answer_within_s=0.5)


@given(st.binary(max_size=120))
def test_no_bytes_raise(data):
    servos = read_servos(data)
    assert servos is None or len(servos.pwm_us) in (16, 32)


def test_mutated_frames_never_raise():
    rng = random.Random(2)
    frame = struct.pack("<HHI16H", 18458, 400, 7, *range(1000, 1016))
    assert read_servos(frame).commands()[3] == pytest.approx(0.003)
    for _ in range(20_000):
        data = bytearray(frame)
        for _ in range(rng.randrange(4)):
            data[rng.randrange(len(data))] = rng.randrange(256)
        read_servos(bytes(data[:rng.randrange(len(data) + 1)]))
