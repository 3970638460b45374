import torch

from irl.core.rng import torch_stream
from irl.core.types import Transitions
from irl.diagnostics.coverage import outside


def batch(n: int, name: str, offset: float = 0.0) -> Transitions:
    obs, action = (torch.randn(n, 3, generator=torch_stream(0, f"{name} {part}")) for part in "oa")
    flags = torch.zeros(n, dtype=torch.bool)
    return Transitions(10 * obs + offset, action, obs, flags, flags)


def test_steps_like_the_probes_are_inside_and_others_are_not() -> None:
    probe = batch(900, "probe")
    assert outside(probe, batch(900, "like it")) < 0.05
    assert outside(probe, batch(900, "elsewhere", offset=80.0)) > 0.95
