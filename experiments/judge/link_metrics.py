"""Figures of links and senders from the ledger: age of information, successive losses, times between transmissions.

A link is (medium, sender, receiver). Its age of information at time t is t minus the instant at which the newest frame
delivered by t was offered (Kaul, Yates, Gruteser 2012): it grows at 1 s/s and drops at deliveries. Over [0, length):

    max  = the largest value just before a drop or the end
    mean = 1/length * sum over pieces [t_k, t_k+1) of (t_k+1 - t_k) * ((t_k + t_k+1)/2 - newest_k)

At t = 0 every receiver holds information of age 0, as if every robot knew the start values; so a link that never
delivers has age t. A frame delivered after a newer one, or corrupt, does not lower the age.
Links on which every copy was too weak are out of range and left out. The age of a link that exists only in some graphs
of a switching topology grows while the link does not exist.

Instants are int64 nanoseconds and their differences exact. Their products exceed 2^63 after 3 s, so the mean is summed
in float64: its relative error is at most the number of pieces times 2^-53.

Not modelled: the age of a link on which no frame was ever offered, as the ledger has no such link.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.judge.frame_copies import DELIVERED, Coded, FrameCopies, Ints, Mask, Portion, smallest
from experiments.judge.groups import largest_so_far, new_group
from netem.core.fate import Fate
from netem.core.link_name import LinkName

NS_PER_S = 1e9
SenderName = tuple[str, str]
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Teeth:
    """Pieces of the sawtooth of some links, sorted by (link, time): on [from_ns, to_ns) the age is t - newest_ns."""

    link: Ints                  # index into the names of `FrameCopies.link`
    from_ns: Ints
    to_ns: Ints
    newest_ns: Ints


@dataclass(frozen=True)
class LinkAges:
    """Largest and mean age of each link in range, in the order of names."""

    links: list[LinkName]
    max_s: Floats
    mean_s: Floats


@dataclass(frozen=True)
class Transmissions:
    """Frames that went on the air, each once, sorted by (sender, on_air_ns)."""

    source: Coded               # (medium, sender)
    on_air_ns: Ints


@dataclass(frozen=True)
class Gaps:
    """Time from the start of one transmission to `on_air_ns`, the start of the same sender's next on that medium."""

    source: Coded
    on_air_ns: Ints
    gap_s: Floats


def teeth(copies: FrameCopies, length_ns: int, links: Collection[tuple[str, ...]] | None = None) -> Iterator[Teeth]:
    """Yield the teeth of every link in range, or of those in `links`; all teeth of a link come in one portion."""
    delivered_ns, offered_ns = copies.ints("delivered_ns"), copies.ints("offered_ns")
    for portion in copies.by_link():
        first, end, _ = portion
        wanted = _in_range(copies, portion)
        if links is not None:
            wanted &= np.array([name in links for name in copies.link.names[first:end]], dtype=np.bool_)
        if wanted.any():
            heard = portion.rows[copies.fate[portion.rows].among(DELIVERED)]
            heard = heard[delivered_ns[heard] < length_ns]
            heard = heard[wanted[copies.link.codes[heard].astype(np.int64) - first]]
            yield _teeth(np.flatnonzero(wanted) + first, copies.link.codes[heard].astype(np.int64),
                         delivered_ns[heard], offered_ns[heard], length_ns)


def sawtooth(links: Sequence[tuple[str, ...]], copies: FrameCopies, length_ns: int) -> tuple[Ints, Ints, Ints, Ints]:
    """Return link (an index into `links`), from_ns, to_ns and newest_ns of each piece, sorted by link and time.

    A link on which nothing was ever delivered, or nothing was audible, has one piece with the age t.
    """
    place = {link: k for k, link in enumerate(links)}
    of_name = np.array([place.get(name, -1) for name in copies.link.names], dtype=np.int64)
    found = [(of_name[some.link], some.from_ns, some.to_ns, some.newest_ns)
             for some in teeth(copies, length_ns, place)]
    silent = np.setdiff1d(np.arange(len(links)), [link for some in found for link in np.unique(some[0])])
    found.append((silent, np.zeros_like(silent), np.full_like(silent, length_ns), np.zeros_like(silent)))
    link, from_ns, to_ns, newest_ns = (np.concatenate(columns) for columns in zip(*found, strict=True))
    order = np.argsort(link, kind="stable")
    return link[order], from_ns[order], to_ns[order], newest_ns[order]


def age_of_information(copies: FrameCopies, length_ns: int) -> LinkAges:
    links: list[LinkName] = []
    max_s, mean_s = [np.zeros(0)], [np.zeros(0)]
    for found in teeth(copies, length_ns):
        starts = np.flatnonzero(new_group(found.link))
        links += [copies.link.names[link] for link in found.link[starts].tolist()]
        oldest_ns = np.maximum.reduceat(found.to_ns - found.newest_ns, starts)
        lasts_ns = (found.to_ns - found.from_ns).astype(np.float64)
        middle_ns = ((found.from_ns - found.newest_ns) + lasts_ns / 2) * lasts_ns
        max_s.append(oldest_ns / NS_PER_S)
        with np.errstate(invalid="ignore"):     # a run of length 0 has no mean
            mean_ns = np.add.reduceat(middle_ns, starts) / length_ns
        mean_s.append(np.minimum(mean_ns, oldest_ns) / NS_PER_S)        # rounding may put the mean above the maximum
    return LinkAges(links, np.concatenate(max_s), np.concatenate(mean_s))


