/// Many boxes as one mesh whose corners are computed here: software renderers draw each instance of an instanced mesh as
/// a mesh of its own, which costs more than the box, and so does a vertex shader that looks its box up.
import * as THREE from "three";
import { toScreen } from "./colour";
import type { Triple } from "./data";

const sun = new THREE.Vector3(-0.5, -1, 1.3).normalize();
const manyBoxes = 3000; // from here on edges are left out: they cost more than they show
const perBox = 12; // numbers: three rows of a matrix

// corner k lies at x = k & 1, y = k >> 1 & 1, z = k >> 2 & 1; rows: direction, then the face's corners seen
// counter-clockwise from outside, the one that shades it first
const faces: [string, [number, number, number, number]][] = [
  ["+x", [1, 3, 7, 5]], ["-x", [0, 4, 6, 2]], ["+y", [3, 2, 6, 7]],
  ["-y", [4, 0, 1, 5]], ["+z", [7, 6, 4, 5]], ["-z", [2, 3, 1, 0]],
];

/// Its vertices: which corner of the box each is, which face it shades, its place on the face; six of them for each face.
interface Shape {
  corner: number[];
  face: number[];
  uv: number[];
  index: number[];
}
const perFace = 6;

/// A box of eight corners. Each face is shaded by the corner that its two triangles end with (WebGL takes `flat` values
/// from there), which carries the face's direction: a third of the vertices of a box with four for each face.
function makeLeanBox(): Shape {
  const face = new Array<number>(8).fill(0);
  const index: number[] = [];
  faces.forEach(([, [a, b, c, d]], f) => {
    face[a] = f;
    index.push(b, c, a, c, d, a);
  });
  return { corner: [0, 1, 2, 3, 4, 5, 6, 7], face, uv: [], index };
}

/// A box with four corners for each face, which know their place on it.
function makeEdgedBox(): Shape {
  const shape: Shape = { corner: [], face: [], uv: [], index: [] };
  faces.forEach(([, corners], f) => {
    shape.corner.push(...corners);
    shape.face.push(f, f, f, f);
    shape.uv.push(0, 0, 1, 0, 1, 1, 0, 1);
    shape.index.push(4 * f, 4 * f + 1, 4 * f + 2, 4 * f, 4 * f + 2, 4 * f + 3);
  });
  return shape;
}

function makeGeometry(count: number, one: Shape): THREE.BufferGeometry {
  const corners = one.corner.length;
  const index = new Uint32Array(one.index.length * count);
  for (let i = 0; i < count; ++i) one.index.forEach((v, k) => (index[i * one.index.length + k] = i * corners + v));
  const geometry = new THREE.BufferGeometry();
  const dynamic = (values: Float32Array | Uint16Array, size: number, normalized: boolean): THREE.BufferAttribute =>
    new THREE.BufferAttribute(values, size, normalized).setUsage(THREE.DynamicDrawUsage);
  geometry.setAttribute("position", dynamic(new Float32Array(3 * corners * count), 3, false));
  geometry.setAttribute("tint", dynamic(new Uint16Array(4 * corners * count), 4, true));
  if (one.uv.length > 0) {
    const uv = new Float32Array(one.uv.length * count);
    for (let i = 0; i < count; ++i) uv.set(one.uv, i * one.uv.length);
    geometry.setAttribute("uv", new THREE.BufferAttribute(uv, 2));
  }
  geometry.setIndex(new THREE.BufferAttribute(index, 1).setUsage(THREE.DynamicDrawUsage));
  return geometry;
}

/// The tint of a face as it is, with dark edges drawn in the fragment shader: one draw call for all boxes, and as little
/// as can be done for each pixel.
function makeMaterial(many: boolean): THREE.MeshBasicMaterial {
  const material = new THREE.MeshBasicMaterial();
  const varyings = many ? "flat varying vec3 vTint;" : "varying vec2 vFace;\nvarying vec3 vTint;";
  const edges = `
        vec2 perPixel = max(fwidth(vFace), vec2(1e-6));
        vec2 pixels = min(vFace, 1.0 - vFace) / perPixel;
        float width = 1.0 / max(perPixel.x, perPixel.y);
        float line = (1.0 - smoothstep(0.5, 1.3, min(pixels.x, pixels.y))) * clamp((width - 2.0) / 6.0, 0.0, 1.0);
        diffuseColor.rgb *= 1.0 - 0.34 * line;`;
  material.customProgramCacheKey = () => (many ? "lean boxes" : "boxes with edges");
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = shader.vertexShader
      .replace("#include <common>", `#include <common>\nattribute vec4 tint;\n${varyings}`)
      .replace("#include <begin_vertex>", `#include <begin_vertex>\nvTint = tint.rgb;\n${many ? "" : "vFace = uv;"}`);
    shader.fragmentShader = shader.fragmentShader
      .replace("#include <common>", `#include <common>\n${varyings}`)
      .replace("#include <color_fragment>", `#include <color_fragment>\ndiffuseColor.rgb *= vTint;${many ? "" : edges}`);
  };
  return material;
}

