from dataclasses import replace

import pytest
import torch

from irl.core.nets import Normaliser, fitted_normaliser
from irl.core.rng import torch_stream
from irl.core.types import Transitions
from irl.rewards.nets import LogitNet, LogitSpec


def batch(n: int, obs_dim: int = 3, action_dim: int = 2) -> Transitions:
    rng = torch_stream(0, "batch")
    obs, action, after = (4 + torch.randn(n, d, generator=rng) for d in (obs_dim, action_dim, obs_dim))
    flags = torch.zeros(n, dtype=torch.bool)
    return Transitions(obs, action, after, flags, flags)


def net(normaliser: Normaliser, seed: int = 0, hidden: tuple[int, ...] = (5, 4)) -> LogitNet:
    return LogitNet(LogitSpec(3, 2, hidden), normaliser, torch_stream(seed, "net"))


def test_it_sees_normalised_observations_beside_raw_actions() -> None:
    steps = batch(50)
    inputs = net(fitted_normaliser(steps.obs)).inputs(steps)
    expected = (steps.obs - steps.obs.mean(0)) / steps.obs.std(0, unbiased=False)
    torch.testing.assert_close(inputs[:, :3], expected)
    assert torch.equal(inputs[:, 3:], steps.action)


def test_a_linear_logit_is_one_product() -> None:
    steps, linear = batch(7), net(Normaliser(3), hidden=())
    weight, bias = (parameter.detach() for parameter in linear.body.parameters())
    expected = torch.cat([steps.obs, steps.action], 1) @ weight[0] + bias
    torch.testing.assert_close(linear(steps).detach(), expected)


def test_it_is_the_perceptron_of_its_inputs_one_logit_a_row() -> None:
    steps, logit = batch(7), net(Normaliser(3))
    assert logit(steps).shape == (7,)
    assert torch.equal(logit(steps), logit.of_inputs(logit.inputs(steps)))
    torch.testing.assert_close(logit(steps[2:5]), logit(steps)[2:5])


def test_it_ignores_all_but_observation_and_action() -> None:
    steps, logit = batch(7), net(Normaliser(3))
    flags = torch.ones(7, dtype=torch.bool)
    other = Transitions(steps.obs, steps.action, -steps.next_obs, flags, flags, torch.ones(7))
    assert torch.equal(logit(other), logit(steps))


@pytest.mark.parametrize("column", ["obs", "action"])
def test_it_depends_on_observation_and_action(column: str) -> None:
    steps, logit = batch(7), net(Normaliser(3))
    columns = {name: getattr(steps, name) for name in ("obs", "action", "next_obs")}
    columns[column] = columns[column] + 0.1
    moved = Transitions(**columns, terminated=steps.terminated, truncated=steps.truncated)
    assert (logit(moved) != logit(steps)).all()


def test_weights_are_the_generators_and_the_normaliser_is_not_trained() -> None:
    one, two, other = net(Normaliser(3)), net(Normaliser(3)), net(Normaliser(3), seed=1)
    steps = batch(4)
    assert torch.equal(one(steps), two(steps))
    assert not torch.equal(one(steps), other(steps))
    assert {name.split(".")[0] for name, _ in one.named_parameters()} == {"body"}


def test_the_normaliser_travels_in_the_state() -> None:
    steps = batch(20)
    fitted, fresh = net(fitted_normaliser(steps.obs)), net(Normaliser(3), seed=1)
    fresh.load_state_dict(fitted.state_dict())
    assert torch.equal(fresh(steps), fitted(steps))


def knowing(scale: float = 10.0, normaliser: Normaliser | None = None) -> LogitNet:
    spec = LogitSpec(3, 2, (5, 4), absorbing_scale=scale)
    return LogitNet(spec, normaliser or Normaliser(3), torch_stream(0, "net"))


def test_the_absorbing_state_is_seen_as_its_scaled_flag_alone() -> None:
    steps = batch(50)
    logit = knowing(7.0, fitted_normaliser(steps.obs))
    flags = torch.arange(50) % 5 == 0
    inputs = logit.inputs(replace(steps, absorbing=flags))
    # its zeros are no observation of mean 4: normalised they would be a state like others
    assert (inputs[flags, :3] == 0).all()
    assert torch.equal(inputs[~flags, :3], logit.normaliser(steps.obs)[~flags])
    assert torch.equal(inputs[:, 3:5], steps.action)
    assert torch.equal(inputs[:, 5], 7.0 * flags.float())


def test_no_flags_are_flags_that_are_down() -> None:
    steps, logit = batch(7), knowing()
    down = replace(steps, absorbing=torch.zeros(7, dtype=torch.bool))
    assert torch.equal(logit(steps), logit(down))


def test_the_logit_of_the_absorbing_state_is_that_of_its_rows() -> None:
    steps, logit = batch(7), knowing(normaliser=fitted_normaliser(batch(50).obs))
    zeros = replace(steps, obs=0 * steps.obs, action=0 * steps.action)
    absorbed = logit(replace(zeros, absorbing=torch.ones(7, dtype=torch.bool)))
    torch.testing.assert_close(absorbed, logit.of_absorbing().expand(7))
    # whatever the row of obs holds: the flag says which state it is
    other = replace(zeros, obs=steps.obs, absorbing=torch.ones(7, dtype=torch.bool))
    assert torch.equal(logit(other), absorbed)
    assert not torch.equal(logit(zeros), absorbed)


def test_a_network_that_knows_no_absorbing_state_refuses_it() -> None:
    steps, logit = batch(7), net(Normaliser(3))
    assert torch.equal(logit(replace(steps, absorbing=torch.zeros(7, dtype=torch.bool))), logit(steps))
    with pytest.raises(ValueError, match="absorbing state, which this network does not know"):
        logit(replace(steps, absorbing=torch.arange(7) == 3))
    with pytest.raises(ValueError, match="knows no absorbing state"):
        logit.of_absorbing()


def test_without_the_new_settings_the_weights_are_drawn_as_before() -> None:
    # one more input draws other weights; a spectral norm draws the same
    plain = net(Normaliser(3)).state_dict()
    spec = LogitSpec(3, 2, (5, 4), spectral_norm=True)
    normed = LogitNet(spec, Normaliser(3), torch_stream(0, "net")).state_dict()
    assert plain.keys() < normed.keys()
    assert all(torch.equal(plain[name], normed[name]) for name in plain)
