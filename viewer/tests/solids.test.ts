import { describe, expect, it } from "vitest";
import { Flight } from "../src/flight";
import { angleBetween } from "../src/quaternions";
import { parseRecording, RecordingError, type Geometry, type Quaternion, type Recording, type Vector } from "../src/recording";
import { freeRotation } from "../src/rotation";
import { firstHit, surfaceOf } from "../src/shapes";
import { dice, engineRun, funnel, gallery, recordEngineRun, recordSolids, rodStruck, type SolidScene } from "./solids";

const read = (scene: SolidScene, turns = true): Recording => parseRecording(JSON.stringify(recordSolids(scene, undefined, turns)));

function volume(position: Float32Array): number {
  let six = 0;
  for (let i = 0; i < position.length; i += 9) {
    const [ax, ay, az, bx, by, bz, cx, cy, cz] = position.subarray(i, i + 9);
    six += ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx);
  }
  return six / 6;
}

describe("shapes", () => {
  const { geometries } = read(gallery());
  const names = geometries.map((geometry, i): [string, Geometry] => [`${i} ${geometry.kind}`, geometry]);

  it.each(names)("%s: a closed surface that faces outwards", (_, geometry) => {
    const { position, normal, edge, mark } = surfaceOf(geometry);
    expect(position.length % 9).toBe(0);
    expect([normal.length, edge.length, mark.length]).toEqual([position.length, position.length / 3, position.length]);
    const sides = new Map<string, number>();
    const key = (i: number) => [...position.subarray(3 * i, 3 * i + 3)].map((x) => Math.round(x * 1e5)).join();
    for (let i = 0; i < position.length / 3; i += 3) for (let k = 0; k < 3; k++) {
      const side = `${key(i + k)} ${key(i + ((k + 1) % 3))}`;
      sides.set(side, (sides.get(side) ?? 0) + 1);
    }
    // Each side of a triangle is met by the same side the other way round.
    for (const [side, count] of sides) expect(sides.get(side.split(" ").reverse().join(" "))).toBe(count);
    for (let i = 0; i < normal.length; i += 3) expect(Math.hypot(...normal.subarray(i, i + 3))).toBeCloseTo(1, 5);
    expect(volume(position)).toBeGreaterThan(0);
  });

  it.each([
    ["box", 0, 1.5 * 0.9 * 0.5], ["capsule", 5, Math.PI * 0.38 ** 2 * (1.1 + (4 / 3) * 0.38)], ["cylinder", 6, Math.PI * 0.25 * 1.2],
    ["ellipsoid", 7, (4 / 3) * Math.PI * 0.95 * 0.6 * 0.4],
  ])("%s: the volume, within the 0.9 %% that 48 straight pieces of a circle leave out", (_, shape, exact) => {
    const found = volume(surfaceOf(geometries[shape]).position) / exact;
    expect(found).toBeLessThan(1 + 1e-6);
    expect(found).toBeGreaterThan(0.991);
  });

  it("edges are where faces meet, and nowhere else", () => {
    const { position, edge } = surfaceOf(geometries[0]);
    // A box of 6 faces with 4 sides each: every side is a triangle with the middle of its face.
    expect(edge.length / 3).toBe(24);
    for (let i = 0; i < edge.length; i += 3) {
      expect([edge[i + 1], edge[i + 2]]).toEqual([0, 0]);
      expect(edge[i]).toBeGreaterThan(0.2);
    }
    expect(Math.max(...position)).toBeCloseTo(0.75);
  });

  it("a ray meets the surface first from outside", () => {
    const surface = surfaceOf(geometries[0]);
    expect(firstHit(surface, [5, 0.1, 0.1], [-1, 0, 0])).toBeCloseTo(4.25, 5);
    expect(firstHit(surface, [5, 3, 0], [-1, 0, 0])).toBe(Infinity);
  });
});

