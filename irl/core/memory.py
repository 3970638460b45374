"""How much memory the process has taken."""

import resource
import sys


def peak_memory() -> int:
    """The most bytes that were in memory at once since the process began, its libraries included."""
    # Linux counts kilobytes, macOS bytes
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit
