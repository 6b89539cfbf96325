"""The `marconet` command. It only looks for input, calls the runner and prints; exit codes are in `exits`.

Heavy modules are imported inside the commands, so that help comes at once.
"""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from experiments.exits import ExitCode, errors_as_text

if TYPE_CHECKING:
    from rich.console import Console

    from experiments.inline_parent import Child
    from experiments.scenario import Scenario

app = typer.Typer(name="marconet", no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False,
                  help="Emulate a team of robots that hear each other only now and then.",
                  epilog="Example: marconet run output_sync")
fmu = typer.Typer(no_args_is_help=True, help="Look at plants and build them.",
                  epilog="Example: marconet fmu info linear_system")
app.add_typer(fmu, name="fmu")

ON_ITS_OWN = "this process is the command's own, so it may fork"

Source = Annotated[str, typer.Argument(metavar="SCENARIO", help="A name from `marconet list`, or the path of a .toml.")]
Seed = Annotated[int | None, typer.Option("--seed", help="Instead of the scenario's seed.")]
Duration = Annotated[float | None, typer.Option("--duration", metavar="S", help="Seconds of robot time.")]
Overrides = Annotated[list[str] | None, typer.Option(
    "--set", metavar="PATH.TO.KEY=VALUE", help="Replace one value of the file; the value is TOML. May be repeated.")]
Traceback = Annotated[bool, typer.Option("--traceback", help="Show where in the code an error came from.")]


@app.command("list", epilog="Example: marconet list")
def list_scenarios(traceback: Traceback = False) -> None:
    """Name the scenarios in ./scenarios and those that come with marconet, and the question each asks."""
    with errors_as_text(traceback):
        from experiments.scenario import catalog
        from experiments.text_views import print_table

        print_table(_console(), ["scenario", "question"], [(entry.name, entry.question) for entry in catalog()])


@app.command(epilog="Example: marconet check output_sync --set 'impairments[0].loss_ratio=0.3'")
def check(scenario: Source, seed: Seed = None, duration: Duration = None, overrides: Overrides = None,
          traceback: Traceback = False) -> None:
    """Find every mistake in a scenario without running it, or print what would run."""
    with errors_as_text(traceback):
        from experiments.text_views import print_scenario

        print_scenario(_console(), _load(scenario, seed, duration, overrides))


@app.command(epilog="Example: marconet run output_sync --seed 3 --set 'impairments[0].loss_ratio=0.3' --out runs/third")
def run(context: typer.Context, scenario: Source, seed: Seed = None, duration: Duration = None,
        host: Annotated[Literal["process", "inline"], typer.Option(
            "--host", help="One process for each robot, or all of them in this one: faster, and the same result.")]
        = "process",
        overrides: Overrides = None,
        out: Annotated[Path | None, typer.Option(
            "--out", metavar="DIR", help="Folder for the records; default: a new one in ./runs.")] = None,
        no_report: Annotated[bool, typer.Option("--no-report", help="Write the records without report.html.")] = False,
        real_time: Annotated[bool, typer.Option(
            "--real-time", help="At the wall clock's pace; a scenario with gateways to the outside needs it.")] = False,
        overwrite: Annotated[bool, typer.Option(
            "--overwrite", help="Replace the records of an earlier run in the folder.")] = False,
        traceback: Traceback = False) -> None:
    r"""Run a scenario and write its records and report.

    Exits with 0 if every \[expect] of the scenario holds, 1 if one does not, 2 for bad input, 3 when a node failed.
    """
    def command(child: Child | None = None) -> int:
        with errors_as_text(traceback):
            found = _load(scenario, seed, duration, overrides)
            folder = _run_folder(found, out)
            if child is not None:
                child.begins(folder, list(found.agents), found.node_timeout_s)
        with errors_as_text(traceback, kept=folder):
            holds = _run(found, host, folder, real_time, overwrite, report=not no_report,
                         running=None if child is None else child.running)
        return ExitCode.DONE if holds else ExitCode.EXPECTATION_BROKEN

    if host == "inline" and context.obj is ON_ITS_OWN:
        from experiments.inline_parent import run_in_child

        code = run_in_child(command)
    else:
        code = command()
    if code != ExitCode.DONE:
        raise typer.Exit(code)


