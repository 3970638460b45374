"""The main peer's GAIL and AIRL (imitation 1.0.1) at its tuned settings; run by throughput.py.

    PEER_PYTHON scripts/benchmarks/throughput_peer.py gail Hopper-v4 demonstrations.npz

It needs an environment of its own: `python -m venv peer; peer/bin/pip install imitation==1.0.1 imageio
'numpy<2' 'pandas<2.3' 'mujoco<3.2'`. It knows the -v4 tasks only; their dynamics are those of -v5.
"""

# pyright: reportMissingImports=false

import json
import sys
import time
from pathlib import Path

import gymnasium as gym
import numpy as np
import torch
from imitation.algorithms.adversarial.airl import AIRL
from imitation.algorithms.adversarial.gail import GAIL
from imitation.data.types import TrajectoryWithRew
from imitation.data.wrappers import RolloutInfoWrapper
from imitation.policies.base import NormalizeFeaturesExtractor
from imitation.rewards.reward_nets import BasicRewardNet, BasicShapedRewardNet
from imitation.util.networks import RunningNorm
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import DummyVecEnv
from torch import nn

torch.set_num_threads(1)
ENVS = 8
# the tuned settings in its repository, by method and task
ACT = {"relu": nn.ReLU, "tanh": nn.Tanh}
SETTINGS = json.loads(Path(__file__).with_name("peer_settings.json").read_text())


def trajectories(path):
    """The demonstrations as the peer takes them."""
    data = np.load(path)
    for i in range(int(data["episodes"])):
        obs, action, reward, terminal = (
            data[f"{name}{i}"] for name in ("obs", "action", "reward", "terminal")
        )
        yield TrajectoryWithRew(obs=obs, acts=action, infos=None, terminal=bool(terminal), rews=reward)


def trainer(method, task, demonstrations, seed=None):
    """A trainer at the tuned settings of the task; `seed` is given to PPO, which seeds the environments."""
    s = SETTINGS[method][task.split("-")[0]]
    # the wrapper with which its documentation has it keep the learner's trajectories
    venv = DummyVecEnv([lambda: RolloutInfoWrapper(gym.make(task)) for _ in range(ENVS)])
    ppo = PPO(
        "MlpPolicy",
        venv,
        n_steps=s["round"] // ENVS,
        **s["ppo"],
        policy_kwargs={
            "net_arch": s["hidden"],
            "activation_fn": ACT[s["activation"]],
            "features_extractor_class": NormalizeFeaturesExtractor,
            "features_extractor_kwargs": {"normalize_class": RunningNorm},
        },
        device="cpu",
        seed=seed,
    )
    make, net = (GAIL, BasicRewardNet) if method == "gail" else (AIRL, BasicShapedRewardNet)
    reward_net = net(venv.observation_space, venv.action_space, normalize_input_layer=RunningNorm)
    return make(
        demonstrations=list(trajectories(demonstrations)),
        demo_batch_size=s["demo_batch_size"],
        gen_replay_buffer_capacity=s["buffer"],
        n_disc_updates_per_round=s["disc_updates"],
        gen_train_timesteps=s["round"],
        venv=venv,
        gen_algo=ppo,
        reward_net=reward_net,
        allow_variable_horizon=True,
        init_tensorboard=False,
    )


def main():
    """A round for each line read; prints its steps and seconds."""
    method, task, demonstrations = sys.argv[1:]
    # its loggers print
    out, sys.stdout = sys.stdout, sys.stderr
    made = trainer(method, task, demonstrations)
    print("ready", file=out, flush=True)
    for line in sys.stdin:
        began, steps = time.perf_counter(), 0
        while time.perf_counter() - began < float(line):
            made.train(made.gen_train_timesteps)
            steps += made.gen_train_timesteps
        print(json.dumps({"steps": steps, "seconds": time.perf_counter() - began}), file=out, flush=True)


if __name__ == "__main__":
    main()
