"""Agents coupled by waves or held outputs, told event by event: the oracle of the exact maps and of emulated runs.

One agent after the other is integrated exactly over each piece without events, with its force written as the port's
equations have it; no map, no registers.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from math import sqrt

import numpy as np
from scipy.linalg import expm

ROUNDING = 1e-12        # an account that should be 0 may be less by this
Arrival = Callable[[int, int, int, int], int | None]        # (sender, receiver, k, sent_ns) -> when it comes


def always(delays_ns) -> Arrival:
    return lambda sender, receiver, k, sent_ns: sent_ns + delays_ns[sender, receiver]


def stepped(A, B, C, damping, force, x, h_s):
    """Return x after h and the integral of C x, for x' = (A - damping B C) x + B force."""
    n = len(A)
    G = np.zeros((n + 2, n + 2))
    G[:n, :n], G[:n, -1], G[n, :n] = A - damping * B @ C, B[:, 0] * force, C[0]
    grown = expm(G * h_s) @ np.r_[x, 0.0, 1.0]
    return grown[:n], grown[n]


def simulate_waves(agents, edges, slot_ns, K, b, x0, instants_ns: Sequence[int], arrival: Arrival, *, hold=False):
    """Return the outputs at the instants, one row for each, and by link the least energy that the line ever owed and
    when it first owed less than nothing [ns], None if never.

    Each end solves its port: b e - F = sqrt(2 b) w and F = K (y - e)."""
    N, round_ns = len(agents), slot_ns * len(agents)
    x = [np.array(part, dtype=float) for part in x0]
    came = defaultdict(list)                        # (time, kind, link) -> [(k, wave)]
    wave, newest, ends = dict.fromkeys(edges, 0.0), dict.fromkeys(edges, -1), {}
    out_integral = dict.fromkeys(edges, 0.0)        # of v of the sender, since it sent last
    sent, account, least = defaultdict(list), dict.fromkeys(edges, 0.0), dict.fromkeys(edges, 0.0)
    broken = dict.fromkeys(edges)
    rows, now_ns, k_of = [], 0, [0] * N
    damping = [K * b / (b + K) * sum(receiver == i for _, receiver in edges) for i in range(N)]

    def advance(until_ns):
        nonlocal now_ns
        h_s = (until_ns - now_ns) * 1e-9
        for i, agent in enumerate(agents):
            incoming = [w for (_, receiver), w in wave.items() if receiver == i]
            force = sum(K * sqrt(2 * b) / (b + K) * w for w in incoming)
            x[i], of_y = stepped(agent.A, agent.B, agent.C, damping[i], force, x[i], h_s)
            for sender, receiver in edges:
                if sender == i:                     # e = (K y + sqrt(2 b) w) / (b + K), v = sqrt(2 b) e - w
                    w = wave[receiver, i]
                    e = (K * of_y + sqrt(2 * b) * w * h_s) / (b + K)
                    out_integral[sender, receiver] += sqrt(2 * b) * e - w * h_s
        for link, w in wave.items():
            if broken[link] is None and account[link] - w * w * h_s < -ROUNDING:
                broken[link] = now_ns + account[link] / (w * w) * 1e9
            account[link] -= w * w * h_s
            least[link] = min(least[link], account[link])
        now_ns = until_ns

    for instant_ns in instants_ns:
        while True:
            slots = [(i * slot_ns + k_of[i] * round_ns, 2, i) for i in range(N)]
            others = [*came, *((end_ns, 1, link) for link, end_ns in ends.items())]
            at_ns, kind, what = min([*slots, *others], key=lambda event: event[:2])
            if at_ns > instant_ns:
                break
            advance(at_ns)
            if kind == 2:
                for link in [link for link in edges if link[0] == what]:
                    v = out_integral[link] / (round_ns * 1e-9)
                    out_integral[link] = 0.0
                    sent[link].append(v)
                    due_ns = arrival(*link, k_of[what], at_ns)
                    if due_ns is not None:
                        came[due_ns, 0, link].append((k_of[what], v))
                k_of[what] += 1
            elif kind == 1:
                wave[what] = 0.0
                del ends[what]
            else:
                for k, v in came.pop((at_ns, 0, what)):
                    if k > newest[what]:
                        account[what] += sum(u * u for u in sent[what][newest[what] + 1:k + 1]) * round_ns * 1e-9
                        newest[what], wave[what] = k, v
                        if not hold:
                            ends[what] = at_ns + round_ns
        advance(instant_ns)
        rows.append([(agent.C @ state)[0] for agent, state in zip(agents, x, strict=True)])
    return np.array(rows), least, broken


def simulate_outputs(agents, edges, slot_ns, K, x0, instants_ns, delays_ns, own_delays_ns):
    """Return the outputs at the instants, one row for each."""
    N, round_ns = len(agents), slot_ns * len(agents)
    x = [np.array(part, dtype=float) for part in x0]
    users_ns = {**delays_ns, **{(i, i): own_delays_ns[i] for i in range(N)}}
    held = {user: (agents[user[0]].C @ x[user[0]])[0] for user in users_ns}
    coming, rows, now_ns, k_of = [], [], 0, [0] * N
    for instant_ns in instants_ns:
        while True:
            slots = [(i * slot_ns + k_of[i] * round_ns, 0, i) for i in range(N)]
            at_ns, kind, what = min([*slots, *coming], key=lambda event: event[:2])
            until_ns = min(at_ns, instant_ns)
            for i, agent in enumerate(agents):
                u = K * sum(held[j, i] - held[i, i] for j, receiver in edges if receiver == i)
                x[i], _ = stepped(agent.A, agent.B, agent.C, 0.0, u, x[i], (until_ns - now_ns) * 1e-9)
            now_ns = until_ns
            if at_ns > instant_ns:
                break
            if kind == 0:
                y = (agents[what].C @ x[what])[0]
                coming += [(at_ns + delay_ns, 1, (user, y)) for user, delay_ns in users_ns.items() if user[0] == what]
                k_of[what] += 1
            else:
                coming.remove((at_ns, kind, what))
                held[what[0]] = what[1]
        rows.append([(agent.C @ state)[0] for agent, state in zip(agents, x, strict=True)])
    return np.array(rows)
