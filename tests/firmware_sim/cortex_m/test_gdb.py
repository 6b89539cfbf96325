"""gdb on the emulated processor: it sees and steps the program, backwards too; a run that is watched is the same."""

from __future__ import annotations

import re
import socket
import struct
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_sim.cortex_m.errors import MachineFault
from firmware_sim.cortex_m.gdb.commands import Resume, answer
from firmware_sim.cortex_m.gdb.target_description import LAYOUT, NAMES, PLACES
from firmware_sim.cortex_m.gdb.wire import INTERRUPT, Wire
from netem.wire.messages import Grant, NodeFault
from tests.firmware_sim.cortex_m.boards import board_node, offers
from tests.firmware_sim.cortex_m.debugging import Packets, debugged, gdb, needs_gdb

BEACON = [[5e6], [1e6], [20.0]]
ARRIVALS = [(4_000_000, 0, b"\x01\0\0\0"), (11_000_500, 0, b"\x02\0\0\0")]
COSTS = (0.0, 1.0)
BREAKPOINT = re.compile(rb"T05thread:1;swbreak:;")


def words(registers: bytes) -> dict[str, int]:
    raw = bytes.fromhex(registers.decode())
    return dict(zip(NAMES, LAYOUT.unpack(raw), strict=True))


def state(client: Packets) -> tuple[int, bytes]:
    """Return how many instructions the program has executed, and its registers."""
    told = bytes.fromhex(client.ask(b"qRcmd," + b"time".hex().encode()).decode())
    return int(told.split()[2]), client.ask(b"g")


def after(client: Packets, packets: bytes) -> tuple[bytes, bytes]:
    """Return time and registers after packets of one letter each."""
    for packet in packets:
        client.ask(bytes([packet]))
    return client.ask(b"qRcmd," + b"time".hex().encode()), client.ask(b"g")


def symbol(image: Path, name: str) -> int:
    from elftools.elf.elffile import ELFFile

    with image.open("rb") as file:
        found = ELFFile(file).get_section_by_name(".symtab").get_symbol_by_name(name)
    return int(found[0]["st_value"]) & ~1


@needs_gdb
@pytest.mark.parametrize("cost", COSTS)
def test_gdb_breaks_steps_and_reads_and_the_frames_are_the_same(image: Callable[..., Path], cost: float) -> None:
    built = image("beacon")
    alone = offers(board_node(built, values=BEACON, cycles_per_instruction=cost), 30_000_000, ARRIVALS)

    with debugged(built, 30_000_000, ARRIVALS, values=BEACON, cycles_per_instruction=cost) as node:
        said = gdb(node, "break interrupt0_handler", "continue", "backtrace", "next", "stepi", "continue",
                   "print sent", "print heard", "delete", "hbreak interrupt8_handler", "continue", "backtrace",
                   "finish", "delete", "continue")
        found = node.ended().offers

    assert len(alone) == 6
    assert found == alone
    assert re.search(r"#0  interrupt0_handler .*\n#1  <signal handler called>\n#2 .* main \(\)", said.replace(
        "#2  wait_for_interrupt () at ./machine_registers.h:111\n#3", "#2")), said
    assert "$1 = 1" in said
    assert "$2 = 2" in said
    assert re.search(r"#0  interrupt8_handler .*\n#1  <signal handler called>", said), said
    assert "exited normally" in said


@needs_gdb
def test_gdb_sees_fpu_registers_and_threads_on_the_process_stack(image: Callable[..., Path]) -> None:
    with debugged(image("kernel"), 1_000_000_000, cycles_per_instruction=1.0) as node:
        said = gdb(node, "break systick_handler", "continue", "continue 3", "backtrace", "print/x $control & 1",
                   "set var $d5 = 2.5", "print $d5", "print/x $s11", "up 2", "print $sp > &stacks[1][0]",
                   "print $sp <= &stacks[2][0]", "delete", "break 68", "continue", "print/x $control & 3",
                   "print $sp == $psp", "print $msp > 0x20000f00", "kill")

    assert re.search(r"#1  <signal handler called>\n(#\d .*\n)+?#\d  0x\w+ in task \(number=1\)", said), said
    values = re.findall(r"\$\d+ = (.*)", said)
    assert values == ["0x1", "2.5", "0x40040000", "1", "1", "0x3", "1", "1"], said


