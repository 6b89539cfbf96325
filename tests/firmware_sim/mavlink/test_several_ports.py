"""A vehicle with several telemetry ports: streams and answers of each, and what is passed on between them."""

from __future__ import annotations

from random import Random

import pytest
from pymavlink.dialects.v20 import common

from firmware_sim.mavlink.front import MavlinkFront
from firmware_sim.mavlink.routing import Routes
from firmware_sim.mavlink.settings import MavlinkSettings, PortSettings
from tests.firmware_sim.mavlink import kinematic_vehicle as kinematic
from tests.firmware_sim.mavlink.ground import QUIET, TICK_NS, kinds

GCS, COMPANION, RADIO = 0, 1, 2
KEY = "0f" * 32


class Vehicle:
    """The vehicle 1/1 with the ports gcs, companion and radio, and pymavlink at the other end of each."""

    def __init__(self, quiet=True, **settings):
        settings.setdefault("streams_hz", QUIET if quiet else {})
        self.events = []
        self.front = MavlinkFront(kinematic.KinematicVehicle(), MavlinkSettings(**settings),
                                  lambda kind, detail: self.events.append((kind, detail)),
                                  names=("gcs", "companion", "radio"))
        self.parsers = [common.MAVLink(None) for _ in range(3)]
        for parser in self.parsers:
            parser.robust_parsing = True
        self.now_ns = 0

    def hear(self, port, *frames):
        """What leaves at each port after these frames came in at one of them."""
        self.now_ns += TICK_NS
        self.front.vehicle.advance(self.now_ns)
        heard = [b"", b"", b""]
        heard[port] = b"".join(frames)
        return [parser.parse_buffer(b"".join(out)) or []
                for parser, out in zip(self.parsers, self.front.step(heard, self.now_ns), strict=True)]

    def run(self, seconds):
        found = [[], [], []]
        for _ in range(round(seconds * 1e9 / TICK_NS)):
            for of_port, more in zip(found, self.hear(GCS), strict=True):
                of_port += more
        return found


class Source:
    """A system that packs its frames with its own sequence numbers."""

    def __init__(self, system, component=190):
        self.mav = common.MAVLink(None, srcSystem=system, srcComponent=component)

    def __call__(self, message):
        data = message.pack(self.mav)
        self.mav.seq = (self.mav.seq + 1) % 256
        return bytes(data)

    def heartbeat(self):
        return self(self.mav.heartbeat_encode(6, 8, 0, 0, 0))

    def command(self, system, component, number=common.MAV_CMD_REQUEST_MESSAGE, first=148.0):
        return self(self.mav.command_long_encode(system, component, number, 0, first, 0, 0, 0, 0, 0, 0))


@pytest.fixture
def vehicle():
    return Vehicle()


def test_each_port_has_the_full_stream_with_sequence_numbers_of_its_own():
    vehicle = Vehicle(quiet=False)

    found = vehicle.run(10.0)

    assert kinds(found[GCS]) == kinds(found[COMPANION]) == kinds(found[RADIO])
    for messages in found:
        numbers = [message.get_seq() for message in messages]
        assert numbers == [number % 256 for number in range(numbers[0], numbers[0] + len(numbers))]


def test_ports_have_rates_and_budgets_of_their_own():
    vehicle = Vehicle(streams_hz={**QUIET, "ATTITUDE": 10.0}, port_settings={
        "companion": PortSettings({"ATTITUDE": 50.0}), "radio": PortSettings(budget_bytes_per_s=100)})

    gcs, companion, radio = vehicle.run(10.0)

    assert (kinds(gcs), kinds(companion)) == (["ATTITUDE"] * 101, ["ATTITUDE"] * 501)       # at 0, ..., 10 s
    sent = sum(len(message.get_msgbuf()) for message in radio)
    assert 950 <= sent <= 100 * 10 + 300 + 40           # what was saved up, and the one that overdrew last


def test_a_request_changes_the_streams_of_its_own_port(vehicle):
    vehicle.hear(COMPANION, Source(245).command(1, 1, common.MAV_CMD_SET_MESSAGE_INTERVAL, 30.0))

    assert [port.streams.interval_ns("ATTITUDE") for port in vehicle.front.ports] == [0, 0, 0]
    set_interval = Source(245)
    vehicle.hear(COMPANION, set_interval(set_interval.mav.command_long_encode(
        1, 1, common.MAV_CMD_SET_MESSAGE_INTERVAL, 0, 30.0, 20_000.0, 0, 0, 0, 0, 0)))
    assert [port.streams.interval_ns("ATTITUDE") for port in vehicle.front.ports] == [0, 20_000_000, 0]


