"""What improves a policy on a reward; the only place that imports stable_baselines3."""
