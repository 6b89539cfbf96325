"""The emulator's inner loops as C: mypyc translates the modules of `modules.MODULES`, unchanged, to extension modules.

    sources --marconet compile--> cache, under a name made from their content --import experiments--> used instead

Invariants:
- what is used was made from the sources that are there: after any change of one of them Python reads the sources again;
- all of them are used or none;
- what a program does that keeps to the types of the interface does not depend on it. One that does not (a float for a
  time, a new attribute on a board or a port) may run on the sources, and is refused compiled.

`MARCONET_COMPILED=0` in the environment turns it off: for a debugger, or to step through a program.
"""
