"""Control units that are FMUs, on buses of scenarios: arbitration by hand, errors, bus-off, garbage, other programs."""

from __future__ import annotations

import struct
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

import pytest

from experiments.judge.run_data import load_run
from experiments.run.runner import run
from experiments.scenario import ScenarioError, load
from firmware_sim.ecu import operations
from netem.media.can.encoded_frame import encode_frame
from netem.media.can.frame import CanFrame, pack, unpack
from netem.records.ledger_file import read_ledger
from tests.fmus.ecu import configure_losses, ecu, heard, script, status, transmit

MS = 1_000_000
BIT = 2_000             # ns at 500 kbit/s
UNIT = 'program = "firmware_sim.ecu.bus_fmu:BusFmu"'
PROGRAMS = '''
import can

from netem.media.can.frame import CanFrame, pack


def listen(rounds=0):
    """Plain python-can: print what comes."""
    with can.Bus(interface="marconet") as bus:
        for message in bus:
            print(f"{message.timestamp:.6f} {message.arbitration_id:x} {message.data.hex()}")


class Talk:
    """Sends identifier 0x100 at 1 ms."""

    def __init__(self, board):
        self.port = board.port("can0")
        board.at(1_000_000, lambda: self.port.send(pack(CanFrame(0x100, bytes(8)))))


class Quiet:
    def __init__(self, board):
        board.port("can0", lambda data: None, listen_only=True)
'''


class Ran(NamedTuple):
    result: Any
    data: Any
    rows: list[dict[str, Any]]
    folder: Path

    def heard(self, node: str) -> list[tuple[int, bytes]]:
        return heard(self.folder / f"{node}.log")

    def counts(self, node: str) -> dict[str, int]:
        return {name.removeprefix("can0."): count for name, count in self.data.counters.get(node, {}).items()}

    def kinds(self, node: str) -> list[tuple[int, str, str]]:
        return [(event.time_ns, event.kind, event.detail) for event in self.data.events if event.node == node]


Go = Callable[..., Ran]


@pytest.fixture
def go(tmp_path: Path) -> Iterator[Go]:
    """Run agents (by name: their tables) on a bus; an FMU's log is NAME.log."""
    (tmp_path / "programs_beside_units.py").write_text(PROGRAMS)
    ecu(tmp_path / "ecu.fmu")

    def started(agents: dict[str, str], bus: str = "", length_s: float = 0.05, host: str = "inline") -> Ran:
        tables = "".join(f"[agents.{name}]\n{table}\n" for name, table in agents.items())
        units = [name for name, table in agents.items() if UNIT in table]
        notified = "" if "notifications_to" in bus else f"notifications_to = {units}\n"
        (tmp_path / "case.toml").write_text(
            f"# Units.\n# Question: do they speak?\nseed = 1\nlength_s = {length_s}\n{tables}[media.can0]\n"
            f'kind = "can"\nbit_rate_bps = 500_000\n{notified}{bus}\n'.replace("'", '"'))
        for log in tmp_path.glob("*.log"):
            log.unlink()
        result = run(load(tmp_path / "case.toml"), host=host, out=tmp_path / "runs", report=False,      # type: ignore[arg-type]
                     overwrite=True)
        return Ran(result, load_run(result.folder), read_ledger(result.folder / "ledger.parquet").to_pylist(), tmp_path)

    yield started
    sys.modules.pop("programs_beside_units", None)


@pytest.fixture
def unit(tmp_path: Path) -> Callable[..., str]:
    def table(name: str, more: str = "", **parameters: Any) -> str:
        log = tmp_path / f"{name}.log"
        values = ", ".join(f"{key} = {str(value).lower() if isinstance(value, bool) else repr(value)}"
                           for key, value in {**parameters, "log": str(log)}.items())
        return f'{UNIT}\nplant = {{ fmu = "ecu.fmu", parameters = {{ {values} }} }}\n{more}'
    return table


