"""What was typed is kept so that a shell reads it again."""

import shlex
import sys

import pytest

from irl.core.provenance import command_line


def test_a_command_can_be_pasted_into_a_shell(monkeypatch: pytest.MonkeyPatch) -> None:
    words = ("--extra=--preset airl-halfcheetah", "--out", "a folder/x", "--env-kwargs", '{"a": 1}')
    typed = ["train", "airl", *words]
    monkeypatch.setattr(sys, "argv", ["/some/where/irl", *typed])
    assert shlex.split(command_line()) == ["irl", *typed]
