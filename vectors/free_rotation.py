"""Free rotation of rigid bodies with 90 digits: writes free_rotation.json, which the core's test of rotation reads.

    python vectors/free_rotation.py            writes the file
    python vectors/free_rotation.py --check    compares what it holds with power series of the equations of motion

Needs mpmath (with gmpy2 it is faster), which nothing else here needs. What is used is the textbook form with Jacobi's
functions and Legendre's integral of the third kind (Landau & Lifshitz, Mechanics, section 37), in so many digits that
differences which cancel cost nothing. It shares no formula with the core, which sums theta functions; and the check
shares none with either: Euler's equations and the quaternion's, in powers of time.
"""

import json
import random
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mpmath
from mpmath import mpf

Vector = list[Any]
Matrix = list[Vector]

mpmath.mp.dps = 90


def cross(a: Vector, b: Vector) -> Vector:
    """The vector product."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a: Vector, b: Vector) -> Any:
    """The scalar product."""
    return sum(x * y for x, y in zip(a, b, strict=True))


def times(factor: Any, a: Vector) -> Vector:
    """A vector scaled."""
    return [factor * x for x in a]


def plus(*vectors: Vector) -> Vector:
    """The sum of vectors."""
    return [sum(components) for components in zip(*vectors, strict=True)]


def unit(a: Vector) -> Vector:
    """The direction of a vector."""
    return times(1 / mpmath.sqrt(dot(a, a)), a)


def axes(quaternion: Vector) -> Matrix:
    """The body's axes in the world (columns of the rotation matrix), of a quaternion (w, x, y, z) of any length."""
    w, x, y, z = unit(quaternion)
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
        [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
        [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
    ]


def quaternion_of(columns: Matrix) -> Vector:
    """The unit quaternion (w, x, y, z) of the axes `columns`, of either sign."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = columns
    rows = [
        [1 + xx + yy + zz, yz - zy, zx - xz, xy - yx],
        [yz - zy, 1 + xx - yy - zz, xy + yx, zx + xz],
        [zx - xz, xy + yx, 1 - xx + yy - zz, yz + zy],
        [xy - yx, zx + xz, yz + zy, 1 - xx - yy + zz],
    ]
    largest = max(range(4), key=lambda i: rows[i][i])
    return unit(rows[largest])


def turned(vector: Vector, axis: Vector, angle: Any) -> Vector:
    """A vector turned about a unit axis (Rodrigues)."""
    sine, cosine = mpmath.sin(angle), mpmath.cos(angle)
    along = times(dot(axis, vector) * (1 - cosine), axis)
    return plus(times(cosine, vector), times(sine, cross(axis, vector)), along)


class Top:
    """A freely rotating body: principal moments, orientation, angular velocity (world) at time 0."""

    def __init__(self, moments: list[float], orientation: list[float], angular_velocity: list[float]) -> None:
        self.moments = [mpf(x) for x in moments]
        self.columns = axes([mpf(x) for x in orientation])
        self.omega = [mpf(x) for x in angular_velocity]
        self.rates = [dot(column, self.omega) for column in self.columns]
        self.momentum = [i * w for i, w in zip(self.moments, self.rates, strict=True)]
        self.size = mpmath.sqrt(dot(self.momentum, self.momentum))
        self.twice_energy = dot(self.momentum, self.rates)
        self.order = sorted(range(3), key=lambda i: self.moments[i])
        first, middle, last = (self.moments[i] for i in self.order)
        torque = cross(self.momentum, self.rates)
        if all(x == 0 for x in torque):
            self.kind = "steady"
        elif first == middle or middle == last:
            self.kind = "symmetric"
        else:
            self.kind = "asymmetric"
            self.prepare()

    def prepare(self) -> None:
        """The constants of Jacobi's solution. The pole is the axis about which the momentum circulates in the body."""
        low, middle, high = self.order
        excess = self.size**2 - self.twice_energy * self.moments[middle]
        self.distance = abs(excess) / self.size**2
        pole, other = (high, low) if excess > 0 else (low, high)
        self.roles = (other, middle, pole)
        i1, i2, i3 = (self.moments[i] for i in self.roles)
        m1, m2, m3 = (self.momentum[i] for i in self.roles)
        square, energy = self.size**2, self.twice_energy
        self.amplitudes = [
            mpmath.sqrt((energy * i3 - square) * i1 / (i3 - i1)),
            mpmath.sqrt((energy * i3 - square) * i2 / (i3 - i2)),
            mpmath.sqrt((square - energy * i1) * i3 / (i3 - i1)),
        ]
        self.tau = mpmath.sqrt((i3 - i2) * (square - energy * i1) / (i1 * i2 * i3))
        self.m = (i2 - i1) * (energy * i3 - square) / ((i3 - i2) * (square - energy * i1))
        self.quarter = mpmath.ellipk(self.m)
        self.period = 4 * self.quarter / self.tau
        self.sign3 = 1 if m3 > 0 else -1
        # With u growing in time sn grows where cn is positive; whether L2 does where L1 is, Euler's equations tell.
        sample = [mpf(0)] * 3
        sample[other], sample[pole] = mpf(1), m3
        growth = cross(sample, [m / i for m, i in zip(sample, self.moments, strict=True)])[middle]
        self.sign1, self.sign2 = 1, 1 if growth > 0 else -1
        sine, cosine = self.sign2 * m2 / self.amplitudes[1], m1 / self.amplitudes[0]
        angle = mpmath.atan2(sine, cosine)
        if abs(angle) <= mpmath.pi / 2:
            self.start = mpmath.ellipf(angle, self.m)
        else:
            self.start = mpmath.sign(angle) * 2 * self.quarter - mpmath.ellipf(
                mpmath.sign(angle) * mpmath.pi - angle, self.m
            )
        self.characteristic = -(self.amplitudes[2] ** 2) * self.m / (square - self.amplitudes[2] ** 2)
        self.pole_moment = i3
        self.complete = mpmath.ellippi(self.characteristic, self.m)

    def third_kind(self, u: Any) -> Any:
        """The integral of du / (1 - n sn²) from 0 to u."""
        halves = mpmath.nint(u / (2 * self.quarter))
        rest = u - 2 * halves * self.quarter
        sine = mpmath.ellipfun("sn", rest, m=self.m)
        return 2 * halves * self.complete + mpmath.ellippi(self.characteristic, mpmath.asin(sine), self.m)

    def body_momentum(self, u: Any) -> Vector:
        """The angular momentum in body axes."""
        u = u - 4 * self.quarter * mpmath.nint(u / (4 * self.quarter))
        result = [mpf(0)] * 3
        names = ("cn", "sn", "dn")
        signs = (self.sign1, self.sign2, self.sign3)
        for role, name, sign, amplitude in zip(self.roles, names, signs, self.amplitudes, strict=True):
            result[role] = sign * amplitude * mpmath.ellipfun(name, u, m=self.m)
        return result

    def triad(self, momentum: Vector) -> Matrix:
        """Direction of the momentum, direction of the pole across it, and the third, in body axes."""
        along = times(1 / self.size, momentum)
        pole = [mpf(int(i == self.roles[2])) for i in range(3)]
        across = unit(plus(pole, times(-dot(pole, along), along)))
        return [along, across, cross(along, across)]

    def state(self, t: float) -> tuple[Vector, Vector]:
        """Orientation (w, x, y, z) and angular velocity (world) after `t` seconds."""
        time = mpf(t)
        if self.kind == "steady":
            speed = mpmath.sqrt(dot(self.omega, self.omega))
            columns = self.columns
            if speed > 0:
                columns = [turned(column, unit(self.omega), speed * time) for column in self.columns]
            return quaternion_of(columns), self.omega
        if self.kind == "symmetric":
            columns = self.symmetric_columns(time)
            momentum = [dot(column, self.world(self.columns, self.momentum)) for column in columns]
        else:
            u = self.start + self.tau * time
            momentum = self.body_momentum(u)
            columns = self.asymmetric_columns(u, time, momentum)
        rates = [m / i for m, i in zip(momentum, self.moments, strict=True)]
        return quaternion_of(columns), self.world(columns, rates)

    def world(self, columns: Matrix, body: Vector) -> Vector:
        """A vector's components in the world."""
        return plus(*(times(component, column) for component, column in zip(body, columns, strict=True)))

    def symmetric_columns(self, time: Any) -> Matrix:
        """Turn about the body's own axis, then about the angular momentum: two plain rotations."""
        low, middle, high = self.order
        pole, across = (high, low) if self.moments[low] == self.moments[middle] else (low, high)
        spin = self.rates[pole] - self.momentum[pole] / self.moments[across]
        direction = unit(self.world(self.columns, self.momentum))
        turn = self.size / self.moments[across] * time
        own = [turned(column, self.columns[pole], spin * time) for column in self.columns]
        return [turned(column, direction, turn) for column in own]

    def asymmetric_columns(self, u: Any, time: Any, momentum: Vector) -> Matrix:
        """The pole goes round the angular momentum by an integral of the third kind."""
        gap = self.size**2 - self.amplitudes[2] ** 2
        factor = self.size * (self.twice_energy - self.size**2 / self.pole_moment) / (gap * self.tau)
        azimuth = self.size * time / self.pole_moment + factor * (self.third_kind(u) - self.third_kind(self.start))
        direction, across, third = (self.world(self.columns, e) for e in self.triad(self.momentum))
        along_now, across_now, third_now = self.triad(momentum)
        images = [direction, turned(across, direction, azimuth), turned(third, direction, azimuth)]
        return [
            plus(times(along_now[i], images[0]), times(across_now[i], images[1]), times(third_now[i], images[2]))
            for i in range(3)
        ]

    def taylor(self, t: float, order: int = 60) -> tuple[Vector, Vector]:
        """The same by power series of Euler's equations and of the quaternion's, in steps of a fifth of a radian."""
        rates, quaternion = list(self.rates), quaternion_of(self.columns)
        ratios = [(self.moments[(i + 1) % 3] - self.moments[(i + 2) % 3]) / self.moments[i] for i in range(3)]
        speed = mpmath.sqrt(self.twice_energy / min(self.moments))
        steps = int(mpmath.ceil(abs(mpf(t)) * speed * 5))
        for _ in range(steps):
            w = [[x] for x in rates]
            q = [[x] for x in quaternion]
            for n in range(order):
                for i in range(3):
                    w[i].append(ratios[i] * convolution(w[(i + 1) % 3], w[(i + 2) % 3], n) / (n + 1))
                product = [
                    -convolution(q[1], w[0], n) - convolution(q[2], w[1], n) - convolution(q[3], w[2], n),
                    convolution(q[0], w[0], n) + convolution(q[2], w[2], n) - convolution(q[3], w[1], n),
                    convolution(q[0], w[1], n) + convolution(q[3], w[0], n) - convolution(q[1], w[2], n),
                    convolution(q[0], w[2], n) + convolution(q[1], w[1], n) - convolution(q[2], w[0], n),
                ]
                for i in range(4):
                    q[i].append(product[i] / (2 * (n + 1)))
            h = mpf(t) / steps
            rates = [mpmath.polyval(series[::-1], h) for series in w]
            quaternion = [mpmath.polyval(series[::-1], h) for series in q]
        return unit(quaternion), self.world(axes(quaternion), rates)


def convolution(a: Vector, b: Vector, n: int) -> Any:
    """The coefficient of t^n of the product of two series."""
    return mpmath.fdot(a[: n + 1], b[n::-1])


def angle_between(p: Vector, q: Vector) -> Any:
    """The angle of the rotation from one unit quaternion to another."""
    same = plus(p, times(-1, q))
    opposite = plus(p, q)
    return 4 * mpmath.asin(mpmath.sqrt(min(dot(same, same), dot(opposite, opposite))) / 2)


# --- the cases ----------------------------------------------------------------------------------------------------


def random_orientation(rng: random.Random) -> list[float]:
    """Uniform, rounded; its length is 1 but for rounding."""
    q = [rng.gauss(0, 1) for _ in range(4)]
    norm = sum(x * x for x in q) ** 0.5
    return [x / norm for x in q]


def random_moments(rng: random.Random) -> list[float]:
    """Those of a body: none is more than the sum of the others."""
    parts = [10 ** rng.uniform(-2, 1) for _ in range(3)]
    return [parts[1] + parts[2], parts[2] + parts[0], parts[0] + parts[1]]


def random_rates(rng: random.Random) -> list[float]:
    """An isotropic direction and a size of about 1."""
    size = 10 ** rng.uniform(-1, 1)
    return [size * rng.gauss(0, 1) for _ in range(3)]


def rates_near_separatrix(rng: random.Random, moments: list[float], distance: float) -> list[float]:
    """Body rates for which |L² - 2 E I2| / L² is near `distance`."""
    order = sorted(range(3), key=lambda i: moments[i])
    i1, i2, i3 = (mpf(moments[i]) for i in order)
    angle = mpf(rng.uniform(0, 6.28))
    m1 = mpmath.cos(angle) * mpmath.sqrt(i1 * (i3 - i2))
    m3 = mpmath.cos(angle) * mpmath.sqrt(i3 * (i2 - i1)) * rng.choice([-1, 1])
    m2 = mpmath.sin(angle) * mpmath.sqrt(m1**2 + m3**2) / max(abs(mpmath.cos(angle)), mpf("1e-3"))
    square = m1**2 + m2**2 + m3**2
    # m3² (1 - i2/i3) - m1² (i2/i1 - 1) = distance L²
    signed = rng.choice([-1, 1]) * mpf(distance) * square
    if signed > 0 or m1**2 * (i2 / i1 - 1) < -signed:
        m3 = mpmath.sign(m3) * mpmath.sqrt(max(m1**2 * (i2 / i1 - 1) + signed, -signed) / (1 - i2 / i3))
    else:
        m1 = mpmath.sign(m1) * mpmath.sqrt((m3**2 * (1 - i2 / i3) - signed) / (i2 / i1 - 1))
    rates = [0.0] * 3
    size = 10 ** rng.uniform(-1, 1)
    for i, m, moment in zip(order, (m1, m2, m3), (i1, i2, i3), strict=True):
        rates[i] = float(size * m / moment)
    return rates


def to_world(orientation: list[float], rates: list[float]) -> list[float]:
    """Body rates in world axes, rounded."""
    columns = axes([mpf(x) for x in orientation])
    return [float(x) for x in plus(*(times(mpf(r), column) for r, column in zip(rates, columns, strict=True)))]


SPANS = ("0.31", "-2.7", "997.43", "1000000.37")


def cases() -> Iterator[tuple[str, list[float], list[float], list[float]]]:
    """Kind, moments, orientation, angular velocity in the world."""
    rng = random.Random(20070145)
    for _ in range(140):
        yield "generic", random_moments(rng), random_orientation(rng), random_rates(rng)
    for k in range(30):
        moments, orientation = random_moments(rng), random_orientation(rng)
        rates = rates_near_separatrix(rng, moments, 10.0 ** (-9 - 0.2 * k))
        yield "separatrix", moments, orientation, to_world(orientation, rates)
    for k in range(30):
        # Two moments that differ little, or all three.
        moments, orientation = random_moments(rng), random_orientation(rng)
        first = k % 3
        moments[(first + 1) % 3] = moments[first] * (1 + 10.0 ** (-1 - 0.5 * k))
        if k % 2:
            moments[(first + 2) % 3] = moments[first] * (1 - 10.0 ** rng.uniform(-15, -1))
        yield "nearly symmetric", moments, orientation, random_rates(rng)
    for k in range(30):
        moments, orientation = random_moments(rng), random_orientation(rng)
        rates = [10.0 ** (-1 - 0.5 * k) * rng.gauss(0, 1) for _ in range(3)]
        rates[k % 3] = rng.choice([-1.0, 1.0])
        yield "nearly principal", moments, orientation, to_world(orientation, rates)
    for k in range(12):
        # Two moments that differ little, and the rotation nearly across the third axis: it can go round any of them.
        moments, orientation = random_moments(rng), random_orientation(rng)
        small = 10.0 ** rng.uniform(-14, -1)
        moments[(k + 1) % 3] = moments[k % 3] * (1 + small)
        rates = [rng.gauss(0, 1) for _ in range(3)]
        rates[(k + 2) % 3] *= small**0.5
        yield "across", moments, orientation, to_world(orientation, rates)
    for k in range(12):
        moments, orientation = random_moments(rng), random_orientation(rng)
        moments[(k + 1) % 3] = moments[k % 3]
        yield "symmetric", moments, orientation, random_rates(rng)
    for _ in range(6):
        yield "spherical", [random_moments(rng)[0]] * 3, random_orientation(rng), random_rates(rng)
    for k in range(6):
        moments = random_moments(rng)
        rates = [0.0] * 3
        rates[k % 3] = rng.uniform(-2, 2)
        orientation = [1.0, 0.0, 0.0, 0.0] if k < 3 else [0.5, 0.5, -0.5, 0.5]
        yield "principal", moments, orientation, to_world(orientation, rates)
    yield "rest", random_moments(rng), random_orientation(rng), [0.0, 0.0, 0.0]
    for _ in range(12):
        inertia, rate = 10.0 ** rng.choice([-100, -60, 60, 100]), 10.0 ** rng.choice([-100, -60, 60, 100])
        moments = [inertia * x for x in random_moments(rng)]
        yield "any scale", moments, random_orientation(rng), [rate * x for x in random_rates(rng)]
    for _ in range(12):
        # Needles: one moment is far below the others.
        moments, orientation = random_moments(rng), random_orientation(rng)
        moments[rng.randrange(3)] *= 10.0 ** rng.uniform(-8, -2)
        yield "needle", moments, orientation, random_rates(rng)


def cycle(top: Top) -> Any:
    """A time (s) in which the motion comes round: the wobble's period, or that of the turning."""
    if top.kind == "asymmetric":
        return top.period
    speed = mpmath.sqrt(dot(top.omega, top.omega))
    return 2 * mpmath.pi / speed if speed > 0 else mpf(1)


def digits(vector: Vector) -> list[str]:
    """Each number with 32 digits."""
    return [mpmath.nstr(x, 32, min_fixed=0, max_fixed=0) for x in vector]


def main() -> None:
    """Write the file."""
    rows = []
    for kind, moments, orientation, omega in cases():
        top = Top(moments, orientation, omega)
        states = []
        for span in SPANS:
            t = float(cycle(top) * mpf(span))
            attitude, rates = top.state(t)
            states.append({"time": t, "orientation": digits(attitude), "angular_velocity": digits(rates)})
        rows.append(
            {
                "kind": kind,
                "moments": moments,
                "orientation": orientation,
                "angular_velocity": omega,
                "angular_momentum": mpmath.nstr(top.size, 32),
                "energy": mpmath.nstr(top.twice_energy / 2, 32),
                "period": mpmath.nstr(top.period, 32) if top.kind == "asymmetric" else None,
                "separatrix_distance": mpmath.nstr(top.distance, 32) if top.kind == "asymmetric" else None,
                "states": states,
            }
        )
    path = Path(__file__).with_suffix(".json")
    path.write_text("[" + ",\n".join(json.dumps(row) for row in rows) + "]\n", encoding="utf-8")
    print(f"{len(rows)} bodies, {path.stat().st_size} bytes")


def check() -> None:
    """Compare the closed form with power series: all bodies for a short time, each tenth for more than a period."""
    worst = mpf(0)
    for row, (kind, moments, orientation, omega) in enumerate(cases()):
        top = Top(moments, orientation, omega)
        speed = mpmath.sqrt(top.twice_energy / min(top.moments))
        short = 1 / speed if speed > 0 else mpf(1)
        span = short * 2
        if row % 10 == 0 and top.kind == "asymmetric" and top.period < 300 * short:
            span = top.period * mpf("1.1")
        (p, v), (q, w) = top.state(float(span)), top.taylor(float(span))
        error = angle_between(p, q)
        change = plus(v, times(-1, w))
        if speed > 0:
            error = max(error, mpmath.sqrt(dot(change, change)) / speed)
        worst = max(worst, error)
        print(row, kind, mpmath.nstr(span / short, 4), "radians:", mpmath.nstr(error, 3), flush=True)
    print("worst", mpmath.nstr(worst, 3))


if __name__ == "__main__":
    check() if "--check" in sys.argv[1:] else main()
