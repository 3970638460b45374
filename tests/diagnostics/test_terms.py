"""Weights of terms in rewards that are made of them, and what is said where they cannot be known."""

import math
from dataclasses import replace

import numpy as np
import pytest

from irl.core.types import Episode
from irl.diagnostics.regression import condition, grams, r2, shapley, solve, unexplained
from irl.diagnostics.shaping import design, moments, potential_parts
from irl.diagnostics.terms import Attribution, attribute

GAMMA, SCALE = 0.99, 0.37


def episode(seed: int, steps: int = 150, ends: bool = True) -> Episode:
    """A walk of two numbers; pays forward, a bonus for not falling, and a little for effort."""
    rng = np.random.default_rng(seed)
    obs = np.cumsum(rng.normal(size=(steps + 1, 2)), 0) * 0.1
    action = rng.uniform(-1.0, 1.0, (steps, 1)).astype(np.float32)
    terminated = ends and seed % 2 == 0
    survive = np.ones(steps)
    survive[-1] = 0.0 if terminated else 1.0
    forward = np.sin(3.0 * obs[1:, 0]) + rng.normal(size=steps)
    terms = {"forward": forward, "survive": survive, "ctrl": -1e-3 * action[:, 0].astype(float) ** 2}
    reward = forward + survive + terms["ctrl"]
    return Episode(obs, action, reward, terminated, not terminated, terms, {}, seed)


EPISODES = [episode(seed) for seed in range(24)]


def shaped(of: Episode, gamma: float = GAMMA, constant: float = 0.0) -> np.ndarray:
    """What a quadratic potential adds to each step, and one that is a constant."""
    potential = 2.0 * of.obs[:, 0] - of.obs[:, 1] ** 2 + constant
    after = gamma * potential[1:]
    if of.terminated:
        after[-1] = 0.0
    return after - potential[:-1]


def found(learned: list[np.ndarray], episodes: list[Episode] = EPISODES) -> Attribution:
    stratum = np.zeros(len(episodes), dtype=int)
    rng = np.random.default_rng(0)
    return attribute(episodes, learned, stratum=stratum, gamma=GAMMA, rng=rng, redraws=100)


def noisy(seed: int = 5, size: float = 0.3) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [SCALE * e.reward + shaped(e) + 0.5 + size * rng.normal(size=len(e)) for e in EPISODES]


def test_the_weights_of_a_scaled_shaped_and_noisy_truth_are_within_their_intervals() -> None:
    result = found(noisy())
    forward = result.terms["forward"]
    assert forward.low < SCALE < forward.high
    assert forward.high - forward.low < 0.1
    assert forward.why_not is None
    assert 0.5 < result.explained < 1.0


def test_without_taking_the_potential_off_it_would_be_booked_on_the_terms() -> None:
    learned = [SCALE * e.reward + 5.0 * shaped(e) for e in EPISODES]
    x = [np.column_stack([np.ones(len(e)), *e.terms.values()]) for e in EPISODES]
    naive = np.linalg.lstsq(np.concatenate(x), np.concatenate(learned), rcond=None)[0]
    assert abs(naive[1] - SCALE) > 0.02
    assert found(learned).terms["forward"].weight == pytest.approx(SCALE, abs=0.02)


def test_shares_add_up_to_what_is_explained() -> None:
    result = found(noisy())
    total = sum(term.share for term in result.terms.values()) + result.shaping
    assert total == pytest.approx(result.explained, abs=1e-9)
    plain = found([e.terms["forward"] for e in EPISODES])
    assert plain.explained == pytest.approx(1.0, abs=1e-3)
    assert plain.terms["forward"].share > 0.8
    assert plain.terms["forward"].standardised == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("constant", [0.0, 3.0, -40.0])
@pytest.mark.parametrize("offset", [0.0, 0.5])
def test_the_survival_bonus_is_the_same_whatever_the_constant_potential(
    constant: float, offset: float
) -> None:
    learned = [SCALE * e.reward + offset + shaped(e, constant=constant) for e in EPISODES]
    result = found(learned)
    assert result.survival_bonus == pytest.approx(SCALE + GAMMA * offset, abs=0.02)
    assert result.terms["survive"].why_not is not None
    assert "survival bonus" in result.terms["survive"].why_not
    if constant:
        assert abs(result.terms["survive"].weight - SCALE) > 1.0


def test_where_no_episode_ends_a_bonus_for_surviving_cannot_be_known() -> None:
    episodes = [episode(seed, ends=False) for seed in range(10)]
    result = found([SCALE * e.reward for e in episodes], episodes)
    assert math.isnan(result.survival_bonus)
    assert math.isnan(result.terms["survive"].weight)
    assert result.terms["survive"].why_not == "it is 1 on every step here"
    assert result.terms["forward"].weight == pytest.approx(SCALE, abs=1e-3)


def test_a_term_too_small_to_matter_and_one_that_others_say_are_given_no_weight_to_believe() -> None:
    result = found(noisy())
    assert result.terms["ctrl"].variance_share < 1e-5
    assert "of the hand-written reward's variance here" in (result.terms["ctrl"].why_not or "")
    twins = [replace(e, terms={**e.terms, "again": 2.0 * e.terms["forward"]}) for e in EPISODES]
    twice = found(noisy(), twins)
    for name in ("forward", "again"):
        assert "say almost all of it" in (twice.terms[name].why_not or "")
        assert twice.terms[name].inflation > 100.0
    assert twice.condition > 1e6 > 10.0 > result.condition >= 1.0


