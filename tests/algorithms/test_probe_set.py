"""Probes: the same for every run, named by their numbers, and files that say when a number was changed."""

import json
import zipfile
from pathlib import Path

import numpy as np
import pytest
from gymnasium.spaces import Box

from irl.algorithms.probe_file import load_probe, save_probe
from irl.algorithms.probe_make import at_shares, base_probe, own_strata
from irl.algorithms.probe_set import BASE, ProbeSet
from irl.core.errors import UserError
from irl.core.rng import stream
from irl.diagnostics.stack import stack
from irl.envs.make import make
from irl.envs.noise import noised
from tests import pointmass

TASK = "PointMass-v0"


def made(steps: int = 90) -> ProbeSet:
    return base_probe(TASK, pointmass.expert(), steps=steps)


def test_the_base_is_the_same_whenever_it_is_made() -> None:
    first, again = made(), made()
    assert tuple(first) == BASE
    assert first.base_sha256 == again.base_sha256
    assert first.base_sha256 != made(120).base_sha256
    assert {sum(map(len, episodes)) for episodes in first.values()} == {90}


def test_a_runs_own_policies_do_not_change_the_base() -> None:
    base = made()
    own = own_strata(TASK, {0: pointmass.expert(), 100: pointmass.expert()}, steps=60)
    both = ProbeSet(TASK, {**base, **own}, {**base.about, **own.about})
    assert list(own) == ["policy at 0 %", "policy at 100 %"]
    assert both.base_sha256 == base.base_sha256
    assert list(both.base) == list(base)
    assert stack(both).layout.names == tuple(both)


def test_noise_makes_an_expert_worse_and_worse() -> None:
    # how far from the origin an episode ends, wherever it began
    far = [np.mean([np.abs(e.obs[-10:]).mean() for e in made(300)[name]]) for name in BASE]
    assert far[0] < far[2] < far[1] < far[3]
    assert "no medium policy is shelved" in made().about["medium"]


def test_without_an_expert_held_out_demonstrations_take_its_place() -> None:
    found = base_probe(TASK, None, held_out=pointmass.demonstrations(4), steps=60)
    assert list(found) == ["expert", "random"]
    assert len(found["expert"]) == 2
    with pytest.raises(ValueError, match="needs an expert or demonstrations"):
        base_probe(TASK, None)


def test_a_task_of_short_episodes_has_a_smaller_probe() -> None:
    assert sum(map(len, made(10_000)["random"])) == 25 * pointmass.STEPS


def test_a_choice_of_actions_is_made_worse_too() -> None:
    env = make("CartPole-v1")
    assert isinstance(env.action_space, Box)
    first = np.array([1.0, 0.0])
    worse = noised(lambda obs: first, env.action_space, 0.5, stream(0, "noise"))
    chosen = np.array([worse(np.zeros(4)) for _ in range(400)])
    assert set(map(tuple, chosen)) == {(1, 0), (0, 1)}
    assert 0.65 < chosen[:, 0].mean() < 0.85


@pytest.fixture
def file(tmp_path: Path) -> Path:
    save_probe(made(), tmp_path / "probe.npz")
    return tmp_path / "probe.npz"


def test_what_is_loaded_is_what_was_saved(file: Path) -> None:
    probe, loaded = made(), load_probe(file)
    assert loaded.base_sha256 == probe.base_sha256
    assert loaded.about == probe.about
    first, again = probe["medium"][1], loaded["medium"][1]
    np.testing.assert_array_equal(first.obs, again.obs)
    assert (first.seed, first.terminated, first.truncated) == (again.seed, again.terminated, again.truncated)


def test_a_changed_number_is_refused(file: Path) -> None:
    with np.load(file) as archive:
        columns = {name: archive[name] for name in archive.files}
    columns["0/reward"][3] += 1e-12
    np.savez(file, **columns)
    with pytest.raises(UserError, match="numbers of 'expert' are not those that were written"):
        load_probe(file)


def test_a_pickle_is_not_read(file: Path) -> None:
    with np.load(file) as archive:
        columns = {name: archive[name] for name in archive.files}
    columns["0/obs"] = np.array([{"a": 1}], dtype=object)
    np.savez(file, **columns)
    with pytest.raises(UserError, match="not a probe this version reads"):
        load_probe(file)


def test_what_is_no_probe_is_refused(tmp_path: Path, file: Path) -> None:
    with pytest.raises(UserError, match="make a probe with: irl probe"):
        load_probe(tmp_path / "none.npz")
    for content in (b"", b"PK", file.read_bytes()[:2000]):
        (tmp_path / "bad.npz").write_bytes(content)
        with pytest.raises(UserError, match="not a probe this version reads"):
            load_probe(tmp_path / "bad.npz")
    about: dict = {"about.json": np.frombuffer(b'{"format":"x","version":9}', np.uint8)}
    np.savez(tmp_path / "new.npz", **about)
    with pytest.raises(UserError, match=r"expected irl\.probe 1"):
        load_probe(tmp_path / "new.npz")


def test_the_file_says_what_it_holds_without_irl(file: Path) -> None:
    assert all(name.endswith(".npy") for name in zipfile.ZipFile(file).namelist())
    with np.load(file, allow_pickle=False) as archive:
        about = json.loads(archive["about.json"].tobytes())
        assert [s["name"] for s in about["strata"]] == list(BASE)
        assert len(archive["3/action"]) == archive["3/length"].sum() == 90


def test_the_recorded_state_is_the_one_a_step_starts_from() -> None:
    env_id = "InvertedPendulum-v5"
    probe = base_probe(env_id, None, held_out=pointmass.demonstrations(1), steps=40)
    episode, env = probe["random"][0], make(env_id)
    try:
        env.reset(seed=0)
        for t in (0, len(episode) - 1):
            qpos, qvel = (
                np.array([episode.infos[f"{n}_{i}"][t] for i in range(2)]) for n in ("qpos", "qvel")
            )
            env.unwrapped.set_state(qpos, qvel)  # pyright: ignore[reportAttributeAccessIssue]
            after = env.step(episode.action[t])[0]
            np.testing.assert_allclose(after, episode.obs[t + 1], atol=1e-5)
    finally:
        env.close()


def test_snapshots_are_taken_at_shares_of_the_run() -> None:
    assert at_shares([0, 2, 5, 10, 26, 51, 74, 100]) == {0: 0, 25: 26, 50: 51, 75: 74, 100: 100}
    assert at_shares([7]) == {100: 7}
