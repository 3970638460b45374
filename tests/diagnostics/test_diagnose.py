"""`irl.diagnose` on the point mass, whose reward is a function that can be written down."""

import numpy as np
import pytest

from irl.core.errors import UserError
from irl.core.types import from_episodes
from irl.diagnostics.diagnose import diagnose
from irl.diagnostics.references import NAMES
from irl.rewards.mujoco import HandWritten
from tests.diagnostics.walks import mirage, play, shaped, true

STRATA = play()
SHORT = (1, 10)


def value(reward, strata=STRATA, truth=true) -> float:
    return diagnose(reward, truth, strata, ns=SHORT).headline.value


def test_scale_offset_and_shaping_do_not_count() -> None:
    for reward in (true, lambda b: 3 * true(b) + 2, shaped(1.0)):
        found = diagnose(reward, true, STRATA, ns=SHORT)
        assert all(d.value < 1e-4 for d in found.curve)
        assert found.headline.shown == "not distinguishable"
        assert found.headline.n == 10


def test_the_opposite_is_one_and_noise_between() -> None:
    assert value(lambda b: -true(b)) == pytest.approx(1)
    # the same in the mean wherever one is
    assert 0.5 < value(lambda b: (1e4 * b.obs[:, 0]).sin()) < 0.9


def test_the_self_tests_are_what_they_say() -> None:
    found = diagnose(lambda b: -b.next_obs[:, 0].abs(), true, STRATA, ns=SHORT).headline
    assert found.self_error < 0.06 < found.value < 0.6
    assert found.negation == pytest.approx(1)
    assert 0.3 < found.random < 0.95
    assert found.low <= found.value <= found.high


def test_a_reward_right_near_the_expert_alone_is_caught_by_other_play() -> None:
    near = {"expert": [episode for episode in play(60)["expert"] if np.abs(episode.obs[0]).max() < 0.2]}
    assert len(near["expert"]) > 1
    assert value(mirage, near) < 0.01
    found = diagnose(mirage, true, STRATA, ns=SHORT)
    assert found.headline.value > 0.5
    assert found.strata["random"].distance.value > 0.5


def test_a_constant_reward_is_a_reason() -> None:
    found = diagnose(lambda b: np.ones(len(b)), true, STRATA, ns=SHORT)
    assert np.isnan(found.headline.value)
    assert found.headline.reason == "the learned reward is constant on these segments"
    assert "undefined" in str(found)


def test_an_offset_is_a_bonus_where_episodes_end_early() -> None:
    strata = play(4, cliff=12)
    by = {d: diagnose(lambda b, d=d: true(b) + d, true, strata, ns=SHORT) for d in (0.0, 1.0)}
    assert by[0.0].headline.value < 1e-6 < 0.05 < by[1.0].headline.value


def test_segments_that_fit_into_few_episodes_are_a_reason() -> None:
    found = diagnose(mirage, true, STRATA, ns=(10, 50))
    assert found.curve[1].reason == "segments of 50 steps fit into 0 of 16 episodes"
    assert found.headline.n == 10


@pytest.mark.parametrize("name", NAMES)
def test_a_named_distance_of_a_reward_to_itself_is_zero_and_to_its_negation_one(name: str) -> None:
    same = diagnose(lambda b: 2 * true(b), true, STRATA, ns=(1,), named=(name,)).references[0]
    opposite = diagnose(lambda b: -true(b), true, STRATA, ns=(1,), named=(name,)).references[0]
    assert same.name == opposite.name == name
    assert same.value == pytest.approx(0, abs=1e-6)
    assert opposite.value == pytest.approx(1, abs=1e-6)
    assert same.size > 0


def test_named_distances_are_what_a_slow_hand_finds() -> None:
    reward, names = shaped(3.0), ("pearson", "spearman", "kendall", "erc", "starc-val")
    found = {d.name: d for d in diagnose(reward, true, STRATA, ns=(1,), named=names).references}
    batches = [from_episodes([episode]) for episodes in STRATA.values() for episode in episodes]
    a, b = ([np.asarray(f(batch), float) for batch in batches] for f in (reward, true))
    learned, own = np.concatenate(a), np.concatenate(b)

    def apart(x: np.ndarray, y: np.ndarray) -> float:
        return float(np.sqrt((1 - np.corrcoef(x, y)[0, 1]) / 2))

    def discounted(of: list[np.ndarray]) -> np.ndarray:
        return np.array([sum(0.99**t * r for t, r in enumerate(episode)) for episode in of])

    order = [np.sign(np.subtract.outer(x, x))[np.triu_indices(len(x), 1)] for x in (learned, own)]
    by_hand = {
        "pearson": apart(learned, own),
        "spearman": apart(learned.argsort().argsort(), own.argsort().argsort()),
        "kendall": float(np.mean(order[0] != order[1])),
        "erc": apart(discounted(a), discounted(b)),
    }
    for name, value in by_hand.items():
        assert found[name].value == pytest.approx(value, abs=1e-3), name
    assert len({round(value, 2) for value in by_hand.values()}) == len(by_hand)
    assert found["starc-val"].value < 1e-4
    assert (found["erc"].size, found["pearson"].size) == (len(batches), len(own))


def test_shaping_counts_for_some_and_not_for_others() -> None:
    names = ("pearson", "npec", "epic")
    pearson, npec, epic = diagnose(shaped(3.0), true, STRATA, ns=(1,), named=names).references
    assert pearson.value > 0.15
    assert npec.value < 1e-4
    # a termination has no potential after it, and EPIC knows none: here there is none
    assert epic.value < 1e-4


def test_what_cannot_be_asked_says_what_can() -> None:
    with pytest.raises(UserError, match="no distance is called epick; choose of pearson"):
        diagnose(true, true, STRATA, named=("epick",))
    with pytest.raises(UserError, match="give a function as truth"):
        diagnose(true, HandWritten(), STRATA, named=("epic",))
    with pytest.raises(ValueError, match="one number a step"):
        diagnose(lambda b: b.obs, true, STRATA)


def test_a_list_of_episodes_is_a_probe_of_one_kind() -> None:
    found = diagnose(mirage, true, STRATA["random"], ns=(1,))
    assert list(found.strata) == ["episodes"]
    assert found.headline.value == pytest.approx(found.strata["episodes"].distance.value, abs=1e-9)


def test_the_same_seed_says_the_same() -> None:
    assert str(diagnose(mirage, true, STRATA, ns=(1,))) == str(diagnose(mirage, true, STRATA, ns=(1,)))


def test_few_episodes_are_said() -> None:
    strata = {"expert": STRATA["expert"], "random": STRATA["random"][:2]}
    assert "within random" in (text := str(diagnose(mirage, true, strata, ns=(1,))))
    assert "2 episodes: few" in text
