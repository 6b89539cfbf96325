"""Messages, keys and errors that pass between the emulator and a node, and the instants that both name."""
