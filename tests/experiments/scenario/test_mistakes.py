"""Each line of the file that is wrong comes out as one line with place, value, rule and remedy; all come at once."""

from __future__ import annotations

import pytest

from experiments.scenario import ScenarioError, load
from netem.gateways.addresses import ADDRESS_RULE, BEYOND_RULE
from netem.gateways.tcp import NO_CAN

EACH = [
    # header
    ("seed = 7", "sead = 7", ['sead=7: unknown key; did you mean "seed"?']),
    ("seed = 7\n", "", ["seed: is missing"]),
    ("seed = 7", "seed = true", ["seed=true: expected a whole number"]),
    ("seed = 7", "seed = 7.5", ["seed=7.5: expected a whole number"]),
    ("seed = 7", "seed = -1", ["seed=-1: expected >= 0"]),
    ("seed = 7", "seed = 99999999999999999999", ["seed=99999999999999999999: expected a number that fits 64 bits"]),
    ("length_s = 2.5\n", "", ["length_s: is missing; write it in one of length_s, length_ms, length_us, length_ns"]),
    ("length_s = 2.5", "length_s = -2.5", ["length_s=-2.5: expected > 0"]),
    ("length_s = 2.5", "length_s = nan", ["length_s=nan: expected a finite number"]),
    ("length_s = 2.5", "length_s = inf", ["length_s=inf: expected a finite number"]),
    ("length_s = 2.5", "length_s = true", ["length_s=true: expected a number of seconds"]),
    ("length_s = 2.5", "length_s = 2.5\nlength_ms = 2500",
     ["length_ms=2500: the same as length_s, which is given too; keep one"]),
    ("length_s = 2.5", "length_s = 1e-11", ["length_s=1e-11: less than half a nanosecond, the resolution of simulated "
                                           "time; write 0 or at least 1 ns"]),
    ("length_s = 2.5", "length_s = 1e10", ["length_s=10000000000.0: expected less than 4611686018 seconds, the end of "
                                          "time"]),
    ("length_s = 2.5", "length_s = 2.5\nnode_timeout_s = 0", ["node_timeout_s=0: expected > 0"]),
    ("length_s = 2.5", "length_s = 2.5\nsample_period_s = 2020-01-01",
     ["sample_period_s=2020-01-01: dates and times of day mean nothing to a scenario; put text in quotes"]),
    # the signal that the question is about
    ("seed = 7", 'seed = 7\nquestion_signal = "y"',
     ['question_signal="y": expected "node.signal", for example "*.y"']),
    ("seed = 7", 'seed = 7\nquestion_signal = "r9.y"',
     ['question_signal="r9.y": no agent, derived signal or medium matches \'r9\'; did you mean "r2"?']),
    ("seed = 7", "seed = 7\nquestion_signal = 3", ["question_signal=3: expected text in quotes"]),
    ("[team.models.r1]", 'question_signal = "e.nrom"\n[derived.e]\nfunction = "math:hypot"\nof = ["r1.y"]\n'
     'signals = { norm = "1" }\n[team.models.r1]',
     ['question_signal="e.nrom": derived.e has no signal \'nrom\'; did you mean "norm"?']),
    # gateways
    ("[media.quiet]",
     '[gateways.g]\nmedium = "radoi"\nlisten = "10.0.0.1:80"\npeer = "127.0.0.1:99999"\n[media.quiet]',
     ['gateways.g.medium="radoi": no such medium; did you mean "radio"?',
      f'gateways.g.listen="10.0.0.1:80": {BEYOND_RULE}', f'gateways.g.peer="127.0.0.1:99999": {ADDRESS_RULE}']),
    ("[media.quiet]", '[gateways.g]\nmedium = "radio"\nkind = "upd"\nlisten = "nowhere"\n[media.quiet]',
     ['gateways.g.kind="upd": no such kind; did you mean "udp"?']),
    ("[media.quiet]", '[gateways.g]\nmedium = "radio"\nlistens = 1\n[media.quiet]',
     ['gateways.g.listens=1: unknown key; did you mean "listen"?']),
    ("[media.quiet]", '[gateways.g]\nmedium = "radio"\nlisten = "0.0.0.0:80"\nonly_from = ["10.0.0.0/99"]\n'
     "[media.quiet]",
     ['gateways.g.only_from=10.0.0.0/99: expected an IP address or a network, for example "192.168.1.20" or '
      '"192.168.1.0/24"']),
    ("[media.quiet]", '[gateways.g]\nmedium = "radio"\nlisten = "0.0.0.0:80"\nonly_from = ["10.0.0.0/8"]\n'
     'peer = "11.0.0.1:14550"\nforget_after_s = -1\n[media.quiet]',
     ['gateways.g.peer="11.0.0.1:14550": is not among only_from = [\'10.0.0.0/8\']; add it there',
      "gateways.g.forget_after_s=-1 (forget_after_ns=-1000000000): expected at least 0"]),
    ("[media.quiet]", '[gateways.g]\nmedium = "radio"\nlisten = "127.0.0.1:81"\n[gateways.h]\nmedium = "radio"\n'
     'listen = "127.0.0.1:81"\n[gateways.i]\nmedium = "radio"\nkind = "tcp"\nlisten = "127.0.0.1:81"\n[media.quiet]',
     ["gateways.h: has the UDP address 127.0.0.1:81, which gateways.g has already; give each one of its own, or let "
      "the clients share one gateway"]),
    ("[media.quiet]", '[gateways.g]\nmedium = "radio"\nkind = "tcp"\n[media.quiet]',
     ['gateways.g: expected one of listen = "127.0.0.1:5760" and connect = "127.0.0.1:5760"']),
    ("[media.quiet]", '[gateways.g]\nmedium = "radio"\nkind = "tcp"\nconnect = "localhost:5760"\n[media.quiet]',
     [f'gateways.g.connect="localhost:5760": {ADDRESS_RULE}']),
    ("[media.quiet]", '[gateways.g]\nmedium = "radio"\nkind = "serial"\ndevice = "/dev/ttyX"\npty = "x"\n'
     '[media.quiet]', ['gateways.g: expected one of device = "/dev/ttyUSB0" and pty = "path of the link to make"']),
    ("[media.quiet]", '[gateways.g]\nmedium = "quiet"\nkind = "tcp"\nlisten = "127.0.0.1:0"\n[media.quiet]\n'
     'kind = "can"\nbit_rate_bps = 500_000\n[media.unused]', [f'gateways.g.medium="quiet": {NO_CAN}']),
    ("[media.quiet]", "[gateways]\ng = 1\n[media.quiet]", ["gateways.g=1: expected a table"]),
    ("[media.quiet]", "[records.pcap]\n[media.quiet]", ['records.pcap: no such recorder; did you mean "pcapng"?']),
    ("[media.quiet]", '[gateways.r1]\nmedium = "radio"\n[media.quiet]',
     ["gateways.r1: is the name of an agent already; take another one"]),
    # derived signals
    ("[expect]", '[derived.r1]\nfunction = "own_functions:f"\nof = ["r1.y"]\nsignals = { e = "1" }\n[expect]',
     ["derived.r1: is the name of an agent already; take another one",
      "derived.r1.function=\"own_functions:f\": there is no module 'own_functions'"]),
    ("[expect]", '[derived.e]\nfunction = "math:hypot"\nof = ["r9.y", "r1"]\nsignals = { e = "1" }\n[expect]',
     ['derived.e.of[0]="r9.y": there is no agent or earlier derived signal \'r9\'; did you mean "r2"?',
      'derived.e.of[1]="r1": expected "node.signal"']),
    ("[expect]", '[derived.e]\nfunction = "math:hypo"\nof = []\nsignals = {}\n[expect]',
     ["derived.e.function=\"math:hypo\": there is no function 'hypo' in math",
      'derived.e.of=[]: expected at least one signal, "node.signal"',
      'derived.e.signals={}: expected at least one, { name = "unit" }']),
    ("{ max = 1e-3 }", "{ max = 1e-3, during_s = [2.0, 1.0] }",
     ['expect."*.y.last_abs"={ max = 0.001, during_s = [2.0, 1.0] }: during: expected 0 <= start < end']),
    ("{ max = 1e-3 }", "{ max = 1e-3 }\nmax_successive_losses = { max = 3, during_s = [0, 1] }",
     ["expect.max_successive_losses={ max = 3, during_s = [0, 1] }: during: only signals, numbers of frames and the "
      "delivery ratio can be judged over a part of the run"]),
    # agents
    ('"robots_of_the_tests:Talker"', '"robots_of_the_test:Talker"',
     ['agents_defaults.program="robots_of_the_test:Talker": there is no module \'robots_of_the_test\'; '
      'did you mean "robots_of_the_tests"?']),
    ('"robots_of_the_tests:Talker"', '"robots_of_the_tests:Walker"',
     ['agents_defaults.program="robots_of_the_tests:Walker": Walker is not in robots_of_the_tests; '
      'did you mean "Talker"?']),
    ('"robots_of_the_tests:Talker"', '"robots_of_the_tests:Boardless"',
     ['agents_defaults.program="robots_of_the_tests:Boardless": takes no board: Boardless() has no positional '
      "argument"]),
    ('"robots_of_the_tests:Talker"', '"robots_of_the_tests.Talker"',
     ["agents_defaults.program=\"robots_of_the_tests.Talker\": expected 'package.module:Class' or "
      "'package.module:function'"]),
    ('"robots_of_the_tests:Talker"', '""', ["agents_defaults.program=\"\": expected 'package.module:Class' or "
      "'package.module:function'"]),
    ('program = "robots_of_the_tests:Talker"', "", ["agents.r1.program: is missing (2 agents: r1, r2)"]),
    ("parameters = { slot_ms = 1.1 }", "parameters = { slit_ms = 1.1 }",
     ['agents.r1.parameters.slit_ms=1.1: unknown key; did you mean "slot_ms"?']),
    ("parameters = { slot_ms = 1.1 }", 'parameters = { slot_ms = 1.1, gain = "high" }',
     ['agents.r1.parameters.gain="high": expected a number']),
    ("[agents.r2]", '[agents.r2]\nprogram = "robots_of_the_tests:Strict"', ["agents.r2.parameters.gain: is missing"]),
    ("clock = { offset_us = 5 }", "clock = { offset_us = 5, drift = 3 }",
     ['agents.r1.clock.drift=3: unknown key; did you mean "drift_ppm"?']),
    ("clock = { offset_us = 5 }", "clock = { tick_us = 0 }",
     ["agents.r1.clock.tick_us=0 (tick_ns=0): expected at least 1"]),
    ('"linear_system"', '"linear_sistem"',
     ['agents.r1.plant.fmu="linear_sistem": no such model; did you mean "linear_system"? '
      "(or give the path of a .fmu)"]),
    ('"linear_system"', '"plants/mine.fmu"',
     ['agents.r1.plant.fmu="plants/mine.fmu": no such file; there are none']),
    ('"team.models.r1"', '"team.models.r9"',
     ['agents.r1.plant.parameters_from="team.models.r9": team.models has no \'r9\'; did you mean "r1"?']),
    ("A = [[-1.0, 2.0], [0.0, -3.0]]", "A = [[-1.0, 2.0], [0.0]]",
     ["team.models.r1.A=[[-1.0, 2.0], [0.0]]: its rows differ in length: a matrix is a list of rows of equal length"]),
    ("A = [[-1.0, 2.0], [0.0, -3.0]]", 'A = [["x"]]', ['team.models.r1.A=[["x"]]: A[1,1]: expected a number']),
    ('parameters_from = "team.models.r1"', "parameters = { AA = 1.0 }",
     ['agents.r1.plant.parameters.AA=1.0: no such parameter or start value; did you mean "A"?']),
    ("at_m = [0.0, 1.0]", "at_m = [0.0]", ["agents.r1.at_m=[0.0]: expected [x, y] or [x, y, z]"]),
    ('media = ["radio"]', 'media = ["raido"]', ['agents.r2.media[0]="raido": no such medium; did you mean "radio"?']),
    ("[agents.r2]", '[agents."r/2"]',
     ['agents."r/2": a name has letters, digits, - and _, and starts with a letter',
      "impairments[0].on=\"radio: r1 -> r2\": 'radio: r1 -> r2': 'r2' names no node on medium 'radio': "
      "nearest: 'r/2'"]),
    # media
    ('kind = "broadcast_radio"\npreset', 'kind = "broadcast_radoi"\npreset',
     ['media.radio.kind="broadcast_radoi": no such kind; did you mean "broadcast_radio"?']),
    ('preset = "crazyflie_p2p"', 'preset = "crazyflie"',
     ["media.radio.preset=\"crazyflie\": no such radio: did you mean 'crazyflie_p2p'?"]),
    ('preset = "crazyflie_p2p"', 'decode = "locl"',
     ["media.radio.decode=\"locl\": expected 'radio_network', 'local' or 'capture'; did you mean \"local\"?"]),
    ('preset = "crazyflie_p2p"', "bitrate_bps = 5",
     ['media.radio.bitrate_bps=5: unknown key; did you mean "bit_rate_bps"?']),
    ('preset = "crazyflie_p2p"', 'topology = { kind = "fixed", links = ["r1 -> r3"] }',
     ["media.radio: link 'r1 -> r3': no node is called 'r3': the nodes are r1, r2"]),
    ('preset = "crazyflie_p2p"', 'topology = { kind = "fixd" }',
     ['media.radio.topology.kind="fixd": no such kind; did you mean "fixed"?']),
    ('preset = "crazyflie_p2p"', 'topology = { kind = "switching", graphs = { L1 = ["* -> *"] }, schedule = '
                                 '[{ at_s = "now", graph = "L1" }, { at_ms = 5, grph = "L1" }], repeat_s = "x" }',
     ['media.radio.topology.schedule[0].at_s="now": expected a number of seconds',
      'media.radio.topology.schedule[1].grph="L1": unknown key; did you mean "graph"?',
      'media.radio.topology.repeat_s="x": expected a number of seconds']),
    ('preset = "crazyflie_p2p"', 'topology = { kind = "switching", graphs = { L1 = ["* -> *"] }, schedule = '
                                 '[{ at_s = 0, graph = 3 }], level_dbm = "loud" }',
     ['media.radio.topology.schedule[0].graph=3: expected text in quotes',
      'media.radio.topology.level_dbm="loud": expected a number']),
    # impairments
    ("loss_ratio = 0.25", "loss_ratio = 1.25",
     ["impairments[0].loss_ratio=1.25: expected 0 <= loss_ratio < 1"]),
    ("mean_burst_frames = 3.0", "mean_burst_frames = 0.5",
     ["impairments[0].mean_burst_frames=0.5: a burst holds at least 1 frame"]),
    ("mean_burst_frames = 3.0\n", "", ["impairments[0].mean_burst_frames: is missing"]),
    ("mean_burst_frames = 3.0", "mean_burst = 3.0",
     ['impairments[0].mean_burst=3.0: unknown key; did you mean "mean_burst_frames"?']),
    ('kind = "gilbert_elliott"\n', "", ["impairments[0].kind: is missing; there are bernoulli_loss, corrupt, delay, "
                                        "duplicate, four_state_loss, gemodel, gilbert_elliott, "
                                        "gilbert_elliott_by_time, rate_limit, reorder, scripted_corruption, "
                                        "scripted_delay, scripted_duplicate, scripted_loss, trace"]),
    ("during_s = [0.5, 1.0]", "during_s = [1.0, 0.5]",
     ["impairments[0].during_s=[1.0, 0.5]: expected 0 <= start < end"]),
    ("during_s = [0.5, 1.0]", "during_s = [0.5, 0.5]",
     ["impairments[0].during_s=[0.5, 0.5]: expected 0 <= start < end"]),
    ("during_s = [0.5, 1.0]", "during_s = []",
     ["impairments[0].during_s=[]: expected [start, end], or a list of such windows"]),
    ("during_s = [0.5, 1.0]", "during_s = [[0.5, 1.0], [0.75, 2.0]]",
     ["impairments[0].during_s=[[0.5, 1.0], [0.75, 2.0]] (during_ns=[(500000000, 1000000000), (750000000, "
      "2000000000)]): intervals overlap: merge them"]),
    ("during_s = [0.5, 1.0]", 'during_s = ["a", 0.5]',
     ['impairments[0].during_s[0]="a": expected a number of seconds']),
    ("during_s = [0.5, 1.0]", "during_s = 0.5", ["impairments[0].during_s=0.5: expected a list"]),
    ("during_s = [0.5, 1.0]", "during_s = [[0.1, 0.2], [0.3]]",
     ["impairments[0].during_s[1]=[0.3]: expected [start, end], or a list of such windows"]),
    ("delay_us = 20", "delay_us = -20", ["impairments[1].delay_us=-20 (delay_ns=-20000): expected delay_ns >= 0"]),
    ("delay_us = 20", "delay_min = 20", ['impairments[1].delay_min=20: unknown key; did you mean "delay_ns"?']),
    ('on = "radio: r1 -> r2"', 'on = "radio: r1 -> r3"',
     ["impairments[0].on=\"radio: r1 -> r3\": 'radio: r1 -> r3': 'r3' names no node on medium 'radio': nearest: 'r2'"]),
    # expectations
    ("frames_lost_on_link = { min = 1 }", "frames_lots = { min = 1 }",
     ["expect.frames_lots: expected <metric>, <medium>.<metric>, <node>.<signal>.<statistic>, "
      "count.<node>.<counter>, guarantee.<name>.<figure> or real_time.<figure>; nearest: frames_lost_on_link"]),
    ("frames_lost_on_link = { min = 1 }", "frames_lost_on_link = {}",
     ["expect.frames_lost_on_link={}: expects nothing; give min, max or both"]),
    ("frames_lost_on_link = { min = 1 }", "frames_lost_on_link = { min = 3, max = 1 }",
     ["expect.frames_lost_on_link={ min = 3, max = 1 }: expected min <= max"]),
    ("frames_lost_on_link = { min = 1 }", "frames_lost_on_link = { least = 1 }",
     ["expect.frames_lost_on_link.least=1: unknown key; there are min, max, during_s, during_ms, "
      "during_us, during_ns, formula, share"]),
    ("frames_lost_on_link = { min = 1 }", "frames_lost_on_link = 1",
     ["expect.frames_lost_on_link=1: expected a table"]),
]


