"""The kinds of guarantees that a scenario can state. A new one is a file and a line here.

Every member is a frozen dataclass whose fields are its TOML keys. Times are fields `<name>_ns`, in TOML `<name>_s`,
`_ms` or `_us`.
"""

from __future__ import annotations

from typing import Any

from experiments.monitors.age_of_information import AgeOfInformation
from experiments.monitors.in_view import InView
from experiments.monitors.inter_transmission_time import InterTransmissionTime
from experiments.monitors.reported import Reported
from experiments.monitors.signal import Signal
from experiments.monitors.successive_losses import SuccessiveLosses

MONITORS: dict[str, type[Any]] = {
    "age_of_information": AgeOfInformation,
    "in_view": InView,
    "inter_transmission_time": InterTransmissionTime,
    "reported": Reported,
    "signal": Signal,
    "successive_losses": SuccessiveLosses,
}
