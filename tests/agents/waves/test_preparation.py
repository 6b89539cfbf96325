"""What `check` refuses of a team that agrees by waves, with the rule and the number."""

from __future__ import annotations

import re

import pytest

from experiments.scenario import ScenarioError, find, load
from netem.wire.instants import in_ms

WAVES, OUTPUTS = find("output_sync_waves"), find("output_sync_unscattered")
UNSURE = ["team.sure=true", "guarantees={}", "expect={}"]


def problems(source, *overrides):
    with pytest.raises(ScenarioError) as error:
        load(source, overrides=list(overrides))
    return [line.removeprefix(f"{source.name}: ") for line in error.value.problems]


def one_delay(keys):
    return f"impairments=[{{ on='radio: * -> *', {keys} }}]"


def test_an_agent_that_is_not_passive_is_refused_with_the_violated_inequality_and_the_number():
    """r2 by its position alone: y = q, in place of q + q': |S|^2 = ((2 + w^2)^2 + 4 w^2) / ((2 - w^2)^2 + 4 w^2)."""
    line, = problems(WAVES, "team.models.r2={ A=[[0.0, 1.0, 0.0], [-2.0, -2.0, 0.0], [1.0, 0.0, 0.0]], "
                            "B=[[0.0], [1.0], [0.0]], C=[[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]] }")

    assert line == ("team.models.r2: the agent behind its 2 ports, A + 2 B C, is not passive: Re G(j omega) = "
                    "-0.166667 at omega = 1.41421 rad/s, expected 0 or more; it reflects 1.73205 times the wave that "
                    "it gets, expected at most 1 (b = 2); waves make delays harmless between passive agents only: add "
                    "damping to the plant, take another output, or correct A if it lacks the dampers of the ports")


def test_a_plant_without_the_dampers_of_its_ports_is_refused():
    line, = problems(WAVES, "team.models.r1.A=[[0.0, 0.0], [1.0, 0.0]]")

    assert "A + 2 B C, is not passive: Re lambda(A - b B C) = 0, expected below 0 (b = 2)" in line


@pytest.mark.parametrize(("own_value", "slots", "stable_ns"), [("late", 8, None), ("late", 9, 172_019_391),
                                                               ("at once", 10, None)])
def test_held_outputs_are_judged_by_the_spectral_radius(own_value, slots, stable_ns):
    keys = [one_delay(f"kind='delay', delay_ms={20 * slots}"), f"team.own_value='{own_value}'", *UNSURE]
    if stable_ns is None:
        assert load(OUTPUTS, overrides=keys)
        return

    line, = problems(OUTPUTS, *keys)

    assert line.startswith("slots of 20 ms, delays of up to 180 ms and own values used late make the loop "
                           "unstable: the exact map of a round has the spectral radius 1.014356, expected below 1; "
                           f"it is stable up to {in_ms(stable_ns)}, 8.601 slots")
    assert load(OUTPUTS, overrides=[one_delay(f"kind='delay', delay_ns={stable_ns}"), *UNSURE])
    assert problems(OUTPUTS, one_delay(f"kind='delay', delay_ns={stable_ns + 1}"), *UNSURE)


@pytest.mark.parametrize("keys", ["kind='delay', delay_ms=60, jitter_ms=40, distribution='uniform'",
                                  "kind='delay', delay_ms=60, during_s=[1.0, 2.0]",
                                  "kind='bernoulli_loss', loss_ratio=0.1"])
def test_what_makes_a_line_give_energy_is_refused_where_waves_are_held_and_outputs_are(keys):
    for source, hold in ((WAVES, "team.when_silent='hold'"), (OUTPUTS, "team.sure=true")):
        line, = problems(source, one_delay(keys), hold, *UNSURE)
        assert line.startswith("impairments[0]: the delay varies or frames are lost")
        assert line.endswith("or set team.sure = false to run it all the same")
    assert load(WAVES, overrides=[one_delay(keys), "guarantees={}"])


def test_a_delay_that_varies_is_constant_where_waves_are_used_later():
    varies = one_delay("kind='delay', delay_ms=60, jitter_ms=40, distribution='uniform'")
    hold = ["team.when_silent='hold'", "guarantees={}"]

    assert load(WAVES, overrides=[varies, *hold, "team.use_after_s=0.1"])
    assert "a team.use_after_s longer than each delay" in problems(WAVES, varies, *hold, "team.use_after_s=0.099")[0]
    line, = problems(WAVES, one_delay("kind='delay', delay_ms=30"), "guarantees={}", "team.use_after_s=0.029")
    assert line == ("team.use_after_s=0.029: a frame from r1 to r2 takes 30 ms or more, so that each of its "
                    "waves comes after it is due; take more")


def test_an_impairment_of_another_link_does_not_count():
    keys = "kind='bernoulli_loss', loss_ratio=0.1"

    assert load(WAVES, overrides=[f"impairments=[{{ on='radio: r1 -> r3', {keys} }}]", "team.when_silent='hold'"])


@pytest.mark.parametrize(("override", "said"), [
    ("team.links=['r1 <-> r2', 'r3 <-> r4', 'r4 <-> r5', 'r5 <-> r3']", "no path leads from r1 to r3"),
    ("team.links=['r1 -> r2']", 'team.links[0]="r1 -> r2": expected "a <-> b"'),
    ("team.links=['r1 <-> r9']", 'team.links[0]="r1 <-> r9": expected "a <-> b"'),
    ("team.slot_s=0.0", "team.slot_s=0.0: expected more than 0"),
    ("team.damping=-1.0", "team.damping=-1.0: expected a positive number"),
    ("team.impedance=-1.0", "team.impedance=-1.0: expected a positive number"),
    ("team.guard_s=0.02", "team.guard_s=0.02: expected 0 or more, and less than half"),
    ("team.use_after_s=-1.0", "team.use_after_s=-1.0: expected 0 or more"),
    ("team.coupling='springs'", "expected one of waves, outputs"),
    ("team.when_silent='repeat'", "expected one of zero, hold"),
    ("team.speed=1", "unknown key"),
    ("team.models.r1.C=[[1.0, 0.0]]", "expected a second row, the integral of the output"),
    ("team.models.r1.x0=[1.0]", "expected 2 values, one per state"),
    ("media.radio.topology={kind='fixed', links=['r1 <-> r2']}", "r3 is to use what r2 sends, but media.radio has no"),
    ("agents.r1.clock.offset_us=10", "clocks are up to 0.01 ms apart"),
])
def test_mistakes_are_told_with_place_value_and_rule(override, said):
    told = problems(WAVES, override, "guarantees={}", "expect={}")

    assert any(said in line for line in told), told


def test_a_slot_shorter_than_its_frame_names_one_that_is_long_enough():
    line, = problems(WAVES, "team.slot_s=0.0001", "media.radio.preset='crazyflie_p2p'", "expect={}")

    least_s = re.search(r"take at least ([0-9.]+)", line)
    assert least_s
    assert load(WAVES, overrides=[f"team.slot_s={least_s[1]}", "media.radio.preset='crazyflie_p2p'", "expect={}"])


def test_a_frame_longer_than_the_radio_carries_is_refused():
    lines = problems(WAVES, "team.links=['r* <-> r*']", "media.radio.preset='crazyflie_p2p'", "expect={}")

    assert ("media.radio.max_payload_bytes=60: a frame with a wave for each neighbour has up to 70 bytes") in lines
