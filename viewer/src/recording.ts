// The data a report carries, typed, and its only parser.
//
// Everything that reaches the page comes through `parseRecording`. SI units; vectors are (x, y, z), arrays of vectors are
// flat (3 numbers a row); times are in seconds since the start of the run (the clock of the scene then read `timeStart`).

export type Axis = 0 | 1 | 2;
export const AXES: readonly Axis[] = [0, 1, 2];
export type Vector = [number, number, number];
export type AxisKind = "open" | "walls" | "periodic";

export interface Bodies {
  /** Balls of the run; `count` of them are here. */
  total: number;
  count: number;
  id: Int32Array;
  name: (string | null)[] | null;
  radius: Float64Array;
  mass: Float64Array;
  position: Float64Array;
  velocity: Float64Array;
  fixed: Uint8Array;
}

export interface Plane {
  id: number;
  /** Points to the free side. */
  normal: Vector;
  /** normal · x = offset + (normal · velocity) t on the plane, with t since the start of the run. */
  offset: number;
  velocity: Vector;
  /** A wall of the domain, not a body. */
  wall: boolean;
  name: string | null;
}

export interface Impacts {
  /** Impacts of the run; `count` of them, the first ones, are here. */
  total: number;
  count: number;
  time: Float64Array;
  a: Int32Array;
  b: Int32Array;
  kind: Uint8Array;
  kinds: string[];
  point: Float64Array;
  /** From B to A. */
  normal: Float64Array;
  approachSpeed: Float64Array;
  separationSpeed: Float64Array;
  impulse: Float64Array;
  restitution: Float64Array;
  energyLost: Float64Array;
}

export interface Series {
  time: number[];
  kineticEnergy: number[];
  potentialEnergy: number[];
  dissipated: number[];
  work: number[];
  momentum: Vector[];
  energyError: number[];
}

export interface Recording {
  title: string;
  version: string;
  dimensions: number;
  gravity: Vector;
  axes: [AxisKind, AxisKind, AxisKind];
  size: Vector;
  timeStart: number;
  /** Length of the run. */
  duration: number;
  /** The replay is complete from 0 to here. */
  replayUntil: number;
  bodies: Bodies;
  planes: Plane[];
  impacts: Impacts;
  series: Series;
  summary: Record<string, unknown>;
}

/** The data of the page is not what this page can read. */
export class RecordingError extends Error {}

type Fields = Record<string, unknown>;

function fields(value: unknown, where: string): Fields {
  if (typeof value !== "object" || value === null || Array.isArray(value)) throw new RecordingError(`${where} is not an object`);
  return value as Fields;
}

function number(from: Fields, name: string, where: string): number {
  const value = from[name];
  if (typeof value !== "number" || !Number.isFinite(value)) throw new RecordingError(`${where}.${name} is not a number`);
  return value;
}

function list(from: Fields, name: string, where: string): unknown[] {
  const value = from[name];
  if (!Array.isArray(value)) throw new RecordingError(`${where}.${name} is not a list`);
  return value;
}

function vector(value: unknown, where: string): Vector {
  if (!Array.isArray(value) || value.length !== 3 || value.some((x) => typeof x !== "number")) {
    throw new RecordingError(`${where} is not three numbers`);
  }
  return value as Vector;
}

function bytes(text: unknown, where: string): ArrayBuffer {
  if (typeof text !== "string") throw new RecordingError(`${where} is not base64 text`);
  let binary: string;
  try {
    binary = atob(text);
  } catch {
    throw new RecordingError(`${where} is not base64 text`);
  }
  const out = new Uint8Array(binary.length);
  for (let i = 0; i < out.length; i++) out[i] = binary.charCodeAt(i);
  return out.buffer;
}

/** Reads one packed array: `length` numbers, little-endian, in base64. */
function packed<T extends { length: number }>(
  from: Fields,
  name: string,
  where: string,
  type: { new (buffer: ArrayBuffer): T; BYTES_PER_ELEMENT: number },
  length: number,
): T {
  const buffer = bytes(from[name], `${where}.${name}`);
  if (buffer.byteLength !== length * type.BYTES_PER_ELEMENT) {
    throw new RecordingError(`${where}.${name} holds ${buffer.byteLength} bytes, not ${length * type.BYTES_PER_ELEMENT}`);
  }
  return new type(buffer);
}

