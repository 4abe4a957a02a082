/// What stands still: ground, grid, outline of the building, neighbours, axes.
import * as THREE from "three";
import { findBuildingLines, type Point, type Run } from "./data";

export interface Theme {
  background: string;
  ground: string;
  grid: string;
  outline: string;
  neighbour: string;
  utility: string;
  selection: string;
}
export const lightTheme: Theme = {
  background: "#f4f6f8",
  ground: "#e7eaed",
  grid: "#cdd3d9",
  outline: "#1f4e79",
  neighbour: "#6b4f8a",
  utility: "#b3590a",
  selection: "#c2005f",
};
export const darkTheme: Theme = {
  background: "#14181d",
  ground: "#20262d",
  grid: "#333c46",
  outline: "#8ec5f0",
  neighbour: "#b79be0",
  utility: "#f0a35e",
  selection: "#ffd23f",
};

/// A flat band of some width along a polygon; WebGL's own lines are one pixel wide.
function makeRibbon(points: readonly Point[], closed: boolean, width: number, z: number): THREE.BufferGeometry {
  const vertices: number[] = [];
  const count = closed ? points.length : points.length - 1;
  for (let i = 0; i < count; ++i) {
    const [ax, ay] = points[i] as Point;
    const [bx, by] = points[(i + 1) % points.length] as Point;
    const length = Math.hypot(bx - ax, by - ay);
    if (!(length > 0)) continue;
    const ux = ((bx - ax) / length) * (width / 2);
    const uy = ((by - ay) / length) * (width / 2);
    const corners = [
      [ax - ux + uy, ay - uy - ux],
      [ax - ux - uy, ay - uy + ux],
      [bx + ux - uy, by + uy + ux],
      [bx + ux + uy, by + uy - ux],
    ] as Point[];
    for (const k of [0, 3, 2, 0, 2, 1]) vertices.push((corners[k] as Point)[0], (corners[k] as Point)[1], z);
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(vertices, 3));
  return geometry;
}

/// A label of constant size on the screen. The text is drawn into a picture, never read as markup.
function makeLabel(text: string): THREE.Sprite {
  const shown = text.length > 40 ? `${text.slice(0, 39)}…` : text;
  const canvas = document.createElement("canvas");
  const context = canvas.getContext("2d") as CanvasRenderingContext2D;
  const font = "500 26px system-ui, -apple-system, 'Segoe UI', 'DejaVu Sans', sans-serif";
  context.font = font;
  canvas.width = Math.ceil(context.measureText(shown).width) + 24;
  canvas.height = 40;
  context.font = font;
  context.fillStyle = "rgba(255, 255, 255, 0.88)";
  context.beginPath();
  context.rect(0, 0, canvas.width, canvas.height);
  context.fill();
  context.fillStyle = "#222a33";
  context.textBaseline = "middle";
  context.fillText(shown, 12, 21);
  const texture = new THREE.CanvasTexture(canvas);
  texture.minFilter = THREE.LinearFilter;
  texture.generateMipmaps = false;
  const material = new THREE.SpriteMaterial({ map: texture, sizeAttenuation: false, depthTest: false, transparent: true });
  const sprite = new THREE.Sprite(material);
  sprite.center.set(0.5, 0);
  sprite.renderOrder = 20;
  sprite.userData["pixels"] = { width: canvas.width / 2, height: canvas.height / 2 };
  return sprite;
}

export class Site {
  readonly group = new THREE.Group();
  readonly gridStep: number;
  private readonly materials: Record<keyof Omit<Theme, "background" | "selection">, THREE.Material & { color: THREE.Color }>;
  private readonly labels: THREE.Sprite[] = [];
  /// Labels of long things, which may stand at any of these places.
  private readonly roaming: { label: THREE.Sprite; home: THREE.Vector3; places: THREE.Vector3[] }[] = [];
  private readonly axes = new THREE.Group();
  /// Where the axes may stand.
  private readonly corners: THREE.Vector3[] = [];

