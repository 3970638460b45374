"""What AIRL is not defined with, and why: its logit must be f - log pi of a step that was taken."""

WHY_NOT = {
    "pu": "the optimum is then no density ratio, which f - log pi must be",
    "wasserstein": "log pi falls out of its gradient, and f is then no log density",
    "mixup": "the logit needs log pi of each row's action, and a mixture of two steps is one nobody took",
    "inputs": "a g that sees the next state can be any shaping, so nothing tells g from h",
}
"""What AIRL is not defined with."""


def check_defined(loss: str, mixup: float, inputs: str) -> None:
    """Refuse settings that AIRL is not defined with.

    Raises:
        ValueError: names the setting, the reason and what to use instead.
    """
    if loss != "bce":
        raise ValueError(f"AIRL has no loss {loss}: {WHY_NOT[loss]}; use --discriminator.loss bce, or GAIL")
    if mixup:
        raise ValueError(f"AIRL has no mixup: {WHY_NOT['mixup']}; use --discriminator.mixup 0, or GAIL")
    if "next_obs" in inputs:
        raise ValueError(
            f"AIRL has no inputs {inputs}: {WHY_NOT['inputs']}; use --discriminator.inputs obs or "
            f"obs_action, or GAIL"
        )
