"""Ordinary blocking code as the program of a node, in virtual time.

    def main():                             # a function is a blocking program, a class is a board's program
        with can.Bus(interface="marconet", channel="can0") as bus:
            while True:
                message = bus.recv(0.1)     # 0.1 s of the node's clock, not of the wall's
                time.sleep(0.01)

Each thread of such a program is an OS thread that runs only while the node resumes it. A call that blocks suspends the
thread, and returns when the node's SimPy environment has reached the instant or event that the call waits for. So
exactly one thread runs at any time, no virtual time passes while it computes (but see `calls_in_a_row.py`), and the
instant that it waits for is on the node's agenda like any program's timer and makes the node's promise.

Threads rather than greenlets: nothing has to be installed, data per thread (`threading.local`, a debugger's view) stays
right, and a thread that the program starts is handled alike. Each blocking call costs a switch of threads, some 10 us.

The standard library's time is replaced (`library_time.py`) for the threads of such programs only. So several of them
can share a process, on the host `inline`, with the result that they have in processes of their own.
"""
