/// The picture of the building at one time. Draws only when something has changed.
import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { Quadruple, Run, Triple } from "./data";
import { calcPose, findFrame } from "./data";
import { Site, darkTheme, lightTheme } from "./site";
import type { Colouring, ZoneMarks } from "./state";
import { colourOfKind, colourOfUtilisation, zoneStates } from "./vocabulary";
import { findParts, partOfShape, type ZonesOfBody } from "./zones";

export type View = "oblique" | "front" | "side" | "top";
const viewDirections: Record<View, Triple> = {
  oblique: [-0.62, -1, 0.5],
  side: [0, -1, 0.06],
  front: [-1, 0, 0.06],
  top: [0, -1e-3, 1],
};
const fov = 32;
const broken = 3; // index in zoneStates
const outside = new THREE.Matrix4().makeScale(0, 0, 0);

function makeMarkGeometry(shape: string): THREE.BufferGeometry {
  switch (shape) {
    case "triangle":
      return new THREE.ConeGeometry(1.1, 1.7, 3).rotateX(Math.PI / 2);
    case "diamond":
      return new THREE.OctahedronGeometry(1.15);
    case "cross": {
      const box = new THREE.BoxGeometry(2.4, 0.6, 0.6);
      return mergeGeometries([box.clone().rotateY(Math.PI / 4), box.clone().rotateY(-Math.PI / 4), box.clone().rotateZ(Math.PI / 2)]);
    }
    case "star":
      return new THREE.TetrahedronGeometry(1.4);
    default:
      return new THREE.SphereGeometry(0.7, 10, 8);
  }
}

function mergeGeometries(parts: THREE.BufferGeometry[]): THREE.BufferGeometry {
  const positions: number[] = [];
  for (const part of parts) positions.push(...part.toNonIndexed().getAttribute("position").array);
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(positions, 3));
  return geometry;
}

/// Lambert shading with dark edges, drawn in the fragment shader so that one call draws all boxes.
function makeBoxMaterial(): THREE.MeshLambertMaterial {
  const material = new THREE.MeshLambertMaterial();
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = shader.vertexShader
      .replace("#include <common>", "#include <common>\nvarying vec2 vFace;")
      .replace("#include <begin_vertex>", "#include <begin_vertex>\nvFace = uv;");
    shader.fragmentShader = shader.fragmentShader
      .replace("#include <common>", "#include <common>\nvarying vec2 vFace;")
      .replace(
        "#include <color_fragment>",
        `#include <color_fragment>
        vec2 perPixel = max(fwidth(vFace), vec2(1e-6));
        vec2 pixels = min(vFace, 1.0 - vFace) / perPixel;
        float width = 1.0 / max(perPixel.x, perPixel.y);
        float line = (1.0 - smoothstep(0.5, 1.3, min(pixels.x, pixels.y))) * clamp((width - 2.0) / 6.0, 0.0, 1.0);
        diffuseColor.rgb *= 1.0 - 0.6 * line;`,
      );
  };
  return material;
}

export class Scene {
  /// Called when a picture is due; the owner then calls render().
  onChange: () => void = () => undefined;
  readonly gridStep: number;
  private readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  private readonly camera = new THREE.PerspectiveCamera(fov, 1, 0.1, 1000);
  private readonly controls: OrbitControls;
  private readonly boxes: THREE.InstancedMesh;
  private readonly bodyOfInstance: number[] = [];
  private readonly partOfInstance: string[] = [];
  private readonly shapePose: THREE.Matrix4[] = [];
  private readonly bodyPose: THREE.Matrix4[];
  private readonly marks: THREE.InstancedMesh<THREE.BufferGeometry, THREE.MeshBasicMaterial>[];
  private readonly zonePlace: { body: number; local: THREE.Vector3 }[];
  private readonly selection: THREE.LineSegments<THREE.BufferGeometry, THREE.LineBasicMaterial>;
  private readonly site: Site;
  private readonly bounds = new THREE.Box3();
  private readonly fitPoints: THREE.Vector3[] = [];
  private readonly kinds: string[];
  private readonly markSize: number;
  private width = 1;
  private height = 1;
  private colouring: Colouring = "kind";
  private zoneMarks: ZoneMarks = "damaged";
  private selected = -1;
  private time = 0;
  private dark = false;

