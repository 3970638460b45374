"""Who carries cells out: a Ray cluster, an extra (`pip install 'irl[ray]'`).

A cell takes one CPU. A worker that dies gives its cell back as killed, as a killed process does here, and the
cell goes on where it is sent next if that place sees the same `--runs`; else it begins again there.
"""

from collections.abc import Sequence
from importlib import import_module
from typing import Any

from irl.bench.cells import Cell
from irl.bench.processes import ONE_THREAD, Processes
from irl.bench.worker import Outcome, Places, carry_out
from irl.core.errors import UserError
from irl.envs.inherited import VARIABLE, inherited

LOCAL = "local"


class Cluster:
    """Workers of Ray, at an address or started here."""

    def __init__(self, address: str, workers: int | None, places: Places) -> None:
        """`workers`: how many cells at a time; as many as the cluster has CPUs unless given.

        Raises:
            UserError: Ray is not installed, or there is no cluster at the address.
        """
        self._ray, self._places = _ray(), places
        given: dict[str, Any] = (
            {"num_cpus": workers, "include_dashboard": False} if address == LOCAL else {"address": address}
        )
        # the workers' own environment is that of their node
        env = ONE_THREAD | {VARIABLE: ",".join(inherited())}
        try:
            self._ray.init(**given, runtime_env={"env_vars": env}, log_to_driver=False)
        except (ConnectionError, ValueError, RuntimeError) as error:
            raise UserError(f"--ray {address}: no cluster there ({error:.200})") from error
        self.workers = workers or max(int(self._ray.cluster_resources().get("CPU", 1)), 1)
        # a worker's death is counted and shown by the one who asked, as that of a process is
        self._task = self._ray.remote(num_cpus=1, max_retries=0)(_carry_out)
        self._cells: dict[Any, Cell] = {}

    def submit(self, cell: Cell) -> None:
        self._cells[self._task.remote(cell, self._places)] = cell

    def finished(self, wait_s: float) -> Sequence[Outcome]:
        """Those that have ended; waits for one at most `wait_s`."""
        done, _ = self._ray.wait(list(self._cells), timeout=wait_s)
        return [self._outcome(reference, self._cells.pop(reference)) for reference in done]

    def _outcome(self, reference: Any, cell: Cell) -> Outcome:
        try:
            return self._ray.get(reference)
        except self._ray.exceptions.RayTaskError as error:
            return Outcome(cell, why=str(error).strip().splitlines()[-1])
        except self._ray.exceptions.RayError as error:
            return Outcome(cell, why=f"its worker died: {type(error).__name__}", killed=True)

    def stop(self) -> None:
        """Leave the cluster; what runs ends with its worker and goes on from its last checkpoint."""
        self._ray.shutdown()


def _carry_out(cell: Cell, places: Places) -> Outcome:
    return carry_out(cell, places, Processes())


def _ray() -> Any:
    try:
        return import_module("ray")
    except ModuleNotFoundError as error:
        raise UserError("--ray needs Ray, which is not installed: pip install 'irl[ray]'") from error
