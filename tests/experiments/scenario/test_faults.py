"""What `[[faults]]` accepts, and the line that each mistake gets."""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments.scenario import ScenarioError, load
from netem.wire.instants import NEVER_NS

S = 1_000_000_000
SCENARIO = '''
# Question: what breaks?
seed = 1
length_s = 10.0
[agents_defaults]
program = "agents.examples:Beacon"
[agents.r1]
[agents.r2]
[agents.r3]
[agents.rover]
plant = { fmu = "unicycle" }
[media.radio]
kind = "broadcast_radio"
[media.can]
kind = "can"
bit_rate_bps = 500000
[media.view]
kind = "sensing"
exposure_period_ms = 10
latency_ms = 2
bodies = { rover = ["x", "y", "theta"] }
'''
PROGRAM = '''
class Beacon:
    def __init__(self, board):
        board.port("radio", listen_only=True)
'''


@pytest.fixture
def read(tmp_path: Path):
    def of(faults: str):
        (tmp_path / "beacon.py").write_text(PROGRAM)
        (tmp_path / "f.toml").write_text(SCENARIO.replace("agents.examples:Beacon", "beacon:Beacon") + faults)
        return load(tmp_path / "f.toml").faults
    return of


@pytest.mark.parametrize(("keys", "occurrences"), [
    ("at_s = 4.0", [(4, NEVER_NS / S)]),
    ("at_s = 4.0\nlasts_ms = 500", [(4, 4.5)]),
    ("during_s = [6.0, 8.0]", [(6, 8)]),
    ("during_s = [[6.0, 8.0], [1.0, 2.0], [7.0, 12.0]]", [(1, 2), (6, 8), (7, 12)]),
    ("at_s = 4.0\nlasts_s = 1.0\nevery_s = 2.0\ntimes = 2", [(4, 5), (6, 7)]),
    ("during_s = [4.0, 5.0]\nevery_s = 2.0", [(4, 5), (6, 7), (8, 9)])])
def test_when_a_fault_occurs(read, keys, occurrences):
    fault, = read(f'[[faults]]\nkind = "clock_drift"\non = "r1"\nby_ppm = 1.0\n{keys}\n')

    assert fault.occurrences == tuple((round(start * S), end * S if end * S == NEVER_NS else round(end * S))
                                      for start, end in occurrences)


