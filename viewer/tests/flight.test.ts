import { describe, expect, it } from "vitest";
import { Flight, lastAtOrBefore, wrap } from "../src/flight";
import { parseRecording, type Recording } from "../src/recording";
import { bouncingBall, gas, piston, poolBreak, record, twoBalls, type Scene } from "./samples";

const EPSILON = 2 ** -52;

function read(scene: Scene): Recording {
  return parseRecording(JSON.stringify(record(scene)));
}

function positions(recording: Recording, time: number): number[] {
  const out = new Float64Array(3 * recording.bodies.count);
  new Flight(recording).positionsAt(time, out);
  return [...out];
}

describe("flight", () => {
  it("two balls of equal mass, head on, exchange their velocities", () => {
    const recording = read({
      title: "", duration: 4,
      balls: [
        { position: [-2, 0, 0], velocity: [1, 0, 0], radius: 0.5, mass: 1 },
        { position: [2, 0, 0], velocity: [-0.5, 0, 0], radius: 0.5, mass: 1 },
      ],
    });
    // gap 3 m, closing at 1.5 m/s: contact at 2 s, at x = 0.5. All numbers here are exact in binary.
    expect([...recording.impacts.time]).toEqual([2]);
    expect(positions(recording, 0)).toEqual([-2, 0, 0, 2, 0, 0]);
    expect(positions(recording, 1)).toEqual([-1, 0, 0, 1.5, 0, 0]);
    expect(positions(recording, 2)).toEqual([0, 0, 0, 1, 0, 0]);
    expect(positions(recording, 4)).toEqual([-1, 0, 0, 3, 0, 0]);
    const flight = new Flight(recording);
    expect(flight.velocityAt(0, 1)).toEqual([1, 0, 0]);
    expect(flight.velocityAt(0, 2)).toEqual([-0.5, 0, 0]);
    expect(flight.velocityBefore(0, flight.segmentA[0])).toEqual([1, 0, 0]);
    expect(flight.velocityAfter(flight.segmentB[0])).toEqual([1, 0, 0]);
  });

  it("a ball dropped on a floor flies parabolas and comes back to e² of its height", () => {
    // Dropped 5 m above the floor with g = 10: 1 s to the floor, 10 m/s there, 5 m/s after e = 0.5, up again for 0.5 s to 1.25 m.
    const recording = read({
      title: "", duration: 2, gravity: [0, 0, -10], restitution: 0.5,
      balls: [{ position: [0, 0, 6], velocity: [1, 0, 0], radius: 1, mass: 3 }],
      planes: [{ id: 1, normal: [0, 0, 1], offset: 0 }],
    });
    expect(recording.impacts.time[0]).toBe(1);
    expect(positions(recording, 0.5)).toEqual([0.5, 0, 4.75]);
    expect(positions(recording, 1)).toEqual([1, 0, 1]);
    expect(positions(recording, 1.5)).toEqual([1.5, 0, 2.25]);
    expect(new Flight(recording).velocityAt(0, 1.5)).toEqual([1, 0, 0]);
  });

  it("a fixed ball neither falls nor gives way", () => {
    const recording = read({
      title: "", duration: 3, balls: [
        { position: [0, 0, 0], velocity: [0, 0, 0], radius: 0.5, mass: 7, fixed: true },
        { position: [3, 0, 0], velocity: [-1, 0, 0], radius: 0.5, mass: 1 },
      ],
    });
    recording.gravity = [0, 0, -8];
    const after = new Flight(recording);
    const out = new Float64Array(6);
    after.positionsAt(2.5, out);
    // The other one has fallen 4·2.5² while flying 2 m there and 0.5 m back.
    expect([...out]).toEqual([0, 0, 0, 1.5, 0, -25]);
  });

  it("a ball in a periodic box comes in where it went out", () => {
    const recording = read({
      title: "", duration: 10, axes: ["periodic", "open", "open"], size: [4, 0, 0],
      balls: [{ position: [1, 0, 0], velocity: [1, 1, 0], radius: 0.25, mass: 1 }],
    });
    expect(positions(recording, 0.75)).toEqual([1.75, 0.75, 0]);
    expect(positions(recording, 1.5)).toEqual([-1.5, 1.5, 0]);
    expect(positions(recording, 9)).toEqual([2 - 4, 9, 0].map((x) => (x === -2 ? wrap(10, 4) : x)));
    expect(wrap(5, 0)).toBe(5);
    expect(wrap(2.5, 4)).toBe(-1.5);
  });

  it("several impacts of one body at one instant count in their order", () => {
    // A cradle of three touching balls: the middle one is struck and strikes at the same time.
    const ball = (x: number, v: number) => ({ position: [x, 0, 0], velocity: [v, 0, 0], radius: 0.5, mass: 1 });
    const recording = read({ title: "", duration: 4, balls: [ball(-2, 1), ball(0, 0), ball(1, 0)] });
    expect([...recording.impacts.time]).toEqual([1, 1]);
    expect(positions(recording, 3)).toEqual([-1, 0, 0, 0, 0, 0, 3, 0, 0]);
  });

  it.each([
    ["two balls", twoBalls], ["pool break", poolBreak()], ["bouncing ball", bouncingBall], ["piston", piston], ["gas", gas(6, 1)],
  ])("%s: every recorded contact point lies on the replayed balls", (_, scene) => {
    const recording = read(scene);
    const flight = new Flight(recording);
    expect(recording.impacts.count).toBeGreaterThan(0);
    const reach = Math.max(...scene.balls.flatMap((ball) => ball.position.map(Math.abs)), 10 * recording.duration);
    // Both sides add up the same impulses in different groupings: a few roundings of the largest path length an impact.
    expect(flight.largestMismatch()).toBeLessThan(4 * EPSILON * reach * recording.impacts.count);
  });

  it("finds the segment of any time, whether asked forwards or backwards", () => {
    const recording = read(poolBreak());
    const flight = new Flight(recording);
    for (let row = 0; row < recording.bodies.count; row++) {
      for (let i = 200; i >= 0; i--) {
        const time = (i / 200) * recording.duration;
        let plain = flight.first[row];
        while (plain + 1 < flight.first[row + 1] && flight.time[plain + 1] <= time) plain++;
        expect(flight.segmentAt(row, time)).toBe(plain);
      }
    }
  });

  it("bisects", () => {
    expect(lastAtOrBefore([], 1)).toBe(-1);
    expect(lastAtOrBefore([1, 2, 2, 3], 0.5)).toBe(-1);
    expect(lastAtOrBefore([1, 2, 2, 3], 2)).toBe(2);
    expect(lastAtOrBefore([1, 2, 2, 3], 9)).toBe(3);
  });
});
