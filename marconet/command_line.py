"""The `marconet` command: finds the input, calls the runner and prints; `exits` has the exit codes.

Commands import their modules themselves, so that `--help` starts fast. docs/command_line.md has a section on every
command.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeVar

import click

from experiments.run.exits import ExitCode, errors_as_text
from marconet.certificate_commands import certificates, verbosely
from marconet.completion import complete_plant, complete_scenario, install, script
from netem.records.table import FROM_FRAMES

if TYPE_CHECKING:
    from experiments.show.console import Console

Command = TypeVar("Command", bound=Callable[..., Any])
TABLES = ("3.1", "3.2", "3.3", "3.4", "3.5", "5.1", "5.2", "5.3", "5.4")
ON_ITS_OWN = "this process is the command's own, so it may fork and change settings of the process"
HOST = ("One process for each robot, or all of them in this one, which is faster and gives the same result. Default: "
        "inline, or process if a program is blocking code.")
SHELLS = ("bash", "zsh", "fish")


class WholeNumber(click.types.IntParamType):
    """A whole number from `least` to `most`, inclusive; `--help` prints no range, unlike with `click.IntRange`."""

    def __init__(self, least: int, most: int | None = None) -> None:
        self._range = click.IntRange(least, most)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        return self._range.convert(value, param, ctx)


PORT = WholeNumber(0, 65535)


def _shared(*options: Callable[[Any], Any]) -> Callable[[Command], Command]:
    """Return a decorator that adds options, in this order, to a command; several commands share them."""
    def add(command: Command) -> Command:
        for option in reversed(options):
            command = option(command)
        return command

    return add


sources = click.argument("sources", metavar="SCENARIO...", nargs=-1, required=True, shell_complete=complete_scenario)
changes = _shared(
    click.option("--seed", type=int, metavar="N", help="Instead of the scenario's seed."),
    click.option("--duration", type=float, metavar="S", help="Seconds of robot time."),
    click.option("--set", "overrides", multiple=True, metavar="PATH.TO.KEY=VALUE",
                 help="Replace one value of the file; the value is TOML. May be repeated."))
as_json = click.option("--json", "as_json", is_flag=True, help="Print one JSON document instead of text.")
reporting = _shared(
    click.option("--junit", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE",
                 help="Also write the outcome as JUnit XML, for continuous integration."),
    as_json,
    click.option("--quiet", is_flag=True, help="Print errors only."),
    verbosely)


def _version(context: click.Context, parameter: click.Parameter, wanted: bool) -> None:
    if wanted:
        import platform
        from importlib.metadata import version

        from experiments import CODE

        click.echo(f"marconet {version('marconet')} (Python {platform.python_version()}, {CODE.partition(':')[0]})")
        context.exit()


def _show_completion(context: click.Context, parameter: click.Parameter, shell: str | None) -> None:
    if shell:
        click.echo(script(app, shell))
        context.exit()


def _install_completion(context: click.Context, parameter: click.Parameter, shell: str | None) -> None:
    if shell:
        with errors_as_text(False):
            click.echo(install(app, shell))
        context.exit()


class WithOptionalPorts(click.Command):
    """A command whose options `--view` and `--foxglove` may stand without a port, which is any free one then."""

    def parse_args(self, context: click.Context, words: list[str]) -> list[str]:
        alone = [word in ("--view", "--foxglove") and not "".join(words[place + 1:place + 2]).isdigit()
                 for place, word in enumerate(words)]
        return super().parse_args(context, [f"{word}=0" if without else word
                                            for word, without in zip(words, alone, strict=True)])


@click.group(epilog="Example: marconet run output_sync", no_args_is_help=True)
@click.option("--version", is_flag=True, is_eager=True, expose_value=False, callback=_version,
              help="Show the version and exit.")
@click.option("--show-completion", type=click.Choice(SHELLS), is_eager=True, expose_value=False,
              callback=_show_completion, help="Print the script that completes this command in a shell.")
@click.option("--install-completion", type=click.Choice(SHELLS), is_eager=True, expose_value=False,
              callback=_install_completion, help="Put that script where the shell looks for it.")
def app() -> None:
    """Emulate a team of robots that hear each other only now and then."""


@app.group(no_args_is_help=True, epilog="Example: marconet fmu info linear_system")
def fmu() -> None:
    """Look at plants and build them."""


app.add_command(certificates)


@app.group(no_args_is_help=True, epilog="Example: marconet firmware new blinker")
def firmware() -> None:
    """Write, build and look at robots' programs in C."""


