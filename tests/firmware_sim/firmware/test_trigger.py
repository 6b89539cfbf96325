"""The trigger in C decides, bit for bit, as the policy in Python; its texts have the digits of Python's."""

from __future__ import annotations

import ctypes as c
from collections.abc import Callable
from pathlib import Path
from random import Random
from types import SimpleNamespace

import pytest

from agents.tracking.controller import Inputs, State
from agents.tracking.firmware_companion import TrackingFirmware
from agents.tracking.team_policy import make_policy
from agents.tracking.tracking_settings import TrackingSettings
from firmware_sim.firmware.build import INCLUDE, firmware_folder
from firmware_sim.firmware.description import read_description
from firmware_sim.firmware.ids_header import ids_header
from fmus.build import compile_library

FOLDER = firmware_folder("tracking_robot", Path())
TEAM = {"robot": {"wheel_radius_m": 0.11, "track_m": 0.573, "counts_per_turn": 16384}}
FILES = ("trigger.c", "error_bound.c", "reachable_set.c", "controller.c")
HARNESS = r"""
#include "board_ids.h"
#include "marconet_text.h"
#include "trigger.h"

static const double *value;
static const uint32_t *first;
static Trigger trigger;
BOARD_EXPORT void begin(const double *values, const uint32_t *firsts);
BOARD_EXPORT int32_t decide(const double *measured, int64_t *decided, double *rates);
BOARD_EXPORT const char *written(double number, uint32_t digits);

int32_t board_parameter_length(uint32_t parameter) { return (int32_t)(first[parameter + 1] - first[parameter]); }

int32_t board_parameter(uint32_t parameter, uint32_t index, double *read)
{
    *read = value[first[parameter] + index];
    return BOARD_OK;
}

void begin(const double *values, const uint32_t *firsts)
{
    value = values;
    first = firsts;
    trigger_init(&trigger);
}

int32_t decide(const double *measured, int64_t *decided, double *rates)
{
    const TrackingError x = { measured[0], measured[1], measured[2] };
    const Velocities inputs = { measured[3], measured[4] };
    Decision decision = { 0, 0, 0, 0.0, 0.0 };
    const int32_t made = trigger_decide(&trigger, 0, x, inputs, &decision);
    decided[0] = decision.interval_ns;
    decided[1] = decision.valid_ns;
    rates[0] = decision.gain_per_s;
    rates[1] = decision.growth_per_s;
    return made;
}

const char *written(double number, uint32_t digits)
{
    static Text text;
    text_begin(&text);
    text_real(&text, number, digits);
    return text.letters;
}
"""
Decide = Callable[[State, Inputs], tuple[int, int, float, float] | None]


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> c.CDLL:
    code = {name: (FOLDER / name).read_bytes() for name in FILES}
    code |= {file.name: file.read_bytes() for folder in (FOLDER, INCLUDE) for file in folder.glob("*.h")}
    code |= {"board_ids.h": ids_header(read_description(FOLDER)).encode(), "harness.c": HARNESS.encode()}
    file = tmp_path_factory.mktemp("trigger") / "trigger.so"
    file.write_bytes(compile_library(code, "the trigger"))
    built = c.CDLL(str(file))
    built.written.restype, built.written.argtypes = c.c_char_p, (c.c_double, c.c_uint32)
    return built


def in_c(library: c.CDLL, settings: TrackingSettings) -> Decide:
    firmware = read_description(FOLDER)
    choices = firmware.parameters[0].choices
    configured = TrackingFirmware.configure(TEAM, "companion", SimpleNamespace(**vars(settings)))
    given = vars(settings) | {"policy": choices.index(settings.policy)} | configured
    rows = [flat(given[name]) for name in firmware.parameter_names]
    ends = [sum(len(row) for row in rows[:k]) for k in range(len(rows) + 1)]
    values = (c.c_double * ends[-1])(*(number for row in rows for number in row))
    firsts = (c.c_uint32 * len(ends))(*ends)
    library.begin(values, firsts)

    def decide(x: State, inputs: Inputs) -> tuple[int, int, float, float] | None:
        assert len(values) == firsts[-1]        # the library has the addresses of both
        decided, rates = (c.c_int64 * 2)(), (c.c_double * 2)()
        made = library.decide((c.c_double * 5)(*x, *inputs), decided, rates)
        return (decided[0], decided[1], rates[0], rates[1]) if made else None

    return decide


def flat(value: object) -> list[float]:
    if isinstance(value, list | tuple):
        return [number for entry in value for number in flat(entry)]
    assert isinstance(value, int | float)
    return [float(value)]


@pytest.mark.parametrize("settings", [TrackingSettings(), TrackingSettings("unified_gain", 2),
                                      TrackingSettings("periodic", 1, 3.0)], ids=lambda settings: settings.policy)
def test_it_decides_as_python_for_measurements_of_all_sizes(library: c.CDLL, settings: TrackingSettings) -> None:
    rng = Random(7)
    policy = make_policy(TEAM, settings.policy, settings.policy_settings())
    decide = in_c(library, settings)
    for _ in range(2000):
        x1, x2, x3 = (rng.choice((0.0, rng.uniform(-1, 1), rng.choice((-1, 1)) * 10 ** rng.uniform(-9, 5.9)))
                      for _ in range(3))
        inputs = Inputs(*rng.choice(((1.0, 1.0), (0.6 + 4e-7, 0.15), (2.0, 2.0 - 4e-6), (0.0, 0.0), (4.0, -1e3),
                                     (rng.uniform(-3, 3), rng.choice((0.0, 5e-5, rng.uniform(-3, 3)))))))
        made = policy.decide(0, (x1, x2, x3), inputs)

        assert decide((x1, x2, x3), inputs) == (made.interval_ns, made.valid_ns, made.gain_per_s, made.growth_per_s)


def test_it_refuses_what_is_no_measurement(library: c.CDLL) -> None:
    decide = in_c(library, TrackingSettings())

    assert decide((9e5, 0.0, 0.0), Inputs(1.0, 1.0)) is not None
    for wrong in (1e6, -2e6, float("inf"), float("nan")):
        assert decide((0.0, wrong, 0.0), Inputs(1.0, 1.0)) is None


def test_numbers_in_events_have_the_digits_of_python_s(library: c.CDLL) -> None:
    rng = Random(1)
    numbers = [0.0, 1e-5, 9.9999999e-5, 999999.5, 1e22, -1e300, float("inf"), float("-inf"), float("nan")]
    numbers += [rng.choice((rng.uniform(-10, 10), rng.randrange(10**8) * 1e-9, float(rng.randrange(1000)),
                            rng.randrange(10**7) / 2, 10 ** rng.uniform(-30, 30))) for _ in range(20_000)]
    for number in numbers:
        for digits in (6, 9):
            assert library.written(number, digits).decode() == f"{number:.{digits}g}"
