"""A program's board: what it waits for on its own clock, what it promises by that, what it senses and records."""

from __future__ import annotations

from random import Random

import pytest

from firmware_sim.board import Board, NoPlant
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.local_clock import LocalClock
from firmware_sim.old_names import BOARD
from fmus.build import build_model
from fmus.describe_fmu import describe
from fmus.errors import PlantError
from fmus.plant import Plant
from netem.node.named import UnknownName
from netem.node.node import Node, PromiseBroken
from netem.wire.instants import NEVER_NS
from netem.wire.messages import Grant, NodeFault
from tests.firmware_sim.board_bench import BoardBench

MS = 1_000_000
RADIO, CAN = 0, 1


# --- waiting


def test_waiting_ends_at_the_first_instant_that_reads_the_local_time():
    bench = BoardBench(offset_ns=500, drift_ppm=-100.0, tick_ns=1000)
    board, woke = bench.board(), []

    def program():
        yield board.until(1_000_000)
        woke.append((bench.node.now_ns, board.now_ns))

    bench.run(program())

    assert woke == [(bench.clock.true_at(1_000_000), 1_000_000)]
    assert woke[0][0] == 999_600                # ceil((1_000_000 - 500) / (1 - 1e-4)) = ceil(999_599.96)


def test_waiting_for_a_local_time_that_is_past_ends_at_once():
    bench = BoardBench(offset_ns=10**6)
    board, woke = bench.board(), []

    def program():
        yield board.until(5)
        woke.append(bench.node.now_ns)
        yield from board.sleep_until(5)
        woke.append(bench.node.now_ns)

    bench.run(program())

    assert woke == [0, 0]


def test_a_clock_that_is_set_back_under_way_wakes_the_armed_timer_early_and_sleep_until_waits_on():
    bench = BoardBench(clock_steps=[(400, -300)])
    board, woke = bench.board(), {}

    def armed_once():
        yield board.until(1000)
        woke["until"] = (bench.node.now_ns, board.now_ns)

    def waits_on():
        yield from board.sleep_until(1000)
        woke["sleep_until"] = (bench.node.now_ns, board.now_ns)

    board.start(armed_once())
    bench.run(waits_on())

    assert woke == {"until": (1000, 700), "sleep_until": (1300, 1000)}


def test_a_clock_that_is_set_forward_under_way_wakes_late_by_the_step():
    bench = BoardBench(clock_steps=[(400, 300)])
    board, woke = bench.board(), []

    def program():
        yield from board.sleep_until(1000)
        woke.append((bench.node.now_ns, board.now_ns))

    bench.run(program())

    assert woke == [(1000, 1300)]


def test_an_interrupt_by_another_clock_comes_after_true_time():
    bench = BoardBench(drift_ppm=100_000.0)
    board = bench.board()
    radio, at = board.port("radio", listen_only=True), []
    board.port("can", listen_only=True)

    board.after(1000, lambda: (at.append(bench.node.now_ns), radio.send(b"x")))

    assert bench.until(500).firm_ns == 1000
    assert [time_ns for time_ns, _, _ in bench.until(2000).offers] == at == [1000]


# --- the promise of silence


def speaks_at(bench: BoardBench, local_ns: int, *listen_only: str):
    """A board that says something at an instant and only listens at these ports."""
    board = bench.board()
    for name in listen_only:
        board.port(name, lambda data: None, listen_only=True)
    board.at(local_ns, lambda: board.port("radio").send(b"on time"))
    return board


def test_the_promise_is_firm_if_no_port_answers_and_stands_in_true_time():
    bench = BoardBench(drift_ppm=100_000.0)
    speaks_at(bench, 1_100_000, "radio", "can")

    report = bench.until(1000, (500, RADIO, b"heard"))

    assert (report.firm_ns, report.soft_ns) == (1_000_000, 1_000_000)
    assert bench.node.hello().quiet == [RADIO, CAN]
    assert bench.until(2_000_000).offers == [(1_000_000, RADIO, b"on time")]


