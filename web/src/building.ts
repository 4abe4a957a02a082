/// The bodies of one run in a picture, at one time: boxes, signs of their zones, the chosen one.
import * as THREE from "three";
import { Boxes } from "./boxes";
import { linear } from "./colour";
import type { Crushed, Frame, Quadruple, Run, Shape, Triple } from "./data";
import { calcCrushed, calcPose, findFrame, shorten } from "./data";
import { SignMesh, type SignShape } from "./sign_mesh";
import type { Theme } from "./site";
import type { Colouring, ZoneMarks } from "./state";
import { colourOfKind, colourOfMaterial, colourOfUtilisation, highestSpeed, zoneStates } from "./vocabulary";
import { findMaterials, findParts, findZonesOfBodies, partOfShape, type ZonesOfBody } from "./zones";

const broken = 3, crushed = 5; // indices in zoneStates
const outside = new THREE.Matrix4().makeScale(0, 0, 0);
const atOrigin = new THREE.Matrix4();

const rampSteps = 64;
const ramp = Array.from({ length: rampSteps + 1 }, (_, i) => linear(colourOfUtilisation(i / rampSteps)));
const rampAt = (s: number): [number, number, number] => ramp[Math.round(rampSteps * Math.min(1, Math.max(0, s || 0)))] as [number, number, number];
const ofState = zoneStates.map((s, i) => linear(i === 0 ? "#dde2e6" : s.colour));
const silent = linear("#c3c9cf"); // no zone speaks for this body
const chosen = linear("#f5d033");

/// Takes the cube of edge 1 around the origin to a shape.
function calcMatrix(shape: Shape): THREE.Matrix4 {
  const [w, x, y, z] = shape.orientation;
  return new THREE.Matrix4().compose(
    new THREE.Vector3(...shape.centre),
    new THREE.Quaternion(x, y, z, w),
    new THREE.Vector3(...shape.half).multiplyScalar(2),
  );
}

export class Building {
  readonly group = new THREE.Group();
  readonly zonesOfBody: ZonesOfBody;
  readonly bounds = new THREE.Box3();
  /// What a fitted picture must show.
  readonly fitPoints: THREE.Vector3[] = [];
  readonly kinds: string[];
  readonly materials: string[];
  readonly markSize: number;
  private readonly boxes: Boxes;
  private readonly bodyOfInstance: number[] = [];
  private readonly colourOfPart: [number, number, number][] = [];
  private readonly colourOfStuff: [number, number, number][] = [];
  private readonly firstInstance: number[] = []; // of each body
  private readonly shapePose: THREE.Matrix4[] = []; // as crushing has left them at the time shown
  private readonly shortened = new Set<number>(); // instances
  private readonly bodyPose: THREE.Matrix4[];
  private readonly bodyColour: [number, number, number][];
  private readonly hidden: Uint8Array; // (B)
  private readonly marks: SignMesh;
  private readonly markColours = zoneStates.map((state) => new THREE.Color(state.colour));
  private readonly zonePlace: { body: number; local: THREE.Vector3 }[];
  private readonly selection: THREE.LineSegments<THREE.BufferGeometry, THREE.LineBasicMaterial>;
  private colouring: Colouring = "kind";
  private zoneMarks: ZoneMarks = "damaged";
  private selected = -1;
  private time = 0;
  private coloured = "";

  constructor(private run: Run) {
    this.zonesOfBody = findZonesOfBodies(run);
    this.kinds = findParts(run);
    this.materials = findMaterials(run);
    this.bodyPose = run.bodies.map(() => new THREE.Matrix4());
    this.bodyColour = run.bodies.map(() => silent);
    this.hidden = new Uint8Array(run.bodies.length);
    this.boxes = this.makeBoxes();
    this.group.add(this.boxes.mesh);
    this.collectFitPoints();
    this.markSize = Math.min(0.6, Math.max(0.15, this.height * 0.013));

    this.zonePlace = run.zones.map((zone) => this.placeZone(zone.place, zone.body_a >= 0 ? zone.body_a : zone.body_b));
    this.marks = new SignMesh(0.95);
    this.marks.mesh.renderOrder = 10;
    this.group.add(this.marks.mesh);

    const edges = new THREE.EdgesGeometry(new THREE.BoxGeometry(1, 1, 1));
    this.selection = new THREE.LineSegments(edges, new THREE.LineBasicMaterial({ depthTest: false }));
    this.selection.renderOrder = 15;
    this.selection.matrixAutoUpdate = false;
    this.selection.visible = false;
    this.group.add(this.selection);
    this.setTime(run.time[0] ?? 0);
  }

  /// Of the building at the start [m].
  get height(): number {
    return Math.max(1, this.bounds.max.z);
  }

