/// Camera, light and canvas: what every picture needs whatever stands in it. Draws only when asked to.
import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { screenSpace } from "./colour";
import type { Triple } from "./data";
import { lastGap } from "./schedule";
import type { SceneLike } from "./scene_view";
import { darkTheme, lightTheme, type Theme } from "./site";

export type View = "oblique" | "front" | "side" | "top";
const viewDirections: Record<View, Triple> = {
  oblique: [-0.62, -1, 0.5],
  side: [0, -1, 0.06],
  front: [-1, 0, 0.06],
  top: [0, -1e-3, 1],
};
export const fov = 32;

/// A point of the canvas's height h is this large at the distance 1.
export const calcPixel = (h: number): number => (2 * Math.tan((fov * Math.PI) / 360)) / Math.max(1, h);

export interface StageOptions {
  antialias: boolean;
  /// Fewer pixels while pictures follow each other so slowly that motion stutters, all of them when it rests.
  adaptive: boolean;
}

const wanted = 1000 / 60; // between two pictures in motion [ms]
const slow = 1.15 * wanted, quick = 1.04 * wanted; // fewer pixels above the one, more below the other
const leastRatio = 0.5; // fewer pixels than that and members cannot be told apart
const restAfter = 220; // and at least three pictures [ms]
const settled = 6; // pictures after a change until their rate is known
const firstWait = 1500, longestWait = 48000; // until more pixels are tried again [ms]

export class Stage implements SceneLike {
  onChange: () => void = () => undefined;
  /// Told of a new size, theme or point of view.
  onTheme: (theme: Theme, dark: boolean) => void = () => undefined;
  onView: () => void = () => undefined;
  /// Told the share of the screen's pixels along an edge that the picture in motion has.
  onSharpness: (share: number) => void = () => undefined;
  readonly renderer: THREE.WebGLRenderer;
  readonly scene = new THREE.Scene();
  readonly camera = new THREE.PerspectiveCamera(fov, 1, 0.1, 1000);
  readonly controls: OrbitControls;
  width = 1;
  height = 1;
  dark = false;
  private readonly fullRatio: number;
  private ratio: number;
  private lastRender = -Infinity;
  private meanInterval = wanted;
  private restTimer: ReturnType<typeof setTimeout> | undefined;
  /// What a fitted picture must show.
  private fitPoints: readonly THREE.Vector3[] = [];
  private readonly bounds = new THREE.Box3();
  private readonly centre = new THREE.Vector3();

  /// Throws if the browser offers no WebGL.
  constructor(canvas: HTMLCanvasElement, private readonly options: StageOptions) {
    // without alpha the page need not be mixed in below the picture
    const context = canvas.getContext("webgl2", { alpha: false, antialias: options.antialias, powerPreference: "high-performance" });
    if (context === null) throw new Error("This browser offers no WebGL 2.");
    this.renderer = new THREE.WebGLRenderer({ canvas, context });
    this.renderer.outputColorSpace = screenSpace;
    this.fullRatio = Math.min(devicePixelRatio, 2);
    this.ratio = this.fullRatio;
    this.renderer.setPixelRatio(this.ratio);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.maxPolarAngle = Math.PI * 0.55;
    this.controls.addEventListener("start", () => (this.isFitted = false));
    this.controls.addEventListener("change", () => {
      this.onView();
      this.onChange();
    });
  }

  setDark(dark: boolean): void {
    this.dark = dark;
    const theme = dark ? darkTheme : lightTheme;
    this.scene.background = new THREE.Color(theme.background);
    this.onTheme(theme, dark);
    this.onChange();
  }

  resize(width: number, height: number): void {
    this.width = Math.max(1, width);
    this.height = Math.max(1, height);
    this.renderer.setSize(this.width, this.height, false);
    this.useAspect(this.width, this.height);
    if (this.isFitted) this.fit();
    this.onChange();
  }

  useAspect(width: number, height: number): void {
    this.camera.aspect = this.shareOf(width) / height;
    this.camera.updateProjectionMatrix();
    this.onView();
  }

  /// Of one picture: two beside each other have half the canvas each.
  private readonly shareOf = (width: number): number => (this.pair === undefined ? width : width / 2);
  get shownWidth(): number {
    return this.shareOf(this.width);
  }

  setFitPoints(points: readonly THREE.Vector3[]): void {
    this.fitPoints = points;
    this.bounds.setFromPoints(points as THREE.Vector3[]);
    this.bounds.getCenter(this.centre);
  }
  get middle(): THREE.Vector3 {
    return this.centre;
  }

  /// Whether the picture is as it was fitted: then a new size fits it anew. Who has moved the camera keeps it.
  isFitted = false;
  /// Looks at all of the fit points from one side, as near as the picture allows.
  fit(view?: View | Triple): void {
    const from =
      view === undefined
        ? this.camera.position.clone().sub(this.controls.target)
        : new THREE.Vector3(...(typeof view === "string" ? viewDirections[view] : view));
    if (this.fitPoints.length === 0) return;
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
    const depth = this.centre.dot(from);
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
    this.isFitted = true;
    this.onView();
    this.onChange();
  }

