"""The figures and the ledger hash of one run of a campaign, which leaves no folder."""

from __future__ import annotations

import msgspec


class Figures(msgspec.Struct, frozen=True):
    """The outcome of one run.

    `values` has a number for each key of `[expect]`, None if the run has no such figure; `broken` names the keys whose
    bounds the run does not keep, also those with a share, which it need not keep. `failure` is the reason why the run
    failed, "" if it did not. Of the processor time of the worker in seconds, `whole_s` is all that the run took,
    `emulation_s` that from the first grant to the finished ledger.
    """

    seed: int
    ledger_hash: str
    holds: bool
    values: dict[str, float | None]
    broken: list[str] = []
    failure: str = ""
    emulation_s: float = 0.0
    whole_s: float = 0.0
