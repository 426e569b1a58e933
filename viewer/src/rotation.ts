// Free rotation in closed form: how a body is oriented and how it turns, any time after its last impact. A port of the
// simulator's own (crates/carom/src/rotation.rs and its folder, where everything is explained); nothing is integrated in steps.
//
// A body with three equal moments, or one that turns exactly about a principal axis, turns about a fixed axis. Of every
// other one the angular momentum wanders in the body, round one principal axis, the pole (Jacobi's elliptic functions, as
// quotients of theta functions), and the body is turned about the angular momentum by an angle whose uneven part is the
// argument of another theta function.

import { DoubleDouble, productError, sumError } from "./doubledouble";
import { product as multiply, rotated } from "./quaternions";
import type { Quaternion, Vector } from "./recording";

const { ZERO, ONE } = DoubleDouble;
const TAU = 2 * Math.PI;
/** Components of the angular momentum below this fraction of the largest are 0 (2^-300). */
const NEGLIGIBLE_MOMENTUM = 2 ** -300;
/** The nome up to which circular functions are summed, e^-2: beyond, hyperbolic ones take fewer terms. */
const LARGEST_NOME = 0.1353352832366127;

/** How a body turns at an instant. */
export interface Turn {
  /** Unit quaternion (w, x, y, z), principal axes to world. */
  orientation: Quaternion;
  /** World axes (rad/s). */
  angularVelocity: Vector;
}

/** A body's rotation right after its last impact, prepared so that it can be evaluated any time later. */
export interface Rotation {
  after(seconds: number): Turn;
}

/**
 * The free rotation of a body with these principal moments (kg m²), of this orientation (principal axes to world) and this
 * angular velocity (rad/s, world axes). Moments that are not finite are those of a body in prescribed motion.
 */
export function freeRotation(moments: ArrayLike<number>, orientation: Quaternion, angularVelocity: Vector): Rotation {
  const start = normalized(orientation);
  const [i1, i2, i3] = [moments[0], moments[1], moments[2]];
  if ((i1 === i2 && i2 === i3) || !Number.isFinite(i1 + i2 + i3) || !(Math.min(i1, i2, i3) > 0)) return new Steady(start, angularVelocity);
  // Powers of two, taken off and put back without rounding, so that no square leaves the range of a double.
  const inertiaUnit = binaryUnit([i1, i2, i3]);
  const rateUnit = binaryUnit(angularVelocity);
  const scaled = [i1 / inertiaUnit, i2 / inertiaUnit, i3 / inertiaUnit];
  const rates = angularVelocity.map((w) => w / rateUnit) as Vector;
  const along = bodyRates(orientation, rates).map((rate, i) => rate.times(scaled[i]));
  const largest = Math.max(...along.map((part) => Math.abs(part.high)));
  const momentum = along.map((part) => (Math.abs(part.high) < NEGLIGIBLE_MOMENTUM * largest ? ZERO : part));
  const size = momentum[0].squared().plus(momentum[1].squared()).plus(momentum[2].squared()).sqrt();
  // Whether L × ω is zero exactly.
  const steady = [[0, 1], [1, 2], [2, 0]].every(([i, j]) => scaled[i] === scaled[j] || momentum[i].high === 0 || momentum[j].high === 0);
  return steady ? new Steady(start, angularVelocity) : new Tumbling(top(scaled, momentum, size), start, rateUnit);
}

/** About an axis that is fixed in the world and in the body. */
class Steady implements Rotation {
  private readonly axis: Vector;
  private readonly halfTurn: DoubleDouble;

  constructor(private readonly orientation: Quaternion, private readonly angularVelocity: Vector) {
    const unit = binaryUnit(angularVelocity);
    const [x, y, z] = angularVelocity.map((w) => w / unit);
    const speed = DoubleDouble.product(x, x).plus(DoubleDouble.product(y, y)).plus(DoubleDouble.product(z, z)).sqrt();
    this.axis = speed.high > 0 ? [x / speed.high, y / speed.high, z / speed.high] : [0, 0, 0];
    this.halfTurn = speed.scaled(0.5).times(DoubleDouble.INVERSE_TWO_PI).scaled(unit);
  }