@app.command("list", epilog="Example: marconet list")
@as_json
@verbosely
def list_scenarios(as_json: bool, verbose: bool) -> None:
    """List the scenarios, with the question of each.

    They are those in ./scenarios and those that come with marconet.
    """
    with errors_as_text(verbose):
        from experiments.scenario import catalog
        from experiments.show.console import print_table

        if as_json:
            from experiments.show.json_output import print_json

            print_json({"scenarios": [{"name": entry.name, "question": entry.question, "path": str(entry.path)}
                                      for entry in catalog()]})
        else:
            print_table(_console(), ["scenario", "question"], [(entry.name, entry.question) for entry in catalog()])


@app.command(epilog="Example: marconet check output_sync --set 'impairments[0].loss_ratio=0.3'")
@sources
@changes
@reporting
def check(sources: Sequence[str], seed: int | None, duration: float | None, overrides: Sequence[str],
          junit: Path | None, as_json: bool, quiet: bool, verbose: bool) -> None:
    """Find every mistake in scenarios without running them.

    Prints what would run if there is none.
    """
    if _process_is_its_own():
        from marconet.short_command import expect_to_end_soon

        expect_to_end_soon()
    from experiments.run.several import Batch

    batch = Batch(_console(not (quiet or as_json)), verbose, junit, "checks" if as_json else None)
    raise SystemExit(batch.check(sources, seed, duration, overrides))


@app.command(cls=WithOptionalPorts,
             epilog="Example: marconet run output_sync --seed 3 --set 'impairments[0].loss_ratio=0.3' --out runs/third")
@sources
@changes
@click.option("--host", type=click.Choice(["process", "inline"]), default="process", show_default=True,
              help="One process for each robot, or all of them in this one: faster, and the same result.")
@click.option("--out", type=click.Path(path_type=Path), metavar="DIR",
              help="Folder for the records; of several scenarios, one in it for each. Default: new ones in ./runs.")
@click.option("--no-report", is_flag=True, help="Write the records without report.html.")
@click.option("--real-time", is_flag=True,
              help="At the wall clock's pace; a scenario with gateways to the outside needs it.")
@click.option("--rate", type=float, metavar="R",
              help="Real time at R virtual seconds a second of the wall clock, as 0.5; means --real-time.")
@click.option("--overrun", type=click.Choice(["slip", "abort"]),
              help="What a run does that is too late: go on and catch up, or end; means --real-time.")
@click.option("--view", type=PORT, metavar="[PORT]",
              help="Show the run in a page on this machine while it happens: fates, faults to inject, pause, speed.")
@click.option("--foxglove", type=PORT, metavar="[PORT]",
              help="Show the page, and signals and positions to Foxglove; needs marconet[foxglove].")
@click.option("--gdb", metavar="NODE[:PORT]",
              help="Let the emulated processor of this robot wait for gdb, which the command printed starts.")
@click.option("--overwrite", is_flag=True, help="Replace the records of an earlier run in the folder.")
@click.option("--fates-of", type=click.Path(path_type=Path), metavar="RUN",
              help="Frames meet the fates and delays recorded in the folder of an earlier run, instead of impairments.")
@click.option("--match", type=click.Choice(["number", "instant"]), default="number", show_default=True,
              help="Which recorded frame of its link one meets: that with its number, or that at its instant.")
