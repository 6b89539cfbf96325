"""python-can's interface `marconet`, by which a blocking program uses the CAN buses of its node.

python-can finds it by the package's entry point `can.interface`, so a program only writes
`can.Bus(interface="marconet", channel="can0")`. `bus.py` is the bus; `other_interfaces.py` refuses other interfaces.
"""
