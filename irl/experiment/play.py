"""Plays an algorithm to its end, and lets the run folder listen.

Nothing here changes a weight: evaluation, snapshots, curves and the progress bar have their own
environments and random streams.
"""

import signal
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np

from irl.algorithms.loop import Round
from irl.core.differences import differences, without
from irl.core.errors import UserError
from irl.core.finite import NotFinite
from irl.core.memory import peak_memory
from irl.core.metrics import Row
from irl.core.provenance import command_line, environment
from irl.core.records import RunFolder, snapshot_steps
from irl.core.rng import episode_seeds
from irl.core.types import Metrics, RewardFn
from irl.diagnostics.overoptimisation import standard_errors
from irl.diagnostics.stack import read_episodes
from irl.envs.rollouts import rollouts
from irl.experiment.curves import curves
from irl.experiment.imitation_run import Watch
from irl.experiment.progress import progress, training_words
from irl.policies.policy import Policy

MOST_CHECKPOINTING = 0.02
"""Share of the time that checkpoints may take."""

MAY_CHANGE = ("watch", "out", "datasets_root", "run")
"""Settings that change no weight, places among them: they may be others when a run goes on."""

EVALUATION = "evaluation while training"
"""The stream of its episodes' starts."""

RECENT = 20
"""Training episodes that `return_mean` is the mean of."""


@runtime_checkable
class Watched(Protocol):
    """What a run folder wants to know of a learner, or of anything that a policy comes from."""

    @property
    def env_steps(self) -> int: ...
    def take_finished(self) -> list[tuple[float, int]]: ...
    def policy(self) -> Policy: ...
    def close(self) -> None: ...


@runtime_checkable
class Algorithm(Protocol):
    """What can be played."""

    @property
    def learner(self) -> Watched: ...
    @property
    def index(self) -> int: ...
    def rounds(self, steps: int) -> Iterator[Round]: ...
    def state_dict(self) -> dict[str, Any]: ...
    def load_state_dict(self, state: dict[str, Any]) -> None: ...


class Interrupted(Exception):
    """Ctrl-C or SIGTERM: the round was finished and a checkpoint written."""


