"""One preset over a run's settings; `irl.experiment.presets` has them all."""

from dataclasses import fields, is_dataclass, replace
from typing import Any

from irl.core.errors import UserError
from irl.experiment.presets import PRESETS


def with_preset(config: Any, name: str) -> Any:
    """The run `config` with the settings of a preset.

    Raises:
        UserError: there is no such preset, or it is of another method.
    """
    if name not in PRESETS:
        raise UserError(f"no preset {name!r:.40}; there are: {', '.join(PRESETS)}")
    preset = PRESETS[name]
    if preset.method != config.KIND:
        raise UserError(
            f"preset {name} is of {preset.method}, not of {config.KIND}; use: irl train {preset.method} "
            f"--preset {name}"
        )
    return replace(_changed(config, preset.settings), preset=name)


def _changed(config: Any, settings: dict[str, Any]) -> Any:
    """The same with these dotted names set, all of one part at once: settings may only fit together."""
    known = {field.name for field in fields(config)}
    parts: dict[str, dict[str, Any]] = {}
    values: dict[str, Any] = {}
    for name, value in settings.items():
        head, _, rest = name.partition(".")
        if head not in known:
            raise KeyError(f"{type(config).__name__} has no setting {head}")
        if rest:
            parts.setdefault(head, {})[rest] = value
        else:
            values[head] = value
    for head, inner in parts.items():
        assert is_dataclass(getattr(config, head))
        values[head] = _changed(getattr(config, head), inner)
    return replace(config, **values)
