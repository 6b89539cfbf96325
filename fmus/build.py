"""Builds a model folder into two archives with binary and sources: FMI 3.0 (`NAME.fmu`) and FMI 2.0 (`NAME.fmi2.fmu`).

One binary exports the functions of both standards. The archives are cached under a digest of all sources, the compiler
options and the platform, so nothing is built twice and concurrent builders do not disturb each other.

The compiler is $CC, else cc, gcc or clang, else `python -m ziglang cc` (PyPI: ziglang). `-ffp-contract=off` forbids
fused multiply-adds: whether a compiler emits them differs by compiler and processor, and they change the last bits of
a trajectory. `-g0` keeps zig from writing debugging tables, which hold the path of the folder that it compiled in.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Final

from fmus import describe
from fmus.cache import cache_folder, kept
from fmus.errors import PlantError
from fmus.platform_names import library_suffix, platform_fmi2, platform_fmi3

MODELS: Final = Path(__file__).parent
FMI: Final = MODELS / "fmi"
OPTIONS: Final = ("-std=c99", "-O2", "-g0", "-ffp-contract=off", "-fno-sanitize=undefined", "-fvisibility=hidden",
                  "-shared")
SIGNATURES: Final = {"model_step": "void model_step(Values *v, double h), which advances the model by h seconds",
                     "model_start": "void model_start(Values *v)", "model_outputs": "void model_outputs(Values *v)"}
_UNDEFINED: Final = re.compile(r"undefined (?:reference to|symbol:?) [`'\"]?(\w+)")
LAYOUT: Final = 2       # raised by one whenever a change of this file changes the archives
EPOCH: Final = (1980, 1, 1, 0, 0, 0)


def find_compiler() -> list[str]:
    """Return the command of a C compiler; raises PlantError, with the ways to install one, if there is none."""
    if named := os.environ.get("CC"):
        return shlex.split(named)
    for name in ("cc", "gcc", "clang"):
        if path := shutil.which(name):
            return [path]
    if importlib.util.find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc"]
    raise PlantError("no C compiler: neither $CC nor cc, gcc or clang on the PATH, nor the Python package ziglang: "
                     "install one of them, for example with `pip install marconet[compiler]`")


def model_folder(model: str | Path) -> Path:
    """Return the folder of a model in `fmus/` by its name, or of any model by its path; raises PlantError if absent."""
    folder = MODELS / model if isinstance(model, str) and "/" not in model and os.sep not in model else Path(model)
    if not (folder / "variables.toml").is_file():
        raise PlantError(f"{model}: no model there: a model is a folder with variables.toml and model.c; "
                         f"own models are {', '.join(own_models())}")
    return folder


def own_models() -> list[str]:
    return sorted(folder.parent.name for folder in MODELS.glob("*/variables.toml"))


def build_model(model: str | Path, fmi_version: str = "3.0", cache: Path | None = None) -> Path:
    """Return the path of the model's FMU for `fmi_version` "3.0" or "2.0"; builds it unless the cache holds it.

    Raises PlantError for a bad table, a missing compiler or code that does not compile."""
    if fmi_version not in ("2.0", "3.0"):
        raise PlantError(f"fmi_version={fmi_version!r}: expected '2.0' or '3.0'")
    folder = model_folder(model)
    spec = describe.read_model(folder / "variables.toml")
    sources = _sources(folder)
    token = describe.token_of(sources)
    key = hashlib.sha256("\0".join([token, *OPTIONS, platform_fmi3(), str(LAYOUT)]).encode()).hexdigest()[:16]
    home = kept((cache or cache_folder()) / "models" / f"{spec.name}-{key}",
                partial(_build, spec=spec, sources=sources, token=token))
    return home / f"{spec.name}{'.fmi2' if fmi_version == '2.0' else ''}.fmu"


def _sources(folder: Path) -> dict[str, bytes]:
    """Return the content of every file that the archives are built from, by its name in the archive."""
    files = [*sorted(folder.glob("*.[ch]")), folder / "variables.toml", *sorted(FMI.glob("*.[ch]"))]
    if not (folder / "model.c").is_file():
        raise PlantError(f"{folder / 'model.c'}: no such file: a model is a folder with variables.toml and model.c")
    sources = {file.name: file.read_bytes() for file in files}
    if readme := folder / "README.md" if (folder / "README.md").is_file() else None:
        sources["README.md"] = readme.read_bytes()
    return sources


def _build(draft: Path, spec: describe.Model, sources: dict[str, bytes], token: str) -> None:
    units = sorted(name for name in sources if name.endswith(".c"))
    code = {name: data for name, data in sources.items() if name.endswith((".c", ".h"))}
    code["variables.h"] = describe.header(spec, token).encode()
    binary = compile_library(code, f"the model {spec.name}", ["-Wl,-z,defs"] if sys.platform == "linux" else [])
    content = {f"sources/{name}": data for name, data in sorted(code.items())}
    if "README.md" in sources:
        content["documentation/README.md"] = sources["README.md"]
    library = f"{spec.name}{library_suffix()}"
    _write(draft / f"{spec.name}.fmu", {
        "modelDescription.xml": describe.description_fmi3(spec, token).encode(),
        f"binaries/{platform_fmi3()}/{library}": binary,
        "sources/buildDescription.xml": describe.build_description(spec, units).encode(),
        **content})
    _write(draft / f"{spec.name}.fmi2.fmu", {
        "modelDescription.xml": describe.description_fmi2(spec, token, units).encode(),
        f"binaries/{platform_fmi2()}/{library}": binary,
        **content})


def compile_library(code: dict[str, bytes], what: str, more_options: Sequence[str] = (),
                    signatures: Mapping[str, str] = SIGNATURES, main: str = "model.c") -> bytes:
    """Return the bytes of the shared library compiled from `code`, C files and headers by name.

    `what` names the library in the PlantError that is raised if there is no compiler or it fails, `signatures` has
    the functions that the author of `main` has to define."""
    compiler = find_compiler()
    with tempfile.TemporaryDirectory(prefix="marconet-") as name:
        folder = Path(name)
        for file, data in code.items():
            (folder / file).write_bytes(data)
        library = folder / f"library{library_suffix()}"
        command = [*compiler, *OPTIONS, *more_options, *([] if sys.platform == "win32" else ["-fPIC"]),
                   "-o", str(library), *sorted(file for file in code if file.endswith(".c")),
                   *([] if sys.platform == "win32" else ["-lm"])]
        try:
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True, errors="replace")
        except OSError as error:
            raise PlantError(f"{compiler[0]}: cannot run the C compiler ({error.strerror}): set CC to one that works, "
                             "or unset it") from None
        if missing := sorted(set(_UNDEFINED.findall(done.stderr))):
            raise PlantError(f"{what}: {main} defines no {', '.join(missing)}; add "
                             + "; ".join(signatures.get(name, name) for name in missing))
        if done.returncode:
            raise PlantError(f"{what} does not compile ({shlex.join(compiler)}, exit code {done.returncode}):\n"
                             f"{(done.stderr or done.stdout).strip()}")
        return library.read_bytes()


def _write(archive: Path, content: dict[str, bytes]) -> None:
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        for name, data in content.items():
            entry = zipfile.ZipInfo(name, EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            file.writestr(entry, data)
