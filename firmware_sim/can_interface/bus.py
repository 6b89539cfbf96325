"""A `can.BusABC` on a port of the node whose blocking program opens it; time is the node's.

    program --send--> struct of SocketCAN --> port of the node      port --> struct --filter--> inbox --recv--> program

It behaves as SocketCAN where python-can leaves a choice. Several buses of a program may share a channel, each with its
own queue and filters. A message that one of them sends is received by the others, and by itself with
`receive_own_messages`, once it got through, if the medium reports that (`own_frames_to`). Only a bus with `fd=True`
receives CAN FD frames. Error messages of the controller pass all filters. `send_periodic` copies its messages when it
is started or modified.

Not modelled: a full transmit queue, with which SocketCAN raises ENOBUFS. Whether a frame still waits is decided in the
emulator after the window in which the program sends, so `send` never blocks, and the ledger has what the controller
drops; `queue_frames` of the bus makes the queue longer. Listening only, `bitrate` and `timing` (the scenario sets those
of the bus).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final

from can import BusABC, BusState, CanInitializationError, CanOperationError, CanProtocol, Message
from can.broadcastmanager import (
    CyclicSendTaskABC,
    LimitedDurationCyclicSendTaskABC,
    ModifiableCyclicTaskABC,
    RestartableCyclicTaskABC,
)
from can.typechecking import AutoDetectedConfig, CanFilters

from firmware_sim.blocking.here import running
from firmware_sim.blocking.inbox import Inbox
from firmware_sim.blocking.program import BlockingProgram
from firmware_sim.blocking.seconds import duration_ns
from netem.media.can.error_message import state_after
from netem.media.can.fault_confinement import State
from netem.media.can.frame import CanFrame, MalformedFrame, pack, unpack

STATES: Final = {State.ERROR_ACTIVE: BusState.ACTIVE, State.ERROR_PASSIVE: BusState.PASSIVE,
                 State.BUS_OFF: BusState.ERROR}
NO_RUN: Final = (
    "the CAN interface 'marconet' exists only inside a run of marconet, in the threads of a node's program. Write the "
    "code as a function, name it in a scenario (program = \"my_module:main\") and start it with `marconet run "
    "my_scenario.toml`; outside of a run use another interface, such as 'virtual'")


class Channel:
    """A node's CAN controller, shared by all buses of its program on one channel."""

    def __init__(self, program: BlockingProgram, name: str) -> None:
        self.program = program
        self.name = name
        self.hears_itself = name in program.own_frames
        self.buses: list[MarconetBus] = []
        self.state = State.ERROR_ACTIVE
        self._senders: dict[bytes, MarconetBus] = {}        # identifier -> bus that sent it last; no other node may
        program.node.ports[name].on_receive = self._receive
        for what in ("malformed", "rx_dropped"):
            program.node.count(f"{name}.{what}", 0)

    def send(self, sender: MarconetBus, data: bytes) -> None:
        self.program.send(self.name, data)
        self._senders[data[:4]] = sender

    def _receive(self, data: bytes) -> None:
        try:
            frame = unpack(data)
        except MalformedFrame:
            self.program.node.count(f"{self.name}.malformed")
            return
        if frame.error:
            self.state = state_after(frame, self.state)
        sender = self._senders.get(data[:4]) if self.hears_itself else None
        for bus in self.buses:
            if bus is not sender or bus.receive_own_messages:
                bus.hear(frame, is_rx=sender is None)
        self.program.promise()