  after(seconds: number): Turn {
    const [sine, cosine] = sineCosine(turnsAfter(this.halfTurn, seconds, 0));
    const [x, y, z] = this.axis;
    return { orientation: multiply([cosine, x * sine, y * sine, z * sine], this.orientation), angularVelocity: this.angularVelocity };
  }
}

/** The angular momentum wanders in the body. */
class Tumbling implements Rotation {
  private readonly wobble: Wobble;
  /** Of v, the phase of the wobble (turns/s). */
  private readonly phase: DoubleDouble;
  private readonly phaseAtStart: number;
  /** Of half of the even part of the angle about the angular momentum (turns/s). */
  private readonly halfTurn: DoubleDouble;
  private readonly sense: number;
  /** L over each moment (rad/s), along the axes of the wobble. */
  private readonly rates: Vector;
  /** From body axes in which the angular momentum is at the pole to the world. */
  private readonly toWorld: Quaternion;
  private readonly index: number[];
  private readonly sign: Vector;

  constructor(state: Top, orientation: Quaternion, rateUnit: number) {
    const { mean, share } = state.means;
    this.wobble = wobbleOf(state, mean.high);
    const frequency = state.tau.times(mean);
    const open = this.wobble.open;
    this.phase = (open ? state.tau : frequency.times(DoubleDouble.INVERSE_TWO_PI)).scaled(rateUnit);
    this.phaseAtStart = state.phaseAtStart(open, mean.high);
    const excess = state.size.times(state.otherMiddle).times(share).over(state.volume).minus(frequency);
    const turnRate = state.size.over(new DoubleDouble(state.moments[1])).plus(excess.times(state.sense));
    this.halfTurn = turnRate.scaled(0.5).times(DoubleDouble.INVERSE_TWO_PI).scaled(rateUnit);
    this.sense = state.sense;
    this.rates = state.moments.map((moment) => (state.size.high / moment) * rateUnit) as Vector;
    this.index = state.index;
    this.sign = state.sign;
    const [w, x, y, z] = this.turnedToPole(0)[0];
    this.toWorld = normalized(multiply(orientation, [w, -x, -y, -z]));
  }

  after(seconds: number): Turn {
    const [toPole, direction] = this.turnedToPole(seconds);
    const orientation = multiply(this.toWorld, toPole);
    const inBody = this.toBody(this.rates[0] * direction[0], this.rates[1] * direction[1], this.rates[2] * direction[2]);
    return { orientation, angularVelocity: rotated(orientation, inBody) };
  }

  private toBody(first: number, second: number, third: number): Vector {
    const result: Vector = [0, 0, 0];
    result[this.index[0]] = first * this.sign[0];
    result[this.index[1]] = second * this.sign[1];
    result[this.index[2]] = third * this.sign[2];
    return result;
  }

  /** The rotation, in body axes, that brings the angular momentum to the pole and turns about it; and its direction. */
  private turnedToPole(seconds: number): [Quaternion, Vector] {
    const { phase, phaseAtStart, wobble, sense } = this;
    const point = wobble.at(wobble.open ? phase.high * seconds + phaseAtStart : turnsAfter(phase, seconds, phaseAtStart));
    const [nx, ny, nz] = point.direction;
    const [sine, cosine] = sineCosine(turnsAfter(this.halfTurn, seconds, sense * point.lead));
    const real = point.uneven[0];
    const imaginary = sense * point.uneven[1];
    const c = cosine * real - sine * imaginary;
    const s = cosine * imaginary + sine * real;
    // (c + s e₃) (1 + n₃ + n × e₃)
    const [x, y, z] = this.toBody(c * ny + s * nx, s * ny - c * nx, s * (1 + nz));
    return [normalized([c * (1 + nz), x, y, z]), point.direction];
  }
}

