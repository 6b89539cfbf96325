"""Words for an exception of a program: the same from a traceback of compiled modules and of sources."""

import pytest

from netem.wire.program_errors import own_lines, what_failed

FROM_SOURCES = '''Traceback (most recent call last):
  File "{root}/netem/node/node.py", line 277, in _run_before
    callback(event)
  File "/home/me/beacon.py", line 20, in run
    yield from self.board.sleep_until(next_ns)
RuntimeError: Invalid yield value "{value}"
'''


@pytest.mark.parametrize(("value", "name"), [
    ("<generator object Board.sleep_until at 0x7f6389dcc0e0>", "Board.sleep_until"),
    ("<firmware_sim.board.sleep_until_Board_gen object at 0x7f6389dcc0e0>", "Board.sleep_until"),
    ("<netem.media.talk_on_air_gen object at 0x7f6389dcc0e0>", "talk_on_air")])
def test_a_forgotten_from_is_told_alike_from_sources_and_compiled(value, name):
    told = what_failed(FROM_SOURCES.format(root="", value=value))

    assert told == (f"beacon.py:20: yield of the generator {name}: it waits only if it is delegated to; write "
                    f"`yield from ...{name.rpartition('.')[2]}(...)`")


def test_the_frames_of_compiled_modules_are_no_lines_of_the_author():
    trace = FROM_SOURCES.format(root="", value="5").replace('"/netem', '"netem')

    assert own_lines(trace) == ('  File "/home/me/beacon.py", line 20, in run\n'
                                '    yield from self.board.sleep_until(next_ns)')


@pytest.mark.parametrize("mistake", [
    'RuntimeError: Invalid yield value "<beacon.Beacon object at 0x7f6389dcc0{}>"',
    "TypeError: unsupported operand type(s) for <bound method Beacon.run of <beacon.Beacon object at 0x7f6389dcc0{}>>"])
def test_an_address_in_memory_does_not_make_one_mistake_two(mistake):
    first, second = (what_failed('  File "/home/me/beacon.py", line 20, in run\n    wrong()\n' + mistake.format(digits))
                     for digits in ("e0", "f0"))

    assert first == second
    assert "0x" not in first
