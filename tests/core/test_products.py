import pytest
import torch

from irl.core import products


@pytest.mark.parametrize("name", products.INSTRUCTIONS)
def test_bfloat16_only_where_the_processor_multiplies_it(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torch.cpu, "get_capabilities", lambda: {"avx2": True, name: True})
    assert products.fastest() == "bfloat16"
    monkeypatch.setattr(torch.cpu, "get_capabilities", lambda: {"avx2": True, name: False})
    assert products.fastest() == "float32"
    monkeypatch.setattr(torch.cpu, "get_capabilities", lambda: {"neon": True})
    assert products.fastest() == "float32"