/** A state whose angular momentum wanders: constants as in rotation/top.rs, along the other axis, the middle one, the pole. */
interface Top {
  index: number[];
  sign: Vector;
  /** 1 if the pole is the axis of the largest moment, −1 if that of the smallest. */
  sense: number;
  size: DoubleDouble;
  moments: number[];
  volume: DoubleDouble;
  otherMiddle: DoubleDouble;
  middlePole: number;
  polePart: number;
  otherPart: number;
  tau: DoubleDouble;
  means: { mean: DoubleDouble; share: DoubleDouble };
  /** Squares of the amplitudes of L₁, L₂, L₃, over L². */
  amplitudes: Vector;
  /** v at the start in turns; u itself if the wobble is open. */
  phaseAtStart(open: boolean, mean: number): number;
}

function top(moments: number[], momentum: DoubleDouble[], size: DoubleDouble): Top {
  const order = [0, 1, 2].sort((i, j) => moments[i] - moments[j]);
  const gap = (a: number, b: number, factor: number) => DoubleDouble.difference(a, b).abs().times(factor);
  const [low, middle, high] = order;
  const squares = momentum.map((part) => part.squared());
  const about = (index: number[]) => {
    const [i1, i2, i3] = index.map((i) => moments[i]);
    const [l1, l2, l3] = index.map((i) => squares[i]);
    const [otherPole, middlePole, otherMiddle] = [gap(i3, i1, i2), gap(i3, i2, i1), gap(i2, i1, i3)];
    return {
      index, moments: [i1, i2, i3], squares: [l1, l2, l3], otherPole, middlePole, otherMiddle,
      volume: DoubleDouble.product(i1, i2).times(i3),
      polePart: otherPole.times(l3).plus(otherMiddle.times(l2)),
      otherPart: otherPole.times(l1).plus(middlePole.times(l2)),
      separation: middlePole.times(l3).minus(otherMiddle.times(l1)),
    };
  };
  let found = about([low, middle, high]);
  let sense = 1;
  if (!(found.separation.high > 0 || (found.separation.high === 0 && found.middlePole.high >= found.otherMiddle.high))) {
    found = about([high, middle, low]);
    sense = -1;
  }
  const { index, otherPole, middlePole, otherMiddle, polePart, otherPart, separation, volume } = found;
  const side = (k: number) => (momentum[index[k]].high < 0 ? -1 : 1);
  const parity = (index[0] + 1) % 3 === index[1] ? 1 : -1;
  const sign: Vector = [side(0), parity * side(0) * side(2), side(2)];
  const square = size.high * size.high;
  const rising = momentum[index[1]].high * sign[1] * sense > 0;
  let means = { mean: ONE, share: ZERO };
  if (otherMiddle.high !== 0 || otherMiddle.low !== 0) {
    const complementary = otherPole.times(separation).over(middlePole.times(polePart));
    means = complementary.high > 0 ? quarterMeans(complementary.sqrt(), otherPole.over(middlePole)) : { mean: ZERO, share: ZERO };
  }
  return {
    index, sign, sense, size, volume, otherMiddle, means,
    moments: found.moments,
    middlePole: middlePole.high,
    polePart: polePart.high,
    otherPart: otherPart.high,
    tau: middlePole.times(polePart).sqrt().over(volume),
    amplitudes: [otherPart.high / otherPole.high / square, otherPart.high / middlePole.high / square, polePart.high / otherPole.high / square],
    phaseAtStart(open, mean) {
      const [first, second, third] = found.squares.map((part) => part.high);
      const cn2 = (otherPole.high * first) / otherPart.high;
      const sn2 = (middlePole.high * second) / otherPart.high;
      const dn2 = (otherPole.high * third) / polePart.high;
      const u = Math.sqrt(sn2) * carlsonFirstKind(cn2, dn2, 1);
      return (rising ? 1 : -1) * (open ? u : (u * mean) / TAU);
    },
  };
}

/** What a wobble is at a point of its period. */
interface Point {
  /** Direction of the angular momentum. */
  direction: Vector;
  /** Cosine and sine, times any positive number, of half of the uneven part of the angle about it. */
  uneven: [number, number];
  /** To be added to half of the even part (turns). */
  lead: number;
}

interface Wobble {
  /** Whether the state is on the separatrix: the body turns over once and never again. */
  open: boolean;
  at(turns: number): Point;
}

