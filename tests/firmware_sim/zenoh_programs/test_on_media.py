"""Zenoh programs on media: losses, lengths, partitions, several media, one hash, and nothing outside."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from pathlib import Path

import polars
import pytest
import zenoh

from experiments.run.runner import run
from experiments.scenario import ScenarioError, load
from netem.wire.errors import NodeFailure
from netem.wire.zenoh_codec import encode
from netem.wire.zenoh_messages import Data, Push
from tests.firmware_sim.zenoh_programs.runs import LAN, RADIO, log_of, scenario, told, virtually

CASE = Path(__file__).parents[2] / "cases" / "zenoh_unmodified"
PAIR = {"hears": "probes:hear", "says": 'program = "probes:numbers"\nparameters = { size = 200, key = "n" }'}


def rows(folder: Path, node: str) -> polars.DataFrame:
    return polars.read_parquet(folder / "out" / "ledger.parquet").filter(polars.col("sender") == node)


def test_a_case_through_a_radio_that_loses_half_hears_what_the_ledger_says_was_received(tmp_path: Path) -> None:
    summary = run(load(CASE / "two.toml"), out=tmp_path, report=False).summary

    ledger = polars.read_parquet(tmp_path / "ledger.parquet")
    puts = ledger.filter((polars.col("sender") == "pub") & (polars.col("fate") == "delivered")
                         & (polars.col("offered_ns") >= 600_000_000))
    heard = [line for line in (tmp_path / "logs" / "sub.log").read_text().splitlines() if line.startswith("got")]
    assert len(heard) == len(puts)
    assert 1 <= len(heard) <= 19            # of 20: all or none at loss 0.5 has probability 2e-6
    assert all(verdict.holds for verdict in summary.verdicts)


def test_a_case_with_total_loss_sends_into_the_radio_and_nothing_arrives(tmp_path: Path) -> None:
    run(load(CASE / "pub_only.toml"), out=tmp_path, report=False)

    ledger = polars.read_parquet(tmp_path / "ledger.parquet")
    assert set(ledger["fate"]) == {"lost"}
    assert len(ledger) == 20 + 3            # 20 puts, and 3 requests for declarations as the session opens


@pytest.mark.parametrize("medium", [LAN, RADIO], ids=["lan", "radio"])
def test_all_arrives_where_nothing_is_lost_also_in_fragments(tmp_path: Path, medium: str) -> None:
    told = virtually(tmp_path, PAIR, medium, length_s=3.0)

    assert told["hears"] == [f"TOLD n {number} 200 True" for number in range(20)]


def test_a_put_takes_the_air_for_zenohs_own_length_and_two_addresses(tmp_path: Path) -> None:
    virtually(tmp_path, {"hears": "probes:hear", "says": 'program = "probes:numbers"\nparameters = { size = 20 }'},
              RADIO, length_s=3.0)

    expected = 4 + 5 + len(encode(Push("n", Data(bytes(20)))))
    lengths = rows(tmp_path, "says").filter(polars.col("offered_ns") > 530_000_000)["size_bytes"].to_list()
    assert expected == 4 + 5 + 26           # 1 + 1 + 2 for the key, 1 + 1 + 20 for the data
    assert lengths.count(expected) >= 20


@pytest.mark.slow
@pytest.mark.parametrize("medium", [LAN, RADIO], ids=["lan", "radio"])
def test_three_runs_have_one_hash_and_another_seed_has_another(tmp_path: Path, medium: str) -> None:
    programs = {**PAIR, "asks": "probes:asks", "answers": "probes:answers", "alive": "probes:alive",
                "watch": "probes:watch"}
    lossy = medium + '[[impairments]]\non = "*: * -> *"\nkind = "bernoulli_loss"\nloss_ratio = 0.3\n'
    path = scenario(tmp_path, programs, lossy, length_s=4.0)

    hashes = [run(load(path), out=tmp_path / str(number), report=False).summary.ledger_hash for number in range(3)]
    other = run(load(path, seed=2), out=tmp_path / "other", report=False).summary.ledger_hash

    assert len(set(hashes)) == 1
    assert other not in hashes


def test_liveliness_is_lost_under_a_partition_and_comes_back(tmp_path: Path) -> None:
    cut = ('[[faults]]\nkind = "partition"\non = "lan"\nduring_s = [3.0, 20.0]\n'
           'groups = [["alive"], ["watch"]]\n')

    told = virtually(tmp_path, {"alive": "probes:alive", "watch": "probes:watch"}, LAN + cut, length_s=30.0)

    (put, first), (delete, lost), (again, back) = [(line.split()[1], float(line.split()[3])) for line in told["watch"]]
    assert (put, delete, again) == ("SampleKind.PUT", "SampleKind.DELETE", "SampleKind.PUT")
    assert 0.5 <= first <= 0.6
    # The lease of 10 s runs from the last declaration before 3 s, which is repeated every 2.5 s by 10 % more or less.
    assert 3.0 - 2.75 + 10.0 <= lost <= 13.1
    assert 20.0 <= back <= 20.0 + 2.75 + 0.1


def test_the_first_way_that_matches_a_key_decides_on_its_medium(tmp_path: Path) -> None:
    two = ('program = "probes:two_ways"\nzenoh = { "fleet/**" = "radio", "other" = "lan" }', "probes:hear")
    programs = {"says": two[0], "far": 'program = "probes:hear"\nmedia = ["lan"]',
                "near": 'program = "probes:hear"\nmedia = ["radio"]'}

    told = virtually(tmp_path, programs, LAN + RADIO, length_s=3.0)

    assert [line.split()[1] for line in told["near"]] == ["fleet/pose"]
    assert [line.split()[1] for line in told["far"]] == ["other"]
    assert told["says"] == ["TOLD nowhere NoMedium agents.says.zenoh: no key expression intersects 'nowhere/at/all', "
                            "so no medium carries it; there are 'fleet/**', 'other'"]


@pytest.mark.parametrize(("target", "expected"), [
    ("ALL", ["a", "b", "c"]), ("ALL_COMPLETE", ["b", "c"]), ("BEST_MATCHING", ["b or c"])])
def test_a_query_asks_the_nodes_of_its_target(tmp_path: Path, target: str, expected: list[str]) -> None:
    programs = {name: f'program = "probes:answers"\nparameters = {{ text = "{name}", complete = {complete} }}'
                for name, complete in (("a", "false"), ("b", "true"), ("c", "true"))}
    programs["asks"] = f'program = "probes:asks"\nparameters = {{ target = "{target}" }}'

    told = virtually(tmp_path, programs, LAN, length_s=4.0)

    (line,) = told["asks"]
    if target == "BEST_MATCHING":
        assert re.fullmatch(r"TOLD \['[bc]'\] 0\.0", line)
    else:
        assert line == f"TOLD {expected} 0.0"


def test_a_query_to_a_node_that_went_out_of_range_ends_with_its_time_out_and_later_with_nobody(tmp_path: Path) -> None:
    cut = '[[faults]]\nkind = "partition"\non = "lan"\nduring_s = [1.5, 40.0]\ngroups = [["a"], ["asks"]]\n'
    programs = {"a": "probes:answers",
                "asks": 'program = "probes:asks"\nparameters = { count = 3, pause = 15.0, timeout = 0.7 }'}

    told = virtually(tmp_path, programs, LAN + cut.replace("1.5", "0.9"), length_s=35.0)

    assert told["asks"] == ["TOLD ['ERR Timeout'] 0.7", "TOLD [] 0.0", "TOLD [] 0.0"]


def test_timestamps_come_from_the_nodes_clock(tmp_path: Path) -> None:
    told = virtually(tmp_path, {"one": 'program = "probes:clocks"\nclock = { offset_s = 1000.0, drift_ppm = 50.0 }'},
                     LAN, length_s=2.0)

    stamp, time_ns, monotonic_ns = map(int, told["one"][0].split()[1:])
    assert monotonic_ns == 1_000_000_000
    assert stamp == monotonic_ns + 1000 * 10**9
    assert abs(stamp - time_ns) <= 256      # time.time() is a float: 2**-23 s at 1000 s, rounded once more by round()


def test_what_is_outside_the_subset_is_refused_by_name(tmp_path: Path) -> None:
    told = virtually(tmp_path, {"one": "probes:outside_subset"}, LAN, length_s=2.0)

    for line, what in zip(told["one"], ("scout", "CancellationToken", "ext.declare_advanced_publisher",
                                        "put: the argument source_info", "get: the argument cancellation_token",
                                        "SessionInfo.links", "open: the argument timestamp_callback"), strict=True):
        assert f"OutsideSubset zenoh: {what} is not there in virtual time; docs/zenoh_programs.md" in line


@pytest.mark.slow
def test_a_loop_that_only_puts_lets_time_pass(tmp_path: Path) -> None:
    run(load(scenario(tmp_path, {"one": "probes:forever"}, '[media.radio]\nkind = "broadcast_radio"\n'
                      'queue_frames = 1\n', length_s=1.0)), out=tmp_path / "out", report=False)


# --- mistakes of scenarios

@pytest.mark.parametrize(("agent", "expected"), [
    ('zenoh = "wifi"', 'agents.one.zenoh="wifi": no such medium; there is only lan'),
    ('zenoh = { "a//b" = "lan" }', "agents.one.zenoh.\"?a//b\"?=.*no key expression: empty chunks are forbidden"),
    ('zenoh = { "**" = "lan", "fleet/**" = "lan" }',
     'matches nothing: "\\*\\*" before it has all of its keys; write it before that one, or leave it out'),
    ("zenoh = 3", "agents.one.zenoh=3"),
])
def test_a_wrong_way_is_one_line_at_its_place(tmp_path: Path, agent: str, expected: str) -> None:
    path = scenario(tmp_path, {"one": f'program = "probes:hear"\n{agent}'}, LAN)

    with pytest.raises(ScenarioError, match=expected) as refused:
        load(path)

    assert len(str(refused.value).splitlines()) == 1


@pytest.mark.parametrize(("medium", "expected"), [
    ('kind = "can"\nbit_rate_bps = 500_000', "one.zenoh=\"it\": a CAN bus carries CAN frames: open it with can.Bus"),
    ('kind = "sensing"\nexposure_period_ms = 10\nlatency_ms = 5', 'one.zenoh="it": a sensing carries no datagrams'),
    ('kind = "serial_line"\nbaud_bps = 57_600',
     'one.zenoh="it": a serial_line may cut frames; Zenoh needs a medium such as broadcast_radio or packet_network'),
])
def test_a_medium_that_cannot_carry_it_is_refused(tmp_path: Path, medium: str, expected: str) -> None:
    path = scenario(tmp_path, dict.fromkeys(("one", "two"), 'program = "probes:hear"\nzenoh = "it"'),
                    f"[media.it]\n{medium}\n")

    with pytest.raises(ScenarioError) as refused:
        load(path)

    assert any(expected in problem for problem in refused.value.problems), refused.value.problems


def test_a_medium_of_others_and_a_class_as_program_are_refused(tmp_path: Path) -> None:
    path = scenario(tmp_path, {"one": 'program = "probes:hear"\nzenoh = "radio"\nmedia = ["lan"]',
                               "two": 'program = "probes:Board"\nzenoh = "lan"'}, LAN + RADIO)

    with pytest.raises(ScenarioError) as refused:
        load(path)

    said = "\n".join(refused.value.problems)
    assert 'agents.one.zenoh="radio": the agent has no port on this medium; it is on lan' in said
    assert "agents.two.zenoh: this program is a class, which sends through `board.port`; zenoh is there for" in said


@pytest.mark.parametrize(("media", "expected"), [
    (LAN + RADIO, r"lan and radio can carry Zenoh; choose: zenoh = \"lan\" under \[agents\.one\]"),
    ('[media.bus]\nkind = "can"\nbit_rate_bps = 500_000\n', r"none of its media carries Zenoh \(bus\)"),
])
def test_a_session_without_a_medium_says_what_to_write(tmp_path: Path, media: str, expected: str) -> None:
    with pytest.raises(NodeFailure, match=expected):
        run(load(scenario(tmp_path, {"one": "probes:hear"}, media)), out=tmp_path / "out", report=False)


# --- outside

FOREIGN = """
import time, zenoh
heard = []
with zenoh.open(zenoh.Config()) as session:
    session.declare_subscriber("**", lambda sample: heard.append(str(sample.key_expr)))
    found = zenoh.scout(lambda hello: heard.append(str(hello)), what="peer|router")
    print("ready", flush=True)
    input()
    found.stop()
