"""One contender of throughput.py: irl's methods, and Stable-Baselines3 alone, a chunk for each line read.

python scripts/benchmarks/throughput_ours.py dac Hopper-v5 DATASETS_ROOT [--shares]
"""

import dataclasses
import json
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import gymnasium as gym
import torch
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.vec_env import DummyVecEnv
from torch import nn

from irl.algorithms.adversarial import ReplayedScheduleConfig, ScheduleConfig
from irl.core.types import Episode
from irl.demos.load import load_demos
from irl.discriminators.airl import AIRLConfig
from irl.discriminators.gail import GAILConfig
from irl.envs.tasks import task_name
from irl.experiment import build
from irl.experiment.configs import OFF_POLICY, AIRLRun, DACRun, GAILRun, Imitation
from irl.learners.ppo import PPOConfig, PPOLearner

SETTINGS = json.loads(Path(__file__).with_name("peer_settings.json").read_text())
ENVS = 8
CHUNK = 250
"""Steps of SAC that are not interrupted."""


def peers(method: str, task: str) -> dict[str, Any]:
    """The peer's tuned settings of a method on this task."""
    return SETTINGS[method][task.split("-")[0]]


def ppo(s: dict[str, Any]) -> PPOConfig:
    """PPO with those settings."""
    its = dict(s["ppo"])
    return PPOConfig(
        n_envs=ENVS,
        steps_per_round=s["round"],
        lr=its.pop("learning_rate"),
        lr_schedule="constant",
        hidden=tuple(s["hidden"]),
        activation=s["activation"],
        **its,
    )


