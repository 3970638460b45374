"""The reward of each kind of play over training, as quantile bands."""

from collections.abc import Mapping, Sequence

import plotly.graph_objects as go

from irl.report import plots
from irl.report.folder import RunFiles, finite, lookup
from irl.report.palette import DASHES, PLAY, STRATA, faded, framed
from irl.report.panel import Panel, View, plain, unmeasured

Quantiles = Mapping[str, list[list[float]]]
"""Of each kind of play: for each of five levels, a number a snapshot."""


def fan(run: RunFiles) -> Panel:
    """As the reward is, and standardised."""
    anchor, title = "fan", "Reward by kind of play"
    steps = _numbers(lookup(run.evaluation, "drift.pictures.snapshots"))
    strata = _quantiles(lookup(run.evaluation, "drift.pictures.fan.strata"), len(steps))
    if not steps or not strata:
        return _older(run, anchor, title)
    text = (
        "Each snapshot of the reward on the same steps (line: median; bands: the middle half and nine "
        "tenths): a reward that knows the task puts expert play on top and random play at the "
        "bottom, with the noisy "
        "expert between. Where the bands lie on each other it cannot tell them apart."
    )
    views = [View("as it is", (figure(steps, strata, "learned reward of a step (nats)"),))]
    mean, std = (_numbers(lookup(run.evaluation, f"drift.pictures.fan.{key}")) for key in ("mean", "std"))
    if len(mean) == len(std) == len(steps) and min(std) > 0:
        scaled = {
            name: [[(v - m) / s for v, m, s in zip(level, mean, std, strict=True)] for level in levels]
            for name, levels in strata.items()
        }
        views.append(View("standardised", (figure(steps, scaled, "reward, standard deviations"),)))
    return Panel(anchor, title, text, "fan", tuple(views), control_label="scale of the reward")


def figure(steps: Sequence[float], strata: Quantiles, unit: str) -> go.Figure:
    """Bands and medians."""
    bands, lines, x = [], [], list(steps)
    for name, (p5, p25, p50, p75, p95) in strata.items():
        colour = PLAY.get(name, STRATA["random"])
        hidden = {
            "hoverinfo": "skip",
            "showlegend": False,
            "legendgroup": name,
            "mode": "lines",
            "line_width": 0,
        }
        for low, high, alpha in ((p5, p95, 0.07), (p25, p75, 0.16)):
            fill = {"fill": "toself", "fillcolor": faded(colour, alpha)}
            bands.append(go.Scatter(x=x + x[::-1], y=high + low[::-1], **fill, **hidden))
        lines.append(
            go.Scatter(
                x=x,
                y=p50,
                name=plain(name),
                legendgroup=name,
                mode="lines+markers",
                marker_size=5,
                line={"color": colour, "width": 2, "dash": DASHES.get(name, "solid")},
                hovertemplate=f"{plain(name)} %{{y:.3g}}<extra></extra>",
            )
        )
    drawn = go.Figure([*bands, *lines]).update_layout(hovermode="x")
    return framed(drawn, plots.STEPS, unit, height=430)


def _older(run: RunFiles, anchor: str, title: str) -> Panel:
    """Evaluations that have three bands on the older probe."""
    bands, steps = lookup(run.evaluation, "drift.strata"), lookup(run.evaluation, "drift.snapshots")
    known = {name: bands[name] for name in STRATA if isinstance(bands, Mapping) and _filled(bands.get(name))}
    if not isinstance(steps, list) or not steps or not known:
        return unmeasured(run, anchor, title, "drift.strata")
    text = (
        "Each snapshot of the reward on the same steps (line: median; band: 10 to 90 % of them): a useful "
        "reward puts the expert on top and random play at the bottom."
    )
    return Panel(anchor, title, text, "fan", (View("", (plots.reward_by_stratum(steps, known),)),))


def _filled(bands: object) -> bool:
    return isinstance(bands, Mapping) and all(
        isinstance(bands.get(k), list) for k in ("p10", "median", "p90")
    )


def _numbers(values: object) -> list[float]:
    """All of a list where all are numbers, else none."""
    found = [finite(value) for value in values] if isinstance(values, list) else []
    known = [value for value in found if value is not None]
    return known if len(known) == len(found) else []


def _quantiles(strata: object, n: int) -> Quantiles:
    if not isinstance(strata, Mapping):
        return {}
    read = {
        str(name): [_numbers(level) for level in levels]
        for name, levels in strata.items()
        if isinstance(levels, list)
    }
    return {name: levels for name, levels in read.items() if [len(level) for level in levels] == [n] * 5}
