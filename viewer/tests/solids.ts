// Small recordings with bodies of every shape. What flies is the page's own closed form, which has its own test; what
// happens at the floor is found the plain way, by looking often and halving, and resolved by the law of impact.

import { readFileSync } from "node:fs";
import { conjugate, rotated } from "../src/quaternions";
import type { Quaternion, Vector } from "../src/recording";
import { freeRotation } from "../src/rotation";
import { generator } from "./samples";

interface PartData {
  kind: string;
  position?: Vector;
  orientation?: Quaternion;
  radius?: number;
  length?: number;
  semi_axes?: Vector;
  vertices?: Vector[];
  faces?: number[][];
}

export interface Solid {
  /** Place in the list of shapes; −1 for a ball of `radius`. */
  shape: number;
  position: Vector;
  velocity?: Vector;
  orientation?: Quaternion;
  angularVelocity?: Vector;
  moments?: Vector;
  mass?: number;
  radius?: number;
  name?: string;
  fixed?: boolean;
}

interface Impact {
  time: number;
  a: number;
  b: number;
  kind: string;
  point: Vector;
  normal: Vector;
  approach: number;
  impulse: number;
  restitution: number;
  lost: number;
  /** Orientation and angular velocity of a and b after it. */
  turns: [Quaternion, Vector, Quaternion, Vector];
}

export interface SolidScene {
  title: string;
  duration: number;
  shapes: PartData[][];
  bodies: Solid[];
  gravity?: Vector;
  floor?: number;
  restitution?: number;
  meshes?: { id: number; name?: string; vertices: Vector[]; triangles: number[][]; angularVelocity?: Vector }[];
  impacts?: Impact[];
  axes?: string[];
  size?: number[];
  dimensions?: number;
}

const REST: Quaternion = [1, 0, 0, 0];
const add = (a: Vector, b: Vector, f = 1): Vector => [a[0] + f * b[0], a[1] + f * b[1], a[2] + f * b[2]];
const cross = (a: Vector, b: Vector): Vector => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

// --- shapes ----------------------------------------------------------------------------------------------------------

export function box(x: number, y: number, z: number): PartData {
  const vertices: Vector[] = [];
  for (const sx of [-0.5, 0.5]) for (const sy of [-0.5, 0.5]) for (const sz of [-0.5, 0.5]) vertices.push([sx * x, sy * y, sz * z]);
  return { kind: "polyhedron", vertices, faces: [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]] };
}

/** Faces of the hull of a few points, the slow way: every plane through three of them that has all others behind it. */
export function hull(vertices: Vector[]): PartData {
  const faces = new Map<string, number[]>();
  const n = vertices.length;
  for (let i = 0; i < n; i++) for (let j = 0; j < n; j++) for (let k = 0; k < n; k++) {
    if (i === j || j === k || k === i) continue;
    const normal = cross(add(vertices[j], vertices[i], -1), add(vertices[k], vertices[i], -1));
    const long = Math.hypot(...normal);
    if (long < 1e-9) continue;
    const heights = vertices.map((v) => add(v, vertices[i], -1).reduce((sum, c, m) => sum + (c * normal[m]) / long, 0));
    if (heights.some((h) => h > 1e-9)) continue;
    const corners = heights.flatMap((h, m) => (h > -1e-9 ? [m] : []));
    const key = corners.join();
    if (faces.has(key)) continue;
    const centre = corners.reduce<Vector>((sum, m) => add(sum, vertices[m], 1 / corners.length), [0, 0, 0]);
    const axis = add(vertices[corners[0]], centre, -1);
    const other = cross(normal, axis).map((c) => c / long) as Vector;
    const angle = (m: number) => {
      const d = add(vertices[m], centre, -1);
      return Math.atan2(d.reduce((sum, c, q) => sum + c * other[q], 0), d.reduce((sum, c, q) => sum + c * axis[q], 0));
    };
    faces.set(key, corners.sort((p, q) => angle(p) - angle(q)));
  }
  return { kind: "polyhedron", vertices, faces: [...faces.values()] };
}

