"""The absorbing state in data: whom it follows, what is kept of it, and what it weighs."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from irl.core.types import Episode, Transitions, concatenate, from_episodes
from irl.envs.absorbing import absorb, subsample

ends = st.lists(
    st.tuples(st.integers(1, 9), st.sampled_from(["fell", "cut", "both", "open"])), min_size=1, max_size=4
)


def episode(steps: int, end: str, start: float = 1.0) -> Episode:
    """Observations `start`, `start + 1`, ... and their doubles; none is zero."""
    count = start + np.arange(steps + 1.0)
    return Episode(
        obs=np.stack([count, 2 * count], axis=1),
        action=-count[:-1, None],
        reward=10 * count[:-1],
        terminated=end in ("fell", "both"),
        truncated=end in ("cut", "both"),
        terms={"forward": count[:-1]},
    )


def episodes(kinds: list[tuple[int, str]]) -> list[Episode]:
    return [episode(n, end, 1.0 + 100.0 * i) for i, (n, end) in enumerate(kinds)]


def columns(batch: Transitions) -> dict[str, Any]:
    flat = {name: value for name, value in vars(batch).items() if name != "terms" and value is not None}
    return flat | dict(batch.terms)


def same(a: Transitions, b: Transitions) -> bool:
    one, two = columns(a), columns(b)
    return one.keys() == two.keys() and all(torch.equal(one[name], two[name]) for name in one)


def fell(batch: Transitions) -> Transitions:
    assert batch.absorbing is not None
    assert batch.next_absorbing is not None
    return batch[batch.absorbing | batch.next_absorbing]


@given(ends)
def test_every_fall_and_nothing_else_leads_into_the_absorbing_state(kinds) -> None:
    raw = from_episodes(episodes(kinds))
    batch, n_falls = absorb(raw), sum(end in ("fell", "both") for _, end in kinds)
    steps, loops = batch[: len(raw)], batch[len(raw) :]
    assert len(loops) == n_falls
    assert not batch.terminated.any()
    assert steps.absorbing is not None
    assert steps.next_absorbing is not None
    assert torch.equal(steps.next_absorbing, raw.terminated)
    assert not steps.absorbing.any()
    # a time limit ends nothing: that step is as it was recorded
    for name in ("obs", "action", "truncated", "reward"):
        assert torch.equal(getattr(steps, name), getattr(raw, name))
    assert torch.equal(steps.next_obs[~raw.terminated], raw.next_obs[~raw.terminated])
    assert (steps.next_obs[raw.terminated] == 0).all()


def test_the_absorbing_state_leads_to_itself_by_no_action_and_no_recorded_reward() -> None:
    loop = absorb(from_episodes([episode(3, "fell")]))[3:]
    assert loop.absorbing is not None
    assert loop.next_absorbing is not None
    assert (bool(loop.absorbing), bool(loop.next_absorbing)) == (True, True)
    assert (bool(loop.terminated), bool(loop.truncated)) == (False, False)
    assert loop.reward is not None
    for value in (loop.obs, loop.action, loop.next_obs, loop.reward, loop.terms["forward"]):
        assert (value == 0).all()


@given(ends)
def test_absorbing_twice_is_absorbing_once(kinds) -> None:
    once = absorb(from_episodes(episodes(kinds)))
    assert same(absorb(once), once)


def test_a_batch_without_reward_and_terms_gets_none() -> None:
    flags = torch.tensor([False, True])
    batch = absorb(Transitions(torch.ones(2, 1), torch.ones(2, 1), torch.ones(2, 1), flags, ~flags))
    assert len(batch) == 3
    assert batch.reward is None
    assert batch.weight is None


@given(ends, st.integers(1, 5), st.integers(0, 9))
def test_all_of_the_absorbing_state_is_kept_and_weighs_one_over_the_rate(kinds, rate, seed) -> None:
    given_ = episodes(kinds)
    whole = absorb(from_episodes(given_))
    try:
        kept = subsample(given_, rate, np.random.default_rng(seed), absorbing=True)
    except ValueError:
        # every episode was shorter than its offset, and none fell
        assert rate > 1
        assert not fell(whole)
        return
    assert len(fell(kept)) == len(fell(whole))
    if not len(fell(kept)) or rate == 1:
        assert kept.weight is None
        return
    of_abs = fell(kept).weight
    assert kept.weight is not None
    assert of_abs is not None
    assert (of_abs == torch.tensor(1.0 / rate)).all()
    assert int((kept.weight == 1.0).sum()) == len(kept) - len(fell(kept))


@settings(max_examples=30)
@given(ends, st.integers(1, 5))
def test_on_average_every_step_weighs_one_over_the_rate(kinds, rate) -> None:
    given_ = episodes(kinds)
    total = torch.zeros(2, dtype=torch.float64)
    for offset in range(rate):
        try:
            kept = subsample(given_, rate, _Always(offset), absorbing=True)
        except ValueError:
            continue
        weight = torch.ones(len(kept)) if kept.weight is None else kept.weight
        total += torch.tensor([float(weight.sum()), float((weight * kept.obs[:, 0]).sum())])
    whole = absorb(from_episodes(given_))
    expected = [len(whole), float(whole.obs[:, 0].double().sum())]
    # each offset once, each with probability 1 / rate: the mean is the whole over the rate
    assert total.tolist() == pytest.approx(expected, rel=1e-5)


class _Always(np.random.Generator):
    """A generator whose integers are all the same."""

    def __init__(self, value: int) -> None:
        super().__init__(np.random.PCG64(0))
        self.value = value

    def integers(self, *_: Any, **__: Any) -> Any:
        return self.value


@given(st.integers(10, 60), st.integers(2, 7), st.integers(0, 9))
def test_every_rate_th_step_is_kept_with_its_own_next_observation(n, rate, seed) -> None:
    kept = subsample([episode(n, "cut")], rate, np.random.default_rng(seed))
    assert {b - a for a, b in pairwise(kept.obs[:, 0].tolist())} == {float(rate)} or len(kept) == 1
    # not the next kept step, and never another episode's
    assert torch.equal(kept.next_obs, kept.obs + torch.tensor([1.0, 2.0]))
    assert len(kept) in (n // rate, n // rate + 1)
    assert not kept.terminated.any()


def test_episodes_have_offsets_of_their_own_that_the_generator_draws() -> None:
    given_ = episodes([(40, "cut")] * 30)
    offsets = {
        float(x) % 100
        for x in subsample(given_, 20, np.random.default_rng(0)).obs[:, 0]
        if float(x) % 100 <= 20
    }
    assert len(offsets) > 8
    again = [subsample(given_, 20, np.random.default_rng(seed)) for seed in (0, 0, 1)]
    assert same(again[0], again[1])
    assert not same(again[0], again[2])


def test_without_the_absorbing_state_a_fall_is_kept_by_chance_and_stays_a_termination() -> None:
    given_ = episodes([(10, "fell")] * 20)
    kept = subsample(given_, 5, np.random.default_rng(0))
    assert kept.weight is None
    assert kept.absorbing is None
    assert 0 < int(kept.terminated.sum()) < 20
    assert same(subsample(given_, 1, np.random.default_rng(0)), from_episodes(given_))


def test_what_cannot_be_thinned_is_refused() -> None:
    with pytest.raises(ValueError, match="rate must be at least 1, not 0"):
        subsample([episode(3, "cut")], 0, np.random.default_rng(0))
    with pytest.raises(ValueError, match="no step of 1 episodes was kept at rate 50"):
        subsample([episode(3, "cut")], 50, np.random.default_rng(0))
    with pytest.raises(ValueError, match="at least one batch"):
        subsample([], 2, np.random.default_rng(0))


def test_expert_rows_join_others_without_losing_their_weight() -> None:
    thin = subsample([episode(6, "fell")], 3, np.random.default_rng(0), absorbing=True)
    joined = concatenate([thin, from_episodes([episode(2, "cut")])])
    assert joined.weight is not None
    assert thin.weight is not None
    assert joined.weight.tolist() == [*thin.weight.tolist(), 1.0, 1.0]
