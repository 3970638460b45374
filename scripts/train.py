"""A policy and a reward from demonstrations: the same as `irl train`."""

import sys

from irl.experiment.cli import main

if __name__ == "__main__":
    sys.exit(main(["train", *sys.argv[1:]]))
