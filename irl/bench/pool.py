"""Who carries cells out: here, several at a time."""

from collections.abc import Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import Protocol, runtime_checkable

from irl.bench.cells import Cell
from irl.bench.processes import Processes
from irl.bench.worker import Outcome, Places, carry_out


@runtime_checkable
class Runner(Protocol):
    """Takes cells and gives back what became of them."""

    @property
    def workers(self) -> int: ...
    def submit(self, cell: Cell) -> None: ...
    def finished(self, wait_s: float) -> Sequence[Outcome]: ...
    def stop(self) -> None: ...


class Pool:
    """Processes on this machine; the threads here only wait for them."""

    def __init__(self, workers: int, places: Places) -> None:
        self.workers, self._places = workers, places
        self._processes, self._threads = Processes(), ThreadPoolExecutor(workers)
        self._futures: set[Future[Outcome]] = set()

    def submit(self, cell: Cell) -> None:
        self._futures.add(self._threads.submit(carry_out, cell, self._places, self._processes))

    def finished(self, wait_s: float) -> Sequence[Outcome]:
        """Those that have ended; waits for one at most `wait_s`."""
        done, self._futures = wait(self._futures, timeout=wait_s, return_when=FIRST_COMPLETED)
        return [future.result() for future in done]

    def stop(self) -> None:
        """End what runs, each with a checkpoint, and wait for that."""
        self._processes.stop()
        self._threads.shutdown()
