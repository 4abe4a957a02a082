/// The picture of the active branch, with view cube, section, storeys, and another branch beside or over it.
import { effect, signal } from "@preact/signals";
import { useRef, useState } from "preact/hooks";
import * as THREE from "three";
import type { Triple } from "./data";
import { Scene, ghostColour, type View } from "./scene";
import { LookChoices, SceneCanvas } from "./scene_canvas";
import { useSceneView } from "./scene_view";
import { DebrisLayer, EventLayer, contourColours, contourLevels } from "./steer_layers";
import type { SteerState } from "./steer_state";
import type { BranchRun } from "./steer_branch";
import { Legend, MemberSearch } from "./view3d";

export type CompareView = "off" | "beside" | "over";
export const compareView = signal<CompareView>("off");
/// What other parts of the page ask of the picture.
export const picture: { fit: () => void; scene: Scene | undefined } = { fit: () => undefined, scene: undefined };

/// Faces of the view cube: word, what looks at it, and how it is turned.
const faces: [string, View | Triple, string][] = [
  ["Front", "front", "rotateY(-90deg)"],
  ["Back", [1, 0, 0.06], "rotateY(90deg)"],
  ["Right", "side", "rotateY(0deg)"],
  ["Left", [0, 1, 0.06], "rotateY(180deg)"],
  ["Top", "top", "rotateX(90deg)"],
];

function ViewCube(props: { cubeRef: { current: HTMLDivElement | null }; onFace: (view: View | Triple) => void }) {
  return (
    <div class="cube-holder" role="group" aria-label="View cube">
      <div class="cube" ref={props.cubeRef}>
        {faces.map(([word, view, turn]) => (
          <button type="button" class="cube-face" style={{ transform: `${turn} translateZ(26px)` }} onClick={() => props.onFace(view)} title={`Look at: ${word.toLowerCase()}`}>
            {word}
          </button>
        ))}
      </div>
    </div>
  );
}

/// CSS turns of the cube so that it stands as the world does in the picture.
function turnCube(cube: HTMLElement, camera: THREE.Camera): void {
  // CSS: x right, y down, z to the viewer; the cube's own axes are x = world x, y = -world z, z = -world y
  const m = camera.matrixWorldInverse.elements;
  const column = (k: number): [number, number, number] => [m[4 * k] as number, -(m[4 * k + 1] as number), m[4 * k + 2] as number];
  const x = column(0), y = column(2).map((v) => -v), z = column(1).map((v) => -v);
  cube.style.transform = `matrix3d(${[...x, 0, ...y, 0, ...z, 0, 0, 0, 0, 1].map((v) => v.toFixed(5)).join(",")})`;
}

function SectionPanel(props: { s: SteerState }) {
  const { s } = props;
  const now = s.section.value;
  if (!now.on) return null;
  const set = (which: "low" | "high", axis: number, value: number): void => {
    const next = { ...now, low: [...now.low] as Triple, high: [...now.high] as Triple };
    next[which][axis] = value;
    if ((next.low[axis] as number) > (next.high[axis] as number)) next[which === "low" ? "high" : "low"][axis] = value;
    s.section.value = next;
  };
  return (
    <div class="section-panel" role="group" aria-label="Section box">
      {["x", "y", "z"].map((name, axis) => (
        <div class="section-row">
          <span>{name}</span>
          {(["low", "high"] as const).map((which) => (
            <input
              type="range" min="0" max="1" step="0.01" value={now[which][axis]} aria-label={`${name}, ${which === "low" ? "from" : "to"}`}
              onInput={(e) => set(which, axis, e.currentTarget.valueAsNumber)}
            />
          ))}
        </div>
      ))}
      <button type="button" onClick={() => (s.section.value = { on: true, low: [0, 0, 0], high: [1, 1, 1] })}>Whole</button>
    </div>
  );
}

