// One impact looked at closely: the contact, the normal, what the bodies were doing before and after. Drawn over the picture.

import { element, setText, svg } from "./elements";
import type { Flight } from "./flight";
import { short } from "./format";
import { AXES, type Recording, type Vector } from "./recording";
import type { Stage } from "./stage";

/** The longest arrow is at least this long, and reaches well out of the balls (CSS pixels). */
const LONGEST = 90;
/** Arrows shorter than this have no head worth drawing (CSS pixels). */
const SHORTEST = 3;

/** One body of an impact; `row` is −1 for a plane. */
export interface Party {
  id: number;
  row: number;
  label: string;
  radius: number;
  before: Vector;
  after: Vector;
  /** Angular velocities (rad/s, world axes). */
  spinBefore: Vector;
  spinAfter: Vector;
}

export function bodyLabel(recording: Recording, row: number, id: number): string {
  if (row >= 0) {
    const name = recording.bodies.name?.[row];
    const shape = recording.bodies.turning?.geometry[row] ?? -1;
    const kind = shape < 0 ? "ball" : recording.geometries[shape].kind;
    return name ? name : `${kind === "polyhedron" ? "body" : kind} ${id}`;
  }
  const walls = ["wall −x", "wall +x", "wall −y", "wall +y", "wall −z", "wall +z"];
  const plane = recording.planes.find((one) => one.id === id);
  if (plane?.name) return plane.name;
  const mesh = recording.meshes.find((one) => one.id === id);
  if (mesh) return mesh.name ?? `mesh ${id}`;
  return id < 0 ? (walls[-id - 1] ?? `wall ${id}`) : plane ? `plane ${id}` : `ball ${id}`;
}

export function parties(recording: Recording, flight: Flight, impact: number): [Party, Party] {
  const party = (id: number, row: number, segment: number): Party => ({
    id,
    row,
    label: bodyLabel(recording, row, id),
    radius: row >= 0 ? recording.bodies.radius[row] : 0,
    before: row >= 0 ? flight.velocityBefore(row, segment) : planeVelocity(recording, id),
    after: row >= 0 ? flight.velocityAfter(segment) : planeVelocity(recording, id),
    spinBefore: row >= 0 ? flight.angularVelocityBefore(row, segment) : meshSpin(recording, id),
    spinAfter: row >= 0 ? flight.angularVelocityAfter(segment) : meshSpin(recording, id),
  });
  const { a, b } = recording.impacts;
  return [
    party(a[impact], flight.rowA[impact], flight.segmentA[impact]),
    party(b[impact], flight.rowB[impact], flight.segmentB[impact]),
  ];
}

/** Velocity of a plane or a mesh; not a number for a body that is not on the page. */
function planeVelocity(recording: Recording, id: number): Vector {
  const found = [...recording.planes, ...recording.meshes].find((one) => one.id === id);
  return found?.velocity ?? (id < 0 ? [0, 0, 0] : [NaN, NaN, NaN]);
}

function meshSpin(recording: Recording, id: number): Vector {
  return recording.meshes.find((mesh) => mesh.id === id)?.angularVelocity ?? [0, 0, 0];
}

/**
 * Half of the time around each impact that is worth slowing down for: until the bodies are half a radius apart, but no longer
 * than half a second of watching at the base rate.
 */
export function slowWindows(recording: Recording, flight: Flight, base: number): Float64Array {
  const { impacts, bodies } = recording;
  return Float64Array.from({ length: impacts.count }, (_, i) => {
    const radii = [flight.rowA[i], flight.rowB[i]].filter((row) => row >= 0).map((row) => bodies.radius[row]);
    return Math.min((0.5 * Math.min(...radii)) / impacts.approachSpeed[i], 0.5 * base);
  });
}

export class ImpactOverlay {
  readonly drawing = svg("svg", { class: "overlay", "aria-hidden": "true" });
  /** The impulse, in words. */
  readonly tag = element("div", { class: "tag", hidden: true });
  private shown = -1;

