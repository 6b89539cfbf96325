"""Running. In: a loaded scenario. Out: the folder of its records, and the `Summary` of the run."""
