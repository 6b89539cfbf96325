"""Names of `[expect]` for the fates of frame copies: one key per fate, and one for all that did not arrive.

    frames_offered = frames_delivered + frames_not_delivered
    frames_not_delivered = the sum of the keys of all other fates

A copy counts as delivered if it reached the node unchanged, so `frames_delivered_corrupt` counts as not delivered. The
name of a key covers exactly the fate that it counts. Former keys with wider names are refused, with two remedies.
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
    """Return the text for a fate of the ledger that covers exactly that fate: "lost on link", "deaf"."""
    return WORDS.get(fate, fate)


def complaint(metric: str) -> str:
    """Return the reason and the remedy for a former name, "" for any other name."""
    if metric not in FORMER:
        return ""
    return f"{ABOUT[metric]}; write {FORMER[metric]} for that, or {NOT_DELIVERED} for all copies that did not arrive"