  constructor(
    private readonly recording: Recording,
    private readonly flight: Flight,
    private readonly stage: Stage,
  ) {}

  /** Draws impact `impact` over the picture; −1 draws nothing. Call after the picture itself has been drawn. */
  draw(impact: number): void {
    this.tag.hidden = impact < 0;
    if (impact < 0) {
      if (this.shown >= 0) this.drawing.replaceChildren();
      this.shown = impact;
      return;
    }
    this.shown = impact;
    const { impacts } = this.recording;
    const pair = parties(this.recording, this.flight, impact);
    const places = pair.map((party) => (party.row >= 0 ? this.stage.drawnPosition(party.row) : null));
    // The contact as drawn: wherever the periodic image of the body is that is shown.
    const normal = AXES.map((k) => impacts.normal[3 * impact + k]) as Vector;
    const anchor = pair[0].row >= 0 && pair[0].radius > 0 ? 0 : 1;
    const drawnAnchor = places[anchor];
    const contact = AXES.map((k) => {
      const at = impacts.point[3 * impact + k];
      const period = this.flight.period[k];
      return at + (drawnAnchor && period > 0 ? period * Math.round((drawnAnchor[k] - at) / period) : 0);
    }) as Vector;

    const pixel = this.stage.pixelAt(contact);
    const fastest = Math.max(...pair.flatMap((party) => [length(party.before), length(party.after)]));
    const largest = Math.max(...pair.map((party) => party.radius || 0)) / pixel;
    const longest = Math.min(Math.max(LONGEST, 2.3 * largest), 240);
    const perSpeed = fastest > 0 ? (longest * pixel) / fastest : 0;
    const parts: SVGElement[] = [];

    const [cx, cy] = this.stage.project(contact);
    const tip = this.stage.project(along(contact, normal, Math.max(0.5 * LONGEST, 0.72 * Math.min(largest, 140)) * pixel));
    parts.push(...arrow([cx, cy], tip, "normal"));
    // On the screen, along the plane of contact, where the bodies are going on average.
    let drift = 0;
    const [nx, ny] = direction([cx, cy], tip);
    pair.forEach((party, which) => {
      const place = places[which];
      if (!place) return;
      const centre = this.stage.project(place);
      parts.push(...arrow(this.stage.project(along(place, party.before, -perSpeed)), centre, "before"));
      const goal = this.stage.project(along(place, party.after, perSpeed));
      drift += -ny * (goal[0] - centre[0]) + nx * (goal[1] - centre[1]);
      parts.push(...arrow(centre, goal, "after"));
    });
    // How the bodies turn: part of a circle about the axis, the longer the faster, before on the inside.
    const quickest = Math.max(...pair.flatMap((party) => [length(party.spinBefore), length(party.spinAfter)]));
    pair.forEach((party, which) => {
      const place = places[which];
      if (!place || !(quickest > 0)) return;
      parts.push(...this.arc(place, party.spinBefore, 0.46 * party.radius, length(party.spinBefore) / quickest, "before"));
      parts.push(...this.arc(place, party.spinAfter, 0.6 * party.radius, length(party.spinAfter) / quickest, "after"));
    });
    parts.push(svg("circle", { cx, cy, r: 3.5, class: "contact" }));
    // The impulse stands in the gap between the two bodies, on the side they do not fly off to.
    const away = drift > 0 ? -1 : 1;
    const off = Math.max(34, Math.min(0.95 * largest, 150));
    const [lx, ly] = [cx - away * ny * off, cy + away * nx * off];
    setText(this.tag, `j = ${short(impacts.impulse[impact], 4)} N·s`);
    const { offsetWidth: wide, offsetHeight: tall } = this.tag;
    const left = lx - cx < -12 ? lx - wide : lx - cx > 12 ? lx : lx - wide / 2;
    const within = (x: number, room: number) => Math.min(Math.max(x, 6), room - 6);
    this.tag.style.transform = `translate(${within(left, this.stage.canvas.clientWidth - wide)}px, ${within(ly - tall / 2, this.stage.canvas.clientHeight - tall)}px)`;
    this.drawing.replaceChildren(...parts);
  }

