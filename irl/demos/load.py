"""Demonstrations for training, and the rest of them for judging what was trained."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import overload

import gymnasium as gym
from gymnasium.spaces import Box

from irl.core.errors import UserError
from irl.core.rng import stream
from irl.core.types import Episode
from irl.demos.bounds import action_outside
from irl.demos.metadata import env_name
from irl.demos.storage import open_dataset, read_episodes
from irl.demos.write import origin_of
from irl.envs.flatten import part_names
from irl.envs.names import other_parts
from irl.envs.tasks import known_apart


@dataclass(frozen=True, eq=False, repr=False)
class Demos(Sequence[Episode]):
    """The episodes drawn for training, as a sequence, and beside it those held out."""

    episodes: tuple[Episode, ...]
    held_out: tuple[Episode, ...]
    indices: tuple[int, ...]
    """Positions of `episodes` in the dataset, ascending."""
    held_out_indices: tuple[int, ...]
    dataset_id: str
    env_id: str | None
    path: Path
    random_return: float | None
    """Mean return of random actions, the zero of a normalised score."""
    expert_return: float | None
    """Mean return of the expert, the one of a normalised score."""
    env_name: str | None = None
    """The task's full name (`irl.envs.names`): the id with the arguments that make it a variant."""

    def __len__(self) -> int:
        return len(self.episodes)

    @overload
    def __getitem__(self, index: int) -> Episode: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Episode, ...]: ...
    def __getitem__(self, index: int | slice) -> Episode | tuple[Episode, ...]:
        return self.episodes[index]

    def __repr__(self) -> str:
        steps = sum(len(episode) for episode in self.episodes)
        return (
            f"Demos({self.dataset_id}, {len(self)} episodes of {steps} steps, {len(self.held_out)} held out, "
            f"env {self.env_id})"
        )


def load_demos(
    dataset_id: str,
    *,
    episodes: int | None = None,
    seed: int = 0,
    root: Path | str | None = None,
    obs_keys: Sequence[str] = (),
) -> Demos:
    """Demonstrations of a dataset: `episodes` of them drawn with `seed`, the rest held out.

    With one seed, fewer episodes are a subset of more.

    Args:
        episodes: how many to train on; None takes all and holds none out.
        seed: of the draw, from its stream "demos".
        root: folder of the datasets; see `irl.demos.root.datasets_root` for what else is looked at.
        obs_keys: parts of observations in a dictionary that are put in a row, in this order.

    Raises:
        UserError: the dataset is not there or cannot be read, or has fewer episodes.
    """
    dataset = open_dataset(dataset_id, root, part_names(obs_keys))
    n = dataset.episodes if episodes is None else episodes
    if n < 1 or n > dataset.episodes:
        raise UserError(
            f"{n} demonstration episodes asked for, {dataset_id} has {dataset.episodes}; expected "
            f"1 to {dataset.episodes}"
        )
    every = read_episodes(dataset, root)
    drawn = stream(seed, "demos").permutation(len(every))
    chosen, rest = sorted(drawn[:n].tolist()), sorted(drawn[n:].tolist())
    return Demos(
        episodes=tuple(every[i] for i in chosen),
        held_out=tuple(every[i] for i in rest),
        indices=tuple(chosen),
        held_out_indices=tuple(rest),
        dataset_id=dataset_id,
        env_id=dataset.env_id,
        path=dataset.path,
        random_return=dataset.random_return,
        expert_return=dataset.expert_return,
        env_name=dataset.env_name,
    )


def check_task(demos: Demos, env: gym.Env, *, seen: bool = True) -> None:
    """Refuse demonstrations of another task than `env`'s, and actions that it would not take.

    Without actions they are refused where those are `seen` by who learns from them.

    Other shapes are always refused; equal ones where both tasks are known and differ, as Walker2d and
    HalfCheetah.

    Raises:
        UserError: names both tasks and their shapes; or the episode, the step, the action and its bounds.
    """
    shown = demos.env_id or demos.dataset_id
    wanted = env.spec.id if env.spec is not None else type(env.unwrapped).__name__
    has = demos[0].obs.shape[1], demos[0].action.shape[1]
    needs = (env.observation_space.shape or (0,))[0], (env.action_space.shape or (0,))[0]
    if has[1] == 0 and seen:
        raise UserError(
            f"demonstrations {demos.dataset_id} have no actions, which the discriminator judges, a "
            f"policy is cloned from, or a learner learns from (expert-share); without these let GAIL's or "
            f"DAC's judge states or pairs of them: "
            f"--discriminator.inputs obs, or obs_next_obs"
        )
    if has[0] != needs[0] or has[1] not in (0, needs[1]):
        raise UserError(
            f"demonstrations of {shown} have observations of {has[0]} and actions of {has[1]}; "
            f"{wanted} has {needs[0]} and {needs[1]}"
        )
    if known_apart(shown, wanted):
        raise UserError(
            f"demonstrations of {shown} are not of {wanted}, though both have observations of {has[0]} and "
            f"actions of {has[1]}"
        )
    name = env_name(origin_of(env).env_spec)
    if name and demos.env_name and other_parts(demos.env_name, name):
        raise UserError(
            f"demonstrations {demos.dataset_id} are of {demos.env_name:.300}, training is in {name:.300}: "
            f"other parts of the observations; name the demonstrations' with --env-kwargs"
        )
    if has[1]:
        _check_actions(demos, wanted, env.action_space)


def other_variant(demos: Demos, env: gym.Env) -> str | None:
    """A line where demonstrations are of another task of the same shapes, or of `env`'s with other arguments.

    None where they are not, or where it is not known. They are not refused: learning across versions, rewards
    or dynamics is a question of its own.
    """
    wanted = env_name(origin_of(env).env_spec)
    if env.spec is None or wanted is None or demos.env_name in (None, wanted):
        return None
    same = demos.env_id == env.spec.id
    mend = "the demonstrations' arguments with --env-kwargs" if same else "other demonstrations with --demos"
    return (
        f"demonstrations {demos.dataset_id} are of {demos.env_name:.300}, training is in {wanted:.300}; "
        f"where that is not meant, name {mend}"
    )


def _check_actions(demos: Demos, wanted: str, space: gym.Space) -> None:
    assert isinstance(space, Box)
    indices = (*demos.indices, *demos.held_out_indices)
    for index, episode in zip(indices, (*demos.episodes, *demos.held_out), strict=True):
        if said := action_outside(episode.action, space, wanted):
            raise UserError(f"demonstrations {demos.dataset_id}: episode {index} has {said}")
