"""What every control law shares: where the axis is held, and what the law does from sample to sample."""

from __future__ import annotations

from abc import ABC, abstractmethod

from idtool.control.guard import Limits, Measurement, State
from idtool.control.online import OnlineModel

#: Slower than this an axis is stopping, not moving, in resolutions per second.
REST_COUNTS_PER_S = 33.0


class Law(ABC):
    """From measurements to the command before its limits. Sub-classes are final.

    Attributes:
        state: what it is doing; never FAULT.
        anchor: where the axis is held while no hand moves it, rad (m).
        torque: estimate of the hand's torque, N m (N).
        raw: the same before any filter.
        wanted: speed at which the axis is asked to yield, rad/s (m/s).
        limited: limits that cut the raw command at this sample.
        uncertainty: how far the model may be wrong at this motion, N m (N); 0 where the law does not ask.
        extra: friction that the law adds to the model's, N m (N).
        note: something the user must know, a sentence; empty if there is nothing.
    """

    state: State = State.STARTING
    anchor: float
    torque: float
    raw: float = 0.0
    wanted: float
    limited: tuple[str, ...] = ()
    uncertainty: float = 0.0
    extra: float = 0.0
    note: str = ""

    def __init__(self, model: OnlineModel, limits: Limits, period: float, resolution: float) -> None:
        self.model = model
        self.limits = limits
        self.period = period
        self.resolution = resolution
        self.rest_speed = REST_COUNTS_PER_S * resolution

    @abstractmethod
    def reset(self) -> None:
        """As after construction: what was learned is forgotten too."""

    @abstractmethod
    def begin(self, position: float) -> None:
        """Start at the first sample after construction, `reset` or a fault: the bristle is unknown."""

    @abstractmethod
    def raw_command(self, sample: Measurement) -> float:
        """The command before the limits, rad (m)."""

    @abstractmethod
    def stand(self, position: float) -> None:
        """The axis was braked from outside and stands here: rest, as after a stop of its own."""

    @abstractmethod
    def rest(self) -> None:
        """The axis is held from outside: rest, keep the zero, start on nothing that was felt so far."""

    @property
    def ready(self) -> bool:
        """Whether it rests and a hand may push."""
        return self.state is State.RESTING

    def tare(self) -> bool:
        """Move to and fro to learn load and friction; False where the law does not, or not now."""
        return False


#: What it is doing, in words.
WORDS = {
    State.STARTING: "reads the friction from the current, hands off",
    State.TARING: "moves by itself to learn its load, hands off",
    State.RESTING: "rests until a hand pushes",
    State.STOPPING: "stops, the hand let go",
    State.GUIDING: "follows the hand",
    State.HELD: "is held, the button is up",
}
