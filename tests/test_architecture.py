"""The house rules, read from the source: a second line beside import-linter and ruff."""

import ast
import importlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "irl"
FILES = sorted(PACKAGE.rglob("*.py"))

# From the top; a file may import from the levels below its own, and from its own folder.
LEVELS = (
    {"experiment"},
    {"bench"},
    {"report"},
    {"algorithms"},
    {"demos", "discriminators", "learners", "diagnostics"},
    {"rewards"},
    {"policies"},
    {"envs"},
    {"core"},
)
DEPTH = {layer: depth for depth, level in enumerate(LEVELS) for layer in level}
OWNERS = {"minari": "demos", "stable_baselines3": "learners", "plotly": "report"}

UNSAFE_LOADS = {"torch.load", "pickle.load", "pickle.loads", "yaml.load", "yaml.unsafe_load"}
# Making a generator, and reading or restoring a global state for a checkpoint, draw nothing.
HARMLESS = {"default_rng", "Generator", "BitGenerator", "SeedSequence", "PCG64", "Philox", "Random"}
HARMLESS |= {"get_state", "set_state", "getstate", "setstate"}
TORCH_DRAWS = {"rand", "randn", "randint", "randperm", "normal", "bernoulli", "multinomial", "poisson"}
# These take no generator, or set the global one.
TORCH_GLOBAL = {"manual_seed", "seed", "rand_like", "randn_like", "randint_like"}


@cache
def tree(file: Path) -> ast.Module:
    return ast.parse(file.read_text(encoding="utf-8"), filename=str(file))


def layer_of(file: Path) -> str | None:
    """The folder below irl/; None for the files that lie beside the layers."""
    parts = file.relative_to(PACKAGE).parts
    return parts[0] if len(parts) > 1 else None


def imported(file: Path) -> Iterator[tuple[int, str]]:
    """Line and full name of each imported module, function-level imports too."""
    package = [PACKAGE.name, *file.relative_to(PACKAGE).parent.parts]
    for node in ast.walk(tree(file)):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = ".".join(package[: len(package) + 1 - node.level]) if node.level else ""
            module = ".".join(filter(None, (base, node.module)))
            # `from irl import core` names a layer, `from irl.core.rng import stream` does not
            names = [f"{module}.{alias.name}" for alias in node.names] if module == "irl" else [module]
            yield from ((node.lineno, name) for name in names)


def calls(file: Path) -> Iterator[tuple[int, str, ast.Call]]:
    """Line, name as imported (`np.random.rand` is `numpy.random.rand`) and node of each call."""
    origin: dict[str, str] = {}
    for node in ast.walk(tree(file)):
        if isinstance(node, ast.Import):
            origin |= {
                a.asname or a.name.split(".")[0]: a.name if a.asname else a.name.split(".")[0]
                for a in node.names
            }
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            origin |= {a.asname or a.name: f"{node.module}.{a.name}" for a in node.names}
    for node in ast.walk(tree(file)):
        if isinstance(node, ast.Call):
            head, *rest = ast.unparse(node.func).split(".")
            if head in origin:
                yield node.lineno, ".".join([origin[head], *rest]), node


def draws_from_global_state(name: str, call: ast.Call) -> bool:
    module, _, function = name.rpartition(".")
    if module in ("numpy.random", "random"):
        return function not in HARMLESS
    if module in ("torch", "torch.random", "torch.cuda"):
        has_generator = any(keyword.arg == "generator" for keyword in call.keywords)
        return function in TORCH_GLOBAL or (function in TORCH_DRAWS and not has_generator)
    return False


def where(file: Path, line: int) -> str:
    return f"{file.relative_to(ROOT)}:{line}"


def wrong_imports(file: Path) -> Iterator[str]:
    layer = layer_of(file)
    for line, name in imported(file):
        top, _, below = name.partition(".")
        target = below.partition(".")[0]
        if top in OWNERS and layer != OWNERS[top]:
            yield f"{where(file, line)} imports {top}, which only irl.{OWNERS[top]} does"
        if top != "irl" or layer is None or target == layer:
            continue
        if target not in DEPTH:
            yield f"{where(file, line)} imports irl itself; name the layer"
        elif DEPTH[target] <= DEPTH[layer]:
            yield f"{where(file, line)} imports {name} from {layer}"


def test_every_folder_is_a_layer():
    assert {layer_of(file) for file in FILES} - {None} <= set(DEPTH)


