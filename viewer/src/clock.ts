// The time of the replay: how it runs, slows down around impacts, and steps from one to the next. No drawing here.

import { lastAtOrBefore } from "./flight";

/** At normal speed a whole run takes this long (s of watching). */
const WATCHING_TIME = 12;
/** Watching time from half a radius apart to contact, in slow motion (s). */
const SLOW_APPROACH = 0.9;
/** In slow motion the distance in time to an impact shrinks by e in this long (s), so that slowing down is smooth. */
const EASE = 0.22;
/** Longest step of the slow-motion rule (s of watching); well under EASE, so an impact is never jumped over. */
const STEP = 1 / 240;

export const SLOWEST = 1e-6;
export const FASTEST = 10;

export class Clock {
  time = 0;
  playing = false;
  /** Multiple of the base rate. */
  speed = 1;
  /** Slow down around every impact. */
  slowMotion = false;
  /** The impact being looked at; −1 for none. */
  focus = -1;
  /** Seconds of the run for a second of watching at speed 1. */
  readonly base: number;

  /** The impact stepped to: slow motion holds around it, whatever `slowMotion` says. */
  private near = -1;
  /** Stop at `near`. */
  private approaching = false;

  /**
   * @param times of the impacts, sorted (s)
   * @param windows of the impacts: half the time during which the two bodies are within about a radius of contact (s)
   */
  constructor(
    readonly times: ArrayLike<number>,
    readonly windows: ArrayLike<number>,
    readonly end: number,
  ) {
    this.base = (end > 0 ? end : 1) / WATCHING_TIME;
  }

  toggle(): void {
    if (this.playing) {
      this.pause();
    } else {
      if (this.time >= this.end) this.seek(0);
      this.playing = true;
      this.approaching = false;
    }
  }

  pause(): void {
    this.playing = false;
  }

  seek(time: number): void {
    this.time = Math.min(Math.max(time, 0), this.end);
    this.focus = -1;
    this.near = -1;
    this.approaching = false;
  }

  /** Goes to an impact: from just before it in slow motion up to contact, or at once if `directly`. */
  goTo(impact: number, directly = false): void {
    if (impact < 0 || impact >= this.times.length) return;
    const contact = this.times[impact];
    this.focus = impact;
    this.near = impact;
    this.approaching = !directly;
    this.playing = !directly;
    this.time = directly ? contact : Math.max(0, contact - 2 * this.windows[impact]);
  }

  /** To the next (+1) or previous (−1) impact. */
  step(direction: 1 | -1, directly = false): void {
    const from = this.near >= 0 ? this.near : this.between(direction);
    this.goTo(Math.min(Math.max(from + direction, 0), this.times.length - 1), directly);
  }

  private between(direction: 1 | -1): number {
    const last = lastAtOrBefore(this.times, this.time);
    return direction > 0 ? last : last + 1;
  }

  /** Lets `watched` seconds of watching pass. */
  advance(watched: number): void {
    for (let left = watched; left > 0 && this.playing; left -= STEP) {
      const rate = this.rate();
      this.time += rate * Math.min(left, STEP);
      if (this.approaching && this.time >= this.times[this.near]) {
        this.time = this.times[this.near];
        this.approaching = false;
        this.playing = false;
      }
      if (this.time >= this.end) {
        this.time = this.end;
        this.playing = false;
      }
    }
  }

  /** Seconds of the run for a second of watching, now. Also settles which impact is being looked at. */
  rate(): number {
    // Stepping to an impact takes the same while at any speed set.
    const fast = this.base * (this.approaching ? 1 : this.speed);
    const impact = this.near >= 0 ? this.near : this.slowMotion ? this.nearest() : -1;
    if (impact < 0) {
      if (this.playing) this.focus = -1;
      return fast;
    }
    const away = Math.abs(this.times[impact] - this.time);
    const slow = Math.max(this.windows[impact] / SLOW_APPROACH, away / EASE);
    if (this.approaching || slow < fast || away <= 2 * this.windows[impact]) {
      this.focus = impact;
    } else {
      this.focus = -1;
      this.near = -1;
    }
    return Math.min(fast, slow);
  }

  private nearest(): number {
    const last = lastAtOrBefore(this.times, this.time);
    const next = last + 1;
    if (last < 0) return next < this.times.length ? next : -1;
    if (next >= this.times.length) return last;
    return this.time - this.times[last] <= this.times[next] - this.time ? last : next;
  }
}
