"""prototype"""
from __future__ import annotations
import math
from typing import Any
import numba
import numpy as np
from idtool.control.load import carry, BRISTLE as Z
from idtool.model.motion import Array

STARTING, RESTING, TARING, GUIDING, STOPPING = range(5)

_C = "bias_rate bias_cap stop_counts zero_drift period torque_constant gain noise floor start count filter virtual follow velocity_gain cap rest_rate gone brake_s coast kick servo_time trim trim_range leash rest_speed low high speed settle tare_turn tare_top tare_cycle resolution bristle_stiffness friction_bound transient transient_decay inertia refuse stand coverage still".split()
CONSTANTS = np.dtype([(n,'f8') for n in _C] + [("prior",'f8',(4,))])
_S = "bias zero_var bound unexplained started time position seen nominal w x lead hand raw zero anchor since moved_at pushed way dead trans k mean mean_sq kept_ tau_before felt_at_rest elastic damping".split()
STATE = np.dtype([('mode','i8'),('refused','i8'),('note','i8')]+[(n,'f8') for n in _S]+[("learned",'f8',(4,)),("cov",'f8',(4,4)),("sum",'f8',(4,5)),("gram",'f8',(4,4)),("moment",'f8',(4,)),("parts",'f8',(8,))])

@numba.njit(cache=True)
def begin(c, s, position):
    s.mode = STARTING
    s.started = 0.0
    s.w = s.nominal = s.seen = s.hand = s.raw = s.zero = 0.0
    s.x = s.anchor = min(max(position, c.low), c.high)
    s.since = 0.0; s.k = 0.0; s.mean = 0.0; s.pushed = 0.0; s.trans = 0.0

@numba.njit(cache=True)
def reset(c, s):
    for j in range(4):
        s.learned[j] = 0.0
        for k in range(4):
            s.cov[j, k] = c.prior[j] ** 2 if j == k else 0.0
    s.cov[3,3] = 0.0
    s.lead = c.servo_time
    begin(c, s, 0.0)

@numba.njit(cache=True)
def spread(s, elastic, damping):
    p = s.cov
    v = p[0,0] + elastic*(elastic*p[1,1] + 2*p[0,1]) + damping*(damping*p[2,2]+2*p[0,2]+2*elastic*p[1,2])
    return math.sqrt(max(v, 0.0))

@numba.njit(cache=True)
def observe(n, m, c, s, time, position, velocity, current, payload, alpha, beta, temperature):
    if s.started == 0.0:
        s.started = 1.0
        s.time = time - c.period
        s.position = position
    step = time - s.time
    if not step > 0.0: step = c.period
    before, nominal = s.seen, s.nominal
    s.nominal += c.follow * (s.w - nominal)
    predicted = before + s.nominal - nominal
    s.seen = predicted + c.velocity_gain * (velocity - predicted)
    travel = position - s.position
    gravity, elastic, damping, extra, level, saturation, delay, z, kept = carry(n, m, time, step, position, s.seen, (s.seen-before)/step, payload, alpha, beta, temperature, travel)
    motor = c.torque_constant * current
    motor *= 1.0 - saturation*abs(motor)
    s.zero *= kept
    s.kept_ = kept
    s.elastic, s.damping = elastic, damping
    plain = gravity + elastic + damping + extra - motor
    s.mean_sq = plain
    s.raw = plain + s.learned[0] + s.learned[1]*elastic + s.learned[2]*damping + s.zero + (s.bias if s.mode == GUIDING else 0.0)
    s.dead = c.floor + c.coverage*spread(s, elastic, damping)
    s.time, s.position = time, position
    fell = s.hand - s.raw if s.hand > 0 else s.raw - s.hand
    size = abs(s.hand)
    gone = fell > c.gone*size and fell > 4.5*c.noise
    s.hand += (1.0 if gone else c.filter)*(s.raw - s.hand)
    s.trans *= c.transient_decay
    return motor

@numba.njit(cache=True)
def certain(s, dead):
    left = abs(s.hand) - dead
    return math.copysign(left, s.hand) if left > 0 else 0.0

@numba.njit(cache=True)
def follow(c, s):
    s.x += s.w*c.period
    behind = s.x - s.position
    leash = c.leash*abs(s.w) + 4*c.resolution
    if abs(behind) > leash:
        s.x = s.position + math.copysign(leash, behind)
    if abs(s.w) > 2*c.rest_speed:
        late = min(max(behind/(s.w*s.lead), -1.0), 1.0)
        s.lead = min(max(s.lead*(1+c.trim*c.period*late), c.servo_time/c.trim_range), c.servo_time*c.trim_range)
    return s.x + s.lead*s.w

@numba.njit(cache=True)
def guide(c, s, velocity):
    s.bias = min(max(s.bias - c.bias_rate*s.raw, -c.bias_cap), c.bias_cap)
    f = certain(s, s.dead)
    felt = math.copysign(max(abs(s.raw) - s.dead, 0.0), s.raw)
    goal = min(max(c.gain*felt, -c.speed), c.speed)
    if f*s.w <= 0.0 and s.way*f <= 0.0:
        s.mode = STOPPING
        s.since = 0.0
        s.tau_before = s.w
        s.trans = max(s.trans, c.transient*abs(s.w))
        s.w = 0.0
        s.x = s.position
        return brake(c, s, velocity)
    s.w += c.virtual*(goal - s.w)
    place = follow(c, s)
    if (s.x > c.high and s.w > 0) or (s.x < c.low and s.w < 0):
        s.x = min(max(s.x, c.low), c.high)
        s.w = 0.0
        return s.x
    return place

