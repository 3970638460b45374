"""Demonstrations from an expert, as a Minari dataset: the same as `irl demos generate`."""

import sys

from irl.experiment.cli import main

if __name__ == "__main__":
    sys.exit(main(["demos", "generate", *sys.argv[1:]]))
