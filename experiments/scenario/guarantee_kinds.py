"""The kinds of guarantees that a scenario can state. A new kind is a file and a line here.

Every member is a frozen dataclass whose fields are its TOML keys. Times are fields `<name>_ns`, in TOML `<name>_s`,
`_ms` or `_us`.
"""

from __future__ import annotations

from typing import Final

from netem.core.kinds import Kinds

MONITORS: Final = Kinds({
    "age_of_information": "experiments.judge.monitors.age_of_information:AgeOfInformation",
    "execution": "experiments.judge.monitors.execution:Execution",
    "formula": "experiments.judge.monitors.formula:Formula",
    "in_view": "experiments.judge.monitors.in_view:InView",
    "inter_transmission_time": "experiments.judge.monitors.inter_transmission_time:InterTransmissionTime",
    "reported": "experiments.judge.monitors.reported:Reported",
    "signal": "experiments.judge.monitors.signal:Signal",
    "successive_losses": "experiments.judge.monitors.successive_losses:SuccessiveLosses",
})