def bits(can_id: int, data: bytes) -> int:
    return encode_frame(pack(CanFrame(can_id, data))).nominal_bits


@pytest.mark.parametrize("host", ["inline", "process"])
def test_a_frame_is_heard_one_bit_before_its_end_and_confirmed_at_its_end(go: Go, unit: Any, host: str) -> None:
    ran = go({"sender": unit("sender", period_ms=10.0, offset_ms=1.0), "echo": unit("echo", echo_ms=0.5)}, host=host)

    for k in range(5):
        data = struct.pack("<q", k)
        start_ns = (1 + 10 * k) * MS
        heard_ns = start_ns + (bits(0x100, data) - 1) * BIT
        back_ns = heard_ns + MS // 2 + (bits(0x101, data) - 1) * BIT
        assert ran.heard("echo")[2 * k:2 * k + 2] == [(heard_ns, transmit(0x100, data)),
                                                     (back_ns + BIT, operations.confirm(0x101))]
        assert ran.heard("sender")[2 * k:2 * k + 2] == [(heard_ns + BIT, operations.confirm(0x100)),
                                                       (back_ns, transmit(0x101, data))]
    assert {row["fate"] for row in ran.rows} == {"delivered"}
    assert ran.data.signals["echo"].column("heard")[-1] == 4        # sampled at 40 ms
    assert ran.counts("sender")["confirmed"] == ran.counts("sender")["transmitted"] == 5


def test_both_hosts_and_repeated_runs_give_one_hash(go: Go, unit: Any) -> None:
    agents = {"sender": unit("sender", period_ms=1.0), "echo": unit("echo", echo_ms=0.0)}

    hashes = {go(agents, host=host).result.summary.ledger_hash for host in ("inline", "process", "inline")}

    assert len(hashes) == 1


# 0x100 = 001 0000 0000 wins against 0x200 = 010 0000 0000 at the second bit of the identifier, the third from SOF on
LOST_AT_BIT = 2


def test_a_unit_that_discards_is_told_at_the_bit_at_which_it_lost_and_may_transmit_again(go: Go, unit: Any) -> None:
    late = script((0, configure_losses(2)))
    ran = go({"a": unit("a", id=512.0, period_ms=1000.0, offset_ms=1.0, script=late, retry=True),
              "b": "program = 'programs_beside_units:Talk'"})

    told, taken, confirmed = ran.heard("a")
    data = bytes(8)
    free_ns = MS + (bits(0x100, data) + 3) * BIT
    assert told == (MS + (LOST_AT_BIT + 1) * BIT, operations.arbitration_lost(0x200))
    assert taken == (MS + (bits(0x100, data) - 1) * BIT, transmit(0x100, data))
    assert confirmed == (free_ns + bits(0x200, data) * BIT, operations.confirm(0x200))
    assert [(row["fate"], row["cause"]) for row in ran.rows if row["sender"] == "a"] == [
        ("arbitration lost", "one attempt"), ("delivered", "")]
    assert ran.counts("a")["arbitration_lost"] == 1


@pytest.mark.parametrize("behavior", [None, 1])
def test_a_unit_that_buffers_is_not_told_and_the_bus_retransmits(go: Go, unit: Any, behavior: int | None) -> None:
    values = [] if behavior is None else [(0, configure_losses(behavior))]
    ran = go({"a": unit("a", id=512.0, period_ms=1000.0, offset_ms=1.0, script=script(*values)),
              "b": "program = 'programs_beside_units:Talk'"})

    data = bytes(8)
    free_ns = MS + (bits(0x100, data) + 3) * BIT
    assert ran.heard("a")[1:] == [(free_ns + bits(0x200, data) * BIT, operations.confirm(0x200))]
    assert {row["fate"] for row in ran.rows} == {"delivered"}


