"""The reference robot R2 of Chapter 4: answers looks with its pose and inputs, and says unasked when its inputs change.

What it says of its inputs is nominal: the disturbance e_omega that acts on them (4.45) is unknown to everybody.

Plant: `virtual_reference`, driven by the pieces in the team's table `reference` (from_s, v_mps, omega_radps).
Not modelled: computing time between a request and its answer; an announcement that is lost is not repeated.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from typing import Any

from simpy.events import Event

from agents.tracking.check import reference_problems
from agents.tracking.controller import Inputs, Pose
from agents.tracking.look_frames import UNASKED, ReferenceState, pack_answer, unpack_request
from agents.tracking.noise import Noise
from firmware_sim.board import Board
from firmware_sim.scenario_view import ScenarioView
from netem.wire.instants import NEVER_NS


class ReferenceRobot:
    def __init__(self, board: Board, *, disturbance: float = 0.0, hold_ns: int = 10_000_000) -> None:
        """`disturbance`: amplitude of e_omega [m/s, rad/s] as `Noise` has it; the plant gets it in steps of hold_ns."""
        if board.plant is None:
            raise ValueError(f"{board.node.name}: a reference robot needs a plant")
        if hold_ns < 1:
            raise ValueError(f"hold_ns={hold_ns}: expected at least 1")
        self._board = board
        self._plant = board.plant
        self._state = board.plant.output_group(["x", "y", "theta", "v", "omega"])
        self._disturb = board.plant.input_group(["e_v", "e_omega"])
        self._noise = Noise(board.rng, board.rng, 0.0, disturbance)
        self._hold_ns = hold_ns
        self._port = board.node.ports["radio"]
        self._port.on_receive = self._hear
        self._switches_ns = [round(from_s * 1e9) for from_s in board.team["reference"]["from_s"] if from_s > 0]
        self._next_word_ns = 0
        board.node.count("unreadable frames", 0)
        board.node.signals([("x", "m"), ("y", "m"), ("theta", "rad"), ("v", "m/s"), ("omega", "rad/s")],
                           self._measure)
        board.node.start(self._announce())
        if disturbance:
            board.node.start(self._drift())

    @staticmethod
    def check(scenario: ScenarioView) -> Iterator[str]:
        yield from reference_problems(scenario, f"{ReferenceRobot.__module__}:{ReferenceRobot.__name__}")

    def _measure(self, true_ns: int) -> tuple[float, ...]:
        self._plant.advance_to(true_ns)
        return self._state.read()

    def _say(self, look: int) -> None:
        node = self._board.node
        x_m, y_m, theta_rad, v_mps, omega_rad_s = self._measure(node.now_ns)
        self._port.send(pack_answer(look, ReferenceState(Pose(x_m, y_m, theta_rad), Inputs(v_mps, omega_rad_s))))

    def _hear(self, data: bytes) -> None:
        look = unpack_request(data)
        if look is None:
            self._board.node.count("unreadable frames")
        else:
            self._say(look)
        self._board.silent_unless_heard_until(self._next_word_ns)

    def _announce(self) -> Generator[Event, Any, None]:
        for switch_ns in [*self._switches_ns, NEVER_NS]:
            self._next_word_ns = switch_ns
            self._board.silent_unless_heard_until(switch_ns)
            yield from self._board.wait_until(switch_ns)
            self._say(UNASKED)
            state = self._measure(self._board.node.now_ns)
            self._board.node.event("switched inputs", f"to v = {state[3]:g} m/s, omega = {state[4]:g} rad/s")

    def _drift(self) -> Generator[Event, Any, None]:
        """R2 drives its inputs less e_omega (4.45), here that of the middle of each step."""
        env = self._board.node.env
        while True:
            now_ns = self._board.node.now_ns
            error = self._noise.input_error(now_ns + self._hold_ns // 2)
            self._plant.advance_to(now_ns)
            self._disturb.write([-error.v_mps, -error.omega_rad_s])
            yield env.timeout(self._hold_ns)
