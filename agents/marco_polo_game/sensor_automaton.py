"""The automaton of a sensor in the Marco Polo game (Figure 2.3, Definition 1).

    waiting --its bid for an investigation was the greatest--> investigating --k detections, too late, let go--> waiting
    waiting --its bid for a pursuit was the greatest--> pursuing --captured, the target is gone, let go--> waiting

Only UGVs have the mode `pursuing`. A sensor that waits stays where its task ended: no farther from there than its
platform needs to come to rest, which is 0 for one without inertia. Where there are obstacles, or zones that are virtual
ones, the domain of each mode is what the sensor's platform can occupy.
Differs from the dissertation: Figure 2.3 ends neither an investigation nor a pursuit that finds nothing. Here an
investigation ends at the latest time at which the target can be in its C-target, and a pursuit when the UGV is where
the target was expected to leave, and that time has passed.
"""

from __future__ import annotations

from enum import IntEnum

from agents.hybrid.automaton import Automaton, Edge, Mode
from agents.hybrid.region import All, AnyOf, Between, Where
from agents.marco_polo_game.game_table import Game
from agents.marco_polo_game.movers import Bounds

AT_OBSTACLE_M = 1e-6            # rounding of times to whole ns moves a sensor by less
NOBODY = -1.0                   # variable `target` of a sensor that waits
ROUNDING_M = 1e-9               # of the distance from where a platform that brakes at once has stopped


class GameMode(IntEnum):
    """Number of the mode in MODE frames."""

    WAITING = 0
    INVESTIGATING = 1
    PURSUING = 2

    @property
    def word(self) -> str:
        return self.name.lower()


def sensor_automaton(game: Game, captures: bool, bounds: Bounds) -> Automaton:
    """Return the automaton of a UGV (`captures`) or a UAV, whose platform keeps to `bounds`.

    Variables: place [m], number of the target, distance from where it was told to stop [m], 0 while it is to drive.
    Inputs: number of its detections, time left [s], 1 if captured, 1 if another sensor is deployed or has ended the
    task."""
    parameters = game.parameters
    k, speed = parameters.detections, bounds.speed_mps
    waiting, investigating, pursuing = (mode.word for mode in GameMode)
    inside = All(Between("x", *game.area.x_m, bounds.outside_m), Between("y", *game.area.y_m, bounds.outside_m))
    if game.barriers(captures):
        ground = game.ground(captures)
        inside = All(inside, Where("outside obstacles", ("x", "y"), lambda point: ground.clear(
            (point["x"], point["y"]), (point["x"], point["y"]), slack_m=AT_OBSTACLE_M)))
    stands = All(inside, Between("target", NOBODY, NOBODY), Between("coasted", 0, bounds.coasts_m, ROUNDING_M))
    busy = All(inside, Between("target", 0, len(game.targets) - 1))
    moves = {"x": (-speed, speed), "y": (-speed, speed)}
    given_up = Between("given_up", 1, 1)
    modes = {waiting: Mode(stands, moves),
             investigating: Mode(busy, moves)}
    edges = [Edge(waiting, investigating, Between("detections", k - 1, k - 1), {"target": "of"}),
             Edge(investigating, waiting, AnyOf(Between("detections", k), Between("left_s", most=0), given_up),
                  {"target": NOBODY, "coasted": 0})]
    if captures:
        modes[pursuing] = Mode(busy, moves)
        edges += [Edge(waiting, pursuing, Between("detections", k), {"target": "of"}),
                  Edge(pursuing, waiting, AnyOf(Between("captured", 1, 1), Between("left_s", most=0), given_up),
                       {"target": NOBODY, "coasted": 0})]
    return Automaton(modes, edges, {waiting: stands}, {"x": "m", "y": "m", "target": "1", "coasted": "m"},
                     {"of": "1", "detections": "1", "left_s": "s", "captured": "1", "given_up": "1"})
