"""Checks whether the assumptions of a decision still hold; called by a robot, a run's monitor or a test.

The decision checked is the one *in force*: the wheels follow the command computed from its measurement. A newer
decision whose command has not reached the drive is not in force. A failed assumption is a `Violation` with its name,
the instant from which on it fails, and the two numbers compared.

    FRESH            age of the measurement in force <= tau_i                        (4.37)
    SMALL_GAIN       gamma_n gamma_e(age) < 1                                        Theorem 4; later than FRESH
    LOSSES           no more attempts in a row failed than fit into tau_i            Remark 6
    SPACING          two measurements are at least the Zeno bound apart              Remark 4
    INPUTS           the inputs of the reference lie in P                            Theorem 4 (i)
    ANNOUNCED        inputs change only at instants that are transmitted at          Assumption 1
    GAIN             the gain of these inputs is known, not just bounded by Z        section 4.6
    REGION               |x| is within the region of the gain in use                 policy `regional_gains`
    COMMAND              the drive does what is commanded                            (4.42); known limits of the drive
    RADIUS           |x| is within what was certified                                Remark 4; periodic measurements
    TABLE            x is within the table of intervals, C_x                         section 5.2.3; optimal intervals
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from math import sqrt

from agents.triggering.error_gain import horizon_s
from agents.triggering.gain_table import GainTable
from agents.triggering.policies import Decision


class Assumption(Enum):
    FRESH = "age of information"
    SMALL_GAIN = "small-gain product"
    LOSSES = "successive losses"
    SPACING = "time between measurements"
    INPUTS = "inputs of the reference"
    ANNOUNCED = "announcement of inputs"
    GAIN = "gain of the inputs"
    RADIUS = "tracking error"
    REGION = "region of the gain"
    COMMAND = "command"
    TABLE = "table of intervals"


@dataclass(frozen=True)
class Violation:
    assumption: Assumption
    at_ns: int              # first instant of the violation
    value: float
    limit: float
    text: str               # one clause for the record: what, value, limit

    def __str__(self) -> str:
        return f"{self.assumption.value}: {self.text}"


def violations(in_force: Decision, now_ns: int, failed_attempts: int = 0) -> list[Violation]:
    """Return violations of FRESH, SMALL_GAIN and LOSSES at `now_ns`; empty up to the certificate's end, included."""
    found = []
    age_s, tau_s = (now_ns - in_force.measured_ns) * 1e-9, in_force.valid_ns * 1e-9
    if now_ns > in_force.holds_until_ns:
        found.append(Violation(Assumption.FRESH, in_force.holds_until_ns, age_s, tau_s,
                               f"the measurement in force is {age_s:.9g} s old, certified for {tau_s:.9g} s"))
    product = in_force.gain_product(now_ns)
    if product >= 1:
        reached_s = horizon_s(in_force.growth_per_s, in_force.gain_per_s, 1.0)
        found.append(Violation(Assumption.SMALL_GAIN, in_force.measured_ns + int(reached_s * 1e9), product, 1.0,
                               f"gamma_n gamma_e = {product:.6g} after {age_s:.6g} s, expected below 1"))
    if failed_attempts > in_force.losses_allowed:
        found.append(Violation(Assumption.LOSSES, in_force.attempt_ns(in_force.losses_allowed), failed_attempts,
                               in_force.losses_allowed,
                               f"{failed_attempts} attempts in a row failed, {in_force.losses_allowed} are allowed"))
    return found


def delay_violations(decision: Decision) -> list[Violation]:
    """Return the violation of FRESH that will come with certainty, as the delay of looks leaves no interval."""
    if decision.in_time:
        return []
    delay_s, tau_s = decision.delay_ns * 1e-9, decision.valid_ns * 1e-9
    return [Violation(Assumption.FRESH, decision.holds_until_ns, delay_s, tau_s,
                      f"a look takes {delay_s:.6g} s until its command acts, and its measurement is certified for "
                      f"{tau_s:.6g} s, which leaves no interval as long as a look's frames")]


