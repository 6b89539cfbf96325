"""A program that tells a mover where to go and when to stop, and records what the mover says."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from agents.marco_polo_game.movers.table import PlatformSettings
from agents.pursuit.law import Area
from firmware_sim.board import Board

AREA = Area((0.0, 10.0), (0.0, 10.0))


class Driver:
    @dataclass(frozen=True, kw_only=True)
    class Settings(PlatformSettings):
        speed_mps: float
        go_ns: tuple[int, ...] = ()                             # when to go,
        ways: tuple[tuple[tuple[float, float], ...], ...] = ()  # and along which places
        stop_ns: tuple[int, ...] = ()

    def __init__(self, board: Board, settings: Settings) -> None:
        mover = settings.platform.mover(board, AREA, settings.speed_mps)
        for at_ns, way in zip(settings.go_ns, settings.ways, strict=True):
            board.at(at_ns, partial(mover.go, way))
        for at_ns in settings.stop_ns:
            board.at(at_ns, mover.stop)
        board.record_all([("x", "m"), ("y", "m"), ("coasted", "m")], lambda: [*mover.place, mover.coasted_m])
