"""Detections of a robot's target on their way to its pursuer: each is counted, and those refused are told of."""

from __future__ import annotations

from agents.pursuit import Place
from agents.pursuit.pursuer import Pursuer
from firmware_sim.board import Board


def take_in(board: Board, pursuer: Pursuer, seen_ns: int, place: Place, own: Place) -> bool:
    """Give a detection to `pursuer`, whose robot is at `own`; return whether it is the newest one now."""
    before_ns = pursuer.seen_ns
    try:
        counted = pursuer.detected(board.now_ns, seen_ns, place, own)
    except ValueError as error:
        board.count("detections refused")
        board.warn("detection refused", str(error))
    else:
        board.count("detections" if counted else "detections too late")
    return pursuer.seen_ns != before_ns