@app.command(epilog="Example: marconet report runs/third")
def report(run_dir: Annotated[Path, typer.Argument(metavar="RUN_DIR", help="Folder of a run.")],
           traceback: Traceback = False) -> None:
    """Write report.html anew from the records of a run."""
    with errors_as_text(traceback):
        from experiments.completion import complete, is_unfinished
        from experiments.report.build import write_report
        from experiments.run_folder import owner
        from experiments.text_views import print_path

        if not (run_dir / "scenario.json").is_file():
            raise FileNotFoundError(f"{run_dir}: no run was recorded there: it has no scenario.json")
        if is_unfinished(run_dir) and not owner(run_dir):
            for problem in complete(run_dir):
                typer.echo(problem, err=True)
        print_path(_console(), "report", write_report(run_dir))


@app.command(epilog="Example: marconet table 3.1 --runs 20 --figures figures.html")
def table(number: Annotated[Literal["3.1", "3.2", "3.3", "3.4", "3.5"], typer.Argument(help="The table's number.")],
          runs: Annotated[int | None, typer.Option(
              "--runs", metavar="N", min=2, help="Monte Carlo runs of each cell, default 100, or rounds of timing, "
              "default 20. With few runs a cell may be missed by chance.")] = None,
          figures: Annotated[Path | None, typer.Option(
              "--figures", metavar="OUT.html", help="Also draw figures 3.5, 3.6 and 3.8, as a page that opens "
              "offline.")] = None,
          traceback: Traceback = False) -> None:
    """Compute a table of the dissertation again, printed beside ours.

    Exits with 0 if every cell is what it has to be, 1 if one is not.
    """
    with errors_as_text(traceback):
        met = _table(number, runs, figures)
    if not met:
        raise typer.Exit(ExitCode.EXPECTATION_BROKEN)


@app.command("compile", epilog="Example: marconet compile")
def compile_inner_loops(
        if_possible: Annotated[bool, typer.Option(
            "--if-possible", help="Say what is missing and go on without, as if all were well.")] = False,
        traceback: Traceback = False) -> None:
    """Compile the emulator's inner loops to C, once for these sources: twice as fast, with the same results."""
    with errors_as_text(traceback):
        from experiments.compiled.build import CannotCompile, compile_modules

        try:
            with _console().status("compiling, half a minute"):
                folder = compile_modules()
        except CannotCompile as error:
            if not if_possible:
                raise
            _console().print(f"not compiled, so at half the speed: {error}", markup=False, highlight=False)
        else:
            _console().print(f"compiled: {folder}", markup=False, highlight=False, soft_wrap=True)


@fmu.command("list", epilog="Example: marconet fmu list")
def list_plants(traceback: Traceback = False) -> None:
    """Name the plants that come with marconet."""
    with errors_as_text(traceback):
        from experiments.text_views import print_table
        from fmus.build import model_folder, own_models
        from fmus.describe import read_model

        models = [read_model(model_folder(name) / "variables.toml") for name in own_models()]
        print_table(_console(), ["plant", "about"], [(model.name, model.description) for model in models])


@fmu.command(epilog="Example: marconet fmu info linear_system")
def info(plant: Annotated[str, typer.Argument(help="A name from `marconet fmu list`, a model folder, or a .fmu file.")],
         traceback: Traceback = False) -> None:
    """Show a plant's variables with their units and start values, and its presets."""
    with errors_as_text(traceback):
        from experiments.text_views import print_plant, print_presets
        from fmus.build import build_model, model_folder, own_models
        from fmus.describe import read_model
        from fmus.describe_fmu import describe
        from fmus.presets import read_presets

        is_model = plant in own_models() or Path(plant).is_dir()
        archive = build_model(plant if plant in own_models() else Path(plant)) if is_model else Path(plant)
        print_plant(_console(), describe(archive))
        if is_model:
            folder = model_folder(plant if plant in own_models() else Path(plant))
            print_presets(_console(), read_presets(folder, read_model(folder / "variables.toml")))


