"""Diagnosis of a crashed or hanging process, with the same messages for the process of a node and an inline run.

    under_way.py    memory shared with the emulator: the node and the FMI call whose code runs
    stack_dump.py   Python's fault handler writes the stacks of all threads there, at a crash or on request
    stack.py        finds the user's line in such a dump
    words.py        writes the message
"""
