"""Grids of runs: what is in one, who carries its cells out, and what they come to together."""
