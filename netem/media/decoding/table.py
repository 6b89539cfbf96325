"""The decode rules that a scenario can name. A new one is a file and a line here."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from netem.media.decoding import Decoding
from netem.media.decoding.capture import Capture
from netem.media.decoding.local import Local
from netem.media.decoding.radio_network import RadioNetwork
from netem.media.radio_presets import RadioPreset

DECODINGS: Final[dict[str, Callable[[RadioPreset], Decoding]]] = {
    "radio_network": lambda radio: RadioNetwork(),
    "local": lambda radio: Local(),
    "capture": lambda radio: Capture(radio.capture_db),
}
