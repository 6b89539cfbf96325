"""Radios on robots that drive: the links are those of the last position shown, on both hosts, as closed forms say."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import cos, hypot, sin
from pathlib import Path
from typing import Any

import pyarrow.parquet as parquet
import pytest
from mcap.reader import make_reader

from experiments.judge.run_data import load_run
from experiments.run.node_host import HostName
from experiments.run.runner import run
from experiments.scenario import ScenarioError, load

MOVING = Path(__file__).parents[1] / "cases" / "moving" / "away.toml"
RANGE_M = 10 ** ((85 - 40) / 20)            # -85 dBm of 0 dBm, 40 dB at 1 m, free space: 177.8 m
SPEED_MPS = 10.0
MS = 1_000_000
Rows = list[dict[str, Any]]

DRIVER = '''
from dataclasses import dataclass


class Driver:
    """Drives with a constant speed and turn rate, and says that it is there, silent in between."""

    @dataclass
    class Settings:
        period_ns: int
        v: float = 0.0
        omega: float = 0.0

    def __init__(self, board, settings):
        port = board.port("radio", lambda frame: board.count("heard"), listen_only=True)
        board.every(settings.period_ns, lambda: port.send(b"here"))
        if settings.v:
            board.actuate("v_cmd", settings.v)
            board.actuate("omega_cmd", settings.omega)


class Ear:
    def __init__(self, board):
        board.port("radio", lambda frame: board.count("heard"), listen_only=True)
'''
CIRCLE = '''# A robot drives on a circle of 20 m about one receiver; another stands 20 m beside the centre.
# Question: who hears it when?
seed = 1
length_s = 30.0
[agents.a_robot]
program = "driver:Driver"
parameters = { period_ms = 50, v = 10.0, omega = 0.5 }
plant = { fmu = "unicycle" }
[agents.beside]
program = "driver:Ear"
at_m = [0.0, 40.0]
[agents.centre]
program = "driver:Ear"
at_m = [0.0, 20.0]
[media.radio]
kind = "broadcast_radio"
preset = "crazyflie_p2p"
sensitivity_dbm = -69.5424
topology = { kind = "positions", bodies = { a_robot = ["x", "y"] }, pose_period_ms = 10 }
'''


@pytest.fixture
def rows_of(tmp_path: Path) -> Callable[..., Rows]:
    def rows(source: Path, host: HostName = "inline", **changes: Any) -> Rows:
        folder = tmp_path / f"run{len(list(tmp_path.iterdir()))}"
        run(load(source, **changes), host=host, out=folder, report=False)
        return parquet.read_table(folder / "ledger.parquet").to_pylist()

    return rows


def follow(period_ms: float, *more: str) -> dict[str, Any]:
    return {"overrides": ['media.radio.topology={kind="positions", bodies={rover=["x", "y"]}, '
                          f'pose_period_ms={period_ms}{"".join(", " + each for each in more)}}}']}


@pytest.mark.parametrize("host", ["inline", pytest.param("process", marks=pytest.mark.slow)])
def test_two_robots_driving_apart_lose_each_other_at_the_instant_computed(host, rows_of):
    rows = rows_of(MOVING, host, **follow(10))

    leaves_ns = RANGE_M / SPEED_MPS * 1e9                       # 17.783 s, not an instant at which anybody speaks
    for sender in ("base", "rover"):
        fates = {row["on_air_ns"]: row["fate"] for row in rows if row["sender"] == sender}
        assert {fate for at_ns, fate in fates.items() if at_ns < leaves_ns} == {"delivered"}
        assert {fate for at_ns, fate in fates.items() if at_ns >= leaves_ns + 10 * MS} == {"too weak"}
        fringe_ns = 10 ** (10 / 20) * leaves_ns                 # 10 dB further nobody expects a copy any more
        assert fringe_ns - 110 * MS < max(fates) < fringe_ns


@pytest.mark.parametrize("host", ["inline", pytest.param("process", marks=pytest.mark.slow)])
def test_the_instants_at_which_links_appear_and_disappear_are_on_record(host, tmp_path):
    (tmp_path / "driver.py").write_text(DRIVER)
    (tmp_path / "circle.toml").write_text(CIRCLE)
    run(load(tmp_path / "circle.toml"), host=host, out=tmp_path / "run", report=False)

    data = load_run(tmp_path / "run")
    told = [(event.time_ns, event.detail) for event in data.events
            if (event.node, event.kind) == ("radio", "links change")]
    # nobody else shows a pose: at 0 all nodes have their places; a circle of 20 m about `centre`, 0.5 rad/s
    expected, hears = [(0, "in range: a_robot <-> centre, beside <-> centre")], False
    for at_ns in range(0, 30_000 * MS, 10 * MS):
        angle = 0.5 * at_ns / 1e9
        now = hypot(20 * sin(angle), 20 - 20 * cos(angle) - 40) <= 10 ** ((69.5424 - 40) / 20)
        if now != hears:
            expected.append((at_ns, f"{'in' if now else 'out of'} range: a_robot <-> beside"))
            hears = now
    assert len(expected) >= 5
    assert told == expected
    assert data.run["switch_instants_ns"] == {"radio": [at_ns for at_ns, _ in expected[1:]]}
    with (tmp_path / "run" / "signals.mcap").open("rb") as file:
        logged = [message.log_time for _, _, message in make_reader(file).iter_messages()
                  if b"links change" in message.data]
    assert logged == [at_ns for at_ns, _ in expected]


@pytest.mark.parametrize("period_ms", [1, 70, 1000, 2700])
def test_a_link_ends_no_earlier_than_it_should_and_less_than_one_pose_period_too_late(period_ms, rows_of):
    rows = rows_of(MOVING, duration_s=25.0, **follow(period_ms))

    wrong_m = []
    for row in rows:
        at_s, shown_s = row["on_air_ns"] / 1e9, row["on_air_ns"] // (period_ms * MS) * period_ms / 1e3
        assert (row["fate"] == "too weak") is (SPEED_MPS * shown_s > RANGE_M)
        if (row["fate"] == "too weak") is not (SPEED_MPS * at_s > RANGE_M):
            wrong_m.append(SPEED_MPS * at_s - RANGE_M)
    assert all(0 < wrong < SPEED_MPS * period_ms / 1e3 for wrong in wrong_m)
    assert bool(wrong_m) is (period_ms > 1)                     # shown at 17.78 s; at 17 s; at 16.2 s


def test_a_robot_on_a_circle_is_always_heard_at_its_centre_and_beside_it_on_the_arc_computed(rows_of, tmp_path):
    (tmp_path / "driver.py").write_text(DRIVER)
    (tmp_path / "circle.toml").write_text(CIRCLE)

    rows = rows_of(tmp_path / "circle.toml")

    heard = {name: [row["fate"] == "delivered" for row in rows if row["receiver"] == name]
             for name in ("centre", "beside")}
    assert heard["centre"] == [True] * 600
    range_m = 10 ** ((69.5424 - 40) / 20)                       # 30 m
    expected = []
    for k in range(600):
        theta = 0.5 * k * 0.05
        away_m = hypot(20 * sin(theta), 20 - 20 * cos(theta) - 40)
        assert abs(away_m - range_m) > 1e-3                     # no frame starts on the edge
        expected.append(away_m < range_m)
    assert heard["beside"] == expected
    assert 3 < sum(a != b for a, b in pairwise(expected)) < 7


@pytest.mark.parametrize("more", [
    pytest.param((), marks=pytest.mark.slow),
    pytest.param(("shadowing={sigma_db=6.0}", "propagation_mps=299792458"), marks=pytest.mark.slow),
    ("two_ray={antenna_height_m=0.3}", 'zones=[{kind="circle", centre_m=[60.0, 0.0], radius_m=5.0, extra_loss_db=40, '
                                       'acts_on="path"}]'),
])
def test_both_hosts_give_the_same_ledger(more, tmp_path):
    hashes = [run(load(MOVING, duration_s=20.0, **follow(30, *more)), host=host, out=tmp_path / host,
                  report=False).summary.ledger_hash for host in ("inline", "process")]

    assert hashes[0] == hashes[1]


def test_a_position_shown_at_the_start_of_a_frame_counts_for_it_whoever_comes_first_by_name(rows_of):
    """At 17.8 s the robot is 178 m away; the base, whose name comes first, speaks at that instant."""
    rows = rows_of(MOVING, duration_s=20.0, **follow(100),
                   values={"agents.base.parameters.offset_s": 0.0, "media.radio.decode": "local"})

    fates = {(row["sender"], row["on_air_ns"]): row["fate"] for row in rows}
    for sender in ("base", "rover"):
        assert [fates[sender, at_ms * MS] for at_ms in (17_700, 17_800)] == ["delivered", "too weak"]


def test_a_silent_robot_is_followed_while_another_speaks(rows_of, tmp_path):
    """The robot promises silence for ever; who hears the base depends on where it is all the same."""
    text = CIRCLE.replace('parameters = { period_ms = 50, v = 10.0', 'parameters = { period_ms = 100_000, v = 10.0') \
        .replace('[agents.beside]\nprogram = "driver:Ear"',
                 '[agents.beside]\nprogram = "driver:Driver"\nparameters = { period_ms = 1000 }')
    (tmp_path / "driver.py").write_text(DRIVER)
    (tmp_path / "circle.toml").write_text(text)

    found = [[row["fate"] == "delivered" for row in rows_of(tmp_path / "circle.toml", host)
              if (row["sender"], row["receiver"]) == ("beside", "a_robot")] for host in ("inline", "process")]

    expected = [hypot(20 * sin(k / 2), -20 - 20 * cos(k / 2)) < 30.0 for k in range(1, 30)]
    assert found[0][1:] == found[1][1:] == expected             # at 0 s both speak


def test_a_robot_that_moves_and_a_radio_that_takes_it_to_stand_are_told_in_a_warning(tmp_path):
    still = run(load(MOVING, duration_s=1.0), host="inline", out=tmp_path / "still", report=False)
    moving = run(load(MOVING, duration_s=1.0, **follow(10)), host="inline", out=tmp_path / "moving", report=False)

    assert moving.summary.warnings == []
    assert still.summary.warnings == [
        "media.radio: rover stands at its at_m for the whole run, but its plant moves it (x, y): write "
        'media.radio.topology.bodies = { rover = ["x", "y"] }, and the links follow it']


@pytest.mark.parametrize(("topology", "says"), [
    ('bodies={base=["x", "y"]}', "media.radio.topology.bodies.base: a body needs a plant"),
    ('bodies={rover=["x", "yy"]}', 'media.radio.topology.bodies.rover="yy": no such output; did you mean "y"?'),
    ('bodies={rovr=["x", "y"]}', "bodies names 'rovr', which has no port on this medium"),
    ('bodies={rover=["x", "y", "z"]}', 'media.radio.topology.bodies.rover="z": no such output'),
    ('bodies={rover=["x", "y"]}, pose_period_ms=0', "pose_period_ms=0 (pose_period_ns=0): expected at least 1"),
    ('bodies={rover=["x", "theta"]}', 'media.radio.topology.bodies.rover="theta": has the unit rad, expected m'),
    ("shadowing={sigma_db=-2}", "sigma_db=-2.0: expected 0 or more"),
    ("propagation_mps=0", "propagation_mps=0.0: expected > 0"),
    ("two_ray={}", "media.radio.topology.two_ray.antenna_height_m: is missing"),
    ('zones=[{kind="circle", centre_m=[0, 0], radius_m=1, extra_loss_db=9, acts_on="way"}]',
     'acts_on="way": expected \'ends\' or \'path\''),
])
def test_mistakes_are_told_with_their_place(topology, says):
    with pytest.raises(ScenarioError) as refusal:
        load(MOVING, overrides=[f'media.radio.topology={{kind="positions", {topology}}}'])

    assert any(says in line for line in refusal.value.problems), refusal.value.problems


@pytest.mark.parametrize("fault", ['{kind="kill", on="rover", at_s=5.0, restart_after_s=20.0}',
                                   pytest.param('{kind="pause", on="rover", during_s=[5.0, 25.0]}',
                                                marks=pytest.mark.slow)])
def test_the_radio_follows_a_robot_whose_program_is_dead_or_stands_still(fault, rows_of):
    changes = follow(10)
    changes["overrides"].append(f"faults=[{fault}]")

    inline, processes = (rows_of(MOVING, host, duration_s=30.0, **changes) for host in ("inline", "process"))

    assert inline == processes
    fates = {row["on_air_ns"]: row["fate"] for row in inline if row["sender"] == "base"}
    leaves_ns = RANGE_M / SPEED_MPS * 1e9
    gone = {fate for at_ns, fate in fates.items() if 5_000 * MS < at_ns < leaves_ns}
    assert gone == ({"receiver gone"} if "kill" in fault else {"delivered", "receiver paused"})     # a full buffer
    assert {fate for at_ns, fate in fates.items() if at_ns > leaves_ns + 10 * MS} == {"too weak"}
    quiet = [row for row in inline if row["sender"] == "rover" and 5_000 * MS < row["on_air_ns"] < 25_000 * MS]
    assert not quiet