def test_an_acknowledgement_goes_to_who_asked_alone(vehicle):
    gcs, companion = Source(255), Source(245)

    first = vehicle.hear(GCS, gcs.command(1, 1))
    second = vehicle.hear(COMPANION, companion.command(1, 1))

    assert [kinds(found) for found in first] == [["COMMAND_ACK", "AUTOPILOT_VERSION"], [], []]
    assert [kinds(found) for found in second] == [[], ["COMMAND_ACK", "AUTOPILOT_VERSION"], []]
    assert (second[COMPANION][0].target_system, second[COMPANION][0].target_component) == (245, 190)


def test_parameters_and_texts(vehicle):
    gcs = Source(255)
    vehicle.front.say(common.MAV_SEVERITY_INFO, "to everybody", vehicle.now_ns)
    asked = vehicle.hear(GCS, gcs(gcs.mav.param_request_list_encode(1, 1)))
    rest = vehicle.run(5.0)

    assert [kinds(found) for found in asked[COMPANION:]] == [["STATUSTEXT"], ["STATUSTEXT"]]
    assert kinds(asked[GCS])[0] == "STATUSTEXT"
    assert set(kinds(rest[GCS])) == {"PARAM_VALUE"}
    assert (rest[COMPANION], rest[RADIO]) == ([], [])


def test_a_heartbeat_is_passed_on_as_it_came_to_all_other_ports(vehicle):
    gcs = Source(255)
    gcs.mav.seq = 77

    found = vehicle.hear(GCS, gcs.heartbeat())

    assert [kinds(each) for each in found] == [[], ["HEARTBEAT"], ["HEARTBEAT"]]
    for each in (found[COMPANION][0], found[RADIO][0]):
        assert (each.get_srcSystem(), each.get_srcComponent(), each.get_seq()) == (255, 190, 77)
    assert vehicle.front.counts["frames passed on"] == 2


def test_what_is_for_another_system_goes_where_it_was_heard_and_is_not_carried_out(vehicle):
    gcs, companion = Source(255), Source(245)
    unknown = vehicle.hear(GCS, gcs.command(245, 190))
    vehicle.hear(COMPANION, companion.heartbeat())

    found = vehicle.hear(GCS, gcs.command(245, 190))
    answer = vehicle.hear(COMPANION, companion(companion.mav.command_ack_encode(512, 0, 0, 0, 255, 190)))
    other_component = vehicle.hear(GCS, gcs.command(245, 1))

    assert unknown == [[], [], []]
    assert [kinds(each) for each in found] == [[], ["COMMAND_LONG"], []]
    assert [kinds(each) for each in answer] == [["COMMAND_ACK"], [], []]
    assert other_component == [[], [], []]


def test_a_component_of_the_same_system_is_reached_and_a_broadcast_to_it_is_carried_out_too(vehicle):
    gcs, camera = Source(255), Source(1, 100)
    vehicle.hear(COMPANION, camera.heartbeat())

    for_camera = vehicle.hear(GCS, gcs.command(1, 100))
    for_all = vehicle.hear(GCS, gcs.command(1, 0))
    for_us = vehicle.hear(GCS, gcs.command(1, 1))

    assert [kinds(each) for each in for_camera] == [[], ["COMMAND_LONG"], []]
    assert [kinds(each) for each in for_all] == [["COMMAND_ACK", "AUTOPILOT_VERSION"], ["COMMAND_LONG"], []]
    assert [kinds(each) for each in for_us] == [["COMMAND_ACK", "AUTOPILOT_VERSION"], [], []]


def test_a_link_between_two_ports_makes_no_loop(vehicle):
    gcs = Source(255)
    out = vehicle.hear(GCS, gcs.heartbeat())
    passed = 0
    for _ in range(50):                             # what leaves at the radio comes back at the companion's port
        frames = [bytes(each.get_msgbuf()) for each in out[RADIO]]
        back = [bytes(each.get_msgbuf()) for each in out[COMPANION]]
        out = vehicle.hear(COMPANION, *frames)
        passed += sum(map(len, out))
        out = [first + second for first, second in zip(out, vehicle.hear(RADIO, *back), strict=True)]

    assert vehicle.front.counts["frames passed on"] < 10
    assert sum(map(len, out)) == 0


def test_radio_status_stays_and_what_is_no_frame_is_not_passed_on(vehicle):
    radio = Source(51, 68)
    status = radio(radio.mav.radio_status_encode(10, 10, 100, 0, 0, 0, 0))
    rng = Random(1)

    assert vehicle.hear(RADIO, status) == [[], [], []]
    assert vehicle.hear(RADIO, rng.randbytes(2000), radio.heartbeat()[:-1]) == [[], [], []]


