"""Shows a scenario or a judged run: in come their data, out come text, tables, JSON, JUnit XML and the report."""
