"""Search: a scenario and a budget go in, the worst pattern within it comes out; a run goes in, its smallest cause.

    break    scenario, budget, cost --candidates--> runs --costs--> the next candidates ... the worst --> a scenario
    shrink   folder of a run that fails --explicit faults and losses--> runs --> a scenario with the few that matter

`falsify.falsify` and `shrink.shrink` are the whole of each. Both evaluate runs with `experiments.sweep.workers.Workers`
and leave a scenario file that `marconet run` repeats.
"""
