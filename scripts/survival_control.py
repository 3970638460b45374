"""What is a survival bonus worth alone? GAIL's reward from a discriminator that never learns.

    python scripts/survival_control.py --env-id Hopper-v5

An untrained D says about .5 everywhere, so -log(1 - D) pays about .69 for each step lived, and nothing else.
PPO still learns from it: how not to fall. What it reaches has nothing to do with the demonstrations, so a
method must be held against it, and not against random actions, before it is said to imitate.
(Kostrikov et al. 2019, arXiv:1809.02925, report some 1000 of 3600 on Hopper.)
"""

import json
from dataclasses import dataclass
from pathlib import Path

import tyro

from irl.experiment.cli import main as irl


@dataclass(frozen=True)
class Settings:
    """Where, and for how long."""

    env_id: str = "Hopper-v5"
    """Gymnasium id of a task with demonstrations; make them with `irl demos generate`."""
    steps: int = 245_760
    """Environment steps."""
    seed: int = 1
    """Seed of everything random."""
    out: Path = Path("runs/survival-control")
    """Run folder."""


def main(settings: Settings) -> None:
    """Train, and print the true return of the policy at the last step."""
    still = ("--discriminator.lr=0", "--discriminator.gradient-penalty=0", "--schedule.epochs=1")
    run = ("--env-id", settings.env_id, "--seed", str(settings.seed), "--steps", str(settings.steps))
    irl(["train", "gail", *run, *still, "--out", str(settings.out)])
    last = json.loads((settings.out / "metrics.jsonl").read_text().splitlines()[-1])
    print(
        f"{settings.env_id}, D untrained, {last['env_steps']} steps: return {last['eval_return_mean']:.0f}, "
        f"length {last['eval_length_mean']:.0f}"
    )


if __name__ == "__main__":
    main(tyro.cli(Settings))
