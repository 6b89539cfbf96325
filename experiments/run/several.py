"""`marconet run` and `marconet check` for one or several scenarios, with a table, JSON and JUnit XML at the end.

After a scenario that is refused or fails, or whose robot program ends the process of an inline run, the next one runs;
Ctrl-C and SIGTERM end the whole call. The exit code is the highest of the scenarios' codes.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import msgspec

from experiments.run.exits import Ended, ExitCode, errors_as_text, in_words
from experiments.show.console import print_table
from experiments.show.outcome import ScenarioOutcome

if TYPE_CHECKING:
    from experiments.judge.run_result import RunResult, Summary
    from experiments.run.inline_parent import Child
    from experiments.run.live.server_process import ServerProcess
    from experiments.run.replay import Replay
    from experiments.scenario import Scenario
    from experiments.show.console import Console
    from netem.gateways.network_settings import NetworkSettings


class ViewPorts(NamedTuple):
    """Where a run is shown: the port of the page, that for Foxglove, or None; 0: any free port."""

    page: int
    foxglove: int | None


INTERRUPTED_FROM = 128                  # exit codes from here on are those of a signal


@dataclass
class Batch:
    console: Console
    verbose: bool
    junit: Path | None
    json_key: str | None                # key of the list in the JSON document; None: text
    outcomes: list[ScenarioOutcome] = field(default_factory=list)
    in_children: bool = False           # True: scenarios run in child processes (inline_parent.py)
    child: Child | None = None          # set in such a child

    def check(self, sources: Sequence[str], seed: int | None, duration_s: float | None,
              overrides: Sequence[str]) -> int:
        def one(source: str) -> ScenarioOutcome:
            from experiments.scenario.standing_robots import standing_robots
            from experiments.show.text_views import print_scenario

            with errors_as_text(self.verbose):
                scenario = _load(source, seed, duration_s, overrides)
                if len(sources) == 1:
                    print_scenario(self.console, scenario)
                _print_warnings(scenario.name, standing_robots(scenario), len(sources) == 1)
                resolved = scenario.resolved() if self.json_key else None
                return ScenarioOutcome(scenario.name, source, ExitCode.DONE, [], resolved=resolved)

        return self._each(sources, "check", one)

    def run(self, sources: Sequence[str], seed: int | None, duration_s: float | None, overrides: Sequence[str],
            out: Path | None, *, fates_of: Path | None = None, match: Literal["number", "instant"] = "number",
            view: ViewPorts | None = None, gdb: str | None = None, **options: Any) -> int:
        names = _folder_names(sources)

        def one(source: str) -> ScenarioOutcome:
            with errors_as_text(self.verbose):
                scenario = _load(source, seed, duration_s, overrides)
                replay = _replay(source, scenario, fates_of, match)
                folder = run_folder(scenario, out / names[source] if out and len(sources) > 1 else out)
            with errors_as_text(self.verbose, kept=folder):
                return self._run(source, scenario, folder, len(sources) == 1, view, gdb, {**options, "replay": replay})

        return self._each(sources, "run", one)

    def _each(self, sources: Sequence[str], verb: str, one: Callable[[str], ScenarioOutcome]) -> int:
        try:
            if self.in_children:
                self._in_children(sources, one)
            else:
                self._in_turn(sources, one, self.outcomes.append)
        finally:
            with errors_as_text(self.verbose):
                self._print(verb, len(sources) > 1)
        return max(outcome.exit_code for outcome in self.outcomes)

    def _in_turn(self, sources: Sequence[str], one: Callable[[str], ScenarioOutcome],
                 became: Callable[[ScenarioOutcome], None]) -> int:
        code = 0
        for source in sources:
            try:
                outcome = one(source)
            except Ended as ended:
                folder = None if ended.folder is None else str(ended.folder)
                outcome = ScenarioOutcome(_stem(source), source, ended.exit_code, ended.lines, folder)
            became(outcome)
            code = max(code, outcome.exit_code)
            if code >= INTERRUPTED_FROM:
                break
        return code

    def _in_children(self, sources: Sequence[str], one: Callable[[str], ScenarioOutcome]) -> None:
        """Run the scenarios in a child process; if a robot program ends it, run the remaining ones in a new child."""
        from experiments.run.inline_parent import run_in_child

        left = list(sources)
        while left:
            ending = run_in_child(partial(self._as_child, left, one))
            told = [msgspec.msgpack.decode(outcome, type=ScenarioOutcome) for outcome in ending.outcomes]
            if ending.broken_off or (len(told) < len(left) and ending.exit_code < INTERRUPTED_FROM):
                source = left[min(len(told), len(left) - 1)]
                told.append(ScenarioOutcome(_stem(source), source, ending.exit_code, ending.lines,
                                            ending.folder or None))
            elif not told:
                told = [ScenarioOutcome(_stem(left[0]), left[0], ending.exit_code, ending.lines)]
            self.outcomes += told
            left = left[len(told):]
            if max(outcome.exit_code for outcome in self.outcomes) >= INTERRUPTED_FROM:
                break

    def _as_child(self, sources: Sequence[str], one: Callable[[str], ScenarioOutcome], child: Child) -> int:
        self.child = child
        return self._in_turn(sources, one, lambda outcome: child.became(msgspec.msgpack.encode(outcome)))

    def _run(self, source: str, scenario: Scenario, folder: Path, in_full: bool, ports: ViewPorts | None,
             gdb: str | None, options: dict[str, Any]) -> ScenarioOutcome:
        from experiments.run import runner
        from experiments.run.debugged import awaiting_debugger
        from experiments.show.live_view import live_view
        from experiments.show.text_views import print_path, print_summary

        if self.child is not None:
            self.child.begins(folder, list(scenario.agents), scenario.node_timeout_s)
            options = options | {"under_way": self.child.under_way}
        with awaiting_debugger(scenario, gdb) as debugged, shown_in(ports, scenario.network) as view:
            if debugged is not None:
                print(f"{debugged.node} waits for gdb: {debugged.command}", file=sys.stderr, flush=True)
                options = options | {"debugged": debugged}
            with live_view(self.console, scenario.name, scenario.length_ns * 1e-9) as progress:
                result = runner.run(scenario, out=folder, progress=progress, view=view, **options)
            if view is not None:
                view.end(result.summary.holds, what_does_not_hold(result.summary), result.folder, _report_of(result))
        if in_full:
            print_summary(self.console, result.summary)
            self.console.print()
            report = _report_of(result)
            print_path(self.console, "records" if report is None else "report", report or result.folder)
        _print_warnings(scenario.name, result.summary.warnings, in_full)
        problems = what_does_not_hold(result.summary)
        for line in () if in_full and self._one_terminal() else problems:
            print(line if in_full else f"{scenario.name}: {line}", file=sys.stderr)
        code = ExitCode.DONE if result.summary.holds else ExitCode.EXPECTATION_BROKEN
        return ScenarioOutcome(scenario.name, source, code, problems, str(result.folder), result.summary)

    def _one_terminal(self) -> bool:
        """Return whether results and errors meet on a terminal, where the table says already what does not hold."""
        return self.console.is_terminal and sys.stdout.isatty() and sys.stderr.isatty()

    def _print(self, verb: str, several: bool) -> None:
        if several:
            self.console.print()
            print_table(self.console, ["scenario", "outcome", "wall time", "records"], [
                (outcome.scenario, _in_a_word(outcome),
                 f"{outcome.summary.wall_s:.2f} s" if outcome.summary else "-", outcome.folder or "-")
                for outcome in self.outcomes])
        if self.json_key:
            from experiments.show.json_output import print_json

            print_json({"exit_code": max(outcome.exit_code for outcome in self.outcomes),
                        self.json_key: [_as_json(outcome, verb) for outcome in self.outcomes]})
        if self.junit is not None:
            from experiments.show.junit_file import write_junit

            write_junit(self.junit, verb, self.outcomes)


@contextmanager
def shown_in(ports: ViewPorts | None, network: NetworkSettings) -> Iterator[ServerProcess | None]:
    """Yield the server of a view for one run, whose addresses are printed; None if `ports` asks for none."""
    if ports is None:
        yield None
        return
    from experiments.run.live.server_process import ServerProcess  # late: few runs are watched

    server = ServerProcess(ports.page, ports.foxglove, network)
    try:
        print(f"view: {server.url}", file=sys.stderr, flush=True)
        if server.door is not None:
            print("view: a browser needs the certificate of " + " or ".join(network.operators), file=sys.stderr,
                  flush=True)
        if server.foxglove_url:
            print(f"Foxglove: open {server.foxglove_url}", file=sys.stderr, flush=True)
        yield server
    except BaseException as error:
        server.fail(in_words(error))
        raise
    finally:
        server.close()


def _replay(source: str, scenario: Scenario, folder: Path | None, match: Literal["number", "instant"]) -> Replay | None:
    """Return the fates that are asked for, or that the run which is repeated met itself; None without any."""
    from experiments.run.repeat import holds_run, made_with

    if folder is None and holds_run(Path(source)):
        _, _, earlier, match = made_with(Path(source))
        folder = Path(earlier) if earlier else None
    if folder is None:
        return None
    from experiments.run.replay import replay_of  # late: it reads a ledger

    return replay_of(folder, scenario, match)


def what_does_not_hold(summary: Summary) -> list[str]:
    """Return a line for each expectation that does not hold and each guarantee that is not as expected."""
    return [*(f"expect.{verdict.key}{'' if verdict.value is None else f'={verdict.value}'}: {verdict.by_how_much()}"
              for verdict in summary.verdicts if not verdict.holds),
            *(f"guarantees.{standing.name}: {standing.in_words()}"
              for standing in summary.guarantees if not standing.as_expected)]


def run_folder(scenario: Scenario, out: Path | None) -> Path:
    """Return the folder of the run; raises an OSError if `out` is a file or holds other files than those of a run."""
    from experiments.judge.run_files import SCENARIO

    folder = out or Path("runs") / f"{scenario.name}-{datetime.now():%Y%m%d-%H%M%S-%f}"
    above = next((parent for parent in folder.parents if parent.exists()), None)
    if above is not None and not above.is_dir():
        raise NotADirectoryError(f"{'--out ' if out else ''}{folder}: {above} is a file: expected a folder of a run or "
                                 "a path where one can be made; name another")
    if folder.exists() and (not folder.is_dir() or (any(folder.iterdir()) and not SCENARIO.is_in(folder))):
        raise FileExistsError(f"--out {folder}: holds something else than a run; name a new folder")
    return folder


def _report_of(result: RunResult) -> Path | None:
    written = result.folder / (result.summary.report or ".")
    return written if written.is_file() else None


def _print_warnings(scenario: str, warnings: Sequence[str], in_full: bool) -> None:
    for line in warnings:
        print(f"warning: {line}" if in_full else f"{scenario}: warning: {line}", file=sys.stderr)


def _folder_names(sources: Sequence[str]) -> dict[str, str]:
    """Return, by source, the name of its records folder: the stem of the file, with `-2`, `-3`, ... if it is taken."""
    taken: Counter[str] = Counter()
    names = {}
    for source in dict.fromkeys(sources):
        stem = _stem(source)
        taken[stem] += 1
        names[source] = stem if taken[stem] == 1 else f"{stem}-{taken[stem]}"
    return names


def _stem(source: str) -> str:
    """Return the name of a scenario that was not loaded, or not in this process; of a run's folder, its own name."""
    return Path(source).stem if source.endswith(".toml") else Path(source).name


def _load(source: str, seed: int | None, duration_s: float | None, overrides: Sequence[str]) -> Scenario:
    from experiments.run.repeat import holds_run, made_with
    from experiments.scenario import find, load

    if holds_run(Path(source)):
        return made_with(Path(source)).load(seed, duration_s, overrides)
    return load(find(source), seed=seed, duration_s=duration_s, overrides=overrides)


def _in_a_word(outcome: ScenarioOutcome) -> str:
    return {ExitCode.DONE: "ok" if outcome.summary is None else "holds", ExitCode.EXPECTATION_BROKEN: "DOES NOT HOLD",
            ExitCode.BAD_INPUT: "refused", ExitCode.NODE_FAILED: "a node failed", ExitCode.DEFECT: "DEFECT"
            }.get(ExitCode(outcome.exit_code), "ended from outside")


def _as_json(outcome: ScenarioOutcome, verb: str) -> dict[str, Any]:
    common = {"scenario": outcome.scenario, "source": outcome.source, "exit_code": outcome.exit_code,
              "problems": outcome.problems}
    if verb == "check":
        return {**common, "resolved": outcome.resolved}
    return {**common, "folder": outcome.folder, "summary": outcome.summary}