@reporting
def run(sources: Sequence[str], seed: int | None, duration: float | None, overrides: Sequence[str],
        host: Literal["process", "inline"], out: Path | None, no_report: bool, real_time: bool,
        rate: float | None, overrun: Literal["slip", "abort"] | None, view: int | None, foxglove: int | None,
        gdb: str | None, overwrite: bool, fates_of: Path | None,
        match: Literal["number", "instant"], junit: Path | None, as_json: bool, quiet: bool, verbose: bool) -> None:
    """Run scenarios and write their records and reports.

    Exits with 0 if every [expect] holds, 1 if one does not, 2 for bad input, 3 when a node failed; of several
    scenarios, with the highest of their codes.
    """
    from experiments.run.several import Batch, ViewPorts

    if gdb is not None and len(sources) > 1:
        raise click.UsageError("--gdb is for one scenario")
    batch = Batch(_console(not (quiet or as_json)), verbose, junit, "runs" if as_json else None)
    pace = [*([] if rate is None else [f"real_time.rate={rate}"]),
            *([] if overrun is None else [f'real_time.overrun="{overrun}"'])]
    shown = None if view is None and foxglove is None else ViewPorts(view or 0, foxglove)
    batch.in_children = host == "inline" and _process_is_its_own()
    raise SystemExit(batch.run(sources, seed, duration, [*overrides, *pace], out, host=host,
                               real_time=real_time or bool(pace), report=not no_report, overwrite=overwrite,
                               fates_of=fates_of, match=match, view=shown, gdb=gdb))


@app.command(epilog="Example: marconet sweep p3at_chases_p3at --vary 'impairments[1].loss_ratio=0,0.3,0.6' --seeds 4")
@click.argument("source", metavar="SCENARIO", shell_complete=complete_scenario)
@click.option("--vary", "vary", multiple=True, metavar="KEY=VALUES",
              help="Values of one key: a,b,c in TOML, or lo:hi:n. May be repeated: every combination is run.")
@click.option("--seeds", type=int, default=1, show_default=True, metavar="N",
              help="Seeds that each setting is run with, from the scenario's or --seed on.")
@changes
@click.option("--sample", type=click.Choice(["latin"]), help="Draw the settings, as a Latin hypercube; see --runs.")
@click.option("--runs", type=int, metavar="N", help="Settings that --sample draws, from values or from lo:hi.")
@click.option("--host", type=click.Choice(["inline", "process"]),
              help=HOST)
@click.option("--jobs", type=int, metavar="N", help="Runs at a time on this machine. Default: one for each core.")
@click.option("--cluster", default="", metavar="ADDRESS",
              help="Run on a Dask cluster instead: tcp://127.0.0.1:PORT or tls://HOST:PORT.")
@click.option("--resume", is_flag=True, help="Go on with the campaign in --out.")
@click.option("--out", type=click.Path(path_type=Path), metavar="DIR", help="Its folder. Default: a new one in ./runs.")
@click.option("--folders", type=WholeNumber(0), default=5, show_default=True, metavar="N",
              help="Runs that are repeated with all records: first those that do not hold, then the worst.")
@as_json
@click.option("--quiet", is_flag=True, help="Print errors only.")
@verbosely
def sweep(source: str, vary: Sequence[str], seeds: int, seed: int | None, duration: float | None,
          overrides: Sequence[str], sample: str | None, runs: int | None, host: Literal["inline", "process"] | None,
          jobs: int | None, cluster: str, resume: bool, out: Path | None, folders: int, as_json: bool, quiet: bool,
          verbose: bool) -> None:
    """Run a scenario with varied keys and many seeds.

    This is a campaign: each run leaves its figures and its hash. Exits with 0 if every run holds and every
    share of runs that the scenario expects is shown, 1 if not, 3 if a run failed.
    """
    from experiments.sweep.command import run_sweep

    raise SystemExit(run_sweep(
        _console(not (quiet or as_json)), source, vary, verbose=verbose, as_json=as_json, sample=sample, runs=runs,
        seeds=seeds, seed=seed, duration_s=duration, overrides=overrides, host=host, jobs=jobs, cluster=cluster,
        resume=resume, out=out, folders=folders))


@app.command("break", epilog="Example: marconet break p3at_chases_p3at --budget 'view: evader -> pursuer: at most 2 "
                            "lost in a row' --minimize guarantee.no_escape.margin_m --runs 20")
