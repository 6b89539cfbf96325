"""What a campaign and its workers say to each other: the scenario, points to run, figures that came of them."""

from __future__ import annotations

from hashlib import blake2b
from pathlib import Path
from typing import Any, Final, Literal

import msgspec

from experiments.judge.figures import Figures
from experiments.scenario.loader import load
from experiments.scenario.model import Scenario

Host = Literal["inline", "process"]
TRACED: Final = "traced.msgpack"        # a list of `netem.impairments.traced.Watched`


class Source(msgspec.Struct, frozen=True):
    """A scenario's file, and the changes that hold for all runs; `digest` is that of the file."""

    path: str
    digest: str
    length_s: float | None = None
    overrides: tuple[str, ...] = ()             # "path=value", as --set
    values: dict[str, Any] = {}                 # Python values by path

    @classmethod
    def of(cls, path: Path, length_s: float | None = None, overrides: tuple[str, ...] = (),
           values: dict[str, Any] | None = None) -> Source:
        return cls(str(path.absolute()), digest_of(path), length_s, overrides, values or {})

    def load(self, values: dict[str, Any], seed: int | None = None) -> Scenario:
        """Return the scenario with `values` set by path, and its own seed or this one.

        ScenarioError lists every problem.
        """
        return load(Path(self.path), seed=seed, duration_s=self.length_s, overrides=self.overrides,
                    values={**self.values, **values})


def digest_of(path: Path) -> str:
    return blake2b(path.read_bytes(), digest_size=16).hexdigest()


class Point(msgspec.Struct, frozen=True):
    """One run: `values` replace entries of the scenario, by path. With a `folder` it leaves its records there.

    With `traced` that folder gets the file TRACED besides, and no report: what impairments did to each copy.
    """

    number: int
    values: dict[str, Any]
    seed: int
    folder: str = ""
    traced: bool = False


class Begin(msgspec.Struct, tag=True, frozen=True):
    """To a worker, once: the scenario of all points."""

    source: Source
    host: Host


class Check(msgspec.Struct, tag=True, frozen=True):
    """To a worker: load the scenario with each of these values, and say what is wrong with it."""

    settings: list[dict[str, Any]]


class Batch(msgspec.Struct, tag=True, frozen=True):
    """To a worker: run these points, which differ in the seed only, one after the other."""

    points: list[Point]


class Ready(msgspec.Struct, tag=True, frozen=True):
    """From a worker: it has imported all that it needs."""


class Checked(msgspec.Struct, tag=True, frozen=True):
    """From a worker: the problems that it found, one line each."""

    problems: list[str]


class Done(msgspec.Struct, tag=True, frozen=True):
    """From a worker: the run of point `number` has ended."""

    number: int
    figures: Figures


class Refused(msgspec.Struct, tag=True, frozen=True):
    """From a worker: a point cannot be run at all, so that the campaign ends with these lines."""

    lines: list[str]


ToWorker = Begin | Check | Batch
FromWorker = Ready | Checked | Done | Refused

encode = msgspec.msgpack.Encoder().encode
decode_to_worker = msgspec.msgpack.Decoder(ToWorker).decode
decode_from_worker = msgspec.msgpack.Decoder(FromWorker).decode
