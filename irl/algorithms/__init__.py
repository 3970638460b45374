"""Training loops, and the steps a reward is judged on."""