@click.argument("source", metavar="SCENARIO", shell_complete=complete_scenario)
@click.option("--budget", "budgets", multiple=True, metavar="TEXT",
              help="'radio: * -> *: at most 2 lost in a row', 'radio: a -> b: at most 3 lost of 10', 'faults: at most "
                   "3', 'faults: at most 3 of kill, pause'. May be repeated; all hold together.")
@click.option("--minimize", metavar="FORMULA",
              help="Make this as small as possible: a formula, a figure's key, or a key of [expect].")
@click.option("--maximize", metavar="FORMULA",
              help="Make this as large as possible: a formula, a figure's key, or a key of [expect].")
@click.option("--vary", "vary", multiple=True, metavar="KEY=lo:hi",
              help="Search this setting as well, by CMA-ES. May be repeated; needs marconet[search].")
@click.option("--runs", type=int, default=200, show_default=True, metavar="N", help="Runs of the search.")
@click.option("--jobs", type=int, metavar="N", help="Runs at a time. Default: one for each core. Same result.")
@click.option("--seed", type=WholeNumber(0), default=0, show_default=True, metavar="N",
              help="Seed of the search; the runs have the scenario's own seed.")
@click.option("--duration", type=float, metavar="S", help="Seconds of robot time.")
@click.option("--set", "overrides", multiple=True, metavar="PATH.TO.KEY=VALUE",
              help="Replace one value of the file; the value is TOML. May be repeated.")
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), metavar="DIR",
              help="Folder for the scenario that is found. Default: ./runs, or beside SCENARIO if its programs are "
                   "found from there.")
@as_json
@click.option("--quiet", is_flag=True, help="Print errors only.")
@verbosely
def break_(source: str, budgets: Sequence[str], minimize: str | None, maximize: str | None, vary: Sequence[str],
           runs: int, jobs: int | None, seed: int, duration: float | None, overrides: Sequence[str],
           out: Path | None, as_json: bool, quiet: bool, verbose: bool) -> None:
    """Find the worst losses and faults within a budget.

    Writes them as a scenario. Exits with 0 if every [expect] holds even then, 1 if one does not, 3 if a node failed.
    """
    from experiments.search.command import run_break

    raise SystemExit(run_break(
        _console(not (quiet or as_json)), source, budgets, minimize, maximize, vary, verbose=verbose, as_json=as_json,
        runs=runs, jobs=jobs, seed=seed, duration_s=duration, overrides=overrides, out=out))


@app.command(epilog="Example: marconet shrink runs/third --out smallest.toml")
@click.argument("run_dir", metavar="RUN", type=click.Path(path_type=Path))
@click.option("--runs", type=int, default=500, show_default=True, metavar="N", help="Most runs that this may take.")
@click.option("--expect", "expectation", default="", metavar="KEY",
              help="The expectation that has to fail. Default: the first that does, or the failure of the run.")
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE",
              help="File for the scenario that is found. Default: a new one in ./runs, or beside the scenario of RUN "
                   "if its programs are found from there.")
@as_json
@click.option("--quiet", is_flag=True, help="Print errors only.")
@verbosely
def shrink(run_dir: Path, runs: int, expectation: str, out: Path | None, as_json: bool, quiet: bool,
           verbose: bool) -> None:
    """Find the few faults and losses that make a run fail.

    Delays and flipped bits count as well. Writes a scenario of which none of them can be left out and whose run is as
    short as it can be.
    """
    from experiments.search.command import run_shrink

    raise SystemExit(run_shrink(_console(not (quiet or as_json)), run_dir, verbose=verbose, as_json=as_json, runs=runs,
                                expectation=expectation, out=out))


@app.command(epilog="Example: marconet compare runs/first runs/second")
@click.argument("a", metavar="A", type=click.Path(path_type=Path))
@click.argument("b", metavar="B", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE.html",
              help="The page. Default: compare.html in B.")
@verbosely
def compare(a: Path, b: Path, out: Path | None, verbose: bool) -> None:
    """Compare two campaigns, or draw two runs over each other.

    Of two campaigns it says whether they differ by more than chance. A and B are folders of campaigns, or of runs.
    """
    with errors_as_text(verbose):
        from experiments.show.campaign.compare import PAGE
        from experiments.show.campaign.compare import compare as compared
        from experiments.show.console import print_table
        from experiments.show.text_views import print_path

        console = _console()
        found = compared(a, b)
        print_table(console, found.columns, found.rows)
        for line in found.lines:
            console.print(line, soft_wrap=True)
        print_path(console, "page", found.write(out or b / PAGE))


