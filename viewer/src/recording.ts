// The data a report carries, typed, and its only parser.
//
// Everything that reaches the page comes through `parseRecording`. SI units; vectors are (x, y, z), arrays of vectors are
// flat (3 numbers a row); times are in seconds since the start of the run (the clock of the scene then read `timeStart`).

export type Axis = 0 | 1 | 2;
export const AXES: readonly Axis[] = [0, 1, 2];
export type Vector = [number, number, number];
export type AxisKind = "open" | "walls" | "periodic";

/** A unit quaternion (w, x, y, z). */
export type Quaternion = [number, number, number, number];
export type PartKind = "ball" | "polyhedron" | "capsule" | "cylinder" | "ellipsoid";

/** A convex part of a body; which of the lengths it has depends on its kind. */
export interface Part {
  kind: PartKind;
  /** Origin of its frame, seen from the body's centre of mass, and its frame to the shape's. */
  position: Vector;
  orientation: Quaternion;
  radius: number;
  /** Of a cylinder, or the straight part of a capsule, along its z axis. */
  length: number;
  semiAxes: Vector;
  vertices: Vector[];
  /** The corners of each face in a loop, counter-clockwise seen from outside. */
  faces: number[][];
}

/** A shape that bodies share, in a frame with its origin at the centre of mass. */
export interface Geometry {
  /** That of its part, or "compound". */
  kind: string;
  /** Largest distance of a point from the centre of mass. */
  radius: number;
  /** Principal axes to the shape's frame. */
  principalAxes: Quaternion;
  parts: Part[];
}

/** Surroundings of triangles, which stand still or move at constant velocities. */
export interface Surroundings {
  id: number;
  name: string | null;
  vertices: Float64Array;
  triangles: Int32Array;
  position: Vector;
  orientation: Quaternion;
  velocity: Vector;
  angularVelocity: Vector;
}

/** How bodies stand and turn at the start. */
export interface Turning {
  /** Which of the recording's geometries each body has; −1 for a ball. */
  geometry: Int32Array;
  /** Principal moments of inertia; infinite where the motion is prescribed. */
  moments: Float64Array;
  /** The shape's frame to world. */
  orientation: Float64Array;
  /** World axes (rad/s). */
  angularVelocity: Float64Array;
}

/** How A and B of each impact stand and turn right after it. */
export interface Turns {
  orientation: [Float64Array, Float64Array];
  angularVelocity: [Float64Array, Float64Array];
}

export interface Bodies {
  /** Bodies of the run but for planes and meshes; `count` of them are here. */
  total: number;
  count: number;
  id: Int32Array;
  name: (string | null)[] | null;
  /** Of a ball; of another shape the largest distance from its centre of mass. */
  radius: Float64Array;
  mass: Float64Array;
  position: Float64Array;
  velocity: Float64Array;
  fixed: Uint8Array;
  /** Null where nothing but balls without spin is. */
  turning: Turning | null;
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
  /** Null in a recording of balls, and in one that leaves them to the law of impact. */
  turns: Turns | null;
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
  /** The shapes, each once. */
  geometries: Geometry[];
  planes: Plane[];
  meshes: Surroundings[];
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

function quaternion(value: unknown, where: string): Quaternion {
  if (!Array.isArray(value) || value.length !== 4 || value.some((x) => typeof x !== "number")) {
    throw new RecordingError(`${where} is not four numbers`);
  }
  return value as Quaternion;
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
    turning: from.orientation === undefined ? null : {
      geometry: packed(from, "geometry", where, Int32Array, count),
      moments: packed(from, "moments", where, Float64Array, 3 * count),
      orientation: packed(from, "orientation", where, Float64Array, 4 * count),
      angularVelocity: packed(from, "angular_velocity", where, Float64Array, 3 * count),
    },
  };
}

const PART_KINDS: readonly string[] = ["ball", "polyhedron", "capsule", "cylinder", "ellipsoid"];

function parsePart(value: unknown, where: string): Part {
  const from = fields(value, where);
  const kind = String(from.kind);
  if (!PART_KINDS.includes(kind)) throw new RecordingError(`${where}.kind is none of ${PART_KINDS.join(", ")}`);
  const part: Part = {
    kind: kind as PartKind,
    position: vector(from.position, `${where}.position`),
    orientation: quaternion(from.orientation, `${where}.orientation`),
    radius: 0, length: 0, semiAxes: [0, 0, 0], vertices: [], faces: [],
  };
  if (kind === "polyhedron") {
    part.vertices = list(from, "vertices", where).map((at, i) => vector(at, `${where}.vertices[${i}]`));
    part.faces = list(from, "faces", where).map((face, i) => {
      const whole = (corner: unknown) => Number.isInteger(corner) && part.vertices[corner as number] !== undefined;
      if (!Array.isArray(face) || face.length < 3 || !face.every(whole)) throw new RecordingError(`${where}.faces[${i}] is not a loop of vertices`);
      return face as number[];
    });
  } else if (kind === "ellipsoid") {
    part.semiAxes = vector(from.semi_axes, `${where}.semi_axes`);
  } else {
    part.radius = number(from, "radius", where);
    if (kind !== "ball") part.length = number(from, "length", where);
  }
  return part;
}

function parseGeometry(value: unknown, index: number): Geometry {
  const where = `geometries[${index}]`;
  const from = fields(value, where);
  return {
    kind: String(from.kind),
    radius: number(from, "radius", where),
    principalAxes: quaternion(from.principal_axes, `${where}.principal_axes`),
    parts: list(from, "parts", where).map((part, i) => parsePart(part, `${where}.parts[${i}]`)),
  };
}

function parseMesh(value: unknown, index: number): Surroundings {
  const where = `meshes[${index}]`;
  const from = fields(value, where);
  const unpacked = <T>(name: string, type: { new (buffer: ArrayBuffer): T }) => new type(bytes(from[name], `${where}.${name}`));
  return {
    id: number(from, "id", where),
    name: typeof from.name === "string" && from.name !== "" ? from.name : null,
    vertices: unpacked("vertices", Float64Array),
    triangles: unpacked("triangles", Int32Array),
    position: vector(from.position, `${where}.position`),
    orientation: quaternion(from.orientation, `${where}.orientation`),
    velocity: vector(from.velocity, `${where}.velocity`),
    angularVelocity: vector(from.angular_velocity, `${where}.angular_velocity`),
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
    turns: from.orientation_a === undefined ? null : {
      orientation: [packed(from, "orientation_a", where, Float64Array, 4 * count), packed(from, "orientation_b", where, Float64Array, 4 * count)],
      angularVelocity: [packed(from, "angular_velocity_a", where, Float64Array, 3 * count), packed(from, "angular_velocity_b", where, Float64Array, 3 * count)],
    },
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
  const recording: Recording = {
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
    geometries: data.geometries === undefined ? [] : list(data, "geometries", "the data").map(parseGeometry),
    planes: list(data, "planes", "the data").map(parsePlane),
    meshes: data.meshes === undefined ? [] : list(data, "meshes", "the data").map(parseMesh),
    impacts: parseImpacts(fields(data.impacts, "impacts")),
    series: parseSeries(fields(data.series, "series")),
    summary: typeof data.summary === "object" && data.summary !== null ? (data.summary as Fields) : {},
  };
  const shapes = recording.geometries.length;
  if (recording.bodies.turning?.geometry.some((shape) => shape >= shapes)) throw new RecordingError("bodies.geometry names a shape that is not there");
  return recording;
}

/** The row of each body by its id. */
export function rowsById(bodies: Bodies): Map<number, number> {
  return new Map(Array.from(bodies.id, (id, row) => [id, row]));
}
