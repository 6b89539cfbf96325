"""Faults of a sensor that sees bodies: it is blind, or its detections are shifted, stuck or noisier than usual.

    detection with the noise of the medium --faults of its link, in the order in which they began--> detection, or none
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from random import Random
from typing import Any, Final

from netem.impairments.correlated_uniforms import SMALLEST, normal_quantile
from netem.media.sensing.sight import Detection

Place = tuple[float, float, float]


@dataclass
class SensorFault:
    cause: str
    start_ns: int
    end_ns: int
    change: Callable[[Place, SensorFault], Place | None]       # None: the sensor is blind
    fields: Mapping[str, Any]
    rng: Random
    first: Place | None = field(default=None, init=False)      # the first detection within the window


def _blind(place: Place, fault: SensorFault) -> Place | None:
    return None


def _shifted(place: Place, fault: SensorFault) -> Place | None:
    x_m, y_m, z_m = (value + by for value, by in zip(place, fault.fields["by_m"], strict=True))
    return x_m, y_m, z_m


def _stuck(place: Place, fault: SensorFault) -> Place | None:
    if fault.first is None:
        fault.first = place
    return fault.first


def _noisier(place: Place, fault: SensorFault) -> Place | None:
    sigma_m = fault.fields["sigma_m"]
    x_m, y_m, z_m = (value + sigma_m * normal_quantile(fault.rng.random() or SMALLEST) for value in place)
    return x_m, y_m, z_m


CHANGES: Final[Mapping[str, Callable[[Place, SensorFault], Place | None]]] = {
    "blind": _blind, "shifted": _shifted, "frozen": _stuck, "noisier": _noisier}


def changed(detection: Detection, faults: Sequence[SensorFault]) -> tuple[Detection | None, str]:
    """Return the detection with the faults that act at its exposure; None and the cause if the sensor is blind."""
    place: Place = detection.x_m, detection.y_m, detection.z_m
    for fault in faults:
        if fault.start_ns <= detection.exposed_ns < fault.end_ns:
            after = fault.change(place, fault)
            if after is None:
                return None, fault.cause
            place = after
    return Detection(detection.exposed_ns, *place, detection.name), ""
