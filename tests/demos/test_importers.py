"""Files that other tools wrote come in as the episodes that went into them."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas
import pyarrow as arrow
import pytest
from pyarrow import parquet

from irl.core.errors import UserError
from irl.core.types import Episode
from irl.demos.importers import import_file
from irl.demos.load import Demos, load_demos
from irl.envs.make import make
from irl.envs.rollouts import random_act, rollouts
from tests import pointmass
from tests.demos.files import Arrays, flat, with_ids, write_csv, write_d4rl, write_npz

TASK = "PointMass-v0"


@pytest.fixture(scope="module")
def episodes() -> list[Episode]:
    return pointmass.demonstrations(3)


@pytest.fixture
def imported(tmp_path: Path) -> Callable[..., Demos]:
    def run(path: Path, env_id: str = TASK, **more) -> Demos:
        import_file(path, env_id, dataset_id="irl/x/imported-v0", root=tmp_path, overwrite=True, **more)
        return load_demos("irl/x/imported-v0", root=tmp_path)

    return run


def same(found: Demos, made: list[Episode], atol: float = 0.0) -> None:
    assert len(found) == len(made)
    for a, b in zip(found, made, strict=True):
        for name in ("obs", "action", "reward"):
            np.testing.assert_allclose(getattr(a, name), getattr(b, name), rtol=0, atol=atol)
        assert (a.terminated, a.truncated) == (b.terminated, b.truncated)


@pytest.mark.parametrize("change", [lambda a: a, with_ids], ids=["flags", "ids and steps"])
@pytest.mark.parametrize(
    ("write", "suffix", "atol"),
    [(write_npz, "npz", 0.0), (write_csv, "csv", 0.0), (write_d4rl, "hdf5", 1e-6)],
)
def test_every_kind_of_file(write, suffix, atol, change, episodes, imported, tmp_path) -> None:
    found = imported(write(tmp_path / f"demos.{suffix}", change(flat(episodes))))
    same(found, episodes, atol)
    assert found.env_id == TASK
    assert found.expert_return == pytest.approx(np.mean([e.return_ for e in episodes]), abs=1e-4)


def test_timeouts_are_truncations_and_terminals_terminations(imported, tmp_path) -> None:
    env = make("Hopper-v5")
    act = random_act(env.action_space, np.random.default_rng(0))
    env.close()
    made = rollouts("Hopper-v5", act, range(3))
    arrays = flat(made)
    assert arrays["terminals"].sum() == 3
    # the second was cut off by the clock, the third by the end of the file
    ends = np.flatnonzero(arrays["terminals"])
    arrays["timeouts"][ends[1]], arrays["terminals"][ends[1:]] = True, False
    found = imported(write_d4rl(tmp_path / "hopper.hdf5", arrays), "Hopper-v5")
    assert [(e.terminated, e.truncated) for e in found] == [(True, False), (False, True), (False, True)]
    assert set(found[0].infos) == {"x_position", "action_log_probs"}


def test_observations_with_the_one_after_the_last_step(episodes, imported, tmp_path) -> None:
    arrays = flat(episodes)
    del arrays["next_observations"]
    arrays["observations"] = np.concatenate([e.obs for e in episodes])
    same(imported(write_npz(tmp_path / "a.npz", arrays)), episodes)
    stacked = {"obs": np.stack([e.obs for e in episodes]), "acts": np.stack([e.action for e in episodes])}
    stacked["rews"] = np.stack([e.reward for e in episodes])
    same(imported(write_npz(tmp_path / "b.npz", stacked)), episodes)
    ends = {"terminals": np.array([True, False, True])}
    found = imported(write_npz(tmp_path / "c.npz", stacked | ends))
    assert [e.terminated for e in found] == [True, False, True]


def test_without_next_observations_the_last_row_is_only_an_observation(episodes, tmp_path) -> None:
    arrays = flat(episodes)
    del arrays["next_observations"]
    arrays["terminals"], arrays["timeouts"] = arrays["timeouts"], arrays["terminals"]
    path = write_npz(tmp_path / "a.npz", arrays | {"extra": np.zeros(7)})
    info, notes = import_file(path, TASK, dataset_id="a-v0", root=tmp_path)
    assert info.steps == sum(map(len, episodes)) - 3
    assert "3 actions and 3 terminations are left out" in notes[0]
    assert notes[1] == "not used: extra"
    for a, b in zip(load_demos("a-v0", root=tmp_path), episodes, strict=True):
        np.testing.assert_array_equal(a.obs, b.obs[:-1])
        assert (a.terminated, a.truncated) == (False, True)


def test_no_rewards_and_no_actions(episodes, imported, tmp_path) -> None:
    states = {k: v for k, v in flat(episodes).items() if k not in ("actions", "rewards")}
    found = imported(write_npz(tmp_path / "states.npz", states))
    assert [e.action.shape for e in found] == [(30, 0)] * 3
    assert all(np.isnan(e.reward).all() for e in found)
    assert (found.random_return, found.expert_return) == (None, None)
    np.testing.assert_array_equal(found[1].obs, episodes[1].obs)


def test_an_info_of_the_whole_file_is_not_used(episodes, tmp_path) -> None:
    path = write_npz(tmp_path / "a.npz", flat(episodes) | {"infos/k": np.array(3.0), "infos/j": np.zeros(90)})
    info, notes = import_file(path, TASK, dataset_id="a-v0", root=tmp_path)
    assert (info.infos, notes) == (("j",), ("not used: infos/k",))


def test_why_episodes_end_is_asked_where_the_file_leaves_it_open(episodes, tmp_path) -> None:
    def notes(arrays: Arrays) -> tuple[str, ...]:
        path = write_npz(tmp_path / "a.npz", arrays)
        return import_file(path, TASK, dataset_id="a-v0", root=tmp_path, overwrite=True)[1]

    arrays = flat(episodes)
    assert notes(arrays) == ()
    (said,) = notes(with_ids(arrays))
    assert "all count as cut off by a time limit; an array `terminals`" in said
    assert all(e.truncated and not e.terminated for e in load_demos("a-v0", root=tmp_path))
    ends = arrays["timeouts"]
    (said,) = notes(arrays | {"terminals": ends, "timeouts": ~ends & ends})
    assert said.startswith("all 3 episodes that the task ended by `terminals` have exactly the 30 steps")
    assert "`dones`" in said
    # one that ended earlier speaks for the flags
    early = {k: v[5:] for k, v in (arrays | {"terminals": ends}).items() if k != "timeouts"}
    assert notes(early) == ()
    # both at once: the file tells them apart
    assert notes(arrays | {"terminals": ends}) == ()


def choose(obs: np.ndarray) -> np.ndarray:
    """Balances CartPole for a while."""
    return np.eye(2)[int(obs[2] + obs[3] > 0)]


@pytest.mark.parametrize(
    "actions",
    [lambda a: a, lambda a: a.argmax(1), lambda a: a.argmax(1).astype(float)[:, None]],
    ids=["rows", "choices", "a column"],
)
def test_choices(actions, imported, tmp_path) -> None:
    made = rollouts("CartPole-v1", choose, range(2))
    arrays = flat(made)
    arrays["actions"] = actions(arrays["actions"])
    same(imported(write_npz(tmp_path / "cartpole.npz", arrays), "CartPole-v1"), made)


def test_a_table_of_pandas(episodes, imported, tmp_path) -> None:
    plain = with_ids(flat(episodes))
    columns = {k: v for k, v in plain.items() if v.ndim == 1}
    for name, short in (("observations", "obs"), ("actions", "action"), ("next_observations", "next_obs")):
        columns |= {f"{short}_{i}": plain[name][:, i] for i in range(2)}
    pandas.DataFrame(columns).to_csv(tmp_path / "table.csv", index=False)
    # float32 in as few digits as tell it apart
    same(imported(tmp_path / "table.csv"), episodes, atol=1e-7)


def test_parquet_as_lerobot_writes_it(episodes, imported, tmp_path) -> None:
    plain = with_ids(flat(episodes))
    table = {
        "observation.state": arrow.FixedSizeListArray.from_arrays(plain["observations"].ravel(), 2),
        "action": arrow.array(plain["actions"].tolist(), arrow.list_(arrow.float32())),
        "next.reward": plain["rewards"],
        "next.done": np.diff(np.append(plain["episode_ids"], -1)) != 0,
        "episode_index": plain["episode_ids"],
        "frame_index": plain["steps"],
        "task": ["go"] * len(plain["steps"]),
    }
    parquet.write_table(arrow.table(table), tmp_path / "a.parquet")
    found = imported(tmp_path / "a.parquet")
    for a, b in zip(found, episodes, strict=True):
        np.testing.assert_array_equal(a.obs, b.obs[:-1])
        np.testing.assert_allclose(a.action, b.action[:-1], atol=1e-6)


def test_pyarrow_is_asked_for_by_name(tmp_path, monkeypatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    (tmp_path / "a.parquet").touch()
    with pytest.raises(UserError, match="pip install pyarrow"):
        import_file(tmp_path / "a.parquet", TASK, dataset_id="a-v0", root=tmp_path)


def changed(**changes: np.ndarray | None) -> Callable[[Arrays], Arrays]:
    return lambda arrays: {k: v for k, v in (arrays | changes).items() if v is not None}


def put(name: str, place: tuple[int, ...], value: float) -> Callable[[Arrays], Arrays]:
    def run(arrays: Arrays) -> Arrays:
        arrays[name][place] = value
        return arrays

    return run


def rows(order: Callable[[np.ndarray], np.ndarray]) -> Callable[[Arrays], Arrays]:
    return lambda arrays: {k: v[order(np.arange(len(v)))] for k, v in with_ids(arrays).items()}


NONE = np.zeros(90, bool)
# 3 episodes of 30 steps
WRONG: dict[str, tuple[Callable[[Arrays], Arrays], str]] = {
    "another size": (
        changed(observations=np.zeros((90, 3)), next_observations=None),
        "have 3 numbers",
    ),
    "another size of actions": (changed(actions=np.zeros((90, 1))), r"actions have \(1,\) numbers"),
    "a row too few": (changed(actions=np.zeros((89, 2))), "90 rows of .* for 89 steps"),
    "observations too few": (
        changed(observations=np.zeros((80, 2))),
        "80 observations for 90 steps in 3 episodes; expected 90, .* 93",
    ),
    "no borders": (changed(terminals=None, timeouts=None), "where episodes end; expected terminals .* dones"),
    "a missing border": (changed(timeouts=NONE), "episode 0 has .* next observation at step 29.* not marked"),
    "a missing border, nothing else": (
        changed(timeouts=NONE, next_observations=None),
        "episode 0 has 89 steps, PointMass-v0 ends after 30",
    ),
    "an action out of bounds": (
        put("actions", (40, 1), 1.5),
        "episode 1 has 1.5 in actions, column 1, at step 10; PointMass-v0 has -1 to 1 .*clipped",
    ),
    "an observation out of bounds": (
        lambda a: put("next_observations", (39, 0), 9.0)(put("observations", (40, 0), 9.0)(a)),
        "episode 1 has 9 in observations, column 0, at step 10; .* -1.5 to 1.5",
    ),
    "nan for a flag": (
        changed(terminals=np.full(90, np.nan)),
        "nan in row 0 of terminated .*terminals.*; expected 0 or 1",
    ),
    "nan": (put("rewards", (65,), np.nan), "episode 2 has nan in rewards at step 5"),
    "another next observation": (
        put("next_observations", (33, 1), 0.5),
        "episode 1 has 0.5 in column 1 of the next observation at step 3.* at step 4; the rows are out of",
    ),
    "two rows exchanged": (
        rows(lambda i: np.where(i == 31, 32, np.where(i == 32, 31, i))),
        "episode 1 goes from step 0 to step 2 in row 31; expected 1",
    ),
    "episodes mixed": (
        rows(lambda i: np.where(i == 31, 89, i)),
        "episode 1 goes on in row 32",
    ),
    "two columns of rewards": (changed(rewards=np.zeros((90, 2))), r"rewards of shape \(90, 2\)"),
    "no observations": (changed(observations=None), "no array 'observations'; it has 'actions'"),
    "nothing": (lambda a: {k: v[:0] for k, v in a.items()}, "no rows"),
    "two of one meaning": (changed(obs=np.zeros((90, 2))), "several arrays of obs"),
    "one timeout for all": (changed(timeouts=np.array(False)), "timeouts as the single value False"),
    "one reward for all": (changed(rewards=np.array(1.5)), "rewards as the single value 1.5; .* each step"),
    "one observation": (changed(observations=np.array(0.0)), "observations as the single value 0.0"),
    "text": (changed(actions=np.array(["left"] * 90)), "actions of <U4; expected numbers"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_named_and_nothing_is_written(name, episodes, tmp_path) -> None:
    change, said = WRONG[name]
    path = write_npz(tmp_path / "wrong.npz", change(flat(episodes)))
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(UserError, match=said) as caught:
        import_file(path, TASK, dataset_id="irl/x/wrong-v0", root=tmp_path)
    assert str(caught.value).startswith(f"{path}")
    assert "\n" not in str(caught.value)
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("obs_0,obs_1,action_0\n1,2\n", "line 2 has 2 columns, the first line names 3"),
        ("obs_0,obs_1,episode\n1,2,0\n1,x,0\n", "line 3 has 'x' in column 'obs_1'; expected a number"),
        ("obs_0,obs_2,episode\n1,2,0\n", "2 columns obs_.* none is obs_1"),
        ("obs_0,obs_0\n1,2\n", "names a column twice"),
        ("", "no array 'observations'"),
        ("obs_0,obs_1\n1,2\n1,2\n", "where episodes end"),
    ],
)
def test_lines_that_are_wrong(text, said, tmp_path) -> None:
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(UserError, match=said):
        import_file(tmp_path / "a.csv", TASK, dataset_id="a-v0", root=tmp_path)


def test_an_action_that_is_no_choice(tmp_path) -> None:
    arrays = flat(rollouts("CartPole-v1", choose, range(2)))
    for wrong, said in ((2, "episode 0: the action 2 at step 3 is none of 0 to 1"), (0.5, "whole numbers")):
        actions = arrays["actions"].argmax(1).astype(float)
        actions[3] = wrong
        path = write_npz(tmp_path / "a.npz", arrays | {"actions": actions})
        with pytest.raises(UserError, match=said):
            import_file(path, "CartPole-v1", dataset_id="a-v0", root=tmp_path)
