"""How long the distances and the drift of 50 snapshots take on a probe of 100,000 steps, and EPIC.

python scripts/benchmarks/diagnostics.py [--snapshots 50] [--steps 100000] [--threads 2]

The steps are noise of Hopper's or HalfCheetah's sizes: what they are does not change what they cost. CPU
seconds are of all threads and hold on a machine that does other things too; wall seconds do not.
"""

import argparse
import json
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import torch

from irl.algorithms.probe_set import ProbeSet
from irl.core.nets import fitted_normaliser
from irl.core.rng import stream, torch_stream
from irl.core.types import Episode, from_episodes
from irl.diagnostics import epic, val
from irl.diagnostics.distance import pearson_distance
from irl.experiment.drifting import Played, judge_snapshots
from irl.experiment.logits import Snapshot
from irl.policies.policy import Policy, PolicySpec
from irl.rewards.learned import LearnedReward, RewardSpec
from irl.rewards.nets import LogitNet, LogitSpec
from irl.rewards.velocity import of_task

OBS, ACTION, LENGTH = 17, 6, 1000


def episode(rng: np.random.Generator) -> Episode:
    """A random walk of HalfCheetah's sizes."""
    obs = np.cumsum(rng.normal(size=(LENGTH + 1, OBS)), axis=0) / 10.0
    action = rng.uniform(-1, 1, (LENGTH, ACTION))
    return Episode(obs, action, obs[1:, 8] - 0.1 * np.sum(action**2, axis=1), False, True)


def snapshot(seed: int, obs: torch.Tensor) -> Snapshot:
    """An untrained discriminator, two hidden layers of 100."""
    spec = LogitSpec(OBS, ACTION, (100, 100))
    net = LogitNet(spec, fitted_normaliser(obs), torch_stream(seed, "net"))
    said = RewardSpec("HalfCheetah-v5", "gail", "gail", "obs, action", spec, 0.99, 1.0, seed, {})
    weights = {"layers.0.weight": np.zeros((ACTION, OBS)), "layers.0.bias": np.zeros(ACTION)}
    weights |= {"log_std": np.zeros(ACTION), "obs_mean": np.zeros(OBS), "obs_std": np.ones(OBS)}
    weights |= {"action_low": -np.ones(ACTION), "action_high": np.ones(ACTION)}
    policy = Policy(PolicySpec("HalfCheetah-v5", OBS, ACTION, (), "tanh", "gaussian"), weights)
    return Snapshot(LearnedReward(said, net), policy)


@contextmanager
def timed(name: str, found: dict[str, dict[str, float]]) -> Iterator[None]:
    """Wall and CPU seconds of the block, under `name`."""
    wall, cpu = time.monotonic(), time.process_time()
    yield
    found[name] = {
        "wall_s": round(time.monotonic() - wall, 1),
        "cpu_s": round(time.process_time() - cpu, 1),
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--snapshots", type=int, default=50)
    parser.add_argument("--steps", type=int, default=100_000)
    parser.add_argument("--epic", type=int, default=1024, help="steps, and invented pairs for each")
    parser.add_argument("--threads", type=int, default=2)
    given = parser.parse_args()
    torch.set_num_threads(given.threads)
    rng = stream(0, "benchmark")
    names = ("expert", "medium", "noisy expert", "random")
    each = max(1, given.steps // LENGTH // len(names))
    probe = ProbeSet("HalfCheetah-v5", {name: tuple(episode(rng) for _ in range(each)) for name in names})
    every = from_episodes([e for episodes in probe.values() for e in episodes])
    snapshots = {i: snapshot(i, every.obs) for i in range(given.snapshots)}
    few = from_episodes([episode(rng)])
    played = Played(few, few, {i: probe["random"][:2] for i in snapshots})
    found: dict[str, dict[str, float]] = {}
    with timed(f"VAL and drift, {given.snapshots} snapshots, {len(every)} steps", found):
        judge_snapshots(snapshots, probe, played, 0, lambda done, words: None)
    batch, samples = (
        every[torch.from_numpy(rng.permutation(len(every))[: min(given.epic, len(every))])] for _ in range(2)
    )
    pair = (snapshots[0].reward, of_task("HalfCheetah-v5"))
    with timed(f"EPIC of two rewards, N = M = {given.epic}", found):
        left = [epic.canonical(reward, batch, samples, 0.99) for reward in pair]
        pearson_distance(left[0], left[1])
    print(json.dumps({"threads": given.threads, "n": val.HEADLINE, **found}, indent=2))


if __name__ == "__main__":
    main()
