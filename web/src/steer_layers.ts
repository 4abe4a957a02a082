/// What lies over the building: heights of the debris, charges that wait, what has just happened.
import * as THREE from "three";
import type { Building } from "./building";
import type { Run } from "./data";
import { SignMesh } from "./sign_mesh";
import { wordsOfEvent } from "./vocabulary";
import { findBody } from "./zones";

/// Heights of which the debris gets a line [m]; the first one is its outline.
export const contourLevels = [0.2, 1, 2, 4, 8];
export const contourColours = ["#c2005f", "#56b4e9", "#2f8fc0", "#1b6ca8", "#0b3d66"];

const margin = 5; // cells around the debris, more than closeGaps reaches

/// Highest point, over each cell of a grid, of what lies elsewhere than it stood: moved by more than 1 m, slower than 2 m/s.
export function calcHeights(building: Building, cell: number): { x0: number; y0: number; nx: number; ny: number; height: Float32Array } {
  const corner = new THREE.Vector3();
  const boxes: Float64Array[] = [];
  let x0 = Infinity, y0 = Infinity, x1 = -Infinity, y1 = -Infinity;
  building.forEachLying(1, 2, (m) => {
    const e = m.elements;
    if (!Number.isFinite(e[12] as number) || m.determinant() === 0) return;
    boxes.push(Float64Array.from(e));
    for (let k = 0; k < 8; ++k) {
      corner.set((k & 1) - 0.5, ((k >> 1) & 1) - 0.5, ((k >> 2) & 1) - 0.5).applyMatrix4(m);
      x0 = Math.min(x0, corner.x), x1 = Math.max(x1, corner.x);
      y0 = Math.min(y0, corner.y), y1 = Math.max(y1, corner.y);
    }
  });
  if (boxes.length === 0) return { x0: 0, y0: 0, nx: 0, ny: 0, height: new Float32Array(0) };
  x0 -= margin * cell, y0 -= margin * cell;
  const nx = Math.min(600, Math.ceil((x1 - x0) / cell) + margin + 1), ny = Math.min(600, Math.ceil((y1 - y0) / cell) + margin + 1);
  const height = new Float32Array(nx * ny);
  const matrix = new THREE.Matrix4(), inverse = new THREE.Matrix4();
  const a = new THREE.Vector3(), b = new THREE.Vector3();
  for (const e of boxes) {
    matrix.fromArray(e);
    inverse.copy(matrix).invert();
    // half the extent of the box along x and y of the world
    const rx = (Math.abs(e[0] as number) + Math.abs(e[4] as number) + Math.abs(e[8] as number)) / 2;
    const ry = (Math.abs(e[1] as number) + Math.abs(e[5] as number) + Math.abs(e[9] as number)) / 2;
    const cx = e[12] as number, cy = e[13] as number;
    const top = (e[14] as number) + (Math.abs(e[2] as number) + Math.abs(e[6] as number) + Math.abs(e[10] as number)) / 2;
    for (let j = Math.max(0, Math.floor((cy - ry - y0) / cell)); j <= Math.min(ny - 1, Math.ceil((cy + ry - y0) / cell)); ++j)
      for (let i = Math.max(0, Math.floor((cx - rx - x0) / cell)); i <= Math.min(nx - 1, Math.ceil((cx + rx - x0) / cell)); ++i) {
        // where the upright line through the cell's middle leaves the box, in the box's frame of edges -1/2 .. 1/2
        const x = x0 + i * cell, y = y0 + j * cell;
        a.set(x, y, top).applyMatrix4(inverse);
        b.set(x, y, top - 1).applyMatrix4(inverse).sub(a);
        let enter = -Infinity, leave = Infinity;
        for (const axis of ["x", "y", "z"] as const) {
          if (Math.abs(b[axis]) < 1e-12) {
            if (Math.abs(a[axis]) > 0.5) enter = Infinity;
            continue;
          }
          const s = (-0.5 - a[axis]) / b[axis], t = (0.5 - a[axis]) / b[axis];
          enter = Math.max(enter, Math.min(s, t));
          leave = Math.min(leave, Math.max(s, t));
        }
        if (enter <= leave) height[j * nx + i] = Math.max(height[j * nx + i] as number, top - enter);
      }
  }
  return { x0, y0, nx, ny, height };
}

/// Fills gaps narrower than twice `radius` cells: the highest of the neighbours, then the lowest of those. The outer line
/// stays where it is.
export function closeGaps(grid: { nx: number; ny: number; height: Float32Array }, radius: number): void {
  const { nx, ny, height } = grid;
  const pass = (from: Float32Array, step: number, count: number, lines: number, lineStep: number, pick: (a: number, b: number) => number): Float32Array => {
    const to = new Float32Array(from.length);
    for (let line = 0; line < lines; ++line)
      for (let k = 0; k < count; ++k) {
        let value = from[line * lineStep + k * step] as number;
        for (let d = Math.max(0, k - radius); d <= Math.min(count - 1, k + radius); ++d) value = pick(value, from[line * lineStep + d * step] as number);
        to[line * lineStep + k * step] = value;
      }
    return to;
  };
  for (const pick of [Math.max, Math.min] as const) height.set(pass(pass(height, 1, nx, ny, nx, pick), nx, ny, nx, 1, pick));
}