def test_the_promise_is_soft_if_one_port_may_answer_and_a_new_one_follows_what_is_heard():
    bench = BoardBench()
    board = speaks_at(bench, 10_000, "can")
    radio = board.port("radio", lambda data: radio.send(b"answer"))

    first = bench.until(100)
    second = bench.until(200, (150, RADIO, b"question"))

    assert (first.firm_ns, first.soft_ns) == (0, 10_000)
    assert second.offers == [(150, RADIO, b"answer")]
    assert (second.firm_ns, second.soft_ns) == (0, 10_000)
    assert bench.until(20_000).offers == [(10_000, RADIO, b"on time")]


def test_a_board_without_a_timer_that_sends_is_silent_until_it_hears_something():
    bench = BoardBench()
    board = bench.board()
    radio = board.port("radio", lambda data: radio.send(b"answer"))
    board.at(700, lambda: board.count("looked"), sends=False)

    assert bench.until(100).soft_ns == NEVER_NS
    assert bench.until(1000, (900, RADIO, b"question")).offers == [(900, RADIO, b"answer")]


def test_an_answer_at_a_port_that_only_listens_breaks_the_promise():
    bench = BoardBench()
    board = speaks_at(bench, 10_000, "radio", "can")
    radio = board.port("radio", lambda data: radio.send(b"answer"))
    bench.until(100)

    with pytest.raises(PromiseBroken, match="radio: a frame at 150 ns, but silence was promised until 10000 ns"):
        bench.until(200, (150, RADIO, b"question"))


@pytest.mark.parametrize("arm", [
    lambda board, act: board.at(300, act, sends=False),
    lambda board, act: board.every(300, act, offset_ns=300, sends=False),
    lambda board, act: board.after(300, act, sends=False)])
def test_a_timer_that_leads_to_no_frame_promises_nothing_and_has_to_keep_to_it(arm):
    quiet, lying = BoardBench(), BoardBench()
    arm(speaks_at(quiet, 900, "radio", "can"), lambda: None)
    arm(board := speaks_at(lying, 900, "radio", "can"), lambda: board.port("radio").send(b"too early"))

    assert (quiet.until(100).firm_ns, lying.until(100).firm_ns) == (900, 900)
    assert quiet.until(1000).offers == [(900, RADIO, b"on time")]
    with pytest.raises(PromiseBroken, match="a frame at 300 ns, but silence was promised until 900 ns"):
        lying.until(1000)


def test_a_sleep_may_say_that_silence_lasts_longer_than_it_does():
    bench = BoardBench(ports=["radio"])
    board, sent = bench.board(), []
    radio = board.port("radio", listen_only=True)

    def program():
        yield from board.sleep_until(300, silent_until_ns=900)
        yield from board.sleep_until(900)
        radio.send(b"on time")
        yield from board.sleep_until(1200, silent_until_ns=NEVER_NS)
        sent.append(bench.node.now_ns)

    board.start(program())

    assert [bench.until(end_ns).firm_ns for end_ns in (100, 500, 950)] == [900, 900, NEVER_NS]
    bench.until(2000)
    assert sent == [1200]


def test_who_speaks_within_the_silence_of_a_sleep_is_named():
    bench = BoardBench(ports=["radio"])
    board = bench.board()
    radio = board.port("radio", listen_only=True)

    def program():
        yield from board.sleep_until(300, silent_until_ns=900)
        radio.send(b"too early")

    board.start(program())
    bench.until(100)

    with pytest.raises(PromiseBroken, match="a frame at 300 ns, but silence was promised until 900 ns"):
        bench.until(1000)


@pytest.mark.parametrize("promise", ["promise_firm", "promise_soft"])
def test_a_program_may_promise_more_than_its_timers_do(promise):
    bench = BoardBench(drift_ppm=100_000.0)
    board = bench.board()
    getattr(board, promise)(1_100_000)
    board.at(550_000, lambda: board.port("radio").send(b"early"))      # true 500_000

    with pytest.raises(PromiseBroken, match="a frame at 500000 ns, but silence was promised until 1000000 ns"):
        bench.until(2_000_000)


