// Surroundings of triangles: seen through, with their creases drawn, so that what is inside them stays in sight.

import { BufferAttribute, BufferGeometry, Color, DoubleSide, EdgesGeometry, GLSL3, Group, LineBasicMaterial, LineSegments, Mesh, Quaternion, ShaderMaterial, Vector3 } from "three";
import { parseColour } from "./colours";
import type { Surroundings } from "./recording";

/** Faces that meet at less than this have no crease between them (degrees). */
const CREASE = 20;

const VERTEX = /* glsl */ `
out vec3 vAt;
out vec3 vNormal;
void main() {
  vec4 at = modelViewMatrix * vec4(position, 1.0);
  vAt = at.xyz;
  vNormal = normalMatrix * normal;
  gl_Position = projectionMatrix * at;
}`;

const FRAGMENT = /* glsl */ `
in vec3 vAt;
in vec3 vNormal;
uniform vec3 tint;
out vec4 colour;
void main() {
  vec3 eye = isOrthographic ? vec3(0.0, 0.0, 1.0) : normalize(-vAt);
  vec3 n = normalize(vNormal);
  n = dot(n, eye) < 0.0 ? -n : n;
  float diffuse = 0.5 + 0.5 * dot(n, normalize(vec3(-0.42, 0.62, 0.66)));
  // As glass: thicker where one looks along it.
  float edgeOn = pow(1.0 - dot(n, eye), 2.0);
  colour = vec4(tint * (0.55 + 0.55 * diffuse), 0.20 + 0.30 * edgeOn);
}`;

interface Wall {
  group: Group;
  mesh: Surroundings;
  fill: ShaderMaterial;
  lines: LineBasicMaterial;
}

export class Walls {
  readonly group = new Group();
  private readonly walls: Wall[];

  constructor(meshes: Surroundings[], private readonly centre: Vector3) {
    this.walls = meshes.map((mesh) => {
      const whole = new BufferGeometry();
      whole.setAttribute("position", new BufferAttribute(Float32Array.from(mesh.vertices), 3));
      whole.setIndex(new BufferAttribute(Uint32Array.from(mesh.triangles), 1));
      const flat = whole.toNonIndexed();
      flat.computeVertexNormals();
      const fill = new ShaderMaterial({
        glslVersion: GLSL3, vertexShader: VERTEX, fragmentShader: FRAGMENT, transparent: true, depthWrite: false, side: DoubleSide,
        uniforms: { tint: { value: new Color() } },
      });
      const lines = new LineBasicMaterial({ transparent: true, opacity: 0.75 });
      const group = new Group();
      group.add(new Mesh(flat, fill), new LineSegments(new EdgesGeometry(whole, CREASE), lines));
      for (const part of group.children) {
        part.frustumCulled = false;
        part.renderOrder = 3;
      }
      this.group.add(group);
      return { group, mesh, fill, lines };
    });
    this.move(0);
  }

  /** Puts all of them where they are at `time`. */
  move(time: number): void {
    for (const { group, mesh } of this.walls) {
      group.position.set(mesh.position[0], mesh.position[1], mesh.position[2]).addScaledVector(new Vector3(...mesh.velocity), time).sub(this.centre);
      const [w, x, y, z] = mesh.orientation;
      group.quaternion.set(x, y, z, w);
      const spin = new Vector3(...mesh.angularVelocity);
      const speed = spin.length();
      if (speed > 0) group.quaternion.premultiply(new Quaternion().setFromAxisAngle(spin.divideScalar(speed), (speed * time) % (2 * Math.PI)));
    }
  }

  paint(fill: string, line: string): void {
    for (const wall of this.walls) {
      wall.fill.uniforms.tint.value.setRGB(...parseColour(fill));
      wall.lines.color.setRGB(...parseColour(line));
    }
  }
}
