"""Where the button is: a key that terminals only repeat, a pin, and words that are none."""

from __future__ import annotations

import os
import pty
import sys
from pathlib import Path

import pytest

from idtool.errors import InputError
from idtool.guiding.button import FIRST_REPEAT_S, REPEAT_S, HeldKey, KeyButton, ToggledKey, open_button


def held(key: HeldKey, until: float, *, first: float = 0.5, every: float = 0.03) -> None:
    """A keyboard that repeats a key held from 1 s on."""
    key.press(1.0)
    at = 1.0 + first
    while at < until:
        key.press(at)
        at += every


def test_a_held_key_is_down_until_it_no_longer_repeats_itself() -> None:
    key = HeldKey()
    assert not key.down(0.0)
    key.press(1.0)
    assert key.down(1.0)
    assert key.down(1.0 + FIRST_REPEAT_S), "the slowest keyboards begin to repeat so late"
    assert not key.down(1.0 + FIRST_REPEAT_S + 0.01), "a tap ends by itself"
    held(key, 3.0)
    assert key.down(3.0)
    assert not key.down(3.0 + REPEAT_S + 0.01)


def test_a_key_that_comes_again_begins_anew() -> None:
    key = HeldKey()
    held(key, 3.0)
    key.press(5.0)
    assert key.down(5.0 + 0.5)


def test_a_toggled_key_goes_up_at_once_and_down_after_a_pause() -> None:
    key = ToggledKey()
    key.press(1.0)
    assert key.down(1.0)
    key.press(3.0)
    assert not key.down(3.0)
    key.press(3.1)
    assert not key.down(3.1), "a key that repeats itself ends up"
    key.press(3.1 + FIRST_REPEAT_S + 0.01)
    assert key.down(9.0)


def test_the_space_bar_of_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    ours, theirs = pty.openpty()
    clock = [0.0]
    with os.fdopen(theirs, "rb", buffering=0) as stream:
        monkeypatch.setattr(sys, "stdin", stream)
        button = KeyButton(toggle=False, now=lambda: clock[0])
        assert not button(0.0)
        os.write(ours, b"x")
        assert not button(0.0)
        os.write(ours, b" ")
        assert button(0.0)
        clock[0] = FIRST_REPEAT_S + 0.1
        assert not button(0.0)
        button.close()
    os.close(ours)


def test_a_pin_is_a_file_that_says_1(tmp_path: Path) -> None:
    pin = tmp_path / "value"
    pin.write_text("0\n")
    with open_button(f"gpio:{pin}") as button:
        assert button is not None
        assert not button(0.0)
        pin.write_text("1\n")
        assert button(0.0)
        pin.unlink()
        assert not button(0.0), "what cannot be read is up"


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("gpio:/nowhere/value", "no /nowhere"),
        ("kye", "key"),
        ("key", "terminal"),
        ("gpio:", "unknown button"),
    ],
)
def test_words_that_are_none(spec: str, words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with open(os.devnull) as nothing:
        monkeypatch.setattr(sys, "stdin", nothing)
        with pytest.raises(InputError, match=words), open_button(spec):
            pass


def test_none_is_no_button_and_the_simulated_one_is_pressed_after_a_while() -> None:
    with open_button("none") as button:
        assert button is None
    with open_button("sim") as button:
        assert button is not None
        assert [button(t) for t in (0.0, 0.4, 0.6, 9.0)] == [False, False, True, True]
