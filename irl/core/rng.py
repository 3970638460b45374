"""Named random streams of one seed.

    stream(seed, name) = PCG64(SeedSequence(seed, spawn_key=(crc32(name),)))

A new stream does not move another one, and nothing here reads or writes the global random state.
"""

import zlib

import numpy as np
import torch


def _sequence(seed: int, name: str) -> np.random.SeedSequence:
    return np.random.SeedSequence(seed, spawn_key=(zlib.crc32(name.encode()),))


def stream(seed: int, name: str) -> np.random.Generator:
    """The numpy generator called `name` of `seed`: the same arguments give the same draws.

    Raises:
        ValueError: the seed is negative.
    """
    return np.random.default_rng(_sequence(seed, name))


def torch_stream(seed: int, name: str, device: torch.device | str = "cpu") -> torch.Generator:
    """The torch generator called `name` of `seed`, on `device`."""
    state = int(_sequence(seed, name).generate_state(1, np.uint64)[0])
    generator = torch.Generator(device=device)
    # manual_seed takes a signed 64-bit number
    generator.manual_seed(state >> 1)
    return generator


def episode_seeds(seed: int, purpose: str, n: int) -> list[int]:
    """`n` distinct reset seeds for one purpose, so that evaluation never repeats a training start.

    Two purposes share a seed with a probability of about n^2 / 2^31.
    """
    drawn = stream(seed, f"episodes/{purpose}").permutation(4 * n + 16)[:n]
    base = int(_sequence(seed, f"episodes/{purpose}").generate_state(1, np.uint32)[0])
    return [(base + int(offset) * 7919) % (2**31 - 1) for offset in drawn]
