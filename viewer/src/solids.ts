// Bodies of any shape: each shape's triangles once, drawn for all bodies that have it at one go.

import { BufferAttribute, Color, DynamicDrawUsage, GLSL3, Group, InstancedBufferAttribute, InstancedBufferGeometry, Mesh, ShaderMaterial, type Vector3 } from "three";
import { conjugate, rotated } from "./quaternions";
import type { Quaternion, Recording, Vector } from "./recording";
import { firstHit, surfaceOf, type Surface } from "./shapes";

/** More triangles than this in all, and round shapes get fewer. */
const MANY_TRIANGLES = 1_500_000;

const VERTEX = /* glsl */ `
in vec4 place;   // centre, and which body it is
in vec4 turn;    // quaternion x y z w
in vec3 tint;
in float edge;
in vec3 mark;
uniform float radius;
uniform float pixel;
uniform ivec2 struck;
uniform float apart;
uniform float nearest;
out vec3 vAt;
out vec3 vNormal;
out vec3 vMark;
out float vEdge;
flat out vec3 vTint;
flat out float vDim;
flat out float vSize;
vec3 turned(vec3 v) { return v + 2.0 * cross(turn.xyz, cross(turn.xyz, v) + turn.w * v); }
void main() {
  int row = int(place.w + 0.5);
  bool isStruck = row == struck.x || row == struck.y;
  vec3 centre = (modelViewMatrix * vec4(place.xyz, 1.0)).xyz;
  float away = isOrthographic ? 1.0 : length(centre);
  vSize = radius / (pixel * away);
  // Never smaller than a pixel; those in front of the impact looked at step back.
  float scale = max(1.0, 1.1 / vSize);
  if (!isStruck && !isOrthographic && -centre.z < nearest) scale *= 1.0 - apart;
  vec4 at = modelViewMatrix * vec4(place.xyz + scale * turned(position), 1.0);
  vAt = at.xyz;
  vNormal = (viewMatrix * vec4(turned(normal), 0.0)).xyz;
  vMark = mark;
  vEdge = edge;
  vTint = tint;
  vDim = isStruck ? 0.0 : 0.8 * apart;
  gl_Position = projectionMatrix * at;
  // Through everything else: the two bodies one has come to see. As the balls do it, depth is 0.02 d or 0.02 + 0.98 d.
  float w = gl_Position.w;
  float depth = 0.5 * (gl_Position.z + w);
  depth = isStruck && apart > 0.0 ? 0.02 * depth : 0.02 * w + 0.98 * depth;
  gl_Position.z = 2.0 * depth - w;
  // What has shrunk to nothing leaves no dust.
  if (scale < 1e-3) gl_Position = vec4(0.0, 0.0, 2.0, 1.0);
}`;

const FRAGMENT = /* glsl */ `
in vec3 vAt;
in vec3 vNormal;
in vec3 vMark;
in float vEdge;
flat in vec3 vTint;
flat in float vDim;
flat in float vSize;
uniform vec3 background;
uniform vec3 ivory;
out vec4 colour;
float side(float x) { return clamp(x / max(fwidth(x), 1e-6), -1.0, 1.0); }
void main() {
  vec3 n = normalize(vNormal);
  vec3 light = normalize(vec3(-0.42, 0.62, 0.66));
  vec3 eye = isOrthographic ? vec3(0.0, 0.0, 1.0) : normalize(-vAt);
  // Two tones, of the same hue.
  float tone = 0.5 - 0.5 * side(vMark.x) * side(vMark.y) * side(vMark.z);
  vec3 base = mix(vTint, mix(vTint, ivory, 0.62), tone);
  float diffuse = pow(0.5 + 0.5 * dot(n, light), 1.35);
  float gloss = pow(max(dot(reflect(-light, n), eye), 0.0), 42.0);
  float rim = pow(1.0 - max(dot(n, eye), 0.0), 3.0);
  // Flat faces have no gradient of their own: more contrast between them.
  vec3 smoothly = base * (0.40 + 0.70 * diffuse) + gloss * 0.30 - rim * 0.10 * base;
  float sky = 0.5 + 0.5 * n.y;
  vec3 flatly = base * (0.26 + 0.74 * diffuse + 0.16 * sky * sky) + gloss * 0.10;
  vec3 lit = vMark.z > 1.5 ? flatly : smoothly;
  float across = vEdge / max(fwidth(vEdge), 1e-12);
  float line = (1.0 - smoothstep(0.45, 1.15, across)) * clamp(vSize / 16.0, 0.0, 1.0);
  lit = mix(lit, base * 0.32, 0.66 * line);
  colour = vec4(mix(clamp(lit, 0.0, 1.0), background, vDim), 1.0);
}`;

/** The outline of a body, on the table it lies on, aside from the light. */
const SHADOW_VERTEX = /* glsl */ `
in vec4 place;
in vec4 turn;
uniform float radius;
uniform vec3 down;
uniform vec3 aside;
vec3 turned(vec3 v) { return v + 2.0 * cross(turn.xyz, cross(turn.xyz, v) + turn.w * v); }
void main() {
  vec3 at = turned(position);
  at -= down * dot(down, at);
  gl_Position = projectionMatrix * modelViewMatrix * vec4(place.xyz + at * 1.03 + radius * (down + 0.14 * aside), 1.0);
  gl_Position.z = 0.98 * gl_Position.z + 0.02 * gl_Position.w;
}`;

const SHADOW_FRAGMENT = /* glsl */ `
out vec4 colour;
void main() { colour = vec4(0.0, 0.0, 0.0, 0.20); }`;

