// The picture: bodies, walls and planes, the camera. It draws what it is told to, when it is told to.

import {
  BoxGeometry, BufferAttribute, BufferGeometry, Color, ColorManagement, DoubleSide, EdgesGeometry, GLSL3, Group, LineBasicMaterial,
  LineDashedMaterial, LineSegments, LinearSRGBColorSpace, Mesh, MeshBasicMaterial, Object3D, OrthographicCamera, PerspectiveCamera,
  Path as Outline, Quaternion, Scene, ShaderMaterial, Shape, ShapeGeometry, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { Balls } from "./balls";
import { Palette, parseColour, themeColour, type Colouring } from "./colours";
import { wrap, type Flight } from "./flight";
import { AXES, type Axis, type Quaternion as Turn, type Recording, type Vector } from "./recording";
import { rotated } from "./quaternions";
import { FloorShadows } from "./shadows";
import { Solids } from "./solids";
import { Walls } from "./walls";

// Colours go to the screen as they are written in the style sheet.
ColorManagement.enabled = false;

/** How long the camera takes to come e times closer to where it is going (s). */
const CAMERA_EASE = 0.14;
/** Paths are drawn up to this many segments; more would be a tangle. */
const MOST_PATHS = 6000;
/** Straight pieces for each curved segment. */
const CURVE_PIECES = 20;

/** Whether all happens in one plane, and how to look at it. */
export interface View {
  flat: boolean;
  /** From the scene to the eye. */
  axis: Vector;
  up: Vector;
  low: Vector;
  high: Vector;
}

export function chooseView(recording: Recording, flight: Flight): View {
  const { bodies, gravity, axes, size, impacts } = recording;
  const low: Vector = [Infinity, Infinity, Infinity];
  const high: Vector = [-Infinity, -Infinity, -Infinity];
  const include = (x: number, k: Axis, r: number) => {
    if (x - r < low[k]) low[k] = x - r;
    if (x + r > high[k]) high[k] = x + r;
  };
  const still: [boolean, boolean, boolean] = [true, true, true];
  for (const k of AXES) {
    for (let row = 0; row < bodies.count; row++) {
      if (!(bodies.radius[row] > 0)) continue;
      include(bodies.position[3 * row + k], k, bodies.radius[row]);
      if (bodies.position[3 * row + k] !== bodies.position[k]) still[k] = false;
    }
    for (let i = 0; i < impacts.count; i++) include(impacts.point[3 * i + k], k, 0);
    if (flight.velocity.some((v, i) => i % 3 === k && v !== 0) || gravity[k] !== 0) still[k] = false;
    // What has a shape is to be seen from a corner, unless it is the plane that has everything; so are balls that spin.
    const solid = recording.meshes.length > 0 || (bodies.turning?.geometry.some((shape) => shape >= 0) ?? false);
    const spins = flight.angularVelocity.some((w, i) => i % 3 !== k && w !== 0);
    if (recording.dimensions === 3 ? solid || spins : k !== 2 && solid) still[k] = false;
  }
  for (const mesh of recording.meshes) {
    for (let i = 0; i < mesh.vertices.length; i += 3) {
      const at = rotated(mesh.orientation, [mesh.vertices[i], mesh.vertices[i + 1], mesh.vertices[i + 2]]);
      for (const k of AXES) include(mesh.position[k] + at[k], k, 0);
    }
  }
  if (!Number.isFinite(low[0])) for (const k of AXES) { low[k] = -1; high[k] = 1; }

  // Where bodies go in the end, but no farther than keeps the beginning in sight.
  const reach = 0.6 * Math.max(...AXES.map((k) => high[k] - low[k]));
  const bounds = AXES.map((k) => [low[k] - reach, high[k] + reach]);
  const last = new Float64Array(3 * bodies.count);
  flight.positionsAt(recording.replayUntil, last);
  for (let row = 0; row < bodies.count; row++) {
    if (!(bodies.radius[row] > 0)) continue;
    for (const k of AXES) include(Math.min(Math.max(last[3 * row + k], bounds[k][0]), bounds[k][1]), k, bodies.radius[row]);
  }
  for (const k of AXES) {
    if (axes[k] === "open" || still[k]) continue;
    low[k] = -size[k] / 2;
    high[k] = size[k] / 2;
  }

  // The axis along which most of it falls.
  const pull = Math.max(...gravity.map(Math.abs));
  const down = pull > 0 ? ([2, 1, 0] as Axis[]).find((k) => Math.abs(gravity[k]) === pull) : undefined;
  // Look along a direction in which nothing happens; from the top if there is a choice and nothing falls.
  const candidates: Axis[] = down === 2 ? [1, 0] : [2, 1, 0];
  const along = candidates.find((k) => still[k]);
  const up: Vector = down !== undefined && along !== down
    ? (AXES.map((k) => (k === down ? -Math.sign(gravity[k]) : 0)) as Vector)
    : along === 2 ? [0, 1, 0] : [0, 0, 1];
  if (along !== undefined) {
    // Right-handed as usual: x to the right seen from the top or from the front.
    const axis = AXES.map((k) => (k === along ? (along === 1 ? -1 : 1) : 0)) as Vector;
    if (along === 1 && up[2] < 0) axis[1] = 1;
    return { flat: true, axis, up, low, high };
  }
  const axis: Vector = up[2] !== 0 ? [0.55, -1, 0.42 * up[2]] : up[1] !== 0 ? [0.55, 0.42 * up[1], 1] : [0.42 * up[0], 0.55, 1];
  return { flat: false, axis, up, low, high };
}

export class Stage {
  readonly canvas: HTMLCanvasElement;
  readonly view: View;
  readonly palette: Palette;
  /** Whether there are paths to show. */
  readonly hasPaths: boolean;
  /** So many bodies that two of them are hard to find. */
  readonly crowd: boolean;
  /** Set to draw at the next chance. */
  dirty = true;

  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera: OrthographicCamera | PerspectiveCamera;
  private readonly controls: OrbitControls;
  private readonly balls: Balls;
  private readonly solids: Solids;
  private readonly walls: Walls;
  private readonly shadows: FloorShadows;
  private readonly furniture = new Group();
  private readonly planes: { slab: Object3D; normal: Vector3; velocity: Vector3; start: Vector3 }[] = [];
  private readonly positions: Float64Array;
  private readonly orientations: Float64Array;
  private readonly centre: Vector3;
  private readonly radius: number;
  private readonly right: Vector3;
  private readonly up: Vector3;
  private readonly background = new Color();
  private paths: LineSegments | null = null;
  private colouring: Colouring;
  private goal: { target: Vector3; scale: number } | null = null;
  private width = 1;
  private height = 1;
  private paintedAt = NaN;
  private apart = 0;
  private pickedOut: [number, number] = [-1, -1];

  constructor(
    private readonly recording: Recording,
    private readonly flight: Flight,
    private readonly host: HTMLElement,
  ) {
    this.view = chooseView(recording, flight);
    this.palette = new Palette(recording, flight);
    this.colouring = this.palette.start;
    this.crowd = recording.bodies.count > 40;
    this.positions = new Float64Array(3 * recording.bodies.count);
    this.orientations = new Float64Array(recording.bodies.turning ? 4 * recording.bodies.count : 0);

    const { low, high, flat } = this.view;
    this.centre = new Vector3(...AXES.map((k) => (low[k] + high[k]) / 2) as Vector);
    this.radius = 0.5 * Math.hypot(...AXES.map((k) => high[k] - low[k])) || 1;
    this.up = new Vector3(...this.view.up);
    const axis = new Vector3(...this.view.axis).normalize();
    this.right = new Vector3().crossVectors(this.up, axis).normalize();

    this.renderer = new WebGLRenderer({ antialias: true, powerPreference: "high-performance" });
    this.renderer.outputColorSpace = LinearSRGBColorSpace;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.canvas = this.renderer.domElement;
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", "Replay of the run. Drag to turn; click, then use the wheel, to come closer.");
    host.prepend(this.canvas);

    this.camera = flat ? new OrthographicCamera() : new PerspectiveCamera(32);
    this.camera.up.copy(this.up);
    this.camera.position.copy(axis).multiplyScalar(this.distance());
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.enableDamping = false;
    // The page scrolls until the picture has been clicked; a finger moving up or down always scrolls it.
    this.controls.enableZoom = false;
    this.canvas.style.touchAction = "pan-y";
    this.canvas.addEventListener("pointerdown", () => (this.controls.enableZoom = true));
    this.canvas.addEventListener("pointerleave", (event) => { if (event.pointerType === "mouse") this.controls.enableZoom = false; });
    this.controls.addEventListener("change", () => (this.dirty = true));
    this.controls.addEventListener("start", () => (this.goal = null));

    // All is drawn about the middle of the scene, so that 32-bit numbers suffice wherever the scene lies.
    this.furniture.position.copy(this.centre).negate();
    this.scene.add(this.furniture);
    this.solids = new Solids(recording, this.palette.colours);
    this.walls = new Walls(recording.meshes, this.centre);
    this.shadows = new FloorShadows(recording, this.centre);
    this.shadows.group.visible = !flat;
    const radii = recording.bodies.radius.map((radius, row) => (this.solids.has(row) ? 0 : radius));
    this.balls = new Balls(radii, this.palette.colours, this.palette.stripes, spinning(recording, flight));
    this.scene.add(this.balls.mesh, this.balls.shadows, this.solids.group, this.walls.group, this.shadows.group);
    if (this.isTable()) {
      this.balls.castShadows(axis.clone().negate(), this.right, this.up);
      this.solids.castShadows(axis.clone().negate(), this.right.clone().multiplyScalar(0.58).addScaledVector(this.up, -0.81));
    }
    this.hasPaths = !flight.period.some((p) => p > 0) && flight.time.length <= MOST_PATHS && flight.time.length > 0;
    this.restyle();
    this.resize();
    new ResizeObserver(() => this.resize()).observe(host);
    this.showWhole(true);
  }

  /** A plane scene with walls on all four sides: seen as a table. */
  private isTable(): boolean {
    return this.view.flat && AXES.every((k) => this.view.axis[k] !== 0 || this.recording.axes[k] === "walls");
  }

  private distance(): number {
    return 4 * this.radius;
  }

  /** Takes the colours of the page again, after the colour scheme has changed. */
  restyle(): void {
    this.palette.paint(this.colouring, 0);
    this.balls.painted();
    this.solids.painted();
    this.walls.paint(themeColour("wall"), themeColour("edge"));
    this.furniture.clear();
    this.planes.length = 0;
    this.background.setRGB(...parseColour(themeColour(this.isTable() && this.palette.pool ? "felt" : "stage")));
    this.scene.background = new Color().setRGB(...parseColour(themeColour("stage")));
    if (this.isTable()) this.buildTable();
    else this.buildBox();
    this.buildPlanes();
    const shown = this.paths?.visible ?? false;
    this.paths = null;
    if (shown) this.showPaths(true);
    this.paintedAt = NaN;
    this.dirty = true;
  }

  colourBy(how: Colouring): void {
    this.colouring = how;
    this.restyle();
  }

  // --- furniture ---------------------------------------------------------------------------------------------------

  private flatColour(name: string, opacity = 1): MeshBasicMaterial {
    return new MeshBasicMaterial({
      color: new Color().setRGB(...parseColour(themeColour(name))), side: DoubleSide, transparent: opacity < 1, opacity, depthWrite: false,
    });
  }

  private buildTable(): void {
    const { low, high } = this.view;
    const extent = (v: Vector3) => AXES.reduce<number>((sum, k) => sum + Math.abs(v.getComponent(k)) * (high[k] - low[k]), 0);
    const width = extent(this.right);
    const height = extent(this.up);
    const rim = 0.014 * Math.max(width, height);
    const depth = Math.max(0, ...this.recording.bodies.radius.filter((r) => r > 0));
    const pool = this.palette.pool;
    const group = new Group();
    const frame = (outer: number, inner: number, round: number, name: string) => {
      const shape = roundedRectangle(new Shape(), width / 2 + outer, height / 2 + outer, round);
      if (inner >= 0) shape.holes.push(roundedRectangle(new Outline(), width / 2 + inner, height / 2 + inner, inner > 0 ? 0.6 * round : 0));
      const mesh = new Mesh(new ShapeGeometry(shape, 8), this.flatColour(name));
      group.add(mesh);
    };
    frame(0, -1, 0, pool ? "felt" : "floor");
    frame(rim, 0, 0.5 * rim, pool ? "cushion" : "wall");
    if (pool) frame(2.6 * rim, rim, 1.8 * rim, "rail");
    group.quaternion.copy(this.facing());
    group.position.copy(this.centre).addScaledVector(new Vector3(...this.view.axis), -depth);
    group.renderOrder = 0;
    this.furniture.add(group);
  }

  /** Turns the x-y plane so that x is to the right, y up, on the screen. */
  private facing(): Quaternion {
    const to = new Object3D();
    to.matrix.makeBasis(this.right, this.up, new Vector3().crossVectors(this.right, this.up));
    return to.quaternion.setFromRotationMatrix(to.matrix).clone();
  }

  /** The edges of the domain: whole lines for walls, dashed where space wraps. */
  private buildBox(): void {
    const { axes } = this.recording;
    const { low, high } = this.view;
    const whole: number[] = [];
    const dashed: number[] = [];
    for (const i of AXES) {
      const j = ((i + 1) % 3) as Axis;
      const k = ((i + 2) % 3) as Axis;
      const kinds = [axes[j], axes[k]];
      if (kinds.every((kind) => kind === "open")) continue;
      const lines = kinds.includes("walls") ? whole : dashed;
      for (const y of [low[j], high[j]]) {
        for (const z of [low[k], high[k]]) {
          for (const x of [low[i], high[i]]) {
            const point = [0, 0, 0];
            point[i] = x;
            point[j] = y;
            point[k] = z;
            lines.push(...point);
          }
        }
      }
    }
    const colour = new Color().setRGB(...parseColour(themeColour("edge")));
    for (const [points, material] of [
      [whole, new LineBasicMaterial({ color: colour })],
      [dashed, new LineDashedMaterial({ color: colour, dashSize: 0.022 * this.radius, gapSize: 0.016 * this.radius })],
    ] as const) {
      if (points.length === 0) continue;
      const lines = new LineSegments(new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(points), 3)), material);
      lines.computeLineDistances();
      this.furniture.add(lines);
    }
  }

  /** Plane bodies: slabs on the side where nothing can be. */
  private buildPlanes(): void {
    const eye = new Vector3(...this.view.axis).normalize();
    for (const plane of this.recording.planes) {
      if (plane.wall) continue;
      const normal = new Vector3(...plane.normal);
      if (this.view.flat && Math.abs(normal.dot(eye)) > 0.99) continue;
      const thick = 0.03 * this.radius;
      // z of the slab along the normal; in a flat scene its y toward the eye.
      const y = this.view.flat ? eye : Math.abs(normal.z) > 0.9 ? new Vector3(0, 1, 0) : new Vector3(0, 0, 1);
      const x = new Vector3().crossVectors(y, normal).normalize();
      const shape = new BoxGeometry(this.planeExtent(x), this.view.flat ? thick : this.planeExtent(new Vector3().crossVectors(normal, x)), thick);
      const slab = new Group();
      slab.add(new Mesh(shape, this.flatColour("wall", this.view.flat ? 1 : 0.22)));
      if (!this.view.flat) {
        slab.add(new LineSegments(new EdgesGeometry(shape), new LineBasicMaterial({ color: new Color().setRGB(...parseColour(themeColour("edge"))) })));
      }
      slab.quaternion.setFromRotationMatrix(new Object3D().matrix.makeBasis(x, new Vector3().crossVectors(normal, x), normal));
      const start = this.centre.clone().addScaledVector(normal, plane.offset - normal.dot(this.centre) - thick / 2);
      slab.position.copy(start);
      this.furniture.add(slab);
      this.planes.push({ slab, normal, velocity: new Vector3(...plane.velocity), start });
    }
  }

  /** How far to draw a plane in a direction: to the walls, or where there are none well beyond the bodies. */
  private planeExtent(direction: Vector3): number {
    const { low, high, flat } = this.view;
    return AXES.reduce<number>((sum, k) => {
      const beyond = this.recording.axes[k] !== "open" ? high[k] - low[k] : flat ? 6 * this.radius : 1.08 * (high[k] - low[k]) + 0.1 * this.radius;
      return sum + Math.abs(direction.getComponent(k)) * beyond;
    }, 0);
  }

  // --- paths -------------------------------------------------------------------------------------------------------

  /** The way each body has come so far: drawn once for the whole run, cut off at the time of the replay by the shader. */
  showPaths(shown: boolean): void {
    if (shown && !this.paths && this.hasPaths) this.paths = this.buildPaths();
    if (this.paths) this.paths.visible = shown;
    this.dirty = true;
  }

  private buildPaths(): LineSegments {
    const { bodies, gravity, replayUntil } = this.recording;
    const { first, time, position, velocity } = this.flight;
    const pieces = gravity.some((g) => g !== 0) ? CURVE_PIECES : 1;
    const points: number[] = [];
    const times: number[] = [];
    const tints: number[] = [];
    for (let row = 0; row < bodies.count; row++) {
      const falls = bodies.fixed[row] ? 0 : 1;
      for (let s = first[row]; s < first[row + 1]; s++) {
        const long = (s + 1 < first[row + 1] ? time[s + 1] : replayUntil) - time[s];
        if (!(long > 0) || AXES.every((k) => velocity[3 * s + k] === 0 && falls * gravity[k] === 0)) continue;
        for (let piece = 0; piece < pieces; piece++) {
          for (const share of [piece / pieces, (piece + 1) / pieces]) {
            const t = share * long;
            for (const k of AXES) {
              points.push(position[3 * s + k] + velocity[3 * s + k] * t + 0.5 * falls * gravity[k] * t * t - this.centre.getComponent(k));
            }
            times.push(time[s] + t);
            tints.push(...this.palette.colours.subarray(3 * row, 3 * row + 3));
          }
        }
      }
    }
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(new Float32Array(points), 3));
    geometry.setAttribute("time", new BufferAttribute(new Float32Array(times), 1));
    geometry.setAttribute("tint", new BufferAttribute(new Float32Array(tints), 3));
    const lines = new LineSegments(geometry, new ShaderMaterial({
      glslVersion: GLSL3,
      transparent: true,
      depthWrite: false,
      uniforms: { now: { value: 0 }, fade: { value: 0.07 * (replayUntil || 1) } },
      vertexShader: `in float time; in vec3 tint; out float vTime; flat out vec3 vTint;
        void main() { vTime = time; vTint = tint; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }`,
      fragmentShader: `in float vTime; flat in vec3 vTint; uniform float now; uniform float fade; out vec4 colour;
        void main() { if (vTime > now) discard; colour = vec4(vTint, 0.22 + 0.68 * exp((vTime - now) / fade)); }`,
    }));
    lines.frustumCulled = false;
    lines.renderOrder = 1;
    this.scene.add(lines);
    return lines;
  }

  // --- camera ------------------------------------------------------------------------------------------------------

  /** What must be in sight: half width and half height seen from the front. */
  private fit(): number {
    const { low, high, flat } = this.view;
    const extent = (v: Vector3) => 0.5 * AXES.reduce<number>((sum, k) => sum + Math.abs(v.getComponent(k)) * (high[k] - low[k]), 0);
    const margin = this.isTable() ? 1.13 : 1.1;
    const aspect = this.width / this.height;
    if (flat) return margin * Math.max(extent(this.up), extent(this.right) / aspect, 1e-12);
    // Each corner of the box, seen in perspective: half height of the view ≥ |y| + z tan(half angle), and so for x.
    const eye = new Vector3(...this.view.axis).normalize();
    const up = new Vector3().crossVectors(eye, this.right);
    const slope = Math.tan(((this.camera as PerspectiveCamera).fov * Math.PI) / 360);
    let scale = 1e-12;
    for (let corner = 0; corner < 8; corner++) {
      const at = new Vector3(...AXES.map((k) => (corner & (1 << k) ? high[k] : low[k])) as Vector).sub(this.centre);
      scale = Math.max(scale, Math.max(Math.abs(at.dot(up)), Math.abs(at.dot(this.right)) / aspect) + slope * at.dot(eye));
    }
    return 1.08 * scale;
  }

  /** Half the height of the view at the point looked at. */
  private get scale(): number {
    if (this.camera instanceof OrthographicCamera) return this.camera.top / this.camera.zoom;
    return this.camera.position.distanceTo(this.controls.target) * Math.tan((this.camera.fov * Math.PI) / 360);
  }

  private setScale(scale: number): void {
    if (this.camera instanceof OrthographicCamera) {
      this.camera.zoom = this.camera.top / scale;
      this.camera.updateProjectionMatrix();
    } else {
      const away = this.camera.position.clone().sub(this.controls.target).setLength(scale / Math.tan((this.camera.fov * Math.PI) / 360));
      this.camera.position.copy(this.controls.target).add(away);
    }
  }

  private lookAt(target: Vector3): void {
    this.camera.position.add(target).sub(this.controls.target);
    this.controls.target.copy(target);
  }

  /** Width to height of the whole scene as first seen. */
  get aspect(): number {
    const { low, high, flat } = this.view;
    const extent = (v: Vector3) => AXES.reduce<number>((sum, k) => sum + Math.abs(v.getComponent(k)) * (high[k] - low[k]), 0);
    return flat ? extent(this.right) / (extent(this.up) || 1) : 1.25;
  }

  /** Back to the whole scene, seen from where it was first seen. */
  showWhole(directly = false): void {
    this.camera.position.copy(this.controls.target).addScaledVector(new Vector3(...this.view.axis).normalize(), this.distance());
    this.camera.up.copy(this.up);
    this.goal = { target: new Vector3(), scale: this.fit() };
    if (directly) this.arrive();
    this.dirty = true;
  }

  /** Moves in on a place, to see `radius` around it; with null back out. */
  closeUp(place: Vector | null, radius = 0, directly = false): void {
    this.goal = place
      ? { target: new Vector3(...place).sub(this.centre), scale: Math.max(radius, 1e-6 * this.radius) }
      : { target: new Vector3(), scale: this.fit() };
    if (directly) this.arrive();
    this.dirty = true;
  }

  private arrive(): void {
    if (!this.goal) return;
    this.lookAt(this.goal.target);
    this.setScale(this.goal.scale);
    this.goal = null;
    this.controls.update();
  }

  private approach(seconds: number): void {
    if (!this.goal) return;
    const left = Math.exp(-seconds / CAMERA_EASE);
    const { target, scale } = this.goal;
    const now = this.scale;
    if (this.controls.target.distanceTo(target) < 1e-3 * scale && Math.abs(now / scale - 1) < 1e-3) return this.arrive();
    this.lookAt(target.clone().lerp(this.controls.target, left));
    this.setScale(scale * (now / scale) ** left);
    this.controls.update();
    this.dirty = true;
  }

  private resize(): void {
    const whole = this.goal === null && Math.abs(this.scale / this.fit() - 1) < 0.02;
    this.width = Math.max(1, this.host.clientWidth);
    this.height = Math.max(1, this.host.clientHeight);
    this.renderer.setSize(this.width, this.height, false);
    const aspect = this.width / this.height;
    if (this.camera instanceof OrthographicCamera) {
      this.camera.top = this.radius;
      this.camera.bottom = -this.radius;
      this.camera.right = this.radius * aspect;
      this.camera.left = -this.camera.right;
      this.camera.near = -8 * this.radius;
      this.camera.far = 16 * this.radius;
    } else {
      this.camera.aspect = aspect;
    }
    this.camera.updateProjectionMatrix();
    if (whole) this.closeUp(null, 0, true);
    this.dirty = true;
  }

  // --- drawing -----------------------------------------------------------------------------------------------------

  /** Size of a pixel at a place of the scene (m). */
  pixelAt(place: Vector): number {
    const at = new Vector3(...place).sub(this.centre);
    const away = this.camera instanceof OrthographicCamera ? 1 : at.distanceTo(this.camera.position);
    return this.pixelSize() * away;
  }

  private pixelSize(): number {
    if (this.camera instanceof OrthographicCamera) return (2 * this.scale) / this.height;
    return (2 * Math.tan((this.camera.fov * Math.PI) / 360)) / this.height;
  }

  /** Where a place of the scene is on the picture, in CSS pixels. */
  project(place: Vector): [number, number] {
    const at = new Vector3(...place).sub(this.centre).project(this.camera);
    return [(0.5 + 0.5 * at.x) * this.width, (0.5 - 0.5 * at.y) * this.height];
  }

  /** From a place of the scene to the eye, a unit vector. */
  toEye(place: Vector): Vector {
    const eye = this.camera instanceof OrthographicCamera
      ? this.camera.getWorldDirection(new Vector3()).negate()
      : this.camera.position.clone().sub(new Vector3(...place).sub(this.centre)).normalize();
    return [eye.x, eye.y, eye.z];
  }

  /** Row of the body seen at a point of the picture, −1 for none. */
  bodyAt(x: number, y: number): number {
    const near = new Vector3((2 * x) / this.width - 1, 1 - (2 * y) / this.height, -1).unproject(this.camera);
    const ray = new Vector3((2 * x) / this.width - 1, 1 - (2 * y) / this.height, 1).unproject(this.camera).sub(near).normalize();
    const { placed } = this.balls;
    const { radius: radii } = this.recording.bodies;
    let found = -1;
    let first = Infinity;
    for (let row = 0; row < this.recording.bodies.count; row++) {
      const i = 4 * row;
      const solid = this.solids.has(row);
      const dx = placed[i] - near.x;
      const dy = placed[i + 1] - near.y;
      const dz = placed[i + 2] - near.z;
      const along = dx * ray.x + dy * ray.y + dz * ray.z;
      const aside = dx * dx + dy * dy + dz * dz - along * along;
      const radius = solid ? radii[row] : placed[i + 3];
      if (aside > radius * radius) continue;
      const stands = [0, 1, 2, 3].map((k) => this.orientations[i + k]) as Turn;
      const hit = solid ? this.solids.hit(row, stands, [-dx, -dy, -dz], [ray.x, ray.y, ray.z]) : along - Math.sqrt(radius * radius - aside);
      if (hit < first) {
        first = hit;
        found = row;
      }
    }
    return found;
  }

  /** In a crowd the two bodies of an impact would not be seen for the others: these step back. */
  private pickOut(struck: [number, number] | null, seconds: number): void {
    const goal = struck && this.crowd ? 1 : 0;
    this.apart = goal + (this.apart - goal) * Math.exp(-seconds / CAMERA_EASE);
    if (Math.abs(this.apart - goal) < 0.01) this.apart = goal;
    else this.dirty = true;
    if (struck) this.pickedOut = struck;
    const eye = this.camera.getWorldDirection(new Vector3());
    const depths = this.pickedOut.filter((row) => row >= 0).map((row) => {
      const { placed } = this.balls;
      return new Vector3(placed[4 * row], placed[4 * row + 1], placed[4 * row + 2]).sub(this.camera.position).dot(eye);
    });
    for (const drawn of [this.balls, this.solids]) {
      drawn.set(this.pixelSize(), this.apart > 0 || struck ? this.pickedOut : [-1, -1], this.apart, Math.max(...depths), this.background);
    }
  }

  /** Where body `row` was last drawn. */
  drawnPosition(row: number): Vector {
    return AXES.map((k) => this.positions[3 * row + k]) as Vector;
  }

  /** Draws the run at `time`. `struck`: the rows of an impact to be picked out; `seconds` have passed since the last call. */
  draw(time: number, struck: [number, number] | null, seconds: number): void {
    this.approach(seconds);
    this.dirty = false;
    this.flight.positionsAt(time, this.positions);
    if (struck && struck[0] >= 0 && struck[1] >= 0) {
      // Two bodies that meet across the edge of a periodic box are drawn together.
      const [a, b] = struck;
      for (const k of AXES) {
        const apart = this.positions[3 * b + k] - this.positions[3 * a + k];
        this.positions[3 * b + k] = this.positions[3 * a + k] + wrap(apart, this.flight.period[k]);
      }
    }
    const { placed } = this.balls;
    const { x, y, z } = this.centre;
    for (let row = 0; row < this.recording.bodies.count; row++) {
      placed[4 * row] = this.positions[3 * row] - x;
      placed[4 * row + 1] = this.positions[3 * row + 1] - y;
      placed[4 * row + 2] = this.positions[3 * row + 2] - z;
    }
    this.balls.moved();
    if (this.recording.bodies.turning) {
      this.flight.orientationsAt(time, this.orientations);
      this.balls.turned(this.orientations);
      this.solids.move(this.positions, this.orientations, this.centre);
    }
    this.walls.move(time);
    this.shadows.move(this.positions, time, this.apart);
    if (this.colouring === "speed" && this.paintedAt !== time) {
      this.palette.paint("speed", time);
      this.balls.painted();
      this.solids.painted();
      this.paintedAt = time;
    }
    for (const { slab, normal, velocity, start } of this.planes) {
      slab.position.copy(start).addScaledVector(normal, normal.dot(velocity) * time);
    }
    if (this.paths) (this.paths.material as ShaderMaterial).uniforms.now.value = time;
    this.pickOut(struck, seconds);
    if (this.camera instanceof PerspectiveCamera) {
      const away = this.camera.position.length();
      this.camera.near = Math.max(away - 3 * this.radius, 1e-3 * this.scale);
      this.camera.far = away + 4 * this.radius;
      this.camera.updateProjectionMatrix();
    }
    this.renderer.render(this.scene, this.camera);
  }
}

/** 1 for each ball that ever turns. */
function spinning({ bodies }: Recording, flight: Flight): Float32Array {
  return Float32Array.from({ length: bodies.count }, (_, row) => {
    const spins = flight.angularVelocity.subarray(3 * flight.first[row], 3 * flight.first[row + 1]);
    return spins.some((w) => w !== 0) ? 1 : 0;
  });
}

function roundedRectangle<T extends Outline>(path: T, x: number, y: number, round: number): T {
  path.moveTo(-x + round, -y);
  path.lineTo(x - round, -y);
  path.quadraticCurveTo(x, -y, x, -y + round);
  path.lineTo(x, y - round);
  path.quadraticCurveTo(x, y, x - round, y);
  path.lineTo(-x + round, y);
  path.quadraticCurveTo(-x, y, -x, y - round);
  path.lineTo(-x, -y + round);
  path.quadraticCurveTo(-x, -y, -x + round, -y);
  return path;
}
