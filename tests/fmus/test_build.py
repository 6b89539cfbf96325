"""The builder: what it makes is valid, whole, repeatable, and made once; and every way to find a compiler."""

from __future__ import annotations

import re
import subprocess
import sys
import zipfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from ctypes import CDLL
from pathlib import Path

import pytest

from fmus import build
from fmus.build import build_model, compile_library, find_compiler, own_models
from fmus.describe_fmu import describe
from fmus.plant import Plant, PlantError
from fmus.platform_names import platform_fmi2, platform_fmi3

TOML = """model = "twice"
description = "y = 2 u"
functions = ["outputs"]
variable = [
  { name = "u", kind = "input",  unit = "1", start = 0.0, about = "number" },
  { name = "y", kind = "output", unit = "1",              about = "twice the number" },
]
"""
C = """#include "variables.h"
void model_step(Values *v, double h) { (void)v, (void)h; }
void model_outputs(Values *v) { v->y = 2 * v->u; }
"""


@pytest.fixture
def twice(tmp_path: Path) -> Path:
    folder = tmp_path / "twice"
    folder.mkdir()
    (folder / "variables.toml").write_text(TOML)
    (folder / "model.c").write_text(C)
    return folder


@pytest.mark.parametrize("model", own_models())
def test_fmpys_validation_finds_nothing(model: str, version: str, own_fmu: Callable[..., Path]) -> None:
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(own_fmu(model, version))) == []


def test_the_binary_exports_every_function_of_both_standards(own_fmu: Callable[..., Path], tmp_path: Path) -> None:
    """The lists come from the standards' own headers, which FMPy carries."""
    import fmpy

    headers = Path(fmpy.__file__).parent / "c-code"
    wanted = {name for version in (2, 3)
              for name in re.findall(rf"(?m)^#define (fmi{version}[A-Z]\w+) +fmi{version}FullName",
                                     (headers / f"fmi{version}Functions.h").read_text())}
    model_exchange_fmi2 = {
        "fmi2EnterEventMode", "fmi2NewDiscreteStates", "fmi2EnterContinuousTimeMode", "fmi2CompletedIntegratorStep",
        "fmi2SetTime", "fmi2SetContinuousStates", "fmi2GetDerivatives", "fmi2GetEventIndicators",
        "fmi2GetContinuousStates", "fmi2GetNominalsOfContinuousStates"}
    binary = f"binaries/{platform_fmi3()}/wheel_motor.so"
    with zipfile.ZipFile(own_fmu("wheel_motor")) as archive:
        library = CDLL(archive.extract(binary, tmp_path))

    assert len(wanted) > 100
    assert {name for name in wanted if not hasattr(library, name)} == model_exchange_fmi2


def test_a_new_model_is_two_files(twice: Path, cache: Path) -> None:
    with Plant(describe(build_model(twice, cache=cache), cache), "t") as plant:
        plant.set("u", 21.0)

        assert plant.get("y") == 42.0


