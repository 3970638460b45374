"""What critics say: the quantile loss against the definition, its gradient against autograd."""

import pytest
import torch
from torch import Tensor

from irl.learners.heads import Head, Lowest, Quantiles

N, B, K = 2, 5, 4


def drawn(*shape: int, seed: int = 0, scale: float = 1.0) -> Tensor:
    rng = torch.Generator().manual_seed(seed)
    return scale * torch.randn(*shape, generator=rng, dtype=torch.float64)


HEADS: list[Head] = [Lowest(), Quantiles(K, 1), Quantiles(K, 0)]


@pytest.mark.parametrize("head", HEADS)
def test_gradients_are_autograds(head: Head) -> None:
    said = drawn(N, B, head.outputs, scale=2.0).requires_grad_()
    target = head.ahead(drawn(N, B, head.outputs, seed=1, scale=2.0))
    (expected,) = torch.autograd.grad(head.loss(said, target), said)
    torch.testing.assert_close(head.of_loss(said.detach(), target), expected)
    shares = drawn(B, seed=2).abs()
    (expected,) = torch.autograd.grad(-(shares * head.value(said)).sum(), said)
    torch.testing.assert_close(head.of_value(said.detach(), shares), expected)


def test_the_quantile_loss_is_its_definition() -> None:
    head = Quantiles(K, 1)
    said, target = drawn(N, B, K, scale=2.0), drawn(3, B, seed=1, scale=2.0)
    terms = []
    for i in range(N):
        for b in range(B):
            for k in range(K):
                for m in range(3):
                    d = float(target[m, b] - said[i, b, k])
                    huber = 0.5 * d * d if abs(d) <= 1 else abs(d) - 0.5
                    terms.append(abs((k + 0.5) / K - (d < 0)) * huber)
    assert float(head.loss(said, target)) == pytest.approx(sum(terms) / len(terms))


def test_the_highest_atoms_of_all_critics_together_are_left_out() -> None:
    said = torch.tensor([[[1.0, 2.0, 9.0]], [[3.0, 8.0, 7.0]]])
    assert Quantiles(3, 1).ahead(said).flatten().tolist() == [1.0, 2.0, 3.0, 7.0]
    assert Quantiles(3, 0).ahead(said).flatten().tolist() == [1.0, 2.0, 3.0, 7.0, 8.0, 9.0]


def test_atoms_learn_the_quantiles_of_what_they_are_shown() -> None:
    """Levels .125, .375, .625, .875 of a uniform on [0, 400], where Huber's bend at 1 is nothing."""
    head, said = Quantiles(4, 0), torch.full((1, 1, 4), 200.0, dtype=torch.float64)
    target = torch.linspace(0, 400, 401, dtype=torch.float64).unsqueeze(1)
    for _ in range(1000):
        said -= 100.0 * head.of_loss(said, target)
    expected = 400.0 * torch.tensor([0.125, 0.375, 0.625, 0.875]).double()
    torch.testing.assert_close(said.flatten(), expected, atol=1.0, rtol=0)


def test_the_lowest_of_two_is_pessimistic() -> None:
    said = torch.tensor([[[1.0], [5.0]], [[2.0], [4.0]]])
    assert Lowest().value(said).tolist() == [1.0, 4.0]
    assert Lowest().ahead(said).tolist() == [[1.0, 4.0]]
