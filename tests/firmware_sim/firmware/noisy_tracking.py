"""Changes of the scenario tracking_individual: a node that sends wrong frames, lost answers, a clock that steps."""

from __future__ import annotations

NOISE = '''
from struct import pack

from netem.media.can.frame import CanFrame, pack as pack_can


class Noise:
    """Sends answers and messages of the drive, many of them wrong in a way that a radio and a bus can carry."""

    def __init__(self, board):
        self.board, self.radio, self.can = board, board.port("radio"), board.port("can")
        board.every(7_000_000, self.say)
        board.every(5_300_000, self.tell)

    def say(self):
        rng = self.board.rng
        numbers = [rng.uniform(-3, 3) for _ in range(5)]
        numbers[rng.choice([0, 0, 1, 2, 3, 4])] = rng.choice([2e2, -1e300, -1e300, float("nan"), 0.0])
        if rng.random() < 0.4:
            numbers[:3] = (rng.uniform(-3, 3) for _ in range(3))
            numbers[3:] = rng.choice([(1.0, 1.0), (0.6, 0.15), (1.5, 1.0), (4.0, 1.0)])
        look = rng.choice([0xFFFF, 0xFFFF, rng.randrange(100), 0])
        frame = pack("<BH5d", rng.choice([0xA6, 0xA6, 0xA6, 0xA5]), look, *numbers)
        self.radio.send(frame[:rng.choice([43, 43, 43, 42])])

    def tell(self):
        rng = self.board.rng
        identifier = rng.choice([0x110, 0x190, 0x190, 0x1A0, 0x710, 0x111])
        data = bytearray(rng.randbytes(rng.choice([8, 8, 8, 8, 7])))
        if len(data) == 8 and rng.random() < 0.8:
            data[2], data[5], data[6] = rng.choice([0, 1, 255]), rng.choice([0, 1, 255, 128]), rng.choice([0, 1, 1, 2])
        self.can.send(pack_can(CanFrame(identifier, bytes(data), extended=rng.random() < 0.1)))
'''
NOISY = '''
[agents.noise]
program = "noise:Noise"
media = ["radio", "can"]

[[impairments]]
on = "radio: reference -> companion"
during_s = [0.1, 0.2]
kind = "bernoulli_loss"
loss_ratio = 0.9

[[faults]]
kind = "clock_step"
name = "back"
on = "companion"
at_s = 0.3
by_ms = -20.3

[[faults]]
kind = "link_down"
name = "loose_plug"
on = "can: drive -> companion"
during_s = [0.05, 0.1]
'''


def without_expectations(text: str) -> str:
    """Return a scenario without its guarantees and expectations, and without what its bus is said to carry."""
    return text[:text.index("[media.can.messages]")].replace('"error.norm"', '"drive.v"')
