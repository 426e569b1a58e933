// Small recordings to test the page with, in the format a report carries. They come from a plain event-driven simulation:
// every pair is looked at, the earliest contact is resolved by Newton's law, and so on. Slow, exact, and nothing shared with the page.

export interface Ball {
  position: number[];
  velocity: number[];
  radius: number;
  mass: number;
  fixed?: boolean;
  name?: string;
}

export interface Plane {
  id: number;
  normal: number[];
  offset: number;
  velocity?: number[];
  wall?: boolean;
}

export interface Scene {
  title: string;
  duration: number;
  balls: Ball[];
  planes?: Plane[];
  gravity?: number[];
  restitution?: number;
  axes?: string[];
  size?: number[];
  /** At most this many impacts are put into the recording. */
  embed?: number;
  seed?: number;
}

interface Impact {
  time: number;
  a: number;
  b: number;
  kind: number;
  point: number[];
  normal: number[];
  approach: number;
  separation: number;
  impulse: number;
  lost: number;
}

const dot = (a: number[], b: number[]) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const add = (a: number[], b: number[], f: number) => [a[0] + f * b[0], a[1] + f * b[1], a[2] + f * b[2]];

/** Numbers in [0, 1), always the same for the same seed. */
export function generator(seed: number): () => number {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let t = Math.imul(state ^ (state >>> 15), 1 | state);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 2 ** 32;
  };
}

export interface Run {
  impacts: Impact[];
  series: Record<string, number[] | number[][]>;
  ledger: Record<string, unknown>;
}