  /// Throws if the browser offers no WebGL.
  constructor(
    canvas: HTMLCanvasElement,
    private readonly run: Run,
    private readonly zonesOfBody: ZonesOfBody,
  ) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, powerPreference: "high-performance" });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.kinds = findParts(run);
    this.bodyPose = run.bodies.map(() => new THREE.Matrix4());

    this.boxes = this.makeBoxes();
    this.scene.add(this.boxes);
    this.collectFitPoints();
    const buildingHeight = Math.max(1, this.bounds.max.z);
    this.markSize = Math.min(0.6, Math.max(0.15, buildingHeight * 0.013));

    const area = this.bounds.clone();
    for (const n of run.neighbours) for (const [x, y] of n.footprint) if (Number.isFinite(x + y)) area.expandByPoint(new THREE.Vector3(x, y, 0));
    this.site = new Site(run, area, buildingHeight);
    this.gridStep = this.site.gridStep;
    this.scene.add(this.site.group);

    this.zonePlace = run.zones.map((zone) => this.placeZone(zone.place, zone.body_a >= 0 ? zone.body_a : zone.body_b));
    this.marks = zoneStates.map((state) => {
      const mesh = new THREE.InstancedMesh(
        makeMarkGeometry(state.shape),
        new THREE.MeshBasicMaterial({ color: state.colour, depthTest: false, transparent: true, opacity: 0.95 }),
        Math.max(1, run.zones.length),
      );
      mesh.count = 0;
      mesh.frustumCulled = false;
      mesh.renderOrder = 10;
      this.scene.add(mesh);
      return mesh;
    });

    const edges = new THREE.EdgesGeometry(new THREE.BoxGeometry(1, 1, 1));
    this.selection = new THREE.LineSegments(edges, new THREE.LineBasicMaterial({ depthTest: false }));
    this.selection.renderOrder = 15;
    this.selection.matrixAutoUpdate = false;
    this.selection.visible = false;
    this.scene.add(this.selection);

    const sun = new THREE.DirectionalLight("#ffffff", 1.9);
    sun.position.set(-0.5, -1, 1.3);
    this.scene.add(new THREE.HemisphereLight("#ffffff", "#a8a39b", 1.9), sun);

    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.maxPolarAngle = Math.PI * 0.55;
    this.controls.addEventListener("change", () => this.onChange());
    this.setDark(false);
    this.setTime(run.time[0] ?? 0);
    this.fit("oblique");
  }

  private makeBoxes(): THREE.InstancedMesh {
    this.run.bodies.forEach((body, index) => {
      for (const shape of body.shapes) {
        const [w, x, y, z] = shape.orientation;
        this.bodyOfInstance.push(index);
        this.partOfInstance.push(partOfShape(body, shape));
        this.shapePose.push(
          new THREE.Matrix4().compose(
            new THREE.Vector3(...shape.centre),
            new THREE.Quaternion(x, y, z, w),
            new THREE.Vector3(...shape.half).multiplyScalar(2),
          ),
        );
      }
    });
    const count = this.shapePose.length;
    const boxes = new THREE.InstancedMesh(new THREE.BoxGeometry(1, 1, 1), makeBoxMaterial(), Math.max(1, count));
    boxes.count = count;
    boxes.frustumCulled = false;
    boxes.instanceColor = new THREE.InstancedBufferAttribute(new Float32Array(3 * Math.max(1, count)), 3);
    return boxes;
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

  private calcBodyPoses(t: number): void {
    const p: Triple = [0, 0, 0];
    const q: Quadruple = [1, 0, 0, 0];
    const { frame, fraction } = findFrame(this.run.time, t);
    for (let b = 0; b < this.bodyPose.length; ++b) {
      const pose = this.bodyPose[b] as THREE.Matrix4;
      if (this.run.time.length === 0) pose.identity();
      else if (calcPose(this.run, b, frame, fraction, p, q))
        pose.compose(this.point.set(...p), this.turn.set(q[1], q[2], q[3], q[0]), this.unit);
      else pose.copy(outside);
    }
  }

  private calcCornersAt(t: number): THREE.Vector3[] {
    const corners: THREE.Vector3[] = [];
    if (this.run.time.length === 0) return corners;
    this.calcBodyPoses(t);
    this.shapePose.forEach((shape, i) => {
      const body = this.bodyOfInstance[i] as number;
      const info = this.run.bodies[body];
      if (info === undefined || info.shapes.some((s) => s.material === "ground")) return;
      this.matrix.multiplyMatrices(this.bodyPose[body] as THREE.Matrix4, shape);
      if (this.matrix.determinant() === 0) return;
      for (let k = 0; k < 8; ++k)
        corners.push(new THREE.Vector3((k & 1) - 0.5, ((k >> 1) & 1) - 0.5, ((k >> 2) & 1) - 0.5).applyMatrix4(this.matrix));
    });
    return corners;
  }

  /// What a fitted picture must show: the building all along the run and the neighbours near to it.
  private collectFitPoints(): void {
    const { time } = this.run;
    for (const s of [0, 0.25, 0.5, 0.75, 1])
      for (const corner of this.calcCornersAt(time[Math.round(s * (time.length - 1))] ?? 0)) {
        corner.z = Math.max(corner.z, -2);
        this.fitPoints.push(corner);
      }
    for (const [x, y] of this.run.building_outline) this.fitPoints.push(new THREE.Vector3(x, y, 0));
    if (this.fitPoints.length === 0) this.fitPoints.push(new THREE.Vector3(-5, -5, 0), new THREE.Vector3(5, 5, 5));
    this.bounds.setFromPoints(this.fitPoints);
    const near = this.bounds.clone().expandByScalar(0.5 * this.bounds.getSize(new THREE.Vector3()).length());
    for (const neighbour of this.run.neighbours) {
      if (neighbour.is_utility) continue;
      const corners = neighbour.footprint.map(([x, y]) => new THREE.Vector3(x, y, 0));
      if (corners.every((c) => near.containsPoint(c))) this.fitPoints.push(...corners);
    }
  }

  setDark(dark: boolean): void {
    this.dark = dark;
    const theme = dark ? darkTheme : lightTheme;
    this.scene.background = new THREE.Color(theme.background);
    this.site.setTheme(theme);
    this.selection.material.color.set(theme.selection);
    zoneStates.forEach((state, i) => this.marks[i]?.material.color.set((dark ? state.onDark : undefined) ?? state.colour));
    this.onChange();
  }

  setTime(t: number): void {
    this.time = t;
    this.calcBodyPoses(t);
    for (let i = 0; i < this.shapePose.length; ++i) {
      this.matrix.multiplyMatrices(this.bodyPose[this.bodyOfInstance[i] as number] as THREE.Matrix4, this.shapePose[i] as THREE.Matrix4);
      this.boxes.setMatrixAt(i, this.matrix);
    }
    this.boxes.instanceMatrix.needsUpdate = true;
    this.boxes.boundingSphere = null; // picking must not use that of another time
    this.placeMarks();
    this.colourBoxes();
    this.placeSelection();
    this.onChange();
  }

  setLook(colouring: Colouring, zoneMarks: ZoneMarks, selected: number): void {
    this.colouring = colouring;
    this.zoneMarks = zoneMarks;
    this.selected = selected;
    this.placeMarks();
    this.colourBoxes();
    this.placeSelection();
    this.onChange();
  }

  private placeMarks(): void {
    const Z = this.run.zones.length;
    const { frame } = findFrame(this.run.time, this.time);
    // A break is marked while it is fresh: later its parts lie apart, and marks would hide them.
    const earlier = findFrame(this.run.time, this.time - 0.4).frame;
    const before = this.run.zone_state.subarray(earlier * Z, (earlier + 1) * Z);
    for (const mesh of this.marks) mesh.count = 0;
    if (this.zoneMarks !== "none" && this.run.time.length > 0)
      for (let z = 0; z < Z; ++z) {
        const state = this.run.zone_state[frame * Z + z] as number;
        const mesh = this.marks[state];
        if (mesh === undefined || (this.zoneMarks === "damaged" && (state === 0 || (state === broken && before[z] === broken)))) continue;
        const { body, local } = this.zonePlace[z] as { body: number; local: THREE.Vector3 };
        this.point.copy(local);
        if (body >= 0) this.point.applyMatrix4(this.bodyPose[body] as THREE.Matrix4);
        const size = state === 0 ? 0.6 * this.markSize : this.markSize;
        this.matrix.makeScale(size, size, size).setPosition(this.point);
        mesh.setMatrixAt(mesh.count++, this.matrix);
      }
    for (const mesh of this.marks) {
      mesh.instanceMatrix.needsUpdate = true;
      mesh.visible = mesh.count > 0;
    }
  }

  private colourOfBody(body: number, frame: number): string {
    const info = this.run.bodies[body];
    if (info === undefined) return "#b9c0c7";
    const Z = this.run.zones.length;
    const zones = this.zonesOfBody[body] ?? [];
    if (zones.length === 0) return "#c3c9cf";
    if (this.colouring === "state") {
      let worst = 0;
      for (const z of zones) worst = Math.max(worst, this.run.zone_state[frame * Z + z] ?? 0);
      return worst === 0 ? "#dde2e6" : (zoneStates[worst]?.colour ?? "#dde2e6");
    }
    let most = 0;
    for (const z of zones) {
      const u = this.run.zone_utilisation[frame * Z + z] as number;
      if (u > most) most = u;
    }
    return colourOfUtilisation(most);
  }

  private readonly colour = new THREE.Color();
  private colourBoxes(): void {
    const { frame } = findFrame(this.run.time, this.time);
    const byKind = this.colouring === "kind";
    const colours = byKind ? [] : this.run.bodies.map((_, body) => this.colourOfBody(body, frame));
    for (let i = 0; i < this.bodyOfInstance.length; ++i) {
      const body = this.bodyOfInstance[i] as number;
      const ofKind = body === this.selected ? "#f5d033" : colourOfKind(this.partOfInstance[i] as string, this.kinds);
      this.boxes.setColorAt(i, this.colour.set(byKind ? ofKind : (colours[body] as string)));
    }
    if (this.boxes.instanceColor !== null) this.boxes.instanceColor.needsUpdate = true;
  }

  private placeSelection(): void {
    const i = this.bodyOfInstance.indexOf(this.selected);
    this.selection.visible = i >= 0;
    if (i < 0) return;
    this.selection.matrix.multiplyMatrices(this.bodyPose[this.selected] as THREE.Matrix4, this.shapePose[i] as THREE.Matrix4);
    this.selection.matrixWorldNeedsUpdate = true;
  }

  resize(width: number, height: number): void {
    this.width = Math.max(1, width);
    this.height = Math.max(1, height);
    this.renderer.setSize(this.width, this.height, false);
    this.useAspect(this.width, this.height);
    this.onChange();
  }

  private useAspect(width: number, height: number): void {
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.site.setViewport(height, fov);
  }

  /// Looks at the whole collapse from one side, as near as the picture allows.
  fit(view?: View): void {
    const from = view === undefined ? this.camera.position.clone().sub(this.controls.target) : new THREE.Vector3(...viewDirections[view]);
    from.normalize();
    const right = new THREE.Vector3().crossVectors(this.camera.up, from).normalize();
    const up = new THREE.Vector3().crossVectors(from, right);
    const tall = Math.tan((fov * Math.PI) / 360) / 1.05;
    const wide = tall * this.camera.aspect;
    // A point at (x, y, z) along right, up and from is in the picture if |x - cx| <= (d - z) wide, and so for y: the
    // largest of x / wide + z and of -x / wide + z give d and cx.
    let east = -Infinity, west = -Infinity, north = -Infinity, south = -Infinity;
    for (const point of this.fitPoints) {
      const x = point.dot(right) / wide, y = point.dot(up) / tall, z = point.dot(from);
      east = Math.max(east, z + x);
      west = Math.max(west, z - x);
      north = Math.max(north, z + y);
      south = Math.max(south, z - y);
    }
    const d = Math.max((east + west) / 2, (north + south) / 2);
    const depth = this.bounds.getCenter(new THREE.Vector3()).dot(from);
    const distance = Math.max(1, d - depth);
    this.controls.target
      .copy(right).multiplyScalar((wide * (east - west)) / 2)
      .addScaledVector(up, (tall * (north - south)) / 2)
      .addScaledVector(from, depth);
    this.camera.position.copy(this.controls.target).addScaledVector(from, distance);
    this.camera.near = distance / 100;
    this.camera.far = distance * 12;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.onChange();
  }

  /// Body under a place of the canvas, -1 if there is none.
  pick(x: number, y: number): number {
    const ray = new THREE.Raycaster();
    ray.setFromCamera(new THREE.Vector2((2 * x) / this.width - 1, 1 - (2 * y) / this.height), this.camera);
    const hit = ray.intersectObject(this.boxes)[0];
    return hit?.instanceId === undefined ? -1 : (this.bodyOfInstance[hit.instanceId] ?? -1);
  }

  render(): void {
    this.camera.updateMatrixWorld();
    this.site.placeLabels(this.camera, this.width, this.bounds.getCenter(this.point));
    this.renderer.render(this.scene, this.camera);
  }

  dispose(): void {
    this.controls.dispose();
    this.scene.traverse((object) => {
      const { geometry, material } = object as Partial<THREE.Mesh>;
      geometry?.dispose();
      for (const one of Array.isArray(material) ? material : [material]) {
        (one as THREE.SpriteMaterial | undefined)?.map?.dispose();
        one?.dispose();
      }
    });
    this.renderer.dispose();
  }

  /// Pictures of the run at given times, on a light ground so that they print well.
  makeStills(times: readonly number[], width: number, height: number): string[] {
    const { time, selected, dark, colouring, zoneMarks } = this;
    const changed = this.onChange;
    const ratio = this.renderer.getPixelRatio();
    const eye = this.camera.position.clone();
    const target = this.controls.target.clone();
    this.onChange = () => undefined;
    this.selected = -1;
    this.colouring = "kind";
    this.zoneMarks = "none";
    this.site.showLabels(false); // too large for small pictures
    this.setDark(false);
    this.renderer.setPixelRatio(1);
    this.renderer.setSize(width, height, false);
    this.useAspect(width, height);
    this.fit("oblique");
    const canvas = document.createElement("canvas");
    canvas.width = width;
    canvas.height = height;
    const pictures = times.map((t) => {
      this.setTime(t);
      this.render();
      // In the same task as the drawing, while the picture is still there.
      canvas.getContext("2d")?.drawImage(this.renderer.domElement, 0, 0);
      return canvas.toDataURL("image/png");
    });
    this.camera.position.copy(eye);
    this.controls.target.copy(target);
    this.selected = selected;
    this.colouring = colouring;
    this.zoneMarks = zoneMarks;
    this.site.showLabels(true);
    this.renderer.setPixelRatio(ratio);
    this.setDark(dark);
    this.resize(this.width, this.height);
    this.controls.update();
    this.setTime(time);
    this.onChange = changed;
    this.onChange();
    return pictures;
  }
}
