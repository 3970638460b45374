"""evaluation.json with every part that the page shows, of any number of snapshots, without a run."""

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from irl.core.rng import stream

STRATA = ("expert", "medium", "noisy expert", "random")
TERMS = ("forward", "ctrl", "survive")
WEBP = "episodes/middle.webp"


def grow(evaluation: dict[str, Any], n: int) -> dict[str, Any]:
    """The same with everything else in it, and `n` snapshots."""
    rng, steps = stream(0, "whole"), [2048 * i for i in range(n)]
    shares = rng.dirichlet(np.ones(3), n - 1)
    drift = evaluation["drift"]
    drift |= {
        "snapshots": steps,
        "moves": [
            {"offset": a, "scale": b, "shape": c, "total": a + b + c, "shares": {}}
            for a, b, c in shares.tolist()
        ],
        "health": [{"train": {"auroc": 0.95}, "held_out": {"auroc": 0.9}} for _ in steps],
        "to_truth": [{"value": 0.5 - 0.3 * i / n, "low": 0.1, "high": 0.6} for i in range(n)],
        "outside": [0.4] * n,
        "pictures": {
            "snapshots": steps,
            "fan": fan(n, rng),
            "maps": [plane(m, n, rng) for m in (1, 10, 50)] + [{"n": 100, "reason": "too long"}],
            "terms": terms(steps),
            "against": {"step": combs(rng), "segment": combs(rng) | {"n": 50}},
            "residuals": {"rows": [residual(i) for i in range(12)]},
        },
    }
    return evaluation | distances() | trusted(steps, rng) | {"episodes": [episode(rng)]}


def fan(n: int, rng: np.random.Generator) -> dict[str, Any]:
    levels = {name: np.sort(rng.normal(size=(5, n)), axis=0).tolist() for name in (*STRATA, "final policy")}
    return {"levels": [0.05, 0.25, 0.5, 0.75, 0.95], "mean": [0.1] * n, "std": [2.0] * n, "strata": levels}


def plane(m: int, n: int, rng: np.random.Generator) -> dict[str, Any]:
    places = rng.normal(size=(n + 1, 2)) / 5
    matrix = np.clip(np.linalg.norm(places[:, None] - places[None], axis=-1), 0, 1)
    return {"n": m, "matrix": matrix.tolist(), "map": places.tolist(), "reason": None}