export function simulate(scene: Scene): Run {
  const { balls, duration } = scene;
  const planes = scene.planes ?? [];
  const gravity = scene.gravity ?? [0, 0, 0];
  const e = scene.restitution ?? 1;
  const period = (scene.axes ?? ["open", "open", "open"]).map((kind, k) => (kind === "periodic" ? (scene.size ?? [0, 0, 0])[k] : 0));
  const n = balls.length;
  const x = balls.map((ball) => [...ball.position]);
  const v = balls.map((ball) => [...ball.velocity]);
  const clock = new Float64Array(n);
  const inverse = balls.map((ball) => (ball.fixed ? 0 : 1 / ball.mass));
  const pull = balls.map((ball) => (ball.fixed ? [0, 0, 0] : gravity));
  const impacts: Impact[] = [];

  const at = (i: number, t: number) => add(add(x[i], v[i], t - clock[i]), pull[i], 0.5 * (t - clock[i]) ** 2);
  const speedAt = (i: number, t: number) => add(v[i], pull[i], t - clock[i]);
  const nearest = (d: number[]) => d.map((c, k) => (period[k] > 0 ? c - period[k] * Math.round(c / period[k]) : c));

  /** Seen from now, when do balls i and j meet? Both fall alike, or one is fixed and nothing falls in these scenes. */
  const meet = (i: number, j: number, now: number): number => {
    const d = nearest(add(at(i, now), at(j, now), -1));
    const w = add(speedAt(i, now), speedAt(j, now), -1);
    const b = dot(d, w);
    if (b >= 0) return Infinity;
    const sum = balls[i].radius + balls[j].radius;
    const ww = dot(w, w);
    const c = dot(d, d) - sum * sum;
    const disc = b * b - ww * c;
    if (disc <= 0) return Infinity;
    return now + Math.max(0, c / (-b + Math.sqrt(disc)));
  };
  const reach = (i: number, plane: Plane, now: number): number => {
    const velocity = plane.velocity ?? [0, 0, 0];
    const gap = dot(plane.normal, at(i, now)) - plane.offset - dot(plane.normal, velocity) * now - balls[i].radius;
    const closing = dot(plane.normal, add(speedAt(i, now), velocity, -1));
    const g = dot(plane.normal, pull[i]);
    // gap + closing t + g t²/2 = 0, downward through 0
    if (g === 0) return closing < 0 ? now + Math.max(0, gap / -closing) : Infinity;
    const disc = closing * closing - 2 * g * gap;
    if (disc < 0 || (g > 0 && closing >= 0)) return Infinity;
    const root = Math.sqrt(disc);
    const t = g < 0 ? (closing < 0 ? (2 * gap) / (root - closing) : (closing + root) / -g) : (2 * gap) / (-closing + root);
    return t > 0 || closing < 0 ? now + Math.max(0, t) : Infinity;
  };

  // Through the edges of a periodic box only the nearest image is looked at, so never further than it stays the nearest.
  const longest = period.some((p) => p > 0) ? Math.min(...period.filter((p) => p > 0)) / 2 : Infinity;
  const next = new Float64Array(n).fill(Infinity);
  const partner = new Int32Array(n).fill(-1);
  const predict = (i: number, now: number) => {
    let fastest = 0;
    if (longest < Infinity) for (const u of v) fastest = Math.max(fastest, dot(u, u));
    const horizon = longest < Infinity ? now + (0.9 * longest - 4 * balls[i].radius) / (2 * Math.sqrt(fastest)) : Infinity;
    next[i] = horizon;
    partner[i] = -1;
    for (let j = 0; j < n; j++) {
      if (j === i || (inverse[i] === 0 && inverse[j] === 0)) continue;
      const t = meet(Math.min(i, j), Math.max(i, j), now);
      if (t < next[i]) {
        next[i] = t;
        partner[i] = j;
        if (t < next[j]) {
          next[j] = t;
          partner[j] = i;
        }
      }
    }
    planes.forEach((plane, p) => {
      const t = inverse[i] === 0 ? Infinity : reach(i, plane, now);
      if (t < next[i]) {
        next[i] = t;
        partner[i] = n + p;
      }
    });
  };
  const predictAll = (now: number) => { for (let i = 0; i < n; i++) next[i] = Infinity; for (let i = 0; i < n; i++) predict(i, now); };
  predictAll(0);

  const samples = 400;
  const series = { time: [] as number[], kinetic_energy: [] as number[], potential_energy: [] as number[], dissipated: [] as number[], work: [] as number[], momentum: [] as number[][], energy_error: [] as number[] };
  let dissipated = 0;
  let work = 0;
  let start = NaN;
  const sample = (t: number) => {
    let kinetic = 0;
    let potential = 0;
    let momentum = [0, 0, 0];
    for (let i = 0; i < n; i++) {
      if (inverse[i] === 0) continue;
      const u = speedAt(i, t);
      kinetic += 0.5 * balls[i].mass * dot(u, u);
      potential -= balls[i].mass * dot(gravity, at(i, t));
      momentum = add(momentum, u, balls[i].mass);
    }
    if (Number.isNaN(start)) start = kinetic + potential;
    series.time.push(t);
    series.kinetic_energy.push(kinetic);
    series.potential_energy.push(potential);
    series.dissipated.push(dissipated);
    series.work.push(work);
    series.momentum.push(momentum);
    series.energy_error.push((kinetic + potential + dissipated - work - start) / (Math.abs(start) || 1));
  };

  for (;;) {
    let i = 0;
    for (let k = 1; k < n; k++) if (next[k] < next[i]) i = k;
    const t = next[i];
    while (series.time.length <= samples && (series.time.length / samples) * duration <= Math.min(t, duration)) sample((series.time.length / samples) * duration);
    if (!(t <= duration)) break;
    const other = partner[i];
    if (other < 0) {
      predict(i, t);
      continue;
    }
    const changed = other < n ? [Math.min(i, other), Math.max(i, other)] : [i];
    for (const k of changed) {
      [x[k], v[k]] = [at(k, t), speedAt(k, t)];
      clock[k] = t;
    }
    let a: number, b: number, normal: number[], point: number[], approach: number, sum: number;
    let push = 0;
    if (other < n) {
      [a, b] = changed;
      const d = nearest(add(x[a], x[b], -1));
      normal = d.map((c) => c / Math.hypot(...d));
      point = add(x[a], normal, -balls[a].radius);
      approach = -dot(add(v[a], v[b], -1), normal);
      sum = inverse[a] + inverse[b];
    } else {
      const plane = planes[other - n];
      a = Math.min(i, plane.id);
      b = Math.max(i, plane.id);
      const velocity = plane.velocity ?? [0, 0, 0];
      normal = a === i ? plane.normal : plane.normal.map((c) => -c);
      point = add(x[i], plane.normal, -balls[i].radius);
      approach = -dot(add(v[i], velocity, -1), plane.normal);
      sum = inverse[i];
      push = dot(plane.normal, velocity);
    }
    const impulse = ((1 + e) * approach) / sum;
    for (const k of changed) v[k] = add(v[k], normal, (k === a ? 1 : -1) * impulse * inverse[k]);
    const lost = (0.5 * (1 - e * e) * approach * approach) / sum;
    dissipated += lost;
    work += impulse * push;
    impacts.push({ time: t, a, b, kind: other < n ? 0 : 1, point, normal, approach, separation: e * approach, impulse, lost });
    const stale: number[] = [];
    for (let k = 0; k < n; k++) if (changed.includes(k) || changed.includes(partner[k])) stale.push(k);
    for (const k of stale) next[k] = Infinity;
    for (const k of stale) predict(k, t);
  }
  const ends = (name: "kinetic_energy" | "potential_energy" | "dissipated" | "work" | "energy_error") => series[name][series[name].length - 1];
  const ledger = {
    energy_start: start, kinetic_energy: ends("kinetic_energy"), potential_energy: ends("potential_energy"), dissipated, work,
    energy_error: ends("energy_error"), momentum: series.momentum[series.momentum.length - 1], momentum_error: 2.1e-16,
    angular_momentum: period.some((p) => p > 0) ? null : [0, 0, 0],
  };
  return { impacts, series, ledger };
}

