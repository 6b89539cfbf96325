"""One node of the ring as a mosaik simulator; mosaik starts `python -m benchmarks.lockstep.mosaik_member HOST:PORT`.

One mosaik time step is one window. mosaik makes two requests per node and window, as JSON over TCP: `step` with the
messages received, and `get_data` for those to send; the turn ends with the answer to the second.
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

import mosaik_api_v3
from mosaik_api_v3.connection import EndOfRequests

from benchmarks.lockstep.ring import Member, Task

META = {
    "api_version": "3.0",
    "type": "time-based",
    "models": {"Node": {"public": True, "params": [], "attrs": ["inbox", "outbox"]}},
}


class MosaikMember(mosaik_api_v3.Simulator):
    def __init__(self) -> None:
        super().__init__(META)  # type: ignore[no-untyped-call]

    def init(self, sid: str, time_resolution: float = 1.0, **sim_params: Any) -> Any:
        self.member = Member(sim_params["index"], Task(**sim_params["task"]))
        self.folder = Path(sim_params["folder"])
        self.out = ""
        return self.meta

    def create(self, num: int, model: str, **model_params: Any) -> Any:
        return [{"eid": "node", "type": model}]

    def step(self, time: int, inputs: dict[str, Any], max_advance: int) -> int:
        received = [text.encode() for text in inputs["node"]["inbox"].values() if text]
        self.out = self.member.turn(received).decode()
        return time + 1

    def get_data(self, outputs: dict[str, list[str]]) -> dict[str, dict[str, str]]:
        self.member.finished()
        if self.member.is_done:
            self.member.save(self.folder)
        return {"node": {"outbox": self.out}}


if __name__ == "__main__":
    with suppress(EndOfRequests):       # mosaik has ended the run, and reports it itself
        mosaik_api_v3.start_simulation(MosaikMember(), configure_logging=False)
