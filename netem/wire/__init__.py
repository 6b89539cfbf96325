"""What the emulator and a node say to each other: messages, keys, errors, and the instants that both name."""
