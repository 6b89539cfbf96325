"""The process of one node: `python -m experiments.node_process`, started by the process host."""

from __future__ import annotations

import sys
from functools import partial

import msgspec

from experiments.node_build import NodeSpecification, build_node
from netem.transport.errand import read_errand
from netem.transport.node_link import serve


def main() -> int:
    errand = read_errand()
    specification = msgspec.json.decode(errand.specification, type=NodeSpecification)
    return serve(errand.endpoint, errand.run, errand.node, partial(build_node, specification), errand.timeout_s)


if __name__ == "__main__":
    sys.exit(main())