@app.command(epilog="Example: marconet report runs/third")
@click.argument("run_dir", metavar="RUN_DIR", type=click.Path(path_type=Path))
@click.option("--self-contained", is_flag=True,
              help="Include the drawing library in the page, so that it can be sent alone. By default it is included "
                   "only if no other run lies beside this one.")
@verbosely
def report(run_dir: Path, self_contained: bool, verbose: bool) -> None:
    """Write report.html anew from the records of a run."""
    with errors_as_text(verbose):
        from experiments.judge.run_files import SCENARIO
        from experiments.run.killed_run import complete, is_unfinished
        from experiments.run.run_folder import owner
        from experiments.show.report.build import write_report
        from experiments.show.text_views import print_path

        if not SCENARIO.is_in(run_dir):
            raise FileNotFoundError(f"{run_dir}: no run was recorded there: {_runs_near(run_dir)}")
        if is_unfinished(run_dir) and not owner(run_dir):
            for problem in complete(run_dir):
                click.echo(problem, err=True)
        print_path(_console(), "report", write_report(run_dir, "inside" if self_contained else "auto"))


@app.command(epilog="Example: marconet fault runs/third kill on=r3 restart_after_s=1.5")
@click.argument("run_dir", metavar="RUN")
@click.argument("kind", metavar="KIND")
@click.argument("keys", metavar="KEY=VALUE...", nargs=-1)
@click.option("--certificates", type=click.Path(path_type=Path), metavar="FOLDER",
              help="For a run on another machine: where authority.crt, NAME.crt and NAME.key are.")
@click.option("--as", "operator", default="operator", show_default=True, metavar="NAME",
              help="Whose certificate is shown to that run.")
@verbosely
def fault(run_dir: str, kind: str, keys: Sequence[str], certificates: Path | None, operator: str,
          verbose: bool) -> None:
    """Inject a fault into a run that goes on.

    The run is in real time or has a view; the fault begins at once. Keys are those of [[faults]] in a scenario. RUN
    is the folder of a run on this machine, or tls://HOST:PORT with the `faults_port` of a run's [network].
    """
    with errors_as_text(verbose):
        from experiments.run.injection import inject, inject_through_door, parse_keys

        if "://" not in run_dir:
            if certificates is not None:
                raise click.UsageError("--certificates is for a run on another machine, as tls://192.168.1.5:7600")
            name, at_ns = inject(Path(run_dir), kind, parse_keys(keys))
        elif certificates is None:
            raise click.UsageError(f"{run_dir}: a door with TLS needs --certificates FOLDER, with the certificate and "
                                   f"key of {operator}")
        else:
            from netem.gateways.door_client import Caller

            name, at_ns = inject_through_door(run_dir, Caller(certificates, operator), kind, parse_keys(keys))
        click.echo(f"{name}: {kind} at {at_ns / 1e9:.9g} s")


@app.command(epilog="Example: marconet export runs/third --as traces --out traces")
@click.argument("run_dir", metavar="RUN_DIR", type=click.Path(path_type=Path))
@click.option("--as", "form", type=click.Choice(["traces", *FROM_FRAMES]), required=True,
              help="traces: a CSV for each link, as the impairment `trace` reads it, and the lines of a scenario for "
                   "them. Others: logs of the frames, of a run with record = \"frames\".")
@click.option("--medium", metavar="NAME", help="Frames of this medium only. Default: all that the format fits.")
@click.option("--by", type=click.Choice(["frame", "time"]), default="frame", show_default=True,
              help="Of traces: whether a frame meets the row with its number or the row in force at its instant.")
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), metavar="DIR",
              help="Folder for the files; traces need one. Default: the folder of the run.")
