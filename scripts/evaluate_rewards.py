"""A recovered reward, judged against the hand-written one: the same as `irl evaluate`."""

import sys

from irl.experiment.cli import main

if __name__ == "__main__":
    sys.exit(main(["evaluate", *sys.argv[1:]]))
