"""Hybrid automata as data (Chapter 2, Definitions 1 to 4), and a check of recorded executions against them.

    program --declares--> Automaton        program --Modes.change--> events `mode`        records --check--> refusals

A program declares its automaton by a static method `automaton(settings, team)`, and records each change of its mode
with `Modes`. A run judges the recorded executions of all such programs as a guarantee of kind `execution`.
"""
