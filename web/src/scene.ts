/// The picture of one run: stage, site and building.
import * as THREE from "three";
import { Building } from "./building";
import type { Run } from "./data";
import type { SceneLike } from "./scene_view";
import { Site, darkTheme, lightTheme } from "./site";
import { Stage, disposeOf, fov, type StageOptions, type View } from "./stage";
import type { Colouring, ZoneMarks } from "./state";
import type { Triple } from "./data";

export type { View } from "./stage";

/// Of a run shown over another one.
export const ghostColour = "#d55e00";

export class Scene implements SceneLike {
  readonly stage: Stage;
  building!: Building;
  site!: Site;
  private colouring: Colouring = "kind";
  private zoneMarks: ZoneMarks = "damaged";
  private selected = -1;
  private time = 0;

  /// Throws if the browser offers no WebGL.
  constructor(canvas: HTMLCanvasElement, run: Run, options: StageOptions = { antialias: true, adaptive: false }) {
    this.stage = new Stage(canvas, options);
    this.stage.onTheme = (theme, dark) => {
      this.site.setTheme(theme);
      this.building.setTheme(theme, dark);
    };
    this.stage.onView = () => this.site.setViewport(this.stage.height, fov);
    this.setRun(run);
    this.setDark(false);
    this.fit("oblique");
  }

  /// Puts another run in place of the one shown. The point of view stays.
  setRun(run: Run): void {
    if (this.building?.useRun(run) === true) {
      this.setLook(this.colouring, this.zoneMarks, this.selected);
      return;
    }
    for (const old of [this.building?.group, this.site?.group])
      if (old !== undefined) {
        this.stage.scene.remove(old);
        disposeOf(old);
      }
    this.building = new Building(run);
    const area = this.building.bounds.clone();
    for (const n of run.neighbours) for (const [x, y] of n.footprint) if (Number.isFinite(x + y)) area.expandByPoint(new THREE.Vector3(x, y, 0));
    this.site = new Site(run, area, this.building.bounds, this.building.height);
    this.stage.scene.add(this.building.group, this.site.group);
    this.stage.setFitPoints(this.building.fitPoints);
    this.site.setViewport(this.stage.height, fov);
    this.setDark(this.stage.dark);
    this.setLook(this.colouring, this.zoneMarks, this.selected);
  }

  private companion: Building | undefined;
  /// A second run beside the first one, or over it as a ghost; undefined ends that.
  setCompanion(run: Run | undefined, beside: boolean): void {
    if (this.companion !== undefined) {
      this.stage.setPair(undefined);
      this.stage.scene.remove(this.companion.group);
      disposeOf(this.companion.group);
      this.companion = undefined;
    }
    if (run !== undefined) {
      this.companion = new Building(run);
      this.companion.setTheme(this.stage.dark ? darkTheme : lightTheme, this.stage.dark);
      this.stage.scene.add(this.companion.group);
      if (beside) {
        this.stage.setPair([this.building.group, this.companion.group]);
        this.fit();
      }
      else this.companion.setGhost(ghostColour);
      this.companion.setLook(this.colouring, beside ? this.zoneMarks : "none", -1);
      this.companion.setTime(this.time);
    }
    this.onChange();
  }

  get gridStep(): number {
    return this.site.gridStep;
  }
  get onChange(): () => void {
    return this.stage.onChange;
  }
  set onChange(change: () => void) {
    this.stage.onChange = change;
  }

  setDark(dark: boolean): void {
    this.stage.setDark(dark);
  }
  resize(width: number, height: number): void {
    if (this.stage.isFitted) this.site.resetAxes();
    this.stage.resize(width, height);
  }
  /// Looks at all of what is there now: a run may have grown.
  fit(view?: View | Triple): void {
    this.building.collectFitPoints();
    this.stage.setFitPoints(this.building.fitPoints);
    this.site.resetAxes();
    this.stage.fit(view);
  }

  setTime(t: number): void {
    this.time = t;
    this.building.setTime(t);
    this.companion?.setTime(t);
    this.onChange();
  }

  setLook(colouring: Colouring, zoneMarks: ZoneMarks, selected: number): void {
    this.colouring = colouring;
    this.zoneMarks = zoneMarks;
    this.selected = selected;
    this.building.setLook(colouring, zoneMarks, selected);
    this.onChange();
  }

  /// Body under a place of the canvas, -1 if there is none.
  pick(x: number, y: number): number {
    return this.building.pick(this.stage.castRay(x, y));
  }

  render(): void {
    this.site.placeLabels(this.stage.camera, this.stage.shownWidth, this.stage.middle);
    this.stage.render();
  }

  dispose(): void {
    this.stage.dispose();
  }

  /// Pictures of the run at given times, on a light ground so that they print well.
  makeStills(times: readonly number[], width: number, height: number): string[] {
    const { time, selected, colouring, zoneMarks, stage } = this;
    const { dark, renderer, camera, controls, isFitted } = stage;
    const changed = this.onChange;
    const ratio = renderer.getPixelRatio();
    const eye = camera.position.clone();
    const target = controls.target.clone();
    this.onChange = () => undefined;
    this.setLook("kind", "none", -1);
    this.site.showLabels(false); // too large for small pictures
    this.setDark(false);
    renderer.setPixelRatio(1);
    renderer.setSize(width, height, false);
    stage.useAspect(width, height);
    this.fit("oblique");
    const canvas = document.createElement("canvas");
    canvas.width = width;
    canvas.height = height;
    const pictures = times.map((t) => {
      this.setTime(t);
      stage.draw();
      // In the same task as the drawing, while the picture is still there.
      canvas.getContext("2d")?.drawImage(renderer.domElement, 0, 0);
      return canvas.toDataURL("image/png");
    });
    camera.position.copy(eye);
    controls.target.copy(target);
    this.site.showLabels(true);
    renderer.setPixelRatio(ratio);
    this.setDark(dark);
    stage.isFitted = isFitted;
    this.resize(stage.width, stage.height);
    controls.update();
    this.setLook(colouring, zoneMarks, selected);
    this.setTime(time);
    this.onChange = changed;
    this.onChange();
    return pictures;
  }
}