@pytest.mark.parametrize(("right", "wrong", "lines"), EACH, ids=[wrong.splitlines()[0] if wrong else f"no {right}"
                                                                  for right, wrong, _ in EACH])
def test_a_mistake_is_one_line_with_place_value_rule_and_remedy(right, wrong, lines, valid, write):
    assert valid.count(right) >= 1

    with pytest.raises(ScenarioError) as error:
        load(write(valid.replace(right, wrong, 1)))

    assert error.value.problems == [f"few.toml: {line}" for line in lines]


def test_mistakes_in_every_section_are_reported_in_one_go(valid, write):
    several = [case for case in EACH if case[0] in (
        "seed = 7", "parameters = { slot_ms = 1.1 }", '"team.models.r1"', 'preset = "crazyflie_p2p"',
        "loss_ratio = 0.25", "delay_us = 20", "frames_lost_on_link = { min = 1 }", 'media = ["radio"]')]
    one_each = {right: (wrong, lines) for right, wrong, lines in reversed(several)}
    text = valid
    for right, (wrong, _) in one_each.items():
        text = text.replace(right, wrong, 1)

    with pytest.raises(ScenarioError) as error:
        load(write(text))

    expected = [f"few.toml: {line}" for _, lines in one_each.values() for line in lines]
    assert len(one_each) == 8
    assert sorted(error.value.problems) == sorted(expected)


