import json
import pickle
import random
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from irl.core import state
from irl.core.errors import UserError
from irl.core.nets import mlp
from irl.core.rng import stream, torch_stream


def same(a: Any, b: Any) -> bool:
    """Equal in value, type and dtype, all the way down; NaN equals NaN."""
    if type(a) is not type(b):
        return False
    if isinstance(a, torch.Tensor):
        return a.dtype == b.dtype and a.shape == b.shape and same(a.numpy(), b.numpy())
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if isinstance(a, dict):
        # in order, as an optimiser's parameters are
        return same(list(a.items()), list(b.items()))
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    return a == b or (a != a and b != b)


def after_round_trip(value: Any) -> Any:
    with tempfile.TemporaryDirectory() as folder:
        state.save(Path(folder), value)
        return state.load(Path(folder))


plain = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5)
keys = st.integers() | st.text(max_size=5) | st.tuples(st.integers(), st.text(max_size=2))
numbers = st.lists(st.integers(0, 100), max_size=4)
tensors = numbers.map(torch.tensor) | numbers.map(np.array)
nested = st.recursive(
    plain | tensors,
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.lists(inner, max_size=3).map(tuple)
        | st.dictionaries(keys, inner, max_size=3)
    ),
    max_leaves=8,
)


@settings(max_examples=40)
@given(nested)
def test_what_is_loaded_is_what_was_saved(value: Any) -> None:
    assert same(after_round_trip(value), value)


@pytest.mark.parametrize(
    "dtype",
    [torch.float64, torch.float32, torch.float16, torch.int64, torch.int32, torch.uint8, torch.bool],
)
@pytest.mark.parametrize("shape", [(), (0,), (3,), (2, 0, 3), (2, 3)])
def test_tensors_and_arrays_keep_dtype_and_shape(dtype: torch.dtype, shape: tuple[int, ...]) -> None:
    tensor = torch.arange(6)[: int(np.prod(shape))].reshape(shape).to(dtype)
    assert same(after_round_trip({"t": tensor, "a": tensor.numpy()}), {"t": tensor, "a": tensor.numpy()})


def test_views_are_saved_as_they_look() -> None:
    tensor = torch.arange(6.0).reshape(2, 3)
    array = np.arange(6.0).reshape(2, 3)
    loaded = after_round_trip([tensor.T, array.T, array[:, ::2], tensor.clone().requires_grad_(True)])
    assert same(loaded[0], tensor.T.contiguous())
    assert same(loaded[1], np.ascontiguousarray(array.T))
    assert same(loaded[2], np.ascontiguousarray(array[:, ::2]))
    assert torch.equal(loaded[3], tensor)


def test_a_loaded_tensor_can_be_written_to() -> None:
    first, second = after_round_trip([torch.zeros(2), torch.zeros(2)])
    first += 1
    assert second.tolist() == [0.0, 0.0]


def test_generators_go_on_where_they_were() -> None:
    numpy_generator, torch_generator, python = stream(0, "a"), torch_stream(0, "a"), random.Random(0)
    old = np.random.RandomState(0)  # SB3's buffers have such a state
    old.standard_normal(3)
    python.gauss(0, 1)
    numpy_generator.random(5, dtype=np.float32)
    saved = after_round_trip(
        {
            "numpy": numpy_generator.bit_generator.state,
            "torch": torch_generator.get_state(),
            "python": python.getstate(),
            "legacy": old.get_state(),
        }
    )
    expected = [
        numpy_generator.random(4, dtype=np.float32).tolist(),
        torch.rand(4, generator=torch_generator).tolist(),
        [python.gauss(0, 1), python.random()],
        old.standard_normal(5).tolist(),
    ]
    others = stream(1, "b"), torch_stream(1, "b"), random.Random(1), np.random.RandomState(1)
    others[0].bit_generator.state = saved["numpy"]
    others[1].set_state(saved["torch"])
    others[2].setstate(saved["python"])
    others[3].set_state(saved["legacy"])
    assert expected == [
        others[0].random(4, dtype=np.float32).tolist(),
        torch.rand(4, generator=others[1]).tolist(),
        [others[2].gauss(0, 1), others[2].random()],
        others[3].standard_normal(5).tolist(),
    ]