def age_quantiles(copies: FrameCopies, length_ns: int, links: Collection[tuple[str, ...]],
                  shares: Sequence[float]) -> Mapping[LinkName, Floats]:
    """For each of `links`, the ages in s that are not exceeded during the given shares of the time.

    The result is exact: as a function of the age, the time spent below it is linear between the ages at which pieces
    begin or end; its slope is the number of pieces that pass that age.
    """
    found = {}
    for some in teeth(copies, length_ns, links):
        starts = np.flatnonzero(new_group(some.link))
        for start, end in zip(starts.tolist(), [*starts[1:].tolist(), some.link.size], strict=True):
            newest_ns = some.newest_ns[start:end]
            edges = np.concatenate([some.from_ns[start:end] - newest_ns, some.to_ns[start:end] - newest_ns])
            order = np.argsort(edges, kind="stable")
            ages_ns = edges[order].astype(np.float64)
            holding = np.cumsum(np.where(order < newest_ns.size, 1, -1))
            below = np.concatenate([[0.0], np.cumsum(holding[:-1] * np.diff(ages_ns))])
            name = copies.link.names[int(some.link[start])]
            found[name] = np.interp(np.asarray(shares) * below[-1], below, ages_ns) / NS_PER_S
    return found


def successive_losses(copies: FrameCopies) -> dict[LinkName, int]:
    """For each link, the longest row of frames of which no copy was delivered; unfinished frames do not count."""
    longest: dict[LinkName, int] = {}
    numbers = copies.ints("number")
    for portion in copies.by_link():
        chosen = portion.rows[_in_range(copies, portion)[copies.link.codes[portion.rows].astype(np.int64)
                                                         - portion.first]]
        chosen = chosen[~copies.fate[chosen].among(Fate.UNFINISHED.value)]
        link, number = copies.link.codes[chosen].astype(np.int64), numbers[chosen]
        order = np.lexsort((number, link))
        link, heard = link[order], copies.fate[chosen[order]].among(DELIVERED)
        frames = np.flatnonzero(new_group(link, number[order]))
        if not frames.size:
            continue
        link, lost = link[frames], ~np.logical_or.reduceat(heard, frames)
        # a row of losses ends at a delivered frame and at the next link
        rows = np.flatnonzero(new_group(link, lost.astype(np.int64)))
        lengths = np.where(lost[rows], np.diff(np.r_[rows, link.size]), 0)
        starts = np.flatnonzero(new_group(link[rows]))
        longest |= {copies.link.names[of]: most for of, most in zip(
            link[rows][starts].tolist(), np.maximum.reduceat(lengths, starts).tolist(), strict=True)}
    return longest


def transmissions(copies: FrameCopies) -> Transmissions:
    on_air = copies.taken(copies.ints("on_air_ns") >= 0)
    source, number, on_air_ns = sources(on_air), on_air.ints("number"), on_air.ints("on_air_ns")
    order = np.lexsort((number, source.codes))
    order = order[new_group(source.codes[order], number[order])]
    order = order[np.lexsort((on_air_ns[order], source.codes[order]))]
    return Transmissions(source[order], on_air_ns[order])


def times_between_transmissions(copies: FrameCopies) -> Gaps:
    found = transmissions(copies)
    later = np.flatnonzero(~new_group(found.source.codes))
    gap_ns = found.on_air_ns[later] - found.on_air_ns[later - 1]
    return Gaps(found.source[later], found.on_air_ns[later], gap_ns / NS_PER_S)


def sources(copies: FrameCopies) -> Coded:
    """(medium, sender) of every copy."""
    names: list[SenderName] = sorted({name[:2] for name in copies.link.names})
    place = {name: code for code, name in enumerate(names)}
    of_link = smallest(np.array([place[name[:2]] for name in copies.link.names], dtype=np.int64), len(names))
    return Coded(of_link[copies.link.codes] if names else copies.link.codes, tuple(names))


def _in_range(copies: FrameCopies, portion: Portion) -> Mask:
    """Mask of the portion's links that have a copy that was not too weak."""
    link = copies.link.codes[portion.rows].astype(np.int64) - portion.first
    audible = ~copies.fate[portion.rows].among(Fate.TOO_WEAK.value)
    return np.bincount(link[audible], minlength=portion.end - portion.first) > 0


def _teeth(links: Ints, link: Ints, delivered_ns: Ints, offered_ns: Ints, length_ns: int) -> Teeth:
    """The teeth of all `links`. The other columns are of the copies delivered within the run, `link` being theirs."""
    zeros = np.zeros(links.size, dtype=np.int64)
    link = np.concatenate([links, link])
    from_ns, newest_ns = np.concatenate([zeros, delivered_ns]), np.concatenate([zeros, offered_ns])
    order = np.lexsort((newest_ns, from_ns, link))
    link, from_ns, newest_ns = link[order], from_ns[order], newest_ns[order]
    last = np.r_[link[1:] != link[:-1], True]
    to_ns = np.where(last, length_ns, np.r_[from_ns[1:], 0])
    return Teeth(link, from_ns, to_ns, largest_so_far(link, newest_ns))