function wobbleOf(state: Top, mean: number): Wobble {
  const modulusSquare = (state.otherMiddle.high * state.otherPart) / (state.middlePole * state.polePart);
  const [other, middle, pole] = state.amplitudes;
  const complementaryMean = arithmeticGeometricMean(1, Math.sqrt(modulusSquare));
  const eta = modulusSquare > 0 ? Math.sqrt(pole) * carlsonFirstKind(other, other + modulusSquare * pole, 1) : Infinity;
  const amplitudes: Vector = [Math.sqrt(other), state.sense * Math.sqrt(middle), Math.sqrt(pole)];
  if (complementaryMean === 0) return circular(amplitudes);
  const nome = Math.exp((-Math.PI * mean) / complementaryMean);
  if (nome > LARGEST_NOME) return hyperbolic(amplitudes, (Math.PI * complementaryMean) / mean, 1 - (eta * complementaryMean) / (0.5 * Math.PI));
  const expanded = Math.exp(-2 * mean * eta);
  return nome === 0 || expanded === 0 ? circular(amplitudes) : trigonometric(amplitudes, nome, expanded);
}

/** k = 0: the angular momentum goes round the axis of a symmetric top. */
function circular([a1, a2, a3]: Vector): Wobble {
  return {
    open: false,
    at(turns) {
      const [sine, cosine] = sineCosine(turns);
      return { direction: [a1 * cosine, a2 * sine, a3], uneven: [1, 0], lead: 0 };
    },
  };
}

/** Sums in powers of the nome q; `expanded` is q e^(2α). */
function trigonometric(amplitudes: Vector, q: number, expanded: number): Wobble {
  const [q2, q4, q6, q9, q12, q16] = [q ** 2, q ** 4, q ** 6, q ** 9, q ** 12, q ** 16];
  const second = 1 + q2 + q6 + q12;
  const evenAtStart = 2 * (q4 + q16);
  const oddAtStart = 2 * (q + q9);
  const [third, fourth] = [1 + evenAtStart + oddAtStart, 1 + evenAtStart - oddAtStart];
  const [a1, a2, a3] = [(amplitudes[0] * fourth) / second, (amplitudes[1] * third) / second, (amplitudes[2] * fourth) / third];
  const near = q * expanded;
  const far = q2 * (q / expanded);
  const [near2, far2] = [near * near * q4, far * far * q4];
  const [near3, far3] = [near ** 3 * q12, far ** 3 * q12];
  return {
    open: false,
    at(turns) {
      const [s1, c1] = sineCosine(turns);
      const [s2, c2] = [2 * s1 * c1, (c1 - s1) * (c1 + s1)];
      const [s4, c4] = [2 * s2 * c2, (c2 - s2) * (c2 + s2)];
      const [s3, c3] = [s2 * c1 + c2 * s1, c2 * c1 - s2 * s1];
      const [s5, c5] = [s4 * c1 + c4 * s1, c4 * c1 - s4 * s1];
      const [s6, c6] = [s4 * c2 + c4 * s2, c4 * c2 - s4 * s2];
      const [s7, c7] = [s4 * c3 + c4 * s3, c4 * c3 - s4 * s3];
      const first = s1 - q2 * s3 + q6 * s5 - q12 * s7;
      const middle = c1 + q2 * c3 + q6 * c5 + q12 * c7;
      const even = 2 * (q4 * c4 + q16 * (c4 - s4) * (c4 + s4));
      const odd = 2 * (q * c2 + q9 * c6);
      const inverse = 1 / (1 + even - odd);
      return {
        direction: [a1 * middle * inverse, a2 * first * inverse, a3 * (1 + even + odd) * inverse],
        uneven: [
          1 - (near + far) * c2 + (near2 + far2) * c4 - (near3 + far3) * c6,
          (far - near) * s2 + (near2 - far2) * s4 - (near3 - far3) * s6,
        ],
        lead: 0,
      };
    },
  };
}