describe("bodies that turn", () => {
  it("a rod struck at its end turns at 4.8 rad/s, and both ways of recording it agree", () => {
    for (const turns of [true, false]) {
      const recording = read(rodStruck(), turns);
      const flight = new Flight(recording);
      const out = new Float64Array(8);
      const after = 0.5;
      flight.orientationsAt(recording.impacts.time[0] + after, out);
      const rod = [...out.subarray(4)] as Quaternion;
      // About y by 4.8 rad/s · 0.5 s.
      expect(angleBetween(rod, [Math.cos(1.2), 0, Math.sin(1.2), 0])).toBeLessThan(1e-14);
      const w = flight.angularVelocityAt(1, recording.impacts.time[0] + after);
      [0, 4.8, 0].forEach((expected, k) => expect(w[k]).toBeCloseTo(expected, 12));
      expect(flight.angularVelocityBefore(1, flight.segmentB[0])).toEqual([0, 0, 0]);
      expect(flight.largestMismatch()).toBeLessThan(1e-15);
    }
  });

  it("what impacts do to spins follows from the impulse, point and normal alone", () => {
    const [recorded, derived] = [new Flight(read(dice(), true)), new Flight(read(dice(), false))];
    const { bodies, duration, impacts } = read(dice());
    expect(impacts.count).toBeGreaterThan(20);
    const [p, q] = [new Float64Array(4 * bodies.count), new Float64Array(4 * bodies.count)];
    for (const time of [0.3 * duration, 0.7 * duration, duration]) {
      recorded.orientationsAt(time, p);
      derived.orientationsAt(time, q);
      for (let row = 0; row < bodies.count; row++) {
        const angle = angleBetween([...p.subarray(4 * row, 4 * row + 4)] as Quaternion, [...q.subarray(4 * row, 4 * row + 4)] as Quaternion);
        expect(angle).toBeLessThan(1e-11);
      }
    }
    expect(recorded.largestMismatch()).toBeLessThan(1e-12);
  });

  it.each([["recorded", true, 1e-13], ["left to the law of impact", false, 1e-11]])(
    "a run of the simulator is replayed to its end, its turns after impacts %s", (_, turns, allowed) => {
      const { duration, last } = engineRun();
      const recording = parseRecording(JSON.stringify(recordEngineRun(turns)));
      const flight = new Flight(recording);
      const [orientations, positions] = [new Float64Array(4 * last.length), new Float64Array(3 * last.length)];
      flight.orientationsAt(duration, orientations);
      flight.positionsAt(duration, positions);
      expect(recording.impacts.count).toBeGreaterThan(100);
      last.forEach((body, row) => {
        const apart = [0, 1, 2].map((k) => positions[3 * row + k] - body.position[k]);
        expect(Math.hypot(...apart)).toBeLessThan(1e-13);
        if (body.shape < 0) return;
        expect(angleBetween([...orientations.subarray(4 * row, 4 * row + 4)] as Quaternion, body.orientation)).toBeLessThan(allowed);
        const spin = flight.angularVelocityAt(row, duration);
        expect(Math.hypot(...[0, 1, 2].map((k) => spin[k] - body.angularVelocity[k]))).toBeLessThan(10 * allowed);
      });
      expect(flight.largestMismatch()).toBeLessThan(1e-13);
    });

  it("between impacts a body turns as the free rotation about its principal axes, wherever these are in its shape", () => {
    const data = recordSolids(gallery());
    const axes: Quaternion = [0.5, 0.5, -0.5, 0.5];
    data.geometries[0].principal_axes = axes;
    const flight = new Flight(parseRecording(JSON.stringify(data)));
    const scene = gallery().bodies[0];
    // The shape is turned by q, its principal axes by q p; after a time those by r, and the shape by r p⁻¹.
    const times = (a: Quaternion, b: Quaternion): Quaternion => [
      a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
      a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ];
    const rotation = freeRotation([0.2, 0.3, 0.4], times(scene.orientation as Quaternion, axes), scene.angularVelocity as Vector);
    const expected = times(rotation.after(5.5).orientation, [axes[0], -axes[1], -axes[2], -axes[3]]);
    const out = new Float64Array(4 * 12);
    flight.orientationsAt(5.5, out);
    expect(angleBetween([...out.subarray(0, 4)] as Quaternion, expected)).toBeLessThan(1e-14);
  });

  it("a report says what is wrong with its shapes", () => {
    const changed = (change: (data: any) => void) => {
      const data = recordSolids(funnel());
      change(data);
      return () => parseRecording(JSON.stringify(data));
    };
    expect(changed(() => {})().meshes[0].triangles.length).toBe(3 * 128);
    expect(changed((data) => (data.geometries[0].parts[0].kind = "torus"))).toThrow("geometries[0].parts[0].kind");
    expect(changed((data) => (data.geometries[0].parts[0].faces[2][1] = 8))).toThrow("parts[0].faces[2]");
    expect(changed((data) => data.geometries.pop())).toThrow("a shape that is not there");
    expect(changed((data) => (data.meshes[0].position = [0, 0]))).toThrow(RecordingError);
  });
});
