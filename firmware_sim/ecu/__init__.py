"""Control units whose program is an FMU with a bus terminal: FMI-LS-BUS 1.0 for CAN, low cut."""
