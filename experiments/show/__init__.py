"""Presentation. In: a scenario or a judged run. Out: text, tables, JSON, JUnit XML and the report."""