const golden = (1 + Math.sqrt(5)) / 2;
const cyclic = (a: number, b: number, c: number): Vector[] => [[a, b, c], [b, c, a], [c, a, b]];
const signs = [1, -1].flatMap((p) => [1, -1].map((q) => [p, q]));
export const tetrahedron = (r: number): PartData => hull(([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]] as Vector[]).map((v) => v.map((c) => (c * r) / Math.sqrt(3)) as Vector));
export const octahedron = (r: number): PartData => hull([1, -1].flatMap((s) => cyclic(s * r, 0, 0)));
export const icosahedron = (r: number): PartData => hull(signs.flatMap(([p, q]) => cyclic(0, p, q * golden)).map((v) => v.map((c) => (c * r) / Math.hypot(1, golden)) as Vector));
export const dodecahedron = (r: number): PartData => hull(
  [...signs.flatMap(([p, q]) => [[1, p, q], [-1, p, q]] as Vector[]), ...signs.flatMap(([p, q]) => cyclic(0, p / golden, q * golden))]
    .map((v) => v.map((c) => (c * r) / Math.sqrt(3)) as Vector));
export const capsule = (radius: number, length: number): PartData => ({ kind: "capsule", radius, length });
export const cylinder = (radius: number, length: number): PartData => ({ kind: "cylinder", radius, length });
export const ellipsoid = (a: number, b: number, c: number): PartData => ({ kind: "ellipsoid", semi_axes: [a, b, c] });
export const ball = (radius: number, position: Vector = [0, 0, 0]): PartData => ({ kind: "ball", radius, position });

/** The point of a part farthest along a direction, both in the frame of the shape. */
function support(part: PartData, direction: Vector): Vector {
  const d = rotated(conjugate(part.orientation ?? REST), direction);
  const long = Math.hypot(...d);
  const along = (r: number): Vector => d.map((c) => (r * c) / long) as Vector;
  const end = 0.5 * (part.length ?? 0) * Math.sign(d[2]);
  let at: Vector;
  if (part.kind === "polyhedron") {
    const reach = (v: Vector) => v[0] * d[0] + v[1] * d[1] + v[2] * d[2];
    at = (part.vertices ?? []).reduce((best, v) => (reach(v) > reach(best) ? v : best));
  } else if (part.kind === "ellipsoid") {
    const scaled = (part.semi_axes ?? [1, 1, 1]).map((a, k) => a * d[k]);
    at = (part.semi_axes ?? [1, 1, 1]).map((a, k) => (a * scaled[k]) / Math.hypot(...scaled)) as Vector;
  } else if (part.kind === "cylinder") {
    const wide = Math.hypot(d[0], d[1]) || 1;
    at = [((part.radius ?? 0) * d[0]) / wide, ((part.radius ?? 0) * d[1]) / wide, end];
  } else {
    at = add(along(part.radius ?? 0), [0, 0, end]);
  }
  return add(rotated(part.orientation ?? REST, at), part.position ?? [0, 0, 0]);
}

export function reach(parts: PartData[]): number {
  let most = 0;
  for (const part of parts) {
    const points = part.kind === "polyhedron" ? part.vertices ?? [] : [[0, 0, 1], [0, 0, -1], [1, 0, 0], [0, 1, 0], [1, 0, 1], [-1, 0, -1]].map((d) => support(part, rotated(part.orientation ?? REST, d as Vector)));
    for (const point of points) most = Math.max(most, Math.hypot(...(part.kind === "polyhedron" ? add(point, part.position ?? [0, 0, 0]) : point)));
  }
  return most;
}

// --- bouncing on a floor ---------------------------------------------------------------------------------------------