def test_a_mission_is_asked_for_at_the_port_that_offers_it_and_another_is_refused(vehicle):
    gcs, companion = Source(255), Source(245)
    offered = vehicle.hear(GCS, gcs(gcs.mav.mission_count_encode(1, 1, 2)))
    other = vehicle.hear(COMPANION, companion(companion.mav.mission_count_encode(1, 1, 3)))
    same_source = vehicle.hear(COMPANION, gcs(gcs.mav.mission_count_encode(1, 1, 2)))
    again = vehicle.run(0.6)

    assert [kinds(each) for each in offered] == [["MISSION_REQUEST_INT"], [], []]
    assert [kinds(each) for each in other] == [[], ["MISSION_ACK"], []]
    assert other[COMPANION][0].type == common.MAV_MISSION_DENIED
    assert kinds(same_source[COMPANION]) == ["MISSION_ACK"]
    assert [kinds(each) for each in again] == [["MISSION_REQUEST_INT"], [], []]


def test_arming_is_told_at_every_port(vehicle):
    gcs = Source(255)

    found = vehicle.hear(GCS, gcs.command(1, 1, common.MAV_CMD_COMPONENT_ARM_DISARM, 1.0))

    assert [kinds(each) for each in found] == [["COMMAND_ACK", "HEARTBEAT", "HOME_POSITION"],
                                               ["HEARTBEAT", "HOME_POSITION"], ["HEARTBEAT", "HOME_POSITION"]]


def test_a_frame_signed_for_one_port_is_old_at_another():
    vehicle = Vehicle(signing_key=KEY)
    gcs = Source(255)
    gcs.mav.signing.secret_key = bytes.fromhex(KEY)
    gcs.mav.signing.sign_outgoing = True
    gcs.mav.signing.timestamp = 10
    frame = gcs.heartbeat()

    vehicle.hear(GCS, frame)
    vehicle.hear(COMPANION, frame)

    assert vehicle.front.counts["frames passed on"] == 2
    assert vehicle.front.counts["frames refused: replayed"] == 1


@pytest.mark.parametrize("seed", range(20))
def test_whatever_is_heard_nothing_returns_to_its_port_or_goes_to_one_that_is_no_way_there(seed):
    rng, routes = Random(seed), Routes(1, 1, 4)
    ways = {}
    for _ in range(500):
        source, port = (rng.randrange(4), rng.randrange(3)), rng.randrange(4)
        routes.heard(*source, port)
        ways.setdefault(source, set()).add(port)
        fields = {"target_system": rng.randrange(4), "target_component": rng.randrange(3)}

        onward = routes.onward("COMMAND_LONG", source, fields, port)

        assert port not in onward
        assert onward == sorted(set(onward))
        target = fields["target_system"], fields["target_component"]
        if target[0]:
            allowed = {way for (system, component), found in ways.items() for way in found
                       if system == target[0] and target[1] in (0, component)}
            assert set(onward) == (set() if target == (1, 1) else allowed - {port})
        else:
            away = {port} | (ways[source] if source[0] else set())
            assert set(onward) == set(range(4)) - away


@pytest.mark.parametrize(("settings", "says"), [
    (MavlinkSettings(ports=("gcs", "uart")), "mavlink.ports='uart': no such free port; there are gcs, companion;"),
    (MavlinkSettings(ports=("gcs", "mocap")), "mavlink.ports='mocap': no such free port"),
    (MavlinkSettings(ports=("gcs",), port_settings={"companion": PortSettings()}),
     "mavlink.port_settings.companion: is none of the ports gcs; correct the name, or add it to ports"),
])
def test_wrong_names_of_ports_are_told(settings, says):
    with pytest.raises(ValueError, match=says):
        settings.ports_of(["gcs", "companion", "mocap"], "mocap")


def test_wrong_settings_of_ports_are_told():
    with pytest.raises(ValueError, match=r"ports=\['a', 'b'\]: port = 'c' is given too; keep one"):
        MavlinkSettings(port="c", ports=("a", "b"))
    with pytest.raises(ValueError, match=r"ports=\['a', 'a'\]: a name stands there twice"):
        MavlinkSettings(ports=("a", "a"))
    with pytest.raises(ValueError, match="port_settings: a: streams_hz: ATTITUD: no such stream"):
        MavlinkSettings(ports=("a",), port_settings={"a": PortSettings({"ATTITUD": 1.0})})
    assert MavlinkSettings(ports=("b", "a")).ports_of(["a", "b", "c"], "c") == ["b", "a"]
