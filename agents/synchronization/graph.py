"""The directed graph of information flow (section 6.1.2) and its Laplacian.

An edge (i, j) is an information flow from i to j; N_i = {j : (j, i) in E} are the agents that agent i hears.

    l_ij = -1 if j in N_i,   |N_i| if j = i,   0 otherwise          (N x N; rows are receivers, columns senders)

Agents are numbered from 0 here and from 1 in the dissertation.
Not modelled: weighted links (every l_ij off the diagonal is 0 or -1), self-loops, several links between a pair.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Edge = tuple[int, int]      # (sender, receiver)


class GraphError(ValueError):
    """A graph or Laplacian is invalid; the text names the edge or entry."""


def laplacian(size: int, edges: Iterable[Edge]) -> Floats:
    """Return the Laplacian of `size` agents with edges (sender, receiver); an edge given twice counts once."""
    L = np.zeros((size, size))
    for sender, receiver in set(edges):
        if not (0 <= sender < size and 0 <= receiver < size):
            raise GraphError(f"edge {sender} -> {receiver}: agents are numbered 0 to {size - 1}")
        if sender == receiver:
            raise GraphError(f"edge {sender} -> {receiver}: an agent has no link to itself (section 6.1.2)")
        L[receiver, sender] = -1.0
        L[receiver, receiver] += 1.0
    return L


def laplacian_from_neighbours(neighbours: Sequence[Iterable[int]]) -> Floats:
    """Return the Laplacian with the sets N_0, N_1, ... of agents that each agent hears."""
    return laplacian(len(neighbours), ((j, i) for i, heard in enumerate(neighbours) for j in heard))


def checked_laplacian(matrix: ArrayLike) -> Floats:
    """Return `matrix` as an array; raises GraphError with all reasons why it is no Laplacian."""
    found = laplacian_problems(matrix)
    if found:
        raise GraphError("; ".join(found))
    return np.array(matrix, dtype=float)


def laplacian_problems(matrix: Any) -> list[str]:
    """Return the reasons why `matrix` is not the Laplacian of a directed graph; agents numbered from 0."""
    try:
        L = np.array(matrix, dtype=float)
    except (TypeError, ValueError):
        return ["the Laplacian is not a matrix of numbers: give N rows of N numbers"]
    if L.ndim != 2 or L.shape[0] != L.shape[1] or L.shape[0] == 0:
        return [f"the Laplacian has shape {L.shape}: expected N x N with N >= 1"]
    found = []
    for i, row in enumerate(L):
        for j, entry in enumerate(row):
            if i != j and entry not in (0.0, -1.0):
                found.append(f"l[{i}][{j}]={entry:g}: expected -1 ({i} hears {j}) or 0")
        heard = int(np.count_nonzero(np.delete(row, i)))
        if row[i] != heard:
            found.append(f"l[{i}][{i}]={row[i]:g}: expected the number of agents that {i} hears, {heard}")
    return found


def neighbours(L: Floats) -> list[list[int]]:
    """Return for each agent i the agents that it hears, N_i, ascending."""
    return [[j for j in range(len(L)) if j != i and L[i, j] != 0] for i in range(len(L))]


def edges(L: Floats) -> list[Edge]:
    """Return all links (sender, receiver), ascending."""
    return [(j, i) for j, hearers in enumerate(neighbours(L.T)) for i in hearers]


def distances(L: Floats) -> Floats:
    """Return d[i, j] = number of links on a shortest path from i to j; inf where there is none."""
    d: Floats = np.where(L.T != 0, 1.0, np.inf)
    np.fill_diagonal(d, 0.0)
    for via in range(len(L)):           # Floyd (1962) and Warshall (1962)
        d = np.minimum(d, d[:, [via]] + d[[via]])
    return d


def unreachable_pairs(L: Floats) -> list[Edge]:
    """Return the pairs (i, j) without a path from i to j; empty if and only if the graph is strongly connected."""
    return [(int(i), int(j)) for i, j in np.argwhere(np.isinf(distances(L)))]


def one_way_links_without_cycle(L: Floats) -> list[Edge]:
    """Return the links that break Assumption 7, "all unidirectional links have an inclusive cycle".

    A link sender -> receiver has such a cycle if a path leads from the receiver back to the sender.
    """
    d = distances(L)
    return [(sender, receiver) for sender, receiver in edges(L) if np.isinf(d[receiver, sender])]
