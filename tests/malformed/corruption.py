"""Hypothesis strategies: the bytes of a file changed a little, and JSON with another value somewhere."""

import json
from collections.abc import Callable
from typing import Any

from hypothesis import strategies as st

TOKENS = [
    b"null",
    b"-1",
    b"0",
    b"1e999",
    b"NaN",
    b'"x"',
    b"[]",
    b"{}",
    b"[" * 3000,
    b"9" * 5000,
    b"true",
    b"\xff",
]


@st.composite
def bytes_changed(draw: Callable, content: bytes) -> bytes:
    """Up to four bytes flipped, pieces cut out, put in or doubled, or the end cut off."""
    changed = bytearray(content)
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, max(len(changed) - 1, 0)))
        match draw(st.sampled_from(["flip", "flip", "put in", "token", "take out", "double", "cut"])):
            case "flip" if changed:
                changed[at] ^= 1 << draw(st.integers(0, 7))
            case "put in":
                changed[at:at] = draw(st.binary(min_size=1, max_size=8))
            case "token":
                changed[at : at + draw(st.integers(0, 4))] = draw(st.sampled_from(TOKENS))
            case "take out":
                del changed[at : at + draw(st.integers(1, 64))]
            case "double":
                changed[at:at] = changed[at : at + draw(st.integers(1, 64))]
            case "cut":
                del changed[at:]
    return bytes(changed)


VALUES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.sampled_from([-1, 0, 10**9, 10**400]),
    st.floats(),
    st.text(max_size=5),
    st.sampled_from(["../../x-v0", "evil:Env-v0", "[/x]", "\x1b[31m", "\x00", "/etc/passwd"]),
    st.just([]),
    st.just({}),
    st.just([{"a": [None]}]),
)


@st.composite
def json_changed(draw: Callable, content: bytes) -> bytes:
    """One value anywhere in a JSON document, or one key, replaced, taken away or added."""
    document = json.loads(content)
    places = list(_places(document))
    holder, key = draw(st.sampled_from(places))
    match draw(st.sampled_from(["replace", "replace", "remove", "add", "root"])):
        case "replace":
            holder[key] = draw(VALUES)
        case "remove":
            del holder[key]
        case "add" if isinstance(holder, dict):
            holder[draw(st.text(max_size=5))] = draw(VALUES)
        case "root":
            document = draw(VALUES)
    return json.dumps(document).encode()


def _places(value: Any) -> Any:
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in list(items):
        yield value, key
        yield from _places(inner)
