"""gdb on the emulated Cortex-M: a stub of gdb's remote serial protocol, and a machine that obeys it.

    gdb <--TCP, loopback--> wire.py --packets--> commands.py --> target.py: registers, memory, breakpoints
                                       `--c, s, bs, bc, D, k--> machine.py: runs, steps --> history.py: goes back

The driver and the programs see a `Machine` whose `run` takes long; while the program stands still, so do virtual time
and the run's time-outs. Without writes by the debugger the run is the one that it would be without it.

Source: "Debugging with GDB", appendix E (Remote Protocol) and appendix G (Target Descriptions).
Not there: watchpoints in the machine (gdb steps instead, slowly), non-stop mode, writes to flash and to devices.
"""