/** Lets each body bounce on the floor for itself. */
export function bounce(scene: SolidScene): Impact[] {
  const { bodies, shapes, duration } = scene;
  const gravity = scene.gravity ?? [0, 0, 0];
  const floor = scene.floor ?? 0;
  const e = scene.restitution ?? 1;
  const impacts: Impact[] = [];
  bodies.forEach((body, row) => {
    if (body.shape < 0 || body.fixed) return;
    const parts = shapes[body.shape];
    const moments = body.moments ?? [1, 1, 1];
    const mass = body.mass ?? 1;
    let [t, x, v] = [0, body.position, body.velocity ?? [0, 0, 0] as Vector];
    let rotation = freeRotation(moments, body.orientation ?? REST, body.angularVelocity ?? [0, 0, 0]);
    for (let count = 0; count < 200; count++) {
      const lowest = (dt: number): [Vector, number] => {
        const { orientation } = rotation.after(dt);
        const centre = add(add(x, v, dt), gravity, 0.5 * dt * dt);
        const down = rotated(conjugate(orientation), [0, 0, -1]);
        const points = parts.map((part) => add(centre, rotated(orientation, support(part, down))));
        const point = points.reduce((best, p) => (p[2] < best[2] ? p : best));
        return [point, point[2] - floor];
      };
      const step = 0.004;
      let low = step;
      while (low < duration - t && !(lowest(low)[1] > 1e-9 && lowest(low + step)[1] <= 0)) low += step;
      if (low >= duration - t) break;
      let high = low + step;
      for (let i = 0; i < 60; i++) {
        const middle = 0.5 * (low + high);
        if (lowest(middle)[1] > 0) low = middle;
        else high = middle;
      }
      const { orientation, angularVelocity } = rotation.after(low);
      const [point] = lowest(low);
      x = add(add(x, v, low), gravity, 0.5 * low * low);
      v = add(v, gravity, low);
      t += low;
      const arm = add(point, x, -1);
      const inverse = (m: Vector): Vector => rotated(orientation, rotated(conjugate(orientation), m).map((c, k) => c / moments[k]) as Vector);
      const lever = cross(arm, [0, 0, 1]);
      const approach = -(v[2] + cross(angularVelocity, arm)[2]);
      if (!(approach > 1e-6)) break;
      const effective = 1 / mass + cross(inverse(lever), arm)[2];
      const impulse = ((1 + e) * approach) / effective;
      v = add(v, [0, 0, 1], impulse / mass);
      const spin = add(angularVelocity, inverse(lever), impulse);
      rotation = freeRotation(moments, orientation, spin);
      impacts.push({
        time: t, a: row, b: bodies.length, kind: "vertex-plane", point, normal: [0, 0, 1], approach, impulse, restitution: e,
        lost: (0.5 * (1 - e * e) * approach * approach) / effective, turns: [orientation, spin, REST, [0, 0, 0]],
      });
    }
  });
  return impacts.sort((one, other) => one.time - other.time);
}

// --- the data of a report --------------------------------------------------------------------------------------------

const packed = (array: Float64Array | Int32Array | Uint8Array) => Buffer.from(array.buffer, array.byteOffset, array.byteLength).toString("base64");
const float = (values: number[]) => packed(Float64Array.from(values));
const whole = (values: number[]) => packed(Int32Array.from(values));