def test_broken_toml_is_reported_with_its_line(valid, write):
    with pytest.raises(ScenarioError) as error:
        load(write(valid.replace("seed = 7", "seed 7")))

    assert error.value.problems == [
        "few.toml: line 4, column 6: not TOML: expected '=' after a key in a key/value pair"]


def test_a_file_that_ends_too_early_is_reported_with_its_last_line(write):
    with pytest.raises(ScenarioError) as error:
        load(write('seed = 7\nteam = { a = "'))

    assert error.value.problems == ["few.toml: line 2: not TOML: unterminated string"]


def test_bytes_that_are_no_text_are_reported(write, valid):
    path = write(valid)
    path.write_bytes(b"seed = 7\n# \xff\n")

    with pytest.raises(ScenarioError) as error:
        load(path)

    assert error.value.problems == ["few.toml: byte 11 is not UTF-8, the encoding of TOML"]


def test_an_empty_file_names_what_a_scenario_needs(write):
    with pytest.raises(ScenarioError) as error:
        load(write(""))

    assert [line.split(":")[1] for line in error.value.problems] == [" seed", " length_s", " agents"]


def test_bottomless_nesting_is_refused_in_one_line(write, valid):
    with pytest.raises(ScenarioError) as error:
        load(write(valid + "[x" + ".x" * 60 + "]\n"))
    with pytest.raises(ScenarioError) as brackets:
        load(write("a = " + "[" * 100_000))

    assert error.value.problems == ["few.toml: x: nested too deeply; at most 40 tables and lists"]
    assert brackets.value.problems == ["few.toml: nested too deeply; at most 40 tables and lists"]


def test_a_program_may_refuse_the_run_once_for_all_its_robots(write, valid):
    text = valid.replace(":Talker", ":Strict").replace("{ slot_ms = 1.1 }", "{ gain = 1.0 }")
    text = text.replace("[agents.r2]", "[agents.r2]\nparameters = { gain = 2.0 }")
    text = text.replace("[team.models.r1]", "[team]\nimpossible = true\n[team.models.r1]")

    with pytest.raises(ScenarioError) as error:
        load(write(text))

    assert error.value.problems == ["few.toml: team.impossible=true: this cannot work; leave it out",
                                    "few.toml: team.impossible=true: really not"]