@verbosely
def export(run_dir: Path, form: str, medium: str | None, by: Literal["frame", "time"], out: Path | None,
           verbose: bool) -> None:
    """Write what a run recorded in another file format."""
    with errors_as_text(verbose):
        from experiments.judge.run_files import SCENARIO
        from experiments.show.text_views import print_path

        if not SCENARIO.is_in(run_dir):
            raise FileNotFoundError(f"{run_dir}: no run was recorded there: {_runs_near(run_dir)}")
        if form == "traces":
            from experiments.judge.trace_files import write_traces

            if out is None or medium is not None:
                raise click.UsageError("--as traces needs --out DIR and takes no --medium: it writes every link")
            print_path(_console(), form, write_traces(run_dir, out, by)[-1])
            return
        from experiments.run.export import export_frames
        from experiments.run.killed_run import complete, is_unfinished
        from experiments.run.run_folder import owner

        if is_unfinished(run_dir) and not owner(run_dir):
            for problem in complete(run_dir):
                click.echo(problem, err=True)
        for path in export_frames(run_dir, form, medium, out or run_dir):
            print_path(_console(), form, path)


def _runs_near(folder: Path) -> str:
    """Say why `folder` holds no run, and name the newest run in it."""
    from experiments.judge.run_files import SCENARIO

    if not folder.is_dir():
        return "give the folder of a run" if folder.exists() else "there is no such folder"
    runs = sorted(file.parent for file in folder.glob(f"*/{SCENARIO.name}"))
    return f"it has no {SCENARIO.name}" + (f"; the newest run in it is {max(runs, key=_changed_s)}" if runs else "")


def _changed_s(path: Path) -> float:
    return path.stat().st_mtime


@app.command(epilog="Example: marconet schema --out marconet.schema.json")
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE",
              help="Write it there instead of printing it.")
@verbosely
def schema(out: Path | None, verbose: bool) -> None:
    """Print the JSON Schema of scenarios, for editors.

    With it an editor completes and checks the keys of a scenario.
    """
    with errors_as_text(verbose):
        from experiments.scenario.json_schema import scenario_schema
        from experiments.show.json_output import as_text
        from experiments.show.text_views import print_path

        text = as_text(scenario_schema())
        if out is None:
            click.echo(text)
        else:
            out.write_text(text + "\n", encoding="utf-8")
            print_path(_console(), "schema", out)


@app.command(epilog="Example: marconet table 3.1 --runs 20 --figures figures.html")
@click.argument("number", type=click.Choice(TABLES), metavar="NUMBER")
@click.option("--runs", type=WholeNumber(2), metavar="N",
              help="Monte Carlo runs of each cell, default 100, or rounds of timing, default 20; 2 or more. With few "
                   "runs a cell may be missed by chance.")
@click.option("--figures", type=click.Path(path_type=Path), metavar="OUT.html",
              help="Also draw figures 3.5, 3.6 and 3.8, or 5.3 and 5.4, as a page that opens offline.")
@verbosely
def table(number: str, runs: int | None, figures: Path | None, verbose: bool) -> None:
    """Compute a table again, beside the printed figures.

    3.1 to 3.5 are tables of the dissertation. 5.1 to 5.4 are ours: its Chapter 5 prints no table, but some of their
    figures in its text. Exits with 0 if every cell is what it has to be, 1 if one is not.
    """
    with errors_as_text(verbose):
        met = _table(number, runs, figures)
    if not met:
        raise SystemExit(ExitCode.EXPECTATION_BROKEN)


@app.command("compile", epilog="Example: marconet compile")
@click.option("--if-possible", is_flag=True, help="If a tool is missing, say so and exit with 0.")
@verbosely
def compile_inner_loops(if_possible: bool, verbose: bool) -> None:
    """Compile the inner loops to C: twice as fast.

    Once for these sources, in two to five minutes. Runs give the same results.
    """
    with errors_as_text(verbose):
        from experiments.compiled.build import CannotCompile, compile_modules

        try:
            with _console().status("compiling, two to five minutes"):
                folder = compile_modules()
        except CannotCompile as error:
            if not if_possible:
                raise
            _console().print(f"not compiled, so at half the speed: {error}", soft_wrap=True)
        else:
            _console().print(f"compiled: {folder}", soft_wrap=True)


