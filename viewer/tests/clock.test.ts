import { describe, expect, it } from "vitest";
import { Clock } from "../src/clock";

const watch = (clock: Clock, seconds: number) => {
  for (let i = 0; i < Math.round(seconds * 60); i++) clock.advance(1 / 60);
};

describe("clock", () => {
  it("plays a run of any length in about twelve seconds, then stops; playing again starts over", () => {
    for (const end of [1e-6, 3, 1e5]) {
      const clock = new Clock([], [], end);
      clock.toggle();
      watch(clock, 6);
      expect(clock.time / end).toBeCloseTo(0.5, 6);
      watch(clock, 7);
      expect([clock.time, clock.playing]).toEqual([end, false]);
      clock.toggle();
      expect([clock.time, clock.playing]).toEqual([0, true]);
    }
  });

  it("stepping to an impact ends exactly at contact, and leaves it slowly", () => {
    const clock = new Clock([1, 2.5], [0.01, 0.01], 4);
    clock.step(1);
    expect(clock.focus).toBe(0);
    expect(clock.time).toBeLessThan(1);
    watch(clock, 3);
    expect([clock.time, clock.playing, clock.focus]).toEqual([1, false, 0]);
    clock.toggle();
    watch(clock, 0.5);
    // Half a second later still within the window: 0.5 s at 0.01 s / 0.9 s.
    expect(clock.time - 1).toBeLessThan(0.01);
    expect(clock.focus).toBe(0);
    watch(clock, 3);
    expect(clock.focus).toBe(-1);
    expect(clock.time).toBeGreaterThan(1.1);
  });

  it("stays with an impact at the slowest speed, and forgets it when paused far away", () => {
    const clock = new Clock([1, 3], [0.01, 0.01], 4);
    clock.step(1, true);
    clock.speed = 1e-6;
    clock.toggle();
    watch(clock, 1);
    expect(clock.focus).toBe(0);
    expect(clock.time - 1).toBeCloseTo(1e-6 * clock.base, 12);
    clock.pause();
    clock.slowMotion = true;
    clock.speed = 1;
    clock.seek(2);
    clock.rate();
    expect(clock.focus).toBe(-1);
  });

  it("steps through impacts of one instant one by one, and not past the ends", () => {
    const clock = new Clock([1, 1, 1, 2], [0.01, 0.01, 0.01, 0.01], 3);
    const seen = [1, 1, 1, 1, 1, -1, -1, -1, -1].map((direction) => {
      clock.step(direction as 1 | -1, true);
      return clock.focus;
    });
    expect(seen).toEqual([0, 1, 2, 3, 3, 2, 1, 0, 0]);
  });

  it("steps from the time shown", () => {
    const clock = new Clock([1, 2, 3], [0, 0, 0], 4);
    clock.seek(2.4);
    clock.step(1, true);
    expect(clock.focus).toBe(2);
    clock.seek(2.4);
    clock.step(-1, true);
    expect(clock.focus).toBe(1);
  });

  it("in slow motion no impact is run over, however short", () => {
    const clock = new Clock([1], [1e-7], 4);
    clock.slowMotion = true;
    clock.seek(0.5);
    clock.toggle();
    const times: number[] = [];
    for (let i = 0; i < 60 * 20 && clock.time < 1.2; i++) {
      clock.advance(1 / 60);
      times.push(clock.time);
    }
    const within = times.filter((t) => Math.abs(t - 1) < 1e-7).length;
    // At one window in 0.9 s each way, some 2 · 0.9 · 60 pictures show the contact; the easing takes a little of it.
    expect(within).toBeGreaterThan(60);
    expect(times.every((t, i) => i === 0 || t >= times[i - 1])).toBe(true);
  });

  it("without slow motion impacts do not slow it down", () => {
    const clock = new Clock([1, 2], [0.1, 0.1], 4);
    clock.toggle();
    watch(clock, 6);
    expect(clock.time).toBeCloseTo(2, 6);
    expect(clock.focus).toBe(-1);
  });

  it("a run that ends at once plays without harm", () => {
    const clock = new Clock([0], [0], 0);
    clock.step(1);
    watch(clock, 1);
    expect(clock.time).toBe(0);
    clock.toggle();
    watch(clock, 1);
    expect([clock.time, clock.playing]).toEqual([0, false]);
  });
});
