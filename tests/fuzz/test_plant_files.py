"""Mutated FMU archives and model tables: whatever is wrong with them, it is told in lines that name the file.

A seed makes every case; `python -m tests.fuzz.test_plant_files ARCHIVES TABLES [SEED]` runs any number of them.
"""

from __future__ import annotations

import io
import sys
import zipfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

import pytest

from fmus.build import MODELS, build_model
from fmus.describe import header, read_model, variables_of
from fmus.describe_fmu import describe
from fmus.errors import PlantError
from fmus.plant import Plant
from tests.fmus.foreign_fmus import stair, steps, types_fmi3

WORDS = ["", "0", "-1", "1e400", "nan", "true", "parameter", "output", "structuralParameter", "../x", "\n", "é\x00",
         "a" * 5000, "99999999999999999999", "2.0", "3.0", "[]", "{", '"', "<", "exact", "Binary", "Float64", "tunable"]


def bent_bytes(data: bytes, rng: Random) -> bytes:
    """Some bytes changed, left out or put in."""
    found = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 8, 64))):
        at = rng.randrange(len(found) + 1)
        kind = rng.randrange(4)
        if kind == 0 and at < len(found):
            found[at] ^= 1 << rng.randrange(8)
        elif kind == 1:
            del found[at:at + rng.randint(1, 40)]
        elif kind == 2:
            found[at:at] = rng.randbytes(rng.randint(1, 20))
        else:
            found[at:at] = found[at // 2:at // 2 + rng.randint(1, 60)]
    return bytes(found)


def bent_text(text: str, rng: Random) -> str:
    """Words of the text changed, swapped or doubled; what remains is often well formed."""
    import re

    for _ in range(rng.choice((1, 1, 2, 3, 6))):
        spots = [match.span() for match in re.finditer(r"[\w.+-]+", text)]
        if not spots:
            return text
        begin, end = rng.choice(spots)
        other = rng.choice(spots)
        text = text[:begin] + rng.choice([rng.choice(WORDS), text[other[0]:other[1]], ""]) + text[end:]
    return text


def bent_archive(data: bytes, rng: Random) -> tuple[bytes, bool]:
    """An archive with something wrong, and whether its binary is as it was."""
    kind = rng.randrange(4)
    if kind == 0:
        return bent_bytes(data, rng), False
    with zipfile.ZipFile(io.BytesIO(data)) as source:
        files = {name: source.read(name) for name in source.namelist()}
    name = "modelDescription.xml"
    if kind == 1:
        files[name] = bent_bytes(files[name], rng)
    elif kind == 2:
        files[name] = bent_text(files[name].decode(), rng).encode(errors="replace")
    else:
        files = {(bent_text(each, rng) if rng.random() < 0.5 else each): content for each, content in files.items()}
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as target:
        for each, content in files.items():
            info = zipfile.ZipInfo("x")
            info.filename = each or "x"
            try:
                target.writestr(info, content)
            except UnicodeEncodeError:
                continue
    return out.getvalue(), True


def judge(path: Path, look: Callable[[], object], tally: Counter[str]) -> None:
    try:
        look()
    except PlantError as error:
        lines = str(error).split("\n")
        for line in lines:
            assert path.name in line, f"names no file: {line!r}"
            assert line.isprintable(), f"no line: {line!r}"
            assert len(line) < 12_000
        tally[str(error).rpartition(":")[2][:40]] += 1
    else:
        tally["accepted"] += 1


def mutated_archives(count: int, seed: int, folder: Path) -> Counter[str]:
    """Describe each; where the binary is one of ours, which judges what it is given, build and step the plant too."""
    sources = {"ours3": build_model("wheel_motor"), "ours2": build_model("wheel_motor", "2.0"),
               "types": types_fmi3(folder), "stair": stair(folder), "steps": steps(folder, 0.004)}
    tally: Counter[str] = Counter()
    rng = Random(f"{seed}/archives")
    for k in range(count):
        kind = rng.choice(sorted(sources))
        data, whole = bent_archive(sources[kind].read_bytes(), rng)
        path = folder / f"bent{k}.fmu"
        path.write_bytes(data)

        def look(path: Path = path, alive: bool = whole and kind.startswith("ours")) -> None:
            found = describe(path, folder / "cache")
            if alive and found.ours:
                with Plant(found, "p") as plant:
                    plant.advance_to(1_000_000)
                    for name in found.variables:
                        plant.get(name)

        judge(path, look, tally)
        path.unlink()
    return tally


def mutated_tables(count: int, seed: int, folder: Path) -> Counter[str]:
    sources = sorted(MODELS.glob("*/variables.toml"))
    tally: Counter[str] = Counter()
    rng = Random(f"{seed}/tables")
    path = folder / "variables.toml"
    for _ in range(count):
        text = rng.choice(sources).read_bytes()
        path.write_bytes(bent_bytes(text, rng) if rng.random() < 0.3 else
                         bent_text(text.decode(), rng).encode(errors="replace"))

        def look() -> None:
            model = read_model(path)
            variables_of(model)
            header(model, "{}")

        judge(path, look, tally)
    return tally


def test_some_mutated_archives_are_refused_in_words(tmp_path: Path) -> None:
    assert mutated_archives(40, 1, tmp_path).total() == 40


def test_some_mutated_tables_are_refused_in_words(tmp_path: Path) -> None:
    assert mutated_tables(200, 1, tmp_path).total() == 200


@pytest.mark.slow
def test_a_thousand_mutated_archives_are_refused_in_words(tmp_path: Path) -> None:
    assert mutated_archives(1000, 2, tmp_path).total() == 1000


@pytest.mark.slow
def test_a_thousand_mutated_tables_are_refused_in_words(tmp_path: Path) -> None:
    assert mutated_tables(1000, 2, tmp_path).total() == 1000


if __name__ == "__main__":
    archives, tables, seed = (int(argument) for argument in (*sys.argv[1:], "0")[:3])
    with TemporaryDirectory() as name:
        for tally in (mutated_archives(archives, seed, Path(name)), mutated_tables(tables, seed, Path(name))):
            print(tally.total(), *tally.most_common(12), sep="\n    ")