@fmu.command("list", epilog="Example: marconet fmu list")
@verbosely
def list_plants(verbose: bool) -> None:
    """List the plants that come with marconet."""
    with errors_as_text(verbose):
        from experiments.show.console import print_table
        from fmus.build import model_folder, own_models
        from fmus.describe import read_model

        models = [read_model(model_folder(name) / "variables.toml") for name in own_models()]
        print_table(_console(), ["plant", "about"], [(model.name, model.description) for model in models])


@fmu.command(epilog="Example: marconet fmu info linear_system")
@click.argument("plant", shell_complete=complete_plant)
@verbosely
def info(plant: str, verbose: bool) -> None:
    """Show a plant's variables, and its presets.

    Variables are shown with their units and start values. PLANT is a name from `marconet fmu list`, a model folder,
    or a .fmu file.
    """
    with errors_as_text(verbose):
        from experiments.show.text_views import print_plant, print_presets
        from fmus.build import build_model, model_folder, own_models
        from fmus.describe import read_model
        from fmus.describe_fmu import describe
        from fmus.presets import read_presets

        _refuse_unknown_plant(plant)
        is_model = plant in own_models() or Path(plant).is_dir()
        archive = build_model(plant if plant in own_models() else Path(plant)) if is_model else Path(plant)
        print_plant(_console(), describe(archive))
        if is_model:
            folder = model_folder(plant if plant in own_models() else Path(plant))
            print_presets(_console(), read_presets(folder, read_model(folder / "variables.toml")))


@fmu.command(epilog="Example: marconet fmu build linear_system --fmi 2.0")
@click.argument("plants", nargs=-1, shell_complete=complete_plant)
@click.option("--fmi", type=click.Choice(["3.0", "2.0"]), default="3.0", show_default=True,
              help="Version of the standard.")
@verbosely
def build(plants: Sequence[str], fmi: Literal["3.0", "2.0"], verbose: bool) -> None:
    """Compile plants into FMUs and print where they are.

    Those that are compiled already are not compiled again. PLANTS are names or model folders; default: all that
    come with marconet.
    """
    with errors_as_text(verbose):
        from experiments.show.text_views import print_path
        from fmus.build import build_model, own_models

        for name in plants:
            _refuse_unknown_plant(name)
        for name in plants or own_models():
            print_path(_console(), name, build_model(name if name in own_models() else Path(name), fmi))


@firmware.command("new", epilog="Example: marconet firmware new blinker")
@click.argument("folder", type=click.Path(path_type=Path))
@verbosely
def new_firmware(folder: Path, verbose: bool) -> None:
    """Write a small firmware that runs, and a scenario.

    FOLDER gets both, and the firmware its name; the scenario has two robots with it. Prints the commands to go on with.
    """
    with errors_as_text(verbose):
        from experiments.show.text_views import print_path
        from firmware_sim.firmware.new_folder import write_new

        written = write_new(folder)
        for path in written:
            print_path(_console(), "written", path)
        scenario = written[-1]
        click.echo(f"run it:   marconet run {scenario}")
        click.echo(f"debug it: marconet run {scenario} --set 'agents.a.target=\"cortex_m4\"' --gdb a")


target = click.option("--target", type=click.Choice(["host", "cortex_m4"]), default="host", show_default=True,
                      help="This computer, or the emulated Cortex-M4.")


@firmware.command("build", epilog="Example: marconet firmware build synchronizing_robot --target cortex_m4 --out build")
@click.argument("folders", nargs=-1)
@target
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), metavar="DIR",
              help="Also copy what was built into this folder.")