@fmu.command(epilog="Example: marconet fmu build linear_system --fmi 2.0")
def build(plants: Annotated[list[str] | None, typer.Argument(help="Names or model folders; default: all that come "
                                                                  "with marconet.")] = None,
          fmi: Annotated[Literal["3.0", "2.0"], typer.Option("--fmi", help="Version of the standard.")] = "3.0",
          traceback: Traceback = False) -> None:
    """Compile plants into FMUs, where that has not been done, and say where they are."""
    with errors_as_text(traceback):
        from experiments.text_views import print_path
        from fmus.build import build_model, own_models

        for name in plants or own_models():
            print_path(_console(), name, build_model(name if name in own_models() else Path(name), fmi))


def _load(source: str, seed: int | None, duration_s: float | None, overrides: list[str] | None) -> Scenario:
    from experiments.scenario import find, load

    return load(find(source), seed=seed, duration_s=duration_s, overrides=overrides or [])


def _table(number: str, runs: int | None, figures: Path | None) -> bool:
    from experiments.live_view import counting_view
    from experiments.tables.chapter_3 import TABLES
    from experiments.text_views import print_measured, print_path

    if figures is not None:
        if figures.is_dir():
            raise IsADirectoryError(f"--figures {figures}: is a folder: expected a page, as figures.html")
        figures.parent.mkdir(parents=True, exist_ok=True)
    console, found = _console(), TABLES[number]
    runs = runs or found.runs
    with counting_view(console, f"table {number}", found.steps(runs)) as progress:
        values = list(found.measure(runs, progress))
    console.print(f"{found.title} ({runs} runs)\n{found.judged_by}", soft_wrap=True)
    print_measured(console, values)
    if figures is not None:
        from experiments.tables.figures import DRAWN_RUNS, write_figures

        with counting_view(console, "figures", DRAWN_RUNS) as progress:
            written = write_figures(figures, progress)
        print_path(console, "figures", written)
    for value in values:
        if value.met is False:
            row = value.row
            typer.echo(f"table {number}, {row.what}: {row.quantity}={value.ours:.4f} {row.unit}: expected "
                       f"{row.low or 0:.4g} to {row.high:.4g}", err=True)
    return all(value.met is not False for value in values)


def _run_folder(scenario: Scenario, out: Path | None) -> Path:
    """The folder of the run."""
    folder = out or Path("runs") / f"{scenario.name}-{datetime.now():%Y%m%d-%H%M%S-%f}"
    above = next((parent for parent in folder.parents if parent.exists()), None)
    if above is not None and not above.is_dir():
        raise NotADirectoryError(f"{'--out ' if out else ''}{folder}: {above} is a file: expected a folder of a run or "
                                 "a path where one can be made; name another")
    if folder.exists() and (not folder.is_dir() or (any(folder.iterdir()) and not (folder / "scenario.json").exists())):
        raise FileExistsError(f"--out {folder}: holds something else than a run; name a new folder")
    return folder


def _run(scenario: Scenario, host: Literal["process", "inline"], folder: Path, real_time: bool, overwrite: bool, *,
         report: bool, running: memoryview | None) -> bool:
    from experiments import runner
    from experiments.live_view import live_view
    from experiments.text_views import print_path, print_summary

    console = _console()
    with live_view(console, scenario.name, scenario.length_ns * 1e-9) as progress:
        result = runner.run(scenario, host=host, out=folder, progress=progress, real_time=real_time,
                            report=report, overwrite=overwrite, running=running)
    print_summary(console, result.summary)
    console.print()
    written = result.folder / (result.summary.report or ".")
    print_path(console, "report" if written.is_file() else "records", written if written.is_file() else result.folder)
    for verdict in result.summary.verdicts:
        if not verdict.holds:
            value = "" if verdict.value is None else f"={verdict.value}"
            typer.echo(f"expect.{verdict.key}{value}: {verdict.by_how_much()}", err=True)
    for standing in result.summary.guarantees:
        if not standing.as_expected:
            typer.echo(f"guarantees.{standing.name}: {standing.in_words()}", err=True)
    return result.summary.holds


def _console() -> Console:
    from rich.console import Console

    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = 120             # of a file or a pipe nobody knows
    return console


def main() -> None:
    app(obj=ON_ITS_OWN)
