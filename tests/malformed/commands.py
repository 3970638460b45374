"""Shelves, environments and places that cannot be used."""

import shutil
from pathlib import Path

from tests.experiment.conftest import DATASET, TASK
from tests.malformed.damage import Damage, being, cut, flipped, gone, keyed, tensors
from tests.malformed.table import SHELVED, SNAPSHOT, Case, at

GENERATE = f"demos generate --env-id {TASK} --dataset-id irl/pointmass/new-v0 --episodes 2"
TRAIN = f"train gail --env-id {TASK} --out new"
EVALUATE = "evaluate run"
RETRAIN, EXPORT = "retrain run --out new", "export run --out new.zip"


def card(damage: Damage, *named: str, words: str = GENERATE) -> Case:
    return Case(words, (f"{SHELVED}/card.json", *named), at(f"{SHELVED}/card.json", damage))


def policy(damage: Damage, *named: str, words: str = GENERATE) -> Case:
    return Case(words, ("policy", *named), at(f"{SHELVED}/policy.safetensors", damage))


def of_another_task(world: Path) -> None:
    """The point mass's policy shelved as the expert of Pendulum-v1, with a card that agrees."""
    shutil.copytree(world / SHELVED, world / "policies/pendulum/expert")
    keyed(env_id="Pendulum-v1")(world / "policies/pendulum/expert/card.json")


SHELF = {
    "a card cut off": card(cut, "not readable JSON"),
    "a card that is a list": card(being("[]"), "not a policy card", "lacks"),
    "a card that lacks a field": card(keyed(return_mean=...), "lacks return_mean"),
    "a card of other types": card(keyed(steps="many"), "steps", "int", words="experts list"),
    "a card with nan": card(keyed(return_mean=float("nan")), "return_mean", "nan", words="experts evaluate"),
    "a card whose environment is of a module": card(
        keyed(env_id="evil:Env-v0"), "'evil'", words="experts evaluate"
    ),
    "a card without its policy": policy(gone, "missing", "irl experts train"),
    "a policy of another byte": policy(flipped, "sha256", "--overwrite"),
    "a policy that is not its card's": policy(tensors(lambda w: None, {"version": 9}), "sha256"),
    "a policy of another task": Case(
        "demos generate --env-id Pendulum-v1", ("Pendulum-v1", TASK, "--overwrite"), of_another_task
    ),
    "a shelf that is a file": Case(
        "demos generate --env-id Cliff-v0 --policies-root notes.txt",
        ("no expert policy", "irl experts train"),
    ),
}

ENVIRONMENTS = {
    f"{fault}: {words.split()[0]}": Case(words, (TASK, *named), fault=fault)
    for fault, named, commands in (
        ("raises when made", ("cannot make", "FileNotFoundError: no model.xml"), (GENERATE, TRAIN, EVALUATE)),
        (
            "raises at reset",
            ("the reset of", "ZeroDivisionError: a bug of two lines", "--debug"),
            (GENERATE, TRAIN, EVALUATE),
        ),
        ("raises at a step", ("the step 12 of", "seed", "ZeroDivisionError"), (GENERATE, EVALUATE)),
        ("nan at reset", ("nan in column 1", "at its reset"), (GENERATE, TRAIN, EVALUATE)),
        ("nan at a step", ("nan in column 1", "after step 12"), (GENERATE, EVALUATE)),
        ("another shape", ("(1,)", "(2,)", "after step 12"), (GENERATE, EVALUATE)),
        ("pays nan", ("episode 0", "nan in rewards", "step 0", "nothing was written"), (GENERATE,)),
        ("dict observations", ("Dict", "flat Box"), (GENERATE, TRAIN, EVALUATE)),
        ("tuple observations", ("Tuple", "flat Box"), (TRAIN,)),
        ("image observations", ("(8, 8, 3)", "uint8", "flat Box"), (TRAIN,)),
        ("byte observations", ("uint8", "flat Box"), (TRAIN,)),
        ("discrete observations", ("Discrete(4)", "flat Box"), (TRAIN,)),
        ("discrete actions", ("actions of 2", "2 and 4"), (TRAIN,)),
        ("several choices", ("MultiDiscrete", "flat Box"), (TRAIN,)),
        ("dict actions", ("Dict", "flat Box"), (TRAIN,)),
        ("unbounded actions", ("finite bounds",), (TRAIN,)),
    )
    for words in commands
}

LAST_POLICY, LAST_REWARD = f"{SNAPSHOT}/policy.safetensors", f"{SNAPSHOT}/reward"

