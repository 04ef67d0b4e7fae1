"""The recordings of real machines that `studies.measured` runs, and what their sources published.

They are not shipped. Nothing of the tool is tuned to any of them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from idtool.verbs.identification import Identification


@dataclass(frozen=True)
class Recording:
    """One recording and what is known of it.

    Attributes:
        name: for `--only`, and the key of the cache.
        title, source: for the page.
        file: in the folder, or a pattern of several that are one session.
        options: of the import.
        gravity: whether the axis is an arm under gravity.
        friction: of `identify`.
        published: rows (what, published, the path for `read`).
        others: recordings of the same machine to predict: name of a recording, and what was published.
        beyond: why a sliding axis alone cannot be identified here: it must be refused, or stay sane.
        remark: what to know.
    """

    name: str
    title: str
    source: str
    file: str
    options: dict[str, Any] = field(default_factory=dict)
    gravity: bool = False
    friction: str = "lugre"
    published: tuple[tuple[str, str, str], ...] = ()
    others: tuple[str, ...] = ()
    beyond: str = ""
    remark: str = ""


def read(result: Identification, path: str) -> str:
    """A number of a result by its path (`static.coulomb`, `effects.backlash.gap`), for a person."""
    group, *names = path.split(".")
    if group == "effects":
        entry = result.parameters.effect(names[0])
        parameter = None if entry is None else entry.parameters[names[1]]
    else:
        parameter = getattr(result.parameters, group).get(names[0])
    if parameter is None:
        return "not found"
    if not parameter.identified:
        return f"{parameter.value:.4g}, not determined"
    return f"{parameter.value:.5g}" + (f" ± {parameter.stderr:.2g}" if parameter.stderr else "")


EMPS = "A. Janot, M. Gautier, M. Brunot, Data Set and Reference Models of EMPS, 2019 (nonlinearbenchmark.org)"
BAM = "github.com/Rhoban/bam"
CICESE = "github.com/jorgevchin/Friction-Identification"
DAMIAO = "github.com/YIZHIXIAOCANGSHU/Friction-Identification-for-Manipulators_usb2fdcan"
DFKI = "github.com/dfki-ric-underactuated-lab/torque_limited_simple_pendulum"
DVRK = "github.com/WPI-AIM/dvrk_dynamics_identification"
HSM = "github.com/malik-robert/HSM150-data"
LAAS = "github.com/heitor-andrade/laas_anti_cogging"
LUGRE = "github.com/TeacherRock/LuGre_Friction"
STS = "github.com/roboninecom/Measuring-Backlash-in-Popular-UART-Servos"
UR = "github.com/shamilmamedov/dynamic_calibration"
BRFD = "github.com/ARTS-Laboratory/Dataset-Friction-Damper-with-Backlash"

_SERVO_RAMP = "servo_motor_lugre/breakaway_torque_ramp.csv.gz"
_BY_RUN: dict[str, Any] = {"trial_by": "run"}
_JOINT_1: dict[str, Any] = {"trial_by": "run", "where": {"joint": ["1"]}}


def _psm(joint: int, payload: str = "", others: tuple[str, ...] = ()) -> Recording:
    """A joint of the PSM, without a payload or with one; the third slides."""
    slides = joint == 3
    length, effort = ("m", "n") if slides else ("rad", "nm")
    mapping = {
        "time_s": "time_nominal_s",
        f"position_{length}": f"position_j{joint}_{length}",
        f"velocity_{length}_s": f"velocity_j{joint}_{length}_s",
        "force_n" if slides else "torque_nm": f"effort_j{joint}_{effort}",
    }
    what = f", {payload}" if payload else " (insertion, linear)" if slides else ""
    return Recording(
        f"psm_{joint}{'_loaded' if payload else ''}",
        f"da Vinci PSM, joint {joint}{what}",
        DVRK,
        f"dvrk_psm_payload/psm_payload_{'105g_parallel' if payload else 'none'}.csv.gz",
        {"mapping": mapping},
        gravity=not slides,
        others=others,
        beyond="" if slides else "three coupled joints move together",
    )


def _cicese(joint: int) -> dict[str, Any]:
    mapping = {"position_rad": f"position{joint}_rad", "torque_nm": f"torque{joint}_cmd_nm"}
    return {"mapping": mapping, "trial_by": "run"}


def _dfki(
    name: str,
    what: str,
    file: str = "",
    gravity: str = "3.31 (another file of the source: 2.14)",
    others: tuple[str, ...] = (),
    beyond: str = "",
    remark: str = "",
) -> Recording:
    return Recording(
        f"dfki_{name}",
        f"DFKI pendulum (AK80-6), {what}",
        DFKI,
        f"dfki_pendulum_ak80/{file or name}.csv.gz",
        gravity=True,
        published=(("gravity, sin q, N m", gravity, "gravity.sin"),),
        others=others,
        beyond=beyond,
        remark=remark,
    )


def _damiao(number: int, kind: str, published: tuple[str, str, str]) -> Recording:
    coulomb, viscous, inertia = published
    return Recording(
        f"damiao_{number}",
        f"Damiao {kind.upper()}",
        DAMIAO,
        f"damiao_motors/motor0{number}_{kind}.csv.gz",
        {"trial_by": "run", "unwrap": 25.0},
        published=(
            ("Coulomb, N m", coulomb, "static.coulomb"),
            ("viscous, N m s/rad", viscous, "static.viscous"),
            ("inertia, kg m2", inertia, "effects.inertia.inertia"),
        ),
        remark="48 Hz at up to 8 rad/s: few rows per motion, and staircases of torque at rest.",
    )


def _hsm(name: str, others: tuple[str, ...] = ()) -> Recording:
    return Recording(
        f"hsm_{name}",
        f"HSM150 servo, torque step {name}",
        HSM,
        f"hsm150_servo/torque_step_{name}.csv.gz",
        _BY_RUN,
        published=(
            ("inertia, kg m2", "1.2e-4 (catalogue)", "effects.inertia.inertia"),
            ("viscous, N m s/rad", "7.03e-5 (catalogue)", "static.viscous"),
        ),
        others=others,
        remark="One speed of one sign, a very noisy torque.",
    )


def _sts(servo: int) -> Recording:
    return Recording(
        f"sts3215_{servo}",
        f"Feetech STS3215, servo {servo}",
        STS,
        "sts3215_backlash/motor_telemetry_single.csv",
        {"torque_constant": 1.0, "where": {"servo_id": [str(servo)]}},
        beyond="the current has no sign, and others pull at the servo through springs",
        remark="A torque constant of 1: what is in N m is in A.",
    )


def _xl330(name: str, title: str, pattern: str) -> Recording:
    return Recording(
        name,
        f"DYNAMIXEL XL330, {title}",
        BAM,
        f"xl330/{pattern}.json.gz",
        gravity=True,
        remark="Duty and supply voltage, no current: what would be in N m is in V of the motor. Rows with "
        "the drive off or the duty at its limit are not compared.",
    )


def _ur(joint: int) -> Recording:
    return Recording(
        f"ur_{joint}",
        f"UR10e, joint {joint}",
        UR,
        f"ur10e/joint_{joint}.csv.gz",
        {"torque_constant": 1.0},
        gravity=joint > 1,
        remark="The torque is in amperes of the motor: its constant is not known." if joint == 1 else "",
    )


RECORDINGS = (
    Recording(
        "emps_textbook",
        "EMPS, textbook model",
        EMPS,
        "emps/emps_identification.csv.gz",
        friction="coulomb",
        published=(
            ("M, kg", "95.109", "effects.inertia.inertia"),
            ("viscous, N s/m", "203.50", "static.viscous"),
            ("Coulomb, N", "20.394", "static.coulomb"),
            ("offset, N", "-3.165", "effects.torque_offset.offset"),
        ),
        others=("emps_pulses",),
    ),
    Recording(
        "emps",
        "EMPS",
        EMPS,
        "emps/emps_identification.csv.gz",
        others=("emps_pulses",),
        remark="The authors traced the asymmetry to fatigue of the screw.",
    ),
    Recording(
        "emps_pulses",
        "EMPS, with pulses of force",
        EMPS,
        "emps/emps_validation_pulses.csv.gz",
        others=("emps",),
    ),
    Recording(
        "brfd",
        "Banded rotary friction damper",
        BRFD,
        "brfd_friction_damper/d2_1hz_30lb_1in.csv.gz",
        published=(("play, m", "3e-3 to 4e-3", "effects.backlash.gap"),),
    ),
    Recording(
        "cicese_1",
        "CICESE DD2DOF, joint 1 (direct drive, vertical, constant speeds)",
        CICESE,
        "cicese_dd2dof/test2_constant_speed_both_joints.csv.gz",
        _cicese(1),
        gravity=True,
        published=(
            ("gravity, sin q, N m", "38.5 (and 1.8 sin 2q)", "gravity.sin"),
            ("Coulomb, N m", "12.4 forwards, 10.9 backwards", "static.coulomb"),
            ("viscous, N m s/rad", "3.4, 2.8", "static.viscous"),
        ),
        others=("cicese_break",),
        remark="Joint 2 moves along, at the same angle: its weight pulls with sin 2q.",
    ),
    Recording(
        "cicese_2",
        "CICESE DD2DOF, joint 2",
        CICESE,
        "cicese_dd2dof/test2_constant_speed_both_joints.csv.gz",
        _cicese(2),
        gravity=True,
        published=(
            ("gravity, N m", "1.8 sin 2q", "gravity.sin"),
            ("Coulomb, N m", "1.92 forwards, 1.72 backwards", "static.coulomb"),
            ("viscous, N m s/rad", "0.17, 0.08", "static.viscous"),
        ),
        remark="Joint 1 moves along at the same angle, so its weight pulls with sin 2q.",
    ),
    Recording(
        "cicese_break",
        "CICESE DD2DOF, joint 1, ramps of torque until it breaks away",
        CICESE,
        "cicese_dd2dof/test1_breakaway_torque_ramps.csv.gz",
        _JOINT_1,
        published=(("static, N m", "10.75 forwards, 12.0 backwards", "static.static"),),
    ),
    Recording(
        "cicese_presliding",
        "CICESE DD2DOF, joint 1, presliding",
        CICESE,
        "cicese_dd2dof/test3_presliding_sigma0_sigma1.csv.gz",
        _JOINT_1,
        published=(
            (
                "bristle stiffness, N m/rad",
                "21,419 (half the slope of the loop; the slope is 40,700 to 42,400)",
                "dynamic.bristle_stiffness",
            ),
        ),
        beyond="microradians: it never slides, so that levels are bounded, not measured",
    ),
    _damiao(1, "dm8009", ("0.310", "0.0867", "0.0227")),
    _damiao(3, "dm4340", ("0.452", "0.1088", "0.0566")),
    _damiao(5, "dm4310", ("0.101", "0.00586", "0.00107")),
    _dfki("ddp", "ddp", others=("dfki_collocation", "dfki_pd")),
    _dfki(
        "collocation",
        "direct collocation",
        "direct_collocation",
        others=("dfki_ddp",),
        remark="3.5 s: one swing-up.",
    ),
    _dfki(
        "pd",
        "PD",
        "pd_system_identification",
        beyond="the torque chatters up to 17 N m, where the axis needs 3",
    ),
    _dfki(
        "hand",
        "moved by hand",
        "gravity_compensation_hand_moved",
        "3.31, as the controller commands",
        beyond="a hand moves the arm, which nobody measured; the torque is the controller's command",
    ),
    Recording(
        "mtm",
        "da Vinci MTM, joint 4 (a cable inside)",
        DVRK,
        "dvrk_mtm_cable_joint4/mtm_joint4_slow_sweep.csv.gz",
        {"mapping": {"time_s": "time_nominal_s"}},
        remark="A cable pulls like a nonlinear spring.",
    ),
    _psm(1, others=("psm_1_loaded",)),
    _psm(1, "105 g"),
    _psm(2, others=("psm_2_loaded",)),
    _psm(2, "105 g"),
    _psm(3, others=("psm_3_loaded",)),
    _psm(3, "105 g", others=("psm_3",)),
    _hsm("pos_0.06", ("hsm_pos_0.065", "hsm_neg_0.04", "hsm_neg_0.045")),
    _hsm("pos_0.065"),
    _hsm("neg_0.04", ("hsm_neg_0.045",)),
    _hsm("neg_0.045"),
    Recording(
        "laas_speed",
        "LAAS cogging, one speed",
        LAAS,
        "laas_bldc_cogging/speed_test.csv.gz",
        {"torque_constant": 0.03},
    ),
    Recording(
        "laas_map",
        "LAAS cogging, held at rest at every 2 mrad",
        LAAS,
        "laas_bldc_cogging/stopped_mapping.csv.gz",
        {"torque_constant": 0.03},
        beyond="every row was read at rest, with the speed at zero",
    ),
    Recording(
        "servo_triangle",
        "Servo motor, torque triangle",
        LUGRE,
        "servo_motor_lugre/inertia_viscous_torque_triangle.csv.gz",
        _BY_RUN,
        published=(
            ("Coulomb, N m", "0.0149, which its own logs contradict (about 0.030)", "static.coulomb"),
            ("inertia, kg m2", "1.76e-4", "effects.inertia.inertia"),
        ),
        others=("servo_ramp",),
        remark="Torque is commanded, and the published numbers are of another recording: a negative control.",
    ),
    Recording("servo_ramp", "Servo motor, torque ramp", LUGRE, _SERVO_RAMP, _BY_RUN),
    Recording(
        "servo_presliding",
        "Servo motor, presliding",
        LUGRE,
        "servo_motor_lugre/presliding_torque_triangle.csv.gz",
        _BY_RUN,
        beyond="it never slides, so that levels are bounded, not measured",
    ),
    _sts(3),
    _sts(4),
    _sts(5),
    _ur(1),
    _ur(2),
    _ur(3),
    _xl330("xl330", "three gains, three trajectories", "kp*"),
    _xl330("xl330_800", "gain 800, three trajectories", "kp800_*"),
)
