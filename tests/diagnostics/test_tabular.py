"""Canonical rewards of finite MDPs: against loops, by their algebra, and against regret."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from irl.core.rng import stream
from irl.core.statistics import spearman
from irl.diagnostics import tabular
from irl.diagnostics.distance import pearson_distance
from tests.diagnostics.mdps import GAMMA, dynamics, optimal, shaped

S, A = 5, 3


def mdp(seed: int):
    rng = stream(seed, "mdp")
    t = dynamics(rng, S, A)
    return rng, t, rng.dirichlet(np.ones(S)), rng.dirichlet(np.ones(A))


def canonicals(seed: int):
    _, t, states, actions = mdp(seed)
    policy = np.broadcast_to(actions, (S, A)).copy()
    return {
        "epic": lambda r: tabular.epic(r, states, actions, GAMMA),
        "dard": lambda r: tabular.dard(r, t, actions, GAMMA),
        "val": lambda r: tabular.val(r, t, policy, GAMMA),
    }


def test_epic_is_what_a_triple_loop_says() -> None:
    rng, _, states, actions = mdp(0)
    r = rng.normal(size=(S, A, S))

    def mean(x: int) -> float:
        return sum(actions[a] * states[u] * r[x, a, u] for a in range(A) for u in range(S))

    everywhere = sum(states[x] * mean(x) for x in range(S))
    expected = np.zeros_like(r)
    for s, a, u in itertools.product(range(S), range(A), range(S)):
        expected[s, a, u] = r[s, a, u] + GAMMA * mean(u) - mean(s) - GAMMA * everywhere
    np.testing.assert_allclose(tabular.epic(r, states, actions, GAMMA), expected, atol=1e-12)


def test_dard_is_what_its_loops_say() -> None:
    rng, t, _, actions = mdp(1)
    r = rng.normal(size=(S, A, S))
    expected = r.copy()
    for s, a, u in itertools.product(range(S), range(A), range(S)):
        for b, x, y in itertools.product(range(A), range(S), range(S)):
            # x follows s, y follows u, under one action b
            chance = actions[b] * t[s, b, x] * t[u, b, y]
            expected[s, a, u] += chance * (GAMMA * r[u, b, y] - r[s, b, x] - GAMMA * r[x, b, y])
    np.testing.assert_allclose(tabular.dard(r, t, actions, GAMMA), expected, atol=1e-12)


def test_val_is_the_advantage_under_the_policy() -> None:
    rng, t, _, actions = mdp(2)
    r = rng.normal(size=(S, A, S))
    policy = np.broadcast_to(actions, (S, A)).copy()
    left = tabular.val(r, t, policy, GAMMA)
    value = np.zeros(S)
    for _ in range(600):
        value = np.einsum("sa,sat,sat->s", policy, t, r + GAMMA * value)
    expected = np.einsum("sat,sat->sa", t, r + GAMMA * value) - value[:, None]
    np.testing.assert_allclose(left, np.repeat(expected[:, :, None], S, 2), atol=1e-10)
    assert np.abs(np.sum(policy * left[:, :, 0], axis=1)).max() < 1e-12


@settings(max_examples=25)
@given(st.integers(0, 10**6), st.sampled_from(["epic", "dard", "val"]), st.floats(0.1, 50), st.floats(-9, 9))
def test_what_asks_for_the_same_has_distance_zero(seed: int, name: str, scale: float, offset: float) -> None:
    canonical, rng = canonicals(seed)[name], stream(seed, "rewards")
    r, potential = rng.normal(size=(S, A, S)), 5 * rng.normal(size=S)
    other = scale * shaped(r, potential) + offset
    assert pearson_distance(canonical(r).ravel(), canonical(other).ravel()) < 1e-6
    assert pearson_distance(canonical(r).ravel(), canonical(-r).ravel()) == pytest.approx(1.0, abs=1e-9)


@settings(max_examples=25)
@given(st.integers(0, 10**6), st.sampled_from(["epic", "dard", "val"]))
def test_it_is_a_distance(seed: int, name: str) -> None:
    canonical, rng = canonicals(seed)[name], stream(seed, "rewards")
    a, b, c = (canonical(rng.normal(size=(S, A, S))).ravel() for _ in range(3))
    assert pearson_distance(a, a) == 0
    assert pearson_distance(a, b) == pytest.approx(pearson_distance(b, a), abs=1e-12)
    assert 0 <= pearson_distance(a, b) <= 1
    assert pearson_distance(a, c) <= pearson_distance(a, b) + pearson_distance(b, c) + 1e-12


def test_val_does_not_see_where_the_reward_lies_among_next_states_and_epic_does() -> None:
    rng, t, states, actions = mdp(3)
    r, noise = rng.normal(size=(2, S, A, S))
    # the same expected reward of every (s, a)
    other = r + noise - np.einsum("sat,sat->sa", t, noise)[:, :, None]
    policy = np.broadcast_to(actions, (S, A)).copy()
    val = [tabular.val(x, t, policy, GAMMA).ravel() for x in (r, other)]
    epic = [tabular.epic(x, states, actions, GAMMA).ravel() for x in (r, other)]
    assert pearson_distance(val[0], val[1]) < 1e-7
    assert pearson_distance(epic[0], epic[1]) > 0.1


def test_starc_is_twice_the_pearson_distance_of_centred_rewards() -> None:
    a, b = stream(4, "starc").normal(size=(2, 60))
    a, b = a - a.mean(), b - b.mean()
    assert tabular.starc(a, b) == pytest.approx(2 * pearson_distance(a, b))
    assert np.isnan(tabular.starc(a, 0 * b))


def test_the_distance_goes_with_regret_at_least_as_well_as_epics() -> None:
    found = {"val": [], "epic": [], "raw": []}
    regrets = []
    uniform = np.full((32, 4), 0.25)
    for seed in range(24):
        rng = stream(seed, "regret")
        t = dynamics(rng, 32, 4, sharp=0.1)
        r = rng.normal(size=(32, 4, 32))
        mixed = rng.uniform()
        other = (1 - mixed) * r + mixed * rng.normal(size=r.shape)
        other = shaped(other, rng.uniform(0, 3) * rng.normal(size=32))
        regrets.append(_regret(r, other, t))
        left = {
            "val": lambda x, t=t: tabular.val(x, t, uniform, GAMMA),
            "epic": lambda x: tabular.epic(x, np.full(32, 1 / 32), np.full(4, 0.25), GAMMA),
            "raw": lambda x: x,
        }
        for name, canonical in left.items():
            found[name].append(pearson_distance(canonical(r).ravel(), canonical(other).ravel()))
    rank = {name: spearman(np.array(values), np.array(regrets)) for name, values in found.items()}
    assert rank["val"] >= rank["epic"]
    assert rank["val"] >= rank["raw"]
    assert rank["val"] > 0.8


def _regret(truth: np.ndarray, learned: np.ndarray, t: np.ndarray) -> float:
    expected = np.einsum("sat,sat->sa", truth, t)

    def worth(policy: np.ndarray) -> float:
        return float(np.mean(tabular.values(expected, t, policy, GAMMA)))

    best, worst = worth(optimal(truth, t)), worth(optimal(-truth, t))
    return (best - worth(optimal(learned, t))) / (best - worst)