def test_a_reward_of_something_else_is_not_explained() -> None:
    rng = np.random.default_rng(1)
    assert found([rng.normal(size=len(e)) for e in EPISODES]).explained < 0.02
    hidden = [np.cos(40.0 * e.obs[1:, 1]) + 0.1 * e.terms["forward"] for e in EPISODES]
    assert found(hidden).explained < 0.2


def test_the_same_generator_gives_the_same_intervals() -> None:
    assert found(noisy()) == found(noisy())


def test_episodes_are_drawn_again_within_their_stratum() -> None:
    """Alike within each, so every resample is the whole again, whatever lies between the strata."""
    episodes = [EPISODES[0]] * 6 + [EPISODES[1]] * 6
    stratum, slopes = np.repeat([0, 1], 6), np.repeat([1.0, 0.1], 6)
    learned = [slope * e.terms["forward"] for slope, e in zip(slopes, episodes, strict=True)]
    rng = np.random.default_rng(0)
    forward = attribute(episodes, learned, stratum=stratum, gamma=GAMMA, rng=rng).terms["forward"]
    assert 0.2 < forward.weight < 0.9
    assert forward.low == pytest.approx(forward.weight, abs=1e-9)
    assert forward.high == pytest.approx(forward.weight, abs=1e-9)
    at_once = attribute(episodes, learned, stratum=0 * stratum, gamma=GAMMA, rng=rng).terms["forward"]
    assert at_once.high - at_once.low > 0.1


def test_what_it_cannot_do_is_said() -> None:
    learned = [e.reward for e in EPISODES]
    rng = np.random.default_rng(0)
    for episodes, rewards, message in (
        (EPISODES[:1], learned[:1], "two episodes or more"),
        (EPISODES, [r[:-1] for r in learned], "a learned reward for each step"),
        (EPISODES, [r * np.nan for r in learned], "not finite"),
        ([replace(e, terms={}) for e in EPISODES], learned, "no term"),
        (EPISODES, [np.full(len(r), 0.1) for r in learned], "reward is constant"),
        (
            [replace(e, terms={n: v * np.nan for n, v in e.terms.items()}) for e in EPISODES],
            learned,
            "terms are not",
        ),
    ):
        with pytest.raises(ValueError, match=message):
            attribute(episodes, rewards, stratum=np.zeros(len(episodes), int), gamma=GAMMA, rng=rng)
    with pytest.raises(ValueError, match="stratum of each episode: 3 != 24"):
        attribute(EPISODES, learned, stratum=np.zeros(3, int), gamma=GAMMA, rng=rng)


def test_the_fit_from_grams_is_least_squares_on_the_steps() -> None:
    mean, std = moments(EPISODES)
    x = [design(e, ["forward", "survive"], GAMMA, mean, std) for e in EPISODES]
    y = noisy()
    of_episodes = grams(x, y)
    columns = range(x[0].shape[1])
    slow = np.linalg.lstsq(np.concatenate(x), np.concatenate(y), rcond=None)[0]
    fast = solve(of_episodes.sum(0), columns, [], 0.0)
    np.testing.assert_allclose(fast, slow, rtol=1e-6, atol=1e-9)
    assert np.abs(solve(of_episodes.sum(0), columns, range(3, 7), 1e3)[3:]).max() < np.abs(slow[3:]).max()
    # held out: fold by fold on the steps
    error = spread = 0.0
    for fold in range(5):
        inside = [i for i in range(len(x)) if i % 5 != fold]
        b = np.linalg.lstsq(
            np.concatenate([x[i] for i in inside]), np.concatenate([y[i] for i in inside]), rcond=None
        )[0]
        center = np.mean(np.concatenate([y[i] for i in inside]))
        for i in range(fold, len(x), 5):
            error += float(((y[i] - x[i] @ b) ** 2).sum())
            spread += float(((y[i] - center) ** 2).sum())
    assert r2(of_episodes, columns, [], 0.0) == pytest.approx(1.0 - error / spread, rel=1e-6)


def test_inflation_and_condition_are_those_of_a_slow_oracle() -> None:
    rng = np.random.default_rng(0)
    x = np.column_stack([np.ones(500), rng.normal(size=(500, 3))])
    x[:, 2] += x[:, 1]
    gram = grams([x], [x @ np.ones(4)])[0]
    left = x[:, 2] - x[:, [0, 1, 3]] @ np.linalg.lstsq(x[:, [0, 1, 3]], x[:, 2], rcond=None)[0]
    assert unexplained(gram, 2, [0, 1, 3]) == pytest.approx(left.var() / x[:, 2].var(), rel=1e-6)
    centred = x[:, 1:3] - x[:, [0, 3]] @ np.linalg.lstsq(x[:, [0, 3]], x[:, 1:3], rcond=None)[0]
    correlations = np.corrcoef(centred.T)
    assert condition(gram, 2, [3]) == pytest.approx(np.linalg.cond(correlations), rel=1e-3)


def test_shapley_is_fair_between_twins_and_gives_nothing_to_a_dummy() -> None:
    rng = np.random.default_rng(0)
    x = [np.column_stack([np.ones(200), rng.normal(size=(200, 3))]) for _ in range(10)]
    y = [of_one[:, 1] + of_one[:, 2] for of_one in x]
    shares, explained = shapley(grams(x, y), 2, [3], 0.0)
    assert explained == pytest.approx(1.0, abs=1e-6)
    assert shares[2] == pytest.approx(0.0, abs=0.01)
    assert shares[0] == pytest.approx(shares[1], abs=0.1)


def test_a_potential_has_squares_only_where_there_are_few_numbers() -> None:
    few, many = np.zeros((4, 3)), np.zeros((4, 100))
    assert potential_parts(few, few[0], few[0] + 1).shape == (4, 6)
    assert potential_parts(many, many[0], many[0] + 1).shape == (4, 100)
