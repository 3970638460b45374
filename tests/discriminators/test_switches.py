"""Each switch on each method: what it computes, where it is refused, and that weights stay finite."""

import copy
import itertools
import math
from dataclasses import asdict
from typing import Any

import pytest
import torch
from torch import Tensor

from irl.core.nets import Normaliser
from irl.core.types import Transitions
from irl.discriminators import losses, objectives, regularisers
from irl.discriminators.airl import AIRL, AIRLConfig
from irl.discriminators.dac import DAC, DACConfig
from irl.discriminators.ensemble import Ensemble, one_or_several
from irl.discriminators.gail import GAIL, GAILConfig

METHODS = {"gail": (GAIL, GAILConfig), "dac": (DAC, DACConfig), "airl": (AIRL, AIRLConfig)}
ON: dict[str, dict[str, Any]] = {
    "pu": {"loss": "pu"},
    "wasserstein": {"loss": "wasserstein", "reward_map": "logit"},
    "label_smoothing": {"label_smoothing": 0.1},
    "mixup": {"mixup": 1.0},
    "dropout": {"dropout": 0.5},
    "input_dropout": {"input_dropout": 0.2},
    "weight_decay": {"weight_decay": 1.0},
    "ensemble": {"ensemble": 2, "ensemble_reward": "lowest"},
    "states": {"inputs": "obs"},
    "pairs": {"inputs": "obs_next_obs"},
    "steps": {"inputs": "obs_action_next_obs"},
    "spectral_norm": {"spectral_norm": True},
    "entropy": {"entropy": 0.1},
    "relu": {"activation": "relu"},
}
NOT_WITH_AIRL = {"pu", "wasserstein", "mixup", "pairs", "steps"}
NOT_AIRLS = {"spectral_norm", "entropy"}


def config(method: str, *switches: str) -> Any:
    settings: dict[str, Any] = {"hidden": (6,)}
    for switch in switches:
        settings |= ON[switch]
    return METHODS[method][1](**settings)


def made(method: str, settings: Any, seed: int = 0) -> GAIL | AIRL | Ensemble:
    def make(called: str) -> GAIL | AIRL:
        first = seed + len(called)
        shared: dict[str, Any] = {
            "normaliser": Normaliser(3),
            "init_rng": torch.Generator().manual_seed(first),
            "rng": torch.Generator().manual_seed(first + 1),
            "gamma": 0.9,
        }
        if method == "airl":
            shared["log_pi"] = lambda batch: -batch.action.square().sum(1)
        return METHODS[method][0](3, 2, settings, **shared)

    return one_or_several(settings, make)


def batch(size: int, seed: int, scale: float = 1.0, shift: float = 0.0) -> Transitions:
    rng = torch.Generator().manual_seed(seed)
    obs, after = (scale * (torch.randn(size, 3, generator=rng) + shift) for _ in range(2))
    ended = torch.rand(size, generator=rng) < 0.2
    return Transitions(obs, torch.randn(size, 2, generator=rng), after, ended, ~ended)


def defined(method: str, switch: str) -> bool:
    return method != "airl" or switch not in NOT_WITH_AIRL | NOT_AIRLS


CELLS = [(m, s) for m in METHODS for s in ON if defined(m, s)]


def numbers(discriminator: GAIL | AIRL | Ensemble) -> list[Tensor]:
    return [value.clone() for value in discriminator.net.state_dict().values()]


@pytest.mark.parametrize(("method", "switch"), CELLS)
def test_a_switch_changes_what_is_learned_and_goes_on_bit_for_bit(method: str, switch: str) -> None:
    expert, policy = batch(8, 1, shift=0.5), batch(8, 2)
    one, plain = made(method, config(method, switch)), made(method, config(method))
    said: dict[str, float] = {}
    for _ in range(2):
        said = one.update(expert, policy)
        plain.update(expert, policy)
    assert said.keys() >= {"discriminator/loss", "discriminator/gradient_penalty"}
    assert [v.shape for v in numbers(one)] != [v.shape for v in numbers(plain)] or not all(
        torch.equal(a, b) for a, b in zip(numbers(one), numbers(plain), strict=True)
    )
    other = made(method, config(method, switch), seed=5)
    other.load_state_dict(copy.deepcopy(one.state_dict()))
    for each in (one, other):
        each.update(expert, policy)
    assert all(torch.equal(a, b) for a, b in zip(numbers(one), numbers(other), strict=True))
    assert torch.equal(one.reward(policy), other.reward(policy))