def test_nothing_is_built_twice(twice: Path, cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = build_model(twice, cache=cache)
    monkeypatch.setattr(build, "compile_library", None)     # a second build would fail

    assert build_model(twice, cache=cache) == first


def test_every_change_of_a_source_builds_anew(twice: Path, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    paths = {build_model(twice, cache=cache)}
    (twice / "model.c").write_text(C + "/* changed */\n")
    paths.add(build_model(twice, cache=cache))
    (twice / "variables.toml").write_text(TOML.replace("twice the number", "double"))
    paths.add(build_model(twice, cache=cache))

    tokens = {describe(path, cache).token for path in paths}

    assert len(paths) == len(tokens) == 3


def test_two_builds_give_the_same_archives(twice: Path, tmp_path: Path) -> None:
    for version in ("2.0", "3.0"):
        first, second = (build_model(twice, version, tmp_path / name).read_bytes() for name in "ab")

        assert first == second


@pytest.mark.slow
def test_concurrent_builders_take_one_result(twice: Path, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    with ThreadPoolExecutor(4) as pool:
        paths = set(pool.map(lambda _: build_model(twice, cache=cache), range(4)))

    assert len(paths) == 1
    assert zipfile.ZipFile(paths.pop()).testzip() is None
    assert [folder.name for folder in (cache / "models").iterdir() if folder.name.startswith(".")] == []


def test_the_sources_in_the_archive_build_the_same_model(twice: Path, tmp_path: Path, version: str) -> None:
    path = build_model(twice, version, tmp_path)
    with zipfile.ZipFile(path) as archive:
        names = [name for name in archive.namelist() if name.startswith("sources/") and name[-2:] in (".c", ".h")]
        code = {Path(name).name: archive.read(name) for name in names}
        platform = platform_fmi2() if version == "2.0" else platform_fmi3()
        binary = archive.read(f"binaries/{platform}/twice.so")

    assert compile_library(code, "the sources") == binary


@pytest.mark.slow
def test_our_c_compiles_without_a_warning(own_fmu: Callable[..., Path], tmp_path: Path) -> None:
    for model in own_models():
        with zipfile.ZipFile(own_fmu(model)) as archive:
            archive.extractall(tmp_path / model)
        sources = sorted((tmp_path / model / "sources").glob("*.c"))
        flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Wstrict-prototypes", "-Werror"]

        done = subprocess.run([*find_compiler(), *flags, "-c", *map(str, sources)], cwd=tmp_path / model,
                              capture_output=True, text=True)

        assert done.stderr == ""


def test_a_compile_error_shows_what_the_compiler_says(twice: Path, cache: Path) -> None:
    (twice / "model.c").write_text(C.replace("v->u", "v->nothing"))

    with pytest.raises(PlantError, match=r"the model twice does not compile [\s\S]*nothing"):
        build_model(twice, cache=cache)


def test_a_table_with_mistakes_names_all_of_them(twice: Path, cache: Path) -> None:
    (twice / "variables.toml").write_text(TOML.replace('"input",  unit = "1"', '"in", unit = "furlong"'))

    with pytest.raises(PlantError) as caught:
        build_model(twice, cache=cache)

    assert [line.partition("variables.toml: ")[2] for line in str(caught.value).splitlines()] == [
        "variable[0].kind='in': expected one of input, output, parameter",
        "variable[0].unit='furlong': 'furlong' is no unit; there are kg, m, s, A, K, mol, cd, rad, Hz, N, Pa, J, W, C, "
        "V, Ohm, F, H, Wb, T, 1"]


def test_an_unknown_model_names_the_known_ones(cache: Path) -> None:
    known = r"wheel: no model there: .* linear_system, omnidirectional, quadrotor, .*wheel_motor"
    with pytest.raises(PlantError, match=known):
        build_model("wheel", cache=cache)


def test_cc_comes_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "mycc -m64")

    assert find_compiler() == ["mycc", "-m64"]


def test_a_cc_that_does_not_exist_is_named(twice: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", str(tmp_path / "nocc"))

    with pytest.raises(PlantError, match=r"nocc: cannot run the C compiler \(No such file or directory\): set CC"):
        build_model(twice, cache=tmp_path)


def test_without_a_compiler_ziglang_serves(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("ziglang", reason="needs ziglang: pip install -e '.[compiler]'")
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", "")

    assert find_compiler() == [sys.executable, "-m", "ziglang", "cc"]


def test_without_any_compiler_the_remedy_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)

    with pytest.raises(PlantError, match=r"no C compiler: .*pip install marconet\[compiler\]"):
        find_compiler()


def test_a_cache_that_cannot_be_written_names_the_remedy(twice: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")

    with pytest.raises(PlantError, match=r"cannot write to the cache .* set MARCONET_CACHE"):
        build_model(twice, cache=tmp_path / "file")


@pytest.mark.slow
@pytest.mark.parametrize("model", own_models())
def test_zig_builds_the_same_trajectory(model: str, own_fmu: Callable[..., Path], tmp_path: Path,
                                        monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("ziglang", reason="needs ziglang: pip install -e '.[compiler]'")
    first = describe(own_fmu(model), tmp_path)
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", "")
    second = describe(build_model(model, cache=tmp_path), tmp_path)
    start = {name: 0.1 * (place % 7) - 0.3 for place, name in enumerate(first.variables)
             if model == "linear_system" and first.variables[name].causality == "parameter"}
    in_both_times = [start | {"dt": dt_s, "noise_seed": 7.0} for dt_s in (0.0, 0.005)] if start else [start]

    def run(description: object, start: dict[str, float]) -> list[tuple[float, ...]]:
        with Plant(description, "p", start) as plant:       # type: ignore[arg-type]
            inputs, outputs = (plant.input_group(first.names("input")), plant.output_group(first.names("output")))
            rows = []
            for k in range(1, 300):
                inputs.write([0.01 * ((k * place) % 5) for place in range(len(inputs.names))])
                plant.advance_to(k * 1_700_000)
                rows.append(outputs.read())
            return rows

    assert first.binary != second.binary
    for values in in_both_times:
        assert run(first, values) == run(second, values)
