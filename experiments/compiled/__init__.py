"""Compiles the emulator's inner loops: mypyc translates the modules in `modules.MODULES` to C extension modules.

    sources --marconet compile--> cache, under a name made from their content --import experiments--> used instead

Invariants:
- compiled modules are used only for the sources they were made from: after a change of any source Python runs the
  sources again;
- either all compiled modules are used or none;
- a program that keeps to the types of the interface behaves in the same way. A program that does not (a float for a
  time, a new attribute on a board or a port) may run on the sources, and fails on compiled modules.

`MARCONET_COMPILED=0` in the environment selects the sources, for a debugger.
"""