/** Jacobi's transform of those sums, near the separatrix; `length` is π K/K′, infinite on it, `fromEnd` is (K′ − η)/K′. */
function hyperbolic(amplitudes: Vector, length: number, fromEnd: number): Wobble {
  const q = Math.exp(-length);
  const open = length === Infinity;
  const qq = q * q;
  const second = 1 + qq + qq * qq * qq;
  const [third, fourth] = [1 + 2 * (q + qq * qq), 1 - 2 * (q - qq * qq)];
  const [a1, a2, a3] = [(amplitudes[0] * second) / fourth, (amplitudes[1] * third) / fourth, (amplitudes[2] * second) / third];
  const [b1s, b1c] = sineCosine(0.125 * fromEnd);
  const doubled = 2 * (b1c - b1s) * (b1c + b1s);
  const [c3, s3] = [b1c * (doubled - 1), b1s * (doubled + 1)];
  const [c5, s5] = [doubled * c3 - b1c, doubled * s3 - b1s];
  const [c7, s7] = [doubled * c5 - c3, doubled * s5 - s3];
  const stretch = open ? 1 : 2 * length;
  const lag = open ? 0 : 0.5 * fromEnd;
  return {
    open,
    at(given) {
      const halves = open ? 0 : nearest(2 * given);
      const turns = given - 0.5 * halves;
      const sign = halves % 2 === 0 ? 1 : -1;
      const w = stretch * turns;
      const side = w < 0 ? -1 : 1;
      const x = Math.exp(-Math.abs(w));
      const y = q > 0 ? q / x : 0;
      const [x2, y2] = [x * x, y * y];
      const [x4, y4] = [x2 * x2, y2 * y2];
      const even = 1 + y4 * qq;
      const [plus, minus] = [y2 + qq * x4, y2 - qq * x4];
      const tail = x2 + qq * qq * qq * x2 * x4;
      const inverse = 1 / (even + tail + plus);
      const oddTerms = y + q * x * x2 + y * y4 * qq * qq;
      const evenTerms = x + q * (y * y2 + qq * q * x * x4);
      const q3 = qq * q;
      const up = [1, y, y2 * q, y * y2 * q3];
      const down = [x, q * x2, q3 * x * x2, q3 * q3 * x4];
      return {
        direction: [
          sign * a1 * 2 * (evenTerms - oddTerms) * inverse,
          sign * side * a2 * (even - tail - minus) * inverse,
          a3 * 2 * (evenTerms + oddTerms) * inverse,
        ],
        uneven: [
          b1c * (up[0] + down[0]) + c3 * (up[1] + down[1]) + c5 * (up[2] + down[2]) + c7 * (up[3] + down[3]),
          -side * (b1s * (up[0] - down[0]) + s3 * (up[1] - down[1]) + s5 * (up[2] - down[2]) + s7 * (up[3] - down[3])),
        ],
        lead: lag * turns,
      };
    },
  };
}

/** π/2K of a complementary modulus 0 < k′ ≤ 1, and the mean over u of cn² / (cn² + p sn²) (Bulirsch). */
function quarterMeans(complementary: DoubleDouble, square: DoubleDouble): { mean: DoubleDouble; share: DoubleDouble } {
  let geometric = complementary;
  let arithmetic = ONE;
  let both = complementary;
  let p = square.sqrt();
  let [a, b] = [ONE, ZERO];
  let power = 1;
  for (;;) {
    const inverse = ONE.over(p);
    const g = both.times(inverse);
    [a, b] = [a.plus(b.times(inverse)), b.plus(a.times(g)).scaled(2)];
    p = p.plus(g);
    const difference = Math.abs(arithmetic.minus(geometric).high);
    const before = arithmetic.high;
    arithmetic = arithmetic.plus(geometric);
    power *= 0.5;
    if (!(difference > 1e-15 * before && power > Number.EPSILON)) break;
    geometric = both.sqrt().scaled(2);
    both = geometric.times(arithmetic);
  }
  const mean = arithmetic.scaled(power);
  return { mean, share: mean.times(b.plus(a.times(arithmetic))).over(arithmetic.times(arithmetic.plus(p))) };
}

function arithmeticGeometricMean(a: number, b: number): number {
  if (a === 0 || b === 0) return 0;
  for (;;) {
    const mean = 0.5 * (a + b);
    if (!(Math.abs(a - b) > 1e-8 * a)) return mean - ((a - b) * (a - b)) / (16 * mean);
    [a, b] = [mean, Math.sqrt(a * b)];
  }
}