/** `turns` false: the recording leaves orientations after impacts to the law of impact. */
export function recordSolids(scene: SolidScene, impacts = scene.impacts ?? (scene.floor === undefined ? [] : bounce(scene)), turns = true): Record<string, any> {
  const { bodies, shapes } = scene;
  const kinds = [...new Set(impacts.map((impact) => impact.kind)), "ball-ball"];
  const radii = bodies.map((body) => (body.shape < 0 ? body.radius ?? 0.5 : reach(shapes[body.shape])));
  const zeros = [0, scene.duration];
  return {
    format: 1, title: scene.title, version: "0.1.0", dimensions: scene.dimensions ?? 3, gravity: scene.gravity ?? [0, 0, 0],
    domain: { axes: scene.axes ?? ["open", "open", "open"], size: scene.size ?? [0, 0, 0] }, time_start: 0, time_end: scene.duration, replay_until: scene.duration,
    geometries: shapes.map((parts) => ({
      kind: parts.length > 1 ? "compound" : parts[0].kind, radius: reach(parts), principal_axes: REST,
      parts: parts.map((part) => ({ position: [0, 0, 0], orientation: REST, ...part })),
    })),
    meshes: (scene.meshes ?? []).map((mesh) => ({
      id: mesh.id, name: mesh.name, vertices: float(mesh.vertices.flat()), triangles: whole(mesh.triangles.flat()),
      position: [0, 0, 0], orientation: REST, velocity: [0, 0, 0], angular_velocity: mesh.angularVelocity ?? [0, 0, 0],
    })),
    bodies: {
      count: bodies.length, id: whole(bodies.map((_, i) => i)), name: bodies.some((body) => body.name) ? bodies.map((body) => body.name ?? null) : null,
      radius: float(radii), mass: float(bodies.map((body) => body.mass ?? 1)),
      position: float(bodies.flatMap((body) => body.position)), velocity: float(bodies.flatMap((body) => body.velocity ?? [0, 0, 0])),
      fixed: packed(Uint8Array.from(bodies.map((body) => (body.fixed ? 1 : 0)))),
      geometry: whole(bodies.map((body) => body.shape)), moments: float(bodies.flatMap((body) => body.moments ?? [1, 1, 1])),
      orientation: float(bodies.flatMap((body) => body.orientation ?? REST)), angular_velocity: float(bodies.flatMap((body) => body.angularVelocity ?? [0, 0, 0])),
    },
    planes: scene.floor === undefined ? [] : [{ id: bodies.length, normal: [0, 0, 1], offset: scene.floor, velocity: [0, 0, 0], wall: false }],
    impacts: {
      total: impacts.length, count: impacts.length, time: float(impacts.map((i) => i.time)), a: whole(impacts.map((i) => i.a)), b: whole(impacts.map((i) => i.b)),
      kind: packed(Uint8Array.from(impacts.map((i) => kinds.indexOf(i.kind)))), kinds, point: float(impacts.flatMap((i) => i.point)), normal: float(impacts.flatMap((i) => i.normal)),
      approach_speed: float(impacts.map((i) => i.approach)), separation_speed: float(impacts.map((i) => i.restitution * i.approach)),
      impulse: float(impacts.map((i) => i.impulse)), restitution: float(impacts.map((i) => i.restitution)), energy_lost: float(impacts.map((i) => i.lost)),
      ...(turns ? {
        orientation_a: float(impacts.flatMap((i) => i.turns[0])), angular_velocity_a: float(impacts.flatMap((i) => i.turns[1])),
        orientation_b: float(impacts.flatMap((i) => i.turns[2])), angular_velocity_b: float(impacts.flatMap((i) => i.turns[3])),
      } : {}),
    },
    series: { time: zeros, kinetic_energy: [1, 1], potential_energy: [0, 0], dissipated: [0, 0], work: [0, 0], momentum: [[0, 0, 0], [0, 0, 0]], energy_error: [0, 0] },
    summary: { ledger: { energy_start: 1, kinetic_energy: 1, potential_energy: 0, dissipated: 0, work: 0, energy_error: 1.2e-16, momentum: [0, 0, 0] }, counts: {}, rules: { law: "newton: v_AB·n after = -e v_AB·n before" } },
  };
}

/** How the simulator's own run of bodies of every convex shape ended (crates/carom/examples/turning_run.rs). */
export interface EngineRun {
  duration: number;
  geometries: Record<string, unknown>[];
  first: Solid[];
  impacts: Impact[];
  last: Required<Pick<Solid, "position" | "velocity" | "orientation" | "angularVelocity" | "shape">>[];
}

export const engineRun = (): EngineRun => JSON.parse(readFileSync(new URL("turning_run.json", import.meta.url), "utf8"));

/** That run as a recording. */
export function recordEngineRun(turns = true): Record<string, any> {
  const { duration, geometries, first, impacts } = engineRun();
  const scene: SolidScene = {
    title: "Bodies of every shape in a box", duration, gravity: [0, 0, -2], axes: ["walls", "walls", "walls"], size: [5, 5, 5],
    shapes: geometries.map((geometry) => geometry.parts as PartData[]), bodies: first,
  };
  return { ...recordSolids(scene, impacts, turns), geometries };
}

// --- scenes ----------------------------------------------------------------------------------------------------------

function anywhere(random: () => number): Quaternion {
  const q = [0, 0, 0, 0].map(() => 2 * random() - 1);
  const long = Math.hypot(...q);
  return q.map((c) => c / long) as Quaternion;
}