def test_imports_point_downwards():
    assert [line for file in FILES for line in wrong_imports(file)] == []


@pytest.mark.parametrize(
    ("source", "complaint"),
    [
        ("from irl.experiment import cli", "imports irl.experiment from rewards"),
        ("from irl import algorithms", "imports irl.algorithms from rewards"),
        ("from ..learners import ppo", "imports irl.learners from rewards"),
        ("def f():\n    import minari", "imports minari, which only irl.demos does"),
        ("from irl import load_demos", "imports irl itself; name the layer"),
        ("from irl.core.rng import stream\nfrom . import maps\nfrom irl.rewards import terms", None),
    ],
)
def test_the_import_rule_sees(source, complaint, monkeypatch):
    monkeypatch.setitem(globals(), "tree", lambda _: ast.parse(source))
    found = list(wrong_imports(PACKAGE / "rewards" / "example.py"))
    assert (complaint is None and not found) or (len(found) == 1 and found[0].endswith(str(complaint)))


def test_nothing_is_called_utils_or_common():
    assert [f for f in PACKAGE.rglob("*") if f.stem in ("util", "utils", "common", "helpers", "misc")] == []


def test_no_file_is_over_400_lines():
    files = [*FILES, *sorted((ROOT / "tests").rglob("*.py")), *sorted((ROOT / "scripts").rglob("*.py"))]
    lengths = {str(f.relative_to(ROOT)): len(f.read_text(encoding="utf-8").splitlines()) for f in files}
    assert {name: n for name, n in lengths.items() if n > 400} == {}


def test_no_file_from_elsewhere_can_run_code():
    found = [where(f, line) for f in FILES for line, name, _ in calls(f) if name in UNSAFE_LOADS]
    assert found == []


# Where tensors are the CPU's already: kept there, or made there.
HERE = {"weight.numpy()"}
HERE_IN = {"ppo_collect.py": "what acts step by step is a copy on the CPU"}


def test_arrays_are_made_of_what_was_brought_to_the_cpu():
    """A tensor of a GPU has no `numpy`; no test here has one."""
    trained_with = [
        f for f in FILES if layer_of(f) in ("algorithms", "discriminators", "learners", "rewards")
    ]
    found = [
        f"{where(file, node.lineno)} {ast.unparse(node)}"
        for file in trained_with
        if file.name not in HERE_IN
        for node in ast.walk(tree(file))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "numpy"
        if ".cpu()" not in ast.unparse(node) and ast.unparse(node) not in HERE
    ]
    assert found == []


def test_randomness_is_an_argument():
    found = [
        f"{where(file, line)} {name}"
        for file in FILES
        if layer_of(file) != "learners"  # SB3 draws from global state there
        for line, name, call in calls(file)
        if draws_from_global_state(name, call)
    ]
    assert found == []


@pytest.mark.parametrize(
    ("source", "global_draw"),
    [
        ("import numpy as np\nnp.random.rand(3)", True),
        ("from numpy.random import seed\nseed(0)", True),
        ("import numpy as np\nnp.random.default_rng(0)", False),
        ("import numpy as np\nnp.random.get_state()", False),
        ("import random\nrandom.choice([1])", True),
        ("random = make()\nrandom.mean()", False),
        ("import torch\ntorch.manual_seed(0)", True),
        ("import torch\ntorch.randn(3)", True),
        ("import torch\ntorch.randn(3, generator=g)", False),
    ],
)
def test_the_randomness_rule_sees(source, global_draw, monkeypatch):
    monkeypatch.setitem(globals(), "tree", lambda _: ast.parse(source))
    found = [draws_from_global_state(name, call) for _, name, call in calls(PACKAGE / "example.py")]
    assert any(found) == global_draw


def test_every_protocol_can_be_checked_when_the_tests_run():
    found = [
        where(file, node.lineno)
        for file in FILES
        for node in ast.walk(tree(file))
        if isinstance(node, ast.ClassDef)
        and "Protocol" in {ast.unparse(base).split("[")[0] for base in node.bases}
        if "runtime_checkable" not in {ast.unparse(decorator) for decorator in node.decorator_list}
    ]
    assert found == [], "beartype refuses a protocol that is not @runtime_checkable"


def test_the_public_names_are_few_sorted_and_there():
    irl = importlib.import_module("irl")
    names = list(getattr(irl, "__all__", []))
    assert names == sorted(set(names))
    assert len(names) <= 25
    assert [name for name in names if not hasattr(irl, name)] == []
