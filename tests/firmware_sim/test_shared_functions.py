"""The elementary functions of robots in Python and in C: accurate, and equal to the last bit on host and chip."""

from __future__ import annotations

import json
import math
import struct
import sys
from collections.abc import Iterator
from pathlib import Path
from random import Random

import pytest

from experiments.run.runner import run
from experiments.scenario import load
from firmware_sim.shared_functions import arc_cosine, cosine, expm1, log1p, sine_cosine

ULP = sys.float_info.epsilon            # of 1: the library's functions are within it of the true value, and so are ours
FOLD = 0x100000001B3                    # FNV-1a

TABLE = """
name = "functions"
ports = [{ name = "radio" }]
parameters = [{ name = "values", type = "floats" }]
counters = [{ name = "sine" }, { name = "cosine" }, { name = "acute" }, { name = "arc" }, { name = "log" },
            { name = "exp" }, { name = "root" }, { name = "remainder" }]
"""
CODE = r"""
#include "board_ids.h"
#include "marconet_board.h"
#include "marconet_functions.h"

static uint64_t digest[COUNTERS_DECLARED];

static void fold(uint32_t counter, double value)
{
    digest[counter] = (digest[counter] ^ bits_of(value)) * 0x100000001B3u;
}

int32_t board_start(void) { return board_set_timer(0, 0, BOARD_SILENT); }

void board_timer(uint32_t timer)
{
    (void)timer;
    for (uint32_t k = 0; k < (uint32_t)board_parameter_length(PARAMETER_VALUES); k++) {
        double value = 0.0, s, c;
        board_parameter(PARAMETER_VALUES, k, &value);
        const double size = magnitude(value), share = size / (1.0 + size);
        sine_cosine(value, &s, &c);
        fold(COUNTER_SINE, s);
        fold(COUNTER_COSINE, c);
        fold(COUNTER_ACUTE, cosine(1.57 * share));
        fold(COUNTER_ARC, arc_cosine(2.0 * share - 1.0));
        fold(COUNTER_LOG, log_1p(size));
        fold(COUNTER_EXP, exp_m1(700.0 * share));
        fold(COUNTER_ROOT, square_root(size));
        fold(COUNTER_REMAINDER, remainder_of(value, 2.0 * MARCONET_PI));
    }
    for (uint32_t counter = 0; counter < COUNTERS_DECLARED; counter++) {
        board_count(counter, (uint32_t)(digest[counter] >> 33));
    }
}

void board_receive(uint32_t port, const uint8_t *data, uint32_t length)
{
    (void)port;
    (void)data;
    (void)length;
}
"""
SCENARIO = """
seed = 1
length_s = 0.01

[agents.a]
firmware = "functions"
target = "{target}"
parameters = {{ values = {values} }}

[media.radio]
kind = "broadcast_radio"
"""


def values(count: int) -> list[float]:
    """Return numbers of all sizes, and those beside which a function goes another way."""
    rng = Random(5)
    edges = [edge * sign * (1 + step * ULP) for edge in (math.pi / 4, math.pi / 2, math.pi, 1.0, 1e6, 0.41421356,
             math.log(2) / 2, 1.0, 2.0, 2**53, 1e300) for sign in (-1.0, 1.0) for step in (-1, 0, 1)]
    return edges + [rng.choice((-1.0, 1.0)) * 10 ** rng.uniform(-12, 12) for _ in range(count - len(edges))]


def results(value: float) -> Iterator[float]:
    size = abs(value)
    share = size / (1.0 + size)
    yield from sine_cosine(value)
    yield cosine(1.57 * share)
    yield arc_cosine(2.0 * share - 1.0)
    yield log1p(size)
    yield expm1(700.0 * share)
    yield math.sqrt(size)
    yield math.remainder(value, 2 * math.pi)


def digests(numbers: list[float]) -> list[int]:
    found = [0] * 8
    for number in numbers:
        for k, result in enumerate(results(number)):
            found[k] = (found[k] ^ int.from_bytes(struct.pack("<d", result), "little")) * FOLD % 2**64
    return [digest >> 33 for digest in found]


def counted(target: str, numbers: list[float], folder: Path) -> list[int]:
    (folder / "functions").mkdir()
    (folder / "functions" / "firmware.toml").write_text(TABLE)
    (folder / "functions" / "functions.c").write_text(CODE)
    scenario = folder / "scenario.toml"
    scenario.write_text(SCENARIO.format(target=target, values=numbers))
    result = run(load(scenario), host="inline", out=folder / "run", report=False)
    counters = json.loads((result.folder / "run.json").read_text())["counters"]["a"]
    return [counters[name] for name in ("sine", "cosine", "acute", "arc", "log", "exp", "root", "remainder")]


def test_angles_have_the_library_s_sines_and_cosines() -> None:
    rng = Random(1)
    angles = [rng.uniform(-5, 5) for _ in range(5000)] + [rng.uniform(-1e6, 1e6) for _ in range(5000)]

    assert max(abs(sine_cosine(angle)[0] - math.sin(angle)) for angle in angles) < 1.5 * ULP
    assert max(abs(sine_cosine(angle)[1] - math.cos(angle)) for angle in angles) < 1.5 * ULP
    assert max(abs(cosine(angle) - math.cos(angle)) for angle in map(abs, angles) if angle <= math.pi / 2) < 1.5 * ULP
    assert sine_cosine(0.0) == (0.0, 1.0)


def test_an_angle_beyond_a_million_is_taken_modulo_the_double_next_to_two_pi() -> None:
    for angle in (1e9, -3e12, 1e300):
        turned = math.remainder(angle, 2 * math.pi)

        assert sine_cosine(angle) == sine_cosine(turned)


def test_a_number_that_is_not_finite_has_no_sine() -> None:
    for angle in (math.inf, math.nan):
        with pytest.raises(ValueError):
            sine_cosine(angle)


def test_the_other_functions_are_the_library_s_to_the_last_digits() -> None:
    rng = Random(2)
    for _ in range(5000):
        value, size = rng.uniform(-1, 1), 10 ** rng.uniform(-12, 12)

        assert abs(arc_cosine(value) - math.acos(value)) < 3 * ULP * math.acos(value)
        assert abs(log1p(size) - math.log1p(size)) < 3 * ULP * math.log1p(size)
        assert abs(expm1(min(size, 700.0)) - math.expm1(min(size, 700.0))) < 3 * ULP * math.expm1(min(size, 700.0))
    assert (arc_cosine(1.0), arc_cosine(-1.0), log1p(0.0), expm1(0.0)) == (0.0, math.pi, 0.0, 0.0)


def test_c_on_the_host_gives_the_same_bits(tmp_path: Path) -> None:
    numbers = values(3000)

    assert counted("host", numbers, tmp_path) == digests(numbers)


def test_c_on_the_chip_gives_the_same_bits(tmp_path: Path) -> None:
    for needed in ("unicorn", "elftools", "ziglang"):
        pytest.importorskip(needed)
    numbers = values(200)

    assert counted("cortex_m4", numbers, tmp_path) == digests(numbers)
