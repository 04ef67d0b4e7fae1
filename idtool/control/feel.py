"""The numbers of the light law (`light`): times, shares and bounds, each with what it is for.

They belong to servos of the DYNAMIXEL kind, to periods around 10 ms and to a hand, and not to one axis: what
an axis brings is in `LightSettings`. Found on axes drawn at random (`studies.teach`, docs/teach.md).
"""

from __future__ import annotations

#: Share of the level that a bristle at rest may hold without our knowing, as a standard deviation.
BRISTLE_PRIOR = 0.6
#: Filters of the hand's torque: while it moves, and at rest, s.
FAST_S, SLOW_S = 0.01, 0.05
#: Time constant of the virtual mass, s.
VIRTUAL_S = 0.12
#: Share of the velocity's innovation that the estimate takes: what an axis was told to do is smooth and
#: not late, what it is measured to do is neither.
VELOCITY_GAIN = 0.15
#: How fast a servo's velocity follows, s.
FOLLOWS_S = 0.025
#: While an axis starts, friction that is not as modelled can look like a hand that lets go, s.
START_S = 0.1
#: One that pushes again so soon after never left; the next sign of it is then believed only after so long, s.
SOON_S, SLOW_START_S = 0.5, 1.0
#: A torque that falls by this share within three periods is a hand that let go.
GONE = 0.6
#: It must fall by so many torque noises.
FALL = 4.5
#: An axis brakes so long at least, then stands for so long, and then the zero is taken over so long, s.
BRAKE_S, STAND_S, ZERO_S = 0.03, 0.1, 0.12
#: So long the anchor follows an axis that was let go, by this share of what it still creeps per sample, s.
FOLLOW_S, FOLLOW_SHARE = 0.05, 0.2
#: The first moment of braking asks for the opposite speed, by this share of the servo's lag.
KICK_S, KICK_SHARE = 0.015, 0.7
#: Share of the reference that is turned round for one period more: what the friction that goes with speed
#: held back meanwhile.
RELIEF_AGAIN = 0.2
#: A braked axis comes to rest where it would be after so long at the speed that is read, s.
COAST_S = 0.008
#: Velocity loop of a drive, s: its integrator takes up torque at inertia / (2 * this)^2 per rad.
DRIVE_S = 0.008
#: An axis that does not come to rest within so long is still pushed, s.
EASED_S = 0.12
#: A push younger than this still bends the bristle; it may fade for so long without ending, s.
EARLY_S, FADE_S = 1.0, 0.2
#: After an eased stop a change of so many torque noises is a hand that leaves; if nothing changed for so
#: long, s, what is felt of late, s, is taken for the zero, with all of it in doubt.
JUMP, CALM_S, LATE_S = 4.5, 1.0, 0.1
#: How well a bristle is known after a stop, and after one of a push that had just begun: to so many encoder
#: counts, at worst this share of the level.
STOP_COUNTS, STALL_COUNTS, STOP_BOUND = 0.7, 0.3, 0.3
#: A torque this far from its mean, in torque noises, changes; a zero that waits for calm longer than this is
#: taken as it comes (sensors noisier than thought), s.
STEADY, LISTEN_S = 5.0, 2.0
#: At rest, a torque beyond the doubt by so many torque noises is a hand and never taken for the zero.
GATE = 4.0
#: So long after a stop a torque against the push may be a hand that leaves, s.
LEAVE_S = 3.0
#: So many samples above the starting torque start a motion.
START_SAMPLES = 2
#: How fast the zero follows at rest, in starting torques per second, and up to which share of it.
TRACK_RATE, TRACK_SHARE = 0.15, 0.6
#: What the model drifts by from one rest to the next: load, in torque noises; friction, relatively.
DRIFT_LOAD, DRIFT_FRICTION = 0.3, 0.01
#: How fast the servo's time constant is trimmed, 1/s, and by how much at most.
TRIM_RATE, TRIM_RANGE = 3.0, 4.0
#: The law's own motion is never farther from the measured one than it moves in this time, s.
LEASH_S = 0.15
#: The errors of a tare are alike from sample to sample, so each sample counts less: noise in torque noises,
#: and what comes late as a share of the damping.
TARE_NOISE, TARE_LATE = 3.0, 0.5
#: What a tare may leave, in torque noises, whatever it is.
TARE_LEFT = 4.0
#: A tare leaves so many torque noises where the model holds. Beyond that it met a ripple, say, that the model
#: does not have, and that pushes a slow axis on as a hand does; from so many speeds of rest on, a hand leads.
TARE_NORMAL, SLOW_SPEEDS = 1.8, 4.0