/** Every shape, side by side, each tumbling where it is. */
export function gallery(): SolidScene {
  const shapes: PartData[][] = [
    [box(1.5, 0.9, 0.5)], [tetrahedron(1)], [octahedron(0.95)], [dodecahedron(0.85)], [icosahedron(0.9)],
    [capsule(0.38, 1.1)], [cylinder(0.5, 1.2)], [ellipsoid(0.95, 0.6, 0.4)],
    [ball(0.42, [0, 0, 0.75]), ball(0.42, [0, 0, -0.75]), { ...cylinder(0.14, 1.5) }],
    [{ ...box(1.7, 0.4, 0.4), position: [0, 0, 0] }, { ...box(0.4, 1.7, 0.4) }, { ...box(0.4, 0.4, 1.7) }],
    [hull([[0.8, 0.1, 0], [-0.7, 0.5, 0.2], [-0.5, -0.7, 0.1], [0.2, -0.3, 0.9], [0.1, 0.4, -0.8], [0.4, -0.6, -0.5], [0.3, 0.8, 0.4], [-0.6, 0.1, -0.6]])],
  ];
  const random = generator(4);
  const bodies: Solid[] = shapes.map((_, i) => ({
    shape: i, position: [2.4 * ((i % 4) - 1.5), 0, 2.4 * (1 - Math.floor(i / 4))], orientation: anywhere(random), moments: [0.2, 0.3, 0.4],
    angularVelocity: [0, 0, 0].map(() => 3 * (random() - 0.5)) as Vector,
  }));
  bodies.push({ shape: -1, radius: 0.75, position: [2.4 * 1.5, 0, -2.4], angularVelocity: [1, 0.6, 2], orientation: anywhere(random) });
  return { title: "Every shape", duration: 8, shapes, bodies };
}

/** A ball strikes the end of a rod at rest: known in closed form. */
export function rodStruck(): SolidScene {
  // 1/m + r²/I = 1 + 0.25 · 12 = 4 for the rod, 1 for the ball: j = 2 · 2 / 5.
  return {
    title: "A ball strikes the end of a rod", duration: 4, shapes: [[capsule(0.08, 0.9)]],
    bodies: [
      { shape: -1, radius: 0.2, name: "ball", position: [-2, 0, 0.5], velocity: [2, 0, 0], mass: 1 },
      { shape: 0, name: "rod", position: [0, 0, 0], orientation: REST, moments: [1 / 12, 1 / 12, 0.002], mass: 1 },
    ],
    impacts: [{
      time: (2 - 0.28) / 2, a: 0, b: 1, kind: "ball-side", point: [-0.08, 0, 0.5], normal: [-1, 0, 0], approach: 2, impulse: 0.8, restitution: 1, lost: 0,
      turns: [REST, [0, 0, 0], REST, [0, 0.8 * 0.5 * 12, 0]],
    }],
  };
}

/** Dice of several kinds thrown on a floor. */
export function dice(): SolidScene {
  const random = generator(12);
  const shapes = [[box(1, 1, 1)], [tetrahedron(0.8)], [octahedron(0.75)], [dodecahedron(0.7)], [icosahedron(0.72)], [cylinder(0.5, 0.6)]];
  const bodies: Solid[] = Array.from({ length: 12 }, (_, i) => ({
    shape: i % 6, position: [2 * (i % 4) - 3, 2.4 * Math.floor(i / 4) - 2.4, 2.5 + 1.5 * random()], velocity: [0, 0, 0].map(() => 0.7 * (random() - 0.5)) as Vector,
    orientation: anywhere(random), angularVelocity: [0, 0, 0].map(() => 9 * (random() - 0.5)) as Vector, moments: i % 6 === 5 ? [0.1, 0.1, 0.13] : [0.16, 0.16, 0.16],
  }));
  return { title: "Dice of all kinds on a floor", duration: 4, gravity: [0, 0, -9.81], floor: 0, restitution: 0.9, shapes, bodies };
}

/** A thousand polyhedra fall on a floor. */
export function thousand(): SolidScene {
  const random = generator(2);
  const shapes = [[box(0.5, 0.4, 0.3)], [tetrahedron(0.35)], [octahedron(0.33)], [dodecahedron(0.3)], [icosahedron(0.3)]];
  const bodies: Solid[] = Array.from({ length: 1000 }, (_, i) => ({
    shape: i % 5, position: [(i % 10) - 4.5, (Math.floor(i / 10) % 10) - 4.5, 1 + Math.floor(i / 100)], velocity: [0, 0, 0].map(() => 0.4 * (random() - 0.5)) as Vector,
    orientation: anywhere(random), angularVelocity: [0, 0, 0].map(() => 6 * (random() - 0.5)) as Vector, moments: [0.02, 0.024, 0.028], mass: 1,
  }));
  return { title: "A thousand polyhedra", duration: 2, gravity: [0, 0, -9.81], floor: 0, shapes, bodies };
}

