"""Runs a loaded scenario; the results are the folder of its records and the `Summary` of the run."""