export function SteerView(props: { s: SteerState; onReady: () => void }) {
  const { s } = props;
  const [gridStep, setGridStep] = useState(0);
  const [sharpness, setSharpness] = useState(1);
  const cubeRef = useRef<HTMLDivElement>(null);
  const sceneView = useSceneView(
    (canvas) => new Scene(canvas, (s.view.peek() as BranchRun).run, { antialias: false, adaptive: true }),
    (scene) => {
      picture.scene = scene;
      picture.fit = () => scene.fit();
      const debris = new DebrisLayer();
      const happenings = new EventLayer();
      scene.stage.scene.add(debris.group, happenings.group);
      const followCube = scene.stage.onView;
      scene.stage.onView = () => {
        followCube();
        scene.stage.camera.updateMatrixWorld();
        if (cubeRef.current !== null) turnCube(cubeRef.current, scene.stage.camera);
      };
      scene.stage.onSharpness = (share) => setSharpness(Math.round(10 * share) / 10);
      let shown = s.view.peek() as BranchRun;
      let session = s.session.peek()?.id;
      let debrisDue: ReturnType<typeof setTimeout> | undefined;
      let debrisCost = 0; // [ms]; at most a tenth of the time goes into it
      const drawDebris = (): void => {
        debrisDue = undefined;
        const begin = performance.now();
        debris.update(scene.building);
        debrisCost = performance.now() - begin;
        scene.onChange();
      };
      setGridStep(scene.gridStep);
      scene.fit("oblique");
      const stops = [
        effect(() => {
          const view = s.view.value;
          if (view === null || view === shown) return;
          shown = view;
          scene.setRun(view.run);
          const now = s.session.peek()?.id;
          if (now !== session) scene.fit("oblique"); // another building, maybe elsewhere and of another size
          session = now;
          setGridStep(scene.gridStep);
        }),
        effect(() => {
          const view = s.view.value;
          if (view === null) return;
          void view.state.grown.value;
          const time = view.state.time.value;
          scene.setTime(time);
          happenings.update(view.run, scene.building, time, (s.branch.value?.charges ?? []).filter((c) => !c.removed && !c.fails && c.time > time));
          debris.group.visible = s.showDebris.value;
          if (s.showDebris.value) debrisDue ??= setTimeout(drawDebris, Math.max(300, 10 * debrisCost));
        }),
        effect(() => scene.setLook(s.colouring.value, s.zoneMarks.value, s.selected.value)),
        effect(() => {
          const hidden = s.hiddenStoreys.value;
          const run = s.view.value?.run;
          if (run === undefined) return;
          scene.building.setFilter((b) => !hidden.has(run.bodies[b]?.storey ?? 0));
          scene.onChange();
        }),
        effect(() => {
          const { on, low, high } = s.section.value;
          void s.view.value;
          const box = scene.building.bounds;
          const size = box.getSize(new THREE.Vector3()).toArray(), least = box.min.toArray();
          const planes: THREE.Plane[] = [];
          for (let k = 0; on && k < 3; ++k) {
            const normal = new THREE.Vector3().setComponent(k, 1);
            const from = (least[k] as number) + low[k as 0] * (size[k] as number), to = (least[k] as number) + high[k as 0] * (size[k] as number);
            if (low[k as 0] > 0) planes.push(new THREE.Plane(normal.clone(), -from));
            if (high[k as 0] < 1) planes.push(new THREE.Plane(normal.clone().negate(), to));
          }
          scene.stage.renderer.localClippingEnabled = planes.length > 0;
          scene.building.setSection(planes);
          scene.onChange();
        }),
        effect(() => {
          const c = s.comparison.value;
          const view = s.view.value;
          const mode = compareView.value;
          const other = c === null || mode === "off" || view === null ? undefined : s.runs.get(view.id === c.a ? c.b : c.a);
          scene.setCompanion(other?.run, mode === "beside");
        }),
      ];
      props.onReady();
      return () => {
        clearTimeout(debrisDue);
        stops.forEach((stop) => stop());
        picture.scene = undefined;
      };
    },
    props.onReady,
  );

  const { sceneRef, problem } = sceneView;
  const view = s.view.value;
  const mode = compareView.value;
  const c = s.comparison.value;
  const nameOf = (id: number): string => s.branches.value.find((b) => b.id === id)?.name ?? "";

  return (
    <section class="view" aria-label="The building">
      <div class="toolbar">
        <LookChoices look={s} damaged="damaged" />
        {view !== null && <MemberSearch state={view.state} />}
        <span class="spring" />
        <label class="check" title="Outline and heights of what has fallen">
          <input type="checkbox" checked={s.showDebris.value} onChange={(e) => (s.showDebris.value = e.currentTarget.checked)} /> Heights
        </label>
        <button type="button" aria-pressed={s.section.value.on} title="Section box (S)" data-test="section" onClick={() => (s.section.value = { ...s.section.value, on: !s.section.value.on })}>
          Section
        </button>
        <button type="button" title="Fit to the window (F)" onClick={() => picture.fit()}>Fit</button>
      </div>
      <SceneCanvas
        view={sceneView}
        label="The building at the time of the view. Arrow keys step in time; the view cube turns it."
        focusable
        run={view?.run}
        selected={s.selected}
        isMoving={() => s.phase.value === "running" && s.following.value}
      >
        {problem === "" && <ViewCube cubeRef={cubeRef} onFace={(face) => sceneRef.current?.fit(face)} />}
        <SectionPanel s={s} />
        {c !== null && mode === "beside" && view !== null && (
          <>
            <span class="half-name left">{nameOf(view.id)}</span>
            <span class="half-name right">{nameOf(view.id === c.a ? c.b : c.a)}</span>
          </>
        )}
        {c !== null && mode === "over" && view !== null && (
          <span class="half-name left">
            {nameOf(view.id)}, over it <i class="swatch" style={{ background: ghostColour }} /> {nameOf(view.id === c.a ? c.b : c.a)}
          </span>
        )}
        {sharpness < 1 && <span class="sharpness" data-test="sharpness" title="So that pictures follow each other faster; at rest the picture has all its pixels">{Math.round(100 * sharpness)} % of the sharpness while it moves</span>}
      </SceneCanvas>
      {problem === "" && view !== null && (
        <div class="legend-line">
          <Legend state={view.state} gridStep={gridStep} />
          {s.showDebris.value && (
            <div class="legend-row quiet contour-legend">
              <span>Heights</span>
              {contourLevels.map((level, k) => (
                <span class="with-sign"><i class="line-swatch" style={{ background: contourColours[k] }} /> {k === 0 ? "outline (0.2 m)" : `${level} m`}</span>
              ))}
            </div>
          )}
        </div>
      )}
    </section>
  );
}
