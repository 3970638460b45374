"""Where a result was made: versions, device, threads, commit."""

import importlib.metadata
import os
import platform
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import torch

PACKAGES = ("irl", "torch", "gymnasium", "mujoco", "stable-baselines3", "minari", "numpy")


def versions() -> dict[str, str]:
    """Versions of the packages that a result depends on."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found


def environment(command: str, device: str = "cpu") -> dict[str, Any]:
    """The content of `environment.json`."""
    commit, dirty = _git()
    name = torch.cuda.get_device_name() if device.startswith("cuda") else _processor()
    return {
        "command": command,
        "packages": versions(),
        "python": platform.python_version(),
        "device": device,
        "machine": f"{name}, {os.cpu_count()} cores, {platform.system()} {platform.machine()}",
        "threads": torch.get_num_threads(),
        "git_commit": commit,
        "git_dirty": dirty,
    }


def command_line() -> str:
    """What was typed, without the path of the program; it can be pasted into a shell."""
    return shlex.join([Path(sys.argv[0]).name, *sys.argv[1:]])


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or "unknown processor"


def _git() -> tuple[str | None, bool | None]:
    """Commit and dirtiness of the source tree irl is imported from; None when it is no checkout."""
    source = Path(__file__).parent.parent.parent

    def ask(*words: str) -> str:
        return subprocess.run(
            ["git", "-C", str(source), *words], capture_output=True, text=True, check=True, timeout=10
        ).stdout.strip()

    if not (source / ".git").exists():
        return None, None
    try:
        return ask("rev-parse", "HEAD"), bool(ask("status", "--porcelain", "--untracked-files=no"))
    except (OSError, subprocess.SubprocessError):
        return None, None
