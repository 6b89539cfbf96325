"""Every default of every impairment: as the page says, and with the behaviour of the value that the page says."""

from __future__ import annotations

import dataclasses
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from netem.core.random_streams import stream
from netem.core.transit import Transit
from netem.impairments.construct import PASSED_IN, construct_impairment
from netem.impairments.recordings import Recordings
from netem.impairments.table import IMPAIRMENTS

PAGE = (Path(__file__).parents[3] / "docs" / "models" / "impairments.md").read_text()
OPTIONAL = [(name, field) for name, kind in IMPAIRMENTS.items() for field in dataclasses.fields(kind)
            if field.init and field.name not in PASSED_IN
            and (field.default is not dataclasses.MISSING or field.default_factory is not dataclasses.MISSING)]
NOTHING = object()
TRACE, SAMPLES = "delay_ns,lost,late_ns\n5,0,7\n9,1,8\n", "delay_ns,late_ns\n5,700\n9,900\n"
TIMED = "time_ns,delay_ns\n3,1\n5,2\n9,3\n"
SOME_DELAY = {"distribution": "normal", "delay_ns": 9000, "jitter_ns": 4000}
A_RATE = {"rate_bps": 8_000_000}            # 10 bytes take 10 us; a frame comes every microsecond
FADES = {"mean_good_ns": 600_000, "mean_bad_ns": 500_000}

# (kind, field): other keys of the table, the value that acts as the default does, one that acts otherwise.
ACTS: dict[tuple[str, str], tuple[dict[str, Any], Any, Any]] = {
    ("corrupt", "bit_error_ratio"): ({"frame_ratio": 0.5}, None, NOTHING),
    ("corrupt", "frame_ratio"): ({"bit_error_ratio": 0.01}, None, NOTHING),
    ("delay", "delay_ns"): ({"distribution": "uniform", "jitter_ns": 50}, 0, 1),
    ("delay", "distribution"): ({"delay_ns": 50}, "constant", NOTHING),
    ("delay", "jitter_ns"): ({"delay_ns": 50}, 0, NOTHING),
    ("delay", "correlation"): (SOME_DELAY, 0.0, 0.5),
    ("delay", "samples_ns"): ({"distribution": "empirical", "quantiles_ns": [1, 9]}, [], NOTHING),
    ("delay", "quantiles_ns"): ({"distribution": "empirical", "samples_ns": [1, 9]}, [], NOTHING),
    ("delay", "file"): ({"distribution": "empirical", "samples_ns": [1, 9]}, "", NOTHING),
    ("delay", "keep_order"): (SOME_DELAY, False, True),
    ("delay", "columns"): ({"distribution": "empirical", "file": SAMPLES}, {}, {"delay_ns": "late_ns"}),
    ("duplicate", "extra_delay_ns"): ({"duplicate_ratio": 0.5}, 0, 1),
    ("duplicate", "correlation"): ({"duplicate_ratio": 0.5}, 0.0, 0.5),
    ("four_state_loss", "p31"): ({"p13": 0.3}, 0.7, 0.6),
    ("four_state_loss", "p32"): ({"p13": 0.3, "p31": 0.3, "p23": 0.5}, 0.0, 0.1),
    ("four_state_loss", "p23"): ({"p13": 0.3, "p31": 0.3, "p32": 0.4}, 1.0, 0.9),
    ("four_state_loss", "p14"): ({"p13": 0.3}, 0.0, 0.05),
    ("gemodel", "r"): ({"p": 0.3}, 0.7, 0.6),
    ("gemodel", "one_minus_h"): ({"p": 0.3, "r": 0.4}, 1.0, 0.9),
    ("gemodel", "one_minus_k"): ({"p": 0.3, "r": 0.4}, 0.0, 0.1),
    ("gilbert_elliott", "loss_while_bad"): ({"loss_ratio": 0.3, "mean_burst_frames": 3.0}, 1.0, 0.9),
    ("gilbert_elliott", "loss_while_good"): ({"loss_ratio": 0.3, "mean_burst_frames": 3.0}, 0.0, 0.1),
    ("gilbert_elliott_by_time", "loss_while_bad"): (FADES, 1.0, 0.9),
    ("gilbert_elliott_by_time", "loss_while_good"): (FADES, 0.0, 0.1),
    ("rate_limit", "overhead_bytes"): (A_RATE, 0, 1),
    ("rate_limit", "queue_frames"): (A_RATE, 1000, 999),
    ("rate_limit", "queue_bytes"): (A_RATE, 10_000, 9_999),     # as 1000 frames of 10 bytes
    ("rate_limit", "queue_ns"): (A_RATE, 10_000_000, 9_000),     # as 1000 frames of 10 us; 1 frame of 9 us
    ("reorder", "reorder_ratio"): ({"hold_ns": 5000, "gap_frames": 3}, 1.0, 0.99),
    ("reorder", "gap_frames"): ({"hold_ns": 5000, "reorder_ratio": 0.3}, 1, 2),
    ("reorder", "correlation"): ({"hold_ns": 5000, "reorder_ratio": 0.3}, 0.0, 0.5),
    ("scripted_corruption", "undetected"): ({"corrupt_frames": [3], "bits": [[1]]}, False, True),
    ("scripted_corruption", "copy"): ({"corrupt_frames": [3], "bits": [[1]]}, 0, 1),
    ("scripted_delay", "copy"): ({"delay_frames": [3], "delays_ns": [5]}, 0, 1),
    ("scripted_duplicate", "copy"): ({"duplicate_frames": [3], "extra_delays_ns": [5]}, 0, 1),
    ("scripted_loss", "every"): ({"lose_frames": [3]}, 10**6, 1000),
    ("scripted_loss", "copy"): ({"lose_frames": [3]}, 0, 1),
    ("trace", "by"): ({"file": TIMED}, "frame", "time"),
    ("trace", "at_end"): ({"file": TRACE}, "wrap", "hold"),
    ("trace", "columns"): ({"file": TRACE}, {}, {"delay_ns": "late_ns"}),
    ("trace", "start_ns"): ({"file": TIMED, "by": "time"}, 3, 4),
}