export class Boxes {
  readonly mesh: THREE.Mesh<THREE.BufferGeometry, THREE.MeshBasicMaterial>;
  private readonly values: Float32Array; // (count x perBox)
  private readonly colours: Float32Array; // (count x 3), linear
  private readonly shape: Shape;

  constructor(readonly count: number) {
    const many = count >= manyBoxes;
    this.shape = many ? makeLeanBox() : makeEdgedBox();
    this.values = new Float32Array(perBox * count);
    this.colours = new Float32Array(3 * count);
    this.mesh = new THREE.Mesh(makeGeometry(count, this.shape), makeMaterial(many));
    this.mesh.frustumCulled = false;
    this.mesh.onBeforeRender = (_, __, camera) => this.chooseFaces(camera);
  }

  private readonly eye = new THREE.Vector3(NaN, NaN, NaN); // that the faces were chosen for; NaN: none
  private readonly seenFrom = new THREE.Vector3();
  private hasAllFaces = true;

  /// Leaves out the faces that look away from the camera: in software each triangle costs more than to find that out here.
  /// All are drawn where a section opens the boxes.
  private chooseFaces(camera: THREE.Camera): void {
    const isOpen = this.mesh.material.side === THREE.DoubleSide;
    this.seenFrom.setFromMatrixPosition(camera.matrixWorld);
    if (isOpen ? this.hasAllFaces : this.seenFrom.equals(this.eye)) return;
    this.eye.copy(isOpen ? this.eye.setScalar(NaN) : this.seenFrom);
    this.hasAllFaces = isOpen;
    const { x, y, z } = this.seenFrom;
    const attribute = this.mesh.geometry.getIndex() as THREE.BufferAttribute;
    const index = attribute.array as Uint32Array;
    const one = this.shape.index, n = this.shape.corner.length, v = this.values;
    let count = 0;
    const add = (face: number, first: number): void => {
      for (let k = perFace * face; k < perFace * (face + 1); ++k) index[count++] = first + (one[k] as number);
    };
    for (let box = 0; box < this.count; ++box) {
      const at = perBox * box, first = n * box;
      const dx = x - (v[at + 3] as number), dy = y - (v[at + 7] as number), dz = z - (v[at + 11] as number);
      for (let axis = 0; axis < 3; ++axis) {
        const ax = v[at + axis] as number, ay = v[at + 4 + axis] as number, az = v[at + 8 + axis] as number;
        const along = ax * dx + ay * dy + az * dz, half = 0.5 * (ax * ax + ay * ay + az * az);
        if (isOpen || along > half) add(2 * axis, first);
        if (isOpen || along < -half) add(2 * axis + 1, first);
      }
    }
    attribute.clearUpdateRanges();
    attribute.addUpdateRange(0, count);
    attribute.needsUpdate = true;
    this.mesh.geometry.setDrawRange(0, count);
  }

  /// `matrix` takes the cube of edge 1 around the origin to the box.
  setMatrix(box: number, matrix: THREE.Matrix4): void {
    const e = matrix.elements, v = this.values;
    let at = perBox * box;
    for (let row = 0; row < 3; ++row)
      for (let column = 0; column < 4; ++column) v[at++] = e[4 * column + row] as number;
  }
  setColour(box: number, red: number, green: number, blue: number): void {
    this.colours[3 * box] = red;
    this.colours[3 * box + 1] = green;
    this.colours[3 * box + 2] = blue;
  }

