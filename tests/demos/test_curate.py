"""Merged and split datasets hold the episodes they were made of."""

import io
import json

import numpy as np
import pytest
from rich.console import Console

from irl.core.errors import UserError
from irl.demos.curate import merge, split
from irl.demos.generate import generate
from irl.demos.info import show, table
from irl.demos.load import load_demos
from irl.demos.metadata import env_name
from tests.demos.test_importers import choose


def same(found, made) -> None:
    for a, b in zip(found, made, strict=True):
        for name in ("obs", "action", "reward"):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
        assert (a.seed, a.terminated, a.truncated) == (b.seed, b.terminated, b.truncated)
        assert a.terms.keys() == b.terms.keys()
        for name, values in {**a.terms, **a.infos}.items():
            np.testing.assert_array_equal(values, {**b.terms, **b.infos}[name])


def test_a_split_and_its_merge(make_hopper, tmp_path) -> None:
    make_hopper()
    names = ("irl/hopper/train-v0", "irl/hopper/held-out-v0")
    kept, away = split("irl/hopper/random-v0", names, held_out=0.4, seed=0, root=tmp_path)
    assert (kept.episodes, away.episodes) == (3, 2)
    assert sorted(seed or 0 for seed in kept.seeds + away.seeds) == [11, 12, 13, 14, 15]
    assert (kept.random_return, kept.expert_return, kept.env_id) == (20.0, 120.0, "Hopper-v5")
    assert kept.terms == ("forward", "ctrl", "survive")
    again = split("irl/hopper/random-v0", ("a-v0", "b-v0"), held_out=0.2, seed=0, root=tmp_path)[1]
    assert set(again.seeds) < set(away.seeds)
    merged = merge(names, "irl/hopper/all-v0", root=tmp_path)
    assert merged.seeds == kept.seeds + away.seeds
    assert (merged.random_return, merged.algorithm, merged.author) == (20.0, "random", "somebody")
    made = {e.seed: e for e in load_demos("irl/hopper/random-v0", root=tmp_path)}
    same(load_demos("irl/hopper/all-v0", root=tmp_path), [made[seed] for seed in merged.seeds])


def test_choices_are_merged(tmp_path) -> None:
    words = {"root": tmp_path, "algorithm": "a", "author": "b", "random_return": 20.0, "description": ""}
    for i, expert in enumerate((200.0, 300.0)):
        generate("CartPole-v1", choose, dataset_id=f"{'ab'[i]}-v0", seeds=[i], expert_return=expert, **words)
    info = merge(["a-v0", "b-v0"], "c-v0", root=tmp_path)
    assert (info.random_return, info.expert_return, info.action_size) == (20.0, None, 2)
    parts = [load_demos(name, root=tmp_path)[0] for name in ("a-v0", "b-v0")]
    same(load_demos("c-v0", root=tmp_path), parts)


def test_one_episode_is_not_split(make_hopper, tmp_path) -> None:
    make_hopper(seeds=[1])
    with pytest.raises(UserError, match="has 1 episodes; expected at least 2"):
        split("irl/hopper/random-v0", ("a-v0", "b-v0"), held_out=0.5, seed=0, root=tmp_path)


def test_a_variant_is_not_merged_with_the_task(tmp_path) -> None:
    words = {"root": tmp_path, "algorithm": "a", "author": "b", "random_return": None, "expert_return": None}
    variant = 'CartPole-v1?{"sutton_barto_reward":true}'
    for name, task in (("a-v0", "CartPole-v1"), ("b-v0", variant)):
        info = generate(task, choose, dataset_id=name, seeds=[0], description="", **words)
        assert (info.env_id, info.env_name) == ("CartPole-v1", task)
    shown = io.StringIO()
    Console(file=shown, width=200).print(table(show("b-v0", tmp_path)))
    assert variant in shown.getvalue()
    with pytest.raises(UserError) as caught:
        merge(["a-v0", "b-v0"], "c-v0", root=tmp_path)
    assert str(caught.value) == (
        f"a-v0 has the task CartPole-v1, b-v0 has {variant}; merge datasets of one task"
    )


def test_how_a_task_is_looked_at_makes_no_variant() -> None:
    spec = {"id": "Hopper-v5", "kwargs": {"render_mode": "rgb_array", "b": [1], "a": {"x": None}}}
    assert env_name(json.dumps(spec)) == 'Hopper-v5?{"a":{"x":null},"b":[1]}'
    assert env_name('{"id": "Hopper-v5"}') == "Hopper-v5"
    # registered with cliff=1
    assert env_name('{"id": "Cliff-v0", "kwargs": {"cliff": 1.0}}') == "Cliff-v0"
    assert env_name('{"id": "Cliff-v0", "kwargs": {"cliff": 2}}') == 'Cliff-v0?{"cliff":2}'
    with pytest.raises(UserError, match=r"env_spec\.kwargs"):
        env_name('{"id": "Hopper-v5", "kwargs": [1]}')
