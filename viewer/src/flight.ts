// Where every body is at any time: the same closed form as the simulator's, nothing integrated, nothing interpolated.
//
// Between impacts a body flies x = x0 + v t + g t²/2 and turns freely (rotation.ts). Its path is a list of segments, one for the start and one for each
// of its impacts; all segments stand in flat arrays, those of one body side by side, so any time is found by bisection.

import { angleBetween, conjugate, product, rotated } from "./quaternions";
import { AXES, rowsById, type Quaternion, type Recording, type Vector } from "./recording";
import { freeRotation, type Rotation } from "./rotation";

/** Impacts at which replayed orientations are compared with recorded ones; all of them could take seconds. */
const TURNS_LOOKED_AT = 1000;

export class Flight {
  /** Segments of body `row` are first[row] … first[row + 1] − 1. */
  readonly first: Int32Array;
  /** Of each segment: when it begins, and position and velocity there. */
  readonly time: Float64Array;
  readonly position: Float64Array;
  readonly velocity: Float64Array;
  /** Of each segment where bodies turn: orientation (shape's frame to world) and angular velocity (world axes) there. */
  readonly orientation: Float64Array;
  readonly angularVelocity: Float64Array;
  /** Of each impact: the segment of A and of B that begins with it; −1 for what is not a body (a plane). */
  readonly segmentA: Int32Array;
  readonly segmentB: Int32Array;
  /** Of each impact: the rows of A and B, −1 for a plane. */
  readonly rowA: Int32Array;
  readonly rowB: Int32Array;
  /** Periods by axis; 0 where space does not wrap. */
  readonly period: [number, number, number];

  private readonly recording: Recording;
  /** Of each body: the rotation last asked for, and of which segment it is. */
  private readonly rotations: (Rotation | undefined)[] = [];
  private readonly rotationOf: Int32Array;
  private mismatch = NaN;

  constructor(recording: Recording) {
    this.recording = recording;
    const { bodies, impacts, gravity } = recording;
    const n = bodies.count;
    const m = impacts.count;
    this.period = AXES.map((k) => (recording.axes[k] === "periodic" ? recording.size[k] : 0)) as [number, number, number];

    const rows = rowsById(bodies);
    this.rowA = impacts.a.map((id) => rows.get(id) ?? -1);
    this.rowB = impacts.b.map((id) => rows.get(id) ?? -1);

    this.first = new Int32Array(n + 1);
    for (let row = 0; row < n; row++) this.first[row + 1] = 1;
    for (const side of [this.rowA, this.rowB]) for (const row of side) if (row >= 0) this.first[row + 1]++;
    for (let row = 0; row < n; row++) this.first[row + 1] += this.first[row];

    const segments = this.first[n];
    this.time = new Float64Array(segments);
    this.position = new Float64Array(3 * segments);
    this.velocity = new Float64Array(3 * segments);
    this.orientation = new Float64Array(bodies.turning ? 4 * segments : 0);
    this.angularVelocity = new Float64Array(bodies.turning ? 3 * segments : 0);
    this.rotationOf = new Int32Array(n).fill(-1);
    this.segmentA = new Int32Array(m).fill(-1);
    this.segmentB = new Int32Array(m).fill(-1);

    const last = this.first.slice(0, n);
    for (let row = 0; row < n; row++) {
      for (const k of AXES) {
        this.position[3 * last[row] + k] = bodies.position[3 * row + k];
        this.velocity[3 * last[row] + k] = bodies.velocity[3 * row + k];
      }
      if (!bodies.turning) continue;
      this.orientation.set(bodies.turning.orientation.subarray(4 * row, 4 * row + 4), 4 * last[row]);
      this.angularVelocity.set(bodies.turning.angularVelocity.subarray(3 * row, 3 * row + 3), 3 * last[row]);
    }
    /** Begins a new segment of `row` at time t, with the velocity changed by `kick` n. */
    const strike = (row: number, t: number, impact: number, kick: number): number => {
      const from = last[row];
      const to = ++last[row];
      const dt = t - this.time[from];
      const falls = bodies.fixed[row] ? 0 : 1;
      this.time[to] = t;
      for (const k of AXES) {
        const g = falls * gravity[k];
        const v = this.velocity[3 * from + k];
        this.position[3 * to + k] = this.position[3 * from + k] + v * dt + 0.5 * g * dt * dt;
        this.velocity[3 * to + k] = v + g * dt + kick * impacts.normal[3 * impact + k];
      }
      return to;
    };
    for (let i = 0; i < m; i++) {
      const t = impacts.time[i];
      const a = this.rowA[i];
      const b = this.rowB[i];
      if (bodies.turning) {
        if (a >= 0) this.turnOn(a, last[a], i, 0);
        if (b >= 0) this.turnOn(b, last[b], i, 1);
      }
      if (a >= 0) this.segmentA[i] = strike(a, t, i, impacts.impulse[i] * this.inverseMass(a));
      if (b >= 0) this.segmentB[i] = strike(b, t, i, -impacts.impulse[i] * this.inverseMass(b));
    }
  }