@pytest.mark.parametrize("switch", sorted(NOT_WITH_AIRL))
def test_what_airl_is_not_defined_with_is_refused_with_the_reason(switch: str) -> None:
    settings = {name: value for name, value in ON[switch].items() if name != "reward_map"}
    with pytest.raises(ValueError, match=r"AIRL has no .*: .*; use --discriminator\."):
        AIRLConfig(**settings)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"loss": "wasserstein"}, "--discriminator.reward-map logit"),
        ({"loss": "wasserstein", "reward_map": "logit", "entropy": 0.1}, "leave entropy at 0"),
        ({"loss": "wasserstein", "reward_map": "logit", "gradient_penalty": 0.0}, "without end"),
        ({"loss": "pu", "mixup": 1.0}, "mixup changes the labels"),
        ({"mixup": 0.5, "label_smoothing": 0.1}, "labels of its own"),
        ({"mixup": 2.0}, r"mixup must be in \[0, 1\], not 2.0"),
        ({"prior": 1.0}, "between 0 and 1"),
        ({"dropout": 1.0}, r"dropout must be in \[0, 1\), not 1.0"),
        ({"ensemble": 0}, "ensemble must be at least 1, not 0"),
    ],
)
def test_contradictions_are_refused_with_what_to_type(settings: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        GAILConfig(**settings)


def test_off_is_the_same_to_the_bit_as_before_there_were_switches() -> None:
    # the update as it was written then: cross-entropy and penalty by hand-written gradients, Adam
    expert, policy, settings = batch(8, 1), batch(8, 2), config("gail")
    one, by_hand = made("gail", settings), made("gail", settings)
    assert isinstance(by_hand, GAIL)
    assert by_hand._slopes._fast is not None
    for _ in range(3):
        one.update(expert, policy)
        x, y = by_hand.net.inputs(expert), by_hand.net.inputs(policy)
        between = regularisers.between(x, y, by_hand.rng)
        logits, slopes = by_hand._slopes(torch.cat([x, y]), between)
        loss = losses.bce(logits[:8], logits[8:]) + 5.0 * regularisers.slope_penalty(slopes, 1.0)
        by_hand.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        by_hand.optimizer.step()
    assert all(torch.equal(a, b) for a, b in zip(numbers(one), numbers(by_hand), strict=True))


def best_logit(loss_of: Any, p_expert: float, p_policy: float) -> float:
    """Where the expected loss at one point, of these densities, is least."""
    h = torch.zeros(1, dtype=torch.float64, requires_grad=True)
    for _ in range(200):
        (gradient,) = torch.autograd.grad(loss_of(h, p_expert, p_policy), h, create_graph=True)
        (slope,) = torch.autograd.grad(gradient, h)
        h = (h - gradient.detach() / slope).detach().requires_grad_()
    return float(torch.sigmoid(h).detach())


def test_the_optimum_with_smoothed_labels_and_with_unlabelled_steps() -> None:
    def point(loss: Any, **more: Any) -> Any:
        weights = lambda h, e, p: (torch.tensor([e, 1 - e]), torch.tensor([p, 1 - p]))  # noqa: E731

        def of(h: Tensor, e: float, p: float) -> Tensor:
            # another point of the space, judged 0, so that the weights are densities
            rows = torch.cat([h, torch.zeros(1, dtype=h.dtype)])
            return loss(rows, rows, *more.values(), *weights(h, e, p))

        return of

    smoothed = best_logit(point(losses.smoothed, smoothing=0.2), 0.6, 0.3)
    assert smoothed == pytest.approx(0.8 * 0.6 / 0.9, abs=1e-5)
    unlabelled = best_logit(point(losses.positive_unlabelled, prior=0.3), 0.6, 0.4)
    assert unlabelled == pytest.approx(0.3 * 0.6 / 0.4, abs=1e-5)


def test_losses_of_a_blind_discriminator_and_weights_as_rows() -> None:
    blind, four = torch.zeros(5), torch.log(torch.tensor(4.0))
    assert losses.mixed(blind, torch.rand(5)) == pytest.approx(float(four))
    assert losses.smoothed(blind, blind, 0.3) == pytest.approx(float(four))
    assert losses.wasserstein(blind + 2.0, blind) == -2.0
    h, twice = torch.tensor([0.3, -1.0]), torch.tensor([0.3, 0.3, -1.0])
    weight = torch.tensor([2.0, 1.0])
    for loss in (losses.bce, losses.wasserstein):
        torch.testing.assert_close(loss(h, h, weight, weight), loss(twice, twice))
    # a sure D: the negatives' risk would be below 0, and is not rewarded
    sure = losses.positive_unlabelled(torch.full((3,), 9.0), torch.full((3,), -9.0), 0.5)
    assert float(sure) == pytest.approx(0.5 * math.log1p(math.exp(-9.0)), rel=1e-4)


def test_mixup_of_rows_that_stand_for_others_is_that_of_as_many_rows() -> None:
    # identical sides, one of half the rows at .05: blind is best, so the loss has no slope there
    n, settings = 40_000, config("gail", "mixup")
    h = torch.zeros(1, requires_grad=True)
    weight = torch.where(torch.arange(n) % 2 == 0, 1.0, 0.05)
    rows, rng = torch.zeros(n, 1), torch.Generator().manual_seed(0)
    inputs, loss = objectives.objective(settings, rows, rows, (weight, None), rng)
    loss(h.expand(len(inputs))).backward()
    assert float(h.grad) == pytest.approx(0.0, abs=0.02)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("alpha", [0.05, 0.3, 1.0])
def test_shares_of_mixup_have_the_moments_of_beta(alpha: float) -> None:
    drawn = regularisers.shares(20_000, alpha, torch.Generator().manual_seed(0))
    assert float(drawn.mean()) == pytest.approx(0.5, abs=0.02)
    assert float(drawn.var()) == pytest.approx(1 / (4 * (2 * alpha + 1)), rel=0.05)


def test_dropout_keeps_the_mean_and_leaves_the_reward_alone() -> None:
    one, rows = made("gail", config("gail", "input_dropout")), batch(1, 3)
    assert isinstance(one, GAIL)
    x = one.net.inputs(rows)
    one.net.body[0].weight.data *= 0.01  # pyright: ignore[reportOptionalMemberAccess, reportOperatorIssue]
    values = one._slopes(x.repeat(20_000, 1), x[:0])[0].detach()
    assert float(values.std()) > 0
    assert float(values.mean()) == pytest.approx(float(one.logits(rows).detach()), abs=3e-5)
    assert torch.equal(one.reward(rows), one.reward(rows))


def test_an_ensemble_pays_the_mean_or_the_lowest_of_its_members() -> None:
    rows = batch(6, 1)
    for pays in ("mean", "lowest"):
        one = made("gail", GAILConfig(hidden=(4,), ensemble=3, ensemble_reward=pays))
        assert isinstance(one, Ensemble)
        each = torch.stack([member.reward(rows) for member in one.members])
        assert not torch.equal(each[0], each[1])
        assert torch.equal(one.reward(rows), each.mean(0) if pays == "mean" else each.amin(0))
        # the first member is the network there would be alone
        alone = made("gail", GAILConfig(hidden=(4,)))
        assert torch.equal(alone.reward(rows), each[0])


def pairs() -> list[tuple[str, str, str]]:
    found = []
    for method in METHODS:
        for a, b in itertools.combinations(ON, 2):
            if defined(method, a) and defined(method, b):
                try:
                    settings = asdict(config(method, a, b))
                except ValueError:
                    continue
                if all(settings[k] == v for k, v in (ON[a] | ON[b]).items()):
                    found.append((method, a, b))
    return found


def random_updates(cell: tuple[str, str, str], n: int) -> None:
    one = made(cell[0], config(*cell))
    for i in range(n):
        scale = (1e-8, 1.0, 1e4, 1e8)[i % 4]
        one.update(batch(1 + i % 3, i, scale, shift=0.1), batch(1 + i % 3, i + 1, scale))
    rows = batch(3, 0)
    assert all(torch.isfinite(value).all() for value in [*numbers(one), one.reward(rows), one.logits(rows)])


def test_every_pair_of_switches_stays_finite_on_batches_of_one_and_any_scale() -> None:
    assert len(pairs()) > 150
    for cell in pairs():
        random_updates(cell, 4)


@pytest.mark.slow
@pytest.mark.parametrize("cell", pairs(), ids="-".join)
def test_every_pair_of_switches_stays_finite_for_ten_thousand_updates(cell: tuple[str, str, str]) -> None:
    random_updates(cell, 10_000)
