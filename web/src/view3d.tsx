import { effect } from "@preact/signals";
import { useMemo, useState } from "preact/hooks";
import { findBuildingLines } from "./data";
import { Scene, type View } from "./scene";
import { LookChoices, SceneCanvas } from "./scene_canvas";
import { useSceneView } from "./scene_view";
import { ZoneSign } from "./signs";
import type { State } from "./state";
import { colourOfKind, colourOfMaterial, highestSpeed, rampCss, wordOfKind, zoneStates } from "./vocabulary";
import { findMaterials, findParts } from "./zones";

const views: [View, string, string][] = [
  ["oblique", "Oblique", "From the front left"],
  ["side", "Side", "Along y"],
  ["front", "Front", "Along x"],
  ["top", "Top", "From above"],
];

export function Legend(props: { state: State; gridStep: number }) {
  const { state } = props;
  const { run } = state;
  const kinds = useMemo(() => findParts(run), [run]);
  const materials = useMemo(() => findMaterials(run), [run]);
  const colouring = state.colouring.value;
  const marks = state.zoneMarks.value;
  const { plans, hull } = useMemo(() => findBuildingLines(run), [run]);
  const buildings = run.neighbours.some((n) => !n.is_utility);
  const utilities = run.neighbours.some((n) => n.is_utility);
  return (
    <div class="legend" aria-label="Legend">
      <div class="legend-row">
        {colouring === "kind" &&
          kinds.map((kind) => (
            <span class="with-sign">
              <i class="swatch" style={{ background: colourOfKind(kind, kinds) }} /> {wordOfKind(kind)}
            </span>
          ))}
        {colouring === "material" &&
          materials.map((name) => (
            <span class="with-sign">
              <i class="swatch" style={{ background: colourOfMaterial(name, materials) }} /> {name || "not given"}
            </span>
          ))}
        {colouring === "speed" && (
          <span class="with-sign">
            speed 0 <i class="ramp" style={{ background: rampCss }} /> {highestSpeed} m/s and more
          </span>
        )}
        {colouring === "utilisation" && (
          <span class="with-sign">
            utilisation 0 <i class="ramp" style={{ background: rampCss }} /> 1 and more
          </span>
        )}
        {colouring === "state" && <span>Members in the colour of their worst zone</span>}
      </div>
      {(marks !== "none" || colouring === "state") && run.zones.length > 0 && (
        <div class="legend-row">
          <span class="quiet">Zones</span>
          {zoneStates.map((s, i) =>
            i === 0 && marks === "damaged" && colouring !== "state" ? null : (
              <span class="with-sign">
                <ZoneSign words={s} /> {s.word}
              </span>
            ),
          )}
        </div>
      )}
      <div class="legend-row quiet">
        <span>Grid {props.gridStep} m</span>
        {plans.length > 0 && (
          <span class="with-sign">
            <i class="line-swatch outline" /> outline before the first charge
          </span>
        )}
        {hull.length > 0 && (
          <span class="with-sign">
            <i class="line-swatch outline thin" /> convex outline, from which reaches count
          </span>
        )}
        {buildings && (
          <span class="with-sign">
            <i class="line-swatch neighbour" /> neighbour (height not given)
          </span>
        )}
        {utilities && (
          <span class="with-sign">
            <i class="line-swatch utility" /> utility
          </span>
        )}
      </div>
    </div>
  );
}

export function View3D(props: { state: State; onReady: (scene: Scene | undefined) => void; fitRef: { current: () => void } }) {
  const { state } = props;
  const [gridStep, setGridStep] = useState(0);
  const view = useSceneView(
    (canvas) => new Scene(canvas, state.run),
    (scene) => {
      setGridStep(scene.gridStep);
      props.fitRef.current = () => scene.fit();
      scene.fit("oblique");
      const stops = [
        effect(() => scene.setTime(state.time.value)),
        effect(() => scene.setLook(state.colouring.value, state.zoneMarks.value, state.selected.value)),
      ];
      props.onReady(scene);
      return () => stops.forEach((stop) => stop());
    },
    () => props.onReady(undefined),
  );

  const { sceneRef, problem } = view;
  const empty = state.run.time.length === 0 || state.run.bodies.length === 0;
  return (
    <section class="panel view" aria-label="Playback in three dimensions">
      <div class="toolbar">
        <LookChoices look={state} />
        <MemberSearch state={state} />
        <span class="spring" />
        <span class="button-group" role="group" aria-label="Point of view">
          {views.map(([side, word, title]) => (
            <button type="button" title={title} onClick={() => sceneRef.current?.fit(side)}>
              {word}
            </button>
          ))}
          <button type="button" title="Fit to the window (F)" onClick={() => sceneRef.current?.fit()}>
            Fit
          </button>
        </span>
      </div>
      <SceneCanvas view={view} label="The building at the time of the cursor" run={state.run} selected={state.selected} isMoving={() => state.playing.value}>
        {problem === "" && empty && <p class="canvas-note">The record holds no frames: there is nothing to play.</p>}
      </SceneCanvas>
      {problem === "" && <Legend state={state} gridStep={gridStep} />}
    </section>
  );
}

export function MemberSearch(props: { state: State }) {
  const { state } = props;
  const choose = (name: string): void => {
    const body = state.run.bodies.findIndex((b) => b.name === name);
    if (body >= 0) state.selected.value = body;
  };
  return (
    <label>
      Member{" "}
      <input
        class="member-search"
        data-test="member-search"
        list="member-names"
        placeholder="name"
        size={12}
        value={state.run.bodies[state.selected.value]?.name ?? ""}
        onInput={(e) => choose(e.currentTarget.value)}
      />
      <datalist id="member-names">
        {state.run.bodies.map((b) => (
          <option value={b.name} />
        ))}
      </datalist>
    </label>
  );
}
