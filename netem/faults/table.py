"""The faults that a scenario can name by `kind`. A new one is a file and a line here."""

from __future__ import annotations

from typing import Final

from netem.core.kinds import Kinds

FAULTS: Final = Kinds({
    "kill": "netem.faults.kill:Kill",
    "pause": "netem.faults.pause:Pause",
    "clock_step": "netem.faults.clock_step:ClockStep",
    "clock_drift": "netem.faults.clock_drift:ClockDrift",
    "link_down": "netem.faults.link_down:LinkDown",
    "undetected_corruption": "netem.faults.undetected_corruption:UndetectedCorruption",
    "plant_input": "netem.faults.plant_input:PlantInput",
    "plant_parameter": "netem.faults.plant_parameter:PlantParameter",
    "slow": "netem.faults.slow:Slow",
    "jam": "netem.faults.jam:Jam",
    "blackout": "netem.faults.blackout:Blackout",
    "bias": "netem.faults.sensor_errors:Bias",
    "stuck": "netem.faults.sensor_errors:Stuck",
    "noise": "netem.faults.sensor_errors:Noise",
    "bus_off": "netem.faults.controller_fault:BusOff",
    "babble": "netem.faults.controller_fault:Babble",
    "stuck_dominant": "netem.faults.stuck_dominant:StuckDominant",
    "partition": "netem.faults.partition:Partition",
})
