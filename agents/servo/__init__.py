"""Servos whose loops close over a bus: sensor, controller and actuator of each are nodes of their own.

    sensor.py       sends what the sensing medium detects
    controller.py   computes the command from each measurement, by the law of `pd.py`
    motor.py        owns the plant, and sets its input as commanded
    messages.py     the frames between them
    tracking_error.py   derived signals

Source: A. Cervin, D. Henriksson, B. Lincoln, J. Eker, K.-E. Arzen, "How does control timing affect performance?", IEEE
Control Systems Magazine 23(3), 2003, and the example `networked` of TrueTime.
"""
