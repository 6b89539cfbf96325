"""The three frames of a team of sensors and its fusion center, little endian; names are numbers in the team's lists.

    report    'R'  sensor, target, claims it?, seen [ns], x, y [m], sigma [m]           32 bytes     sensor -> center
    news      'N'  sensor, target, then for each detection: seen [ns], x, y [m]     3 + 16 n bytes     center -> sensor
    charges   'C'  version, target of each sensor (255: idle)                        3 + n bytes     center -> everybody

Parsing never raises: it returns None for a frame that is cut, too long, not finite, or names no member of the team.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Final, NamedTuple

from agents.pursuit import Place

MOST_NEWS: Final = 6            # detections that fit into 100 bytes
IDLE: Final = 255
VERSIONS: Final = 1 << 16
_REPORT, _NEWS, _DETECTION, _CHARGES = (struct.Struct(form) for form in ("<cBB?q2df", "<cBB", "<q2f", "<cH"))


class Team(NamedTuple):
    """The names of sensors and targets; a number in a frame is a position in these lists."""

    sensors: tuple[str, ...]
    targets: tuple[str, ...]


class Report(NamedTuple):
    sensor: str
    target: str
    claims: bool                # the sensor is idle and claims the target, which entered its escape area
    seen_ns: int
    place: Place
    sigma_m: float


class News(NamedTuple):
    """Detections by other sensors, sent to the sensor in charge of the target."""

    sensor: str
    target: str
    detections: tuple[tuple[int, Place], ...]       # seen [ns], place


class Charges(NamedTuple):
    version: int                # counts changes and answers to claims modulo `VERSIONS`
    target_of: Mapping[str, str]


def team_of(table: Mapping[str, Sequence[str]]) -> Team:
    """Return the team of the scenario's `[team]`; ValueError if a list is missing or wrong."""
    team = Team(tuple(table.get("sensors", ())), tuple(table.get("targets", ())))
    for name, members in team._asdict().items():
        if not 0 < len(members) < IDLE or len(set(members)) < len(members):
            raise ValueError(f"team.{name}={list(members)}: expected 1 to {IDLE - 1} names, each once")
    return team


def pack_report(team: Team, report: Report) -> bytes:
    return _REPORT.pack(b"R", team.sensors.index(report.sensor), team.targets.index(report.target), report.claims,
                        report.seen_ns, *report.place, report.sigma_m)


def pack_news(team: Team, news: News) -> bytes:
    """Return the frame of the newest `MOST_NEWS` detections."""
    return _NEWS.pack(b"N", team.sensors.index(news.sensor), team.targets.index(news.target)) + b"".join(
        _DETECTION.pack(seen_ns, *place) for seen_ns, place in news.detections[-MOST_NEWS:])


def pack_charges(team: Team, charges: Charges) -> bytes:
    return _CHARGES.pack(b"C", charges.version % VERSIONS) + bytes(
        team.targets.index(charges.target_of[sensor]) if sensor in charges.target_of else IDLE
        for sensor in team.sensors)


def unpack(team: Team, data: bytes) -> Report | News | Charges | None:
    kind = data[:1]
    if kind == b"R" and len(data) == _REPORT.size:
        _, sensor, target, claims, seen_ns, x, y, sigma_m = _REPORT.unpack(data)
        if _known(team, sensor, target) and isfinite(x + y) and isfinite(sigma_m) and sigma_m > 0:
            return Report(team.sensors[sensor], team.targets[target], claims, seen_ns, (x, y), sigma_m)
    elif kind == b"N" and len(data) >= _NEWS.size and (len(data) - _NEWS.size) % _DETECTION.size == 0:
        _, sensor, target = _NEWS.unpack_from(data)
        found = tuple((seen_ns, (x, y)) for seen_ns, x, y in _DETECTION.iter_unpack(data[_NEWS.size:]))
        if _known(team, sensor, target) and all(isfinite(x + y) for _, (x, y) in found):
            return News(team.sensors[sensor], team.targets[target], found)
    elif kind == b"C" and len(data) == _CHARGES.size + len(team.sensors):
        numbers = data[_CHARGES.size:]
        if all(number == IDLE or number < len(team.targets) for number in numbers):
            return Charges(_CHARGES.unpack_from(data)[1], {
                sensor: team.targets[number] for sensor, number in zip(team.sensors, numbers, strict=True)
                if number != IDLE})
    return None


def newer(version: int, than: int) -> bool:
    """Return whether `version` is newer than `than`, modulo `VERSIONS`; they must differ by less than half of it."""
    return 0 < (version - than) % VERSIONS < VERSIONS // 2


def _known(team: Team, sensor: int, target: int) -> bool:
    return sensor < len(team.sensors) and target < len(team.targets)
