"""From the name of a program to its class or function: modules beside a scenario, folders of firmware in C, .elf files.

A robot's process imports this room, and of `experiments` otherwise only what builds its node.
"""
