// Colours of the bodies, and the page's own colours as drawing code needs them.

import type { Recording } from "./recording";
import type { Flight } from "./flight";

export type Colouring = "identity" | "shape" | "size" | "speed";
export type Colour = [number, number, number];

/** Numbered balls of a pool set, 1 to 8; 9 to 15 repeat 1 to 7 as stripes. */
const POOL = ["#f2b930", "#2d62c9", "#d9422e", "#6a3d9e", "#ee7a29", "#1d8a5b", "#8f2b3a", "#22262a"];
const IVORY = "#f6f0e2";
/** For a few bodies to be told apart, in light and dark. */
const DISTINCT = ["#3b7ddd", "#e8884a", "#2fa58a", "#b868c8", "#e0b23e", "#e0607e", "#6d7fe0", "#7fae42", "#4bb3d6", "#b58463"];
/** From small to large, or slow to fast. */
const RAMP = ["#3f51a3", "#3b7fc4", "#3fa9b5", "#74c39a", "#d3d47c", "#f4b860", "#ee7b4d"];

export function parseColour(text: string): Colour {
  const hex = text.trim().replace("#", "");
  return [0, 2, 4].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255) as Colour;
}

const RAMP_COLOURS = RAMP.map(parseColour);

function ramp(share: number, out: Float32Array, at: number): void {
  const x = Math.min(Math.max(share, 0), 1) * (RAMP_COLOURS.length - 1);
  const i = Math.min(Math.floor(x), RAMP_COLOURS.length - 2);
  for (let k = 0; k < 3; k++) out[at + k] = RAMP_COLOURS[i][k] * (1 - x + i) + RAMP_COLOURS[i + 1][k] * (x - i);
}

/** A pool set: a ball called cue, and at most fifteen others. */
export function isPool(recording: Recording): boolean {
  const { count, name } = recording.bodies;
  return count >= 2 && count <= 16 && (name?.some((text) => /\bcue\b/i.test(text ?? "")) ?? false);
}

export class Palette {
  /** Red, green, blue of each body, 0 to 1. */
  readonly colours: Float32Array;
  /** 1 for a striped ball. */
  readonly stripes: Float32Array;
  readonly pool: boolean;
  readonly start: Colouring;
  /** The ways in which these bodies can be coloured. */
  readonly ways: Colouring[];
  private readonly speedScale: number;

  constructor(private readonly recording: Recording, private readonly flight: Flight) {
    const { bodies } = recording;
    this.colours = new Float32Array(3 * bodies.count);
    this.stripes = new Float32Array(bodies.count);
    this.pool = isPool(recording);
    const sizes = new Set(bodies.radius).size;
    const shapes = new Set(bodies.turning?.geometry).size;
    this.ways = shapes > 1 ? ["identity", "shape", "size", "speed"] : ["identity", "size", "speed"];
    this.start = bodies.count <= 40 ? "identity" : shapes > 1 ? "shape" : sizes > 1 ? "size" : "speed";
    let squares = 0;
    for (const v of flight.velocity) squares += v * v;
    // Twice the root mean square speed, over all impacts, is the hot end: in a gas few bodies are faster.
    this.speedScale = 2 * Math.sqrt((3 * squares) / Math.max(1, flight.velocity.length)) || 1;
  }

  paint(how: Colouring, time: number): void {
    if (how === "identity") this.byIdentity();
    else if (how === "shape") this.byShape();
    else if (how === "size") this.bySize();
    else this.bySpeed(time);
  }

  private byIdentity(): void {
    const { bodies } = this.recording;
    this.stripes.fill(0);
    let numbered = 0;
    for (let row = 0; row < bodies.count; row++) {
      let colour = DISTINCT[row % DISTINCT.length];
      if (this.pool) {
        if (/\bcue\b/i.test(bodies.name?.[row] ?? "")) {
          colour = IVORY;
        } else {
          numbered++;
          const number = Number(/\d+/.exec(bodies.name?.[row] ?? "")?.[0] ?? numbered);
          colour = POOL[(number - 1) % 8];
          this.stripes[row] = number > 8 ? 1 : 0;
        }
      }
      this.colours.set(parseColour(colour), 3 * row);
    }
  }

  private byShape(): void {
    const { bodies } = this.recording;
    this.stripes.fill(0);
    for (let row = 0; row < bodies.count; row++) {
      const shape = 1 + (bodies.turning?.geometry[row] ?? -1);
      this.colours.set(parseColour(DISTINCT[shape % DISTINCT.length]), 3 * row);
    }
  }

  private bySize(): void {
    const { bodies } = this.recording;
    this.stripes.fill(0);
    const sizes = [...new Set(bodies.radius)].filter((r) => r > 0).sort((a, b) => a - b);
    const low = Math.log(sizes[0] ?? 1);
    const range = Math.log(sizes[sizes.length - 1] ?? 1) - low || 1;
    const few = sizes.length <= DISTINCT.length;
    for (let row = 0; row < bodies.count; row++) {
      if (few) this.colours.set(parseColour(DISTINCT[Math.max(0, sizes.indexOf(bodies.radius[row]))]), 3 * row);
      else ramp((Math.log(bodies.radius[row]) - low) / range, this.colours, 3 * row);
    }
  }

  private bySpeed(time: number): void {
    this.stripes.fill(0);
    const v = [0, 0, 0];
    for (let row = 0; row < this.recording.bodies.count; row++) {
      this.flight.velocityAt(row, time, v);
      ramp(Math.hypot(v[0], v[1], v[2]) / this.speedScale, this.colours, 3 * row);
    }
  }
}

/** The value of a colour of the style sheet, as #rrggbb, in the present colour scheme. */
export function themeColour(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}
