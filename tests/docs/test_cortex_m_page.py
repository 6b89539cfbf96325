"""The page on computing that takes time does what it says; it runs ten teams of five emulated processors."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.docs.page import follow


@pytest.mark.slow
def test_the_page_does_what_it_says(tmp_path: Path) -> None:
    for library in ("unicorn", "elftools", "ziglang"):
        pytest.importorskip(library, reason="needs the extra: pip install 'marconet[cortex-m]'")

    follow("docs/howto/computing_takes_time.md", tmp_path)