  private makeBoxes(): Boxes {
    this.run.bodies.forEach((body, index) => {
      this.firstInstance.push(this.shapePose.length);
      for (const shape of body.shapes) {
        this.bodyOfInstance.push(index);
        this.colourOfPart.push(linear(colourOfKind(partOfShape(body, shape), this.kinds)));
        this.colourOfStuff.push(linear(colourOfMaterial(shape.material, this.materials)));
        this.shapePose.push(calcMatrix(shape));
      }
    });
    return new Boxes(this.shapePose.length);
  }

  private placeZone(place: Triple, body: number): { body: number; local: THREE.Vector3 } {
    const local = new THREE.Vector3(...place);
    const p: Triple = [0, 0, 0];
    const q: Quadruple = [1, 0, 0, 0];
    if (body < 0 || this.run.time.length === 0 || !calcPose(this.run, body, 0, 0, p, q)) return { body: -1, local };
    const turn = new THREE.Quaternion(q[1], q[2], q[3], q[0]).invert();
    return { body, local: local.sub(new THREE.Vector3(...p)).applyQuaternion(turn) };
  }

  private readonly point = new THREE.Vector3();
  private readonly turn = new THREE.Quaternion();
  private readonly unit = new THREE.Vector3(1, 1, 1);
  private readonly matrix = new THREE.Matrix4();
  private readonly p: Triple = [0, 0, 0];
  private readonly q: Quadruple = [1, 0, 0, 0];

  private calcBodyPoses(t: number): void {
    const { p, q } = this;
    const { frame, fraction } = findFrame(this.run.time, t);
    for (let b = 0; b < this.bodyPose.length; ++b) {
      const pose = this.bodyPose[b] as THREE.Matrix4;
      // without frames nobody knows where parts are
      if (this.run.time.length === 0) pose.copy(this.isGround(b) ? atOrigin : outside);
      else if (calcPose(this.run, b, frame, fraction, p, q))
        pose.compose(this.point.set(p[0], p[1], p[2]), this.turn.set(q[1], q[2], q[3], q[0]), this.unit);
      else pose.copy(outside);
    }
    this.calcShapePoses(calcCrushed(this.run, frame, fraction));
  }

  private calcShapePoses(crushed: readonly Crushed[]): void {
    const ends = new Map<number, Crushed[]>();
    for (const c of crushed) {
      const instance = (this.firstInstance[c.body] ?? 0) + c.shape;
      ends.set(instance, [...(ends.get(instance) ?? []), c]);
    }
    for (const instance of this.shortened) if (!ends.has(instance)) ends.set(instance, []);
    for (const [instance, list] of ends) {
      const body = this.bodyOfInstance[instance] ?? -1;
      const shape = this.run.bodies[body]?.shapes[instance - (this.firstInstance[body] ?? 0)];
      if (shape === undefined) continue;
      this.shapePose[instance] = calcMatrix(shorten(shape, list));
      if (list.length > 0) this.shortened.add(instance);
      else this.shortened.delete(instance);
    }
  }

  private isGround(body: number): boolean {
    return this.run.bodies[body]?.shapes.some((s) => s.material === "ground") ?? true;
  }

  private calcCornersAt(t: number): THREE.Vector3[] {
    const corners: THREE.Vector3[] = [];
    if (this.run.time.length === 0) return corners;
    this.calcBodyPoses(t);
    this.shapePose.forEach((shape, i) => {
      const body = this.bodyOfInstance[i] as number;
      if (this.isGround(body)) return;
      this.matrix.multiplyMatrices(this.bodyPose[body] as THREE.Matrix4, shape);
      if (this.matrix.determinant() === 0) return;
      for (let k = 0; k < 8; ++k)
        corners.push(new THREE.Vector3((k & 1) - 0.5, ((k >> 1) & 1) - 0.5, ((k >> 2) & 1) - 0.5).applyMatrix4(this.matrix));
    });
    return corners;
  }

  /// The building all along the run so far and the neighbours near to it.
  collectFitPoints(): void {
    const { time } = this.run;
    this.fitPoints.length = 0;
    for (const s of time.length < 2 ? [0] : [0, 0.25, 0.5, 0.75, 1])
      for (const corner of this.calcCornersAt(time[Math.round(s * (time.length - 1))] ?? 0)) {
        corner.z = Math.max(corner.z, -2);
        this.fitPoints.push(corner);
      }
    for (const [x, y] of this.run.building_outline) this.fitPoints.push(new THREE.Vector3(x, y, 0));
    if (time.length === 1) this.expectFall();
    if (this.fitPoints.length === 0) this.fitPoints.push(new THREE.Vector3(-5, -5, 0), new THREE.Vector3(5, 5, 5));
    this.bounds.setFromPoints(this.fitPoints);
    const near = this.bounds.clone().expandByScalar(0.5 * this.bounds.getSize(new THREE.Vector3()).length());
    for (const neighbour of this.run.neighbours) {
      if (neighbour.is_utility) continue;
      const corners = neighbour.footprint.map(([x, y]) => new THREE.Vector3(x, y, 0));
      if (corners.every((c) => near.containsPoint(c))) this.fitPoints.push(...corners);
    }
    this.calcBodyPoses(this.time);
  }