@needs_gdb
def test_gdb_watches_a_variable_by_steps(image: Callable[..., Path]) -> None:
    with debugged(image("beacon"), 3_000_000, values=[[5e6], [1e6], [0.0]]) as node:
        said = gdb(node, "set can-use-hw-watchpoints 0", "watch sent", "continue", "kill")

    assert "Old value = 0\nNew value = 1\n" in said


@needs_gdb
def test_a_program_that_cannot_go_on_is_shown_where_it_is(image: Callable[..., Path]) -> None:
    with pytest.raises(MachineFault, match="bus fault: read of 0x30000000"), \
            debugged(image("mistakes"), values=[[1.0]]) as node:
        said = gdb(node, "continue", "backtrace", "continue")

    assert "Program received signal SIGSEGV" in said
    assert re.search(r"<signal handler called>\n#2  blunder \(.*\) at mistakes.c:\d+\n#3 .* in main \(\)", said), said
    assert "exited with code 03" in said


@needs_gdb
def test_gdb_goes_back_to_breakpoints_and_comes_to_the_present_again(image: Callable[..., Path]) -> None:
    with debugged(image("beacon"), 40_000_000, values=BEACON) as node:
        said = gdb(node, "break interrupt0_handler", "continue", "continue 2", "print sent", "reverse-continue",
                   "print sent", "reverse-continue", "print sent", "reverse-continue", "set var sent = 9", "continue",
                   "continue", "print sent", "delete", "continue", "print sent", "continue")
        frames = node.ended().offers

    assert re.findall(r"\$\d+ = (\d+)", said) == ["2", "1", "0", "1", "2"]
    assert said.count("No more reverse-execution history") == 2         # its beginning, and the present
    assert "Cannot access memory" in said                               # the past is not changed
    assert [data[:4] for _, _, data in frames] == [k.to_bytes(4, "little") for k in range(8)]


@pytest.mark.parametrize("cost", COSTS)
def test_each_step_back_finds_every_register_as_it_was(image: Callable[..., Path], cost: float) -> None:
    steps = 400
    with debugged(image("beacon"), 30_000_000, ARRIVALS, values=BEACON, cycles_per_instruction=cost) as node:
        client = node.client()
        client.ask(b"Z0,%x,2" % symbol(node.image, "interrupt8_handler"))
        assert BREAKPOINT.fullmatch(client.ask(b"c"))
        there = dict([state(client)])
        for _ in range(steps):
            assert client.ask(b"s").startswith(b"T05")
            there |= [state(client)]            # of two at one count the later: behind the entry of an exception
        back = []
        while min(there) < state(client)[0]:
            assert client.ask(b"bs") == b"T05thread:1;"
            back.append(state(client))
        client.send(b"k")

    assert len(there) > 300
    assert [count for count, _ in back] == sorted(there, reverse=True)[1:]
    assert dict(back) | dict([max(there.items())]) == there


def test_a_program_is_stopped_by_ctrl_c_and_ended_by_kill(image: Callable[..., Path]) -> None:
    with debugged(image("mistakes"), values=[[6.0]], instruction_budget=0) as node:
        client = node.client()
        client.send(b"c")
        client.socket.sendall(INTERRUPT)

        assert client.answer() == b"T02thread:1;"
        client.send(b"k")
        report = node.ended()

    assert report.ends is not None
    assert report.ends[1] == "the debugger of r1 ended it"


@pytest.mark.parametrize("leaves", ["detaches", "is gone", "is gone while the program runs"])
@pytest.mark.parametrize("cost", COSTS)
def test_a_debugger_that_leaves_lets_the_program_go_on(image: Callable[..., Path], leaves: str, cost: float) -> None:
    built = image("beacon")
    alone = offers(board_node(built, values=BEACON, cycles_per_instruction=cost), 30_000_000, ARRIVALS)

    with debugged(built, 30_000_000, ARRIVALS, values=BEACON, cycles_per_instruction=cost) as node:
        client = node.client()
        client.ask(b"Z0,%x,2" % symbol(built, "interrupt0_handler"))
        assert BREAKPOINT.fullmatch(client.ask(b"c"))
        client.ask(b"bs")
        if leaves == "detaches":
            assert client.ask(b"D") == b"OK"
        elif leaves == "is gone":
            client.socket.close()
        else:
            client.ask(b"c")                    # to the present
            client.send(b"c")
            client.socket.close()
        assert node.ended().offers == alone