@pytest.mark.parametrize(("fault", "line"), [
    ('kind = "kil"\non = "r1"', "faults[0].kind=\"kil\": no such kind; did you mean \"kill\"?"),
    ('on = "r1"', "faults[0].kind: is missing"),
    ('kind = "kill"\nat_s = 1', "faults[0].on: is missing"),
    ('kind = "kill"\non = "r4"\nat_s = 1', "faults[0].on=\"r4\": 'r4' names no node of the scenario: nearest: 'r"),
    ('kind = "kill"\non = "r1"\nat_s = 10.0', "faults[0].at_s=10.0"),
    ('kind = "kill"\non = "r1"', "one of at_s, during_s and rate_per_s"),
    ('kind = "kill"\non = "r1"\nat_s = 1\nrate_per_s = 0.1', "at_s and rate_per_s are given: a fault has exactly one"),
    ('kind = "kill"\non = "r1"\nduring_s = [1, 2]', "happens at an instant"),
    ('kind = "kill"\non = "r1"\nat_s = 1\nrestart_after_s = -1', "a node restarts after it was killed"),
    ('kind = "kill"\non = "r1"\nat_s = 1\nrestrat_after_s = 1',
     "faults[0].restrat_after_s=1: unknown key; did you mean \"restart_after_s\"?"),
    ('kind = "kill"\non = "r1"\nat_s = 1\n[[faults]]\nkind = "pause"\non = "r*"\nduring_s = [2, 3]',
     "faults[1]: pause of r1 at 2 s: faults[0] (kill) takes it away from 1 s for ever"),
    ('kind = "kill"\non = "r1"\nat_s = 1\nrestart_after_s = 3\nevery_s = 2', "takes it away from 1 s until 4 s"),
    ('kind = "pause"\non = "r1"\nrate_per_s = 1.0', "lasts_s is missing"),
    ('kind = "clock_step"\non = "r1"\nat_s = 1\nby_ms = 0', "a step changes the clock"),
    ('kind = "link_down"\non = "radio: r1 -> r9"\nat_s = 1', "'r9' names no node on medium 'radio'"),
    ('kind = "partition"\non = "radoi"\nat_s = 1\nshape = "halves"', "nearest: 'radio'"),
    ('kind = "partition"\non = "radio"\nat_s = 1\ngroups = [["r1", "r2", "r3"]]',
     "leave all nodes of 'radio' connected"),
    ('kind = "partition"\non = "radio"\nat_s = 1\ngroups = [["r1"], ["r9"]]', "'r9' names no node on medium 'radio'"),
    ('kind = "partition"\non = "radio"\nat_s = 1\ngroups = [["r1"], ["r1"]]', "'r1' is in two groups"),
    ('kind = "partition"\non = "radio"\nat_s = 1\nshape = "star"', "expected 'halves', 'ring', 'bridge' or 'isolate'"),
    ('kind = "partition"\non = "can"\nat_s = 1\nshape = "halves"\ncarriers = "stop"',
     "faults[0].carriers=\"stop\": 'can' is a medium without carriers, which others could sense or lose frames by: "
     "leave the key out"),
    ('kind = "link_down"\non = "view: rover -> r1"\nat_s = 1\ncarriers = "cross"',
     "faults[0].carriers=\"cross\": 'view' is a medium without carriers"),
    ('kind = "partition"\non = "radio"\nat_s = 1\nshape = "halves"\ncarriers = "sotp"', "expected 'cross' or 'stop'"),
    ('kind = "pause"\non = "r1"\nduring_s = [3, 2]', "0 <= start < end"),
    ('kind = "pause"\non = "r1"\nduring_s = "x"', "faults[0].during_s=\"x\": expected a number of seconds"),
    ('kind = "kill"\non = "rover"\nat_s = 1\ninputs_when_dead = { v_cmnd = 0.0 }',
     'no such input of unicycle; did you mean "v_cmd"'),
    ('kind = "plant_input"\non = "r1"\nat_s = 1\nvariable = "v_cmd"\nvalue = 0.0', "r1 has no plant"),
    ('kind = "plant_input"\non = "rover"\nat_s = 1\nvariable = "v_cmnd"\nvalue = 0.0',
     'faults[0].variable="v_cmnd": no such input of unicycle; did you mean "v_cmd"'),
    ('kind = "plant_input"\non = "rover"\nat_s = 1\nvariable = "track_m"\nvalue = 0.0', "is a parameter"),
    ('kind = "plant_input"\non = "rover"\nat_s = 1\nvariable = "v_cmd"\nvalue = "fast"', "expected a number"),
    ('kind = "plant_input"\non = "rover"\nat_s = 1\nvariable = "v_cmd"\nvalue = 1.0\nbias = 1.0',
     "exactly one of value, factor and bias, got value and bias"),
    ('kind = "plant_parameter"\non = "rover"\nat_s = 1\nvariable = "track_m"\nfactor = 0.5',
     'faults[0].variable="track_m": is a parameter that cannot be changed while the plant runs'),
    ('kind = "plant_parameter"\non = "rover"\nat_s = 1\nvariable = "slip_left"\nvalue = 1.5', "expected -1 to 1"),
    ('kind = "slow"\non = "r1"\nat_s = 1\nfactor = 2.0', "r1 runs a program without execution times"),
    ('kind = "slow"\non = "r1"\nat_s = 1\nfactor = 0.5', "faults[0].factor=0.5: expected a finite number >= 1"),
    ('kind = "jam"\non = "can"\nat_s = 1\nnodes = ["r1"]',
     'faults[0].on="can": can is a medium of kind can, which takes no fault of kind jam: it takes link_down, '),
    ('kind = "jam"\non = "radio"\nat_s = 1', "expected either a zone or nodes"),
    ('kind = "jam"\non = "radio"\nat_s = 1\nnodes = ["r9"]', "'r9' names no node on medium 'radio'"),
    ('kind = "jam"\non = "radio"\nat_s = 1\nnodes = ["r1"]\nduty_cycle = 0.5', "below 1 it needs a period"),
    ('kind = "jam"\non = "radio"\nat_s = 1\nzone = { kind = "circle", low_m = [0, 0], high_m = [1, 1] }',
     "low_m and high_m of a rectangle, or centre_m and radius_m of a circle"),
    ('kind = "jam"\non = "radio"\nat_s = 1\nzone = { kind = "circle", centre_m = [0, 0], radius_m = 5 }',
     'faults[0].zone={ kind = "circle", centre_m = [0, 0], radius_m = 5 }: no node on \'radio\' stands anywhere, so '
     'none is in the zone: give agents at_m = [x, y], or name nodes in place of the zone'),
    ('kind = "blackout"\non = "radio: r1 -> r2"\nat_s = 1', "takes no fault of kind blackout"),
    ('kind = "bias"\non = "view: rover -> r1"\nat_s = 1\nby_m = [1.0]', "expected [x, y] or [x, y, z]"),
    ('kind = "noise"\non = "view: rover -> r1"\nat_s = 1\nsigma_m = 0.0', "expected more than 0"),
    ('kind = "bus_off"\non = "can"\nat_s = 1', "faults[0].nodes: is missing"),
    ('kind = "babble"\non = "can"\nat_s = 1\nnodes = ["r1"]\ncan_id = 2048', "expected an identifier of 11 bits"),
    ('kind = "stuck_dominant"\non = "radio"\nat_s = 1', "takes no fault of kind stuck_dominant"),
    ('name = "x"\nkind = "pause"\non = "r1"\nduring_s = [1, 2]\n[[faults]]\nname = "x"\nkind = "pause"\non = "r2"\n'
     'during_s = [1, 2]', "give each a name of its own")])
