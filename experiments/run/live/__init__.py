"""The run's side of its live view: what is counted for it, what it may do, and the process that serves it."""
