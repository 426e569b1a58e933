// The surface of a shape as triangles, once for all bodies that have it.
//
// Besides place and normal each corner has two things that make turning visible: how far it is from the next edge that is
// drawn (0 on it), and a mark, three numbers of which the product's sign tells which of two tones a point has. Flat faces
// have one tone and edges; what is round has no edges and is painted in quarters or eighths.

import { rotated } from "./quaternions";
import type { Geometry, Part, Vector } from "./recording";

export interface Surface {
  /** Three corners a triangle, three numbers a corner, counter-clockwise seen from outside. */
  position: Float32Array;
  normal: Float32Array;
  edge: Float32Array;
  mark: Float32Array;
}

/** The mark of a flat face, which has one tone; a third number beyond 1 says that it is flat. */
const FLAT: Vector = [1, 1, 2];
/** Faces that meet at less than this are one bend surface, without an edge between them (cosine of 10°). */
const SMOOTH = 0.985;

class Builder {
  readonly position: number[] = [];
  readonly normal: number[] = [];
  readonly edge: number[] = [];
  readonly mark: number[] = [];

  constructor(private readonly part: Part) {}

  corner(at: Vector, normal: Vector, edge: number, mark: Vector): void {
    const turned = rotated(this.part.orientation, at);
    this.position.push(turned[0] + this.part.position[0], turned[1] + this.part.position[1], turned[2] + this.part.position[2]);
    this.normal.push(...rotated(this.part.orientation, normal));
    this.edge.push(edge);
    this.mark.push(...mark);
  }
}

const minus = (a: Vector, b: Vector): Vector => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const cross = (a: Vector, b: Vector): Vector => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const dot = (a: Vector, b: Vector): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const unit = (a: Vector): Vector => {
  const long = Math.hypot(...a) || 1;
  return [a[0] / long, a[1] / long, a[2] / long];
};

/** `segments` straight pieces a circle, a multiple of 4. */
export function surfaceOf(geometry: Geometry, segments = 48): Surface {
  const all: Surface[] = geometry.parts.map((part) => {
    const builder = new Builder(part);
    if (part.kind === "polyhedron") polyhedron(builder, part, geometry.radius);
    else if (part.kind === "cylinder") cylinder(builder, part, segments);
    else round(builder, part, geometry.radius, segments);
    return {
      position: Float32Array.from(builder.position), normal: Float32Array.from(builder.normal),
      edge: Float32Array.from(builder.edge), mark: Float32Array.from(builder.mark),
    };
  });
  if (all.length === 1) return all[0];
  const joined = (name: keyof Surface) => {
    const out = new Float32Array(all.reduce((sum, one) => sum + one[name].length, 0));
    let at = 0;
    for (const one of all) {
      out.set(one[name], at);
      at += one[name].length;
    }
    return out;
  };
  return { position: joined("position"), normal: joined("normal"), edge: joined("edge"), mark: joined("mark") };
}

function polyhedron(out: Builder, { vertices, faces }: Part, radius: number): void {
  const normals = faces.map((face) => {
    // Newell's: of all corners, so that a short side does no harm.
    let sum: Vector = [0, 0, 0];
    face.forEach((corner, k) => {
      const part = cross(minus(vertices[corner], vertices[face[0]]), minus(vertices[face[(k + 1) % face.length]], vertices[face[0]]));
      sum = [sum[0] + part[0], sum[1] + part[1], sum[2] + part[2]];
    });
    return unit(sum);
  });
  const across = new Map<string, number>();
  faces.forEach((face, f) => face.forEach((corner, k) => across.set(`${corner} ${face[(k + 1) % face.length]}`, f)));
  faces.forEach((face, f) => {
    const centre = face.reduce<Vector>((sum, corner) => [
      sum[0] + vertices[corner][0] / face.length, sum[1] + vertices[corner][1] / face.length, sum[2] + vertices[corner][2] / face.length,
    ], [0, 0, 0]);
    face.forEach((corner, k) => {
      const following = face[(k + 1) % face.length];
      const [a, b] = [vertices[corner], vertices[following]];
      const neighbour = across.get(`${following} ${corner}`);
      const drawn = neighbour === undefined || dot(normals[neighbour], normals[f]) < SMOOTH;
      const height = Math.hypot(...cross(minus(centre, a), unit(minus(b, a))));
      out.corner(centre, normals[f], drawn ? height : radius, FLAT);
      out.corner(a, normals[f], drawn ? 0 : radius, FLAT);
      out.corner(b, normals[f], drawn ? 0 : radius, FLAT);
    });
  });
}