/// Pieces of the line at one height through a grid (marching squares): x y x y ...
export function findContour(grid: { x0: number; y0: number; nx: number; ny: number; height: Float32Array }, cell: number, level: number): number[] {
  const { x0, y0, nx, ny, height } = grid;
  const out: number[] = [];
  for (let j = 0; j + 1 < ny; ++j)
    for (let i = 0; i + 1 < nx; ++i) {
      const h = [height[j * nx + i], height[j * nx + i + 1], height[(j + 1) * nx + i + 1], height[(j + 1) * nx + i]] as number[];
      const cross: number[] = [];
      for (let k = 0; k < 4; ++k) {
        const a = (h[k] as number) - level, b = (h[(k + 1) % 4] as number) - level;
        if (a < 0 === b < 0) continue;
        const s = a / (a - b);
        const [ax, ay] = [[0, 0], [1, 0], [1, 1], [0, 1]][k] as [number, number];
        const [bx, by] = [[1, 0], [1, 1], [0, 1], [0, 0]][k] as [number, number];
        cross.push(x0 + (i + ax + s * (bx - ax)) * cell, y0 + (j + ay + s * (by - ay)) * cell);
      }
      if (cross.length >= 4) out.push(...cross.slice(0, 4));
      if (cross.length === 8) out.push(...cross.slice(4));
    }
  return out;
}

export class DebrisLayer {
  readonly group = new THREE.Group();
  private readonly lines: THREE.LineSegments<THREE.BufferGeometry, THREE.LineBasicMaterial>[];
  constructor() {
    this.lines = contourLevels.map((_, k) => {
      const lines = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: contourColours[k] as string, depthTest: k > 0 }));
      lines.frustumCulled = false;
      lines.renderOrder = 5;
      this.group.add(lines);
      return lines;
    });
  }
  /// Outline on the ground, the other lines at their height.
  update(building: Building): void {
    const size = building.bounds.max.x - building.bounds.min.x + building.bounds.max.y - building.bounds.min.y;
    const cell = Math.max(0.4, size / 240);
    const grid = calcHeights(building, cell);
    closeGaps(grid, Math.min(margin - 1, Math.ceil(1.2 / cell)));
    contourLevels.forEach((level, k) => {
      const flat = findContour(grid, cell, level);
      const points = new Float32Array((flat.length / 2) * 3);
      for (let i = 0; i < flat.length / 2; ++i) points.set([flat[2 * i] as number, flat[2 * i + 1] as number, k === 0 ? 0.06 : level], 3 * i);
      this.lines[k]?.geometry.setAttribute("position", new THREE.BufferAttribute(points, 3));
    });
  }
}

const shownFor = 0.4; // [s]
const most = 400;

/// Signs of what has just happened (contacts, touchdowns, breaks) and of charges that wait.
export class EventLayer {
  readonly group = new THREE.Group();
  private readonly signs = new SignMesh(0.9);
  private readonly place = new THREE.Vector3();
  private readonly colour = new THREE.Color();
  private readonly chargeColour = new THREE.Color("#e0218a");
  private bodies = new Map<string, number>();
  private run: Run | undefined;

  constructor() {
    this.signs.mesh.renderOrder = 12;
    this.group.add(this.signs.mesh);
  }

  private findBody(run: Run, name: string): number {
    if (this.run !== run) {
      this.run = run;
      this.bodies = new Map();
    }
    let body = this.bodies.get(name);
    if (body === undefined) this.bodies.set(name, (body = findBody(run, name)));
    return body;
  }

  update(run: Run, building: Building, time: number, waiting: readonly { member: string }[]): void {
    this.signs.clear();
    let n = 0;
    for (let k = run.events.length - 1; k >= 0 && n < most; --k) {
      const event = run.events[k];
      if (event === undefined || event.time > time || event.time < time - shownFor || !["contact", "touchdown", "charge", "release", "cable"].includes(event.kind)) continue;
      const body = this.findBody(run, event.subject);
      if (body < 0 || !building.findPlace(body, this.place)) continue;
      const age = (time - event.time) / shownFor;
      const size = building.markSize * (event.kind === "touchdown" ? 3 : 1.8) * (1 + age);
      const { colour } = wordsOfEvent(event.kind);
      this.signs.add("ring", this.place, size, this.colour.set(colour.startsWith("#") ? colour : "#8a5a3c"), true);
      ++n;
    }
    n = 0;
    for (const { member } of waiting) {
      const body = n < most ? this.findBody(run, member) : -1;
      if (body < 0 || !building.findPlace(body, this.place)) continue;
      this.signs.add("bar", this.place, 0.8 * building.markSize, this.chargeColour);
      ++n;
    }
    this.signs.commit();
  }
}
