"""Demonstrations as Minari datasets: made, described and loaded. The only place that imports minari."""
