"""python-can's interface `marconet`: a blocking program's way onto the CAN buses of its node.

python-can finds it by the entry point `can.interface` of the package, so a program says no more than
`can.Bus(interface="marconet", channel="can0")`. `bus.py` is the bus; `other_interfaces.py` refuses all others by name.
"""