print("HEARD", [what for what in heard if "ready" not in what])
"""


def test_a_foreign_listener_with_scouting_hears_nothing(tmp_path: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", FOREIGN], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                          text=True) as listener:
        assert listener.stdin is not None
        assert listener.stdout is not None
        assert listener.stdout.readline() == "ready\n"
        virtually(tmp_path, PAIR, LAN, length_s=3.0)
        time.sleep(0.5)
        out, _ = listener.communicate("\n", timeout=30)

    assert not re.search(r"\bn\b|127\.0\.0\.1", out), out


def test_a_session_opens_no_socket_and_starts_no_thread_but_pythons(tmp_path: Path) -> None:
    told = virtually(tmp_path, {"one": "probes:system_resources"}, LAN, length_s=5.0)

    assert told["one"][0].startswith("TOLD True")


# --- programs that do the same at the same instants

def puts_that_arrive(folder: Path, mac: str, parameters: str = "") -> int:
    talk = f'program = "probes:numbers"\n{parameters}'
    told = virtually(folder, {"one": talk, "two": talk, "hears": "probes:hear"},
                     RADIO.replace('mac = "csma"', f'mac = "{mac}"'), length_s=3.0)
    return len(told["hears"])


def test_puts_at_the_same_instants_collide_unless_the_medium_or_the_program_prevents_it(tmp_path: Path) -> None:
    assert puts_that_arrive(tmp_path / "none", "none") == 0
    assert puts_that_arrive(tmp_path / "apart", "none", "parameters = { apart = true }") == 40

    # Of 20 pairs one in 8 draws the same slot (min_exponent 3): 2.5, standard deviation 1.48; each loses two puts.
    assert puts_that_arrive(tmp_path / "csma", "csma") >= 40 - 2 * (2.5 + 4 * 1.48)


# --- hosts

@pytest.mark.parametrize("medium", [LAN, pytest.param(RADIO, marks=pytest.mark.slow)], ids=["lan", "radio"])
def test_runs_inline_have_the_hash_of_a_run_with_processes_and_tell_the_same(
        tmp_path: Path, capsys: pytest.CaptureFixture[str], medium: str) -> None:
    programs = {"answers": "probes:answers", "asks": "probes:asks", "hears": "probes:hear", "watches": "probes:watch",
                "lives": 'program = "probes:alive"\nparameters = { first_s = 1.0 }',
                "says": 'program = "probes:numbers"\nparameters = { size = 200, key = "n" }'}
    loaded = load(scenario(tmp_path, programs, medium, length_s=6.0))

    with_processes = run(loaded, out=tmp_path / "out", report=False).summary
    by_processes = sorted(line for name in programs for line in told(log_of(tmp_path, name)))

    capsys.readouterr()
    for number in range(3):
        inline = run(loaded, host="inline", out=tmp_path / str(number), report=False).summary
        assert (inline.ledger_hash, inline.frames) == (with_processes.ledger_hash, with_processes.frames)
        assert sorted(told(capsys.readouterr().out)) == by_processes
    assert len(by_processes) >= 20


def test_programs_inline_have_sessions_of_their_own_and_the_library_is_back_afterwards(tmp_path: Path) -> None:
    names = "open", "Session", "Subscriber", "scout"
    before = [getattr(zenoh, name) for name in names]

    run(load(scenario(tmp_path, PAIR, LAN, length_s=3.0)), host="inline", out=tmp_path / "out", report=False)

    after = [getattr(zenoh, name) for name in names]
    assert [getattr(one, "__wrapped__", one) for one in after] == [getattr(one, "__wrapped__", one) for one in before]
    senders = polars.read_parquet(tmp_path / "out" / "ledger.parquet")["sender"].unique().sort()
    assert senders.to_list() == ["hears", "says"]
