"""What a newcomer's mistakes are told as: one message each, with place, value, rule and remedy, alike on both hosts."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner

from marconet.command_line import app

CASES = Path(__file__).parents[1] / "cases"
HOSTS = ("inline", "process")
REFUSED = {                 # by `check`, and so by both hosts: how the line begins
    "e11_neg": "e11_neg.toml: agents_defaults.parameters.period_ms=-10: expected > 0; ",
    "e18_missingfmupath": 'e18_missingfmupath.toml: agents.left.plant.fmu="models/kart.fmu": no such file; did you '
                          'mean "cart"?',
    "e19_plantparam": "e19_plantparam.toml: agents.right.plant.parameters.mass=3.0: no such parameter or start value; "
                      "there are F, x, v, m, T",
    "e26_nomedia": "e26_nomedia.toml: expect.radio.frames_deaf: there is no medium 'radio', nor any other; add "
                   "[media.radio]",
    "k09_nomodel": 'k09_nomodel.toml: agents.left.plant.fmu="k09_nomodel": the model k09_nomodel: model.c defines no '
                   "model_step; add void model_step(",
    "p08_noyieldfrom": 'p08_noyieldfrom.toml: agents_defaults.program="p08_noyieldfrom:Beacon": Beacon.run is no '
                       "generator, as it has no `yield`",
    "p10_norun": 'p10_norun.toml: agents_defaults.program="p10_norun:Beacon": Beacon has no method `run`, with which a '
                 "program starts, and nothing starts its method `runn`; call it `run`",
}
FAILED = {                  # by the run: the first line, and the author's line that it shows
    "p06_sleep": ("2 agents: r1, r2: its program failed at 0 ns: time.sleep(0.01) would hold up the emulator by the "
                  "wall clock and let no robot time pass; write `yield from self.board.sleep_until(self.board.now_ns + "
                  "10_000_000)`", "import time; time.sleep(0.01)"),
    "p07_forgotfrom": ("2 agents: r1, r2: its program failed at 0 ns: p07_forgotfrom.py:25: yield of the generator "
                       "Board.sleep_until: it waits only if it is delegated to; write `yield from ...sleep_until(...)`",
                       "yield self.board.sleep_until(next_ns)"),
    "p16_port": ("2 agents: r1, r2: could not start: r1 has no port 'radi'; did you mean 'radio'?",
                 'self.radio = board.port("radi", self.hear, listen_only=True)'),
}
MISBEHAVING = {
    "NotGen": "node bad: could not start: TypeError: NotGen.run() gave 5: expected a generator; write `run` with ",
    "YieldJunk": "node bad: its program failed at 0 ns: robots.py:124: yield 5: expected an event, as ",
    "SendStr": "node bad: its program failed at 200000000 ns: TypeError: radio: 'hello' is str: a frame is bytes",
    "StrSignal": "node bad: its program failed at 0 ns: ValueError: bad: the signals bad at 0 ns: ('foo',): expected ",
    "InfYield": "node bad: its program failed at 0 ns: RuntimeError: 100000 waits in a row at 0 ns for instants ",
    "SurrogateEvent": "node bad: its program failed at 200000000 ns: ValueError: event 'k\\udce4': 'd\\ud800': ",
    "SendHuge": "warning: radio: bad handed out a frame that nobody can receive: longer than 60 bytes (the first at "
                "0.2 s has 50000000 bytes)",
}


@pytest.fixture
def told(tmp_path):
    """The lines on standard error and the exit code of a command about a case."""
    def command(verb: str, case: str, *options: str) -> tuple[list[str], int]:
        folder, name = case.split("/")
        there = tmp_path / folder
        if not there.is_dir():
            shutil.copytree(CASES / folder, there)
        more = ["--out", str(tmp_path / "out")] if verb == "run" else []
        result = CliRunner().invoke(app, [verb, str(there / f"{name}.toml"), "--quiet", *more, *options])
        return result.stderr.splitlines(), result.exit_code

    return command


@pytest.mark.parametrize("case", REFUSED)
def test_a_mistake_that_shows_before_the_run_is_refused_by_check(case, told):
    lines, code = told("check", f"novice/{case}")

    assert code == 2
    assert [line for line in lines if line.startswith(REFUSED[case])] == lines[:1]


@pytest.mark.parametrize("host", HOSTS)
@pytest.mark.parametrize("case", FAILED)
def test_a_mistake_that_shows_in_the_run_is_told_once_with_the_authors_lines(case, host, told):
    message, source = FAILED[case]

    lines, code = told("run", f"novice/{case}", "--host", host)

    assert code == 3
    assert lines[0] == message
    assert any(source in line for line in lines[1:])
    assert not any("/netem/" in line or "/experiments/node" in line for line in lines)


def test_verbose_shows_marconets_lines_too(told):
    lines, _ = told("run", "novice/p16_port", "--host", "inline", "--verbose")

    assert any("hosts.py" in line for line in lines)


@pytest.mark.parametrize("host", HOSTS)
def test_frames_that_are_too_long_are_told_with_the_limit(host, told):
    lines, _ = told("run", "novice/p11_big", "--host", host)

    assert lines[0] == ("warning: radio: 2 agents: r1, r2: handed out 400 frames that nobody can receive: longer than "
                        "60 bytes (the first at 0 s has 800 bytes)")


@pytest.mark.parametrize("host", HOSTS)
@pytest.mark.parametrize("case", MISBEHAVING)
def test_what_a_misbehaving_program_did_is_said_alike_on_both_hosts(case, host, told):
    lines, _ = told("run", f"robots_that_misbehave/{case}", "--host", host)

    assert lines[0].startswith(MISBEHAVING[case])


def test_a_mistake_in_five_agents_is_one_line(tmp_path):
    agents = "\n".join(f'[agents.r{n}]\nprogram = "carts:Cart"\n'
                       'parameters = { period_ms = 20, gain = 0.1, offset_ms = 0 }\n'
                       f'plant = {{ fmu = "cart", parameters = {{ mass = 3.0 }} }}' for n in range(1, 6))
    shutil.copytree(CASES / "novice", tmp_path, dirs_exist_ok=True)
    (tmp_path / "five.toml").write_text(f'seed = 1\nlength_s = 1.0\n{agents}\n[media.radio]\n'
                                        'kind = "broadcast_radio"\n')

    result = CliRunner().invoke(app, ["check", str(tmp_path / "five.toml")])

    assert result.stderr.splitlines() == [
        "five.toml: agents.r1.plant.parameters.mass=3.0: no such parameter or start value; there are F, x, v, m, T "
        "(5 agents: r1, r2, r3, r4, r5)"]


# --- siblings

PROGRAM = '''\
class Robot:
    def __init__(self, board):
        self.board = board
{body}
'''
SIBLINGS = {
    "async run": ("    async def run(self):\n        pass",
                  "Robot.run is async, and asyncio does not run in virtual time"),
    "a generator under another name": ("    def main(self):\n        yield self.board.until(1)",
                                       "nothing starts its method `main`; call it `run`"),
    "run that returns nothing": ("    def run(self):\n        self.board.count('x')",
                                 "Robot.run is no generator"),
    "a key that [team] has not": ("        board.team['gain']",
                                  "r1 has no key of [team] 'gain'; the scenario has no [team]"),
    "a plant that is not": ("    def run(self):\n        yield self.board.until(1)\n"
                            "        self.board.sensors(['x'])",
                            "r1 has no plant; give it one, as agents.r1.plant = {"),
    "a yield of nothing": ("    def run(self):\n        yield", "yield None: expected an event"),
    "a sleep imported by name": ("    def run(self):\n        sleep(1)\n        yield self.board.until(1)",
                                 "time.sleep(1) would hold up the emulator"),
}


@pytest.mark.parametrize("host", HOSTS)
@pytest.mark.parametrize("case", SIBLINGS)
def test_a_sibling_of_these_mistakes_is_told_with_its_remedy(case, host, tmp_path):
    body, message = SIBLINGS[case]
    (tmp_path / "robot_of_a_novice.py").write_text("from time import sleep\n" + PROGRAM.format(body=body))
    (tmp_path / "one.toml").write_text('seed = 1\nlength_s = 0.1\n[agents.r1]\nprogram = "robot_of_a_novice:Robot"\n'
                                       '[media.radio]\nkind = "broadcast_radio"\n')

    result = CliRunner().invoke(app, ["run", str(tmp_path / "one.toml"), "--host", host, "--out",
                                      str(tmp_path / "out")])

    assert result.exit_code in (2, 3)
    assert message in result.stderr.splitlines()[0]


@pytest.mark.parametrize("body", [
    "    pass",                                                                         # only listens
    "        board.start(self.loop())\n    def loop(self):\n        yield self.board.until(1)",
    "    def run(self):\n        return self.loop()\n    def loop(self):\n        yield self.board.until(1)"])
def test_a_program_without_a_run_of_its_own_kind_is_accepted_if_it_starts_itself(body, tmp_path):
    (tmp_path / "robot_of_a_novice.py").write_text(PROGRAM.format(body=body))
    (tmp_path / "one.toml").write_text('seed = 1\nlength_s = 0.1\n[agents.r1]\nprogram = "robot_of_a_novice:Robot"\n'
                                       '[media.radio]\nkind = "broadcast_radio"\n')

    result = CliRunner().invoke(app, ["run", str(tmp_path / "one.toml"), "--host", "inline", "--out",
                                      str(tmp_path / "out")])

    assert result.exit_code == 0
