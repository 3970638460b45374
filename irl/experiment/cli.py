"""The command line: one table of commands, each a frozen dataclass that tyro reads."""

import errno
import sys
from collections.abc import Callable, Sequence
from typing import Any

from rich.console import Console

from irl.core.errors import UserError
from irl.experiment import (
    benched,
    demonstrations,
    evaluate,
    experts,
    export,
    generation,
    glossary,
    imports,
    probes,
    reports,
    reseeded,
    retrain,
    shelved,
    tabled,
    train,
)
from irl.experiment.configs import (
    AIRLRun,
    AIRLSACRun,
    BCRun,
    DACRun,
    DACTD3Run,
    GAILRun,
    GAILSACRun,
    GAILTD3Run,
)
from irl.experiment.modules import imported
from irl.experiment.play import Interrupted
from irl.experiment.typed import parsed

Run = Callable[[Any], None]

COMMANDS: dict[tuple[str, ...], tuple[type, Run]] = {
    ("demos", "generate"): (generation.GenerateDemos, generation.generate_demos),
    ("demos", "import"): (imports.ImportDemos, imports.import_demos),
    ("demos", "merge"): (imports.MergeDemos, imports.merge_demos),
    ("demos", "split"): (imports.SplitDemos, imports.split_demos),
    ("demos", "show"): (demonstrations.ShowDemos, demonstrations.show_demos),
    ("demos", "list"): (demonstrations.ListDemos, demonstrations.list_demos),
    ("train", "gail"): (GAILRun, train.train),
    ("train", "gail-sac"): (GAILSACRun, train.train),
    ("train", "gail-td3"): (GAILTD3Run, train.train),
    ("train", "dac"): (DACRun, train.train),
    ("train", "dac-td3"): (DACTD3Run, train.train),
    ("train", "airl"): (AIRLRun, train.train),
    ("train", "airl-sac"): (AIRLSACRun, train.train),
    ("train", "bc"): (BCRun, train.train),
    ("train",): (train.Resume, train.go_on),
    ("probe",): (probes.Probe, probes.make_probe),
    ("evaluate",): (evaluate.Evaluate, evaluate.evaluate),
    ("metrics",): (glossary.Glossary, glossary.glossary),
    ("report",): (reports.Report, reports.report),
    ("retrain",): (retrain.Retrain, reseeded.retrain),
    ("export",): (export.Export, export.export),
    ("bench", "table"): (tabled.BenchTable, tabled.bench_table),
    ("bench",): (benched.Bench, benched.bench),
    ("experts", "train"): (experts.TrainExpert, experts.train),
    ("experts", "evaluate"): (shelved.EvaluateExpert, shelved.evaluate),
    ("experts", "list"): (shelved.ListExperts, shelved.list_experts),
}

REFUSED: dict[tuple[str, ...], str] = {
    (
        "train",
        "airl-td3",
    ): "AIRL's discriminator is f - log pi, and TD3's policy has one action for a state, so "
    "no log pi; use: irl train airl-sac, or irl train dac-td3"
}
"""What one might type and there is no way to do."""

_FULL = "; free some space, or choose a folder on another disk"
_CLOSED = "; choose a folder that you may write to"
_FILE = "; a file is where a folder is needed: choose another place"
HINTS = dict.fromkeys((errno.EEXIST, errno.ENOTDIR), _FILE)
HINTS |= dict.fromkeys((errno.ENOSPC, errno.EDQUOT, errno.EFBIG), _FULL)
HINTS |= dict.fromkeys((errno.EACCES, errno.EPERM, errno.EROFS), _CLOSED)


def main(argv: Sequence[str] | None = None) -> None:
    """Run one command; a user's mistake is one line on stderr and exit status 2."""
    words = list(sys.argv[1:] if argv is None else argv)
    debug = "--debug" in words
    words = [word for word in words if word != "--debug"]
    try:
        with imported(words) as rest:
            _dispatch(rest)
    except (UserError, OSError) as error:
        if debug:
            raise
        _fail(_of_system(error) if isinstance(error, OSError) else str(error))
    except (Interrupted, KeyboardInterrupt):
        raise SystemExit(130) from None


def _dispatch(words: list[str]) -> None:
    if reason := REFUSED.get(tuple(words[:2])):
        raise UserError(reason)
    for n in (2, 1):
        if (name := tuple(words[:n])) in COMMANDS and len(name) == n:
            cls, run = COMMANDS[name]
            run(parsed(cls, words[n:], f"irl {' '.join(name)}"))
            return
    _overview(words)


def _overview(words: list[str]) -> None:
    words = [word for word in words if word not in ("-h", "--help")]
    near = [name for name in COMMANDS if name[: len(words)] == tuple(words)]
    asked = [word for word in words if not word.startswith("-")]
    if asked and not near:
        known = ", ".join(" ".join(name) for name in COMMANDS)
        raise UserError(f"no command 'irl {' '.join(asked)}'; there are: {known}")
    console = Console()
    for name in near or list(COMMANDS):
        first = (COMMANDS[name][0].__doc__ or "").splitlines()[0]
        console.print(f"  irl {' '.join(name):<18} {first}", highlight=False)


def _of_system(error: OSError) -> str:
    """What the system said, of which file, and what may be done about it."""
    said = f"{error.filename}: {error.strerror}" if error.filename and error.strerror else str(error)
    return said + HINTS.get(error.errno or 0, "")


def _fail(message: str) -> None:
    # a name out of a file may hold what a terminal obeys
    line = "".join(c if c.isprintable() else "?" for c in " ".join(message.split()))
    print(f"irl: {line}", file=sys.stderr)
    raise SystemExit(2)
