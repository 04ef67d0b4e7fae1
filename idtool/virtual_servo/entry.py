"""A servo's table and its entries, whoever made it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class Entry(ABC):
    """One entry.

    Attributes:
        address, size: where, bytes.
        writable: RW, else R.
        initial: value after switching on.
        range: lowest and highest value that may be written, None for whatever fits.
    """

    address: int
    size: int
    writable: bool = True
    initial: int = 0
    range: tuple[int, int] | None = None

    @abstractmethod
    def encode(self, value: int) -> bytes:
        """The bytes of a number."""

    @abstractmethod
    def decode(self, data: bytes) -> int:
        """The number of the bytes."""


class Table:
    """The memory of one servo.

    Attributes:
        fields: its entries by name.
        size: bytes.
        eeprom_end: what lies below this address keeps its value without power.
    """

    fields: ClassVar[Mapping[str, Entry]]
    size: ClassVar[int]
    eeprom_end: ClassVar[int]

    def __init__(self) -> None:
        self._memory = bytearray(self.size)
        for name, field in self.fields.items():
            self[name] = field.initial

    def __getitem__(self, name: str) -> int:
        field = self.fields[name]
        return field.decode(bytes(self._memory[field.address : field.address + field.size]))

    def __setitem__(self, name: str, value: int) -> None:
        """Set an entry as the servo itself does, without any rule but that it fits."""
        field = self.fields[name]
        self._memory[field.address : field.address + field.size] = field.encode(value)

    def reboot(self) -> None:
        """Back to the initial values, except what is in the EEPROM."""
        for name, field in self.fields.items():
            if field.address >= self.eeprom_end:
                self[name] = field.initial
