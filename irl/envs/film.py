"""Pictures of an episode: its actions are played again in an environment that draws.

    python -m irl.envs.film STEPS.npz SHEET.webp

A process of its own: a graphics library that is missing or breaks ends this process and no other. All frames
are one file, row after row, so that a page can show any of them at once.
"""

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from PIL import Image

from irl.core.types import Episode
from irl.envs.inherited import inherited
from irl.envs.make import make

WIDTH, HEIGHT = 240, 180
ACROSS = 10
"""Frames in a row of the sheet."""
QUALITY = 40
SECONDS = 180
SAME = 1e-6
"""A replay's rewards may differ from those recorded by this."""


def film(env_id: str, episode: Episode, frames: int, sheet: Path) -> dict[str, Any]:
    """What was written to `sheet`: `every` how many steps a frame is, `frames`, `across`, `width`, `height`.

    Raises:
        RuntimeError: there is no picture; says why in a sentence.
    """
    if "rgb_array" not in _modes(env_id):
        raise RuntimeError("the task draws no pictures (it has no render mode rgb_array)")
    if episode.seed is None:
        raise RuntimeError("the episode has no seed to play it again from")
    steps = sheet.with_suffix(".npz")
    np.savez(
        steps, env_id=env_id, seed=episode.seed, action=episode.action, reward=episode.reward, frames=frames
    )
    try:
        why = ""
        for library in _libraries():
            done, said = _run(library, [str(steps), str(sheet)])
            if done is not None:
                return done
            why = why or said
        raise RuntimeError(why)
    finally:
        steps.unlink(missing_ok=True)


def _modes(env_id: str) -> Sequence[str]:
    env = make(env_id)
    try:
        return list(env.metadata.get("render_modes") or ())
    finally:
        env.close()


def _libraries() -> Sequence[str]:
    """What draws without a screen: the one that was chosen, or these in turn."""
    chosen = os.environ.get("MUJOCO_GL")
    return (chosen,) if chosen else ("egl", "osmesa")


def _run(library: str, words: Sequence[str]) -> tuple[dict[str, Any] | None, str]:
    """What the process said it wrote, or why it wrote nothing."""
    quiet = {"MUJOCO_GL": library, "SDL_VIDEODRIVER": "dummy", "LP_NUM_THREADS": "1"}
    if library == "osmesa":
        quiet["PYOPENGL_PLATFORM"] = library
    command = [sys.executable, "-m", "irl.envs.film", *words]
    try:
        ended = subprocess.run(
            command, env={**os.environ, **quiet}, capture_output=True, text=True, timeout=SECONDS, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return None, f"no picture could be drawn: {error}"
    if ended.returncode == 0:
        return json.loads(ended.stdout.splitlines()[-1]), ""
    said = [line.strip() for line in ended.stderr.splitlines() if line.strip()]
    return (
        None,
        f"no picture could be drawn with MUJOCO_GL={library}: {said[-1] if said else ended.returncode}",
    )


def main(steps: Path, sheet: Path) -> None:
    """Play, draw, write; what was written is said as JSON."""
    for module in inherited():
        # which registers the task
        import_module(module)
    with np.load(steps, allow_pickle=False) as file:
        given = {name: file[name] for name in file.files}
    env = _drawing(str(given["env_id"]))
    every = max(1, -(-len(given["action"]) // int(given["frames"])))
    pictures = []
    try:
        env.reset(seed=int(given["seed"]))
        for t, action in enumerate(given["action"]):
            if t % every == 0:
                pictures.append(_picture(env))
            reward = float(env.step(action)[1])
            if not np.isclose(reward, given["reward"][t], rtol=SAME, atol=SAME, equal_nan=True):
                raise RuntimeError(f"step {t} of the replay pays {reward:g}, not {given['reward'][t]:g}")
    finally:
        env.close()
    rows = -(-len(pictures) // ACROSS)
    whole = Image.new("RGB", (WIDTH * min(ACROSS, len(pictures)), HEIGHT * rows))
    for i, picture in enumerate(pictures):
        whole.paste(picture, (WIDTH * (i % ACROSS), HEIGHT * (i // ACROSS)))
    whole.save(sheet, "WEBP", quality=QUALITY)
    written = {"every": every, "frames": len(pictures), "across": ACROSS, "width": WIDTH, "height": HEIGHT}
    print(json.dumps(written))


def _drawing(env_id: str) -> gym.Env:
    """The environment with a renderer; of MuJoCo's without what is slow to draw in software."""
    probe = make(env_id)
    model = getattr(probe.unwrapped, "model", None)
    probe.close()
    size = {"width": WIDTH, "height": HEIGHT} if hasattr(model, "vis") else {}
    env = make(env_id, render_mode="rgb_array", **size)
    if size:
        # shadows, mirrors and smoothing take ten times as long as all the rest
        inner: Any = env.unwrapped
        inner.model.vis.quality.offsamples = inner.model.vis.quality.shadowsize = 0
        inner.model.mat_reflectance[:] = 0.0
        inner.model.light_castshadow[:] = 0
    return env


def _picture(env: gym.Env) -> Image.Image:
    drawn = env.render()
    if not isinstance(drawn, np.ndarray):
        raise RuntimeError("the environment gave no picture")
    picture = Image.fromarray(drawn.astype(np.uint8))
    picture.thumbnail((WIDTH, HEIGHT))
    framed = Image.new("RGB", (WIDTH, HEIGHT))
    framed.paste(picture, ((WIDTH - picture.width) // 2, (HEIGHT - picture.height) // 2))
    return framed


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
