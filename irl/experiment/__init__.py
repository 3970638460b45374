"""Configs, runs and the command line; the only place that knows configs."""
