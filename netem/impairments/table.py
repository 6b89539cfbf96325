"""The impairments that a scenario can name by `kind`. A new one is a file and a line here.

Every member is a dataclass whose fields are its TOML keys, with a keyword-only `rng` if it draws random numbers. A time
is a field `<name>_ns`, in TOML `<name>_s`, `_ms` or `_us`.
"""

from __future__ import annotations

from typing import Any

from netem.impairments.bernoulli_loss import BernoulliLoss
from netem.impairments.corrupt import Corrupt
from netem.impairments.delay import Delay
from netem.impairments.duplicate import Duplicate
from netem.impairments.four_state_loss import FourStateLoss
from netem.impairments.gemodel import Gemodel
from netem.impairments.gilbert_elliott import GilbertElliott
from netem.impairments.gilbert_elliott_by_time import GilbertElliottByTime
from netem.impairments.rate_limit import RateLimit
from netem.impairments.reorder import Reorder
from netem.impairments.scripted_corruption import ScriptedCorruption
from netem.impairments.scripted_delay import ScriptedDelay
from netem.impairments.scripted_duplicate import ScriptedDuplicate
from netem.impairments.scripted_loss import ScriptedLoss
from netem.impairments.trace import Trace

IMPAIRMENTS: dict[str, type[Any]] = {
    "bernoulli_loss": BernoulliLoss,
    "corrupt": Corrupt,
    "delay": Delay,
    "duplicate": Duplicate,
    "four_state_loss": FourStateLoss,
    "gemodel": Gemodel,
    "gilbert_elliott": GilbertElliott,
    "gilbert_elliott_by_time": GilbertElliottByTime,
    "rate_limit": RateLimit,
    "reorder": Reorder,
    "scripted_corruption": ScriptedCorruption,
    "scripted_delay": ScriptedDelay,
    "scripted_duplicate": ScriptedDuplicate,
    "scripted_loss": ScriptedLoss,
    "trace": Trace,
}