/** Carlson's symmetric integral of the first kind. */
function carlsonFirstKind(x: number, y: number, z: number): number {
  for (;;) {
    const mean = (x + y + z) / 3;
    const [dx, dy] = [1 - x / mean, 1 - y / mean];
    const dz = -(dx + dy);
    if (!(Math.max(Math.abs(dx), Math.abs(dy), Math.abs(dz)) >= 0.01)) {
      const second = dx * dy - dz * dz;
      const third = dx * dy * dz;
      const series = second * (-1 / 10 + second * (1 / 24 - second * (5 / 208)))
        + third * (1 / 14 - second * (3 / 44) + third * (3 / 104) + (second * second) / 16);
      return (1 + series) / Math.sqrt(mean);
    }
    const [rx, ry, rz] = [Math.sqrt(x), Math.sqrt(y), Math.sqrt(z)];
    const shift = rx * (ry + rz) + ry * rz;
    [x, y, z] = [0.25 * (x + shift), 0.25 * (y + shift), 0.25 * (z + shift)];
  }
}

/** The angular velocity along the body's axes with 32 digits: near the separatrix the rates depend on small differences. */
function bodyRates([w, x, y, z]: Quaternion, [a, b, c]: Vector): DoubleDouble[] {
  const of = DoubleDouble.product;
  const [ww, xx, yy, zz] = [of(w, w), of(x, x), of(y, y), of(z, z)];
  const inverse = ONE.over(ww.plus(xx).plus(yy.plus(zz)));
  const twice = (one: DoubleDouble, other: DoubleDouble) => one.plus(other).scaled(2);
  return [
    [ww.plus(xx).minus(yy.plus(zz)), twice(of(x, y), of(w, z)), twice(of(x, z), of(-w, y))],
    [twice(of(x, y), of(-w, z)), ww.plus(yy).minus(xx.plus(zz)), twice(of(y, z), of(w, x))],
    [twice(of(x, z), of(w, y)), twice(of(y, z), of(-w, x)), ww.plus(zz).minus(xx.plus(yy))],
  ].map(([p, q, r]) => p.times(a).plus(q.times(b)).plus(r.times(c)).times(inverse));
}

/** Where one is after `seconds` at `rate` (turns/s) from `start` (turns) on, in turns but for whole ones. */
function turnsAfter(rate: DoubleDouble, seconds: number, start: number): number {
  const turns = rate.high * seconds;
  const error = productError(rate.high, seconds) + rate.low * seconds;
  const part = turns - nearest(turns);
  const sum = part + start;
  return (sum - nearest(sum)) + (sumError(part, start) + (error - nearest(error)));
}

/** The integer nearest to x. */
function nearest(x: number): number {
  const shift = 6755399441055744;
  return Math.abs(x) < 2251799813685248 ? (x + shift) - shift : Math.round(x);
}

/** Sine and cosine of an angle in turns. */
function sineCosine(turns: number): [number, number] {
  const quarters = nearest(4 * turns);
  const x = TAU * (turns - 0.25 * quarters);
  const [sine, cosine] = [Math.sin(x), Math.cos(x)];
  switch (((quarters % 4) + 4) % 4) {
    case 0: return [sine, cosine];
    case 1: return [cosine, -sine];
    case 2: return [-sine, -cosine];
    default: return [-cosine, sine];
  }
}

const bits = new Float64Array(1);
const words = new Uint32Array(bits.buffer);

/** The largest power of two that is at most the largest magnitude; 1 for zeros. */
function binaryUnit(values: ArrayLike<number>): number {
  bits[0] = Math.max(Math.abs(values[0]), Math.abs(values[1]), Math.abs(values[2]));
  if (!(bits[0] > 0)) return 1;
  words[0] = 0;
  words[1] &= 0x7ff00000;
  return bits[0] || 1;
}

function normalized([w, x, y, z]: Quaternion): Quaternion {
  const length = Math.sqrt(w * w + x * x + y * y + z * z) || 1;
  return [w / length, x / length, y / length, z / length];
}
