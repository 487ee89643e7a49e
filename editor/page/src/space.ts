// The world of a run in three dimensions. Loaded when it is looked at: it brings three.js.
import * as three from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { Point, SceneShape, SceneWorld } from "./protocol.ts";
import { thing_of } from "./stage.svelte.ts";

export interface Shown {
  forces: boolean; com: boolean; frames: boolean;
  follows: Followed | null; // null: the camera stays where it is
  hidden: ReadonlySet<string>; // robots and objects
}
/** A world and the number of one of its bodies; -1: its centre of mass. */
export interface Followed { world: number; body: number }
/** Where a person takes hold of a body: its number, the point in its frame, and a force in world axes. */
export interface Hold { world: number; body: number; point: number[]; force: number[] }

const metres_per_newton = 0.0015;
const newtons_per_metre = 200; // of a person's pull
const contact_colour = 0x1aa659, pull_colour = 0xe64d26, com_colour = 0xd9a406;

/** All meshes of a world, in the protocol's form. */
export function meshes_of(data: ArrayBuffer): three.BufferGeometry[] {
  const view = new DataView(data), found: three.BufferGeometry[] = [];
  for (let at = 0; at + 8 <= data.byteLength; ) {
    const vertices = view.getUint32(at, true), triangles = view.getUint32(at + 4, true), geometry = new three.BufferGeometry();
    at += 8;
    geometry.setAttribute("position", new three.BufferAttribute(new Float32Array(data, at, 3 * vertices), 3));
    geometry.setAttribute("normal", new three.BufferAttribute(new Float32Array(data, at + 12 * vertices, 3 * vertices), 3));
    geometry.setIndex(new three.BufferAttribute(new Uint32Array(data, at + 24 * vertices, 3 * triangles), 1));
    at += 24 * vertices + 12 * triangles;
    found.push(geometry);
  }
  return found;
}

/** In MuJoCo cylinders and capsules lie along z; in three.js along y. */
function geometry_of({ kind, mesh, size: [a = 0, b = 0, c = 0] }: SceneShape, meshes: three.BufferGeometry[]): three.BufferGeometry {
  switch (kind) {
    case "mesh": return meshes[mesh] ?? new three.BufferGeometry();
    case "sphere": return new three.SphereGeometry(a, 32, 20);
    case "box": return new three.BoxGeometry(2 * a, 2 * b, 2 * c);
    case "cylinder": return new three.CylinderGeometry(a, a, 2 * b, 32).rotateX(Math.PI / 2);
    case "capsule": return new three.CapsuleGeometry(a, 2 * b, 8, 24).rotateX(Math.PI / 2);
    case "ellipsoid": return new three.SphereGeometry(1, 32, 20).scale(a, b, c);
  }
}

/** From a point along a force; it shines through what is in front of it. */
class Arrow extends three.Group {
  private readonly shaft: three.Mesh;
  private readonly head: three.Mesh;

  constructor(colour: number) {
    super();
    const material = new three.MeshBasicMaterial({ color: colour, depthTest: false, transparent: true, opacity: 0.85 });
    this.shaft = new three.Mesh(new three.CylinderGeometry(0.008, 0.008, 1, 12).translate(0, 0.5, 0), material);
    this.head = new three.Mesh(new three.ConeGeometry(0.022, 0.06, 16).translate(0, -0.03, 0), material);
    this.shaft.renderOrder = this.head.renderOrder = 1;
    this.add(this.shaft, this.head);
  }
  set(from: three.Vector3, along: three.Vector3): void {
    const length = along.length();
    this.visible = length > 1e-3;
    if (!this.visible) return;
    this.position.copy(from);
    this.quaternion.setFromUnitVectors(new three.Vector3(0, 1, 0), along.clone().divideScalar(length));
    this.shaft.scale.set(1, Math.max(length - 0.05, 1e-3), 1);
    this.head.position.set(0, length, 0);
  }
}

class Body {
  readonly group = new three.Group();
  readonly frame = new three.AxesHelper(0.12);

  constructor() {
    (this.frame.material as three.Material).depthTest = false;
    this.frame.renderOrder = 2;
    this.group.add(this.frame);
  }
}

class World {
  readonly group = new three.Group();
  readonly bodies: Body[];
  readonly contacts: Arrow[];
  readonly com = new three.Mesh(new three.SphereGeometry(0.022, 24, 16),
    new three.MeshBasicMaterial({ color: com_colour, depthTest: false, transparent: true, opacity: 0.9 }));
  readonly under = new three.Mesh(new three.RingGeometry(0.012, 0.024, 32), new three.MeshBasicMaterial({ color: com_colour }));
  readonly about: SceneWorld;