  /** Writes how body `row` stands and turns in the segment after `from`: as recorded, or by the law of impact. */
  private turnOn(row: number, from: number, impact: number, side: 0 | 1): void {
    const { impacts, bodies } = this.recording;
    const { turns } = impacts;
    const to = from + 1;
    if (turns) {
      this.orientation.set(turns.orientation[side].subarray(4 * impact, 4 * impact + 4), 4 * to);
      this.angularVelocity.set(turns.angularVelocity[side].subarray(3 * impact, 3 * impact + 3), 3 * to);
      return;
    }
    const seconds = impacts.time[impact] - this.time[from];
    const { orientation, angularVelocity } = this.rotationFrom(row, from).after(seconds);
    const stands = product(orientation, conjugate(this.principal(row)));
    // Δω = ± I⁻¹ (r × j n), in principal axes; nothing of a body in prescribed motion.
    const j = (side === 0 ? 1 : -1) * impacts.impulse[impact];
    const g = bodies.fixed[row] ? 0 : 0.5 * seconds * seconds;
    const arm = AXES.map((k) => {
      const centre = this.position[3 * from + k] + this.velocity[3 * from + k] * seconds + this.recording.gravity[k] * g;
      return wrap(impacts.point[3 * impact + k] - centre, this.period[k]);
    });
    const n = AXES.map((k) => impacts.normal[3 * impact + k]);
    const moment = AXES.map((k) => j * (arm[(k + 1) % 3] * n[(k + 2) % 3] - arm[(k + 2) % 3] * n[(k + 1) % 3])) as Vector;
    const along = rotated(conjugate(orientation), moment);
    const change = rotated(orientation, AXES.map((k) => (bodies.fixed[row] ? 0 : along[k] / this.moment(row, k))) as Vector);
    this.orientation.set(stands, 4 * to);
    this.angularVelocity.set(AXES.map((k) => angularVelocity[k] + change[k]), 3 * to);
  }

  private moment(row: number, k: number): number {
    return this.recording.bodies.turning?.moments[3 * row + k] ?? Infinity;
  }

  /** Principal axes to the shape's frame. */
  private principal(row: number): Quaternion {
    const shape = this.recording.bodies.turning?.geometry[row] ?? -1;
    return shape < 0 ? [1, 0, 0, 0] : this.recording.geometries[shape].principalAxes;
  }

  /** The free rotation of body `row`, along its principal axes, from the beginning of `segment` on. */
  private rotationFrom(row: number, segment: number): Rotation {
    const known = this.rotations[row];
    if (known && this.rotationOf[row] === segment) return known;
    const stands = [0, 1, 2, 3].map((k) => this.orientation[4 * segment + k]) as Quaternion;
    const spins = AXES.map((k) => this.angularVelocity[3 * segment + k]) as Vector;
    // Balls turn about any axis alike, and what is prescribed keeps its angular velocity.
    const free = !this.recording.bodies.fixed[row] && (this.recording.bodies.turning?.geometry[row] ?? -1) >= 0;
    const moments = AXES.map((k) => (free ? this.moment(row, k) : Infinity));
    const made = freeRotation(moments, product(stands, this.principal(row)), spins);
    this.rotations[row] = made;
    this.rotationOf[row] = segment;
    return made;
  }

  /** Orientations of all bodies at `time` (shape's frame to world) into `out` (4 numbers a body). */
  orientationsAt(time: number, out: Float64Array): void {
    const { count, turning } = this.recording.bodies;
    if (!turning) return;
    for (let row = 0; row < count; row++) {
      const s = this.segmentAt(row, time);
      const { orientation } = this.rotationFrom(row, s).after(time - this.time[s]);
      const [w, x, y, z] = product(orientation, conjugate(this.principal(row)));
      out[4 * row] = w;
      out[4 * row + 1] = x;
      out[4 * row + 2] = y;
      out[4 * row + 3] = z;
    }
  }

  /** Angular velocity of body `row` at `time` (rad/s, world axes); at an impact the one after it. */
  angularVelocityAt(row: number, time: number): Vector {
    if (!this.recording.bodies.turning) return [0, 0, 0];
    const s = this.segmentAt(row, time);
    return this.rotationFrom(row, s).after(time - this.time[s]).angularVelocity;
  }

  /** Angular velocity just before segment `segment` of body `row` begins. */
  angularVelocityBefore(row: number, segment: number): Vector {
    if (!this.recording.bodies.turning) return [0, 0, 0];
    return this.rotationFrom(row, segment - 1).after(this.time[segment] - this.time[segment - 1]).angularVelocity;
  }

  angularVelocityAfter(segment: number): Vector {
    if (!this.recording.bodies.turning) return [0, 0, 0];
    return AXES.map((k) => this.angularVelocity[3 * segment + k]) as Vector;
  }