interface Kind {
  surface: Surface;
  rows: number[];
  place: InstancedBufferAttribute;
  turn: InstancedBufferAttribute;
  tint: InstancedBufferAttribute;
  material: ShaderMaterial;
  radius: number;
}

export class Solids {
  readonly group = new Group();
  private readonly kinds: Kind[] = [];
  private readonly kindOf = new Map<number, Kind>();

  constructor(recording: Recording, private readonly colours: Float32Array) {
    const { bodies, geometries } = recording;
    const rowsOf: number[][] = geometries.map(() => []);
    bodies.turning?.geometry.forEach((shape, row) => { if (shape >= 0) rowsOf[shape].push(row); });
    const bodiesWith = (segments: number) => rowsOf.reduce((sum, rows, shape) => sum + rows.length * trianglesOf(shape, segments), 0);
    const trianglesOf = (shape: number, segments: number) => geometries[shape].parts.reduce((sum, part) => sum + (part.kind === "polyhedron" ? 3 * part.vertices.length : segments * segments), 0);
    const segments = [48, 32, 24, 16].find((count) => bodiesWith(count) < MANY_TRIANGLES) ?? 12;
    rowsOf.forEach((rows, shape) => {
      if (rows.length === 0) return;
      const geometry = geometries[shape];
      const surface = surfaceOf(geometry, segments);
      const n = rows.length;
      const buffers = new InstancedBufferGeometry();
      buffers.instanceCount = n;
      for (const [name, width] of [["position", 3], ["normal", 3], ["edge", 1], ["mark", 3]] as const) {
        buffers.setAttribute(name, new BufferAttribute(surface[name], width));
      }
      const instanced = (name: string, width: number) => {
        const attribute = new InstancedBufferAttribute(new Float32Array(width * n), width).setUsage(DynamicDrawUsage);
        buffers.setAttribute(name, attribute);
        return attribute;
      };
      const kind: Kind = {
        surface, rows, radius: geometry.radius,
        place: instanced("place", 4), turn: instanced("turn", 4), tint: instanced("tint", 3),
        material: new ShaderMaterial({
          glslVersion: GLSL3, vertexShader: VERTEX, fragmentShader: FRAGMENT,
          uniforms: {
            radius: { value: geometry.radius },
            pixel: { value: 1 }, struck: { value: new Int32Array([-1, -1]) }, apart: { value: 0 }, nearest: { value: 0 },
            background: { value: new Color() }, ivory: { value: new Color().setRGB(0.955, 0.93, 0.87) },
          },
        }),
      };
      rows.forEach((row, i) => {
        kind.place.array[4 * i + 3] = row;
        this.kindOf.set(row, kind);
      });
      const mesh = new Mesh(buffers, kind.material);
      mesh.frustumCulled = false;
      mesh.renderOrder = 2;
      this.kinds.push(kind);
      this.group.add(mesh);
    });
  }

  /** Bodies lie on a table: `down` from the eye to it, `aside` from the light, both unit vectors. */
  castShadows(down: Vector3, aside: Vector3): void {
    const shadows = this.group.children.map((drawn, i) => {
      const mesh = new Mesh((drawn as Mesh).geometry, new ShaderMaterial({
        glslVersion: GLSL3, vertexShader: SHADOW_VERTEX, fragmentShader: SHADOW_FRAGMENT, transparent: true, depthWrite: false,
        uniforms: { radius: { value: this.kinds[i].radius }, down: { value: down.clone() }, aside: { value: aside.clone() } },
      }));
      mesh.frustumCulled = false;
      mesh.renderOrder = 1;
      return mesh;
    });
    if (shadows.length > 0) this.group.add(...shadows);
  }

  /** Whether body `row` is drawn here. */
  has(row: number): boolean {
    return this.kindOf.has(row);
  }

  /** Puts all bodies where `positions` less `centre` says, turned by `orientations` (w, x, y, z). */
  move(positions: Float64Array, orientations: Float64Array, centre: { x: number; y: number; z: number }): void {
    for (const { rows, place, turn } of this.kinds) {
      rows.forEach((row, i) => {
        place.array[4 * i] = positions[3 * row] - centre.x;
        place.array[4 * i + 1] = positions[3 * row + 1] - centre.y;
        place.array[4 * i + 2] = positions[3 * row + 2] - centre.z;
        for (let k = 0; k < 4; k++) turn.array[4 * i + k] = orientations[4 * row + ((k + 1) % 4)];
      });
      place.needsUpdate = true;
      turn.needsUpdate = true;
    }
  }

  painted(): void {
    for (const { rows, tint } of this.kinds) {
      rows.forEach((row, i) => { for (let k = 0; k < 3; k++) tint.array[3 * i + k] = this.colours[3 * row + k]; });
      tint.needsUpdate = true;
    }
  }

  set(pixel: number, struck: [number, number], apart: number, nearest: number, background: Color): void {
    for (const { material: { uniforms } } of this.kinds) {
      uniforms.pixel.value = pixel;
      uniforms.struck.value[0] = struck[0];
      uniforms.struck.value[1] = struck[1];
      uniforms.apart.value = apart;
      uniforms.nearest.value = nearest;
      uniforms.background.value.copy(background);
    }
  }

  /** How far along a ray, from the body's centre seen `from`, body `row` begins; infinite if it is not met. */
  hit(row: number, orientation: Quaternion, from: Vector, along: Vector): number {
    const kind = this.kindOf.get(row);
    if (!kind) return Infinity;
    const back = conjugate(orientation);
    return firstHit(kind.surface, rotated(back, from), rotated(back, along));
  }
}
