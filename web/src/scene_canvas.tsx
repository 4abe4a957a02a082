/// The canvas of a run's picture with the member under the pointer, and the choices of how it looks.
import type { ComponentChildren } from "preact";
import { useRef, useState } from "preact/hooks";
import type { Run } from "./data";
import { NoWebGl } from "./no_webgl";
import type { Scene } from "./scene";
import type { SceneView } from "./scene_view";
import type { Colouring, Look, ZoneMarks } from "./state";

const colourings: [Colouring, string][] = [
  ["kind", "kind of member"],
  ["material", "material"],
  ["state", "state of its zones"],
  ["utilisation", "utilisation"],
  ["speed", "speed"],
];

export function LookChoices(props: { look: Pick<Look, "colouring" | "zoneMarks">; damaged?: string }) {
  const { colouring, zoneMarks } = props.look;
  return (
    <>
      <label>
        Colour by{" "}
        <select data-test="colouring" value={colouring.value} onChange={(e) => (colouring.value = e.currentTarget.value as Colouring)}>
          {colourings.map(([value, word]) => (
            <option value={value}>{word}</option>
          ))}
        </select>
      </label>
      <label>
        Zones{" "}
        <select value={zoneMarks.value} onChange={(e) => (zoneMarks.value = e.currentTarget.value as ZoneMarks)}>
          <option value="damaged">{props.damaged ?? "damaged, new breaks"}</option>
          <option value="all">all</option>
          <option value="none">none</option>
        </select>
      </label>
    </>
  );
}

export interface SceneCanvasProps {
  view: SceneView<Scene>;
  label: string;
  /// Takes the keyboard.
  focusable?: boolean;
  run: Run | undefined;
  selected: { value: number };
  /// Whether the picture moves by itself: then no member is named under the pointer.
  isMoving: () => boolean;
  children?: ComponentChildren;
}

/// A click picks a member; a drag turns the view.
export function SceneCanvas(props: SceneCanvasProps) {
  const { frameRef, canvasRef, sceneRef, problem } = props.view;
  const [hover, setHover] = useState<{ x: number; y: number; name: string }>();
  const pressed = useRef<[number, number]>([0, 0]);
  const pickAt = (event: PointerEvent): number => sceneRef.current?.pick(event.offsetX, event.offsetY) ?? -1;
  const onPointerUp = (event: PointerEvent): void => {
    const [x, y] = pressed.current;
    if (event.button === 0 && Math.hypot(event.clientX - x, event.clientY - y) < 4) props.selected.value = pickAt(event);
  };
  const onPointerMove = (event: PointerEvent): void => {
    const name = event.buttons !== 0 || event.pointerType === "touch" || props.isMoving() ? undefined : props.run?.bodies[pickAt(event)]?.name;
    if (name !== undefined) setHover({ x: event.offsetX, y: event.offsetY, name });
    else if (hover !== undefined) setHover(undefined);
  };
  return (
    <div class="canvas-frame" ref={frameRef}>
      <canvas
        ref={canvasRef}
        data-test="canvas"
        {...(props.focusable === true ? { tabIndex: 0 } : {})}
        role="img"
        aria-label={props.label}
        hidden={problem !== ""}
        onPointerDown={(e) => {
          pressed.current = [e.clientX, e.clientY];
          setHover(undefined);
        }}
        onPointerUp={onPointerUp}
        onPointerMove={onPointerMove}
        onPointerLeave={() => setHover(undefined)}
      />
      {problem !== "" && <NoWebGl problem={problem} />}
      {props.children}
      {hover !== undefined && <span class="hover-name" data-name style={{ left: `${hover.x + 12}px`, top: `${hover.y + 12}px` }}>{hover.name}</span>}
    </div>
  );
}
