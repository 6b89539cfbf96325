"""Completions that the shell offers after a Tab: scenario names and plants; click completes commands and options.

The script that a shell loads is click's; it calls `marconet` with `_MARCONET_COMPLETE` in its environment.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import click
from click.shell_completion import CompletionItem, get_completion_class

VARIABLE: Final = "_MARCONET_COMPLETE"
PLACES: Final = {                   # where each shell looks for the completions of a user, below the home folder
    "bash": ".local/share/bash-completion/completions/marconet",
    "zsh": ".zfunc/_marconet",
    "fish": ".config/fish/completions/marconet.fish",
}
THEN: Final = {
    "bash": "open a new shell; it needs the package bash-completion",
    "zsh": "add `fpath+=~/.zfunc; autoload -Uz compinit && compinit` to ~/.zshrc, then open a new shell",
    "fish": "open a new shell",
}


def complete_scenario(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete to names from `marconet list` and scenario files of this folder; if none fits, to paths."""
    from experiments.scenario.library import catalog

    files = sorted(str(file) for file in Path().glob("*.toml"))
    return _begun([*(CompletionItem(entry.name, help=entry.question) for entry in catalog()),
                   *map(CompletionItem, files)], incomplete)


def complete_plant(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Complete to names from `marconet fmu list` and plants in this folder; if none fits, to paths."""
    from fmus.build import own_models

    models = [file.parent for file in Path().glob("*/variables.toml")]
    files = sorted(str(path) for path in (*models, *Path().glob("*.fmu")))
    return _begun(list(map(CompletionItem, [*own_models(), *files])), incomplete)


def _begun(items: list[CompletionItem], incomplete: str) -> list[CompletionItem]:
    """Return the items that begin with `incomplete`, or else a request for paths.

    Names and paths are never mixed: click's script for bash drops all names if it meets a request for paths.
    """
    return ([item for item in items if item.value.startswith(incomplete)]
            or [CompletionItem(incomplete, type="file")])


def script(command: click.Command, shell: str) -> str:
    """Return the script that `shell` has to load."""
    found = get_completion_class(shell)
    assert found is not None, shell
    return found(command, {}, "marconet", VARIABLE).source()


def install(command: click.Command, shell: str) -> str:
    """Write the script below the home folder; returns its path and the step that the user has to do."""
    file = Path.home() / PLACES[shell]
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(script(command, shell), encoding="utf-8")
    return f"completion: {file}\n{THEN[shell]}"
