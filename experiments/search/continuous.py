"""Continuous settings of a search by CMA-ES (Hansen and Ostermeier 2001), as the library `cma` implements it.

Settings are shares in [0, 1) of the ranges of `--vary`. Costs enter by their rank, so that they may be infinite.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any, Final

from experiments.search.budget import BadBudget

GET_CMA: Final = "--vary in a search needs the library cma: pip install 'marconet[search]'"
START, STEP = 0.5, 0.3


class Continuous:
    """`size` settings are asked for and told at a time; the same seed gives the same ones."""

    def __init__(self, dimensions: int, size: int, seed: int) -> None:
        self.dimensions = dimensions
        self._asked: list[Any] = []
        if not dimensions:
            return
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")         # it looks for libraries that draw
                import cma
        except ImportError as error:
            raise BadBudget(GET_CMA) from error
        # CMA-ES has no step in one dimension alone: a second one, which nothing reads, takes part.
        self._strategy = cma.CMAEvolutionStrategy(
            [START] * max(2, dimensions), STEP,
            {"bounds": [0, 1], "seed": seed % 2**31 + 1, "popsize": size, "verbose": -9})

    def ask(self) -> list[tuple[float, ...]]:
        self._asked = self._strategy.ask()
        return [tuple(min(max(float(share), 0.0), 1.0 - 2**-53) for share in shares[:self.dimensions])
                for shares in self._asked]

    def tell(self, costs: Sequence[float]) -> None:
        """Take the costs of all that was asked for last."""
        ranks = {cost: rank for rank, cost in enumerate(sorted(set(costs)))}
        self._strategy.tell(self._asked, [float(ranks[cost]) for cost in costs])
