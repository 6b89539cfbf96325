"""Runs scenarios: in comes a loaded scenario, out come the folder of records and the `Summary` of the run."""