  /** An arrow about the axis of an angular velocity, its middle on the side of the eye. */
  private arc(centre: Vector, spin: Vector, radius: number, share: number, kind: string): SVGElement[] {
    const sweep = MOST_SWEEP * share;
    if (!(sweep > LEAST_SWEEP) || radius < SMALLEST_ARC * this.stage.pixelAt(centre)) return [];
    const axis = along([0, 0, 0], spin, 1 / length(spin));
    const eye = this.stage.toEye(centre);
    const across = axis[0] * eye[0] + axis[1] * eye[1] + axis[2] * eye[2];
    let front = along(eye, axis, -across);
    // Seen along the axis, any side will do; below is where the other arrows are not.
    if (length(front) < 0.1) front = Math.abs(axis[2]) > 0.5 ? [0, -1, 0] : [0, 0, -1];
    front = along(front, axis, -(front[0] * axis[0] + front[1] * axis[1] + front[2] * axis[2]));
    front = along([0, 0, 0], front, 1 / length(front));
    const side: Vector = [axis[1] * front[2] - axis[2] * front[1], axis[2] * front[0] - axis[0] * front[2], axis[0] * front[1] - axis[1] * front[0]];
    const pieces = Math.ceil(sweep / 0.1);
    const points = Array.from({ length: pieces + 1 }, (_, i) => {
      const angle = sweep * (i / pieces - 0.5);
      return this.stage.project(along(along(centre, front, radius * Math.cos(angle)), side, radius * Math.sin(angle)));
    });
    const head = arrow(points[points.length - 5] ?? points[0], points[points.length - 1], kind).slice(2);
    const path = { points: points.slice(0, -1).map((point) => point.join(",")).join(" "), fill: "none" };
    return [svg("polyline", { ...path, class: "halo" }), svg("polyline", { ...path, class: kind }), ...head];
  }
}

/** Arcs smaller than this would lie over the straight arrows (CSS pixels). */
const SMALLEST_ARC = 20;
/** Arcs that sweep less than this (rad) say nothing. */
const LEAST_SWEEP = 0.12;
/** What the quickest turning sweeps (rad). */
const MOST_SWEEP = 2.6;

function arrow(from: [number, number], to: [number, number], kind: string): SVGElement[] {
  const long = Math.hypot(to[0] - from[0], to[1] - from[1]);
  if (!(long >= SHORTEST)) return [];
  const [dx, dy] = direction(from, to);
  const head = Math.min(9, 0.6 * long);
  const base: [number, number] = [to[0] - head * dx, to[1] - head * dy];
  const wide = 0.42 * head;
  const corners = [to, [base[0] - wide * dy, base[1] + wide * dx], [base[0] + wide * dy, base[1] - wide * dx]];
  const shaft = { x1: from[0], y1: from[1], x2: base[0], y2: base[1] };
  return [
    svg("line", { ...shaft, class: "halo" }),
    svg("line", { ...shaft, class: kind }),
    svg("polygon", { points: corners.map((corner) => corner.join(",")).join(" "), class: kind }),
  ];
}

function direction(from: [number, number], to: [number, number]): [number, number] {
  const long = Math.hypot(to[0] - from[0], to[1] - from[1]) || 1;
  return [(to[0] - from[0]) / long, (to[1] - from[1]) / long];
}

function length(v: Vector): number {
  return Math.hypot(...v);
}

function along(from: Vector, v: Vector, factor: number): Vector {
  return AXES.map((k) => from[k] + factor * v[k]) as Vector;
}
