"""Whether a Dask scheduler answers, asked before anything that takes its time to import."""

from __future__ import annotations

import asyncio
import time
from dataclasses import dataclass
from typing import Any

from idtool.errors import InputError

#: A scheduler that does not speak by then is given up, s. What importing Dask takes counts: one waits for it.
PATIENCE_S = 10.0
#: However long that took, a scheduler has this long to answer, s.
_AT_LEAST_S = 2.0


@dataclass(frozen=True)
class Greeted:
    """A scheduler that answered.

    Attributes:
        address: its own.
        client: class of Dask's client.
    """

    address: str
    client: Any


def greet(address: str) -> Greeted:
    """Ask who is there: Dask's client itself waits without end for one that accepts and says nothing.

    Raises:
        InputError: Dask is not installed, or no scheduler answers.
    """
    begun = time.monotonic()
    try:
        import distributed
    except ImportError as error:
        raise InputError(
            "a Dask cluster needs the package distributed", remedy="pip install 'ffc-id[fleet]'"
        ) from error
    left = PATIENCE_S - (time.monotonic() - begun)
    try:
        asyncio.run(_greeted(address, max(left, _AT_LEAST_S)))
    except Exception as error:  # whatever another kind of server says, or its silence
        raise no_scheduler(address) from error
    return Greeted(address, distributed.Client)


def no_scheduler(address: str) -> InputError:
    """What is said where nobody answers."""
    return InputError(
        f"no Dask scheduler answers at {address}",
        place="--scheduler",
        remedy="start it with dask scheduler and dask worker, and check the address",
    )


async def _greeted(address: str, within: float) -> None:
    from distributed.core import rpc

    ask: Any = rpc  # distributed is typed in parts only
    async with asyncio.timeout(within), ask(address) as scheduler:
        await scheduler.identity()