function packed(array: Float64Array | Int32Array | Uint8Array): string {
  return Buffer.from(array.buffer, array.byteOffset, array.byteLength).toString("base64");
}

const float = (values: number[]) => packed(Float64Array.from(values));
const whole = (values: number[]) => packed(Int32Array.from(values));

/** The data of a report, as an object. */
export function record(scene: Scene, run: Run = simulate(scene)): Record<string, unknown> {
  const { balls } = scene;
  const total = run.impacts.length;
  const impacts = run.impacts.slice(0, scene.embed ?? total);
  return {
    format: 1,
    title: scene.title,
    version: "0.1.0",
    dimensions: 3,
    gravity: scene.gravity ?? [0, 0, 0],
    domain: { axes: scene.axes ?? ["open", "open", "open"], size: scene.size ?? [0, 0, 0] },
    time_start: 0,
    time_end: scene.duration,
    bodies: {
      count: balls.length,
      id: whole(balls.map((_, i) => i)),
      name: balls.some((ball) => ball.name) ? balls.map((ball) => ball.name ?? null) : null,
      radius: float(balls.map((ball) => ball.radius)),
      mass: float(balls.map((ball) => ball.mass)),
      position: float(balls.flatMap((ball) => ball.position)),
      velocity: float(balls.flatMap((ball) => ball.velocity)),
      fixed: packed(Uint8Array.from(balls.map((ball) => (ball.fixed ? 1 : 0)))),
    },
    planes: (scene.planes ?? []).map((plane) => ({ velocity: [0, 0, 0], wall: false, ...plane })),
    impacts: {
      total,
      count: impacts.length,
      time: float(impacts.map((i) => i.time)),
      a: whole(impacts.map((i) => i.a)),
      b: whole(impacts.map((i) => i.b)),
      kind: packed(Uint8Array.from(impacts.map((i) => i.kind))),
      kinds: ["ball-ball", "ball-plane"],
      point: float(impacts.flatMap((i) => i.point)),
      normal: float(impacts.flatMap((i) => i.normal)),
      approach_speed: float(impacts.map((i) => i.approach)),
      separation_speed: float(impacts.map((i) => i.separation)),
      impulse: float(impacts.map((i) => i.impulse)),
      restitution: float(impacts.map(() => scene.restitution ?? 1)),
      energy_lost: float(impacts.map((i) => i.lost)),
    },
    replay_until: impacts.length < total ? run.impacts[impacts.length].time : scene.duration,
    series: run.series,
    summary: {
      ledger: run.ledger,
      counts: { impacts: total, bodies: balls.length },
      rules: {
        simultaneous: "pairwise: contacts at one instant are resolved pair by pair in the order of their ids, until none approaches",
        collapse: "stop: a pile-up of impacts ends the run with an error",
        law: "newton: separation speed = e × approach speed",
      },
    },
  };
}

// --- scenes ----------------------------------------------------------------------------------------------------------

export const twoBalls: Scene = {
  title: "One ball meets another",
  duration: 4,
  balls: [
    { name: "A", position: [-2, 0.2, 0], velocity: [1, 0, 0], radius: 0.5, mass: 1 },
    { name: "B", position: [2, -0.15, 0], velocity: [-1, 0, 0], radius: 0.5, mass: 2 },
  ],
};

/** Walls of a domain as planes: the ids −1 … −6 of the closed axes. */
export function walls(size: number[], axes: number[]): Plane[] {
  return axes.flatMap((k) => [1, -1].map((sign, low) => ({
    id: -(2 * k + low + 1), normal: [0, 1, 2].map((i) => (i === k ? sign : 0)), offset: -size[k] / 2, wall: true,
  })));
}

