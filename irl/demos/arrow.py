"""The episodes in Minari's Arrow and Parquet folders; pyarrow is asked for only where there is one."""

import importlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from irl.core import files
from irl.core.config import from_json
from irl.core.errors import UserError
from irl.core.types import Episode
from irl.demos.episodes import Columns, Layout, to_episode

FORMATS = ("arrow", "parquet")


def read(folder: Path, form: str, n: int, layout: Layout) -> list[Episode]:
    """The `n` episodes in a folder of folders, one an episode.

    Raises:
        UserError: pyarrow is not installed.
        ValueError: names the episode, and the step and the column where there is one.
        LookupError, TypeError, OSError: what pyarrow makes of a damaged file.
    """
    arrow = pyarrow()
    if n < 1:
        raise ValueError(f"it has {n} episodes; expected at least 1")
    return [to_episode(_columns(arrow, folder / str(i), form, layout), i, layout) for i in range(n)]


def pyarrow() -> Any:
    """The module, with its datasets.

    Raises:
        UserError: it is not installed.
    """
    try:
        arrow = importlib.import_module("pyarrow")
        importlib.import_module("pyarrow.dataset")
    except ImportError as error:
        raise UserError(
            "this file is in the Arrow format, which pyarrow reads, and pyarrow is not installed: "
            "pip install pyarrow"
        ) from error
    return arrow


def numbers(arrow: Any, column: Any) -> np.ndarray:
    """A column as an array; rows of a fixed or of one common length become its second axis.

    Raises:
        ValueError: the rows have several lengths, or a number is missing.
    """
    if column.null_count:
        raise ValueError("has missing numbers")
    if isinstance(column, arrow.ChunkedArray):
        column = column.combine_chunks()
    if not hasattr(column, "flatten") or arrow.types.is_struct(column.type):
        return column.to_numpy(zero_copy_only=False)
    flat = numbers(arrow, column.flatten())
    if flat.size % max(len(column), 1):
        raise ValueError(f"has {len(column)} rows of several lengths")
    return flat.reshape(len(column), -1, *flat.shape[1:])


def _columns(arrow: Any, folder: Path, form: str, layout: Layout) -> Columns:
    """The columns; actions, rewards and ends have a row too many, for the last observation."""
    if not (paths := sorted(folder.glob(f"*.{form}"))):
        raise ValueError(f"no file {folder}/*.{form}")
    table = arrow.dataset.dataset([str(path) for path in paths], format=form).to_table()
    named = dict(zip(table.column_names, table.columns, strict=True))
    observations = named["observations"].combine_chunks()
    of_keys = {key: numbers(arrow, observations.field(key)) for key in layout.obs_keys}
    names = ("actions", "rewards", "terminations", "truncations")
    return Columns(
        of_keys or numbers(arrow, observations),
        *(numbers(arrow, named[name])[:-1] for name in names),
        infos=dict(_infos(arrow, named["infos"].combine_chunks())) if "infos" in named else {},
        seed=_seed(folder),
    )


def _infos(arrow: Any, infos: Any) -> Iterator[tuple[str, np.ndarray]]:
    if not arrow.types.is_struct(infos.type):
        return
    for i in range(infos.type.num_fields):
        values = infos.field(i)
        if arrow.types.is_primitive(values.type) and not values.null_count:
            yield infos.type.field(i).name, numbers(arrow, values)


def _seed(folder: Path) -> int | None:
    if not (path := folder / "metadata.json").is_file():
        return None
    content = from_json(dict[str, Any], files.read_json(path), str(path))
    return from_json(int | None, content.get("seed"), f"{path}.seed")
