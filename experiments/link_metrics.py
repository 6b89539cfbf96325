"""What the ledger says about links and senders: age of information, losses in a row, times between transmissions.

A link is (medium, sender, receiver). Its age of information at time t is t minus the instant at which the newest frame
delivered by t was handed out (Kaul, Yates, Gruteser 2012): it grows at 1 s/s and drops at deliveries. Over [0, length):

    max  = the largest value just before a drop or the end
    mean = 1/length * sum over pieces [t_k, t_k+1) of (t_k+1 - t_k) * ((t_k + t_k+1)/2 - newest_k)      exact

At t = 0 every receiver holds information of age 0, as when every robot is told the start values; so a link that never
delivers has age t. A frame delivered after a newer one does not lower the age; corrupt frames inform nobody.
Links of which every copy was too weak are out of range and left out. A link that exists only in some topologies ages
while it does not exist.

Not modelled: age of a link over which nothing was ever sent: the ledger does not know it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import polars as pl
from numpy.typing import NDArray

LINK = ["medium", "sender", "receiver"]
SENDER = ["medium", "sender"]
DELIVERED = "delivered"
NS_PER_S = 1e9
NAMES_BITS = 20

LinkName = tuple[str, str, str]


def age_steps(ledger: pl.DataFrame, length_ns: int) -> pl.DataFrame:
    """Pieces of every link's sawtooth in order: on [from_ns, to_ns) the age is t - newest_ns.

    `link` numbers the links; their names stand beside it."""
    ledger = _in_range(_numbered(ledger, LINK, "link"))
    zero = pl.lit(0, pl.Int64)
    starts = ledger.group_by("link").agg(pl.col(LINK).first(), from_ns=zero, newest_ns=zero)
    heard = ledger.filter((pl.col("fate") == DELIVERED) & (pl.col("delivered_ns") < length_ns)).select(
        "link", *LINK, from_ns="delivered_ns", newest_ns="offered_ns")
    arrival, newest = (pl.col(name).sort_by("from_ns", "newest_ns") for name in ("from_ns", "newest_ns"))
    pieces = pl.concat([starts, heard]).group_by("link", maintain_order=True).agg(
        pl.col(LINK).first(), arrival, newest.cum_max(),
        to_ns=arrival.shift(-1).fill_null(length_ns))
    return pieces.explode("from_ns", "newest_ns", "to_ns")


def age_of_information(ledger: pl.DataFrame, length_ns: int) -> pl.DataFrame:
    """Per link, in the order of names: max_s and mean_s."""
    age_from, age_to = pl.col("from_ns") - pl.col("newest_ns"), pl.col("to_ns") - pl.col("newest_ns")
    lasts = pl.col("to_ns") - pl.col("from_ns")
    return age_steps(ledger, length_ns).group_by("link").agg(
        pl.col(LINK).first().cast(pl.String), max_s=age_to.max() / NS_PER_S,
        mean_s=(lasts * (age_from + age_to) / 2 / lasts.sum()).sum() / NS_PER_S).drop("link").sort(LINK)


def age_quantiles(steps: pl.DataFrame, shares: Sequence[float]) -> Mapping[LinkName, NDArray[np.float64]]:
    """Per link the ages [s] that are not exceeded during the given shares of the time; exact, since the time spent
    below an age grows, between the ends of pieces, at the number of pieces that hold the age."""
    found = {}
    for own in steps.partition_by("link", maintain_order=True):
        start, end, newest = (own[name].to_numpy() for name in ("from_ns", "to_ns", "newest_ns"))
        edges = np.concatenate([start - newest, end - newest])
        order = np.argsort(edges, kind="stable")
        edges = edges[order].astype(np.float64)
        holding = np.cumsum(np.where(order < start.size, 1, -1))
        below = np.concatenate([[0.0], np.cumsum(holding[:-1] * np.diff(edges))])
        names = own.select(pl.col(LINK).first().cast(pl.String)).row(0)
        found[names] = np.interp(np.asarray(shares) * below[-1], below, edges) / NS_PER_S
    return found


def successive_losses(ledger: pl.DataFrame) -> pl.DataFrame:
    """Per link: the longest row of frames of which no copy was delivered; frames under way at the end do not count."""
    ended = _in_range(_numbered(ledger, LINK, "link")).filter(pl.col("fate") != "unfinished")
    names = ended.group_by("link").agg(pl.col(LINK).first().cast(pl.String))
    frames = ended.group_by("link", "number").agg(lost=(pl.col("fate") != DELIVERED).all())
    in_order = frames.group_by("link").agg(pl.col("lost").sort_by("number")).explode("lost")
    rows = in_order.with_columns(row=(~pl.col("lost")).cum_sum().over("link")).group_by("link", "row").agg(
        length=pl.col("lost").sum())
    longest = rows.group_by("link").agg(longest=pl.col("length").max())
    return names.join(longest, on="link").drop("link").sort(LINK)


def transmissions(ledger: pl.DataFrame) -> pl.DataFrame:
    """One row per frame that went on the air, in order per sender: source (numbers the senders), medium, sender,
    on_air_ns."""
    on_air = _numbered(ledger.filter(pl.col("on_air_ns") >= 0), SENDER, "source").unique(["source", "number"])
    return on_air.group_by("source").agg(pl.col(SENDER).first().cast(pl.String), pl.col("on_air_ns").sort()).sort(
        SENDER).explode("on_air_ns")


def times_between_transmissions(ledger: pl.DataFrame) -> pl.DataFrame:
    """medium, sender, gap_s from the start of one transmission to the start, on_air_ns, of the sender's next there."""
    return transmissions(ledger).select(
        *SENDER, "on_air_ns", gap_s=pl.col("on_air_ns").diff().over("source") / NS_PER_S).drop_nulls("gap_s")


def _numbered(ledger: pl.DataFrame, names: Sequence[str], number: str) -> pl.DataFrame:
    """With a column that is equal where all `names` are: grouping by one integer is ten times faster than by names."""
    ledger = ledger.with_columns(pl.col(names).cast(pl.Categorical))
    codes = [pl.col(name).to_physical().cast(pl.Int64) * (1 << NAMES_BITS * place) for place, name in enumerate(names)]
    return ledger.with_columns(pl.sum_horizontal(codes).alias(number))


def _in_range(ledger: pl.DataFrame) -> pl.DataFrame:
    return ledger.filter((pl.col("fate") != "too weak").any().over("link"))
