import pytest
import torch

from irl.core.finite import NotFinite, check_finite, first_bad, named

GOOD = {"a": torch.zeros(3), "n": torch.tensor([1, 2]), "empty": torch.zeros(0)}


def test_finite_tensors_pass() -> None:
    assert first_bad(GOOD) is None
    check_finite(GOOD)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf")])
def test_the_first_bad_tensor_is_named_with_how_much_of_it_is_bad(value: float) -> None:
    bad = torch.zeros(2, 3)
    bad[1, 2] = value
    with pytest.raises(NotFinite, match=r"^policy w \(1 of 6 numbers are not finite\)$"):
        check_finite({**GOOD, **named("policy", {"w": bad, "later": bad})})


def test_a_sum_that_overflows_is_no_bad_number() -> None:
    assert first_bad({"large": torch.full((10,), 3e38)}) is None
    assert first_bad({"opposite": torch.tensor([float("inf"), -float("inf")])}) is not None
