import copy

import pytest
import torch

from irl.core import adam


@pytest.mark.parametrize("fused", [True, False])
@pytest.mark.parametrize("weight_decay", [0.0, 0.1])
@pytest.mark.parametrize("sizes", [(1000,), (600, 7, 2)])
def test_the_step_is_torchs_to_the_bit_and_so_is_what_is_saved(
    fused: bool, weight_decay: float, sizes: tuple[int, ...]
) -> None:
    rng = torch.Generator().manual_seed(0)
    ours, theirs = ([torch.ones(size).requires_grad_() for size in sizes] for _ in range(2))
    settings = {"fused": fused, "weight_decay": weight_decay}
    fast, slow = torch.optim.Adam(ours, **settings), torch.optim.Adam(theirs, **settings)
    for i in range(20):
        if i == 10:
            fast.load_state_dict(copy.deepcopy(slow.state_dict()))
        for optimizer in (fast, slow):
            optimizer.param_groups[0]["lr"] = 1e-2 / (i + 1)
        for mine, its in zip(ours, theirs, strict=True):
            mine.grad = torch.randn(len(mine), generator=rng) * 10.0 ** (i % 5 - 3)
            its.grad = mine.grad.clone()
        with torch.no_grad():
            adam.step(fast)
        slow.step()
        assert all(map(torch.equal, ours, theirs))
    for mine, its in zip(ours, theirs, strict=True):
        for one, other in zip(fast.state[mine].values(), slow.state[its].values(), strict=True):
            assert torch.equal(one, other)