  private held = false;
  /// The same number of pixels until the returned function is called: a video cannot change its size.
  holdRatio(ratio: number): () => void {
    clearTimeout(this.restTimer);
    this.held = true;
    this.setRatio(ratio);
    this.onChange();
    return () => {
      this.held = false;
      this.setRatio(this.fullRatio);
      this.onChange();
    };
  }

  private readonly ray = new THREE.Raycaster();
  /// The ray through a place of the canvas.
  castRay(x: number, y: number): THREE.Raycaster {
    this.camera.updateMatrixWorld();
    const width = this.pair === undefined ? this.width : this.width / 2;
    this.ray.setFromCamera(new THREE.Vector2((2 * (x % width)) / width - 1, 1 - (2 * y) / this.height), this.camera);
    return this.ray;
  }

  private pair: [THREE.Object3D, THREE.Object3D] | undefined;
  /// Two pictures beside each other from one point of view, each without the other's object. Undefined: one picture.
  setPair(pair: [THREE.Object3D, THREE.Object3D] | undefined): void {
    this.pair = pair;
    this.useAspect(this.width, this.height);
    this.onChange();
  }

  render(): void {
    if (this.options.adaptive && !this.held) this.adapt();
    this.draw();
  }

  draw(): void {
    this.camera.updateMatrixWorld();
    if (this.pair === undefined) {
      this.renderer.render(this.scene, this.camera);
      return;
    }
    const half = Math.floor(this.width / 2);
    this.renderer.setScissorTest(true);
    this.pair.forEach((shown, i) => {
      for (const object of this.pair ?? []) object.visible = object === shown;
      const x = i === 0 ? 0 : half + 1;
      this.renderer.setViewport(x, 0, half - 1, this.height);
      this.renderer.setScissor(x, 0, half - 1, this.height);
      this.renderer.render(this.scene, this.camera);
    });
    for (const object of this.pair) object.visible = true;
    this.renderer.setScissorTest(false);
    this.renderer.setViewport(0, 0, this.width, this.height);
  }

  private adapt(): void {
    const now = performance.now();
    const interval = now - this.lastRender;
    this.lastRender = now;
    // A picture that comes a second later begins another motion.
    if (interval < 1000) this.meanInterval += 0.2 * (lastGap() - this.meanInterval);
    ++this.since;
    if (this.meanInterval > slow && this.ratio > leastRatio && this.since >= settled) {
      // More pixels were too many: the next try comes later.
      if (now - this.triedAt < 1000) this.wait = Math.min(longestWait, 2 * this.wait);
      this.nextTry = now + this.wait;
      this.useRatio(Math.max(leastRatio, this.ratio * Math.max(0.6, Math.sqrt(wanted / this.meanInterval))));
    } else if (this.meanInterval < quick && this.ratio < this.fullRatio && now > this.nextTry && this.since >= 2 * settled) {
      this.triedAt = now;
      this.useRatio(Math.min(this.fullRatio, 1.2 * this.ratio));
    }
    clearTimeout(this.restTimer);
    if (this.ratio < this.fullRatio)
      this.restTimer = setTimeout(() => {
        // At rest: the whole picture once, and the ratio of motion again for the next one.
        const ratio = this.ratio;
        this.setRatio(this.fullRatio);
        this.draw();
        this.ratio = ratio;
        this.atRest = true;
        this.onSharpness(1);
      }, Math.max(restAfter, 3 * this.meanInterval));
    if (this.atRest) {
      this.atRest = false;
      this.setRatio(this.ratio);
    }
    this.onSharpness(this.ratio / this.fullRatio);
  }
  private useRatio(ratio: number): void {
    this.since = 0;
    this.setRatio(ratio);
  }
  private since = 0; // pictures since the ratio changed
  private triedAt = -Infinity; // when more pixels were tried
  private nextTry = 0;
  private wait = firstWait;
  private atRest = false;

  private setRatio(ratio: number): void {
    this.ratio = ratio;
    this.renderer.setPixelRatio(ratio);
    // three sets the size of the canvas from the ratio of the size it knows
  }

  /// The canvas with all its pixels, however fast the last pictures came. For a picture to keep.
  drawFull(): HTMLCanvasElement {
    const ratio = this.ratio;
    this.setRatio(this.fullRatio);
    this.draw();
    this.ratio = ratio;
    this.atRest = ratio !== this.fullRatio;
    return this.renderer.domElement;
  }

  dispose(): void {
    clearTimeout(this.restTimer);
    this.controls.dispose();
    disposeOf(this.scene);
    this.renderer.dispose();
    this.renderer.forceContextLoss(); // a browser keeps few of them
  }
}

/// Frees what the graphics card holds of everything below `root`.
export function disposeOf(root: THREE.Object3D): void {
  root.traverse((object) => {
    const { geometry, material } = object as Partial<THREE.Mesh>;
    geometry?.dispose();
    for (const one of Array.isArray(material) ? material : [material]) {
      (one as THREE.SpriteMaterial | undefined)?.map?.dispose();
      one?.dispose();
    }
  });
}
