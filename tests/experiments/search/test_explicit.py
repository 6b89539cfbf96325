"""The explicit form of a run: all entries together do to every copy what was drawn, and nothing is drawn any more."""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments.judge.run_files import LEDGER
from experiments.run.runner import run
from experiments.scenario import load
from experiments.search.base import Base
from experiments.search.explicit import Explicit
from netem.impairments.traced import Trace
from netem.records.ledger_file import read_ledger

DRAWN = '''
[[impairments]]
on = "radio: * -> c"
kind = "duplicate"
duplicate_ratio = 0.3
extra_delay_ms = 2
[[impairments]]
on = "radio: * -> *"
kind = "gilbert_elliott"
loss_ratio = 0.2
mean_burst_frames = 2.0
[[impairments]]
on = "radio: * -> c"
kind = "rate_limit"
rate_bps = 20_000
[[impairments]]
on = "radio: a -> *"
kind = "corrupt"
bit_error_ratio = 0.03
during_s = [0.5, 3.5]
[[impairments]]
on = "radio: * -> *"
kind = "delay"
delay_ms = 1
jitter_ms = 3
distribution = "normal"
shared = true
[[impairments]]
on = "radio: b -> c"
kind = "delay"
delay_ms = 4
[[faults]]
kind = "undetected_corruption"
on = "radio: b -> c"
during_s = [1.0, 2.0]
ratio = 0.5
flipped_bits = 3
[[faults]]
kind = "kill"
on = "[bc]"
rate_per_s = 0.5
restart_after_s = 0.3
'''
WHAT_BECAME = ["medium", "sender", "receiver", "number", "copy", "end_ns", "delivered_ns", "fate"]


def rows(scenario: Path, out: Path, trace: Trace | None = None, **values: object) -> list[tuple[object, ...]]:
    run(load(scenario, values=values), host="inline", out=out, report=False, trace=trace)
    table = read_ledger(out / LEDGER, WHAT_BECAME)
    return sorted(zip(*(table[name].to_pylist() for name in WHAT_BECAME), strict=True))


@pytest.fixture
def drawn(watched: Path) -> Path:
    watched.write_text(watched.read_text() + DRAWN)
    return watched


def test_all_entries_together_do_to_every_copy_what_was_drawn(drawn: Path, tmp_path: Path) -> None:
    trace = Trace()
    expected = rows(drawn, tmp_path / "drawn", trace)
    base = Base.of(drawn)

    explicit = Explicit(base.scenario, base.tables, trace.watched)
    entries = explicit.entries(explicit.items)

    fates = {row[-1] for row in expected}
    assert {"lost", "corrupted", "delivered corrupt", "receiver gone", "delivered"} <= fates
    assert any(row[4] for row in expected)                  # duplicates
    assert rows(drawn, tmp_path / "explicit", **entries) == expected
    kinds = {table["kind"] for table in entries["impairments"]}
    assert kinds == {"scripted_duplicate", "scripted_loss", "scripted_corruption", "scripted_delay", "rate_limit",
                     "delay"}
    assert {table["kind"] for table in entries["faults"]} == {"kill"}
    # Another seed draws nothing else, as nothing is drawn any more: programs and radio of this scenario draw nothing.
    assert rows(drawn, tmp_path / "seed", **entries, seed=99) == expected


def test_the_entries_are_told_in_words(drawn: Path, tmp_path: Path) -> None:
    trace = Trace()
    rows(drawn, tmp_path / "drawn", trace)
    base = Base.of(drawn)

    explicit = Explicit(base.scenario, base.tables, trace.watched)
    told = list(explicit.in_words(explicit.items))

    for words in ("rate_limit on radio: * -> c", "is lost, at", "is late by", "flipped, undetected, at",
                  "arrives twice, 2 ms apart, at", "copy 1,", "kill of c at"):
        assert any(words in line for line in told), words
