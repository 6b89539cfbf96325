"""One node of the ring as a HELICS message federate: `python -m benchmarks.lockstep.helics_member <json>`.

Time is counted in windows. With the grant of time t HELICS delivers the messages stamped before t, so a message of time
k comes with the grant of k + 1, never with that of k.
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path

import helics

from benchmarks.lockstep.ring import Member, Task


@dataclass(frozen=True)
class HelicsMember:
    index: int
    task: Task
    folder: str
    core_type: str
    core_init: str
    targeted: bool

    def run(self) -> None:
        info = helics.helicsCreateFederateInfo()
        helics.helicsFederateInfoSetCoreTypeFromString(info, self.core_type)
        helics.helicsFederateInfoSetCoreName(info, f"core_{self.index}")
        helics.helicsFederateInfoSetCoreInitString(info, self.core_init)
        helics.helicsFederateInfoSetTimeProperty(info, helics.HELICS_PROPERTY_TIME_PERIOD, 1.0)
        helics.helicsFederateInfoSetIntegerProperty(info, helics.HELICS_PROPERTY_INT_LOG_LEVEL,
                                                    helics.HELICS_LOG_LEVEL_NO_PRINT)
        helics.helicsFederateInfoSetFlagOption(info, helics.HELICS_FLAG_UNINTERRUPTIBLE, True)
        helics.helicsFederateInfoSetFlagOption(info, helics.HELICS_FLAG_WAIT_FOR_CURRENT_TIME_UPDATE, False)
        federate = helics.helicsCreateMessageFederate(f"node_{self.index}", info)
        neighbour = f"port_{(self.index + 1) % self.task.nodes}"
        if self.targeted:
            port = helics.helicsFederateRegisterGlobalTargetedEndpoint(federate, f"port_{self.index}")
            helics.helicsEndpointAddDestinationTarget(port, neighbour)
        else:
            port = helics.helicsFederateRegisterGlobalEndpoint(federate, f"port_{self.index}")
        helics.helicsFederateEnterExecutingMode(federate)
        self.take_turns(federate, port, neighbour)
        helics.helicsFederateDisconnect(federate)
        helics.helicsFederateFree(federate)

    def take_turns(self, federate: helics.HelicsMessageFederate, port: helics.HelicsEndpoint, neighbour: str) -> None:
        member = Member(self.index, self.task)
        for window in range(self.task.windows):
            granted = helics.helicsFederateRequestTime(federate, float(window + 1))
            if granted != window + 1:
                member.fault = f"node {self.index}: asked for time {window + 1}, was granted {granted}"
                break
            received = []
            while helics.helicsEndpointHasMessage(port):
                received.append(helics.helicsMessageGetBytes(helics.helicsEndpointGetMessage(port)))
            out = member.turn(received)
            helics.helicsEndpointSendBytesTo(port, out, neighbour)
            member.finished()
        member.save(Path(self.folder))


if __name__ == "__main__":
    given = json.loads(sys.argv[1])
    HelicsMember(**{**given, "task": Task(**given["task"])}).run()
    helics.helicsCloseLibrary()