  /// Of a collapse yet to come: it will reach as far as about half of the building's height.
  private expectFall(): void {
    const box = new THREE.Box3().setFromPoints(this.fitPoints);
    const far = 0.55 * Math.max(0, box.max.z);
    for (const x of [box.min.x - far, box.max.x + far])
      for (const y of [box.min.y - 0.3 * far, box.max.y + 0.3 * far]) this.fitPoints.push(new THREE.Vector3(x, y, 0));
  }

  /// Shows another run of the same bodies and zones; false if it is of others.
  useRun(run: Run): boolean {
    if (run.bodies !== this.run.bodies || run.zones !== this.run.zones) return false;
    this.run = run;
    this.coloured = "";
    return true;
  }

  setTheme(theme: Theme, dark: boolean): void {
    this.selection.material.color.set(theme.selection);
    zoneStates.forEach((state, i) => this.markColours[i]?.set((dark ? state.onDark : undefined) ?? state.colour));
    this.placeMarks();
  }

  setTime(t: number): void {
    this.time = t;
    this.calcBodyPoses(t);
    for (let i = 0; i < this.shapePose.length; ++i) {
      const body = this.bodyOfInstance[i] as number;
      if (this.hidden[body] === 1) this.matrix.copy(outside);
      else this.matrix.multiplyMatrices(this.bodyPose[body] as THREE.Matrix4, this.shapePose[i] as THREE.Matrix4);
      this.boxes.setMatrix(i, this.matrix);
    }
    this.placeMarks();
    this.colourBoxes();
    this.boxes.commit();
    this.placeSelection();
  }

  setLook(colouring: Colouring, zoneMarks: ZoneMarks, selected: number): void {
    this.colouring = colouring;
    this.zoneMarks = zoneMarks;
    this.selected = selected;
    this.placeMarks();
    if (this.colourBoxes()) this.boxes.commit();
    this.placeSelection();
  }

  /// Leaves out the bodies for which `isShown` is false.
  setFilter(isShown: (body: number) => boolean): void {
    for (let b = 0; b < this.hidden.length; ++b) this.hidden[b] = isShown(b) ? 0 : 1;
    this.setTime(this.time);
  }

  /// Cuts off what lies behind the planes; an empty list ends that.
  setSection(planes: THREE.Plane[]): void {
    const { material } = this.boxes.mesh;
    material.clippingPlanes = planes;
    material.side = planes.length > 0 ? THREE.DoubleSide : THREE.FrontSide;
    material.needsUpdate = true;
    this.marks.mesh.material.clippingPlanes = planes;
  }

  /// A run shown for comparison only: in one colour, see-through unless `opacity` is 1.
  setGhost(colour: string, opacity = 0.35): void {
    const { material } = this.boxes.mesh;
    material.transparent = opacity < 1;
    material.opacity = opacity;
    material.depthWrite = opacity === 1;
    this.ghost = linear(colour);
    this.coloured = "";
    if (this.colourBoxes()) this.boxes.commit();
  }
  private ghost: [number, number, number] | undefined;

  private placeMarks(): void {
    const { frame } = findFrame(this.run.time, this.time);
    const now = this.run.frames[frame];
    // A break is marked while it is fresh: later its parts lie apart, and marks would hide them.
    const before = this.run.frames[findFrame(this.run.time, this.time - 0.4).frame];
    this.marks.clear();
    if (this.zoneMarks !== "none" && now !== undefined && before !== undefined)
      for (let z = 0; z < this.run.zones.length; ++z) {
        const state = now.state[z] as number;
        const colour = this.markColours[state];
        if (colour === undefined || (this.zoneMarks === "damaged" && (state === 0 || (state === broken && before.state[z] === broken)))) continue;
        const { body, local } = this.zonePlace[z] as { body: number; local: THREE.Vector3 };
        if (body >= 0 && this.hidden[body] === 1) continue;
        this.point.copy(local);
        if (body >= 0) this.point.applyMatrix4(this.bodyPose[body] as THREE.Matrix4);
        this.marks.add((zoneStates[state]?.shape ?? "circle") as SignShape, this.point, state === 0 ? 0.6 * this.markSize : this.markSize, colour);
      }
    this.marks.commit();
  }

