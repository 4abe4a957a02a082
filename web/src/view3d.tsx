import { effect } from "@preact/signals";
import { useMemo, useRef, useState } from "preact/hooks";
import { NoWebGl } from "./no_webgl";
import { Scene, type View } from "./scene";
import { useSceneView } from "./scene_view";
import { ZoneSign } from "./signs";
import type { Colouring, State, ZoneMarks } from "./state";
import { colourOfKind, colourOfMaterial, highestSpeed, rampCss, wordOfKind, zoneStates } from "./vocabulary";
import { findMaterials, findParts } from "./zones";

const views: [View, string, string][] = [
  ["oblique", "Oblique", "From the front left"],
  ["side", "Side", "Along y"],
  ["front", "Front", "Along x"],
  ["top", "Top", "From above"],
];

export const colourings: [Colouring, string][] = [
  ["kind", "kind of member"],
  ["material", "material"],
  ["state", "state of its zones"],
  ["utilisation", "utilisation"],
  ["speed", "speed"],
];

export function Legend(props: { state: State; gridStep: number }) {
  const { state } = props;
  const { run } = state;
  const kinds = useMemo(() => findParts(run), [run]);
  const materials = useMemo(() => findMaterials(run), [run]);
  const colouring = state.colouring.value;
  const marks = state.zoneMarks.value;
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
        {run.building_outline.length > 1 && (
          <span class="with-sign">
            <i class="line-swatch outline" /> outline before the first charge
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
  const [hover, setHover] = useState<{ x: number; y: number; name: string }>();
  const { frameRef, canvasRef, sceneRef, problem } = useSceneView(
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

  // A click picks; a drag turns the view.
  const pressed = useRef<[number, number]>([0, 0]);
  const pickAt = (event: PointerEvent): number => sceneRef.current?.pick(event.offsetX, event.offsetY) ?? -1;
  const onPointerUp = (event: PointerEvent): void => {
    const [x, y] = pressed.current;
    if (event.button === 0 && Math.hypot(event.clientX - x, event.clientY - y) < 4) state.selected.value = pickAt(event);
  };
  const onPointerMove = (event: PointerEvent): void => {
    if (event.buttons !== 0 || event.pointerType === "touch" || state.playing.value) {
      if (hover !== undefined) setHover(undefined);
      return;
    }
    const name = state.run.bodies[pickAt(event)]?.name;
    if (name !== undefined) setHover({ x: event.offsetX, y: event.offsetY, name });
    else if (hover !== undefined) setHover(undefined);
  };

  const empty = state.run.time.length === 0 || state.run.bodies.length === 0;
  return (
    <section class="panel view" aria-label="Playback in three dimensions">
      <div class="toolbar">
        <label>
          Colour by{" "}
          <select
            data-test="colouring"
            value={state.colouring.value}
            onChange={(e) => (state.colouring.value = e.currentTarget.value as Colouring)}
          >
            {colourings.map(([value, word]) => (
              <option value={value}>{word}</option>
            ))}
          </select>
        </label>
        <label>
          Zones{" "}
          <select value={state.zoneMarks.value} onChange={(e) => (state.zoneMarks.value = e.currentTarget.value as ZoneMarks)}>
            <option value="damaged">damaged, new breaks</option>
            <option value="all">all</option>
            <option value="none">none</option>
          </select>
        </label>
        <MemberSearch state={state} />
        <span class="spring" />
        <span class="button-group" role="group" aria-label="Point of view">
          {views.map(([view, word, title]) => (
            <button type="button" title={title} onClick={() => sceneRef.current?.fit(view)}>
              {word}
            </button>
          ))}
          <button type="button" title="Fit to the window (F)" onClick={() => sceneRef.current?.fit()}>
            Fit
          </button>
        </span>
      </div>
      <div class="canvas-frame" ref={frameRef}>
        <canvas
          ref={canvasRef}
          data-test="canvas"
          role="img"
          aria-label="The building at the time of the cursor"
          hidden={problem !== ""}
          onPointerDown={(e) => {
            pressed.current = [e.clientX, e.clientY];
            setHover(undefined);
          }}
          onPointerUp={onPointerUp}
          onPointerMove={onPointerMove}
          onPointerLeave={() => setHover(undefined)}
        />
        {problem !== "" && (
          <NoWebGl problem={problem} />
        )}
        {problem === "" && empty && <p class="canvas-note">The record holds no frames: there is nothing to play.</p>}
        {hover !== undefined && (
          <span class="hover-name" style={{ left: `${hover.x + 12}px`, top: `${hover.y + 12}px` }}>{hover.name}</span>
        )}
      </div>
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
