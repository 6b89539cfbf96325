"""Columns are those of `pyarrow.array`, and a run does without pandas."""

import subprocess
import sys
from importlib.util import find_spec
from typing import Any

import pyarrow as pa
import pytest

from netem.records.columns import NAME, column_of


@pytest.mark.parametrize(("kind", "values"), [
    (NAME, ["can", "air", "can", "", "größer"]),
    (pa.int64(), [0, -1, 2**63 - 1, -2**63]),
    (pa.bool_(), [True, False, False, True, True, False, True, False, True]),
    (pa.string(), ["", "größer", "a\0b"]),
    (pa.binary(), [b"", b"\0\xff", b"abc"]),
])
def test_a_column_is_the_one_of_arrow(kind: pa.DataType, values: list[Any]) -> None:
    for some in (values, values[:1], []):
        column = column_of(kind, some)
        column.validate(full=True)
        plain = pa.array(some, kind.value_type).dictionary_encode() if kind == NAME else pa.array(some, kind)
        assert column.equals(plain)


@pytest.mark.parametrize(("kind", "value", "error"), [
    (pa.int64(), 2**63, OverflowError), (pa.int64(), "1", TypeError), (pa.binary(), 1, TypeError),
    (pa.string(), b"text", AttributeError), (NAME, 3, AttributeError),
])
def test_a_value_of_another_type_is_refused(kind: pa.DataType, value: object, error: type[Exception]) -> None:
    with pytest.raises(error):
        column_of(kind, [value])


@pytest.mark.skipif(find_spec("pandas") is None, reason="needs pandas, which a run is not to import")
def test_a_run_with_its_report_does_not_import_pandas(tmp_path: Any) -> None:
    run = ("import sys; from marconet.command_line import main\n"
           "sys.argv = 'marconet run output_sync --duration 0.1 --host inline --quiet --out out'.split()\n"
           "try: main()\n"
           "except SystemExit: print('pandas' in sys.modules)")
    done = subprocess.run([sys.executable, "-c", run], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.stdout == "False\n", done.stderr
    assert (tmp_path / "out" / "ledger.parquet").exists()