  private inverseMass(row: number): number {
    const { fixed, mass } = this.recording.bodies;
    return fixed[row] || !Number.isFinite(mass[row]) ? 0 : 1 / mass[row];
  }

  /** The last segment of body `row` that has begun at `time`; at an impact the one after it. */
  segmentAt(row: number, time: number): number {
    let low = this.first[row];
    let high = this.first[row + 1] - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.time[middle] <= time) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  /** Positions of all bodies at `time`, wrapped into a periodic box, into `out` (3 numbers a body). */
  positionsAt(time: number, out: Float64Array): void {
    const { bodies, gravity } = this.recording;
    const [gx, gy, gz] = gravity;
    const [lx, ly, lz] = this.period;
    const { position, velocity } = this;
    for (let row = 0; row < bodies.count; row++) {
      const s = this.segmentAt(row, time);
      const t = time - this.time[s];
      const h = bodies.fixed[row] ? 0 : 0.5 * t * t;
      const i = 3 * row;
      const j = 3 * s;
      out[i] = wrap(position[j] + velocity[j] * t + gx * h, lx);
      out[i + 1] = wrap(position[j + 1] + velocity[j + 1] * t + gy * h, ly);
      out[i + 2] = wrap(position[j + 2] + velocity[j + 2] * t + gz * h, lz);
    }
  }

  /** Velocity of body `row` at `time`, into `out`; at an impact the one after it. */
  velocityAt(row: number, time: number, out: Float64Array | number[] = [0, 0, 0]): typeof out {
    const s = this.segmentAt(row, time);
    const t = this.recording.bodies.fixed[row] ? 0 : time - this.time[s];
    for (const k of AXES) out[k] = this.velocity[3 * s + k] + this.recording.gravity[k] * t;
    return out;
  }

  /** Velocity just before segment `segment` of body `row` begins, that is before its impact. */
  velocityBefore(row: number, segment: number): [number, number, number] {
    const t = this.recording.bodies.fixed[row] ? 0 : this.time[segment] - this.time[segment - 1];
    return AXES.map((k) => this.velocity[3 * (segment - 1) + k] + this.recording.gravity[k] * t) as [number, number, number];
  }

  velocityAfter(segment: number): [number, number, number] {
    return AXES.map((k) => this.velocity[3 * segment + k]) as [number, number, number];
  }

  /**
   * How far the replay is from the recording: the largest distance, over all impacts, between a recorded contact point and
   * the place on the replayed ball's surface where it should lie (m); of other bodies, how far replayed and recorded
   * orientations leave their farthest points apart, at a thousand impacts. Rounding only, if the recording is whole.
   */
  largestMismatch(): number {
    if (Number.isNaN(this.mismatch)) this.mismatch = this.findMismatch();
    return this.mismatch;
  }

  private findMismatch(): number {
    const { impacts, bodies } = this.recording;
    let largest = 0;
    const turn = (row: number, segment: number) => {
      if (segment < 0) return;
      const replayed = this.rotationFrom(row, segment - 1).after(this.time[segment] - this.time[segment - 1]).orientation;
      const recorded = product([0, 1, 2, 3].map((k) => this.orientation[4 * segment + k]) as Quaternion, this.principal(row));
      largest = Math.max(largest, angleBetween(recorded, replayed) * bodies.radius[row]);
    };
    const look = (impact: number, row: number, segment: number, side: number) => {
      if (segment < 0 || !(bodies.radius[row] > 0) || (bodies.turning?.geometry[row] ?? -1) >= 0) return;
      let squared = 0;
      for (const k of AXES) {
        const surface = this.position[3 * segment + k] - side * bodies.radius[row] * impacts.normal[3 * impact + k];
        const gap = wrap(surface - impacts.point[3 * impact + k], this.period[k]);
        squared += gap * gap;
      }
      largest = Math.max(largest, Math.sqrt(squared));
    };
    for (let i = 0; i < impacts.count; i++) {
      look(i, this.rowA[i], this.segmentA[i], 1);
      look(i, this.rowB[i], this.segmentB[i], -1);
    }
    if (bodies.turning && impacts.turns) {
      const step = Math.max(1, Math.floor(impacts.count / TURNS_LOOKED_AT));
      for (let i = 0; i < impacts.count; i += step) {
        turn(this.rowA[i], this.segmentA[i]);
        turn(this.rowB[i], this.segmentB[i]);
      }
    }
    return largest;
  }
}

/** x in a box of the given period centred on 0; unchanged if the period is 0. */
export function wrap(x: number, period: number): number {
  return period > 0 ? x - period * Math.round(x / period) : x;
}

/** Index of the last entry of sorted `times` at or before `time`; −1 if there is none. */
export function lastAtOrBefore(times: ArrayLike<number>, time: number): number {
  let low = -1;
  let high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= time) low = middle;
    else high = middle - 1;
  }
  return low;
}
