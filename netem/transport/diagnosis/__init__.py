"""Diagnosis of a crashed or hanging process, in the same words for nodes with a process each and for inline runs.

    under_way.py    memory outside the process: the node and the FMI call whose code runs
    stack_dump.py   Python's fault handler writes the stacks of all threads there, at a crash and when asked
    stack.py        from such a dump to the user's own line
    words.py        the sentence
"""
