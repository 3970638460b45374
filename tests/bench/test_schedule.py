"""Which cell is next, what is tried again, and what is given up, with a runner that does as it is told."""

from collections.abc import Sequence

from irl.bench.cells import Cell
from irl.bench.estimate import Cost, costs, makespan, measured
from irl.bench.live import seconds_left, table
from irl.bench.pool import Runner
from irl.bench.progress import Progress
from irl.bench.schedule import TRIES, State, outcome_line, play
from irl.bench.worker import Outcome


def cell(name: str, source: str = "", steps: int = 100, arm: str = "gail", task: str = "Hopper-v5") -> Cell:
    kind = "retrain" if source else "train"
    return Cell(
        "g", name, kind, arm, arm, task, 1, steps, 5, 1, (), source=source, algo="ppo" if source else ""
    )


class Told:
    """Gives back what `says` has for a name, one after the other; a result when that is used up."""

    def __init__(self, workers: int, **says: list[Outcome | str]) -> None:
        self.workers, self.says, self.log, self.most = workers, says, list[str](), 0
        self.running: list[Cell] = []

    def submit(self, cell: Cell) -> None:
        self.running.append(cell)
        self.log.append(cell.name)
        self.most = max(self.most, len(self.running))

    def finished(self, wait_s: float) -> Sequence[Outcome]:
        cell = self.running.pop(0)
        said = self.says.get(cell.name) or [""]
        word = said.pop(0) if len(said) > 1 else said[0]
        if not word:
            return [Outcome(cell, {"n": cell.name})]
        return [Outcome(cell, why=str(word), killed=word == "killed")]

    def stop(self) -> None:
        pass


def played(runner: Told, *cells: Cell, done: set[str] | None = None) -> tuple[State, list[str]]:
    kept: list[str] = []
    state = State([*cells], done=done or set())
    play(state, runner, lambda outcome: kept.append(outcome.cell.name), lambda _: None, lambda: False)
    return state, kept


def test_every_cell_is_carried_out_once_with_no_more_at_a_time_than_workers() -> None:
    runner = Told(2)
    assert isinstance(runner, Runner)
    state, kept = played(runner, cell("a"), cell("b"), cell("c"))
    assert runner.log == kept == ["a", "b", "c"]
    assert (runner.most, state.done, state.failed) == (2, {"a", "b", "c"}, {})


def test_a_killed_cell_goes_on_and_a_failed_one_stops_no_other() -> None:
    state, kept = played(
        Told(1, a=["killed", "killed", ""], b=["no expert"]), cell("a"), cell("b"), cell("c")
    )
    assert kept == ["a", "c"]
    assert state.failed == {"b": "no expert"}
    assert state.tries == {"a": 3, "b": 1, "c": 1}


def test_a_result_that_cannot_be_kept_fails_its_cell_and_stops_no_other() -> None:
    def keep(outcome: Outcome) -> None:
        if outcome.cell.name == "a":
            raise ValueError("Out of range float values are not JSON compliant")

    state = State([cell("a"), cell("b"), cell("r", "a")])
    play(state, Told(1), keep, lambda _: None, lambda: False)
    assert state.done == {"b"}
    assert state.failed == {
        "a": "its result cannot be kept: ValueError: Out of range float values are not JSON compliant",
        "r": "there is no reward: a failed",
    }


def test_what_is_killed_every_time_is_given_up() -> None:
    state, kept = played(Told(1, a=["killed"]), cell("a"), cell("b"))
    assert kept == ["b"]
    assert state.failed == {"a": f"killed, {TRIES} times"}


def test_a_reward_is_waited_for_and_without_it_nothing_is_retrained() -> None:
    runner = Told(3, bad=["diverged"])
    cells = (cell("r", "a"), cell("a"), cell("bad"), cell("q", "bad"), cell("there", "before"))
    state, _ = played(runner, *cells, done={"before"})
    assert runner.log.index("a") < runner.log.index("r")
    assert state.failed == {"bad": "diverged", "q": "there is no reward: bad failed"}
    assert state.done == {"a", "r", "there", "before"}
    assert outcome_line(state) == "4 of 6 done, 0 running, 0 waiting, 2 failed"


def test_asked_to_stop_nothing_is_begun() -> None:
    runner, state = Told(1), State([cell("a")])
    play(state, runner, lambda _: None, lambda _: None, lambda: True)
    assert (runner.log, state.waiting) == ([], [cell("a")])


def test_costs_are_by_the_nearest_run_that_was_measured() -> None:
    rates = measured(
        {"method": "gail", "task": "Hopper-v5", "env_steps": 100.0 * n, "wall_s": 10.0} for n in (1, 2, 9)
    )
    assert rates[("gail", "Hopper-v5")] == 20.0
    here, there, other, of = costs(
        [cell("a"), cell("b", task="Ant-v5"), cell("c", arm="dac"), cell("d", "a", arm="ppo on gail")], rates
    )
    assert (here.seconds, here.source) == (5.0, "measured")
    assert (there.steps_per_s, there.source) == (20.0, "on other tasks")
    assert (other.steps_per_s, other.source) == (47.0, "a guess")
    # a retraining is the learner's alone, whatever the run with a discriminator took
    assert (of.steps_per_s, of.source) == (2300.0, "a guess")


def test_the_time_in_all_is_that_of_workers_who_take_what_is_next_when_they_are_free() -> None:
    def cost(name: str, seconds: int, source: str = "") -> Cost:
        return Cost(cell(name, source, steps=seconds), 1.0, "")

    assert makespan([cost("a", 30), cost("b", 10), cost("c", 10)], 2) == 30
    assert makespan([cost("a", 30), cost("b", 10), cost("c", 25)], 2) == 35
    # the retraining begins when its reward is there, whoever is free
    assert makespan([cost("r", 5, "a"), cost("a", 30), cost("b", 10)], 2) == 35


def test_what_runs_is_shown_with_its_score_and_the_time_left() -> None:
    a, b = cell("a", steps=1000), cell("b", steps=1000)
    state = State([b], {"a": a}, failed={"c": "no expert"})
    read = {"a": Progress(steps=250, steps_per_s=50.0, score=0.5)}
    ahead = [Cost(a, 1.0, ""), Cost(b, 100.0, "")]
    assert seconds_left(state, read, ahead, 1) == 750 / 50 + 1000 / 100
    drawn = table(state, read, ahead, 1)
    cells = [list(column.cells) for column in drawn.columns]
    assert cells == [["a", "c"], ["25%", "failed"], ["50", ""], ["0.500", ""], ["15 s", "no expert"]]
    assert drawn.caption == "0 of 3 done, 1 running, 1 waiting, 1 failed, 25 s left"
