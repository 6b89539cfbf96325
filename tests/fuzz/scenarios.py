"""Mutates scenarios and reads each as `marconet check` does: `python tests/fuzz/scenarios.py 10000 --seed 1`.

What is accepted is fine. What is refused has to come as a ScenarioError whose problems are one line each, begin with
the name of the file and hold neither a traceback nor an address in memory. Prints every mutant that breaks this.
"""

from __future__ import annotations

import argparse
import random
import re
import shutil
import sys
import tempfile
import time
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from experiments.scenario import ScenarioError, load

ROOT = Path(__file__).parents[2]
SLOW_S = 10.0
VALUES = ["-1", "0", "1", "0.5", "-0.5", "1e9", "1e300", "9223372036854775807", "99999999999999999999", "nan", "inf",
          "true", "false", '""', '"x"', '"../x"', '"a:b"', '"r1"', '"* -> *"', '"\\u0000"', '"\\U0001f916"', "[]",
          "[1]", "[[1.0, 2.0]]", '["r1"]', "{}", "{ a = 1 }", "{ kind = 1 }", "2026-11-29", "07:00:00",
          '"' + "y" * 300 + '"']
ADDRESS = re.compile(r"\b0x[0-9a-f]{8,}")
ASSIGNMENT = re.compile(r"^(\s*(?:[\w.\"*'-]+)\s*=\s*)(.+)$")
LEAF = re.compile(r"""(?<![\w."'-])(-?\d[\d_.eE+-]*|true|false|"[^"]*")(?![\w."'-])""")


class Mutant(NamedTuple):
    source: Path
    number: int
    text: str


class Broken(NamedTuple):
    mutant: Mutant
    why: str


def sources() -> list[Path]:
    """Our scenarios and those of tests/cases."""
    found = [*(ROOT / "scenarios").glob("*.toml"), *(ROOT / "tests/cases").rglob("*.toml")]
    return sorted(path for path in found if "length_s" in path.read_text(encoding="utf-8", errors="replace"))


def mutants(count: int, seed: int) -> Iterator[Mutant]:
    files = sources()
    texts = {path: path.read_text(encoding="utf-8") for path in files}
    rng = random.Random(seed)
    for number in range(count):
        source = rng.choice(files)
        text = texts[source]
        for _ in range(rng.choice((1, 1, 1, 2, 4))):
            text = rng.choice(MUTATIONS)(text, rng)
        yield Mutant(source, number, text)


def complaint(mutant: Mutant, folder: Path) -> str:
    """What is wrong with how the mutant is refused, "" if nothing. `folder` is where it is written."""
    file = folder / f"mutant_{mutant.source.stem}.toml"
    file.write_text(mutant.text, encoding="utf-8", errors="surrogateescape")
    began_cpu_s = time.process_time()
    try:
        load(file)
    except ScenarioError as error:
        lines = error.problems
        for line in lines:
            _, *shown = line.split("\n")
            if (shown and not _points_into_a_formula(shown)) or "Traceback" in line or ADDRESS.search(line):
                return f"not one plain line: {line!r}"
            if not line.startswith((file.name, str(file))):
                return f"does not name the file: {line!r}"
            if len(line) > 1500:
                return f"{len(line)} characters: {line[:200]!r}"
    except Exception:
        return traceback.format_exc()
    finally:
        file.unlink()
    cpu_s = time.process_time() - began_cpu_s
    return f"took {cpu_s:.1f} s of processor time" if cpu_s > SLOW_S else ""


def _points_into_a_formula(shown: list[str]) -> bool:
    """Return whether these lines, below the words of a refusal, are a formula and a caret under it."""
    return len(shown) == 2 and shown[1].strip() == "^" and len(shown[1]) <= len(shown[0]) + 1


def _lines(text: str, rng: random.Random) -> tuple[list[str], int]:
    lines = text.splitlines()
    return lines, rng.randrange(len(lines)) if lines else 0


def _delete_line(text: str, rng: random.Random) -> str:
    lines, at = _lines(text, rng)
    return "\n".join(lines[:at] + lines[at + 1:]) + "\n"


def _double_line(text: str, rng: random.Random) -> str:
    lines, at = _lines(text, rng)
    return "\n".join([*lines[:at + 1], *lines[at:]]) + "\n"


def _swap_lines(text: str, rng: random.Random) -> str:
    lines, one = _lines(text, rng)
    _, other = _lines(text, rng)
    if lines:
        lines[one], lines[other] = lines[other], lines[one]
    return "\n".join(lines) + "\n"


def _change_character(text: str, rng: random.Random) -> str:
    at = rng.randrange(len(text) + 1)
    return text[:at] + rng.choice('abz019_.,=[]{}"\'#\n\t \\\x00é-') + text[at + rng.randrange(2):]


def _replace_value(text: str, rng: random.Random) -> str:
    lines = text.splitlines()
    at = [index for index, line in enumerate(lines) if ASSIGNMENT.match(line)]
    if at:
        chosen = rng.choice(at)
        lines[chosen] = ASSIGNMENT.sub(lambda found: found[1] + rng.choice(VALUES), lines[chosen])
    return "\n".join(lines) + "\n"


def _replace_leaf(text: str, rng: random.Random) -> str:
    leaves = list(LEAF.finditer(text))
    if not leaves:
        return text
    leaf = rng.choice(leaves)
    return text[:leaf.start()] + rng.choice(VALUES) + text[leaf.end():]


def _misspell(text: str, rng: random.Random) -> str:
    words = list(re.finditer(r"[A-Za-z_]{3,}", text))
    if not words:
        return text
    word = rng.choice(words)
    at = rng.randrange(word.start(), word.end())
    return text[:at] + rng.choice("aeiou_x") + text[at + 1:]


MUTATIONS = [_delete_line, _double_line, _swap_lines, _change_character, _replace_value, _replace_value, _replace_leaf,
             _replace_leaf, _replace_leaf, _misspell, _misspell]


def broken(count: int, seed: int) -> Iterator[Broken]:
    """Mutants stand in copies of their folders, beside the programs and plants that they name."""
    with tempfile.TemporaryDirectory(prefix="marconet-fuzz-") as name:
        copies: dict[Path, Path] = {}
        for mutant in mutants(count, seed):
            folder = mutant.source.parent
            if folder not in copies:
                copies[folder] = Path(shutil.copytree(folder, Path(name) / str(len(copies)) / folder.name))
            if why := complaint(mutant, copies[folder]):
                yield Broken(mutant, why)


def what_changed(mutant: Mutant) -> str:
    """The lines of the mutant that its source does not have."""
    before = set(mutant.source.read_text(encoding="utf-8").splitlines())
    return "\n".join(line for line in mutant.text.splitlines() if line not in before)




def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", type=int)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    found = 0
    for one in broken(arguments.count, arguments.seed):
        found += 1
        print(f"--- {one.mutant.source.relative_to(ROOT)} mutant {one.mutant.number}\n{what_changed(one.mutant)}\n"
              f"{one.why}", flush=True)
    print(f"{arguments.count} mutants of {len(sources())} scenarios, seed {arguments.seed}: {found} refused badly")
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
