"""Shows campaigns: the report of one, and what differs between two, or between two runs."""