  /// `area` is what must lie on the ground plane, `near` all that the building comes to; `height` that of the building [m].
  constructor(run: Run, area: THREE.Box3, near: THREE.Box3, height: number) {
    const size = Math.max(area.max.x - area.min.x, area.max.y - area.min.y, 10);
    this.gridStep = [1, 2, 5, 10, 20, 50, 100].find((s) => size / s <= 24) ?? 200;
    const flat = { side: THREE.DoubleSide };
    this.materials = {
      ground: new THREE.MeshBasicMaterial({ ...flat, polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 2 }),
      grid: new THREE.LineBasicMaterial(),
      outline: new THREE.MeshBasicMaterial(flat),
      neighbour: new THREE.MeshBasicMaterial({ ...flat, transparent: true, opacity: 0.22, depthWrite: false }),
      utility: new THREE.MeshBasicMaterial({ ...flat, transparent: true, opacity: 0.85, depthWrite: false }),
    };
    this.addGround(area);
    const width = Math.max(0.12, height * 0.008);
    const { plans, hull } = findBuildingLines(run);
    for (const plan of plans) this.group.add(new THREE.Mesh(makeRibbon(plan, true, width, 0.03), this.materials.outline));
    if (hull.length >= 2) this.group.add(new THREE.Mesh(makeRibbon(hull, true, width / 3, 0.03), this.materials.outline));
    for (const neighbour of run.neighbours) this.addNeighbour(neighbour.name, neighbour.footprint, neighbour.is_utility, height, width);
    const outline = new THREE.Box3();
    for (const [x, y] of run.building_outline) outline.expandByPoint(new THREE.Vector3(x, y, 0));
    this.addAxes(area, outline.isEmpty() ? [near] : [near, outline], width);
  }