def documented(kind: str, name: str) -> str:
    """The meaning that the page gives for a key, its last column."""
    section = re.search(rf"^## {kind}$(.*?)^## ", PAGE, re.M | re.S)
    row = re.search(rf"^\| `{name.removesuffix('_ns')}(?:_ms)?` \|(.*)\|$", section[1], re.M)
    return row[1].rpartition(" | ")[2].strip()


def default_of(field: dataclasses.Field[Any]) -> Any:
    return field.default_factory() if field.default is dataclasses.MISSING else field.default


@pytest.fixture
def carried(tmp_path):
    """What comes out for 1200 frames of 10 bytes, one every microsecond, as (number, arrival, data, undetected)."""
    def through(kind: str, settings: dict[str, Any]) -> list[tuple[int, int, bytes, bool]]:
        if "\n" in settings.get("file", ""):
            (tmp_path / "recorded.csv").write_text(settings["file"])
            settings = settings | {"file": str(tmp_path / "recorded.csv")}
        impairment = construct_impairment(IMPAIRMENTS[kind], settings, stream(7, kind), Recordings())
        return [(copy.number, copy.arrival_ns, copy.data, copy.undetected) for n in range(1200)
                for copy in impairment.carry(Transit(n, 1000 * n, 1000 * n, b"0123456789"))]

    return through


@pytest.mark.parametrize(("kind", "field"), OPTIONAL, ids=lambda value: getattr(value, "name", value))
def test_the_page_says_the_default(kind, field):
    meaning, default = documented(kind, field.name), default_of(field)

    literal = re.search(r"default `([^`]*)`", meaning)
    if default is None:
        assert "default: " in meaning
        assert literal is None
    else:
        said = tomllib.loads(f"said = {literal[1]}")["said"]
        assert (said, type(said)) == (default, type(default))


def test_every_default_has_an_example_of_what_it_does():
    assert {(kind, field.name) for kind, field in OPTIONAL} == set(ACTS)


@pytest.mark.parametrize(("kind", "name"), ACTS)
def test_a_key_that_is_left_out_acts_as_its_default(kind, name, carried):
    settings, same, other = ACTS[kind, name]

    out = carried(kind, settings)

    assert out == carried(kind, settings | {name: same})
    if other is not NOTHING:
        assert out != carried(kind, settings | {name: other})


@pytest.mark.parametrize(("kind", "name"), [key for key, (_, _, other) in ACTS.items() if other is NOTHING])
def test_a_key_that_its_neighbours_rule_out_is_refused_beside_them(kind, name, carried):
    beside = {"bit_error_ratio": 0.1, "frame_ratio": 0.1, "distribution": "normal", "jitter_ns": 1, "samples_ns": [1],
              "quantiles_ns": [1, 2], "file": SAMPLES}

    with pytest.raises(ValueError, match=r"give|choose|needs"):
        carried(kind, ACTS[kind, name][0] | {name: beside[name]})