  constructor(about: SceneWorld, meshes: three.BufferGeometry[]) {
    this.about = about;
    this.bodies = about.bodies.map(() => new Body());
    for (const shape of about.shapes) {
      const [r = 0.7, g = 0.7, b = 0.7, opacity = 1] = shape.colour;
      const material = new three.MeshStandardMaterial({ roughness: 0.55, metalness: 0.08, transparent: opacity < 1, opacity });
      material.color.setRGB(r, g, b, three.SRGBColorSpace);
      const part = new three.Mesh(geometry_of(shape, meshes), material), [x = 0, y = 0, z = 0, qw = 1, qx = 0, qy = 0, qz = 0] = shape.pose;
      part.position.set(x, y, z);
      part.quaternion.set(qx, qy, qz, qw);
      part.castShadow = part.receiveShadow = true;
      part.userData = { body: shape.body };
      this.bodies[shape.body]!.group.add(part);
    }
    this.contacts = about.feet.map(() => new Arrow(contact_colour));
    this.com.renderOrder = 1;
    this.group.add(...this.bodies.map((body) => body.group), ...this.contacts, this.com, this.under);
  }
  place(values: ArrayLike<number>): void {
    const at = (i: number) => new three.Vector3(values[i], values[i + 1], values[i + 2]);
    let i = 0;
    for (const { group } of this.bodies) {
      group.position.copy(at(i));
      group.quaternion.set(values[i + 4]!, values[i + 5]!, values[i + 6]!, values[i + 3]!);
      i += 7;
    }
    for (const arrow of this.contacts) {
      arrow.set(at(i), at(i + 3).multiplyScalar(metres_per_newton));
      i += 6;
    }
    this.com.position.copy(at(i));
    this.under.position.set(values[i]!, values[i + 1]!, 0.002);
  }
  /** Where a body is, or the centre of mass. */
  at(body: number): three.Vector3 { return (this.bodies[body]?.group ?? this.com).position; }
  show({ forces, com, frames, hidden }: Shown): void {
    this.bodies.forEach(({ group, frame }, i) => {
      group.visible = !hidden.has(thing_of(this.about, this.about.bodies[i]!));
      frame.visible = frames;
    });
    for (const arrow of this.contacts) arrow.traverse((part) => part.layers.set(forces ? 0 : 1));
    this.com.visible = this.under.visible = com;
  }
}

/** Throws where the browser has no WebGL. */
export class Space {
  private readonly renderer: three.WebGLRenderer;
  private readonly scene = new three.Scene();
  private readonly camera = new three.PerspectiveCamera(35, 1, 0.02, 100);
  private readonly controls: OrbitControls;
  private readonly ground = new three.Group();
  private readonly lamp = new three.DirectionalLight(0xffffff, 2);
  private readonly pull = new Arrow(pull_colour);
  private readonly canvas: HTMLCanvasElement;
  private worlds: World[] = [];
  private shown: Shown = { forces: true, com: false, frames: false, follows: { world: 0, body: -1 }, hidden: new Set() };
  private followed = new three.Vector3();
  private request = 0;
  private held: { world: number; body: number; point: three.Vector3; plane: three.Plane } | null = null;

