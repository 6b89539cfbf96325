"""The face of marconet: the command line. What it calls is in `experiments`."""

import experiments  # noqa: F401  # before anything of the emulator, so that its compiled modules are found
