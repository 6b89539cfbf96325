"""Stuff bits: after five equal bits the sender inserts one of the other polarity (ISO 11898-1:2015, 10.5).

    state = (last bit, length of its run, 1..5)         after a run of 5 a stuff bit comes next and starts a run of 1

The stuff bit counts in the run that follows. A table maps (state, byte) to (state, stuff bits, bits sent), so a frame
takes one look-up per byte. The bus is idle, recessive, before SOF, so SOF starts a run.
"""

from __future__ import annotations

from typing import Final, NamedTuple

_LONGEST: Final = 5
_IDLE: Final = 0            # a run of one dominant bit, after which the padding 0101.. gets no stuff bit


class _Step(NamedTuple):
    state: int
    stuffed: int
    sent: str


def _step(state: int, byte: int) -> _Step:
    last, run = divmod(state, _LONGEST)
    run += 1
    stuffed, sent = 0, ""
    for bit in (byte >> shift & 1 for shift in range(7, -1, -1)):
        if run == _LONGEST:
            last, run = 1 - last, 1
            stuffed += 1
            sent += str(last)
        last, run = bit, run + 1 if bit == last else 1
        sent += str(bit)
    return _Step(last * _LONGEST + run - 1, stuffed, sent)


_STEPS: Final = [[_step(state, byte) for byte in range(256)] for state in range(2 * _LONGEST)]
_STATES: Final = [[step.state for step in steps] for steps in _STEPS]
_STUFFED: Final = [[step.stuffed for step in steps] for steps in _STEPS]
_SENT: Final = [[step.sent for step in steps] for steps in _STEPS]
_PADDING: Final = [0, 0b1, 0b01, 0b101, 0b0101, 0b10101, 0b010101, 0b1010101]      # bits that end in recessive idle


def stuff_bits(bits: int, length: int, *, at_end: bool) -> int:
    """Number of stuff bits in `length` bits, of which the first is the most significant.

    `at_end` if one is inserted after the last bit too, should that end a run of five.
    """
    missing = -length & 7
    state, total = _IDLE, 0
    for byte in (_PADDING[missing] << length | bits).to_bytes(length + missing >> 3, "big"):
        total += _STUFFED[state][byte]
        state = _STATES[state][byte]
    return total + 1 if at_end and state % _LONGEST == _LONGEST - 1 else total


def stuffed(bits: int, length: int) -> str:
    """The bits as sent, as '0' and '1', with no stuff bit after the last one."""
    missing = -length & 7
    state, sent = _IDLE, []
    for byte in (_PADDING[missing] << length | bits).to_bytes(length + missing >> 3, "big"):
        sent.append(_SENT[state][byte])
        state = _STATES[state][byte]
    return "".join(sent)[missing:]
