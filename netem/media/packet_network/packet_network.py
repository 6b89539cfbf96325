"""Datagrams over full-duplex links, each direction with its queue, and over switches that store and forward.

    offer --fragments--> queue --rate--> link --delay--> switch: queue --rate--> link --delay--> node: reassembly
                           full: QUEUE_FULL                                                      all there: links

A packet is forwarded when its last bit has arrived. Each fragment has a header of its own, and all but the last carry
the greatest multiple of 8 bytes that the smallest MTU of their tree has room for (RFC 791; the sender knows the MTU of
its paths, as with RFC 1191). A copy is lost with the first of its fragments that is lost; the others go on.
The impairments of `sender -> receiver` act on each packet as it arrives at the receiver.

Invariants:
- the ledger expects one copy for each receiver of a datagram at its offer;
- packets of one sender to one receiver never overtake each other before the impairments;
- `_ahead` has an entry for each last packet on its way to a switch, with the least instant at which it reaches a node.

Not modelled: reassembly timeouts, duplicates of single fragments (a receiver takes the first to arrive), an error
message to the sender.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from heapq import heappop, heappush
from random import Random
from typing import Final

from netem.core.agenda import END_OF_FRAME, Agenda
from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.core.nearest import did_you_mean
from netem.media.links import Links
from netem.media.medium import Medium
from netem.media.packet_network.datagram import Datagram, pack, unpack
from netem.media.packet_network.routes import Branch
from netem.media.packet_network.settings import PacketNetworkSettings
from netem.media.packet_network.under_way import Packet, UnderWay
from netem.records.ledger import Ledger

LONGEST_BYTES: Final = 65_535       # a whole datagram with its header: the total length of IPv4 has 16 bits


class PacketNetwork(Medium):
    Settings = PacketNetworkSettings

    def __init__(self, name: str, settings: PacketNetworkSettings, nodes: Iterable[str], agenda: Agenda, ledger: Ledger,
                 links: Links, rng_for: Callable[[str], Random]) -> None:
        super().__init__(name, nodes)
        self._routes = settings.routes(self.nodes)
        self._groups = settings.members(self.nodes)
        self._agenda, self._ledger, self._links = agenda, ledger, links
        self._header_bytes, self._checksum = settings.header_bytes, settings.checksum
        self._fragments = settings.longer_than_mtu == "fragment"
        self._numbers: dict[str, int] = dict.fromkeys(self.nodes, 0)
        self._trees: dict[tuple[str, str], tuple[list[str], list[Branch]]] = {}     # by (sender, destination)
        self._under_way: dict[UnderWay, None] = {}
        self._ahead: list[tuple[int, int]] = []             # heap of (earliest instant at a node, sequence)
        self._passing: set[int] = set()                     # sequence numbers in `_ahead` that still count
        self._sequence = 0
        self._first = [(branch.link.queue, branch.link.idle_ns(self._header_bytes) + branch.rest_ns(self._header_bytes))
                       for node in self.nodes for branch in self._routes.tree(node, self._routes.reachable(node))]
        self._least_ns = min([least_ns for _, least_ns in self._first], default=0)
        self._first_busy_ns = 0                             # until then a first link is sending

    def links(self, until_ns: int) -> Sequence[tuple[str, str]]:
        there = {node: set(self._routes.reachable(node)) for node in self.nodes}
        return [(sender, receiver) for sender, receiver in super().links(until_ns) if receiver in there[sender]]

    def counters(self) -> Mapping[str, Mapping[str, int]]:
        """Packets that each link has sent and that its queue has dropped, under the name of the medium."""
        return {self.name: {f"{link.name} {what}": count for link in self._routes.links
                            for what, count in (("packets sent", link.sent), ("packets dropped", link.dropped))}}

    def offer(self, sender: str, data: bytes, now_ns: int) -> None:
        datagram = unpack(data)
        if datagram is None:
            self._refuse(self._frame(sender, data, now_ns), self._others(sender), "no header with the destination")
            return
        receivers, tree = self._tree(sender, datagram.destination)
        data = pack(Datagram(datagram.destination, datagram.payload, sender))
        frame = self._frame(sender, data, now_ns)
        if not receivers:
            self._refuse(frame, self._others(sender), self._no_receiver(sender, datagram.destination))
            return
        payload = datagram.payload
        room = min([branch.mtu_bytes() for branch in tree]) - self._header_bytes
        most = LONGEST_BYTES - self._header_bytes if self._fragments else room
        if len(payload) > most:
            self._refuse(frame, receivers, f"longer than {most} bytes")
            return
        self._ledger.expect(len(receivers), self.name)
        self._send(frame, data[:len(data) - len(payload)], payload, room, receivers, tree, now_ns)

    def lookahead_ns(self, t0_ns: int) -> int:
        """See `Medium`: of a new offer the shortest packet behind what its first link sends, and the packets ahead."""
        if self._first_busy_ns > t0_ns:
            reach_ns = min([max(t0_ns, queue.free_ns) + least_ns for queue, least_ns in self._first])
        else:
            reach_ns = t0_ns + self._least_ns
        ahead = self._ahead
        while ahead and ahead[0][1] not in self._passing:
            heappop(ahead)
        return max(t0_ns, min(reach_ns, ahead[0][0])) if ahead else reach_ns

    def finish(self, end_ns: int) -> None:
        for under_way in self._under_way:
            for receiver in under_way.open:
                self._ledger.close(under_way.frame, receiver, Fate.UNFINISHED, cause="under way")
        self._under_way.clear()

    def _send(self, frame: Frame, head: bytes, payload: bytes, room: int, receivers: list[str], tree: list[Branch],
              now_ns: int) -> None:
        size = len(payload) if len(payload) <= room else room // 8 * 8
        starts = range(0, len(payload), size) if payload else range(1)
        under_way = UnderWay(frame, head, len(starts), receivers)
        self._under_way[under_way] = None
        taken: list[tuple[Packet, Branch, int | None]] = []
        for start in starts:
            piece = payload[start:start + size]
            packet = Packet(under_way, piece, self._header_bytes + len(piece), start == starts[-1])
            for branch in tree:
                end_ns = branch.link.take(packet.size_bytes, now_ns)
                taken.append((packet, branch, end_ns))
                if end_ns is not None:
                    begin_ns = end_ns - branch.link.sending_ns(packet.size_bytes)
                    frame.on_air_ns = begin_ns if frame.on_air_ns < 0 else min(frame.on_air_ns, begin_ns)
                    frame.end_ns = max(frame.end_ns, end_ns)
        self._first_busy_ns = max(self._first_busy_ns, frame.end_ns)
        if frame.on_air_ns >= 0:
            for tap in self.taps:
                tap.frame(frame, frame.end_ns)
        for packet, branch, end_ns in taken:
            self._go(packet, branch, end_ns)

    def _forward(self, packet: Packet, switch: Branch, sequence: int) -> None:
        self._passing.discard(sequence)
        now_ns = self._agenda.now_ns
        for branch in switch.onward:
            self._go(packet, branch, branch.link.take(packet.size_bytes, now_ns))

    def _go(self, packet: Packet, branch: Branch, end_ns: int | None) -> None:
        """Take a packet along a link, over at `end_ns`; None: the queue of the link had no room."""
        if end_ns is None:
            for receiver in branch.receivers:
                if receiver in packet.of.open:
                    self._ledger.close(packet.of.frame, receiver, Fate.QUEUE_FULL, cause=branch.link.name)
                    self._close(packet.of, receiver)
            return
        arrival_ns = end_ns + branch.link.delay_ns
        if not branch.onward:
            self._arrive(packet, branch.receivers[0], arrival_ns)
            return
        self._sequence += 1
        if packet.last:
            heappush(self._ahead, (arrival_ns + branch.rest_ns(packet.size_bytes), self._sequence))
            self._passing.add(self._sequence)
        self._agenda.at(arrival_ns, END_OF_FRAME, branch.link.name,
                        partial(self._forward, packet, branch, self._sequence))

    def _arrive(self, packet: Packet, receiver: str, arrival_ns: int) -> None:
        under_way = packet.of
        frame = under_way.frame
        if under_way.count == 1:
            self._links.receive(frame, receiver, arrival_ns, checksum=self._checksum)
            self._close(under_way, receiver)
            return
        copies, fate, cause = self._links.impair_fragment(frame, receiver, arrival_ns, packet.payload)
        if receiver not in under_way.open:
            return
        if not copies:
            self._ledger.close(frame, receiver, fate, cause=cause)
            self._close(under_way, receiver)
            return
        whole = under_way.reassemble(receiver, min(copies, key=lambda copy: copy.arrival_ns))
        if whole is not None:
            self._links.receive_whole(frame, receiver, whole, checksum=self._checksum)
            self._close(under_way, receiver)

    def _close(self, under_way: UnderWay, receiver: str) -> None:
        del under_way.open[receiver]
        if not under_way.open:
            del self._under_way[under_way]

    def _refuse(self, frame: Frame, receivers: Sequence[str], cause: str) -> None:
        self._ledger.expect(len(receivers), self.name)
        for receiver in receivers:
            self._ledger.close(frame, receiver, Fate.MALFORMED, cause=cause)

    def _frame(self, sender: str, data: bytes, now_ns: int) -> Frame:
        number = self._numbers[sender]
        self._numbers[sender] = number + 1
        return Frame(self.name, sender, number, now_ns, data)

    def _others(self, sender: str) -> list[str]:
        return [node for node in self.nodes if node != sender]

    def _tree(self, sender: str, destination: str) -> tuple[list[str], list[Branch]]:
        """Return the receivers of what `sender` sends to `destination`, and the links that it takes."""
        found = self._trees.get((sender, destination))
        if found is None:
            reachable = self._routes.reachable(sender)
            members = self._groups.get(destination, (destination,))
            receivers = [node for node in self.nodes if node in members and node in reachable]
            found = self._trees[sender, destination] = receivers, self._routes.tree(sender, receivers)
        return found

    def _no_receiver(self, sender: str, destination: str) -> str:
        if destination == sender:
            return f"addressed to its sender, {sender}"
        if destination in self.nodes or destination in self._groups:
            return f"no path from {sender} to {destination}"
        return (f"no node or group is called {destination[:40]!r}: "
                f"{did_you_mean(destination, [*self.nodes, *self._groups], 'see the nodes and groups of the medium')}")
