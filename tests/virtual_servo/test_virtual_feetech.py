"""The virtual STS servo against the vendor's SDK, and its packets against the published rules."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import pytest
import scservo_sdk as sdk
from hypothesis import given
from hypothesis import strategies as st

from idtool.virtual_servo.feetech.packet import Decoder, Packet, checksum, encode
from idtool.virtual_servo.feetech.table import FIELDS
from tests.rig.dynamixel.support import BAUD, Bench, eventually

MEASURED = ("present_position", "present_speed", "present_load", "present_current", "moving")


@pytest.fixture
def on() -> Iterator[tuple[Bench, Any]]:
    with Bench(kind="feetech") as made:
        port = sdk.PortHandler(made.terminal.path)
        assert port.setBaudRate(BAUD)
        yield made, sdk.sms_sts(port)
        port.closePort()


def patiently(act: Any, tries: int = 8) -> Any:
    """The first answer: a busy computer may be late with one."""
    for _ in range(tries):
        *values, result, error = act()
        if result == sdk.COMM_SUCCESS:
            return (*values, error)
        time.sleep(0.05)  # an answer that comes after all must not be taken for that of the next instruction
    raise AssertionError("no answer")


def test_ping(on: tuple[Bench, Any]) -> None:
    _, client = on
    assert patiently(lambda: client.ping(1)) == (777, 0)
    assert client.ping(2)[1] == sdk.COMM_RX_TIMEOUT


def test_every_entry_is_read_as_it_stands(on: tuple[Bench, Any]) -> None:
    made, client = on
    for name, field in FIELDS.items():
        read = {1: client.read1ByteTxRx, 2: client.read2ByteTxRx}[field.size]
        value, error = patiently(lambda read=read, field=field: read(1, field.address))
        assert error == 0
        if name not in MEASURED:
            signed = client.scs_tohost(value, field.sign) if field.sign else value
            assert signed == made.servo.table[name], name


def test_the_sdks_own_functions_move_it(on: tuple[Bench, Any]) -> None:
    made, client = on
    patiently(lambda: client.write1ByteTxRx(1, FIELDS["torque_enable"].address, 1))
    patiently(lambda: client.WritePosEx(1, 1500, 600, 50))
    table = made.servo.table
    assert [table[name] for name in ("goal_position", "goal_speed", "acceleration")] == [1500, 600, 50]
    made.later(0.3)
    position, speed, error = patiently(lambda: client.ReadPosSpeed(1))
    assert error == 0
    assert 1500 < position < 2048
    assert speed == pytest.approx(-600, abs=60)
    assert speed % 50 == 0
    made.later(2.0)
    assert patiently(lambda: client.ReadPos(1))[0] == pytest.approx(1500, abs=2)
    assert patiently(lambda: client.ReadMoving(1))[0] == 0
    patiently(lambda: client.WheelMode(1))
    patiently(lambda: client.WriteSpec(1, -400, 0))
    made.later(0.5)
    assert patiently(lambda: client.ReadSpeed(1))[0] == pytest.approx(-400, abs=50)


def test_the_load_is_the_duty(on: tuple[Bench, Any]) -> None:
    """0.5 kg on the axis, standing: R i over the supply, with its sign above the magnitude."""
    made, client = on
    patiently(lambda: client.write1ByteTxRx(1, FIELDS["torque_enable"].address, 1))
    made.later(0.2)
    with made.terminal.lock:
        from idtool.rig.base import TrialSetup

        made.servo.axis.load(TrialSetup(payload_kg=0.5))
    made.later(1.0)
    value, _ = patiently(lambda: client.read2ByteTxRx(1, FIELDS["present_load"].address))
    motor, file = made.servo.axis.file.motor, made.servo.axis.file
    torque = file.gravity["base_nm"] + 0.5 * file.gravity["per_payload_nm_per_kg"]
    duty = torque / file.axis.torque_constant * motor.resistance / motor.supply
    # the bristles may carry a part of it
    friction = file.friction["static_nm"] / file.axis.torque_constant * motor.resistance / motor.supply
    assert client.scs_tohost(value, 10) / 1000 == pytest.approx(duty, abs=friction)


def test_sync_write_and_read(on: tuple[Bench, Any]) -> None:
    made, client = on
    group = sdk.GroupSyncWrite(client, FIELDS["goal_speed"].address, 2)
    group.addParam(1, [0x2C, 0x01])
    group.addParam(2, [1, 0])
    group.txPacket()
    reader = sdk.GroupSyncRead(client, FIELDS["present_position"].address, 8)
    reader.addParam(1)
    for _ in range(8):
        if reader.txRxPacket() == sdk.COMM_SUCCESS:
            break
    assert made.servo.table["goal_speed"] == 300
    assert reader.isAvailable(1, FIELDS["present_voltage"].address, 1)
    assert reader.getData(1, FIELDS["present_voltage"].address, 1) == 240


def test_a_registered_write_waits_for_its_action(on: tuple[Bench, Any]) -> None:
    made, client = on
    patiently(lambda: client.RegWritePosEx(1, 1000, 100, 1))
    assert made.servo.table["goal_position"] == 0
    client.RegAction()
    assert eventually(lambda: made.servo.table["goal_position"] == 1000)


def test_only_what_is_unlocked_outlives_the_power(on: tuple[Bench, Any]) -> None:
    made, client = on
    address = FIELDS["p_gain"].address
    patiently(lambda: client.write1ByteTxRx(1, address, 20))
    made.servo.lose_power()
    assert made.servo.table["p_gain"] == 32
    patiently(lambda: client.unLockEprom(1))
    patiently(lambda: client.write1ByteTxRx(1, address, 20))
    made.servo.lose_power()
    assert made.servo.table["p_gain"] == 20


def test_values_are_cut_and_read_only_ones_left(on: tuple[Bench, Any]) -> None:
    made, client = on
    patiently(lambda: client.write2ByteTxRx(1, FIELDS["torque_limit"].address, 3000))
    assert made.servo.table["torque_limit"] == 1000
    patiently(lambda: client.write1ByteTxRx(1, FIELDS["present_voltage"].address, 1))
    assert patiently(lambda: client.read1ByteTxRx(1, FIELDS["present_voltage"].address))[0] == 240


def test_the_checksum_of_the_protocol_manual() -> None:
    assert encode(Packet(1, 0x01)) == bytes.fromhex("ffff010201fb")  # ping of servo 1
    assert checksum(bytes.fromhex("0104023802")) == 0xBE  # its position


@given(
    st.lists(st.tuples(st.integers(0, 0xFD), st.integers(0, 255), st.binary(max_size=60))),
    st.binary(max_size=20),
    st.integers(1, 7),
)
def test_packets_survive_the_wire_whole_and_in_order(
    packets: list[tuple[int, int, bytes]], noise: bytes, piece: int
) -> None:
    """Whatever stands before them, except what begins like a packet itself, and however they are cut."""
    sent = [Packet(*packet) for packet in packets]
    stream = noise.replace(b"\xff", b"\x00") + b"".join(map(encode, sent))
    decoder, found = Decoder(), []
    for begin in range(0, len(stream), piece):
        found += decoder.feed(stream[begin : begin + piece])
    assert found == sent


@given(st.integers(0, 252), st.binary(max_size=20), st.integers(0, 400))
def test_a_flipped_bit_never_passes(whose: int, data: bytes, place: int) -> None:
    good = encode(Packet(whose, 3, data))
    index = 2 + place % (len(good) - 2)
    bad = good[:index] + bytes([good[index] ^ (1 << place % 8)]) + good[index + 1 :]
    assert Packet(whose, 3, data) not in list(Decoder().feed(bad))