REUSED = {
    "no snapshot to retrain on": Case(
        f"{RETRAIN} --snapshot 5", ("no snapshot of step 5", "768", "--snapshot")
    ),
    "a reward gone, to retrain on": Case(
        RETRAIN, ("no reward in", LAST_REWARD), at(f"{LAST_REWARD}/spec.json", gone)
    ),
    "a reward of other weights, to retrain on": Case(
        RETRAIN, (LAST_REWARD, "sha256"), at(f"{LAST_REWARD}/weights.safetensors", flipped)
    ),
    "a reward of another task, to retrain on": Case(
        RETRAIN, ("Hopper-v5", TASK), at(f"{LAST_REWARD}/spec.json", keyed(env_id="Hopper-v5"))
    ),
    "settings cut off, to retrain": Case(RETRAIN, ("not readable JSON",), at("run/config.json", cut)),
    "an environment of a module, to retrain": Case(
        RETRAIN, ("'evil'", "IRL_ENV_MODULES"), at("run/config.json", keyed(env_id="evil:Env-v0"))
    ),
    "raises at reset: retrain": Case(RETRAIN, (TASK, "the reset of", "--debug"), fault="raises at reset"),
    "raises when made: retrain": Case(RETRAIN, (TASK, "cannot make"), fault="raises when made"),
    "no environment: export": Case(EXPORT, (TASK, "cannot make"), fault="raises when made"),
    "retrained into a run": Case("retrain run --out run", ("run already holds a run", "--out")),
    "retrained below a file": Case("retrain run --out notes.txt/new", ("notes.txt", "a file is where")),
    "retraining what is no run": Case("retrain policies", ("policies", "holds no run")),
    "going on with a run as if retrained": Case("retrain --resume run", ("'gail'", "irl train --resume run")),
    "a policy cut off, to export": Case(EXPORT, (LAST_POLICY, "not a policy"), at(LAST_POLICY, cut)),
    "a policy gone, to export": Case(EXPORT, ("no policy file", LAST_POLICY), at(LAST_POLICY, gone)),
    "no snapshot to export": Case(f"{EXPORT} --snapshot 5", ("no snapshot of step 5", "768")),
    "exported over a file": Case("export run --out notes.txt", ("notes.txt", "--overwrite")),
    "exported below a file": Case("export run --out notes.txt/new.zip", ("notes.txt",)),
    "exporting what is no run": Case("export datasets", ("datasets", "holds no run")),
}

GATES = {
    f"a gate {what}": Case(f"{EVALUATE} --gate gate.toml", named, at("gate.toml", being(content)))
    for what, content, named in (
        ("cut off", "[bounds", ("gate.toml", "not readable TOML")),
        ("of bytes", b"\xff\xfe", ("gate.toml", "not readable TOML")),
        ("that is empty", "", ("states no bound", "[bounds]")),
        ("of an unknown part", "[limits]\nscore = 1", ("no part 'limits'", "bounds, verdicts")),
        ("of an unknown bound", "[bounds]\nfame = { min = 1 }", ("no bound 'fame'", "score")),
        ("of an unknown verdict", "[verdicts]\nfine = true", ("no verdict 'fine'", "hacked")),
        ("of a number", "[bounds]\nscore = 1", ("bounds.score is 1", "min = 0.5")),
        ("of text", '[bounds]\nscore = { min = "a" }', ("bounds.score", "min = 0.5")),
        ("of nan", "[bounds]\nscore = { min = nan }", ("bounds.score", "min = 0.5")),
        ("turned round", "[bounds]\nscore = { min = 2, max = 1 }", ("bounds.score", "min = 0.5")),
        ("of a verdict of a number", "[verdicts]\nhacked = 1", ("verdicts.hacked", "true or false")),
        ("of a list", "bounds = [1]", ("bounds is [1]", "expected a table")),
    )
} | {"no gate": Case(f"{EVALUATE} --gate gate.toml", ("no gate file gate.toml",))}

PLACES = {
    "a dataset outside the root": Case("demos show ../../x-v0", ("'../../x-v0'", "not a dataset id")),
    "a dataset with no version": Case(
        "demos show irl/pointmass", ("not a dataset id", "irl/hopper/expert-v0")
    ),
    "a dataset of an absolute path": Case("demos show /etc/x-v0", ("not a dataset id",)),
    "a dataset to be made outside": Case(f"{GENERATE} --dataset-id ../x-v0", ("not a dataset id",)),
    "a dataset inside another": Case(
        f"{GENERATE} --dataset-id {DATASET}/more-v0", ("is a dataset", "choose another id")
    ),
    "a dataset that is there": Case(f"{GENERATE} --dataset-id {DATASET}", ("already", "--overwrite")),
    "a level that leads elsewhere": Case(
        f"{GENERATE} --level ../../x", ("'../../x' is not a level", "expert")
    ),
    "a level to be measured elsewhere": Case("experts evaluate --level a/b", ("'a/b' is not a level",)),
    "a level to be trained elsewhere": Case(
        f"experts train --env-id {TASK} --level ../x", ("'../x' is not a level",)
    ),
    "a level that is a parent": Case(f"{GENERATE} --level ..", ("'..' is not a level",)),
    "a run below a file": Case(f"{TRAIN} --out notes.txt/run", ("notes.txt", "a file is where a folder")),
    "a dataset below a file": Case(f"{GENERATE} --datasets-root notes.txt", ("notes.txt",)),
    "a run in the system's own": Case(f"{TRAIN} --out /proc/run", ("/proc",)),
    "a run that is a file": Case("evaluate notes.txt", ("notes.txt", "holds no run")),
    "a run that is no run": Case("evaluate policies", ("policies", "holds no run")),
    "a run that is there": Case(f"{TRAIN} --out run", ("run", "--out", "irl train --resume run")),
    "an environment with two colons": Case("train gail --env-id a:b:C-v0 --out new", ("a:b:C-v0",)),
    "an environment of no module": Case("train gail --env-id no_such:C-v0 --out new", ("no_such",)),
}