/** A ring of quarters: angle k of the circle, and a corner of it. */
function circle(segments: number): [number, number][] {
  return Array.from({ length: segments + 1 }, (_, k) => {
    const angle = (2 * Math.PI * (k % segments)) / segments;
    return [Math.cos(angle), Math.sin(angle)];
  });
}

function cylinder(out: Builder, { radius, length }: Part, segments: number): void {
  const half = 0.5 * length;
  const turn = circle(segments);
  for (let k = 0; k < segments; k++) {
    const [p, q] = [turn[k], turn[k + 1]];
    const at = ([x, y]: [number, number], z: number): Vector => [radius * x, radius * y, z];
    const side = (which: [number, number], z: number) => out.corner(at(which, z), [which[0], which[1], 0], half - Math.abs(z), [which[0], which[1], 1]);
    for (const [low, high] of [[-half, 0], [0, half]]) {
      side(p, low); side(q, low); side(q, high);
      side(p, low); side(q, high); side(p, high);
    }
    for (const end of [1, -1]) {
      const rim = (which: [number, number]) => out.corner(at(which, end * half), [0, 0, end], 0, [which[0], which[1], 2]);
      out.corner([0, 0, end * half], [0, 0, end], radius, [0, 0, 2]);
      if (end > 0) { rim(p); rim(q); } else { rim(q); rim(p); }
    }
  }
}

/** Balls, ellipsoids and capsules: a ball's surface, stretched along the axes or pulled apart. */
function round(out: Builder, part: Part, size: number, segments: number): void {
  const axes: Vector = part.kind === "ellipsoid" ? part.semiAxes : [part.radius, part.radius, part.radius];
  const apart = part.kind === "capsule" ? 0.5 * part.length : 0;
  const turn = circle(segments);
  const rings = segments / 2;
  const corner = (ring: number, k: number, side: number) => {
    const angle = (Math.PI * ring) / rings;
    const rho = ring === 0 || ring === rings ? 0 : Math.sin(angle);
    const n: Vector = [rho * turn[k][0], rho * turn[k][1], -Math.cos(angle)];
    const normal = unit([n[0] / axes[0], n[1] / axes[1], n[2] / axes[2]]);
    const z = axes[2] * n[2] + side * apart;
    out.corner([axes[0] * n[0], axes[1] * n[1], z], normal, size, part.kind === "capsule" ? [n[0], n[1], 1] : n);
  };
  for (let ring = 0; ring < rings; ring++) {
    const side = ring < rings / 2 ? -1 : 1;
    for (let k = 0; k < segments; k++) {
      // At either pole one of the two is no triangle.
      if (ring > 0) { corner(ring, k, side); corner(ring, k + 1, side); corner(ring + 1, k + 1, side); }
      if (ring < rings - 1) { corner(ring, k, side); corner(ring + 1, k + 1, side); corner(ring + 1, k, side); }
    }
  }
  if (apart === 0) return;
  for (let k = 0; k < segments; k++) {
    const middle = rings / 2;
    corner(middle, k, -1); corner(middle, k + 1, -1); corner(middle, k + 1, 1);
    corner(middle, k, -1); corner(middle, k + 1, 1); corner(middle, k, 1);
  }
}

/** Along a ray from `from` (in the shape's frame), how far the first triangle is; infinite if it meets none. */
export function firstHit(surface: Surface, from: Vector, along: Vector): number {
  const p = surface.position;
  let first = Infinity;
  for (let i = 0; i < p.length; i += 9) {
    const a: Vector = [p[i], p[i + 1], p[i + 2]];
    const ab: Vector = [p[i + 3] - a[0], p[i + 4] - a[1], p[i + 5] - a[2]];
    const ac: Vector = [p[i + 6] - a[0], p[i + 7] - a[1], p[i + 8] - a[2]];
    const h = cross(along, ac);
    const det = dot(ab, h);
    if (det <= 0) continue;
    const to = minus(from, a);
    const u = dot(to, h);
    if (u < 0 || u > det) continue;
    const q = cross(to, ab);
    const v = dot(along, q);
    if (v < 0 || u + v > det) continue;
    const t = dot(ac, q) / det;
    if (t > 0 && t < first) first = t;
  }
  return first;
}
