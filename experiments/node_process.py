"""The process of one node: `python -m experiments.node_process`, started by the process host."""

from __future__ import annotations

import sys

import msgspec

from experiments.node_build import NodeSpecification, build_node
from netem.node import Node
from netem.transport.errand import Errand
from netem.transport.node_link import take_part


def build(errand: Errand) -> Node:
    return build_node(msgspec.json.decode(errand.specification, type=NodeSpecification))


if __name__ == "__main__":
    sys.exit(take_part(build))
