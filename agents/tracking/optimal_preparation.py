"""Prepares the policy `optimal` of a scenario's tracking robots: the cost of a look from its media, then the tables.

`prepared_tables` adds to the team table `optimal_tables`, `optimal_look_cost_j` (S), `optimal_remark` and what an
observer needs; it adds nothing if no robot has this policy. Making tables takes seconds, so it tells its progress.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from itertools import count
from typing import TYPE_CHECKING, Any, Final

import msgspec

from agents.tracking.controller import Inputs, Pose
from agents.tracking.look_frames import ReferenceState, pack_answer, pack_request
from agents.tracking.look_port import ANSWER_ID, PORT, REQUEST_ID, can_struct
from agents.tracking.optimal_settings import OptimalSettings, read_optimal
from agents.tracking.planned_gains import gains_of
from agents.tracking.tracking_settings import TrackingSettings
from agents.triggering.policies.interval_table import IntervalTable
from firmware_sim.scenario_view import MediumView, Own, Preparing, ScenarioView, unseen
from netem.media.can.encoded_frame import encode_frame

if TYPE_CHECKING:
    from agents.tracking.optimal_tables import Tables
    from firmware_sim.height_chart import HeightChart

POLICY: Final = "optimal"
PREPARED: Final = "tables of the optimal policy"


def prepared_tables(scenario: ScenarioView, own: Own[TrackingSettings], progress: Preparing) -> dict[str, Any]:
    """Return additions to the team table; the same for all robots with the policy `optimal`."""
    if all(agent.settings.policy != POLICY for agent in own.values()):
        return {}
    settings = read_optimal(scenario.team)
    look_cost_j = look_cost(scenario, settings)
    tables = _tables(scenario, settings, look_cost_j, progress)
    return {"optimal_tables": tables.by_inputs, "optimal_look_cost_j": look_cost_j, "optimal_remark": tables.remark,
            "optimal_observer": settings.observer, "optimal_disturbance": settings.disturbance}


def prepared_charts(scenario: ScenarioView, own: Own[TrackingSettings]) -> Sequence[HeightChart]:
    """Return charts of the tables that `prepared_tables` makes; none if it makes none."""
    if all(agent.settings.policy != POLICY for agent in own.values()):
        return ()
    from agents.tracking.optimal_charts import optimal_charts  # late: NumPy

    settings = read_optimal(scenario.team)
    look_cost_j = look_cost(scenario, settings)
    return list(optimal_charts(settings, _tables(scenario, settings, look_cost_j, unseen), look_cost_j))


def optimal_problems(scenario: ScenarioView) -> Iterator[str]:
    """Yield the mistakes of `[team.optimal]`, a cap below the shortest interval, a cost of a look that is unknown."""
    try:
        settings = read_optimal(scenario.team)
    except ValueError as error:
        yield from str(error).split("; ")
        return
    from agents.tracking.optimal_tables import cap_problems  # late: NumPy and SciPy

    yield from cap_problems(settings, gains_of(scenario.team))
    try:
        look_cost(scenario, settings)
    except ValueError as error:
        yield str(error)


def look_cost(scenario: ScenarioView, settings: OptimalSettings) -> float:
    """Return S [J]: as given, or the energy of a request and its answer on the medium of the looks."""
    if settings.look_cost_j is not None:
        return settings.look_cost_j
    medium = scenario.media.get(PORT)
    airtime_ns = None if medium is None else _airtime_ns(medium)
    if airtime_ns is None:
        raise ValueError(f"team.optimal.look_cost_j: is missing, and media.{PORT} has no airtimes to compute it from: "
                         "give the energy of a look in joules")
    if settings.transmit_w + settings.receive_w <= 0:
        raise ValueError("team.optimal.transmit_w=0: expected the power of a radio while it transmits, or look_cost_j; "
                         "looks that cost nothing are taken as often as possible")
    return (settings.transmit_w + settings.receive_w) * airtime_ns * 1e-9


def _airtime_ns(medium: MediumView) -> int | None:
    """Return the time on the air of a request and its answer, None for a medium that has none."""
    frames = {REQUEST_ID: pack_request(0),
              ANSWER_ID: pack_answer(0, ReferenceState(Pose(0.0, 0.0, 0.0), Inputs(0.0, 0.0)))}
    if medium.settings.carries_can_frames:
        encoded = [encode_frame(can_struct(can_id, frame)) for can_id, frame in frames.items()]
        return sum(int(medium.settings.clock.whole_ns(each.nominal_bits, each.data_bits)) for each in encoded)
    radio = medium.settings.radio()
    return None if radio is None else sum(int(radio.airtime_ns(len(frame))) for frame in frames.values())


def interval_tables(team: Mapping[str, Any]) -> dict[tuple[float, ...], IntervalTable]:
    """Return the tables that `prepared_tables` added to the team table; ValueError if it has none."""
    if "optimal_tables" not in team:
        raise ValueError(f"policy={POLICY!r}: the team table has no optimal_tables: they are made before a run")
    return {tuple(each["inputs"]): IntervalTable(each["axes"], each["tau_s"], each["cap_s"], each["shortest_s"])
            for each in team["optimal_tables"]}


def _tables(scenario: ScenarioView, settings: OptimalSettings, look_cost_j: float, progress: Preparing) -> Tables:
    """Return the tables, which are made once for all runs of a process that need the same ones."""
    gains = gains_of(scenario.team)
    key = (msgspec.json.encode(settings), tuple(gains.rows), gains.unified, look_cost_j)
    if key not in _made:
        from agents.tracking.optimal_tables import STEPS_PER_TABLE, make_tables  # late: NumPy and SciPy

        done, steps = count(1), STEPS_PER_TABLE * len(gains.rows)
        progress(PREPARED, 0, steps)
        _made[key] = make_tables(settings, gains, look_cost_j, lambda: progress(PREPARED, next(done), steps))
    return _made[key]


_made: Final[dict[tuple[Hashable, ...], Tables]] = {}