/** A funnel of triangles with bodies in it. */
export function funnel(): SolidScene {
  const n = 32;
  const ring = (radius: number, z: number): Vector[] => Array.from({ length: n }, (_, k) => [radius * Math.cos((2 * Math.PI * k) / n), radius * Math.sin((2 * Math.PI * k) / n), z]);
  const vertices = [...ring(3, 2.4), ...ring(0.8, 0), ...ring(0.8, -1.4)];
  const triangles: number[][] = [];
  for (let level = 0; level < 2; level++) for (let k = 0; k < n; k++) {
    const [a, b, c, d] = [level * n + k, level * n + ((k + 1) % n), (level + 1) * n + k, (level + 1) * n + ((k + 1) % n)];
    triangles.push([a, c, b], [b, c, d]);
  }
  const random = generator(8);
  const shapes = [[box(0.5, 0.5, 0.5)], [capsule(0.2, 0.5)], [ellipsoid(0.4, 0.28, 0.28)], [dodecahedron(0.35)]];
  const bodies: Solid[] = Array.from({ length: 10 }, (_, i) => ({
    shape: i % 4, position: [1.1 * Math.cos(i * 2.4) * (0.5 + i / 14), 1.1 * Math.sin(i * 2.4) * (0.5 + i / 14), 1.3 + 0.12 * i], velocity: [0, 0, -0.5 * random()],
    orientation: anywhere(random), angularVelocity: [0, 0, 0].map(() => 4 * (random() - 0.5)) as Vector, moments: [0.02, 0.024, 0.028],
  }));
  return { title: "A funnel", duration: 3, gravity: [0, 0, -1], shapes, bodies, meshes: [{ id: 99, name: "funnel", vertices, triangles }] };
}


/** Balls that spin, in a box. */
export function spinningPool(): SolidScene {
  const random = generator(21);
  const bodies: Solid[] = Array.from({ length: 15 }, (_, i) => ({
    shape: -1, radius: 0.3 + 0.25 * random(), position: [1.5 * (i % 5) - 3, 1.5 * Math.floor(i / 5) - 1.5, 0.6 * random()], velocity: [0, 0, 0].map(() => random() - 0.5) as Vector,
    orientation: anywhere(random), angularVelocity: i % 4 === 3 ? [0, 0, 0] : [0, 0, 0].map(() => 5 * (random() - 0.5)) as Vector,
  }));
  return { title: "Balls that spin", duration: 3, shapes: [], bodies };
}

/** Flat bodies on a table, seen from above. */
export function table(): SolidScene {
  const random = generator(31);
  const shapes = [[box(0.5, 0.3, 0.4)], [capsule(0.12, 0.4)].map((part) => ({ ...part, orientation: [Math.SQRT1_2, 0, Math.SQRT1_2, 0] as Quaternion })), [hull([0, 1, 2, 3, 4, 5].flatMap((k) => [-0.2, 0.2].map((z): Vector => [0.3 * Math.cos(k * Math.PI / 3), 0.3 * Math.sin(k * Math.PI / 3), z])))]];
  const bodies: Solid[] = Array.from({ length: 14 }, (_, i) => {
    const half = Math.PI * random();
    return {
      shape: i % 4 === 3 ? -1 : i % 4, radius: 0.2, position: [0.9 * (i % 5) - 1.8, 0.8 * Math.floor(i / 5) - 0.8, 0], velocity: [random() - 0.5, random() - 0.5, 0],
      orientation: [Math.cos(half), 0, 0, Math.sin(half)], angularVelocity: [0, 0, 4 * (random() - 0.5)], moments: [0.01, 0.02, 0.025],
    };
  });
  return { title: "Flat bodies on a table", duration: 3, dimensions: 2, shapes, bodies, axes: ["walls", "walls", "open"], size: [5, 3, 1] };
}
