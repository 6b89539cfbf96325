"""Robots that an operator drives over a packet network: commands one way, images and status the other.

    stream.py       a program that sends datagrams of one size at a fixed period, and counts what it hears
"""
