"""The fitted value function: exact where the features can say anything, linear everywhere."""

import numpy as np
import pytest

from irl.core.rng import stream
from irl.diagnostics import tabular
from irl.diagnostics.features import fitted
from irl.diagnostics.values import td_errors
from tests.diagnostics.mdps import GAMMA, every_step, of_table


def deterministic(seed: int, states: int = 8, actions: int = 3):
    rng = stream(seed, "mdp")
    t = np.eye(states)[rng.integers(states, size=(states, actions))]
    return rng, t, every_step(t)


def test_it_is_the_matrix_solve_on_a_table() -> None:
    rng, t, steps = deterministic(0)
    reward = rng.normal(size=(8, 3, 8))
    left = tabular.val(reward, t, np.full((8, 3), 1 / 3), GAMMA)
    given = np.stack([of_table(r)(steps.batch).numpy() for r in (reward, left)], 1)
    found = td_errors(given[:, :1], steps, lambda obs: obs.astype(np.float64), GAMMA)
    np.testing.assert_allclose(found[:, 0], given[:, 1], atol=1e-10)


def test_shaping_of_the_span_and_an_offset_vanish_and_the_rest_is_linear() -> None:
    rng, _, steps = deterministic(1)
    a, b = rng.normal(size=(2, len(steps.batch)))
    one_hot = rng.normal(size=8)
    shaping = (GAMMA * steps.batch.next_obs.double() - steps.batch.obs.double()).numpy() @ one_hot
    rewards = np.column_stack([a, b, 2 * a - 3 * b, a + shaping, a + 7, shaping])
    left = td_errors(rewards, steps, lambda obs: np.c_[np.ones(len(obs)), obs], GAMMA)
    np.testing.assert_allclose(left[:, 2], 2 * left[:, 0] - 3 * left[:, 1], atol=1e-9)
    np.testing.assert_allclose(left[:, 3], left[:, 0], atol=1e-9)
    np.testing.assert_allclose(left[:, 4], left[:, 0], atol=1e-9)
    np.testing.assert_allclose(left[:, 5], 0, atol=1e-9)


def test_features_hold_what_potentials_are_made_of() -> None:
    obs = stream(2, "obs").normal(3, 5, size=(500, 4))
    features = fitted(obs, stream(0, "waves"), waves=6)
    made = features(obs)
    assert made.shape == (500, features.size) == (500, 1 + 4 + 4 + 6)
    potential = obs @ np.arange(4.0) + obs[:, 1] ** 2 + 2
    weights = np.linalg.lstsq(made, potential, rcond=None)[0]
    np.testing.assert_allclose(made @ weights, potential, atol=1e-8)


def test_a_discount_of_one_is_refused() -> None:
    _, _, steps = deterministic(3)
    with pytest.raises(ValueError, match="gamma = 1"):
        td_errors(np.zeros((len(steps.batch), 1)), steps, lambda obs: obs, 1.0)
