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

import polars as pl

LINK = ["medium", "sender", "receiver"]
DELIVERED = "delivered"
NS_PER_S = 1e9


def copies_in_range(ledger: pl.DataFrame) -> pl.DataFrame:
    return ledger.filter((pl.col("fate") != "too weak").any().over(LINK))


def age_steps(ledger: pl.DataFrame, length_ns: int) -> pl.DataFrame:
    """Pieces of every link's sawtooth: from_ns, to_ns, newest_ns; on [from_ns, to_ns) the age is t - newest_ns."""
    ledger = copies_in_range(ledger)
    starts = ledger.select(LINK).unique().with_columns(
        from_ns=pl.lit(0, pl.Int64), newest_ns=pl.lit(0, pl.Int64))
    heard = ledger.filter((pl.col("fate") == DELIVERED) & (pl.col("delivered_ns") < length_ns)).select(
        *LINK, from_ns=pl.col("delivered_ns"), newest_ns=pl.col("offered_ns"))
    return pl.concat([starts, heard]).sort([*LINK, "from_ns", "newest_ns"]).with_columns(
        pl.col("newest_ns").cum_max().over(LINK),
        to_ns=pl.col("from_ns").shift(-1).over(LINK).fill_null(length_ns))


def age_of_information(ledger: pl.DataFrame, length_ns: int) -> pl.DataFrame:
    """Per link: max_s, mean_s, and p95_s, the age that is not exceeded during 95 % of the time."""
    steps = age_steps(ledger, length_ns).with_columns(
        low_s=(pl.col("from_ns") - pl.col("newest_ns")) / NS_PER_S,
        high_s=(pl.col("to_ns") - pl.col("newest_ns")) / NS_PER_S,
        long_s=(pl.col("to_ns") - pl.col("from_ns")) / NS_PER_S)
    table = steps.group_by(LINK).agg(
        max_s=pl.col("high_s").max(),
        mean_s=(pl.col("long_s") * (pl.col("low_s") + pl.col("high_s")) / 2).sum() / pl.col("long_s").sum())
    return table.join(_percentile(steps, 0.95), on=LINK, how="left").sort(LINK)


def _percentile(steps: pl.DataFrame, share: float) -> pl.DataFrame:
    """The age a with time(age <= a) = share * length: that time grows, between the ends of pieces, at the number of
    pieces that hold the age."""
    edges = pl.concat([steps.select(*LINK, age_s="low_s", opens=pl.lit(1.0)),
                       steps.select(*LINK, age_s="high_s", opens=pl.lit(-1.0))]).sort([*LINK, "age_s"])
    edges = edges.with_columns(
        slope=pl.col("opens").cum_sum().shift(1).over(LINK).fill_null(0.0),
        step_s=pl.col("age_s").diff().over(LINK).fill_null(0.0),
    ).with_columns(below_s=(pl.col("slope") * pl.col("step_s")).cum_sum().over(LINK))
    wanted = steps.group_by(LINK).agg(wanted_s=pl.col("long_s").sum() * share)
    beyond = edges.join(wanted, on=LINK).filter(pl.col("below_s") >= pl.col("wanted_s"), pl.col("slope") > 0)
    return beyond.sort([*LINK, "age_s"]).group_by(LINK, maintain_order=True).first().select(
        *LINK, p95_s=pl.col("age_s") - (pl.col("below_s") - pl.col("wanted_s")) / pl.col("slope"))


def successive_losses(ledger: pl.DataFrame) -> pl.DataFrame:
    """Per link: the longest row of frames of which no copy was delivered; frames under way at the end do not count."""
    ended = copies_in_range(ledger).filter(pl.col("fate") != "unfinished")
    frames = ended.group_by([*LINK, "number"]).agg(lost=(pl.col("fate") != DELIVERED).all()).sort([*LINK, "number"])
    heard = frames.with_columns(row=(~pl.col("lost")).cum_sum().over(LINK))
    rows = heard.group_by([*LINK, "row"]).agg(length=pl.col("lost").sum())
    return rows.group_by(LINK).agg(longest=pl.col("length").max()).sort(LINK)


def transmissions(ledger: pl.DataFrame) -> pl.DataFrame:
    """One row per frame that went on the air: medium, sender, number, on_air_ns, end_ns; in order per sender."""
    return ledger.filter(pl.col("on_air_ns") >= 0).select("medium", "sender", "number", "on_air_ns", "end_ns").unique(
        ["medium", "sender", "number"]).sort(["medium", "sender", "on_air_ns", "number"])


def times_between_transmissions(ledger: pl.DataFrame) -> pl.DataFrame:
    """medium, sender, gap_s from the start of one transmission to the start of the sender's next on that medium."""
    return transmissions(ledger).select(
        "medium", "sender",
        gap_s=pl.col("on_air_ns").diff().over(["medium", "sender"]) / NS_PER_S).drop_nulls("gap_s")
