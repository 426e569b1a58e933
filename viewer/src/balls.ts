// Balls drawn as perfect spheres: each is one square facing the eye, on which the fragment shader finds the sphere itself.
// So contacts stay contacts at any zoom, and twenty thousand balls are forty thousand triangles.

import {
  BufferAttribute, Color, CustomBlending, DynamicDrawUsage, GLSL3, InstancedBufferAttribute, InstancedBufferGeometry, Mesh, OneFactor, ShaderMaterial,
  Vector3, ZeroFactor,
} from "three";

const VERTEX = /* glsl */ `
in vec4 ball;      // centre and radius
in vec3 tint;
in float stripe;
in vec4 turn;      // quaternion x y z w
in float spins;
uniform float pixel;   // size of a pixel: of the view (orthographic) or at distance 1 (perspective)
uniform ivec2 struck;  // the two bodies of the impact being looked at
uniform float apart;   // how far all others step back, 0 to 1: paler, and those in front smaller, down to nothing
uniform float nearest; // how near to the eye those may be that stay
out vec3 vPoint;
out vec2 vSquare;
flat out vec3 vCentre;
flat out float vRadius;
flat out vec3 vTint;
flat out float vStripe;
flat out vec4 vTurn;
flat out float vSpins;
flat out float vDim;
flat out float vFront;
void main() {
  vec3 centre = (modelViewMatrix * vec4(ball.xyz, 1.0)).xyz;
  float away = isOrthographic ? 1.0 : length(centre);
  float radius = ball.w > 0.0 ? max(ball.w, 1.1 * pixel * away) : 0.0;
  bool isStruck = gl_InstanceID == struck.x || gl_InstanceID == struck.y;
  if (!isStruck && !isOrthographic && -centre.z < nearest) radius *= 1.0 - apart;
  vec3 toward = isOrthographic ? vec3(0.0, 0.0, 1.0) : -centre / away;
  vec3 right = normalize(cross(vec3(0.0, 1.0, 0.0001), toward));
  vec3 up = cross(toward, right);
  // The circle that the sphere's outline makes in the plane through its centre.
  float outline = isOrthographic ? radius : radius * away / sqrt(max(away * away - radius * radius, 1e-12));
  vSquare = position.xy * (1.0 + 1.5 * pixel * away / max(radius, 1e-30));
  vPoint = centre + (right * vSquare.x + up * vSquare.y) * outline;
  vCentre = centre;
  vRadius = radius;
  vTint = tint;
  vStripe = stripe;
  vTurn = turn;
  vSpins = spins;
  vDim = isStruck ? 0.0 : 0.8 * apart;
  vFront = isStruck && apart > 0.0 ? 1.0 : 0.0;
  gl_Position = radius > 0.0 ? projectionMatrix * vec4(vPoint, 1.0) : vec4(0.0, 0.0, 2.0, 1.0);
}`;

const FRAGMENT = /* glsl */ `
in vec3 vPoint;
in vec2 vSquare;
flat in vec3 vCentre;
flat in float vRadius;
flat in vec3 vTint;
flat in float vStripe;
flat in vec4 vTurn;
flat in float vSpins;
flat in float vDim;
flat in float vFront;
uniform mat4 projectionMatrix;
uniform vec3 background;
uniform vec3 ivory;
out vec4 colour;
float side(float x) { return clamp(x / max(fwidth(x), 1e-6), -1.0, 1.0); }
void main() {
  float rho = length(vSquare);
  float soft = fwidth(rho);
  float cover = 1.0 - smoothstep(1.0 - soft, 1.0 + 0.5 * soft, rho);
  if (cover <= 0.0) discard;
  vec3 hit;
  if (isOrthographic) {
    vec2 off = vPoint.xy - vCentre.xy;
    hit = vec3(vPoint.xy, vCentre.z + sqrt(max(0.0, vRadius * vRadius - dot(off, off))));
  } else {
    vec3 ray = normalize(vPoint);
    float along = dot(ray, vCentre);
    hit = ray * (along - sqrt(max(0.0, along * along - dot(vCentre, vCentre) + vRadius * vRadius)));
  }
  vec3 n = normalize(hit - vCentre);
  vec3 light = normalize(vec3(-0.42, 0.62, 0.66));
  vec3 eye = isOrthographic ? vec3(0.0, 0.0, 1.0) : normalize(-hit);

  // The same normal in the ball's own axes: what is painted on it turns with it.
  vec3 inWorld = (vec4(n, 0.0) * viewMatrix).xyz;
  vec3 own = inWorld + 2.0 * cross(-vTurn.xyz, cross(-vTurn.xyz, inWorld) + vTurn.w * inWorld);
  float latitude = abs(own.y);
  float tone = 0.5 - 0.5 * side(own.x) * side(own.y) * side(own.z);
  vec3 base = vTint;
  if (vStripe > 0.5) base = mix(vTint, ivory, smoothstep(0.52, 0.52 + 2.0 * fwidth(latitude), latitude));
  else if (vSpins > 0.5) base = mix(vTint, mix(vTint, dot(vTint, vec3(1.0)) > 2.4 ? vec3(0.80, 0.30, 0.24) : ivory, 0.62), tone);
  float diffuse = pow(0.5 + 0.5 * dot(n, light), 1.35);
  float gloss = pow(max(dot(reflect(-light, n), eye), 0.0), 42.0);
  float rim = pow(1.0 - max(dot(n, eye), 0.0), 3.0);
  vec3 lit = base * (0.40 + 0.70 * diffuse) + gloss * 0.38 - rim * 0.10 * base;
  colour = vec4(mix(clamp(lit, 0.0, 1.0), background, vDim), cover);

  vec4 clip = projectionMatrix * vec4(hit, 1.0);
  float depth = 0.5 + 0.5 * clip.z / clip.w;
  // Through everything else: the two bodies one has come to see.
  gl_FragDepth = vFront > 0.5 ? 0.02 * depth : 0.02 + 0.98 * depth;
}`;

