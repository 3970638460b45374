"""A grid of runs, written as one TOML file.

    title = "DAC and GAIL on two tasks"
    seeds = [21, 22, 23]                      # what stands here holds for each part that does not say it
    tasks = ["Hopper-v5", "HalfCheetah-v5"]
    demos = [5, { episodes = 4, rate = 20 }]
    not_shown = ["that any other task is learned"]

    [[part]]                                  # kind = "train" unless said
    methods = ["dac"]
    steps = 250_000
    settings = { "learner.lr" = 5e-4 }        # flags of the command
    variant = "slow"                          # what the settings make of it; "" are its defaults

    [[part]]
    kind = "retrain"                          # fresh policies on the rewards that the train cells left
    methods = ["dac"]
    steps = 1_000_000
    shares = [0.5, 1.0]

    [[part]]
    kind = "peer"                             # somebody else's code, by a script in a Python of its own
    methods = ["gail"]
    steps = 1_000_000
    script = "scripts/benchmarks/peer_cell.py"

A part is the product of its methods, tasks, demos and seeds.
"""

import re
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Any, ClassVar, Literal

from irl.core import files
from irl.core.config import check_at_least, check_seed, from_json, to_json
from irl.core.errors import UserError

SHIPPED = Path(__file__).parent / "grids"
INHERITED = ("seeds", "tasks", "demos")
SAID = {
    "seed": "seeds",
    "seeds": "seeds",
    "env-id": "tasks",
    "demo-episodes": "demos",
    "demo-rate": "demos",
    "steps": "steps",
    "algo": "algo",
    "snapshot": "shares",
}
"""Flags of a command that a part has in words of its own, by which its cells are named and grouped."""


@dataclass(frozen=True)
class Given:
    """How many demonstrations a cell has."""

    episodes: int
    rate: int = 1
    """Every so-manieth step of them."""

    def __post_init__(self) -> None:
        check_at_least(self, 1, "episodes", "rate")


@dataclass(frozen=True)
class Part:
    """Methods, tasks, demonstrations and seeds, each with each."""

    methods: tuple[str, ...]
    tasks: tuple[str, ...]
    demos: tuple[Given, ...]
    seeds: tuple[int, ...]
    steps: int
    settings: dict[str, Any]
    variant: str

    def __post_init__(self) -> None:
        check_at_least(self, 1, "steps")
        for name in ("methods", "tasks", "demos", "seeds"):
            if not (values := getattr(self, name)):
                raise ValueError(f"a part needs {name}: none are given, here or at the top")
            if len(set(values)) < len(values):
                raise ValueError(f"{name} names one twice")
        for word in (*self.methods, *filter(None, [self.variant])):
            if not re.fullmatch(r"[A-Za-z0-9._-]+", word):
                raise ValueError(f"{word!r:.60} cannot be part of a file's name: use letters, digits, . _ -")
        for seed in self.seeds:
            check_seed(seed)
        for name in self.settings:
            if word := SAID.get(name.replace("_", "-")):
                raise ValueError(f"settings has {name}, which would contradict the cell; write {word} = ...")


@dataclass(frozen=True)
class Train(Part):
    """Runs of `irl train`, judged by `irl evaluate`."""

    KIND: ClassVar[str] = "train"


@dataclass(frozen=True)
class Retrain(Part):
    """Runs of `irl retrain` on rewards of the grid's own train cells."""

    KIND: ClassVar[str] = "retrain"
    shares: tuple[float, ...]
    algo: Literal["ppo", "sac"]

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.shares or not all(0 <= share <= 1 for share in self.shares):
            raise ValueError(f"shares are of a run's steps, each in 0 to 1, not {list(self.shares)}")


@dataclass(frozen=True)
class Peer(Part):
    """Runs of somebody else's code."""

    KIND: ClassVar[str] = "peer"
    script: str


DEFAULTS: dict[type[Part], dict[str, Any]] = {
    Train: {"settings": {}, "variant": ""},
    Retrain: {"settings": {}, "variant": "", "shares": [0.5, 1.0], "algo": "ppo"},
    Peer: {"settings": {}, "variant": "peer"},
}
"""What a part need not say, by its kind."""


@dataclass(frozen=True)
class Grid:
    """What is run, and what it is for."""

    part: tuple[Train | Retrain | Peer, ...]
    name: str
    title: str = ""
    evaluate: str = ""
    """More words for `irl evaluate`."""
    not_shown: tuple[str, ...] = ()
    """What a reader might take from the table and must not, a sentence each."""

    def __post_init__(self) -> None:
        if not self.part:
            raise ValueError("a grid needs at least one [[part]]")


def find_grid(name: str) -> Path:
    """The file of a shipped grid, or the one that is named.

    Raises:
        UserError: there is none.
    """
    if name.endswith(".toml"):
        return Path(name)
    known = sorted(path.stem for path in SHIPPED.glob("*.toml"))
    if name not in known:
        raise UserError(
            f"no grid {name!r:.60}; there are {', '.join(known)}, or name a file of your own: {name:.60}.toml"
        )
    return SHIPPED / f"{name}.toml"


def read_grid(path: Path) -> Grid:
    """The grid in a file, called as the file is.

    Raises:
        UserError: there is none, it is no TOML, or it says what there is not.
    """
    content = files.read_toml(path, "grid")
    if not isinstance(parts := content.get("part"), list):
        raise UserError(f"{path} has no [[part]]; irl/bench/grid.py shows a grid")
    if "name" in content:
        raise UserError(f"{path}: a grid is called as its file is; leave name = {content['name']!r:.60} away")
    shared = {key: content.pop(key) for key in INHERITED if key in content}
    content["part"] = [_part({**shared, **part}, f"{path}: part {i + 1}") for i, part in enumerate(parts)]
    return from_json(Grid, {**_defaults(Grid), **content, "name": path.stem}, str(path))


def _part(given: dict[str, Any], where: str) -> dict[str, Any]:
    kinds: Mapping[str, type[Part]] = {cls.KIND: cls for cls in (Train, Retrain, Peer)}
    cls = kinds.get(str(kind := given.get("kind", Train.KIND)))
    if cls is None:
        raise UserError(f"{where}: kind is one of {', '.join(kinds)}, found {kind!r:.40}")
    demos = given.get("demos", [])
    if isinstance(demos, list):
        given["demos"] = [{"episodes": one} if isinstance(one, int) else one for one in demos]
        given["demos"] = [_defaults(Given) | one if isinstance(one, dict) else one for one in given["demos"]]
    return {"kind": cls.KIND, "seeds": [], "tasks": [], "demos": [], **DEFAULTS[cls], **given}


def _defaults(cls: type) -> dict[str, Any]:
    return {field.name: to_json(field.default) for field in fields(cls) if field.default is not MISSING}