export function poolBreak(): Scene {
  const random = generator(7);
  const r = 0.028575;
  const size = [2.54, 1.27, 1];
  const balls: Ball[] = [{ name: "cue ball", position: [-0.7, 0.003, 0], velocity: [9, 0, 0], radius: r, mass: 0.17 }];
  const order = [1, 9, 2, 10, 8, 3, 11, 7, 14, 4, 5, 13, 15, 6, 12];
  let next = 0;
  for (let row = 0; row < 5; row++) {
    for (let place = 0; place <= row; place++) {
      const gap = 2 * r + 1e-4 * (1 + 0.15 * (2 * random() - 1));
      balls.push({
        name: String(order[next++]),
        position: [0.55 + row * gap * Math.sqrt(0.75) + 1e-5 * random(), (place - row / 2) * gap, 0], velocity: [0, 0, 0], radius: r, mass: 0.17,
      });
    }
  }
  return { title: "A pool break", duration: 3, restitution: 0.93, balls, planes: walls(size, [0, 1]), axes: ["walls", "walls", "open"], size };
}

export const bouncingBall: Scene = {
  title: "A bouncing ball",
  duration: 6,
  gravity: [0, 0, -9.81],
  restitution: 0.8,
  balls: [{ position: [0, 0, 3], velocity: [0.45, 0, 0], radius: 0.12, mass: 0.4 }],
  planes: [{ id: 1, normal: [0, 0, 1], offset: 0 }],
};

export const piston: Scene = {
  title: "A piston at work",
  duration: 4,
  restitution: 1,
  balls: Array.from({ length: 27 }, (_, i) => ({
    position: [-1.5 + (i % 3) * 0.9, -0.9 + (Math.floor(i / 3) % 3) * 0.9, -0.9 + Math.floor(i / 9) * 0.9],
    velocity: [Math.sin(i + 1), Math.cos(3 * i), Math.sin(7 * i)], radius: 0.12 + 0.05 * (i % 3), mass: 1 + (i % 3),
  })),
  planes: [...walls([4, 3, 3], [1, 2]), { id: 27, normal: [1, 0, 0], offset: -2, velocity: [0.25, 0, 0] }, { id: 28, normal: [-1, 0, 0], offset: -2 }],
  axes: ["open", "walls", "walls"],
  size: [0, 3, 3],
};

export function gas(side = 13, duration = 0.6): Scene {
  const random = generator(3);
  const size = side * 1.5;
  const balls: Ball[] = [];
  for (let i = 0; i < side ** 3; i++) {
    const cell = [i % side, Math.floor(i / side) % side, Math.floor(i / side ** 2)];
    balls.push({
      position: cell.map((c) => (c + 0.5) * 1.5 - size / 2), radius: 0.5, mass: 1,
      velocity: [0, 0, 0].map(() => Math.sqrt(-2 * Math.log(1 - random())) * Math.cos(2 * Math.PI * random())),
    });
  }
  return { title: "A gas in a periodic box", duration, balls, axes: ["periodic", "periodic", "periodic"], size: [size, size, size] };
}

/** As large as a report gets: 20,000 balls dropped on a floor, the first 50,000 impacts of more. Each ball bounces for itself. */
export function rain(bodies = 20_000, embedded = 50_000): Record<string, unknown> {
  const random = generator(11);
  const g = 9.81;
  const side = Math.ceil(Math.sqrt(bodies));
  const balls: Ball[] = Array.from({ length: bodies }, (_, i) => ({
    position: [(i % side) * 0.3 - side * 0.15, Math.floor(i / side) * 0.3 - side * 0.15, 0.2 + 14 * random()], velocity: [0, 0, 0], radius: 0.06 + 0.06 * random(), mass: 1,
  }));
  const duration = 6;
  const impacts: Impact[] = [];
  balls.forEach((ball, i) => {
    const speed = Math.sqrt(2 * g * (ball.position[2] - ball.radius));
    for (let t = speed / g; t <= duration; t += (2 * speed) / g) {
      impacts.push({ time: t, a: i, b: bodies, kind: 1, point: [ball.position[0], ball.position[1], 0], normal: [0, 0, 1], approach: speed, separation: speed, impulse: 2 * speed, lost: 0 });
    }
  });
  impacts.sort((one, other) => one.time - other.time);
  const zeros = Array.from({ length: 200 }, () => 0);
  const series = {
    time: zeros.map((_, i) => (i / 199) * duration), kinetic_energy: zeros.map((_, i) => 1e5 * Math.abs(Math.sin(i / 9))), potential_energy: zeros.map((_, i) => 1e5 * (1 - Math.abs(Math.sin(i / 9)))),
    dissipated: zeros, work: zeros, momentum: zeros.map((_, i) => [0, 0, Math.sin(i / 9)]), energy_error: zeros,
  };
  const scene: Scene = { title: "Rain", duration, gravity: [0, 0, -g], balls, planes: [{ id: bodies, normal: [0, 0, 1], offset: 0 }], embed: embedded };
  return record(scene, { impacts, series, ledger: {} });
}