@pytest.mark.parametrize("cost", COSTS)
def test_a_run_that_gdb_ends_at_once_tells_of_no_mistake(image: Callable[..., Path], cost: float) -> None:
    with debugged(image("beacon"), values=BEACON, cycles_per_instruction=cost) as node:
        node.client().send(b"k")
        report = node.ended()

    assert report.ends is not None
    assert report.ends[1] == "the debugger of r1 ended it"
    assert (report.offers, report.events) == ([], [])


@pytest.mark.parametrize("cost", COSTS)
def test_a_run_that_was_taken_back_has_the_same_records_with_a_slow_processor_too(image: Callable[..., Path],
                                                                                  cost: float) -> None:
    built, settings = image("beacon"), {"values": BEACON, "cycles_per_instruction": cost}
    slow = [NodeFault(ns, "slow", {"factor": 3.0, "begins": begins}) for ns, begins in ((10_000_000, True),
                                                                                      (20_000_000, False))]
    alone = board_node(built, **settings).advance(Grant(1, 30_000_000, False, True, ARRIVALS, slow))

    with debugged(built, 30_000_000, ARRIVALS, slow, **settings) as node:
        client = node.client()
        client.ask(b"Z0,%x,2" % symbol(built, "interrupt0_handler"))        # at 1, 6, 11, 16 ms
        first = [after(client, b"cc"), after(client, b"ssss"), after(client, b"cc")]
        assert BREAKPOINT.fullmatch(client.ask(b"bc"))
        client.ask(b"bc")
        again = [after(client, b""), after(client, b"ssss"), after(client, b"cc")]
        client.ask(b"D")
        found = node.ended()

    assert again == first
    assert found.offers == alone.offers
    assert found.samples == alone.samples
    if not cost:                        # a run by blocks counts instructions that a condition skips too
        assert 400 < found.counters.pop("instructions") < alone.counters.pop("instructions")
    assert found.counters == alone.counters


@pytest.mark.parametrize("cost", COSTS)
def test_ram_that_the_image_does_not_declare_can_be_written(image: Callable[..., Path], cost: float) -> None:
    far = 0x2001_F000
    with debugged(image("far"), 20_000_000, ARRIVALS, values=[[1.0]], cycles_per_instruction=cost) as node:
        client = node.client()
        assert client.ask(b"M%x,4:05000000" % far) == b"OK"
        client.ask(b"Z0,%x,2" % symbol(node.image, "interrupt8_handler"))
        client.ask(b"c")
        assert client.ask(b"m%x,4" % far) == b"05000000"
        client.ask(b"D")
        frames = node.ended().offers

    assert [data for _, _, data in frames] == [struct.pack("<I", 6), struct.pack("<I", 8)]


def test_what_a_debugger_writes_acts_and_is_recorded(image: Callable[..., Path]) -> None:
    with debugged(image("beacon"), 8_000_000, values=BEACON) as node:
        client = node.client()
        client.ask(b"Z1,%x,2" % symbol(node.image, "interrupt0_handler"))
        client.ask(b"c")
        client.ask(b"c")
        assert client.ask(b"M%x,4:07000000" % symbol(node.image, "sent")) == b"OK"
        assert client.ask(b"X%x,1:}\x03" % (symbol(node.image, "heard") + 1)) == b"OK"      # an escaped #
        assert client.ask(b"D") == b"OK"
        report = node.ended()

    assert [data for _, _, data in report.offers] == [struct.pack("<II", 0, 0), struct.pack("<II", 7, 0x2300)]
    assert [kind for _, kind, _, _ in report.events] == ["changed by a debugger"]


def test_registers_are_written_and_devices_are_read_without_their_effects(image: Callable[..., Path]) -> None:
    with debugged(image("beacon"), 30_000_000, ARRIVALS, values=BEACON) as node:
        client = node.client()
        client.ask(b"Z0,%x,2" % symbol(node.image, "interrupt8_handler"))
        client.ask(b"c")

        assert client.ask(b"m40000000,4") == b"4d434d34"                    # "MCM4"
        assert [client.ask(b"m40010010,4") for _ in range(2)] == [b"01000000"] * 2      # a FIFO's next word
        assert client.ask(b"m40000100,4") == b"E0e"
        assert client.ask(b"m1ffffffe,4") == b"E0e"
        assert client.ask(b"m2001fffe,8") == b"0000"                        # as much as there is
        assert client.ask(b"M0,4:00000000") == client.ask(b"M40000074,4:01000000") == b"E0e"    # flash, a device
        for name, value in (("r3", b"efbeadde"), ("d7", b"0102030405060708"), ("fpscr", b"00000001"),
                            ("basepri", b"40000000")):
            assert client.ask(b"P%x=%b" % (NAMES.index(name), value)) == b"OK", name
            assert client.ask(b"p%x" % NAMES.index(name)) == value, name
        before = client.ask(b"g")
        changed = bytearray.fromhex(before.decode())
        changed[PLACES[2]:PLACES[2] + 4] = b"\x07\0\0\0"
        assert client.ask(b"G" + changed.hex().encode()) == b"OK"
        assert words(client.ask(b"g")) == words(before) | {"r2": 7}
        assert client.ask(b"P%x=00000000" % NAMES.index("control")) == b"E0e"
        client.send(b"k")


