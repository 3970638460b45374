"""Sampled EPIC and DARD against what they sample: tables, and an integral on a small continuous task."""

import numpy as np
import torch

from irl.core.rng import stream, torch_stream
from irl.core.types import Transitions
from irl.diagnostics import dard, epic, tabular
from irl.diagnostics.distance import pearson_distance
from tests.diagnostics.mdps import GAMMA, of_table


def steps(obs: torch.Tensor, action: torch.Tensor, next_obs: torch.Tensor) -> Transitions:
    flags = torch.zeros(len(obs), dtype=torch.bool)
    return Transitions(obs, action, next_obs, flags, flags)


def mesh(states: int, actions: int) -> Transitions:
    s, a, u = np.meshgrid(np.arange(states), np.arange(actions), np.arange(states), indexing="ij")
    one, choice = torch.eye(states), torch.eye(actions)
    return steps(one[s.ravel()], choice[a.ravel()], one[u.ravel()])


def test_over_a_whole_mesh_it_is_the_tables() -> None:
    reward = stream(0, "reward").normal(size=(4, 3, 4))
    every = mesh(4, 3)
    # each state with each action once: the distributions are uniform
    pairs = steps(torch.eye(4).repeat(3, 1), torch.eye(3).repeat_interleave(4, 0), torch.eye(4).repeat(3, 1))
    found = epic.canonical(of_table(reward), every, pairs, GAMMA)
    expected = tabular.epic(reward, np.full(4, 0.25), np.full(3, 1 / 3), GAMMA)
    np.testing.assert_allclose(found, expected.ravel(), atol=1e-12)


def test_over_every_action_dard_is_the_tables() -> None:
    reward = stream(1, "reward").normal(size=(4, 3, 4))
    after = stream(1, "after").integers(4, size=(4, 3))
    found = dard.canonical(
        of_table(reward),
        mesh(4, 3),
        torch.eye(3),
        lambda s, a: torch.eye(4)[after[s.argmax(1), a.argmax(1)]],
        GAMMA,
    )
    expected = tabular.dard(reward, np.eye(4)[after], np.full(3, 1 / 3), GAMMA)
    np.testing.assert_allclose(found, expected.ravel(), atol=1e-12)


def first(batch: Transitions) -> torch.Tensor:
    s, a, u = (x[:, 0].double() for x in (batch.obs, batch.action, batch.next_obs))
    return s * a + u.square()


def second(batch: Transitions) -> torch.Tensor:
    s, a, u = (x[:, 0].double() for x in (batch.obs, batch.action, batch.next_obs))
    return (3 * s).sin() + a * u


def test_on_a_continuous_task_it_nears_the_integral() -> None:
    # s, a and s' uniform on [0, 1]: integrals over a grid of midpoints
    grid = (torch.arange(24) + 0.5) / 24
    s, a, u = (x.reshape(-1, 1) for x in torch.meshgrid(grid, grid, grid, indexing="ij"))
    left = {}
    for name, reward in (("first", first), ("second", second)):
        table = reward(steps(s, a, u)).reshape(24, 24, 24).numpy()
        left[name] = tabular.epic(table, np.full(24, 1 / 24), np.full(24, 1 / 24), 0.9).ravel()
    exact = pearson_distance(left["first"], left["second"])

    def spread(name: str) -> torch.Tensor:
        # one number in each of 600 parts of [0, 1], in any order: little noise in the means
        order = torch.randperm(600, generator=torch_stream(0, name))
        return (order[:, None] + 0.5) / 600

    batch = steps(spread("s"), spread("a"), spread("u"))
    pairs = steps(spread("other s"), spread("other a"), spread("other s"))
    found = [epic.canonical(reward, batch, pairs, 0.9) for reward in (first, second)]
    assert abs(pearson_distance(found[0], found[1]) - exact) < 0.02
    assert 0.1 < exact < 0.9


def test_potentials_go_exactly_however_few_the_samples() -> None:
    def shaped(batch: Transitions) -> torch.Tensor:
        phi = lambda x: 20 * (7 * x[:, 0].double()).sin()  # noqa: E731
        return first(batch) + 0.9 * phi(batch.next_obs) - phi(batch.obs)

    batch = steps(*(torch.rand(50, 1, generator=torch_stream(1, f"draw {i}")) for i in range(3)))
    pairs = steps(*(torch.rand(4, 1, generator=torch_stream(1, f"sample {i}")) for i in range(3)))
    own, other = (epic.canonical(reward, batch, pairs, 0.9) for reward in (first, shaped))
    np.testing.assert_allclose(own, other, atol=1e-9)
    linear = lambda s, a: 0.5 * s + a  # noqa: E731
    own, other = (dard.canonical(reward, batch, pairs.action, linear, 0.9) for reward in (first, shaped))
    np.testing.assert_allclose(own, other, atol=1e-9)
