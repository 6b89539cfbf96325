"""An emulated microcontroller with a Cortex-M4F, on which a robot's firmware runs as it would be flashed.

    image.py    an .elf file, checked                machine.c, exceptions.c, devices.c   the processor and its devices
    sections.py what is in it                        debug.c, gdb/       gdb holds the machine
    machine.py  a machine, from Python                program.py    a machine as a program on a `Board`
    fault.py    what ended a program, in words        build.py      the machine's library, and images from C files

The processor's instructions are executed by Unicorn, which is licensed under the GPL version 2: it is an optional
extra (`pip install marconet[cortex-m]`), and only the process of a node that uses it imports it.
Not modelled: cycle accuracy, MPU, DMA; see docs/cortex_m.md.
"""