class Memory:
    """Stands for a machine; all memory holds 7."""

    def registers(self) -> bytes:
        return bytes(LAYOUT.size)

    def write_register(self, number: int, value: bytes) -> bool:
        return number < len(NAMES)

    def read_memory(self, address: int, length: int) -> bytes:
        return b"\7" * length

    def write_memory(self, address: int, data: bytes) -> bool:
        return True

    def set_breakpoint(self, address: int) -> bool:
        return True

    def clear_breakpoint(self, address: int) -> None:
        pass


def arbitrary(random: Random) -> bytes:
    """Return a packet that gdb might send, with arbitrary numbers."""
    address = random.choice((random.getrandbits(32), 0x2000_0000 + random.randrange(0x2100), random.randrange(0x800)))
    length, value = random.choice((0, 1, 4, 64, 5_000)), random.randbytes(random.choice((4, 8)))
    return random.choice((
        b"g", b"s", b"s", b"bs", b"bc", b"?", b"m%x,%x" % (address, length), b"Z0,%x,2" % address,
        b"M%x,%x:%b" % (address, len(value), value.hex().encode()), b"z0,%x,2" % address,
        b"P%x=%b" % (random.randrange(48), value.hex().encode()), b"vCont;r%x,%x:1" % (address, address + 8),
        b"G" + random.randbytes(LAYOUT.size).hex().encode(), b"qRcmd,74696d65"))


@pytest.mark.parametrize("cost", COSTS)
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 20))])
def test_a_debugger_that_does_anything_leaves_the_host_alive(image: Callable[..., Path], seed: int,
                                                             cost: float) -> None:
    random, answered = Random(seed), [b""]

    with suppress(MachineFault), debugged(image("kernel"), 10_000_000, cycles_per_instruction=cost,
                                          instruction_budget=100_000) as node, suppress(OSError):
        client = node.client()
        while len(answered) < 100 and not answered[-1].startswith(b"W"):
            answered.append(client.ask(arbitrary(random)))
        client.send(b"D")

    assert len(answered) == 100 or answered[-1] in (b"W03", b"")


BEGINNINGS = st.sampled_from([b"m", b"M", b"X", b"p", b"P", b"G", b"Z0,", b"z1,", b"vCont;", b"qRcmd,", b"c",
                              b"qXfer:features:read:target.xml:"])


@given(st.one_of(st.binary(max_size=40), st.tuples(BEGINNINGS, st.binary(max_size=20)).map(b"".join)))
def test_no_packet_raises(packet: bytes) -> None:
    found = answer(packet or b"g", Memory(), b"T05", str)

    assert isinstance(found, bytes | Resume)


@given(st.binary(max_size=60))
def test_noise_before_a_packet_is_dropped(noise: bytes) -> None:
    ours, theirs = socket.socketpair()
    with ours, theirs:
        theirs.sendall(noise.replace(b"$", b"").replace(b"\x03", b"") + b"$g#67")

        assert Wire(ours).receive() == b"g"


def test_a_packet_with_a_wrong_checksum_is_asked_for_again() -> None:
    ours, theirs = socket.socketpair()
    with ours, theirs:
        theirs.sendall(b"$g#00$g#67")

        assert Wire(ours).receive() == b"g"
        assert theirs.recv(16) == b"-+"


def test_a_packet_without_end_ends_the_connection() -> None:
    ours, theirs = socket.socketpair()
    with ours, theirs:
        theirs.sendall(b"$" + b"7" * 20_000)
        wire = Wire(ours)

        assert wire.receive() == b""
        assert wire.closed
