"""Run folders that cannot be judged or gone on with."""

import json
import os
from pathlib import Path

import numpy as np

from irl.core.config import to_json
from irl.experiment.configs import ExpertRun, Watch
from irl.learners.ppo import PPOConfig
from tests.malformed.damage import (
    Damage,
    a_folder,
    being,
    cut,
    empty,
    flipped,
    gone,
    keyed,
    tensors,
    weights,
)
from tests.malformed.table import DATA, SNAPSHOT, Case, at

EVALUATE, RESUME, AGAIN = "evaluate run", "train --resume run", "train --config run/config.json --out new"


def config(damage: Damage, *named: str, words: str = EVALUATE) -> Case:
    return Case(words, ("run/config.json", *named), at("run/config.json", damage))


def record(damage: Damage, *named: str, words: str = EVALUATE) -> Case:
    return Case(words, ("run/demonstrations.json", *named), at("run/demonstrations.json", damage))


def policy(damage: Damage, *named: str) -> Case:
    return Case(EVALUATE, ("policy", *named), at(f"{SNAPSHOT}/policy.safetensors", damage))


def reward(damage: Damage, *named: str) -> Case:
    return Case(EVALUATE, (f"{SNAPSHOT}/reward", *named), at(f"{SNAPSHOT}/reward", damage))


def spec(damage: Damage, *named: str) -> Case:
    return reward(lambda folder: damage(folder / "spec.json"), *named)


def pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def every(damage: Damage, pattern: str) -> Damage:
    """The damage to each file of a pattern."""

    def all_of(world: Path) -> None:
        found = list(world.glob(pattern))
        assert found
        for path in found:
            damage(path)

    return all_of


def a_bad_line(path: Path) -> None:
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join([lines[0], b'{"round": 2, "env_\n', *lines[2:]]))


def without_numbers(weights: dict[str, np.ndarray]) -> None:
    weights["layers.0.weight"][0, 0] = np.nan


def nan_reward(weights: dict[str, np.ndarray]) -> None:
    weights["body.0.weight"][0, 0] = np.nan


def an_expert_of_a_module(path: Path) -> None:
    learner, watch = PPOConfig(), Watch()
    run = ExpertRun("evil:Env-v0", "expert", 64, 0, Path("run"), learner, watch, "cpu", 1)
    path.write_text(json.dumps(to_json(run)))


SETTINGS = {
    "no settings": config(gone, "holds no run"),
    "no settings to go on with": config(gone, "holds no run", words=RESUME),
    "empty settings": config(empty, "not readable JSON"),
    "empty settings to go on with": config(empty, "not readable JSON", words=RESUME),
    "settings cut off": config(cut, "not readable JSON", words=RESUME),
    "settings that are a folder": config(a_folder, "config.json"),
    "settings that are a pipe": config(pipe, "config.json"),
    "settings that are a pipe, to repeat": config(pipe, "is not a file", words=AGAIN),
    "settings that are a list": config(being("[]"), "list"),
    "settings that are a list, to go on with": config(being("[]"), "list", words=RESUME),
    "settings that are no text": config(being(b"\xff\xfe\x00\x80"), "not readable JSON", words=AGAIN),
    "settings nested too deeply": config(being('{"a":' * 100_000), "nested too deeply"),
    "an integer of ten thousand digits": config(
        being('{"steps": 1' + "0" * 10_000 + "}"), "digits", words=AGAIN
    ),
    "a float that none can hold": config(keyed("learner", lr=10**400), "learner.lr", "float", words=AGAIN),
    "a setting that is nan": config(keyed("learner", lr=float("nan")), "learner.lr", "nan", words=AGAIN),
    "a setting named twice": config(being('{"seed": 1, "seed": 2}'), "twice", "seed", words=AGAIN),
    "an unknown setting": config(keyed(sped=1), "unknown sped", "known: env_id", words=AGAIN),
    "a missing setting": config(keyed(steps=...), "missing steps", words=AGAIN),
    "a setting of another type": config(keyed(steps="many"), "steps", "int", "'many'", words=AGAIN),
    "a setting of another type, to judge": config(keyed(threads=1.5), "threads", "int", "1.5"),
    "settings that contradict": config(keyed("learner", n_envs=3), "steps_per_round", words=AGAIN),
    "settings of another kind": config(keyed(kind="dream"), "gail", "'dream'", words=AGAIN),
    "a learner of another kind": config(keyed("learner", kind=[]), "learner", "[]", words=AGAIN),
    "a setting that is an object": config(keyed(env_id={"a": 1}), "env_id", "str", words=AGAIN),
    "a dataset outside its root": Case(
        AGAIN, ("'../../x-v0'", "not a dataset id"), at("run/config.json", keyed(demos="../../x-v0"))
    ),
    "a dataset whose name is endless": Case(
        AGAIN, ("not a dataset id",), at("run/config.json", keyed(demos="a/" * 100_000 + "x-v0"))
    ),
    "an environment of a module, to repeat": config(
        keyed(env_id="evil:Env-v0"), "IRL_ENV_MODULES", words=AGAIN
    ),
    "an environment of a module, to go on": config(keyed(env_id="evil:Env-v0"), "'evil'", words=RESUME),
    "an environment of a module, to judge": config(keyed(env_id="evil:Env-v0"), "IRL_ENV_MODULES=evil"),
    "an environment of a module, of an expert": config(
        an_expert_of_a_module, "IRL_ENV_MODULES=evil", words="experts train --resume run"
    ),
    "another task in the settings": Case(
        EVALUATE, ("Hopper-v5", "11", "2"), at("run/config.json", keyed(env_id="Hopper-v5"))
    ),
    "another seed in the settings": Case(
        EVALUATE, ("begun with", "--datasets-root"), at("run/config.json", keyed(seed=5))
    ),
}