def test_a_mistake_is_told_with_its_place(read, fault, line):
    with pytest.raises(ScenarioError) as refusal:
        read(f"[[faults]]\n{fault}\n")

    found = [problem for problem in refusal.value.problems if line in problem]
    assert found, refusal.value.problems
    assert found[0].startswith("f.toml: faults[")


@pytest.mark.parametrize(("part", "with_positions"), [
    ("[agents.r2]", "[agents.r2]\nat_m = [1.0, 0.0]"),
    ('kind = "broadcast_radio"', 'kind = "broadcast_radio"\n'
     'topology = { kind = "positions", bodies = { rover = ["x", "y"] }, at_m = { r1 = [0, 0], r2 = [1, 0], '
     'r3 = [2, 0] } }')])
def test_a_zone_needs_a_node_whose_position_its_radio_knows(tmp_path, read, part, with_positions):
    zone = ('[[faults]]\nkind = "jam"\non = "radio"\nat_s = 1\n'
            'zone = { kind = "circle", centre_m = [0, 0], radius_m = 5 }\n')
    with pytest.raises(ScenarioError, match="stands anywhere"):
        read(zone)
    (tmp_path / "f.toml").write_text((tmp_path / "f.toml").read_text().replace(part, with_positions))

    assert [fault.targets for fault in load(tmp_path / "f.toml").faults] == [(("radio",),)]


def test_a_list_is_expected(read):
    with pytest.raises(ScenarioError, match=r"faults=.*expected a list: write \[\[faults\]\]"):
        read("[faults]\nkind = 1\n")