def schedule(s: dict[str, Any]) -> tuple[int, int]:
    """Rows of a discriminator's update, and passes: as many updates as the peer's, at most a rollout each.

    On Hopper that is more rows than the peer takes, on HalfCheetah GAIL half as many.
    """
    rows = min(max(s["demo_batch_size"], s["round"] // s["disc_updates"]), s["round"])
    return rows, s["disc_updates"] * rows // s["round"]


def gail(task: str) -> GAILRun:
    """GAIL with PPO at those settings."""
    s = peers("gail", task)
    discriminator = GAILConfig(hidden=(32, 32), activation="relu", gradient_penalty=0.0)
    return GAILRun(
        env_id=task, learner=ppo(s), discriminator=discriminator, schedule=ScheduleConfig(*schedule(s))
    )


def airl(task: str) -> AIRLRun:
    """AIRL with PPO at those settings; the peer's buffer of earlier steps is no longer than a round."""
    s = peers("airl", task)
    rows, passes = schedule(s)
    discriminator = AIRLConfig(
        hidden=(32,),
        potential_hidden=(32, 32),
        activation="relu",
        gradient_penalty=0.0,
        reward="f",
        terminal="mask",
        log_pi_bound=10.0,
    )
    again = ReplayedScheduleConfig(rows, passes, warmup_rounds=0, negatives=1, memory=0)
    return AIRLRun(env_id=task, learner=ppo(s), discriminator=discriminator, schedule=again)


def dac(task: str, products: str, quantiles: int = 0) -> DACRun:
    """DAC's defaults; without quantiles its critics are those of the SAC that it is held against.

    Rounds are short, so that a turn ends soon after its time is up.
    """
    learner = dataclasses.replace(OFF_POLICY, products=products, quantiles=quantiles, steps_per_round=CHUNK)
    return DACRun(env_id=task, learner=learner)


def rounds(run: Imitation, root: Path, shares: dict[str, float] | None) -> Iterator[int]:
    """Train; the steps of each round."""
    episodes: list[Episode] = list(load_demos(f"irl/{task_name(run.env_id)}/expert-v0", root=root))
    algorithm = build.imitation(run, episodes)
    if shares is not None:
        watch(algorithm, shares)
    before = 0
    for played in algorithm.rounds(10**9):
        yield played.env_steps - before
        before = played.env_steps


def watch(algorithm: Any, shares: dict[str, float]) -> None:
    """Add up the seconds of each part; what is inside another part is taken off that."""
    stack = [0.0]

    def timed(owner: Any, name: str, part: str) -> None:
        inner = getattr(owner, name)

        def outer(*args: Any, **kwargs: Any) -> Any:
            stack.append(0.0)
            began = time.perf_counter()
            try:
                return inner(*args, **kwargs)
            finally:
                took = time.perf_counter() - began
                shares[part] = shares.get(part, 0.0) + took - stack.pop()
                stack[-1] += took

        setattr(owner, name, outer)

    learner, discriminator = algorithm.learner, algorithm.discriminator
    timed(learner.venv, "advance" if isinstance(learner, PPOLearner) else "step", "environment")
    for name in ("update", "reward", "logits"):
        timed(discriminator, name, "discriminator")
    # what was handed on before it was watched
    learner.start(
        discriminator.reward, *([algorithm._before_update] if hasattr(algorithm, "_updates") else [])
    )
    timed(learner, "collect", "policy")
    timed(learner, "improve", "learner")
    if hasattr(learner, "_learn"):
        timed(learner, "_learn", "learner")


def sb3_ppo(task: str) -> Iterator[int]:
    """Stable-Baselines3's PPO on the task's own reward, at the peer's settings."""
    s = peers("gail", task)
    venv = DummyVecEnv([lambda: gym.make(task) for _ in range(ENVS)])
    activation = {"relu": nn.ReLU, "tanh": nn.Tanh}[s["activation"]]
    shape = {"net_arch": s["hidden"], "activation_fn": activation}
    yield from learned(
        PPO("MlpPolicy", venv, n_steps=s["round"] // ENVS, **s["ppo"], policy_kwargs=shape, device="cpu"),
        s["round"],
    )


def sb3_sac(task: str) -> Iterator[int]:
    """Stable-Baselines3's SAC on the task's own reward, with the networks, batch and ratio of DAC's."""
    c = OFF_POLICY
    shape = {"net_arch": list(c.hidden)}
    model = SAC(
        "MlpPolicy",
        gym.make(task),
        learning_starts=c.learning_starts,
        batch_size=c.batch_size,
        buffer_size=200_000,
        policy_kwargs=shape,
        device="cpu",
    )
    yield from learned(model, CHUNK)


def learned(model: PPO | SAC, steps: int) -> Iterator[int]:
    """Steps of each piece of a long `learn`."""
    fresh = True
    while True:
        before = model.num_timesteps
        model.learn(steps, reset_num_timesteps=fresh)
        fresh = False
        yield model.num_timesteps - before


def contender(name: str, task: str, root: Path, shares: dict[str, float] | None) -> tuple[Iterator[int], int]:
    """Its chunks, and how many of them warm it up."""
    updating = OFF_POLICY.learning_starts // CHUNK + 2
    defaults = dac(task, OFF_POLICY.products, OFF_POLICY.quantiles)
    made: dict[str, Callable[[], tuple[Iterator[int], int]]] = {
        "gail": lambda: (rounds(gail(task), root, shares), 1),
        "airl": lambda: (rounds(airl(task), root, shares), 1),
        "dac": lambda: (rounds(dac(task, "bfloat16"), root, shares), updating),
        "dac-defaults": lambda: (rounds(defaults, root, shares), updating),
        "dac-float32": lambda: (rounds(dac(task, "float32"), root, shares), updating),
        "sb3-ppo": lambda: (sb3_ppo(task), 1),
        "sb3-sac": lambda: (sb3_sac(task), updating),
    }
    return made[name]()


def main() -> None:
    """For each line, seconds: train for at least that long; print steps, seconds and, if asked, shares."""
    name, task, root, *flags = sys.argv[1:]
    torch.set_num_threads(1)
    shares: dict[str, float] | None = {} if "--shares" in flags else None
    chunks, before = contender(name, task, Path(root), shares)
    for _ in range(before):
        next(chunks)
    print("ready", flush=True)
    for line in sys.stdin:
        if shares is not None:
            shares.clear()
        began, steps = time.perf_counter(), 0
        while time.perf_counter() - began < float(line):
            steps += next(chunks)
        row = {"steps": steps, "seconds": time.perf_counter() - began, "shares": shares}
        print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main()
