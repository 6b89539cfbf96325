"""The report of a run: one page that opens offline, and one picture, both made from the run folder alone."""