def test_of_two_units_at_one_instant_the_lower_identifier_goes_first(go: Go, unit: Any) -> None:
    ran = go({"a": unit("a", id=768.0, period_ms=1000.0, offset_ms=1.0),
              "b": unit("b", id=32.0, period_ms=1000.0, offset_ms=1.0), "c": unit("c")})

    first_ns = MS + (bits(0x20, bytes(8)) - 1) * BIT
    second_ns = first_ns + 4 * BIT + (bits(0x300, bytes(8)) - 1) * BIT
    assert ran.heard("c") == [(first_ns, transmit(0x20, bytes(8))), (second_ns, transmit(0x300, bytes(8)))]


def test_an_error_frame_is_told_to_sender_and_receivers_and_the_frame_is_repeated(go: Go, unit: Any) -> None:
    ran = go({"a": unit("a", period_ms=1000.0, offset_ms=1.0), "b": unit("b")},
             bus="bit_errors = { scripted = [{ transmission = 0, bit = 40 }] }")

    (error_ns, to_sender), (confirmed_ns, confirmed) = ran.heard("a")
    (same_ns, to_receiver), _ = ran.heard("b")
    assert to_sender == operations.bus_error(0x100, 1, primary=True, is_sender=True)
    assert to_receiver == operations.bus_error(0x100, 1, primary=False, is_sender=False)
    # bit 40 is wrong; flags of 6 to 12 bits, delimiter 8, intermission 3
    assert MS + (41 + 6 + 11) * BIT <= error_ns == same_ns <= MS + (41 + 12 + 11) * BIT
    assert (confirmed_ns, confirmed) == (error_ns + bits(0x100, bytes(8)) * BIT, operations.confirm(0x100))


def test_a_unit_counts_its_errors_as_the_bus_does_and_tells_bus_off(go: Go, unit: Any) -> None:
    every = ", ".join(f"{{ transmission = {k}, bit = 40 }}" for k in range(32))
    ran = go({"a": unit("a", period_ms=1.0, offset_ms=1.0, count_errors=True), "b": unit("b")},
             bus=f'bit_errors = {{ scripted = [{every}] }}\nrecovery = "never"')

    told = [(time_ns, detail) for time_ns, kind, detail in ran.kinds("a") if kind == "status"]
    own = {kind: time_ns for time_ns, kind, _ in ran.kinds("a") if kind in ("error-passive", "bus-off")}
    # 16 errors count 128, 32 count 256; the unit learns of each at the end of its error frame, up to 23 bits later
    assert [detail for _, detail in told] == ["can0: error-passive", "can0: bus-off"]
    for (time_ns, _), kind in zip(told, ("error-passive", "bus-off"), strict=True):
        assert 0 < time_ns - own[kind] <= (12 + 8 + 3) * BIT
    assert ran.counts("a")["bus_off_told"] == 1
    assert ran.data.signals["a"].column("tec")[-1] == 256
    assert ran.counts("a")["transmitted"] < 10                  # a unit that is bus-off transmits no more


def test_a_unit_that_says_bus_off_is_taken_off_the_bus(go: Go, unit: Any) -> None:
    ran = go({"a": unit("a", period_ms=10.0, offset_ms=1.0), "b": unit("b", script=script((5000, status(3))))},
             bus='recovery = "never"')

    assert {row["fate"] for row in ran.rows if row["offered_ns"] < 5 * MS} == {"delivered"}
    assert ran.counts("a")["confirmed"] == 1                    # with nobody left there is no acknowledgement
    assert ran.data.counters["a"]["can0.no_acknowledgement"] > 0
    assert not [row for row in ran.rows if row["offered_ns"] > 5 * MS and row["fate"] == "delivered"]


def test_a_wakeup_reaches_all_other_units_and_not_its_initiator(go: Go, unit: Any) -> None:
    ran = go({"a": unit("a", script=script((2000, operations.wakeup()))), "b": unit("b"), "c": unit("c")})

    assert ran.heard("a") == []
    assert ran.heard("b") == ran.heard("c") == [(2 * MS + 2 * BIT, operations.wakeup())]


