"""Made parts of a document: put in their place, and nothing else touched."""

from pathlib import Path

import pytest

from irl.bench.written import marks, read_part, with_part, write_part
from irl.core.errors import UserError


def test_a_part_goes_to_the_end_and_from_then_on_into_its_place(tmp_path: Path) -> None:
    path = tmp_path / "RESULTS.md"
    path.write_text("# Results\n\nby hand\n")
    assert not write_part(path, "core", "one", begin=False)
    assert write_part(path, "core", "one\n", begin=True)
    path.write_text(path.read_text() + "\nafter\n")
    assert write_part(path, "core", "| two |\n", begin=False)
    assert read_part(path.read_text(), "core") == "| two |\n"
    begin, end = marks("core")
    assert path.read_text() == f"# Results\n\nby hand\n\n{begin}\n\n| two |\n\n{end}\n\nafter\n"
    assert read_part(with_part(path.read_text(), "peer", "three"), "core") == "| two |\n"


def test_half_a_mark_is_refused() -> None:
    with pytest.raises(UserError, match="one is missing"):
        read_part(f"text {marks('core')[0]} text", "core")
