"""What a learned reward is worth: pure functions of reward arrays, rewards and episodes."""