  /// Shows what was set. Faces are lit by the sky from above and by a sun.
  commit(): void {
    const { corner, face } = this.shape;
    const n = corner.length;
    const position = this.mesh.geometry.getAttribute("position"), tint = this.mesh.geometry.getAttribute("tint");
    const p = position.array as Float32Array, t = tint.array as Uint16Array;
    const v = this.values, colours = this.colours;
    const place = new Float64Array(24), shade = new Uint16Array(18);
    for (let box = 0; box < this.count; ++box) {
      const at = perBox * box;
      for (let k = 0; k < 8; ++k) {
        const x = (k & 1) - 0.5, y = ((k >> 1) & 1) - 0.5, z = ((k >> 2) & 1) - 0.5;
        for (let row = 0; row < 3; ++row) {
          const i = at + 4 * row;
          place[3 * k + row] = (v[i] as number) * x + (v[i + 1] as number) * y + (v[i + 2] as number) * z + (v[i + 3] as number);
        }
      }
      // the columns of the matrix are the edges, which are the directions of the faces
      for (let axis = 0; axis < 3; ++axis) {
        const x = v[at + axis] as number, y = v[at + 4 + axis] as number, z = v[at + 8 + axis] as number;
        const length = Math.sqrt(x * x + y * y + z * z) || 1;
        const lit = (x * sun.x + y * sun.y + z * sun.z) / length, up = z / length;
        for (let side = 0; side < 2; ++side) {
          const sign = 1 - 2 * side, light = 0.605 * (0.685 + 0.315 * sign * up + Math.max(0, sign * lit));
          for (let c = 0; c < 3; ++c) shade[6 * axis + 3 * side + c] = toScreen((colours[3 * box + c] as number) * light);
        }
      }
      for (let k = 0, to = n * box; k < n; ++k, ++to) {
        const from = 3 * (corner[k] as number), f = 3 * (face[k] as number);
        p[3 * to] = place[from] as number;
        p[3 * to + 1] = place[from + 1] as number;
        p[3 * to + 2] = place[from + 2] as number;
        t[4 * to] = shade[f] as number;
        t[4 * to + 1] = shade[f + 1] as number;
        t[4 * to + 2] = shade[f + 2] as number;
      }
    }
    position.needsUpdate = true;
    tint.needsUpdate = true;
    this.eye.setScalar(NaN);
  }

  /// Box that a ray meets first, -1 if there is none; what lies behind a plane is not met.
  pick(ray: THREE.Ray, planes: readonly THREE.Plane[]): number {
    const { origin: o, direction: d } = ray;
    const v = this.values;
    const point = new THREE.Vector3();
    let found = -1, least = Infinity;
    for (let box = 0; box < this.count; ++box) {
      const at = perBox * box;
      const [a, b, c, x, e, f, g, y, h, i, j, z] = v.subarray(at, at + perBox) as unknown as [number, number, number, number, number, number, number, number, number, number, number, number];
      const volume = a * (f * j - g * i) - b * (e * j - g * h) + c * (e * i - f * h);
      if (!(Math.abs(volume) > 0)) continue;
      // the ray in the frame of the box's edges
      const turn = (px: number, py: number, pz: number): Triple => [
        ((f * j - g * i) * px + (c * i - b * j) * py + (b * g - c * f) * pz) / volume,
        ((g * h - e * j) * px + (a * j - c * h) * py + (c * e - a * g) * pz) / volume,
        ((e * i - f * h) * px + (b * h - a * i) * py + (a * f - b * e) * pz) / volume,
      ];
      const p = turn(o.x - x, o.y - y, o.z - z), q = turn(d.x, d.y, d.z);
      let enter = -Infinity, leave = Infinity;
      for (let k = 0; k < 3; ++k) {
        const s = (-0.5 - (p[k] as number)) / (q[k] as number), t = (0.5 - (p[k] as number)) / (q[k] as number);
        enter = Math.max(enter, Math.min(s, t));
        leave = Math.min(leave, Math.max(s, t));
      }
      if (!(enter <= leave)) continue;
      for (const distance of planes.length > 0 ? [enter, leave] : [enter]) {
        if (distance < 0 || distance >= least) continue;
        point.copy(d).multiplyScalar(distance).add(o);
        if (planes.some((plane) => plane.distanceToPoint(point) < 0)) continue;
        least = distance;
        found = box;
        break;
      }
    }
    return found;
  }
}