class MarconetBus(BusABC):
    def __init__(self, channel: str | None = None, can_filters: CanFilters | None = None, fd: bool = False,
                 receive_own_messages: bool = False, ignore_rx_error_frames: bool = False, rx_queue_size: int = 0,
                 **kwargs: Any) -> None:
        """`channel`: a CAN bus of the node, by default its only one. `rx_queue_size`: 0 keeps any number of messages;
        a full queue drops the oldest, counted as `CHANNEL.rx_dropped`. Other arguments (`bitrate`) are ignored.
        """
        program = running()
        if program is None:
            raise CanInitializationError(NO_RUN)
        self._program = program
        self._channel = _channel(program, channel)
        if receive_own_messages and not self._channel.hears_itself:
            raise CanInitializationError(
                f"receive_own_messages: the controller does not report what got through; write own_frames_to = "
                f"[\"{program.node.name}\"] under [media.{self._channel.name}] of the scenario")
        self._inbox: Inbox[Message] = Inbox(program, rx_queue_size)
        self._can_protocol = CanProtocol.CAN_FD if fd else CanProtocol.CAN_20
        self._errors = not ignore_rx_error_frames
        self.receive_own_messages = receive_own_messages
        self.channel_info = f"marconet channel '{self._channel.name}' of node '{program.node.name}'"
        super().__init__(channel=self._channel.name, can_filters=can_filters, **kwargs)
        self._channel.buses.append(self)

    def send(self, msg: Message, timeout: float | None = None) -> None:
        """Send `msg`: it waits in the controller for the bus, the program does not wait."""
        self._check()
        self.transmit(packed(msg, fd=self.protocol is CanProtocol.CAN_FD))
        self._program.note_call()

    def recv(self, timeout: float | None = None) -> Message | None:
        return self._recv_internal(timeout)[0]

    def _recv_internal(self, timeout: float | None) -> tuple[Message | None, bool]:
        self._check()
        message = self._inbox.take(None if timeout is None else duration_ns(timeout))
        if message is None:
            self._check()               # raises if the bus was shut down meanwhile
        return message, True

    def _send_periodic_internal(self, msgs: Sequence[Message] | Message, period: float, duration: float | None = None,
                                autostart: bool = True,
                                modifier_callback: Callable[[Message], None] | None = None) -> CyclicSendTaskABC:
        self._check()
        if modifier_callback is not None:           # the callback may block, so it needs a thread of the program
            return super()._send_periodic_internal(msgs, period, duration, autostart, modifier_callback)
        task = CyclicSendTask(self, self._program, msgs, period, duration)
        if autostart:
            task.start()
        return task

    def shutdown(self) -> None:
        super().shutdown()
        if self in self._channel.buses:
            self._channel.buses.remove(self)

    @property
    def state(self) -> BusState:
        """The controller's state by its last error message."""
        if running() is self._program:
            self._program.note_call()
        return STATES[self._channel.state]

    @state.setter
    def state(self, new_state: BusState) -> None:
        raise NotImplementedError("the state of the controller follows from what happens on the bus")

    @staticmethod
    def _detect_available_configs() -> list[AutoDetectedConfig]:
        """Return the CAN buses of the node; none outside of a run."""
        program = running()
        return [] if program is None else [{"interface": "marconet", "channel": name} for name in program.can_buses]

    # --- calls of the channel and of periodic tasks, from any thread

    def transmit(self, data: bytes) -> None:
        self._channel.send(self, data)

    def hear(self, frame: CanFrame, *, is_rx: bool) -> None:
        if (frame.fd and self.protocol is not CanProtocol.CAN_FD) or (frame.error and not self._errors):
            return
        message = Message(self._program.board.now_ns / 1e9, frame.can_id, frame.extended, frame.remote, frame.error,
                          self._channel.name, len(frame.data) if frame.fd else frame.dlc, bytearray(frame.data),
                          frame.fd, is_rx, frame.bit_rate_switch, frame.error_state)
        if (frame.error or self._matches_filters(message)) and not self._inbox.put(message):
            self._program.node.count(f"{self._channel.name}.rx_dropped")

    def _check(self) -> None:
        if self._is_shutdown:
            raise CanOperationError(f"{self.channel_info}: the bus was shut down")
        if running() is not self._program:
            raise CanOperationError(f"{self.channel_info}: called in a thread that the node does not know; "
                                    "start threads with threading.Thread")


class CyclicSendTask(LimitedDurationCyclicSendTaskABC, ModifiableCyclicTaskABC, RestartableCyclicTaskABC):
    """Sends messages cyclically, one each period of the node's oscillator, the first at once."""

    def __init__(self, bus: MarconetBus, program: BlockingProgram, messages: Sequence[Message] | Message,
                 period: float, duration: float | None) -> None:
        super().__init__(messages, period, duration)
        self._bus = bus
        self._repeating = program.repeat(duration_ns(period), duration_ns(duration) if duration else None, self._send)
        self._turn = 0
        self._take(self.messages)

    def start(self) -> None:
        if not self._repeating.runs:
            self._turn = 0
            self._repeating.start()

    def stop(self) -> None:
        self._repeating.stop()

    def modify_data(self, messages: Sequence[Message] | Message) -> None:
        super().modify_data(messages)
        self._take(self.messages)

    def _take(self, messages: Sequence[Message]) -> None:
        fd = self._bus.protocol is CanProtocol.CAN_FD
        self._packed = [packed(message, fd=fd) for message in messages]

    def _send(self) -> None:
        data = self._packed[self._turn]
        self._turn = (self._turn + 1) % len(self._packed)
        self._bus.transmit(data)


def packed(message: Message, *, fd: bool) -> bytes:
    """Return the struct for the port; CanOperationError for no valid CAN frame, or for CAN FD on a bus without it."""
    if message.is_fd and not fd:
        raise CanOperationError("a CAN FD message on a bus that was opened without fd=True")
    try:
        return pack(CanFrame(message.arbitration_id, bytes(message.data), message.is_extended_id,
                             message.is_remote_frame, message.is_fd, message.bitrate_switch,
                             message.error_state_indicator, -1 if message.is_fd else message.dlc,
                             message.is_error_frame))
    except MalformedFrame as error:
        raise CanOperationError(f"{message.arbitration_id:#x}: {error}") from error


def _channel(program: BlockingProgram, name: str | None) -> Channel:
    known = program.can_buses
    if name is None and len(known) == 1:
        (name,) = known
    if name not in known:
        there = ", ".join(f'"{channel}"' for channel in known) or "none"
        raise CanInitializationError(f"node {program.node.name}: channel={name!r} is no CAN bus of this node; "
                                     f"it has {there}" + ("; name one of them" if name is None and known else ""))
    key = ("can", name)
    if key not in program.shared:
        program.shared[key] = Channel(program, name)
    found: Channel = program.shared[key]
    return found
