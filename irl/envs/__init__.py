"""Environments: making them, playing in them, and what is known of each MuJoCo task."""