def test_an_optimiser_goes_on_where_it_was() -> None:
    def started() -> tuple[torch.nn.Module, torch.optim.Optimizer]:
        net = mlp((2, 4, 1), "tanh", torch_stream(0, "net"))
        return net, torch.optim.Adam(net.parameters(), lr=0.01, betas=(0.8, 0.9))

    def step(net: torch.nn.Module, optimizer: torch.optim.Optimizer) -> None:
        optimizer.zero_grad()
        net(torch.ones(1, 2)).square().sum().backward()
        optimizer.step()

    net, optimizer = started()
    for _ in range(3):
        step(net, optimizer)
    saved = {"net": net.state_dict(), "optimizer": optimizer.state_dict()}
    loaded = after_round_trip({name: dict(part) for name, part in saved.items()})
    assert list(loaded["optimizer"]["state"]) == [0, 1, 2, 3]
    other, other_optimizer = started()
    other.load_state_dict(loaded["net"])
    other_optimizer.load_state_dict(loaded["optimizer"])
    step(net, optimizer)
    step(other, other_optimizer)
    assert all(torch.equal(a, b) for a, b in zip(net.parameters(), other.parameters(), strict=True))


@pytest.mark.parametrize(
    "value",
    [
        object(),
        {1, 2},
        b"bytes",
        np.array([object()]),
        np.array(["text"]),
        torch.zeros(2, dtype=torch.bfloat16),
    ],
    ids=["object", "set", "bytes", "object array", "text array", "bfloat16"],
)
def test_what_cannot_be_saved_is_refused(tmp_path: Path, value: Any) -> None:
    with pytest.raises(TypeError):
        state.save(tmp_path, {"deep": [value]})


def damage(folder: Path, name: str, content: bytes | None) -> None:
    if content is None:
        (folder / name).unlink()
    else:
        (folder / name).write_bytes(content)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        (state.STRUCTURE, None),
        (state.ARRAYS, None),
        (state.STRUCTURE, b'{"": "dict", "of": [['),
        (state.ARRAYS, b""),
        (state.ARRAYS, b"\x10\x00\x00\x00\x00\x00\x00\x00{not json at all"),
        (state.STRUCTURE, b'{"": "tensor", "of": "5"}'),
        (state.STRUCTURE, b'{"": "tensor", "of": ["0"]}'),
        (state.STRUCTURE, b'{"": "pickle", "of": "0"}'),
        (state.STRUCTURE, b'{"": "dict", "of": [[{"": "dict", "of": []}, 1]]}'),
        (state.STRUCTURE, b'{"": "dict", "of": [1, 2]}'),
        (state.STRUCTURE, b'{"other": "json"}'),
    ],
)
def test_damaged_files_are_the_users_to_mend(tmp_path: Path, name: str, content: bytes | None) -> None:
    state.save(tmp_path, {"a": torch.arange(5)})
    damage(tmp_path, name, content)
    with pytest.raises(UserError, match=tmp_path.name):
        state.load(tmp_path)


@pytest.mark.parametrize("name", [state.STRUCTURE, state.ARRAYS])
def test_a_cut_off_file_is_damaged_wherever_it_is_cut(tmp_path: Path, name: str) -> None:
    state.save(tmp_path, {"a": torch.arange(5), "b": [1, 2]})
    whole = (tmp_path / name).read_bytes()
    for length in range(0, len(whole), 7):
        (tmp_path / name).write_bytes(whole[:length])
        with pytest.raises(UserError):
            state.load(tmp_path)


class Payload:
    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.touch, (self.mark,)


@pytest.mark.parametrize("name", [state.STRUCTURE, state.ARRAYS])
def test_a_pickle_in_its_place_is_not_run(tmp_path: Path, name: str) -> None:
    mark = tmp_path / "ran"
    content = pickle.dumps(Payload(mark))
    pickle.loads(content)
    assert mark.exists()  # the payload would work
    mark.unlink()
    state.save(tmp_path, {"a": torch.arange(5)})
    (tmp_path / name).write_bytes(content)
    with pytest.raises(UserError):
        state.load(tmp_path)
    assert not mark.exists()


def test_other_tools_can_read_both_files(tmp_path: Path) -> None:
    state.save(tmp_path, {"steps": 5, 0: (torch.tensor([1.5]),)})
    one = {"": "tuple", "of": [{"": "tensor", "of": "0"}]}
    content = json.loads((tmp_path / state.STRUCTURE).read_text())
    assert content["state"] == {"": "dict", "of": [["steps", 5], [0, one]]}


def test_a_changed_number_is_damage_and_not_another_number(tmp_path: Path) -> None:
    state.save(tmp_path, {"steps": 5, "weights": torch.zeros(3)})
    text = (tmp_path / state.STRUCTURE).read_text()
    (tmp_path / state.STRUCTURE).write_text(text.replace("5]", "6]", 1))
    with pytest.raises(UserError, match="not what was written"):
        state.load(tmp_path)
    (tmp_path / state.STRUCTURE).write_text(text)
    assert state.load(tmp_path)["steps"] == 5
    content = bytearray((tmp_path / state.ARRAYS).read_bytes())
    content[-1] ^= 1
    (tmp_path / state.ARRAYS).write_bytes(content)
    with pytest.raises(UserError, match="not what was written"):
        state.load(tmp_path)
