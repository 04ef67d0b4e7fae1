"""The virtual servo against the vendor's SDK, and its packets against the published rules."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import dynamixel_sdk as sdk
import pytest
from hypothesis import given
from hypothesis import strategies as st

from idtool.virtual_servo.dynamixel.packet import Damaged, Decoder, Packet, crc16, encode
from idtool.virtual_servo.dynamixel.table import FIELDS
from tests.rig.dynamixel.support import BAUD, Bench, eventually


def patiently(act: Callable[[], Any], good: Any, tries: int = 8) -> bool:
    """Whether one of some tries ends so: a busy computer may be late with an answer."""
    return any(act() == good for _ in range(tries))


class Client:
    """The SDK, unchanged, on one device."""

    def __init__(self, path: str, baud: int = BAUD) -> None:
        self.port = sdk.PortHandler(path)
        assert self.port.setBaudRate(baud)
        self.handler = sdk.Protocol2PacketHandler()

    def read(self, name: str, *, tries: int = 5) -> tuple[int, int, int]:
        field = FIELDS[name]
        read = {1: "read1ByteTxRx", 2: "read2ByteTxRx", 4: "read4ByteTxRx"}[field.size]
        for _ in range(tries):  # a busy computer may be late with its answer
            value, result, error = getattr(self.handler, read)(self.port, 1, field.address)
            if result == sdk.COMM_SUCCESS:
                break
            self.wait_for_the_late()
        return value, result, error

    def write(self, name: str, value: int, *, tries: int = 5) -> tuple[int, int]:
        field = FIELDS[name]
        write = {1: "write1ByteTxRx", 2: "write2ByteTxRx", 4: "write4ByteTxRx"}[field.size]
        for _ in range(tries):
            result, error = getattr(self.handler, write)(self.port, 1, field.address, value)
            if result == sdk.COMM_SUCCESS:
                break
            self.wait_for_the_late()
        return result, error

    def wait_for_the_late(self) -> None:
        """An answer that comes after all must not be taken for that of the next instruction."""
        time.sleep(0.05)
        self.port.clearPort()


@pytest.fixture
def on() -> Iterator[tuple[Bench, Client]]:
    with Bench() as made:
        client = Client(made.terminal.path)
        yield made, client
        client.port.closePort()


def test_ping_and_who_is_there(on: tuple[Bench, Client]) -> None:
    _, client = on
    assert patiently(lambda: client.handler.ping(client.port, 1), (1150, sdk.COMM_SUCCESS, 0))
    assert client.handler.ping(client.port, 2)[1] == sdk.COMM_RX_TIMEOUT


@pytest.mark.parametrize("name", FIELDS)
def test_every_entry_is_read_as_it_stands(on: tuple[Bench, Client], name: str) -> None:
    made, client = on
    value, result, error = client.read(name)
    assert (result, error) == (sdk.COMM_SUCCESS, 0)
    if name not in ("realtime_tick", "present_current", "present_velocity", "present_position"):
        size = 8 * FIELDS[name].size
        assert value == made.servo.table[name] % (1 << size)


@pytest.mark.parametrize(
    ("name", "value", "error"),
    [
        ("led", 1, 0),
        ("led", 2, 4),  # out of range
        ("goal_velocity", 60, 0),
        ("goal_velocity", 2**32 - 60, 0),  # two's complement
        ("goal_velocity", 300, 6),  # beyond the velocity limit
        ("goal_current", 2000, 6),
        ("present_position", 5, 7),  # read only
        ("hardware_error_status", 0, 7),
        ("operating_mode", 1, 0),
        ("operating_mode", 0, 4),
    ],
)
def test_access_rules(on: tuple[Bench, Client], name: str, value: int, error: int) -> None:
    made, client = on
    before = made.servo.table[name]
    assert client.write(name, value) == (sdk.COMM_SUCCESS, error)
    read = client.read(name)[0]
    assert read == (value if not error else before % (1 << 8 * FIELDS[name].size))


def test_the_eeprom_is_locked_while_the_torque_is_on(on: tuple[Bench, Client]) -> None:
    _, client = on
    assert client.write("torque_enable", 1) == (sdk.COMM_SUCCESS, 0)
    assert client.write("operating_mode", 1) == (sdk.COMM_SUCCESS, 7)
    client.write("torque_enable", 0)
    assert client.write("operating_mode", 1) == (sdk.COMM_SUCCESS, 0)


def test_group_sync_read_and_write(on: tuple[Bench, Client]) -> None:
    made, client = on
    client.write("operating_mode", 1)
    client.write("torque_enable", 1)
    write = sdk.GroupSyncWrite(client.port, client.handler, FIELDS["goal_velocity"].address, 4)
    write.addParam(1, [40, 0, 0, 0])
    assert write.txPacket() == sdk.COMM_SUCCESS
    assert eventually(lambda: made.servo.table["goal_velocity"] == 40)  # nobody answers a sync write
    made.later(0.5)
    read = sdk.GroupSyncRead(client.port, client.handler, FIELDS["present_velocity"].address, 8)
    read.addParam(1)
    assert patiently(read.txRxPacket, sdk.COMM_SUCCESS)
    assert read.getData(1, FIELDS["present_velocity"].address, 4) == pytest.approx(40, abs=2)
    assert read.getData(1, FIELDS["present_position"].address, 4) > 2048 + 100


def test_registered_writes_wait_for_action(on: tuple[Bench, Client]) -> None:
    made, client = on
    led = FIELDS["led"].address
    assert patiently(lambda: client.handler.regWriteTxRx(client.port, 1, led, 1, [1])[0], sdk.COMM_SUCCESS)
    assert made.servo.table["led"] == 0
    assert client.read("registered_instruction")[0] == 1
    client.handler.action(client.port, 1)
    assert eventually(lambda: made.servo.table["led"] == 1)
    assert made.servo.table["registered_instruction"] == 0


def test_the_status_return_level(on: tuple[Bench, Client]) -> None:
    made, client = on
    client.write("status_return_level", 1)
    assert client.write("led", 1, tries=1)[0] == sdk.COMM_RX_TIMEOUT
    assert made.servo.table["led"] == 1
    assert client.read("led")[:2] == (1, sdk.COMM_SUCCESS)


def test_an_overload_lasts_until_a_reboot(on: tuple[Bench, Client]) -> None:
    made, client = on
    client.write("torque_enable", 1)
    made.servo.fail(0x20)
    value, result, error = client.read("torque_enable")
    assert (value, result, error) == (0, sdk.COMM_SUCCESS, 0x80)
    assert client.write("torque_enable", 1) == (sdk.COMM_SUCCESS, 0x81)
    assert patiently(lambda: client.handler.reboot(client.port, 1)[0], sdk.COMM_SUCCESS)
    assert client.write("torque_enable", 1) == (sdk.COMM_SUCCESS, 0)


def test_the_watchdog_stops_a_moving_axis(on: tuple[Bench, Client]) -> None:
    made, client = on
    client.write("operating_mode", 1)
    client.write("torque_enable", 1)
    client.write("bus_watchdog", 5)
    client.write("goal_velocity", 60)
    _, moving = made.later(0.09)
    assert moving > 0.1
    assert made.stands(0.5)
    assert client.read("bus_watchdog")[0] == 0xFF
    assert client.write("goal_velocity", 60) == (sdk.COMM_SUCCESS, 4)
    assert client.write("bus_watchdog", 0) == (sdk.COMM_SUCCESS, 0)
    assert client.write("goal_velocity", 60) == (sdk.COMM_SUCCESS, 0)


def test_another_baud_rate_is_noise(on: tuple[Bench, Client]) -> None:
    made, client = on
    client.port.closePort()
    other = Client(made.terminal.path, 57600)
    assert other.read("led", tries=1)[1] == sdk.COMM_RX_TIMEOUT
    other.port.closePort()


def test_stuffing_survives_the_way_there_and_back(on: tuple[Bench, Client]) -> None:
    """A goal whose bytes look like a header: FF FF FD."""
    made, client = on
    made.servo.table["operating_mode"] = 4
    goal = -0x20001  # FF FF FD FF on the wire
    assert (goal & 0xFFFFFFFF).to_bytes(4, "little") == bytes.fromhex("fffffdff")
    address, data = FIELDS["goal_position"].address, list(bytes.fromhex("fffffdff"))
    assert patiently(
        lambda: client.handler.writeTxRx(client.port, 1, address, 4, data), (sdk.COMM_SUCCESS, 0)
    )
    assert made.servo.table["goal_position"] == goal
    made.servo.table["goal_position"] = goal
    assert client.read("goal_position")[:2] == (goal & 0xFFFFFFFF, sdk.COMM_SUCCESS)


def test_the_crc_of_the_manual() -> None:
    ping = bytes.fromhex("fffffd0001030001")
    assert encode(Packet(1, 1)) == ping + bytes.fromhex("194e")
    assert crc16(b"") == 0


packets = st.builds(
    Packet,
    st.integers(0, 0xFE),
    st.integers(0, 255),
    st.lists(st.sampled_from([0xFF, 0xFD, 0x00, 0x55]) | st.integers(0, 255), max_size=60).map(bytes),
)


@given(st.lists(packets, max_size=5), st.data())
def test_whatever_is_encoded_is_decoded(sent: list[Packet], data: Any) -> None:
    stream = b"".join(map(encode, sent))
    decoder, got = Decoder(), []
    while stream:
        cut = data.draw(st.integers(1, len(stream)))
        got += list(decoder.feed(stream[:cut]))
        stream = stream[cut:]
    assert got == sent


@given(st.binary(max_size=400), packets)
def test_noise_never_crashes_and_a_packet_after_it_is_found(noise: bytes, packet: Packet) -> None:
    decoder = Decoder()
    list(decoder.feed(noise))
    # whatever the noise promised to go on with, it ends: a packet is at most 1 KiB
    found = [each for _ in range(80) for each in decoder.feed(encode(packet))]
    assert packet in found
    assert all(isinstance(each, Packet | Damaged) for each in found)
    assert len(decoder._buffer) < 2048


@given(packets, st.integers(0, 10**6), st.integers(0, 7))
def test_no_flipped_bit_passes_the_crc(packet: Packet, place: int, bit: int) -> None:
    raw = bytearray(encode(packet))
    raw[place % len(raw)] ^= 1 << bit
    assert packet not in list(Decoder().feed(bytes(raw)))


@pytest.mark.parametrize(("model", "unit"), [(1150, 2.69e-3), (321, 3.36e-3), (1200, 1e-3), (1060, 1e-3)])
def test_every_family_speaks_of_its_own_current(model: int, unit: float) -> None:
    """Of the motor, of the supply (the motor's while the bridge is on), or a load."""
    with Bench(model=model) as on:
        client = Client(on.terminal.path)
        on.servo.axis._out[3, 0] = current = 0.6
        reading = on.servo.axis.read()
        said = {1150: current, 321: current, 1200: current * reading.duty, 1060: reading.duty}[model]
        on.servo.pass_time = lambda now: None  # the current stays what it is
        raw, result, _ = client.read("present_current")
        client.port.closePort()
        assert result == sdk.COMM_SUCCESS
        assert raw * unit == pytest.approx(said, abs=4 * unit + 0.01)


def test_a_servo_without_a_current_sensor_has_no_current_to_set() -> None:
    with Bench(model=1060) as on:
        client = Client(on.terminal.path)
        assert client.write("current_limit", 100) == (sdk.COMM_SUCCESS, 7)
        assert client.write("operating_mode", 5) == (sdk.COMM_SUCCESS, 4)
        client.port.closePort()


def test_a_host_on_the_skipping_clock_does_not_take_a_servo_without_a_core_for_silent() -> None:
    """Its thread is held for far longer than all tries of a transaction; the host's clock does not go on."""
    with Bench() as made:
        bus = made.bus()
        assert bus.ping() == 1150
        made.terminal.lock.acquire()
        begun = made.clock.now()
        threading.Timer(1.0, made.terminal.lock.release).start()
        assert bus.ping() == 1150
        assert bus.retries == 0
        assert made.clock.now() - begun < 0.03
        bus.close()
