"""Which demonstrations a run learns from: drawn once, written down, and the same ever after."""

from pathlib import Path
from typing import Any

from irl.core import files
from irl.core.errors import UserError
from irl.core.records import RunFolder
from irl.demos.load import Demos, check_task, load_demos
from irl.envs.make import make
from irl.experiment.configs import GAILRun

RECORD = "demonstrations.json"


def draw(config: GAILRun) -> Demos:
    """The demonstrations that the settings name.

    Raises:
        UserError: there are none, too few, or they are of another task.
    """
    env = make(config.env_id)
    try:
        wanted, root = config.demo_episodes, config.datasets_root
        demos = load_demos(config.demos, episodes=wanted, seed=config.seed, root=root)
        check_task(demos, env)
        return demos
    finally:
        env.close()


def drawn(demos: Demos) -> dict[str, Any]:
    """What is written down of them."""
    return {
        "dataset": demos.dataset_id,
        "episodes": list(demos.indices),
        "held_out": list(demos.held_out_indices),
        "returns": [episode.return_ for episode in demos],
        "held_out_returns": [episode.return_ for episode in demos.held_out],
    }


def drawn_again(config: GAILRun, folder: RunFolder, root: Path | None = None) -> Demos:
    """The demonstrations that the run in `folder` was begun with.

    Raises:
        UserError: the dataset is another one now.
    """
    where = root or config.datasets_root
    demos = load_demos(config.demos, episodes=config.demo_episodes, seed=config.seed, root=where)
    if drawn(demos) != files.read_json(folder.path / RECORD):
        raise UserError(
            f"{config.demos} in {demos.path} is not the dataset that {folder.path} was begun with; "
            f"name the folder that holds it with --datasets-root, or set MINARI_DATASETS_PATH"
        )
    return demos
