"""A bake that does not fit into memory is refused, or ends in a sentence."""

import re
import sys

import pytest
from detp.core import memory
from detp.core.errors import OutOfMemoryError
from detp.core.memory import check_baking, check_reading, free_bytes, memory_errors_named


def test_what_fits_passes_and_what_does_not_is_refused_with_both_sizes():
    need = memory.READING_TRIANGLE * 1_000_000 + memory.READING_MESH * 300_000 + memory.READING_CORNER * 2_000_000
    check_reading(1_000_000, 300_000, 2_000_000, need)
    with pytest.raises(OutOfMemoryError) as refused:
        check_reading(1_000_000, 300_000, 2_000_000, need - 100_000_000)
    figures = [float(number) for number in re.findall(r"(\d+\.\d) GB", str(refused.value))]
    assert figures == pytest.approx([need / 1e9, need / 1e9 - 0.1], abs=0.051)
    need = memory.BAKING + memory.BAKING_TRIANGLE * 7 + memory.BAKING_POINT * 5_000_000
    check_baking(7, 5_000_000, need)
    with pytest.raises(OutOfMemoryError, match=r"7 triangles and 5\.0 M points"):
        check_baking(7, 5_000_000, need - 1)
    with pytest.raises(OutOfMemoryError, match=r"10\.0 M triangles and 2 workers"):
        memory.check_workers(10_000_000, 1_000_000, 0, 2, 10**9)


def test_a_machine_that_tells_nothing_refuses_nothing(monkeypatch):
    monkeypatch.setattr(memory, "free_bytes", lambda: None)
    check_baking(10**12, 10**12)


@pytest.mark.skipif(sys.platform != "linux", reason="asks Linux")
def test_the_limit_of_a_container_counts(monkeypatch, tmp_path):
    (tmp_path / "memory.max").write_text("1000000\n")
    (tmp_path / "memory.current").write_text("900000\n")
    (tmp_path / "memory.stat").write_text("anon 1\ninactive_file 50000\n")
    monkeypatch.setattr(memory, "GROUPS", tmp_path)
    assert free_bytes() == 150_000
    (tmp_path / "memory.max").write_text("max\n")
    assert free_bytes() > 1_000_000


def test_memory_errors_become_a_sentence():
    with pytest.raises(OutOfMemoryError, match="not memory enough"), memory_errors_named():
        raise MemoryError
