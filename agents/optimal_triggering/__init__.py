"""Optimal self-triggering (Chapter 5): how long to hold a command when looking costs energy and holding costs tracking.

    J = sum over looks k of  D(t_k) [ integral over [t_k, t_k+1] of x'Qx + u'Ru dt  +  S ],      t_k+1 = t_k + tau(x_k)

A pure library on arrays: no network, no scenario, no clock. `formulation` has the three weights D; `held_loop` the flow
and the running cost between two looks; `decision_model` tabulates them over the points of an averager; value iteration,
policy iteration and the semi-Markov solver work on that table; `rollouts` measures what a policy costs. Costs are
reported from rollouts, never from the value function.

With noise a look shows y^ = x + nu, and u is computed from y^, so the state of the decision problem is (x, y^) or the
belief. The tables have x alone as their state, average over nu in u, and are asked at y^ or x^ as if that were x: V(x^)
of section 5.2.5 is certainty equivalence.

Differs from the dissertation: its value function V depends on omega^_p too; here each omega^_p has a table of its own.
"""
