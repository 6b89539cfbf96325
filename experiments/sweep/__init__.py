"""Campaigns: a scenario with varied keys and many seeds goes in; a folder of figures, hashes and a report comes out.

    --vary, --seeds --plan--> points --workers, cluster--> figures --journal--> runs.parquet --> report, worst runs

`workers.Workers.evaluate` and `cluster.Cluster.evaluate` take points (number, values to set, seed) and yield the
figures of each as its run ends; `campaign.sweep` is the whole.
"""