def spacing_violations(measured_ns: int, previous_ns: int, zeno_ns: int) -> list[Violation]:
    """Return violations of SPACING; not for measurements forced by a change of inputs, which no trigger decided."""
    apart_ns = measured_ns - previous_ns
    if apart_ns >= zeno_ns:
        return []
    return [Violation(Assumption.SPACING, measured_ns, apart_ns * 1e-9, zeno_ns * 1e-9,
                      f"{apart_ns * 1e-9:.6g} s after the last one, expected at least {zeno_ns * 1e-9:.6g} s")]


def input_violations(at_ns: int, inputs: tuple[float, ...], limits: tuple[float, ...],
                     gains: GainTable) -> list[Violation]:
    """Return violations of INPUTS and GAIN by measured inputs."""
    for value, limit in zip(inputs, limits, strict=True):
        if not abs(value) <= limit:
            return [Violation(Assumption.INPUTS, at_ns, value, limit,
                              f"{_listed(inputs)}, expected magnitudes of at most {_listed(limits)}")]
    if not gains.planned(inputs):
        return [Violation(Assumption.GAIN, at_ns, gains.unified, gains.unified,
                          f"none is known for {_listed(inputs)}; the unified gain {gains.unified:g} 1/s is used")]
    return []


def announcement_violations(at_ns: int, inputs: tuple[float, ...], before: tuple[float, ...]) -> list[Violation]:
    """Return violations of ANNOUNCED by inputs received without an announcement; `before` are the previous inputs."""
    if tuple(inputs) == tuple(before):
        return []
    change = _norm([now - then for now, then in zip(inputs, before, strict=True)])
    return [Violation(Assumption.ANNOUNCED, at_ns, change, 0.0,
                      f"{_listed(before)} became {_listed(inputs)} unannounced, since the measurement before")]


def radius_violations(at_ns: int, x: Sequence[float], radius: float, noise: float = 0.0) -> list[Violation]:
    """Return violations of RADIUS by a measurement with an error of up to `noise` in each component."""
    norm, limit = _norm(x), radius + noise * sqrt(len(x))
    if norm <= limit:
        return []
    return [Violation(Assumption.RADIUS, at_ns, norm, limit, f"|x| = {norm:.6g}, certified up to {limit:.6g}")]


def region_violations(at_ns: int, x: Sequence[float], before: Decision | None, noise: float = 0.0) -> list[Violation]:
    """Return violations of REGION: x, with an error of up to `noise` in each component, is a state outside the region
    of the gain with which the decision `before` was made."""
    if before is None:
        return []
    norm, limit = _norm(x), before.radius + noise * sqrt(len(x))
    if norm <= limit:
        return []
    return [Violation(Assumption.REGION, at_ns, norm, limit,
                      f"|x| = {norm:.6g}, the gain {before.gain_per_s:g} 1/s counts up to {before.radius:g}")]


def command_violations(at_ns: int, wanted: float, limit: float) -> list[Violation]:
    """Return violations of COMMAND by a command that needs `wanted` of what the drive gives at most."""
    if wanted <= limit:
        return []
    return [Violation(Assumption.COMMAND, at_ns, wanted, limit,
                      f"it needs {wanted:.6g} m/s of a wheel's rim, which turns at {limit:g} m/s at most")]


def table_violations(decision: Decision, x: Sequence[float]) -> list[Violation]:
    """Return violations of TABLE by the state x that `decision` was made for."""
    if not decision.clamped:
        return []
    return [Violation(Assumption.TABLE, decision.measured_ns, 1.0, 0.0,
                      f"x = {_listed(x)} is outside of it and clamped to its edge")]


def _norm(values: Sequence[float]) -> float:
    """Return the 2-norm, summed in the order of the values as robots in C do."""
    total = values[0] * values[0]
    for value in values[1:]:
        total += value * value
    return sqrt(total)


def _listed(values: Sequence[float]) -> str:
    return f"({', '.join(f'{value:.9g}' for value in values)})"
