"""The curves of a grid as one SVG, which any page shows: score against steps, a panel a task."""

import math
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from irl.bench.arms import Arm, arms_of, scorer

# stay apart under the common colour blindnesses, and readable on white and on black
COLOURS = ("#2f7fc1", "#d9730d", "#3fa796", "#9a55a8", "#d8b441", "#7d8590")
INK, LINES = "#808080", "rgba(128,128,128,0.25)"
WIDTH, HEIGHT, ACROSS = 280, 190, 3
LEFT, TOP, GAP = 44, 28, 40
"""Of a panel: room for its numbers, its title, and below it."""
ROW = 22
"""Height of a line of the legend."""
Result = Mapping[str, Any]


def curves(results: Sequence[Result]) -> str:
    """Thin lines are seeds; a method that takes no environment step is a dashed line at its scores."""
    arms = arms_of([r for r in results if "score_of_the_run" not in r])
    tasks = list(dict.fromkeys(task for arm in arms for task in arm.by_task))
    across = min(len(tasks), ACROSS) or 1
    legend = ROW * math.ceil(len(arms) / 2) + 8
    width = across * (LEFT + WIDTH) + 16
    height = legend + math.ceil(len(tasks) / across) * (TOP + HEIGHT + GAP)
    colours = {id(arm): COLOURS[i % len(COLOURS)] for i, arm in enumerate(arms)}
    drawn = [_legend(arms, colours, width / 2)]
    for i, task in enumerate(tasks):
        at = (i % across * (LEFT + WIDTH) + LEFT, legend + i // across * (TOP + HEIGHT + GAP) + TOP)
        drawn.append(f'<g transform="translate({at[0]},{at[1]})">{_panel(task, arms, colours)}</g>')
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" '
        f'height="{height}" font-family="system-ui, sans-serif" font-size="12" fill="{INK}">\n'
        + "\n".join(drawn)
        + "\n</svg>\n"
    )


def _legend(arms: Sequence[Arm], colours: Mapping[int, str], column: float) -> str:
    rows = []
    for i, arm in enumerate(arms):
        x, y = i % 2 * column + LEFT, i // 2 * ROW + 16
        label = escape(f"{arm.method}, {arm.demos} episodes")
        line = f'<line x1="{x}" x2="{x + 22}" y1="{y - 4}" y2="{y - 4}" stroke="{colours[id(arm)]}"'
        rows.append(f'{line} stroke-width="3"/><text x="{x + 28}" y="{y}">{label}</text>')
    return "".join(rows)


def _panel(task: str, arms: Sequence[Arm], colours: Mapping[int, str]) -> str:
    lines = [(arm, _scored(r)) for arm in arms for r in arm.by_task.get(task, ())]
    # of logarithms: what was judged before the first step stands at the left edge
    steps = [max(x, 1.0) for arm, line in lines if not _dashed(arm) for x, _ in line]
    scores = [y for _, line in lines for _, y in line]
    span = (min(steps, default=1.0), max(steps, default=10.0))
    low, high = min(0.0, *scores, 0.0), max(1.05, *scores, 1.05)
    low = max(low, -1.0)

    def x(value: float) -> float:
        share = math.log(max(value, 1) / span[0]) / (math.log(span[1] / span[0]) or 1.0)
        return round(share * (WIDTH - 16), 1)

    def y(value: float) -> float:
        return round(HEIGHT * (high - max(value, low)) / (high - low), 1)

    drawn = [f'<text x="0" y="-10" font-weight="600">{escape(task)}</text>', _axes(span, x, y)]
    for arm, line in lines:
        stroke = f'fill="none" stroke="{colours[id(arm)]}" stroke-width="1.6" stroke-linejoin="round"'
        if _dashed(arm):
            at = y(line[-1][1]) if line else None
            path = f"0,{at} {WIDTH - 16},{at}" if at is not None else ""
            stroke += ' stroke-dasharray="5 4"'
        else:
            path = " ".join(f"{x(s)},{y(v)}" for s, v in line)
        drawn.append(f'<polyline points="{path}" {stroke}/>')
    return "".join(drawn)


def _axes(span: tuple[float, float], x: Any, y: Any) -> str:
    right = WIDTH - 16
    drawn = []
    for score in (0.0, 0.5, 0.9, 1.0):
        at = y(score)
        drawn.append(f'<line x1="0" x2="{right}" y1="{at}" y2="{at}" stroke="{LINES}"/>')
        # .9 and 1 would write over each other
        if score != 0.9:
            drawn.append(f'<text x="-6" y="{at + 4}" text-anchor="end">{score:g}</text>')
    for steps in _round_steps(*span):
        at = x(steps)
        drawn.append(f'<line x1="{at}" x2="{at}" y1="{HEIGHT}" y2="{HEIGHT + 4}" stroke="{INK}"/>')
        label = f"{steps / 1e6:g}M" if steps >= 1e6 else f"{steps / 1e3:g}k"
        drawn.append(f'<text x="{at}" y="{HEIGHT + 18}" text-anchor="middle">{label}</text>')
    return "".join(drawn)


def _round_steps(least: float, most: float) -> list[float]:
    """1, 3, 10, 30, ... between the two; with nothing between, both.

    >>> _round_steps(9_000.0, 120_000.0)
    [10000.0, 30000.0, 100000.0]
    """
    found = [m * 10.0**e for e in range(2, 9) for m in (1, 3)]
    return [value for value in found if least <= value <= most] or [least, most]


def _dashed(arm: Arm) -> bool:
    return arm.method.split()[0] == "bc"


def _scored(result: Result) -> list[tuple[float, float]]:
    score = scorer(result)
    points = [(float(steps), score(value)) for steps, value in result["curve"]]
    return [(steps, value) for steps, value in points if math.isfinite(value)]