const SHADOW_VERTEX = /* glsl */ `
in vec4 ball;
uniform vec3 down;    // from the eye to the table
uniform vec3 right;
uniform vec3 up;
out vec2 vSquare;
void main() {
  vSquare = position.xy;
  vec3 at = ball.xyz + ball.w * (down * 0.98 + right * 0.30 - up * 0.42 + 1.45 * (right * position.x + up * position.y));
  gl_Position = projectionMatrix * modelViewMatrix * vec4(at, 1.0);
  // Depth as that of what is drawn over it.
  gl_Position.z = 0.98 * gl_Position.z + 0.02 * gl_Position.w;
}`;

const SHADOW_FRAGMENT = /* glsl */ `
in vec2 vSquare;
out vec4 colour;
void main() {
  float shade = 1.0 - smoothstep(0.35, 1.0, length(vSquare));
  colour = vec4(0.0, 0.0, 0.0, 0.42 * shade * shade);
}`;

export class Balls {
  readonly mesh: Mesh;
  readonly shadows: Mesh;
  /** Centre and radius of each ball, as drawn. */
  readonly placed: Float32Array;
  private readonly place: InstancedBufferAttribute;
  private readonly tint: InstancedBufferAttribute;
  private readonly stripe: InstancedBufferAttribute;
  private readonly turn: InstancedBufferAttribute;
  private readonly material: ShaderMaterial;

  /** A radius of 0 is drawn as nothing. `spins`: which balls turn, so that they are painted in two tones. */
  constructor(radii: Float64Array, colours: Float32Array, stripes: Float32Array, spins: Float32Array) {
    const n = radii.length;
    this.placed = new Float32Array(4 * n);
    for (let row = 0; row < n; row++) this.placed[4 * row + 3] = radii[row] > 0 ? radii[row] : 0;
    this.place = new InstancedBufferAttribute(this.placed, 4).setUsage(DynamicDrawUsage);
    this.tint = new InstancedBufferAttribute(colours, 3).setUsage(DynamicDrawUsage);
    this.stripe = new InstancedBufferAttribute(stripes, 1);
    const square = new InstancedBufferGeometry();
    square.instanceCount = n;
    square.setIndex([0, 1, 2, 0, 2, 3]);
    square.setAttribute("position", new BufferAttribute(new Float32Array([-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0]), 3));
    square.setAttribute("ball", this.place);
    square.setAttribute("tint", this.tint);
    square.setAttribute("stripe", this.stripe);
    this.turn = new InstancedBufferAttribute(new Float32Array(4 * n), 4).setUsage(DynamicDrawUsage);
    for (let row = 0; row < n; row++) this.turn.array[4 * row + 3] = 1;
    square.setAttribute("turn", this.turn);
    square.setAttribute("spins", new InstancedBufferAttribute(spins, 1));

    this.material = new ShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      // The alpha of an edge says how many samples of a pixel the ball covers; it must not get into the picture itself, which
      // would let the page shine through.
      alphaToCoverage: true,
      blending: CustomBlending,
      blendSrc: OneFactor,
      blendDst: ZeroFactor,
      blendSrcAlpha: ZeroFactor,
      blendDstAlpha: OneFactor,
      uniforms: {
        pixel: { value: 1 },
        struck: { value: new Int32Array([-1, -1]) },
        apart: { value: 0 },
        nearest: { value: 0 },
        background: { value: new Color() },
        ivory: { value: new Color().setRGB(0.955, 0.93, 0.87) },
      },
    });
    this.mesh = new Mesh(square, this.material);
    this.shadows = new Mesh(square, new ShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: SHADOW_VERTEX,
      fragmentShader: SHADOW_FRAGMENT,
      transparent: true,
      depthWrite: false,
      uniforms: { down: { value: new Vector3() }, right: { value: new Vector3() }, up: { value: new Vector3() } },
    }));
    // The balls are wherever the recording says; nothing to cull by.
    this.mesh.frustumCulled = this.shadows.frustumCulled = false;
    this.mesh.renderOrder = 2;
    this.shadows.renderOrder = 1;
    this.shadows.visible = false;
  }

  moved(): void {
    this.place.needsUpdate = true;
  }

  /** Turns all balls as `orientations` (w, x, y, z) says. */
  turned(orientations: Float64Array): void {
    for (let i = 0; i < this.turn.array.length; i++) this.turn.array[i] = orientations[(i & ~3) + ((i + 1) & 3)];
    this.turn.needsUpdate = true;
  }

  painted(): void {
    this.tint.needsUpdate = true;
    this.stripe.needsUpdate = true;
  }

  castShadows(down: Vector3, right: Vector3, up: Vector3): void {
    const { uniforms } = this.shadows.material as ShaderMaterial;
    uniforms.down.value.copy(down);
    uniforms.right.value.copy(right);
    uniforms.up.value.copy(up);
    this.shadows.visible = true;
  }

  /** What the eye needs to know before each picture. */
  set(pixel: number, struck: [number, number], apart: number, nearest: number, background: Color): void {
    const { uniforms } = this.material;
    uniforms.pixel.value = pixel;
    uniforms.struck.value[0] = struck[0];
    uniforms.struck.value[1] = struck[1];
    uniforms.apart.value = apart;
    uniforms.nearest.value = nearest;
    uniforms.background.value.copy(background);
  }
}
