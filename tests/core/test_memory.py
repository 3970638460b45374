"""The peak grows by what is held, and does not fall."""

import numpy as np

from irl.core.memory import peak_memory


def test_the_peak_grows_by_what_is_held_and_stays() -> None:
    before = peak_memory()
    held = np.ones(40_000_000)
    at_most = peak_memory()
    assert at_most >= before
    assert at_most > held.nbytes
    del held
    assert peak_memory() >= at_most
