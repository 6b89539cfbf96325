"""Ordinary blocking code as the program of a node, in virtual time.

    def main():                             # a function is a blocking program, a class is a board's program
        with can.Bus(interface="marconet", channel="can0") as bus:
            while True:
                message = bus.recv(0.1)     # 0.1 s of the node's clock, not of the wall's
                time.sleep(0.01)

Each thread of such a program is an OS thread that runs only while the node lends it the baton; a call that blocks gives
the baton back and comes home when the node's SimPy environment has come that far. So exactly one thread runs at any
time, no virtual time passes while it computes (but see `calls_in_a_row.py`), and what it waits for is on the node's
agenda as any program's timer is: it is the node's promise. Threads and not greenlets: there is nothing to install, what
the program keeps per thread (`threading.local`, a debugger's view of it) stays right, and a thread that the program
itself starts is another of the same kind. The price is the hand-over, some 10 us of the operating system for each call
that does block.

The time of the standard library is replaced in the node's process (`library_time.py`), which is why such a program
needs a process of its own: the host `inline` is refused.
"""