  private addGround(area: THREE.Box3): void {
    const step = this.gridStep;
    const margin = 2 * step;
    const x0 = Math.floor((area.min.x - margin) / step) * step, x1 = Math.ceil((area.max.x + margin) / step) * step;
    const y0 = Math.floor((area.min.y - margin) / step) * step, y1 = Math.ceil((area.max.y + margin) / step) * step;
    const plane = new THREE.Mesh(new THREE.PlaneGeometry(x1 - x0, y1 - y0), this.materials.ground);
    plane.position.set((x0 + x1) / 2, (y0 + y1) / 2, 0);
    this.group.add(plane);
    const lines: number[] = [];
    for (let x = x0; x <= x1 + step / 2; x += step) lines.push(x, y0, 0.01, x, y1, 0.01);
    for (let y = y0; y <= y1 + step / 2; y += step) lines.push(x0, y, 0.01, x1, y, 0.01);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(lines, 3));
    this.group.add(new THREE.LineSegments(geometry, this.materials.grid));
  }

  private addNeighbour(name: string, footprint: readonly Point[], isUtility: boolean, height: number, width: number): void {
    const points = footprint.filter(([x, y]) => Number.isFinite(x) && Number.isFinite(y));
    if (points.length === 0) return;
    const material = isUtility ? this.materials.utility : this.materials.neighbour;
    // The plan gives footprints only; the height is a sign for "something stands here".
    const up = isUtility ? 0.05 : Math.min(6, Math.max(2, 0.2 * height));
    if (!isUtility && points.length >= 3) {
      const shape = new THREE.Shape(points.map(([x, y]) => new THREE.Vector2(x, y)));
      const body = new THREE.ExtrudeGeometry(shape, { depth: up, bevelEnabled: false });
      this.group.add(new THREE.Mesh(body, material));
      const edges = new THREE.LineSegments(new THREE.EdgesGeometry(body, 20), new THREE.LineBasicMaterial());
      edges.material.color = this.materials.neighbour.color;
      this.group.add(edges);
    }
    if (points.length >= 2) {
      const solid = new THREE.MeshBasicMaterial({ side: THREE.DoubleSide });
      solid.color = material.color;
      this.group.add(new THREE.Mesh(makeRibbon(points, points.length > 2, width, 0.04), solid));
    }
    const centre = points.reduce((sum, p) => [sum[0] + p[0] / points.length, sum[1] + p[1] / points.length] as Point, [0, 0] as Point);
    if (name === "") return;
    const label = this.addLabel(name, centre[0], centre[1], up + 0.3);
    if (!isUtility) return;
    const places = points.flatMap(([x, y], i) => {
      const [bx, by] = points[(i + 1) % points.length] as Point;
      return Array.from({ length: 12 }, (_, k) => new THREE.Vector3(x + (k / 12) * (bx - x), y + (k / 12) * (by - y), up + 0.3));
    });
    this.roaming.push({ label, home: label.position.clone(), places });
  }

  /// Arrows with their labels, at the area's corner or at one of `around`: placeAxes.
  private addAxes(area: THREE.Box3, around: THREE.Box3[], width: number): void {
    const s = this.gridStep;
    this.group.add(this.axes);
    for (const [dx, dy, name] of [[1, 0, "x"], [0, 1, "y"]] as [number, number, string][]) {
      const tip: Point = [dx * s, dy * s];
      this.axes.add(new THREE.Mesh(makeRibbon([[0, 0], tip], false, width, 0.05), this.materials.outline));
      const head: Point[] = [
        [tip[0] - 0.25 * s * dx - 0.15 * s * dy, tip[1] - 0.25 * s * dy - 0.15 * s * dx],
        tip,
        [tip[0] - 0.25 * s * dx + 0.15 * s * dy, tip[1] - 0.25 * s * dy + 0.15 * s * dx],
      ];
      this.axes.add(new THREE.Mesh(makeRibbon(head, false, width, 0.05), this.materials.outline));
      this.axes.add(this.addLabel(name, 1.2 * tip[0], 1.2 * tip[1], 0.1));
    }
    const before = (v: number): number => Math.floor((v - 0.5 * s) / s) * s, behind = (v: number): number => Math.ceil((v + 0.5 * s) / s) * s;
    this.axes.position.set(before(area.min.x), before(area.min.y), 0);
    this.corners.push(this.axes.position.clone());
    for (const box of around)
      for (const x of [before(box.min.x), behind(box.max.x)])
        for (const y of [before(box.min.y), behind(box.max.y)]) this.corners.push(new THREE.Vector3(x, y, 0));
  }

  /// The axes are looked for a place anew.
  resetAxes(): void {
    this.axes.position.copy(this.corners[0] as THREE.Vector3);
  }

  /// Leaves the axes where they are while they are in the picture; else puts them to the first corner at which they are and
  /// that does not lie behind `centre`.
  private placeAxes(camera: THREE.PerspectiveCamera, centre: THREE.Vector3): void {
    camera.updateMatrixWorld();
    const reach = 1.2 * this.gridStep;
    const p = new THREE.Vector3();
    const isSeen = (corner: THREE.Vector3): boolean =>
      ([[0, 0], [reach, 0], [0, reach]] as Point[]).every(([dx, dy]) => {
        p.set(corner.x + dx, corner.y + dy, 0).project(camera);
        return p.z <= 1 && Math.abs(p.x) <= 0.97 && p.y >= -0.97 && p.y <= 0.9;
      });
    if (isSeen(this.axes.position)) return;
    const toEye = camera.position.clone().sub(centre).normalize();
    const isBehind = ({ x, y }: THREE.Vector3): boolean => (x - centre.x) * toEye.x + (y - centre.y) * toEye.y < -0.5 * Math.hypot(x - centre.x, y - centre.y);
    this.axes.position.copy(this.corners.find((corner) => !isBehind(corner) && isSeen(corner)) ?? (this.corners[0] as THREE.Vector3));
  }

  /// Puts the labels of long things where they are in the picture and farthest from `centre`, and the axes where they are in it.
  placeLabels(camera: THREE.PerspectiveCamera, width: number, centre: THREE.Vector3): void {
    this.placeAxes(camera, centre);
    const middle = centre.clone().project(camera);
    const p = new THREE.Vector3();
    for (const { label, home, places } of this.roaming) {
      label.position.copy(home);
      const margin = (label.userData["pixels"] as { width: number }).width / Math.max(1, width);
      let best = -1;
      for (const place of places) {
        p.copy(place).project(camera);
        if (p.z > 1 || Math.abs(p.x) > 0.98 - margin || p.y < -0.95 || p.y > 0.88) continue;
        const far = Math.hypot((p.x - middle.x) * camera.aspect, p.y - middle.y);
        if (far <= best + 0.01) continue; // the first of equals, so that round-off does not move it
        best = far;
        label.position.copy(place);
      }
    }
  }

  showLabels(visible: boolean): void {
    for (const label of this.labels) label.visible = visible;
  }

  private addLabel(text: string, x: number, y: number, z: number): THREE.Sprite {
    const label = makeLabel(text);
    label.position.set(x, y, z);
    this.labels.push(label);
    this.group.add(label);
    return label;
  }

  setTheme(theme: Theme): void {
    for (const key of Object.keys(this.materials) as (keyof typeof this.materials)[]) this.materials[key].color.set(theme[key]);
  }

  /// Keeps the labels at their size in pixels.
  setViewport(height: number, fov: number): void {
    const perPixel = (2 * Math.tan((fov * Math.PI) / 360)) / Math.max(1, height);
    for (const label of this.labels) {
      const pixels = label.userData["pixels"] as { width: number; height: number };
      label.scale.set(pixels.width * perPixel, pixels.height * perPixel, 1);
    }
  }
}
