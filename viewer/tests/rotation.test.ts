import { readFileSync } from "node:fs";
import { describe, expect, it } from "vitest";
import { angleBetween, conjugate, rotated } from "../src/quaternions";
import type { Quaternion, Vector } from "../src/recording";
import { freeRotation } from "../src/rotation";

interface Case {
  kind: string;
  moments: Vector;
  orientation: Quaternion;
  angular_velocity: Vector;
  period: string | null;
  states: { time: number; orientation: string[]; angular_velocity: string[] }[];
}

const cases: Case[] = JSON.parse(readFileSync(new URL("../../vectors/free_rotation.json", import.meta.url), "utf8"));

describe("free rotation", () => {
  it("is that of the simulator's reference: spherical, symmetric, asymmetric, near the separatrix, up to a million periods", () => {
    expect(cases.length).toBeGreaterThan(200);
    let worst = 0;
    for (const { kind, moments, orientation, angular_velocity, states } of cases) {
      const rotation = freeRotation(moments, orientation, angular_velocity);
      const speed = Math.hypot(...angular_velocity);
      for (const state of states) {
        const turn = rotation.after(state.time);
        const angle = angleBetween(turn.orientation, state.orientation.map(Number) as Quaternion);
        const off = Math.hypot(...[0, 1, 2].map((k) => turn.angularVelocity[k] - Number(state.angular_velocity[k])));
        if (speed * Math.abs(state.time) < 1e9) worst = Math.max(worst, angle);
        // The simulator itself is tested to some 1e-15; a picture needs far less. After 1e22 turns, 31 digits of the rate tell.
        const allowed = 1e-12 + 1e-31 * speed * Math.abs(state.time);
        expect(angle, `${kind} at ${state.time} s`).toBeLessThan(allowed);
        expect(off, `${kind} at ${state.time} s`).toBeLessThanOrEqual((allowed * speed * Math.max(...moments)) / Math.min(...moments));
      }
    }
    console.log(`free rotation: largest angle between page and reference, up to 1e9 rad, ${worst.toExponential(1)} rad`);
  });

  it("rests, turns about a principal axis, and takes a body in prescribed motion as it is", () => {
    expect(freeRotation([1, 2, 3], [1, 0, 0, 0], [0, 0, 0]).after(5).orientation).toEqual([1, 0, 0, 0]);
    const half = freeRotation([1, 2, 3], [1, 0, 0, 0], [0, Math.PI, 0]).after(1).orientation;
    expect(angleBetween(half, [0, 0, 1, 0])).toBeLessThan(1e-15);
    const prescribed = freeRotation([Infinity, Infinity, Infinity], [1, 0, 0, 0], [0.3, 0.4, 0]);
    expect(prescribed.after(7).angularVelocity).toEqual([0.3, 0.4, 0]);
  });

  it("a book thrown about its middle axis turns over, and its energy and momentum stay", () => {
    const moments: Vector = [1, 2, 3];
    const rotation = freeRotation(moments, [1, 0, 0, 0], [1e-3, 2, 0]);
    const states = Array.from({ length: 81 }, (_, i) => rotation.after(0.25 * i));
    // The middle axis seen in the world: along y, and over, and back again.
    const middle = states.map((state) => rotated(state.orientation, [0, 1, 0])[1]);
    expect(Math.max(...middle)).toBeGreaterThan(0.99);
    expect(Math.min(...middle)).toBeLessThan(-0.99);
    for (const { orientation, angularVelocity } of states) {
      const w = rotated(conjugate(orientation), angularVelocity);
      const energy = 0.5 * (moments[0] * w[0] ** 2 + moments[1] * w[1] ** 2 + moments[2] * w[2] ** 2);
      const momentum = rotated(orientation, [0, 1, 2].map((k) => moments[k] * w[k]) as Vector);
      expect(energy).toBeCloseTo(4 + 0.5e-6, 13);
      [1e-3, 4, 0].forEach((l, k) => expect(momentum[k]).toBeCloseTo(l, 13));
    }
  });
});
