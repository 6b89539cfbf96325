"""Loss with a probability for each of two states: what the models of Gilbert and Elliott share."""

from __future__ import annotations

from random import Random

from netem.impairments.checks import expect_ratio


def expect_losses(while_bad: float, while_good: float) -> None:
    """Raise ValueError unless both are probabilities and the bad state loses more than the good one."""
    expect_ratio("loss_while_bad", while_bad)
    expect_ratio("loss_while_good", while_good)
    if while_good >= while_bad:
        raise ValueError(f"loss_while_good={while_good}: expected less than loss_while_bad ({while_bad})")


def survives(loss: float, rng: Random) -> bool:
    """Return whether a copy survives a loss of this probability; 0 and 1 need no draw."""
    return loss == 0 or (loss < 1 and rng.random() >= loss)
