"""Airtimes against figures worked out by hand from the standards and data sheets: docs/models/broadcast_radio.md."""

from dataclasses import fields
from fractions import Fraction
from math import ceil

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netem.media.radio_presets import PRESETS, RadioPreset
from netem.media.radio_settings import CarrierSenseSettings, RadioSettings

US = 1_000


@pytest.mark.parametrize(("preset", "payload_bytes", "airtime_ns"), [
    # 1 preamble + 5 address bytes, 9 bits of length and id, 2 port bytes, payload, 2 checksum bytes at 2 Mbit/s
    ("crazyflie_p2p", 0, 44_500),
    ("crazyflie_p2p", 60, 284_500),
    # 6 + 9 + 2 + payload + 2 bytes of 32 us; the longest 802.15.4 frame of 133 bytes lasts 4.256 ms
    ("xbee_802154", 0, 608 * US),
    ("xbee_802154", 100, 3_808 * US),
    ("xbee_802154", 114, 4_256 * US),
    # 192 us long preamble and header, then 8 us a byte: 24 + 8 + 28 + payload + 4
    ("wifi_broadcast_80211b_1mbps", 0, 704 * US),
    ("wifi_broadcast_80211b_1mbps", 100, 1_504 * US),
    ("wifi_broadcast_80211b_1mbps", 1472, 12_480 * US),
    # 20 us preamble and SIGNAL, 4 us symbols of 24 bits: ceil((16 + 8 (64 + payload) + 6) / 24), 6 us extension
    ("wifi_broadcast_80211g_6mbps", 0, 118 * US),           # 534 bits: 23 symbols
    ("wifi_broadcast_80211g_6mbps", 1472, 2_078 * US),      # 12310 bits: 513 symbols
    ("ideal", 0, 0),
    ("ideal", 10**6, 0),
])
def test_airtime_matches_the_figure_worked_out_by_hand(preset, payload_bytes, airtime_ns):
    assert PRESETS[preset].airtime_ns(payload_bytes) == airtime_ns


@given(bit_rate_bps=st.integers(1, 10**9), header_bits=st.integers(0, 1000), bits_per_symbol=st.integers(1, 64),
       payload_bytes=st.integers(0, 2000))
def test_airtime_is_the_exact_time_rounded_up(bit_rate_bps, header_bits, bits_per_symbol, payload_bytes):
    radio = RadioSettings(preset="xbee_802154", bit_rate_bps=bit_rate_bps, header_bits=header_bits,
                          bits_per_symbol=bits_per_symbol).radio()

    symbols = ceil(Fraction(header_bits + 8 * payload_bytes, bits_per_symbol))
    assert radio.airtime_ns(payload_bytes) == 192 * US + ceil(Fraction(symbols * bits_per_symbol * 10**9, bit_rate_bps))


def test_a_scenario_can_override_every_field_of_a_preset():
    odd = {"bit_rate_bps": 1234, "preamble_ns": 5, "header_bits": 7, "bits_per_symbol": 3, "trailer_ns": 11,
           "max_payload_bytes": 13, "receive_latency_ns": 17, "checksum": False, "tx_power_dbm": -1.5,
           "sensitivity_dbm": -77.5, "capture_db": 2.5}
    assert {*odd, "csma"} == {field.name for field in fields(RadioPreset)}

    radio = RadioSettings(preset="crazyflie_p2p", csma=CarrierSenseSettings(slot_ns=19), **odd).radio()

    assert {name: getattr(radio, name) for name in odd} == odd
    assert radio.csma.slot_ns == 19
    assert radio.csma.cca_ns == PRESETS["crazyflie_p2p"].csma.cca_ns


@pytest.mark.parametrize(("settings", "message"), [
    ({"preset": "crazyfly_p2p"}, "did you mean 'crazyflie_p2p'"),
    ({"bit_rate_bps": 0}, "bit_rate_bps=0: expected at least 1"),
    ({"capture_db": 0.0}, "capture_db=0.0: expected > 0"),
    ({"receive_latency_ns": -1}, "receive_latency_ns=-1: expected"),
    ({"queue_frames": -1}, "queue_frames=-1: expected"),
    ({"csma": CarrierSenseSettings(min_exponent=3)}, "min_exponent=3, max_exponent=0: expected"),
    ({"csma": CarrierSenseSettings(scheme="dcf")}, "slot_ns=0: expected at least 1"),
])
def test_settings_refuse_nonsense(settings, message):
    with pytest.raises(ValueError, match=message):
        RadioSettings(**settings)
