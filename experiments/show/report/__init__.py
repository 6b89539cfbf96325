"""Makes the report of a run, a page that opens offline, and a picture, from the run folder alone."""
