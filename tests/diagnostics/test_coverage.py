import numpy as np
import torch

from irl.core.rng import torch_stream
from irl.core.types import Transitions
from irl.diagnostics.coverage import coverage


def batch(n: int, name: str, offset: float = 0.0) -> Transitions:
    obs, action = (torch.randn(n, 3, generator=torch_stream(0, f"{name} {part}")) for part in "oa")
    flags = torch.zeros(n, dtype=torch.bool)
    return Transitions(10 * obs + offset, action, obs, flags, flags)


def test_steps_like_the_probes_are_inside_and_others_are_not() -> None:
    probe = coverage(batch(900, "probe"))
    assert probe.outside(batch(900, "like it")) < 0.05
    assert probe.outside(batch(900, "elsewhere", offset=80.0)) > 0.95


def test_a_probe_of_few_steps_covers_what_nobody_knows() -> None:
    assert np.isnan(coverage(batch(5, "few")).outside(batch(9, "new")))