@numba.njit(cache=True)
def brake(c, s, velocity):
    moved = abs(s.position - s.anchor) > 1.01*c.resolution
    if moved:
        s.anchor = s.position
        s.moved_at = s.since
    s.since += c.period
    if s.since - s.moved_at >= c.still and s.since >= c.brake_s:
        s.mode = RESTING
        s.anchor = min(max(s.position, c.low), c.high)
        s.since = 0.0
        s.pushed = 0.0
        s.x = s.anchor
        s.bound = math.sqrt((c.stop_counts*c.count)**2 + (2.0*s.unexplained)**2 + c.cap**2)
        s.zero_var = s.bound**2
        s.hand = 0.0
        return s.anchor
    if s.since <= 2.01*c.period:
        return s.position - c.kick*s.lead*velocity
    return s.position + c.coast*velocity

@numba.njit(cache=True)
def rest(c, s):
    s.since += c.period
    # the zero follows, within what a stop can leave
    share = s.zero_var/(s.zero_var + c.noise**2)
    s.zero_var -= share*s.zero_var
    if s.zero_var < c.noise**2/12.0:
        s.zero_var = 0.0
        share = c.zero_drift
    before = s.zero
    s.zero = min(max(s.zero - share*s.raw, -s.bound), s.bound)
    s.hand += s.zero - before
    threshold = max(s.dead, s.bound) + c.start + 2.0*math.sqrt(s.zero_var)
    s.pushed = s.pushed + 1 if abs(s.hand) > threshold else 0.0
    if s.pushed >= 2:
        s.mode = GUIDING
        s.x = s.anchor
        s.w = 0.0
        s.way = math.copysign(1.0, s.hand)
    return s.anchor

@numba.njit(cache=True)
def start(n, m, c, s):
    s.k += 1
    s.mean += (s.raw - s.mean)/s.k
    s.hand = 0.0
    if s.k*c.period >= c.settle:
        bent = m[Z]*c.bristle_stiffness - s.mean
        m[Z] = min(max(bent, -c.friction_bound), c.friction_bound)/c.bristle_stiffness
        s.mode = RESTING
        s.since = 0.0
    return s.anchor

@numba.njit(cache=True)
def tare(c, s):
    if s.mode != RESTING: return False
    s.mode = TARING
    s.k = 0.0
    s.w = 0.0
    s.x = s.anchor
    s.way = 1.0 if s.anchor <= 0.5*(c.low+c.high) else -1.0
    s.bound = c.cap
    s.zero_var = 0.0
    s.tau_before = 0.0
    s.mean = 1.0  # what is left of the bristle's unknown start
    s.sum[:,:] = 0.0
    s.bias = 0.0
    for j in range(4):
        s.sum[j,j] = 1.0/c.prior[j]**2
    s.learned[:] = 0.0
    s.zero = 0.0
    s.anchor = s.position
    return True

@numba.njit(cache=True)
def sweep(m, c, s):
    late = 0.5*s.damping
    weight = 1.0/((3*c.noise)**2 + late*late)
    s.mean *= s.kept_
    row = (1.0, s.elastic, s.damping, s.mean)
    if s.k == 0:
        s.gram[:,:] = 0.0; s.moment[:] = 0.0
    s.tau_before += s.mean_sq**2
    for j in range(4):
        s.moment[j] -= row[j]*s.mean_sq
        for k in range(4):
            s.gram[j,k] += row[j]*row[k]
    for j in range(4):
        for k in range(4):
            s.sum[j,k] += weight*row[j]*row[k]
        s.sum[j,4] -= weight*row[j]*s.mean_sq
    s.k += 1
    if s.k >= 2*c.tare_cycle:
        solve(s)
        total = 0.0
        for j in range(4):
            for k in range(4):
                total += s.learned[j]*(s.gram[j,k]*s.learned[k])
            total -= 2.0*s.learned[j]*s.moment[j]
        rms = (total + s.tau_before)/s.k
        s.unexplained = math.sqrt(max(rms - c.noise**2, 0.0))
        m[Z] += s.learned[3]*s.mean/c.bristle_stiffness
        s.learned[3] = 0.0
        if abs(s.learned[0]) > c.refuse:
            s.refused = 1
            reset(c, s)
        s.mode = RESTING
        s.since = 0.0
        s.w = 0.0
        s.hand = 0.0
        return s.anchor
    place = follow(c, s)
    s.w = s.way*c.tare_top*math.sin(c.tare_turn*s.k)
    return place

@numba.njit(cache=True)
def solve(s):
    a = s.sum[:, :4].copy()
    inv = np.linalg.inv(a)
    for j in range(4):
        s.learned[j] = 0.0
        for k in range(4):
            s.cov[j,k] = inv[j,k]
            s.learned[j] += inv[j,k]*s.sum[k,4]

@numba.njit(cache=True)
def advance(n, m, c, s, time, position, velocity, current, payload, alpha, beta, temperature):
    if s.started == 0.0:
        begin(c, s, position)
    observe(n, m, c, s, time, position, velocity, current, payload, alpha, beta, temperature)
    if s.mode == STARTING: return start(n, m, c, s)
    if s.mode == GUIDING: return guide(c, s, velocity)
    if s.mode == STOPPING: return brake(c, s, velocity)
    if s.mode == TARING: return sweep(m, c, s)
    return rest(c, s)
