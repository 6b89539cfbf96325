"""Measures one step of a plant: set 4 inputs, step 1 ms, get 13 outputs of the model `rigid_body`.

    python -m benchmarks.fmu_step [--steps 20000]

Compares `fmus.plant.Plant` with FMPy's own wrapper on the same FMU, for both FMI versions, in turns in one process.
Times are CPU times of this thread, so other load on the machine counts only through shared caches; the median over the
turns is printed. `model alone` is the same work called from C, a lower bound for every binding.
"""

from __future__ import annotations

import argparse
import ctypes as c
import statistics
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import thread_time_ns
from typing import Any

from fmus.build import build_model, compile_library
from fmus.describe_fmu import describe
from fmus.description import PlantDescription
from fmus.plant import Plant

H_NS = 1_000_000
INPUTS = (9.81, 0.0, 0.0, 0.001)
TURN = 1000                 # consecutive steps before the next contender's turn
GOAL_US = 1.5

Contender = Callable[[int], None]      # takes that many steps


def ours(description: PlantDescription) -> Contender:
    plant = Plant(description, "ours")
    inputs = plant.input_group(description.names("input"))
    outputs = plant.output_group(description.names("output"))

    def run(steps: int) -> None:
        write, advance_to, read, now_ns = inputs.write, plant.advance_to, outputs.read, plant.now_ns
        for t_ns in range(now_ns + H_NS, now_ns + (steps + 1) * H_NS, H_NS):
            write(INPUTS)
            advance_to(t_ns)
            read()

    return run


def fmpy_convenience(description: PlantDescription) -> Contender:
    """FMPy with lists of inputs and outputs, as its documentation shows."""
    slave, set_values, get_values, inputs, outputs = _fmpy_slave(description)
    now = [0]

    def run(steps: int) -> None:
        for k in range(now[0], now[0] + steps):
            set_values(inputs, INPUTS)
            slave.doStep(currentCommunicationPoint=k * H_NS / 1e9, communicationStepSize=H_NS / 1e9)
            get_values(outputs)
        now[0] += steps

    return run


def fmpy_arrays(description: PlantDescription) -> Contender:
    """FMPy's lower level with arrays that the caller keeps, as in its example efficient_loops."""
    slave, _, _, inputs, outputs = _fmpy_slave(description)
    in_refs, out_refs = (c.c_uint * 4)(*inputs), (c.c_uint * 13)(*outputs)
    in_values, out_values = (c.c_double * 4)(), (c.c_double * 13)()
    flags, last = [c.c_bool() for _ in range(3)], c.c_double()
    now = [0]

    def run(steps: int) -> None:
        for k in range(now[0], now[0] + steps):
            in_values[:] = INPUTS
            if description.fmi == "3.0":
                slave.fmi3SetFloat64(slave.component, in_refs, 4, in_values, 4)
                slave.fmi3DoStep(slave.component, k * H_NS / 1e9, H_NS / 1e9, True, *flags, last)
                slave.fmi3GetFloat64(slave.component, out_refs, 13, out_values, 13)
            else:
                slave.fmi2SetReal(slave.component, in_refs, 4, in_values)
                slave.fmi2DoStep(slave.component, k * H_NS / 1e9, H_NS / 1e9, True)
                slave.fmi2GetReal(slave.component, out_refs, 13, out_values)
            out_values[:]
        now[0] += steps

    return run


def _fmpy_slave(description: PlantDescription) -> tuple[Any, Any, Any, list[int], list[int]]:
    import fmpy
    from fmpy.simulation import instantiate_fmu

    folder = Path(description.resources).parent
    slave: Any = instantiate_fmu(str(folder), fmpy.read_model_description(str(folder)))
    if description.fmi == "2.0":
        slave.setupExperiment()
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    suffix = "Float64" if description.fmi == "3.0" else "Real"
    references = {kind: [description.variables[name].reference for name in description.names(kind)]
                  for kind in ("input", "output")}
    return (slave, getattr(slave, f"set{suffix}"), getattr(slave, f"get{suffix}"), references["input"],
            references["output"])


DRIVER = """
#include <stdio.h>
#include <time.h>
#include "fmi2.h"
#include "variables.h"
int drive(long steps, double *us)
{
    fmi2CallbackFunctions functions = {0};
    fmi2Component self = fmi2Instantiate("c", 1, MODEL_TOKEN, "", &functions, 0, 0);
    unsigned in[4], out[13];
    double inputs[4] = {9.81, 0, 0, 0.001}, outputs[13], sum = 0;
    for (unsigned i = 0; i < 4; i++) in[i] = i;
    for (unsigned i = 0; i < 13; i++) out[i] = 4 + i;
    fmi2SetupExperiment(self, 0, 0, 0, 0, 0);
    fmi2EnterInitializationMode(self);
    fmi2ExitInitializationMode(self);
    clock_t begin = clock();
    for (long k = 0; k < steps; k++) {
        fmi2SetReal(self, in, 4, inputs);
        fmi2DoStep(self, k / 1e3, 1e-3, 1);
        fmi2GetReal(self, out, 13, outputs);
        sum += outputs[0];
    }
    *us = 1e6 * (double)(clock() - begin) / CLOCKS_PER_SEC / (double)steps;
    fmi2FreeInstance(self);
    return sum == sum;
}
"""


def model_alone_us() -> float:
    folder = Path(describe(build_model("rigid_body")).resources).parent / "sources"
    code = {file.name: file.read_bytes() for file in folder.glob("*.[ch]")}
    code["driver.c"] = b"__attribute__((visibility(\"default\"))) int drive(long, double *);" + DRIVER.encode()
    with tempfile.TemporaryDirectory() as name:
        library = Path(name) / "driver.so"
        library.write_bytes(compile_library(code, "the driver"))
        us = c.c_double()
        c.CDLL(str(library)).drive(c.c_long(200_000), c.byref(us))
    return us.value


def measure(contenders: dict[str, Contender], steps: int) -> dict[str, float]:
    """Median CPU time of one step [us] over the turns of each contender."""
    turns: dict[str, list[float]] = {name: [] for name in contenders}
    for _ in range(max(1, steps // TURN)):
        for name, run in contenders.items():
            begin = thread_time_ns()
            run(TURN)
            turns[name].append((thread_time_ns() - begin) / TURN / 1000)
    return {name: statistics.median(times) for name, times in turns.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description="Cost of one plant step: 4 inputs, 1 ms, 13 outputs.")
    parser.add_argument("--steps", type=int, default=20_000, help="steps per contender")
    arguments = parser.parse_args()
    descriptions = {version: describe(build_model("rigid_body", version)) for version in ("3.0", "2.0")}
    kinds = {"Plant (ours)": ours, "FMPy, arrays kept": fmpy_arrays, "FMPy, lists": fmpy_convenience}
    medians = measure({f"{kind} {version}": make(description) for kind, make in kinds.items()
                       for version, description in descriptions.items()}, arguments.steps)
    print("set 4 inputs + step + get 13 outputs   FMI 3.0   FMI 2.0   [us per step, CPU, median]")
    for kind in kinds:
        print(f"  {kind:<35} {medians[f'{kind} 3.0']:8.2f}  {medians[f'{kind} 2.0']:8.2f}")
    print(f"  {'the model alone, called from C':<35} {'':8}  {model_alone_us():8.2f}")
    print(f"  goal: at most {GOAL_US} us")


if __name__ == "__main__":
    main()