def test_a_misshapen_operation_is_answered_at_once_and_the_others_of_its_value_are_done(go: Go, unit: Any) -> None:
    bad = bytes.fromhex("99000000 09000000 07")
    ran = go({"a": unit("a", script=script((3000, transmit(0x10) + bad + transmit(0x11)))), "b": unit("b")})

    assert ran.heard("a")[0] == (3 * MS, operations.format_error(bad, 2048))
    assert [value for _, value in ran.heard("b")] == [transmit(0x10), transmit(0x11)]
    assert ran.counts("a")["format_errors"] == 1
    assert [(kind, detail) for _, kind, detail in ran.kinds("a") if kind == "format error"] == [
        ("format error", "can0: operation 0x99: no operation that an FMU sends to a CAN bus")]


def test_other_bit_rates_are_reported_and_have_no_effect(go: Go, unit: Any) -> None:
    rate = struct.pack("<IIBI", 0x40, 13, 1, 250_000)
    ran = go({"a": unit("a", script=script((0, rate), (1000, transmit(0x10)))), "b": unit("b")})

    assert ("bit rate", "can0: the FMU asks for CAN_BAUDRATE = 250000 bit/s, the bus can0 has 500000: the scenario "
            "decides") in [(kind, detail) for _, kind, detail in ran.kinds("a")]
    assert ran.heard("b") == [(MS + (bits(0x10, b"") - 1) * BIT, transmit(0x10))]


def test_without_notifications_a_unit_gets_frames_only(go: Go, unit: Any) -> None:
    ran = go({"a": unit("a", period_ms=10.0, script=script((0, configure_losses(2)))), "b": unit("b", echo_ms=1.0)},
             bus="notifications_to = []")

    assert {struct.unpack_from("<I", value)[0] for _, value in ran.heard("a")} == {0x10}
    assert ("not told to the bus", "can0: one_shot: name this node in notifications_to of [media.can0]") in [
        (kind, detail) for _, kind, detail in ran.kinds("a")]


def test_can_fd_frames_keep_their_flags(go: Go, unit: Any) -> None:
    frame = CanFrame(0x55, bytes(range(20)), fd=True, bit_rate_switch=True)
    ran = go({"a": unit("a", script=script((1000, operations.transmit(frame)))), "b": unit("b")},
             bus="data_bit_rate_bps = 2_000_000")

    assert [value for _, value in ran.heard("b")] == [operations.transmit(frame)]


def test_plain_python_can_hears_a_unit(go: Go, unit: Any) -> None:
    ran = go({"a": unit("a", period_ms=10.0, offset_ms=1.0), "listener": "program = 'programs_beside_units:listen'"},
             host="process")

    lines = (ran.result.folder / "logs" / "listener.log").read_text().splitlines()
    assert [line.split()[1:] for line in lines] == [["100", struct.pack("<q", k).hex()] for k in range(5)]


def test_a_unit_commands_a_drive_controller(go: Go, unit: Any) -> None:
    from firmware_sim.drive_controller.drive_messages import DriveMessages, Mode, Setpoint

    messages = DriveMessages()
    setpoints = [(10_000, operations.transmit(unpack(messages.pack(Setpoint(2.0, 1.0, Mode.RUN, k)))))
                 for k in range(25)]
    ran = go({"a": unit("a", script=script(*setpoints)),
              "drive": "program = 'firmware_sim.drive_controller.drive_controller:DriveController'\n"
                       "plant = { fmu = 'unicycle' }"}, length_s=0.3)

    assert "drive running" in [kind for _, kind, _ in ran.kinds("drive")]
    assert ran.data.signals["drive"].column("x")[-1] > 0.01


