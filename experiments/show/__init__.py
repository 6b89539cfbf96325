"""Shows a scenario or a judged run as text, tables, JSON, JUnit XML and the report."""
