// Soft spots on what bodies fall on, straight below them: without them nobody sees how high a body is.

import { BufferAttribute, DynamicDrawUsage, GLSL3, Group, InstancedBufferAttribute, InstancedBufferGeometry, Mesh, ShaderMaterial, Vector3 } from "three";
import type { Plane, Recording } from "./recording";

/** More bodies than this have no shadows: together they would be a carpet. */
const MOST_BODIES = 200;

const VERTEX = /* glsl */ `
in vec4 place;   // centre and size
uniform vec3 normal_;
uniform vec3 right;
uniform vec3 up;
uniform float offset;
uniform float strength;
out vec2 vSquare;
flat out float vStrength;
void main() {
  float height = dot(normal_, place.xyz) - offset;
  float above = max(height - place.w, 0.0) / max(place.w, 1e-30);
  // The higher the body, the wider and fainter.
  float size = place.w * (1.0 + 0.25 * min(above, 6.0));
  vStrength = height < -place.w ? 0.0 : strength / (1.0 + 0.45 * above);
  vSquare = position.xy;
  vec3 at = place.xyz - normal_ * height + size * 1.25 * (right * position.x + up * position.y);
  gl_Position = projectionMatrix * modelViewMatrix * vec4(at, 1.0);
}`;

const FRAGMENT = /* glsl */ `
in vec2 vSquare;
flat in float vStrength;
out vec4 colour;
void main() {
  float shade = 1.0 - smoothstep(0.1, 1.0, length(vSquare));
  colour = vec4(0.02, 0.04, 0.06, vStrength * shade);
}`;

export class FloorShadows {
  readonly group = new Group();
  private readonly place: InstancedBufferAttribute;
  private readonly floors: { plane: Plane; material: ShaderMaterial }[] = [];

  constructor(private readonly recording: Recording, private readonly centre: Vector3) {
    const { bodies, planes, gravity } = recording;
    const pull = Math.hypot(...gravity);
    this.place = new InstancedBufferAttribute(new Float32Array(4 * bodies.count), 4).setUsage(DynamicDrawUsage);
    if (pull === 0 || bodies.count > MOST_BODIES) return;
    const square = new InstancedBufferGeometry();
    square.instanceCount = bodies.count;
    square.setIndex([0, 1, 2, 0, 2, 3]);
    square.setAttribute("position", new BufferAttribute(new Float32Array([-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0]), 3));
    square.setAttribute("place", this.place);
    for (const plane of planes) {
      const normal = new Vector3(...plane.normal);
      if (normal.dot(new Vector3(...gravity)) > -0.7 * pull) continue;
      const right = new Vector3(1, 0, 0).cross(normal).length() > 0.5 ? new Vector3(1, 0, 0) : new Vector3(0, 1, 0);
      right.addScaledVector(normal, -right.dot(normal)).normalize();
      const material = new ShaderMaterial({
        glslVersion: GLSL3, vertexShader: VERTEX, fragmentShader: FRAGMENT, transparent: true, depthWrite: false,
        uniforms: { normal_: { value: normal }, right: { value: right }, up: { value: new Vector3().crossVectors(normal, right) }, offset: { value: 0 }, strength: { value: 0.4 } },
      });
      const mesh = new Mesh(square, material);
      mesh.frustumCulled = false;
      mesh.renderOrder = 3;
      this.group.add(mesh);
      this.floors.push({ plane, material });
    }
  }

  /** Puts them below bodies at `positions`, at `time`; they are gone where all but two bodies step back (`apart` 1). */
  move(positions: Float64Array, time: number, apart: number): void {
    if (this.floors.length === 0) return;
    const { bodies } = this.recording;
    const { x, y, z } = this.centre;
    const { array } = this.place;
    for (let row = 0; row < bodies.count; row++) {
      array[4 * row] = positions[3 * row] - x;
      array[4 * row + 1] = positions[3 * row + 1] - y;
      array[4 * row + 2] = positions[3 * row + 2] - z;
      // Of a body that is no ball, what is between its size and its thickness.
      array[4 * row + 3] = (bodies.turning?.geometry[row] ?? -1) < 0 ? bodies.radius[row] : 0.8 * bodies.radius[row];
    }
    this.place.needsUpdate = true;
    for (const { plane, material } of this.floors) {
      const { normal, velocity, offset } = plane;
      const along = normal[0] * (velocity[0] * time - x) + normal[1] * (velocity[1] * time - y) + normal[2] * (velocity[2] * time - z);
      material.uniforms.offset.value = offset + along;
      material.uniforms.strength.value = 0.4 * (1 - apart);
    }
  }
}
