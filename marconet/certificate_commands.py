"""The commands `marconet certificates new`, `show` and `check`: what they take and print."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from experiments.run.exits import ExitCode, errors_as_text

if TYPE_CHECKING:
    from experiments.show.console import Console
    from netem.gateways.certificate_table import Row

FOLDER = click.Path(path_type=Path)
verbosely = click.option("--verbose", "--traceback", "verbose", is_flag=True,
                         help="Show where in marconet's own code an error came from, too.")


@click.group(no_args_is_help=True,
             epilog="Example: marconet certificates new certificates r1 r2 operator --address 192.168.1.5")
def certificates() -> None:
    """Make, list and try the certificates of TLS doors.

    With them robots and operators take part in a run from outside.
    """


@certificates.command(epilog="Example: marconet certificates new certificates r1 r2 operator --address 192.168.1.5")
@click.argument("folder", metavar="FOLDER", type=FOLDER)
@click.argument("names", metavar="[NAME]...", nargs=-1)
@click.option("--address", "addresses", multiple=True, metavar="HOST",
              help="IP address or host name at which the emulator can be reached. May be repeated. Default: those of "
                   "the loopback.")
@click.option("--days", type=int, default=365, show_default=True, metavar="N", help="How long they are valid.")
@click.option("--overwrite", is_flag=True,
              help="Replace what is there of each NAME; of the emulator, with --address or without a NAME.")
@verbosely
def new(folder: Path, names: Sequence[str], addresses: Sequence[str], days: int, overwrite: bool,
        verbose: bool) -> None:
    """Make the certificates that FOLDER lacks.

    They are an authority, the emulator's certificate, and one for each NAME. A NAME is a robot, as its gateway is
    called, or an operator, who may open views and inject faults.
    """
    with errors_as_text(verbose):
        from netem.gateways.certificate_authority import make_certificates

        made = make_certificates(folder, names, addresses, days=days, overwrite=overwrite)
        for name in made.names:
            click.echo(f"{folder / name}.crt, {name}.key: {_for_whom(name, made.addresses)}")
        click.echo(f"valid until {made.until:%Y-%m-%d}; the run needs this folder, a client its own two files and "
                   "authority.crt")


def _for_whom(name: str, addresses: Sequence[str]) -> str:
    if name == "authority":
        return "the authority; move authority.key to a safe place, it is needed to add names only"
    return f"the emulator at {', '.join(addresses)}" if name == "emulator" else f"the client {name}"


@certificates.command(epilog="Example: marconet certificates show certificates")
@click.argument("folder", metavar="FOLDER", type=FOLDER)
@verbosely
def show(folder: Path, verbose: bool) -> None:
    """List certificates, and what is wrong with them.

    Exits with 0 if nothing is wrong, 2 if something is.
    """
    with errors_as_text(verbose):
        from experiments.show.console import print_table
        from netem.gateways.certificate_table import read_table

        table = read_table(folder)
        print_table(_console(), ["name", "kind", "addresses", "valid from", "until", "state", "of this authority",
                                 "key here"], [_cells(row) for row in table.rows])
        for problem in table.problems:
            click.echo(problem, err=True)
    if table.problems:
        raise SystemExit(ExitCode.BAD_INPUT)


def _cells(row: Row) -> Sequence[str]:
    return (row.name, row.kind, " ".join(row.addresses) or "-", f"{row.begins:%Y-%m-%d}", f"{row.ends:%Y-%m-%d}",
            row.state, {True: "yes", False: "no", None: "unknown"}[row.ours], "yes" if row.has_key else "no")


@certificates.command(epilog="Example: marconet certificates check tls://192.168.1.5:7447 --as r1 "
                             "--certificates certificates")
@click.argument("address", metavar="ADDRESS")
@click.option("--as", "name", required=True, metavar="NAME", help="Whose certificate is shown to the door.")
@click.option("--certificates", "folder", required=True, type=FOLDER, metavar="FOLDER",
              help="Where authority.crt, NAME.crt and NAME.key are.")
@verbosely
def check(address: str, name: str, folder: Path, verbose: bool) -> None:
    """Ask a running door whether it lets NAME in.

    If it does not, print why. ADDRESS is HOST:PORT, also as tls://HOST:PORT, a Zenoh endpoint tls/HOST:PORT, or the
    https address of a view.
    Exits with 0 if it does, with 2 if not.
    """
    with errors_as_text(verbose):
        from netem.gateways.door_client import Caller, ask_door

        click.echo(f"{address}: welcome {ask_door(address, Caller(folder, name))}")


def _console() -> Console:
    from experiments.show.console import console_for

    return console_for()
