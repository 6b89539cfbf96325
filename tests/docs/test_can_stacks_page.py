"""The page on ISO-TP, UDS and CANopen does what it says, in virtual time."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.docs.page import blocks, follow

PAGE = "docs/howto/speak_over_can.md"
GET_IT = "a stack is not installed; get them with: pip install 'marconet[clients]'"


@pytest.mark.slow
def test_the_page_does_what_it_says(tmp_path: Path) -> None:
    for library in ("isotp", "udsoncan", "canopen"):
        pytest.importorskip(library, reason=GET_IT)

    follow(PAGE, tmp_path)

    said = (tmp_path / "isotp" / "logs" / "sender.log").read_text()
    took = re.search(r"answer bytearray\(b'4000 bytes'\) after ([\d.]+) s", said)
    # 571 frames of at least 111 bits at 500 kbit/s, and one flow control for 8 of them
    assert took is not None
    assert float(took[1]) > (571 + 71) * 111 / 500_000


def test_its_programs_name_marconet_only_as_an_interface() -> None:
    programs = [block.text for block in blocks(PAGE) if block.language == "python"]

    assert len(programs) == 3
    for text in programs:
        assert set(re.findall(r".*marconet.*", text)) == {
            line for line in text.splitlines() if re.fullmatch(r"def \w+\(interface=\"marconet\".*\):", line)}
