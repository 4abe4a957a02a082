/// Signs in the picture as one mesh that is filled anew when the time changes: software renderers draw each instance of an
/// instanced mesh as a mesh of its own.
import * as THREE from "three";

type Corner = readonly [number, number];

const fan = (corners: readonly Corner[]): Corner[] => corners.slice(2).flatMap((c, i) => [corners[0] as Corner, corners[i + 1] as Corner, c]);
const around = (count: number, radius: number): Corner[] =>
  Array.from({ length: count }, (_, k): Corner => [radius * Math.cos((2 * Math.PI * k) / count), radius * Math.sin((2 * Math.PI * k) / count)]);
const turned = (corners: readonly Corner[], angle: number): Corner[] =>
  corners.map(([x, y]): Corner => [x * Math.cos(angle) - y * Math.sin(angle), x * Math.sin(angle) + y * Math.cos(angle)]);
const rectangle = (x: number, y: number): Corner[] => fan([[-x, -y], [x, -y], [x, y], [-x, y]]);
const ray = fan([[-1.4, 0], [0, -0.42], [1.4, 0], [0, 0.42]]);
const band = (outer: readonly Corner[], inner: readonly Corner[]): Corner[] =>
  outer.flatMap((a, i) => {
    const next = (i + 1) % outer.length;
    return fan([a, outer[next] as Corner, inner[next] as Corner, inner[i] as Corner]);
  });

/// Triangles, of about the size 1 around the middle.
const shapes = {
  circle: fan(around(8, 0.7)),
  triangle: fan([[0, 0.95], [-0.98, -0.75], [0.98, -0.75]]),
  diamond: fan(around(4, 1.15)),
  square: rectangle(0.75, 0.75),
  cross: [...turned(rectangle(1.2, 0.3), Math.PI / 4), ...turned(rectangle(1.2, 0.3), -Math.PI / 4)],
  star: [...ray, ...turned(ray, Math.PI / 2)],
  bar: rectangle(0.5, 1.1),
  ring: band(around(16, 1.16), around(16, 0.84)),
};
export type SignShape = keyof typeof shapes;

export class SignMesh {
  readonly mesh: THREE.Mesh<THREE.BufferGeometry, THREE.MeshBasicMaterial>;
  private count = 0; // vertices
  private place!: Float32Array;
  private corner!: Float32Array;
  private colour!: Uint8Array;

  constructor(opacity: number) {
    const material = new THREE.MeshBasicMaterial({ vertexColors: true, depthTest: false, transparent: true, opacity });
    material.customProgramCacheKey = () => "signs";
    material.onBeforeCompile = (shader) => {
      // signs face the viewer
      shader.vertexShader = shader.vertexShader
        .replace("#include <common>", "#include <common>\nattribute vec2 corner;")
        .replace("#include <project_vertex>", "vec4 mvPosition = modelViewMatrix * vec4(transformed, 1.0);\nmvPosition.xy += corner;\ngl_Position = projectionMatrix * mvPosition;");
    };
    this.mesh = new THREE.Mesh(new THREE.BufferGeometry(), material);
    this.mesh.frustumCulled = false;
    this.mesh.visible = false;
    this.allocate(256);
  }

  /// No more than is needed: a driver may copy the whole of a buffer for each change.
  private allocate(vertices: number): void {
    const { geometry } = this.mesh;
    geometry.dispose();
    const make = <T extends Float32Array | Uint8Array>(name: string, values: T, before: T | undefined, size: number): T => {
      if (before !== undefined) values.set(before);
      geometry.setAttribute(name, new THREE.BufferAttribute(values, size, values instanceof Uint8Array).setUsage(THREE.DynamicDrawUsage));
      return values;
    };
    this.place = make("position", new Float32Array(3 * vertices), this.place, 3);
    this.corner = make("corner", new Float32Array(2 * vertices), this.corner, 2);
    this.colour = make("color", new Uint8Array(3 * vertices), this.colour, 3);
  }

  clear(): void {
    this.count = 0;
  }
  ///   lies  on the ground instead of facing the viewer
  add(shape: SignShape, place: THREE.Vector3, size: number, colour: THREE.Color, lies = false): void {
    const corners = shapes[shape];
    if (3 * (this.count + corners.length) > this.place.length) this.allocate((2 * this.place.length) / 3);
    const { place: p, corner: c, colour: t } = this;
    for (const [x, y] of corners) {
      const i = this.count++;
      p[3 * i] = place.x + (lies ? size * x : 0);
      p[3 * i + 1] = place.y + (lies ? size * y : 0);
      p[3 * i + 2] = place.z;
      c[2 * i] = lies ? 0 : size * x;
      c[2 * i + 1] = lies ? 0 : size * y;
      t[3 * i] = 255 * colour.r;
      t[3 * i + 1] = 255 * colour.g;
      t[3 * i + 2] = 255 * colour.b;
    }
  }
  /// Shows what was added.
  commit(): void {
    const { geometry } = this.mesh;
    this.mesh.visible = this.count > 0;
    if (this.count === 0) return;
    for (const name of ["position", "corner", "color"]) geometry.getAttribute(name).needsUpdate = true;
    geometry.setDrawRange(0, this.count);
  }
}