class Player:
    """One algorithm, one folder, and what was seen so far."""

    def __init__(
        self,
        algorithm: Algorithm,
        folder: RunFolder,
        watch: Watch,
        *,
        env_id: str,
        steps: int,
        seed: int,
        snapshot: Callable[[Path], None],
        reward: RewardFn | None = None,
    ) -> None:
        """`snapshot` fills the folder it is given. With `reward`, evaluations are judged by that as well."""
        self.algorithm, self.folder, self.watch = algorithm, folder, watch
        self.env_id, self.steps, self.snapshot, self.reward = env_id, steps, snapshot, reward
        self._eval_seeds = episode_seeds(seed, EVALUATION, watch.eval_episodes)
        self._recent: deque[tuple[float, int]] = deque(maxlen=RECENT)
        self._wall_s = self._checkpoint_s = self._last_save_s = 0.0

    def run(self, to_go_on: str) -> None:
        """Go on from the last checkpoint, play to the end, and close the environments.

        Raises:
            Interrupted: the user asked to stop; `to_go_on`, the command that goes on, was printed.
            UserError: another process plays this run, its settings are not those it was begun with, or
                a number stopped being finite.
        """
        try:
            with self.folder.locked():
                self.resume()
                self.play()
            print(f"peak memory {peak_memory() / 1e9:.2f} GB", file=sys.stderr)
        except Interrupted:
            print(f"stopped; go on with: {to_go_on}", file=sys.stderr)
            raise
        except NotFinite as error:
            raise UserError(self._diverged(error, to_go_on)) from error
        finally:
            self.algorithm.learner.close()

    def _diverged(self, error: NotFinite, to_go_on: str) -> str:
        rounds, kept = self.algorithm.index + 1, self.folder.checkpoints()
        words = f"training stopped in round {rounds}: {error}; "
        if not kept:
            return words + "there was no checkpoint yet; lower a learning rate and begin again"
        return words + (
            f"the checkpoint of step {max(kept):,} is good and kept. Going on ({to_go_on}) comes to the same "
            f"end; begin again with a lower learning rate"
        )

    def resume(self) -> None:
        """Go on from the folder's last checkpoint; from the start when there is none.

        A damaged last checkpoint is left for the one before, and said.
        """
        content, damaged = self.folder.load_checkpoint()
        for words in damaged:
            print(f"irl: {words}; going on from the checkpoint before", file=sys.stderr)
        if content is not None:
            self._same_settings(content["config"])
            self.algorithm.load_state_dict(content["algorithm"])
            self._recent.extend(content["recent"])
            self._wall_s, self._checkpoint_s = content["wall_s"], content["checkpoint_s"]
            if (done := self.algorithm.learner.env_steps) < self.steps:
                device = str(self.folder.config.get("device", "cpu"))
                self.folder.goes_on(done, environment(command_line(), device))
        self.folder.forget_rounds_after(self.algorithm.index)

    def _same_settings(self, before: dict[str, Any]) -> None:
        changed = differences(without(before, MAY_CHANGE), without(self.folder.config, MAY_CHANGE))
        if changed:
            raise UserError(
                f"{self.folder.path} was begun with other settings than its config.json has now: "
                f"{'; '.join(changed)}. Undo that, or begin a new run with --config and --out"
            )

    def play(self) -> None:
        """Play to the end.

        Raises:
            Interrupted: the user asked to stop; a checkpoint is there to go on from.
        """
        learner = self.algorithm.learner
        began, start = time.monotonic() - self._wall_s, learner.env_steps
        saved = time.monotonic()
        due = [step for step in snapshot_steps(self.steps) if step > start or step == start == 0]
        due = self._snapshots(due)
        with (
            asked_to_stop() as asked,
            curves(self.folder.path, start, self.watch.tensorboard) as draw,
            progress(self.folder.path.name, self.steps, start, self.watch.progress) as report,
        ):
            for round_ in self.algorithm.rounds(self.steps):
                row = self._row(round_, time.monotonic() - began)
                self.folder.append(row)
                draw(row)
                due = self._snapshots(due)
                rate = (learner.env_steps - start) / (time.monotonic() - began - self._wall_s)
                report(min(learner.env_steps, self.steps), training_words(row, rate))
                late = time.monotonic() - saved > self._between_checkpoints()
                if late or asked() or learner.env_steps >= self.steps:
                    self._checkpoint(time.monotonic() - began)
                    saved = time.monotonic()
                if asked():
                    # after the last round too: who asked does not want what comes next
                    raise Interrupted

    def _between_checkpoints(self) -> float:
        """Seconds: as asked for, or more where writing takes long; 0 is after every round."""
        every = self.watch.checkpoint_every_s
        return max(every, self._last_save_s / MOST_CHECKPOINTING) if every else 0.0

    def _row(self, round_: Round, wall_s: float) -> Row:
        self._recent.extend(self.algorithm.learner.take_finished())
        returns = [value for value, _ in self._recent]
        lengths = [length for _, length in self._recent]
        row: Row = {
            "round": round_.index,
            "env_steps": round_.env_steps,
            "wall_s": round(wall_s, 3),
            "checkpoint_s": round(self._checkpoint_s, 3),
            "return_mean": float(np.mean(returns)) if returns else None,
            "length_mean": float(np.mean(lengths)) if lengths else None,
        }
        return {**row, **round_.metrics, **self._evaluation(round_)}

    def _evaluation(self, round_: Round) -> Metrics:
        last, every = round_.env_steps >= self.steps, self.watch.eval_every
        if self.watch.eval_episodes == 0 or not (last or (every and round_.index % every == 0)):
            return {}
        return evaluated(self.env_id, self.algorithm.learner.policy(), self._eval_seeds, self.reward)

    def _snapshots(self, due: list[int]) -> list[int]:
        """Take the snapshot that is due, if one is; return those that are not yet."""
        steps = self.algorithm.learner.env_steps
        if any(step <= steps for step in due):
            with self.folder.snapshot(steps) as folder:
                self.snapshot(folder)
        return [step for step in due if step > steps]

    def _checkpoint(self, wall_s: float) -> None:
        content = {
            "algorithm": self.algorithm.state_dict(),
            "recent": [list(item) for item in self._recent],
            "wall_s": wall_s,
            "checkpoint_s": self._checkpoint_s,
            "config": self.folder.config,
        }
        began = time.monotonic()
        self.folder.save_checkpoint(self.algorithm.learner.env_steps, content)
        self._last_save_s = time.monotonic() - began
        self._checkpoint_s += self._last_save_s


def evaluated(env_id: str, policy: Policy, seeds: Sequence[int], reward: RewardFn | None) -> Metrics:
    """What a row of metrics.jsonl has of a policy in these episodes; by `reward` too where there is one."""
    episodes = rollouts(env_id, policy, seeds)
    returns = np.array([episode.return_ for episode in episodes])
    seen = {
        "eval_return_mean": float(returns.mean()),
        "eval_return_stderr": float(standard_errors([returns])[0]),
        "eval_length_mean": float(np.mean([len(episode) for episode in episodes])),
    }
    if reward is not None:
        learned = [given.sum() for given in read_episodes(reward, episodes)]
        seen["eval_learned_return_mean"] = float(np.mean(learned))
    return seen


@contextmanager
def asked_to_stop() -> Iterator[Callable[[], bool]]:
    """Whether SIGINT or SIGTERM came; the second one of a kind ends the process as usual."""
    asked = False

    def note(number: int, frame: object) -> None:
        nonlocal asked
        asked = True
        signal.signal(number, before[signal.Signals(number)])

    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        for number in before:
            signal.signal(number, note)
    except ValueError:
        # not the main thread: signals are somebody else's
        yield lambda: False
        return
    try:
        yield lambda: asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