@click.option("--header", is_flag=True, help="Print board_ids.h instead, for a build of your own.")
@verbosely
def build_firmware(folders: Sequence[str], target: Literal["host", "cortex_m4"], out: Path | None, header: bool,
                   verbose: bool) -> None:
    """Compile firmware and print where it is.

    It becomes a shared library for this computer, or an .elf file. What is compiled already is not compiled again.
    FOLDERS are folders with firmware.toml, or names of firmware that comes with marconet; default: all of these.
    """
    with errors_as_text(verbose):
        from experiments.show.text_views import print_path
        from firmware_sim.firmware.build import firmware_folder, own_firmware
        from firmware_sim.firmware.description import read_description
        from firmware_sim.firmware.ids_header import ids_header

        for name in folders or own_firmware():
            folder = firmware_folder(name, Path())
            if header:
                click.echo(ids_header(read_description(folder)), nl=False)
                continue
            built = _built_for(target, folder)
            if out is not None:
                out.mkdir(parents=True, exist_ok=True)
                built = Path(shutil.copyfile(built, out / built.name))
            print_path(_console(), name, built)


@firmware.command("info", epilog="Example: marconet firmware info synchronizing_robot --target cortex_m4")
@click.argument("firmware", metavar="FOLDER|FILE.elf")
@target
@verbosely
def firmware_info(firmware: str, target: Literal["host", "cortex_m4"], verbose: bool) -> None:
    """Show a firmware's size, functions and declarations.

    With the numbers in board_ids.h. For the Cortex-M4, and of an .elf file, also what the image takes of flash and
    RAM, stack, entry and sections.
    """
    with errors_as_text(verbose):
        from experiments.show.firmware_view import print_firmware, print_image
        from firmware_sim.cortex_m.elf_program import checked_image
        from firmware_sim.cortex_m.image import read_image
        from firmware_sim.firmware.build import firmware_folder
        from firmware_sim.firmware.description import read_description

        if firmware.endswith(".elf"):
            print_image(_console(), read_image(checked_image(Path(firmware))))
            return
        found = firmware_folder(firmware, Path())
        built = _built_for(target, found)
        print_firmware(_console(), read_description(found), found, built)
        if target == "cortex_m4":
            _console().print()
            print_image(_console(), read_image(built))


def _built_for(target: Literal["host", "cortex_m4"], folder: Path) -> Path:
    """Return the file that the firmware in `folder` is built into."""
    if target == "host":
        from firmware_sim.firmware.build import build_for_host

        return build_for_host(folder)
    from firmware_sim.cortex_m.firmware import build_for_cortex_m4

    return build_for_cortex_m4(folder)


def _refuse_unknown_plant(name: str) -> None:
    from experiments.scenario.files_there import near_file, plants_in
    from fmus.build import own_models
    from fmus.errors import PlantError

    if name not in own_models() and not Path(name).exists():
        raise PlantError(f"{name}: no such plant; {near_file(name, [*own_models(), *plants_in(Path())])}")


def _table(number: str, runs: int | None, figures: Path | None) -> bool:
    from experiments.scenario.counted import counted
    from experiments.show.live_view import counting_view
    from experiments.show.tables.chapters import figures_of, table_of
    from experiments.show.text_views import print_measured, print_path

    if figures is not None:
        if figures.is_dir():
            raise IsADirectoryError(f"--figures {figures}: is a folder: expected a page, as figures.html")
        figures.parent.mkdir(parents=True, exist_ok=True)
    console, found = _console(), table_of(number)
    runs = runs or found.runs
    with counting_view(console, f"table {number}", found.steps(runs)) as progress:
        values = list(found.measure(runs, progress))
    console.print(f"{found.title} ({counted(runs, 'run')})\n{found.judged_by}", soft_wrap=True)
    print_measured(console, values)
    if figures is not None:
        drawn = figures_of(number)
        with counting_view(console, "figures", drawn.steps) as progress:
            written = drawn.write(figures, progress)
        print_path(console, "figures", written)
    for value in values:
        if value.met is False:
            row = value.row
            click.echo(f"table {number}, {row.what}: {row.quantity}={value.ours:.4f} {row.unit}: expected "
                       f"{row.low or 0:.4g} to {row.high:.4g}", err=True)
    return all(value.met is not False for value in values)


def _process_is_its_own() -> bool:
    return bool(click.get_current_context().find_root().obj == ON_ITS_OWN)


def _console(for_people: bool = True) -> Console:
    from experiments.show.console import console_for

    return console_for(for_people)


def main() -> None:
    app(prog_name="marconet", obj=ON_ITS_OWN)


if __name__ == "__main__":
    main()
