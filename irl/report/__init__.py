"""Pages and tables about a run, from the files of its folder; the only place that imports plotly."""