def test_a_soft_promise_of_the_program_ends_with_what_it_hears():
    bench = BoardBench()
    board = bench.board()
    radio = board.port("radio", lambda data: radio.send(b"answer"))
    board.promise_soft(1000)

    assert bench.until(500, (200, RADIO, b"question")).offers == [(200, RADIO, b"answer")]


@pytest.mark.parametrize("promise", ["promise_firm", "promise_soft"])
def test_no_promise_reaches_beyond_the_next_step_of_the_clock(promise):
    """A step forward may bring the next slot nearer; a promise across it would then be broken innocently."""
    bench = BoardBench(clock_steps=[(400, 5_000), (800, -5_000)])
    board = bench.board()
    radio, sent = board.port("radio"), []

    def program():
        getattr(board, promise)(6_000)
        yield board.until(500)                      # armed before the step: true time 500
        radio.send(b"due now: local time is 5500")
        sent.append(bench.node.now_ns)
        getattr(board, promise)(6_000)              # true 1000, cut to 800
        yield board.until(5_850)                    # armed at true 500, for true 850
        radio.send(b"the clock went back meanwhile")
        sent.append(bench.node.now_ns)

    bench.run(program())

    assert sent == [500, 850]


def test_the_promise_of_a_timer_shrinks_when_a_fault_sets_the_clock_forward():
    bench = BoardBench(clock_steps=[(400, 5_000)])
    speaks_at(bench, 6_000, "radio", "can")

    # the clock reads 6000 at true time 1000 now, and another action might send something for that reading
    assert [bench.until(end_ns).firm_ns for end_ns in (100, 450)] == [6_000, 1_000]


def test_a_frame_ends_a_wait_with_a_timeout_and_the_next_wait_promises_anew():
    bench = BoardBench(ports=["radio"])
    board = bench.board()
    radio, woke = board.port("radio"), []

    def program():
        heard = radio.receive()
        yield heard | board.until(1000)
        woke.append((bench.node.now_ns, heard.triggered))
        yield from board.sleep_until(400)
        radio.send(b"answer")

    board.start(program())

    assert bench.until(100).soft_ns == 1000
    assert bench.until(200, (150, RADIO, b"question")).soft_ns == 400
    assert bench.until(2000).offers == [(400, RADIO, b"answer")]
    assert woke == [(150, True)]


# --- ports


def test_what_nobody_listens_to_waits_for_the_program():
    bench = BoardBench(ports=["radio"])
    board, heard = bench.board(), []

    def program():
        yield from board.sleep_until(1000)
        heard.append((yield board.port("radio").receive()))

    board.start(program())
    bench.until(2000, (100, RADIO, b"early"))

    assert heard == [b"early"]
    assert board.ports == ("radio",)


def test_a_port_that_is_not_there_is_named_with_those_that_are():
    with pytest.raises(UnknownName, match="robot has no port 'radi'; did you mean 'radio'"):
        BoardBench().board().port("radi")


# --- the plant, parameters and records


@pytest.fixture
def integrator():
    """(bench, board) whose plant is dy/dt = u; sampled every 250 ms."""
    bench = BoardBench(sample_period_ns=250 * MS, offset_ns=7, drift_ppm=100.0)
    plant = Plant(describe(build_model("linear_system")), "robot", {"A": [[0.0]], "B": [[1.0]], "C": [[1.0]]},
                  present=bench.node.present_ns)
    yield bench, bench.board(plant)
    plant.close()


def test_what_is_sensed_and_set_is_of_the_present(integrator):
    bench, board = integrator
    sensed, group = [], board.sensors(["y[1]"])
    board.actuate("u[1]", 2.0)

    def look():
        sensed.append((board.sense("y[1]"), group.read()))
        board.actuators(["u[1]"]).write([0.0])

    board.after(500 * MS, look)
    board.after(900 * MS, look)
    bench.until(1000 * MS)

    assert sensed == [(pytest.approx(1.0), (pytest.approx(1.0),))] * 2


