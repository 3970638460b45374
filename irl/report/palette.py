"""Colours and the quiet frame that every figure shares.

The strata keep one colour in all figures. The hues were chosen to stay apart under the common
colour blindnesses and to have a contrast of 3 or more on the light and the dark page.
"""

from typing import Any

import plotly.graph_objects as go

STRATA = {"expert": "#2f7fc1", "policy": "#d9730d", "random": "#7d8590"}
PLAY = STRATA | {"final policy": "#d9730d", "noisy expert": "#3fa796", "medium": "#9a55a8"}
"""Kinds of play of the base probe, with the run's own policy."""
DASHES = {
    "expert": "solid",
    "final policy": "solid",
    "noisy expert": "dash",
    "medium": "dot",
    "random": "dashdot",
}
"""The same told apart without colour."""
METHODS = {
    "gail": "#2f7fc1",
    "airl": "#d9730d",
    "dac": "#3fa796",
    "gail-sac": "#9a55a8",
    "airl-sac": "#d8b441",
    "bc": "#7d8590",
}
OTHERS = ("#2f7fc1", "#d9730d", "#3fa796", "#9a55a8", "#d8b441", "#7d8590")
"""For names that are not known beforehand, in turn."""
BLUES = [[0.0, "rgba(47,127,193,0.10)"], [1.0, "#2f7fc1"]]
"""Of little to much; both ends readable on the light and the dark page."""
SIGNED = [[0.0, "#2f7fc1"], [0.5, "rgba(128,128,128,0.12)"], [1.0, "#d9730d"]]
STRATUM_NAMES = {"expert": "held-out expert", "policy": "policy", "random": "random"}
DEMONSTRATIONS = "#3fa796"
CHANGES = {"offset": "#d8b441", "scale": "#3fa796", "shape": "#9a55a8"}
ACCENT = "#9a55a8"
INK = "#808080"
"""Readable on white and on black; the page's style sheet replaces it by the page's own ink."""
GRID = "rgba(128,128,128,0.22)"
FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif"


def faded(colour: str, alpha: float) -> str:
    """The colour `#rrggbb` with an opacity, as CSS writes it."""
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red},{green},{blue},{alpha:g})"


AXIS: dict[str, Any] = {
    "gridcolor": GRID,
    "linecolor": INK,
    "zeroline": False,
    "automargin": True,
    "ticks": "outside",
    "tickcolor": GRID,
}
LAYOUT: dict[str, Any] = {
    "template": {},
    "margin": {"l": 10, "r": 14, "t": 10, "b": 10},
    "paper_bgcolor": "rgba(0,0,0,0)",
    "plot_bgcolor": "rgba(0,0,0,0)",
    "font": {"family": FONT, "size": 13, "color": INK},
    "legend": {"orientation": "h", "x": 0, "xanchor": "left", "y": 1.02, "yanchor": "bottom"},
    "hoverlabel": {"bgcolor": "#ffffff", "bordercolor": INK, "font": {"color": "#1a1a1a"}},
    # a finger on a figure scrolls the page
    "dragmode": False,
}


def framed(figure: go.Figure, x: str, y: str, height: int = 380) -> go.Figure:
    """The figure with axis titles, a legend above it and no background of its own."""
    title = {"standoff": 10, "font": {"size": 13}}
    figure.update_xaxes(**AXIS, showgrid=False, showline=True, title={**title, "text": x})
    figure.update_yaxes(**AXIS, title={**title, "text": y})
    return figure.update_layout(**LAYOUT, height=height)
