"""The `ffc-id` program from its first moment to its exit code: signals, and what becomes of errors.

Only the standard library is imported here: a signal that comes while numpy is being imported finds its
handler, and every error its sentence.
"""

from __future__ import annotations

import errno
import gc
import io
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:
    import click

#: Exit codes that are not an error's own (sysexits.h calls 70 an internal software error).
INTERRUPTED = 130
PROGRAM_FAULT = 70
CANNOT_WRITE = 3
USAGE = 2
#: So much of a name that is too long is shown.
_SHOWN = 60
#: Objects between two looks for garbage: imports and a fit make fewer, nearly all of which stay.
_OBJECTS = 300_000
#: mallopt of glibc: what it gives back to the system at once, and what is at the end of its heap. It comes to
#: these bytes by itself where a program frees as much; until then each array of a fit is new memory.
_MEMORY = {-3: 32 << 20, -1: 64 << 20}


def main(argv: list[str] | None = None) -> NoReturn:
    """Run the command line; every error ends as one sentence and an exit code."""
    with _stop_signals(to_the_end=argv is None) as stopped:
        try:
            try:
                code = _run(argv)
            except Exception as error:
                # some libraries turn an interrupt into an error of their own
                code = _interrupted() if stopped else _told(error)
        except KeyboardInterrupt:
            code = _interrupted()
    if argv is None:
        gc.freeze()  # the interpreter would look through all modules for garbage before it ends
    sys.exit(code)


def _run(argv: list[str] | None) -> int:
    # The matrices here are tall and thin: more threads of linear algebra only wait for each other.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    gc.set_threshold(_OBJECTS)
    _keep_memory()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal that cannot show ± shows ? and no traceback
    import logging

    from .commands import ffc_id

    # what libraries warn of is for programmers; the sentences for users are our own
    logging.captureWarnings(True)
    if "_FFC_ID_COMPLETE" in os.environ:
        from .completion import register

        register()
    try:
        code = ffc_id.main(args=argv, prog_name="ffc-id", standalone_mode=False)
    finally:
        logging.captureWarnings(False)
    sys.stdout.flush()
    return code if isinstance(code, int) else 0


def _keep_memory() -> None:
    import ctypes

    with suppress(AttributeError, OSError, TypeError):  # another C library
        mallopt = ctypes.CDLL(None).mallopt
        for parameter, size in _MEMORY.items():
            mallopt(parameter, size)


@contextmanager
def _stop_signals(*, to_the_end: bool) -> Iterator[list[int]]:
    """A closed terminal and a polite kill end the program as Ctrl-C does; the signals that came.

    One that is ignored, as by nohup, stays so. The program itself keeps them `to_the_end`: one that comes
    while the interpreter takes itself apart finds the work done or undone already, and nothing to say.
    """
    came: list[int] = []

    def interrupt(number: int, _: Any) -> NoReturn:
        came.append(number)
        raise KeyboardInterrupt

    names = ("SIGINT", "SIGTERM", "SIGHUP")
    before = {number: signal.getsignal(number) for name in names if (number := getattr(signal, name, None))}
    before = {n: had for n, had in before.items() if had in (signal.SIG_DFL, signal.default_int_handler)}
    if threading.current_thread() is not threading.main_thread():
        before = {}  # Python delivers signals to the main thread only
    for number in before:
        signal.signal(number, interrupt)
    try:
        yield came
    finally:
        for number, had in before.items():
            signal.signal(number, _leave if to_the_end else had)


def _leave(*_: Any) -> NoReturn:
    os._exit(INTERRUPTED)


def _told(error: Exception) -> int:
    """Say what is wrong in one sentence; the exit code."""
    import click

    from idtool.errors import FfcIdError

    if isinstance(error, click.exceptions.Abort):
        return _interrupted()
    if type(error).__name__ == "NoArgsIsHelpError":  # since click 8.2
        _say(str(error))
        return USAGE
    if isinstance(error, click.ClickException):
        _say(f"ffc-id: {_usage_sentence(error)}")
        return USAGE
    if isinstance(error, FfcIdError):
        _say(f"ffc-id: {error.on_the_command_line}")
        return error.exit_code
    if isinstance(error, BrokenPipeError):
        _drop_output()  # the reader of our output went away; there is nobody to tell
        return 0
    if isinstance(error, OSError) and error.filename is None and error.errno == errno.ENOSPC:
        _say(
            f"ffc-id: standard output cannot be written ({error.strerror}); free space or pick another place."
        )
        _drop_output()
        return CANNOT_WRITE
    if isinstance(error, OSError) and error.filename and error.errno in (errno.ENAMETOOLONG, errno.ELOOP):
        _say(f"ffc-id: {str(error.filename)[:_SHOWN]}: {error.strerror}; name another place.")
        return CANNOT_WRITE
    from .fault import sentence_of

    _say(f"ffc-id: {sentence_of(error)}")
    return PROGRAM_FAULT


def _usage_sentence(error: click.ClickException) -> str:
    """What is wrong with the words of a command, and where its options stand, as one sentence."""
    import re

    import click

    if isinstance(error, click.NoSuchOption) and error.possibilities:
        near = " or ".join(f'"{one}"' for one in error.possibilities)
        return f'no option "{error.option_name}"; did you mean {near}?'
    message = re.sub(
        r"is not a valid (float|integer)(?: range)?",
        lambda found: {"float": "is no number", "integer": "is no whole number"}[found[1]],
        " ".join(error.format_message().split()),
    )
    context = getattr(error, "ctx", None)
    if context is None or message.endswith("?"):  # a guess is the remedy already
        return message
    if isinstance(error, click.MissingParameter) and (told := getattr(error.param, "help", None)):
        message = f"{message.removesuffix('.')} ({told.partition('. ')[0].removesuffix('.')})"
    return f"{message.removesuffix('.')}; {context.command_path} --help shows what it takes."


def _interrupted() -> int:
    _say("interrupted.")
    return INTERRUPTED


def _say(text: str) -> None:
    with suppress(OSError, ValueError):  # the terminal itself may be what went away
        print(text, file=sys.stderr, flush=True)


def _drop_output() -> None:
    """What is still in the buffers goes nowhere, or the interpreter would fail on it at its end."""
    with suppress(OSError, ValueError, io.UnsupportedOperation):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