  constructor(canvas: HTMLCanvasElement) {
    this.canvas = canvas;
    this.renderer = new three.WebGLRenderer({ canvas, antialias: true });
    this.renderer.shadowMap.enabled = true;
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => this.redraw());
    this.lamp.castShadow = true;
    this.lamp.shadow.mapSize.set(2048, 2048);
    Object.assign(this.lamp.shadow.camera, { left: -1.6, right: 1.6, top: 1.6, bottom: -1.6, near: 0.5, far: 8 });
    this.lamp.shadow.bias = -0.0005;
    this.lamp.shadow.normalBias = 0.01;
    this.pull.visible = false;
    this.scene.add(new three.HemisphereLight(0xffffff, 0xb4bac4, 1.7), this.lamp, this.lamp.target, this.ground, this.pull);
    this.home();
  }

  /** Colours of the page: behind everything, of the floor, and of its lines. */
  paint(sky: string, floor: string, line: string): void {
    this.scene.background = new three.Color(sky);
    this.scene.fog = new three.Fog(sky, 8, 18);
    this.ground.clear();
    const plane = new three.Mesh(new three.PlaneGeometry(40, 40), new three.MeshLambertMaterial({ color: floor, polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 2 }));
    plane.receiveShadow = true;
    const lines = new three.GridHelper(40, 160, line, line);
    lines.rotateX(Math.PI / 2);
    lines.position.z = 0.002;
    this.ground.add(plane, lines);
    this.redraw();
  }
  load(worlds: SceneWorld[], meshes: ArrayBuffer[]): void {
    this.scene.remove(...this.worlds.map((world) => world.group));
    this.worlds = worlds.map((world, i) => new World(world, meshes_of(meshes[i] ?? new ArrayBuffer(0))));
    if (this.worlds.length > 0) this.scene.add(...this.worlds.map((world) => world.group));
    this.ground.visible = worlds.some((world) => world.has_floor);
    worlds.forEach((world, i) => this.place(i, world.start));
    this.show(this.shown);
    this.home();
  }
  place(world: number, values: ArrayLike<number>): void {
    const found = this.worlds[world];
    if (!found || values.length !== 7 * found.bodies.length + 6 * found.contacts.length + 3) return;
    found.place(values);
    if (world === (this.shown.follows?.world ?? 0)) this.follow();
    this.redraw();
  }
  private follow(): void {
    const { world, body } = this.shown.follows ?? { world: 0, body: -1 }, at = this.worlds[world]!.at(body).clone();
    if (body < 0) at.setZ(0);
    const by = at.clone().sub(this.followed);
    this.followed.copy(at);
    this.lamp.position.copy(at).setZ(0).add(new three.Vector3(1.5, 1.2, 3.2));
    this.lamp.target.position.copy(at).setZ(0);
    if (!this.shown.follows) return;
    this.camera.position.add(by);
    this.controls.target.add(by);
    this.controls.update();
  }
  show(shown: Shown): void {
    const { follows } = shown, is_other = follows?.world !== this.shown.follows?.world || follows?.body !== this.shown.follows?.body;
    this.shown = shown;
    for (const world of this.worlds) world.show(shown);
    const at = follows && is_other && this.worlds[follows.world]?.at(follows.body);
    if (at) { // it comes to the middle, and is followed from there on
      this.camera.position.add(at).sub(this.controls.target);
      this.controls.target.copy(at);
      this.followed.copy(at);
      if (follows.body < 0) this.followed.setZ(0);
      this.controls.update();
    }
    this.redraw();
  }
  resize(width: number, height: number): void {
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / Math.max(height, 1);
    this.camera.updateProjectionMatrix();
    this.redraw();
  }
  /** The whole of the first world, from half in front. */
  home(): void {
    const box = new three.Box3();
    for (const { group } of this.worlds[0]?.bodies ?? []) box.expandByObject(group);
    if (box.isEmpty()) box.set(new three.Vector3(-0.5, -0.5, 0), new three.Vector3(0.5, 0.5, 1));
    const middle = box.getCenter(new three.Vector3()), reach = box.getSize(new three.Vector3()).length() / 2;
    const distance = (0.95 * reach) / Math.tan(((this.camera.fov / 2) * Math.PI) / 180) / Math.min(this.camera.aspect, 1);
    this.controls.target.copy(middle);
    this.camera.position.copy(middle).add(new three.Vector3(0.84, 0.5, 0.22).normalize().multiplyScalar(distance));
    this.controls.update();
    this.redraw();
  }
  /** Turns about what is looked at by angles in radians, and comes nearer by a factor. */
  turn(azimuth: number, elevation: number, factor = 1): void {
    const away = new three.Spherical(), offset = this.camera.position.clone().sub(this.controls.target);
    const upright = new three.Quaternion().setFromUnitVectors(this.camera.up, new three.Vector3(0, 1, 0));
    away.setFromVector3(offset.applyQuaternion(upright));
    away.theta += azimuth;
    away.phi -= elevation;
    away.radius /= factor;
    away.makeSafe();
    this.camera.position.setFromSpherical(away).applyQuaternion(upright.invert()).add(this.controls.target);
    this.controls.update();
    this.redraw();
  }

  // ---- taking hold of a body ----

  private ray(p: Point): three.Raycaster {
    const caster = new three.Raycaster();
    caster.setFromCamera(new three.Vector2((2 * p.x) / this.canvas.clientWidth - 1, 1 - (2 * p.y) / this.canvas.clientHeight), this.camera);
    return caster;
  }
  /** Whether there is a body at that pixel, which is held until `release`. */
  grab(p: Point): boolean {
    const caster = this.ray(p);
    for (const [number, world] of this.worlds.entries()) {
      const parts = world.bodies.filter(({ group }) => group.visible).flatMap(({ group }) => group.children.filter((part) => part.userData.body !== undefined));
      const hit = caster.intersectObjects(parts, false)[0];
      if (!hit) continue;
      const body = hit.object.userData.body as number, towards = this.camera.getWorldDirection(new three.Vector3());
      const plane = new three.Plane().setFromNormalAndCoplanarPoint(towards, hit.point);
      this.held = { world: number, body, point: world.bodies[body]!.group.worldToLocal(hit.point.clone()), plane };
      this.controls.enabled = false;
      return true;
    }
    return false;
  }
  /** What the pointer pulls with, as a spring does. */
  pulled(p: Point): Hold | null {
    const held = this.held, to = held && this.ray(p).ray.intersectPlane(held.plane, new three.Vector3());
    if (!held || !to) return null;
    const from = this.worlds[held.world]!.bodies[held.body]!.group.localToWorld(held.point.clone());
    const force = to.sub(from).multiplyScalar(newtons_per_metre);
    this.pull.set(from, force.clone().divideScalar(newtons_per_metre));
    this.redraw();
    return { world: held.world, body: held.body, point: held.point.toArray(), force: force.toArray() };
  }
  release(): void {
    this.held = null;
    this.controls.enabled = true;
    this.pull.visible = false;
    this.redraw();
  }

  private redraw(): void { this.request ||= requestAnimationFrame(() => {
    this.request = 0;
    this.renderer.render(this.scene, this.camera);
  }); }
  dispose(): void {
    cancelAnimationFrame(this.request);
    this.controls.dispose();
    this.renderer.dispose();
  }
}
