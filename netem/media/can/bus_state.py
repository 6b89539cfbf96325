"""State of the bus and of its controllers, with the changes that every transmission makes, with errors or without.

Invariants:
- at least 3 bits separate two transmissions, 11 if an error-passive node sends both;
- `waiting` holds exactly the controllers with a frame waiting that are not bus-off.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.media.can.bus_events import BusEvents
from netem.media.can.bus_load import BusLoad
from netem.media.can.bus_timeline import BusTimeline
from netem.media.can.controller import Controller
from netem.media.can.encoded_frame import EncodedFrame
from netem.media.can.settings import CanSettings
from netem.media.links import Links
from netem.records import FrameTap
from netem.records.ledger import Ledger


class BusState:
    def __init__(self, name: str, settings: CanSettings, controllers: Mapping[str, Controller], ledger: Ledger,
                 links: Links, taps: Sequence[FrameTap]) -> None:
        self.name = name
        self.settings = settings
        self.controllers = controllers
        self.ledger = ledger
        self.links = links
        self.timeline = BusTimeline(settings.clock)
        self.load = BusLoad(settings.load_window_ns)
        self.events = BusEvents(name)
        self.waiting: dict[str, Controller] = {}
        self.taps = taps
        self.transmissions = 0

    def carry(self, frame: Frame, encoded: EncodedFrame, now_ns: int) -> int:
        """Put the whole frame on the bus from now on; return the instant [ns] at which receivers take it."""
        timeline, clock = self.timeline, self.timeline.clock
        end_ticks = timeline.start(now_ns) + encoded.nominal_bits * clock.nominal + encoded.data_bits * clock.data
        timeline.busy_until(end_ticks)
        self.load.busy(now_ns, timeline.free_ns)
        frame.on_air_ns = now_ns
        frame.end_ns = timeline.instant(end_ticks)
        return timeline.instant(end_ticks - clock.nominal)

    def take(self, controller: Controller) -> Frame:
        """Remove the frame at the head of the controller's queue, which got through, and return it."""
        frame = controller.queue.take()[2]
        if not controller.queue.waiting:
            del self.waiting[controller.name]
        return frame

    def drop(self, controller: Controller, frame: Frame, fate: Fate, cause: str) -> None:
        for receiver in controller.open_copies(frame):
            self.ledger.close(frame, receiver, fate, cause=cause)
        controller.retransmissions.pop(frame.number, None)