@pytest.mark.parametrize(("agent", "complaint"), [
    ("", "agents.a: BusFmu runs an FMU with a bus terminal; write plant"),
    ("plant = { fmu = 'unicycle' }", "agents.a.plant: fmu=unicycle: it has no bus terminal"),
    ("plant = { fmu = 'broken.fmu' }", "terminal Powertrain: has no member Rx_Data"),
    ("plant = { fmu = 'triggered.fmu' }", "agents.a.parameters: step_ms is missing: Powertrain.Tx_Clock is a"),
    ("plant = { fmu = 'ecu.fmu' }\nparameters = { terminals = { Body = 'can0' } }",
     "terminals.Body: the FMU has no such bus terminal; it has Powertrain"),
    ("plant = { fmu = 'ecu.fmu' }\nparameters = { terminals = { Powertrain = 'can9' } }",
     "terminals.Powertrain=can9: no CAN bus of this agent; there are can0"),
])
def test_a_unit_that_cannot_run_is_refused_by_check(go: Go, tmp_path: Path, agent: str, complaint: str) -> None:
    ecu(tmp_path / "broken.fmu", terminals={'memberName="Rx_Data"': 'memberName="Rx_Date"'})
    ecu(tmp_path / "triggered.fmu", "triggered")

    with pytest.raises(ScenarioError) as error:
        go({"a": f"{UNIT}\n{agent}", "b": "program = 'programs_beside_units:Quiet'"}, bus="notifications_to = []")

    assert complaint in "\n".join(error.value.problems)


def test_a_node_that_is_not_on_the_bus_gets_no_notifications(go: Go, unit: Any) -> None:
    with pytest.raises(ScenarioError, match="notifications_to=nobody: no such node on this bus"):
        go({"a": unit("a"), "b": unit("b")}, bus='notifications_to = ["nobody"]')


def test_a_triggered_output_clock_sends_at_the_ends_of_its_steps(go: Go, unit: Any, tmp_path: Path) -> None:
    ecu(tmp_path / "ecu.fmu", "triggered")
    ran = go({"a": unit("a", "parameters = { step_ms = 2 }", period_ms=3.0, offset_ms=1.0),
              "b": "program = 'programs_beside_units:Quiet'"}, length_s=0.015)

    assert [row["offered_ns"] // MS for row in ran.rows] == [2, 4, 8, 10, 14]


def garbage(rng: Random) -> bytes:
    """Return a value of Tx_Data: random bytes, or an operation of which some bytes are changed."""
    if rng.random() < 0.5:
        return rng.randbytes(rng.randrange(1, 40))
    value = bytearray(rng.choice([
        transmit(rng.randrange(2048), rng.randbytes(rng.randrange(9))), configure_losses(1 + rng.randrange(2)),
        status(1 + rng.randrange(2)), operations.wakeup(), operations.format_error(b"x", None),
        operations.transmit(CanFrame(0x1, bytes(12), fd=True))]))
    for _ in range(rng.randrange(3)):
        value[rng.randrange(len(value))] = rng.randrange(256)
    return bytes(value)


@pytest.mark.parametrize("number", [2_000, pytest.param(100_000, marks=pytest.mark.slow)])
def test_garbage_is_answered_by_format_errors_and_the_run_goes_on(go: Go, unit: Any, number: int) -> None:
    rng = Random(3)
    values = [garbage(rng) for _ in range(number)]
    bad = sum(isinstance(operation, operations.Misshapen) for value in values for operation in operations.decode(value))
    ran = go({"a": unit("a", script=script(*((1_000, value) for value in values))), "b": unit("b", period_ms=100.0)},
             bus="data_bit_rate_bps = 2_000_000", length_s=number / 1000 + 0.1)

    told = [value for _, value in ran.heard("a") if value[:4] == bytes((1, 0, 0, 0))]
    assert len(told) == ran.counts("a")["format_errors"] == bad > number / 3
    assert ran.counts("b")["transmitted"] == number // 100 + 1
    assert [row["fate"] for row in ran.rows].count("unfinished") <= 1
