"""Names of `[expect]` for the fates of frame copies: one key per fate, and one for all that did not arrive.

    frames_offered = frames_delivered + frames_not_delivered
    frames_not_delivered = the sum of the keys of all other fates

Not arrived is what did not reach the node as it was handed out: `frames_delivered_corrupt` counts as not delivered.
A key says no more than the fate it counts. A key that did is refused with the two that it may have meant.
"""

from __future__ import annotations

from typing import Final

from netem.core.fate import Fate

NOT_DELIVERED: Final = "frames_not_delivered"
OWN_NAMES: Final = {
    Fate.LOST: "frames_lost_on_link",               # dropped by an impairment, not collided, too weak, ...
    Fate.CORRUPTED: "frames_caught_by_checksum",    # not those that reached the node with flipped bits
}
FATE_OF: Final = {OWN_NAMES.get(fate, f"frames_{fate.value.replace(' ', '_')}"): fate for fate in Fate}
FORMER: Final = {f"frames_{fate.value}": name for fate, name in OWN_NAMES.items()}
WORDS: Final = {fate.value: name.removeprefix("frames_").replace("_", " ") for fate, name in OWN_NAMES.items()}
ABOUT: Final = {"frames_lost": "counts only what an impairment dropped, one fate of many",
                "frames_corrupted": "counts only what a checksum caught, not what arrived with flipped bits"}


def in_words(fate: str) -> str:
    """A fate of the ledger, as a reader takes it for no more than it is: "lost on link", "deaf"."""
    return WORDS.get(fate, fate)


def complaint(metric: str) -> str:
    """Why a former name is refused, and what to write; empty for any other name."""
    if metric not in FORMER:
        return ""
    return f"{ABOUT[metric]}; write {FORMER[metric]} for that, or {NOT_DELIVERED} for all copies that did not arrive"
