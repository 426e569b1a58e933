// Where every body is at any time: the same closed form as the simulator's, nothing integrated, nothing interpolated.
//
// Between impacts a body flies x = x0 + v t + g t²/2. Its path is a list of segments, one for the start and one for each
// of its impacts; all segments stand in flat arrays, those of one body side by side, so any time is found by bisection.

import { AXES, rowsById, type Recording } from "./recording";

export class Flight {
  /** Segments of body `row` are first[row] … first[row + 1] − 1. */
  readonly first: Int32Array;
  /** Of each segment: when it begins, and position and velocity there. */
  readonly time: Float64Array;
  readonly position: Float64Array;
  readonly velocity: Float64Array;
  /** Of each impact: the segment of A and of B that begins with it; −1 for what is not a body (a plane). */
  readonly segmentA: Int32Array;
  readonly segmentB: Int32Array;
  /** Of each impact: the rows of A and B, −1 for a plane. */
  readonly rowA: Int32Array;
  readonly rowB: Int32Array;
  /** Periods by axis; 0 where space does not wrap. */
  readonly period: [number, number, number];

  private readonly recording: Recording;

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
    this.segmentA = new Int32Array(m).fill(-1);
    this.segmentB = new Int32Array(m).fill(-1);

    const last = this.first.slice(0, n);
    for (let row = 0; row < n; row++) {
      for (const k of AXES) {
        this.position[3 * last[row] + k] = bodies.position[3 * row + k];
        this.velocity[3 * last[row] + k] = bodies.velocity[3 * row + k];
      }
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
      if (a >= 0) this.segmentA[i] = strike(a, t, i, impacts.impulse[i] * this.inverseMass(a));
      if (b >= 0) this.segmentB[i] = strike(b, t, i, -impacts.impulse[i] * this.inverseMass(b));
    }
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
   * the place on the replayed ball's surface where it should lie (m). Rounding only, if the recording is whole.
   */
  largestMismatch(): number {
    const { impacts, bodies } = this.recording;
    let largest = 0;
    const look = (impact: number, row: number, segment: number, side: number) => {
      if (segment < 0 || !(bodies.radius[row] > 0)) return;
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
