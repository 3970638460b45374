"""Where datasets lie, and how Minari is told so."""

import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

VARIABLE = "MINARI_DATASETS_PATH"


def datasets_root(root: Path | str | None = None) -> Path:
    """The folder that holds the datasets; it need not exist.

    The first of: the argument, the environment variable MINARI_DATASETS_PATH, `expert_data/datasets` of the
    checkout that `irl` is imported from, and Minari's own default in the home folder.
    """
    given = root or os.environ.get(VARIABLE)
    if given:
        return Path(given).expanduser().absolute()
    checkout = _checkout()
    return checkout / "expert_data" / "datasets" if checkout else Path.home() / ".minari" / "datasets"


@contextmanager
def minari_at(root: Path) -> Iterator[None]:
    """Within the block Minari works in `root` and is quiet.

    Minari knows its root from the process's environment only, so two threads cannot use two roots at once.
    """
    before = os.environ.get(VARIABLE)
    os.environ[VARIABLE] = str(root)
    try:
        with warnings.catch_warnings():
            # it recommends e-mail addresses and permalinks, which are not the user's to give
            warnings.simplefilter("ignore")
            yield
    finally:
        if before is None:
            del os.environ[VARIABLE]
        else:
            os.environ[VARIABLE] = before


def _checkout() -> Path | None:
    """The source checkout around the package, None for an installed package."""
    folder = Path(__file__).resolve().parents[2]
    is_checkout = (folder / "pyproject.toml").is_file() and (folder / "expert_data").is_dir()
    return folder if is_checkout else None