def test_within_a_record_all_is_of_the_instant_of_the_sample(integrator):
    bench, board = integrator
    board.actuate("u[1]", 2.0)
    board.record("y", "m", lambda: board.sense("y[1]"))
    board.record_all([("local", "ns"), ("true", "ns")], lambda: (board.now_ns, bench.node.present_ns()))
    board.after(700 * MS, lambda: None)

    samples = bench.until(1000 * MS).samples

    assert [time_ns for time_ns, _ in samples] == [0, 250 * MS, 500 * MS, 750 * MS]
    for time_ns, (y, local_ns, true_ns) in samples:
        assert (y, local_ns, true_ns) == (pytest.approx(2e-9 * time_ns), bench.clock.reading_at(time_ns), time_ns)


def test_an_unknown_variable_of_the_plant_is_named(integrator):
    with pytest.raises(PlantError, match="z"):
        integrator[1].sense("z")


@pytest.mark.parametrize("ask", [
    lambda board: board.sense("x"), lambda board: board.actuate("F", 1.0), lambda board: board.sensors(["x"]),
    lambda board: board.actuators(["F"])])
def test_without_a_plant_there_is_nothing_to_sense_or_set(ask):
    with pytest.raises(NoPlant, match=r"^robot has no plant; give it one, as agents\.robot\.plant = \{ fmu = "):
        ask(BoardBench().board())


def test_a_parameter_that_the_scenario_does_not_give_is_named_with_those_that_it_does():
    board = BoardBench(parameters={"period_ns": 5}).board()

    assert board.parameter("period_ns") == 5
    with pytest.raises(UnknownName, match="robot has no parameter 'perod_ns'; did you mean 'period_ns'"):
        board.parameter("perod_ns")


def test_what_is_counted_and_told_is_in_the_report():
    bench = BoardBench()
    board = bench.board()
    board.count("looks", 0)
    board.count("laps", 2)
    board.after(5, lambda: (board.event("turn", "left"), board.warn("low battery")))

    report = bench.until(10)

    assert report.counters == {"looks": 0, "laps": 2}
    assert [event[:2] for event in report.events] == [(5, "turn"), (5, "low battery")]


# --- names of before


@pytest.mark.parametrize("name", BOARD)
def test_a_name_of_before_is_refused_with_that_of_today(name):
    with pytest.raises(AttributeError) as caught:
        getattr(BoardBench().board(), name)

    assert str(caught.value) == f"Board has no {name!r} any more: {BOARD[name]}"
    assert "\n" not in str(caught.value)


def test_every_name_that_a_message_of_the_board_tells_is_there():
    board = BoardBench().board()

    told = {word.strip(",;").partition("(")[0].partition(".")[2] for text in BOARD.values() for word in text.split()
            if word.startswith("board.")}
    assert told >= {"port", "sense", "actuate", "sleep_until", "promise_firm", "promise_soft"}
    assert all(hasattr(board, name) for name in told)


def test_what_an_error_within_a_property_says_reaches_the_program():
    def true_now() -> int:
        raise ValueError("no time")

    board = Board(Node("robot", []), LocalClock(ClockSettings(), true_now), None, {}, Random(1), {})

    with pytest.raises(ValueError, match="no time"):
        board.now_ns  # noqa: B018



def test_a_port_that_is_told_whether_it_answers_says_what_took_its_place():
    port = BoardBench().board().port("radio")

    with pytest.raises(AttributeError, match="listen_only=True"):
        port.answers = False
    with pytest.raises(AttributeError, match="listen_only=True"):
        port.answers  # noqa: B018


@pytest.mark.parametrize("listen_only", [False, True])
def test_a_process_that_a_pause_keeps_from_its_start_has_promised_nothing(listen_only):
    bench = BoardBench()
    board = bench.board()
    for name in board.ports:
        board.port(name, listen_only=listen_only)

    def program():
        board.port("radio").send(b"1")
        yield board.until(10 * MS)

    board.start(program())
    bench.node.hello()
    pause = NodeFault(0, "pause", {"until_ns": 2 * MS})

    before = bench.node.advance(Grant(1, MS, False, False, [], [pause]))
    after = bench.node.advance(Grant(2, 3 * MS, False, False, []))

    assert before.offers == []
    assert max(before.firm_ns, before.soft_ns) <= 2 * MS
    assert after.offers == [(2 * MS, RADIO, b"1")]
    assert max(after.soft_ns, after.firm_ns) == 10 * MS