def terms(steps: list[int]) -> dict[str, Any]:
    at = steps[:: max(1, len(steps) // 8)]
    row = {"weight": 0.5, "low": 0.4, "high": 0.7, "standardised": 0.6, "share": 0.2}
    return {
        "snapshots": at,
        "std": dict.fromkeys(TERMS, 2.0),
        "reward_std": [4.0] * len(at),
        "weights": {
            name: {k: [v] * len(at) for k, v in row.items()}
            | {"why_not": "too small" if name == "ctrl" else None}
            for name in TERMS
        },
        "explained": [0.7] * len(at),
        "shaping": [0.1] * len(at),
        "reason": None,
    }


def combs(rng: np.random.Generator) -> dict[str, Any]:
    def one(name: str) -> dict[str, Any]:
        x, y = rng.normal(size=(2, 150)).round(3).tolist()
        line = {
            "slope": 0.5,
            "low": 0.4,
            "high": 0.6,
            "intercept": 0.1,
            "pearson": 0.7,
            "size": 900,
            "episodes": 9,
        }
        return line | {"hex_x": x, "hex_y": y, "hex_count": [1 + i for i in range(150)], "range": [-1.0, 1.0]}

    return {"across": 36, "x": [-3.0, 3.0], "y": [-3.0, 3.0], "strata": {name: one(name) for name in STRATA}}


def residual(i: int) -> dict[str, Any]:
    numbers = {"learned": 1.25, "hand_written": 3.5, "expected": 2.0, "residual": -4.375}
    place = {"stratum": "random", "episode": i, "seed": i, "step": 7, "ends": i == 0}
    return numbers | place | {"terms": dict.fromkeys(TERMS, 0.5), "obs": [0.1] * 11, "action": [0.2] * 3}


def distances() -> dict[str, Any]:
    row = {"name": "VAL", "value": 0.2174, "low": 0.18, "high": 0.25, "self_error": 0.0125, "negation": 1.0}
    row |= {"random": 0.61, "episodes": 60, "reason": None, "distinguishable": True}
    strata = {name: row | {"steps": 5000, "covered": True} for name in STRATA}
    curve = [row | {"n": n} for n in (1, 10, 50)]
    weight = {"weight": 0.37, "low": 0.3, "high": 0.4, "standardised": 0.8, "share": 0.6, "why_not": None}
    known = {name: weight for name in TERMS} | {"ctrl": {**weight, "why_not": "too small"}}
    found = {"curve": curve, "headline": row | {"n": 50}, "references": [], "strata": strata, "notes": []}
    return {
        "distances": found | {"probe_sha256": "ab" * 32, "steps": 20_000, "episodes": 60},
        "terms": {"weights": known, "explained": 0.7, "shaping": 0.1, "survival_bonus": 0.8, "reason": None},
    }


def trusted(steps: list[int], rng: np.random.Generator) -> dict[str, Any]:
    names = ["random", "medium", "expert"]
    policies = [{"name": n, "kind": n, "true_return": 1000.0 * i, "episodes": 5} for i, n in enumerate(names)]
    measure = {"value": 0.9, "low": 0.8, "high": 1.0}
    agreement = [
        {"step": s, **{k: measure for k in ("pearson", "spearman", "kendall", "regret")}} for s in steps
    ]
    rule = {"threshold": 0.2, "rule": "the distance is above the threshold", "reason": None}
    return {
        "verdicts": [
            rule | {"name": "close", "fired": False, "value": 0.2174, "sentence": "Something else."},
            rule | {"name": "hacked", "fired": True, "value": 0.375, "sentence": "True return fell."},
            rule | {"name": "stable", "fired": True, "value": 0.0625, "sentence": "It has come to rest."},
            rule | {"name": "flat", "fired": None, "value": None, "sentence": "", "reason": "no policy"},
        ],
        "cross_play": {
            "snapshots": steps,
            "policies": policies,
            "learned": rng.normal(size=(len(steps), 3)).tolist(),
            "agreement": agreement,
            "notes": ["No second task."],
        },
        "proxy_gold": {
            "points": [{"step": s, "proxy": float(s), "gold": float(s) / 2} for s in steps],
            "peak_step": steps[-1],
            "drop": 0.0,
            "gap": 0.1,
            "decoupling_step": None,
            "fit": None,
            "fit_reason": "no peak inside the run",
        },
        "residual": {"r2": 0.8, "features": [{"name": "obs[2]", "importance": 0.9}]},
        "ledger": {"determines": ["a ratio of densities"], "cannot": ["the task"], "source": "a paper"},
        "chosen": {"step": steps[1], "rule": "lowest rank", "criteria": [], "compared": None},
    }


def episode(rng: np.random.Generator) -> dict[str, Any]:
    film = {"file": WEBP, "every": 5, "frames": 8, "across": 4, "width": 24, "height": 18}
    place = {"name": "middle", "seed": 3, "steps": 40, "return": 44.5, "terminated": True, "dt_s": 0.008}
    rewards = {"learned": rng.normal(size=40).tolist(), "hand_written": rng.normal(size=40).tolist()}
    each = {name: rng.normal(size=40).tolist() for name in TERMS}
    return place | rewards | {"terms": each, "film": film, "film_reason": None}


def write(run: Path, evaluation: dict[str, Any]) -> None:
    """The files that the page reads beside the evaluation."""
    (run / "evaluation.json").write_text(json.dumps(evaluation))
    (run / "episodes").mkdir()
    with io.BytesIO() as file:
        Image.new("RGB", (96, 36), "#446688").save(file, "WEBP")
        (run / WEBP).write_bytes(file.getvalue())
    reward = run / "snapshots" / "000122880" / "reward"
    reward.mkdir(parents=True)
    (reward / "spec.json").write_text(json.dumps({"method": "gail", "reward_map": "gail", "gamma": 0.99}))
    (reward / "weights.safetensors").write_bytes(b"weights")
    ratio = {"value": 0.875, "low": 0.7, "high": 1.0}
    row = {
        "snapshot": 122880,
        "part": "gail",
        "dynamics": "as trained",
        "seeds": [1, 2],
        "returns": [3000.0, 3100.0],
    }
    (run / "retrained.json").write_text(json.dumps({"rows": [row | {"scores": [0.9, 0.95], "ratio": ratio}]}))