REST = {
    "no record of the demonstrations": record(gone, "no file", "irl train --config run/config.json"),
    "no record, to go on": record(gone, "no file", "irl train --config run/config.json", words=RESUME),
    "a record cut off": record(cut, "not readable JSON", words=RESUME),
    "a record of other demonstrations": record(keyed(episodes=[0, 1, 2, 3]), "begun with", words=RESUME),
    "a record that is a list": record(being("[]"), "begun with"),
    "the demonstrations gone": Case(
        EVALUATE, ("no file", "irl demos generate"), at(f"{DATA}/metadata.json", gone)
    ),
    "no snapshots": Case(
        EVALUATE, ("no snapshot", "irl train"), lambda world: os.rename("run/snapshots", "kept")
    ),
    "a line of the metrics damaged": Case(
        RESUME, ("line 2 of run/metrics.jsonl", "take the line out"), at("run/metrics.jsonl", a_bad_line)
    ),
    "metrics that are no text": Case(
        RESUME, ("line 1 of run/metrics.jsonl",), at("run/metrics.jsonl", being(b"\xff\n\xff\n\xff\n"))
    ),
    "every checkpoint cut off": Case(
        RESUME, ("no checkpoint",), every(cut, "run/checkpoint/*/state.safetensors")
    ),
    "no policy": policy(gone, "no policy file"),
    "an empty policy": policy(empty, "not a policy"),
    "a policy cut off": policy(cut, "not a policy"),
    "a policy that is a folder": policy(a_folder, "no policy file"),
    "a policy that is none": policy(being("hello"), "not a policy"),
    "a policy of a newer format": policy(tensors(lambda w: None, {"version": 9}), "irl.policy 1", "9"),
    "a policy with no specification": policy(tensors(lambda w: None, {"spec": None}), "spec", "None"),
    "a policy with nan": policy(tensors(without_numbers), "layers.0.weight", "not finite"),
    "a policy that lacks weights": policy(tensors(lambda w: w.pop("obs_mean")), "obs_mean", "found None"),
    "a policy of integers": policy(
        tensors(lambda w: w.update(obs_mean=np.zeros(2, np.int64))), "obs_mean", "int64"
    ),
    "a policy of no spread": policy(tensors(lambda w: w["obs_std"].fill(0.0)), "obs_std", "positive"),
    "a policy of bounds the wrong way": policy(tensors(lambda w: w["action_low"].fill(9.0)), "action_low"),
    "no specification of a reward": Case(
        EVALUATE, ("no reward in", SNAPSHOT), at(f"{SNAPSHOT}/reward/spec.json", gone)
    ),
    "a specification cut off": spec(cut, "not readable JSON"),
    "a reward of a newer format": spec(keyed(version=9), "irl.reward", "9"),
    "a reward of another format": spec(keyed(format="other.reward"), "irl.reward"),
    "a reward of another task": spec(keyed(env_id="Hopper-v5"), "Hopper-v5", "PointMass-v0"),
    "a reward with an unknown key": spec(keyed(more=1), "unknown more"),
    "a reward with a map that is none": spec(keyed(reward_map="magic"), "unknown map", "magic", "gail"),
    "a reward that claims a terabyte": spec(keyed("net", hidden=[500_000, 500_000]), "do not fit"),
    "a reward of no observations": spec(keyed("net", obs_dim=-2), "do not fit"),
    "a reward of other sizes": spec(keyed("net", obs_dim=3), "not a reward"),
    "a reward with an unknown activation": spec(keyed("net", activation="exec"), "exec"),
    "weights of one other byte": reward(lambda f: flipped(f / "weights.safetensors"), "sha256"),
    "no weights": reward(lambda f: gone(f / "weights.safetensors"), "weights.safetensors"),
    "weights with nan": reward(weights(nan_reward), "body.0.weight", "not finite"),
    "weights that lack a layer": reward(weights(lambda w: w.pop("body.2.bias")), "body.2.bias"),
}