function parseBodies(from: Fields): Bodies {
  const where = "bodies";
  const count = number(from, "count", where);
  return {
    total: from.total === undefined ? count : number(from, "total", where),
    count,
    id: packed(from, "id", where, Int32Array, count),
    name: from.name == null ? null : list(from, "name", where).map((name) => (typeof name === "string" && name !== "" ? name : null)),
    radius: packed(from, "radius", where, Float64Array, count),
    mass: packed(from, "mass", where, Float64Array, count),
    position: packed(from, "position", where, Float64Array, 3 * count),
    velocity: packed(from, "velocity", where, Float64Array, 3 * count),
    fixed: packed(from, "fixed", where, Uint8Array, count),
  };
}

function parseImpacts(from: Fields): Impacts {
  const where = "impacts";
  const count = number(from, "count", where);
  const column = (name: string) => packed(from, name, where, Float64Array, count);
  return {
    total: number(from, "total", where),
    count,
    time: column("time"),
    a: packed(from, "a", where, Int32Array, count),
    b: packed(from, "b", where, Int32Array, count),
    kind: packed(from, "kind", where, Uint8Array, count),
    kinds: list(from, "kinds", where).map(String),
    point: packed(from, "point", where, Float64Array, 3 * count),
    normal: packed(from, "normal", where, Float64Array, 3 * count),
    approachSpeed: column("approach_speed"),
    separationSpeed: column("separation_speed"),
    impulse: column("impulse"),
    restitution: column("restitution"),
    energyLost: column("energy_lost"),
  };
}

function parseSeries(from: Fields): Series {
  const column = (name: string) => list(from, name, "series").map((x) => (typeof x === "number" ? x : NaN));
  return {
    time: column("time"),
    kineticEnergy: column("kinetic_energy"),
    potentialEnergy: column("potential_energy"),
    dissipated: column("dissipated"),
    work: column("work"),
    momentum: list(from, "momentum", "series").map((p, i) => vector(p, `series.momentum[${i}]`)),
    energyError: column("energy_error"),
  };
}

function parsePlane(value: unknown, index: number): Plane {
  const where = `planes[${index}]`;
  const from = fields(value, where);
  return {
    id: number(from, "id", where),
    normal: vector(from.normal, `${where}.normal`),
    offset: number(from, "offset", where),
    velocity: vector(from.velocity, `${where}.velocity`),
    wall: from.wall === true,
    name: typeof from.name === "string" && from.name !== "" ? from.name : null,
  };
}

/** Reads the JSON text of a report. Raises `RecordingError`, which names the field, if it is not a recording of format 1. */
export function parseRecording(text: string): Recording {
  let json: unknown;
  try {
    json = JSON.parse(text);
  } catch (error) {
    throw new RecordingError(`the data is not JSON: ${(error as Error).message}`);
  }
  const data = fields(json, "the data");
  if (data.format !== 1) throw new RecordingError(`format ${String(data.format)} is not one this page knows (it knows 1)`);
  const domain = fields(data.domain, "domain");
  const axes = list(domain, "axes", "domain");
  if (axes.length !== 3 || axes.some((kind) => kind !== "open" && kind !== "walls" && kind !== "periodic")) {
    throw new RecordingError("domain.axes is not three of open, walls, periodic");
  }
  const timeStart = number(data, "time_start", "the data");
  return {
    title: typeof data.title === "string" && data.title !== "" ? data.title : "Untitled run",
    version: typeof data.version === "string" ? data.version : "",
    dimensions: number(data, "dimensions", "the data"),
    gravity: vector(data.gravity, "gravity"),
    axes: axes as Recording["axes"],
    size: vector(domain.size, "domain.size"),
    timeStart,
    duration: Math.max(0, number(data, "time_end", "the data") - timeStart),
    replayUntil: Math.max(0, number(data, "replay_until", "the data") - timeStart),
    bodies: parseBodies(fields(data.bodies, "bodies")),
    planes: list(data, "planes", "the data").map(parsePlane),
    impacts: parseImpacts(fields(data.impacts, "impacts")),
    series: parseSeries(fields(data.series, "series")),
    summary: typeof data.summary === "object" && data.summary !== null ? (data.summary as Fields) : {},
  };
}

/** The row of each body by its id. */
export function rowsById(bodies: Bodies): Map<number, number> {
  return new Map(Array.from(bodies.id, (id, row) => [id, row]));
}