  /// Centre of a body at the time shown; false where it has no pose or is left out.
  findPlace(body: number, out: THREE.Vector3): boolean {
    const pose = this.bodyPose[body];
    if (pose === undefined || this.hidden[body] === 1 || pose.elements[15] !== 1 || pose.elements[0] + pose.elements[1] + pose.elements[2] === 0) return false;
    out.setFromMatrixPosition(pose);
    return true;
  }

  private calcSpeed(body: number, frame: number): number {
    const later = frame === 0 ? 1 : frame;
    const a = this.run.frames[later - 1]?.pose, b = this.run.frames[later]?.pose;
    if (a === undefined || b === undefined) return 0;
    const i = 7 * body;
    const dt = (this.run.time[later] as number) - (this.run.time[later - 1] as number);
    return Math.hypot((b[i] as number) - (a[i] as number), (b[i + 1] as number) - (a[i + 1] as number), (b[i + 2] as number) - (a[i + 2] as number)) / dt;
  }

  private calcColour(body: number, frame: number, now: Frame | undefined): [number, number, number] {
    if (this.colouring === "speed") return rampAt(this.calcSpeed(body, frame) / highestSpeed);
    const zones = this.zonesOfBody[body] ?? [];
    if (zones.length === 0 || now === undefined) return silent;
    if (this.colouring === "state") {
      let worst = 0;
      for (const z of zones) {
        const state = now.state[z] ?? 0;
        // what is above a crushed stub is whole
        if (state !== crushed || this.run.zones[z]?.member === this.run.bodies[body]?.name) worst = Math.max(worst, state);
      }
      return ofState[worst] ?? silent;
    }
    let most = 0;
    for (const z of zones) {
      const u = now.utilisation[z] as number;
      if (u > most) most = u;
    }
    return rampAt(most);
  }

  /// Whether there is a change to show.
  private colourBoxes(): boolean {
    const { frame } = findFrame(this.run.time, this.time);
    const byPart = this.colouring === "kind" || this.colouring === "material";
    const wanted = `${this.colouring} ${this.selected} ${byPart ? 0 : frame} ${this.run.frames.length > 1}`;
    if (wanted === this.coloured) return false;
    this.coloured = wanted;
    const now = this.run.frames[frame];
    if (!byPart && this.ghost === undefined)
      for (let b = 0; b < this.bodyColour.length; ++b) this.bodyColour[b] = this.calcColour(b, frame, now);
    const parts = this.colouring === "kind" ? this.colourOfPart : this.colourOfStuff;
    for (let i = 0; i < this.bodyOfInstance.length; ++i) {
      const body = this.bodyOfInstance[i] as number;
      const [r, g, b] = this.ghost ?? (byPart ? (body === this.selected ? chosen : parts[i]) : this.bodyColour[body]) ?? silent;
      this.boxes.setColour(i, r, g, b);
    }
    return true;
  }

  private placeSelection(): void {
    const i = this.bodyOfInstance.indexOf(this.selected);
    this.selection.visible = i >= 0 && this.hidden[this.selected] !== 1;
    if (i < 0) return;
    this.selection.matrix.multiplyMatrices(this.bodyPose[this.selected] as THREE.Matrix4, this.shapePose[i] as THREE.Matrix4);
    this.selection.matrixWorldNeedsUpdate = true;
  }

  /// Body that a ray meets first, -1 if there is none. What a section cuts off is not met.
  pick(ray: THREE.Raycaster): number {
    return this.bodyOfInstance[this.boxes.pick(ray.ray, this.boxes.mesh.material.clippingPlanes ?? [])] ?? -1;
  }

  /// The boxes at the time shown, in the world, of bodies that have moved by more than `least` [m] and are now slower
  /// than `slow` [m/s]; the ground is left out.
  forEachLying(least: number, slow: number, visit: (matrix: THREE.Matrix4, body: number) => void): void {
    const first = this.run.frames[0]?.pose;
    if (first === undefined) return;
    const { frame } = findFrame(this.run.time, this.time);
    for (let i = 0; i < this.shapePose.length; ++i) {
      const body = this.bodyOfInstance[i] as number;
      const e = (this.bodyPose[body] as THREE.Matrix4).elements;
      const way = Math.hypot((e[12] as number) - (first[7 * body] as number), (e[13] as number) - (first[7 * body + 1] as number), (e[14] as number) - (first[7 * body + 2] as number));
      if (!(way > least) || this.isGround(body) || this.calcSpeed(body, frame) > slow) continue;
      this.matrix.multiplyMatrices(this.bodyPose[body] as THREE.Matrix4, this.shapePose[i] as THREE.Matrix4);
      visit(this.matrix, body);
    }
  }
}
