/// A canvas with a scene in it: made once, drawn only on change, following size and theme, disposed of at the end.
import { useEffect, useRef, useState } from "preact/hooks";
import { drawNext } from "./schedule";

export interface SceneLike {
  /// Called by the scene when a picture is due.
  onChange: () => void;
  setDark(dark: boolean): void;
  resize(width: number, height: number): void;
  render(): void;
  dispose(): void;
}

export const darkQuery = (): MediaQueryList => matchMedia("(prefers-color-scheme: dark)");

export interface SceneView<S extends SceneLike> {
  /// For the element whose size the canvas takes.
  frameRef: { current: HTMLDivElement | null };
  canvasRef: { current: HTMLCanvasElement | null };
  /// Undefined before the first layout and where the browser offers no WebGL.
  sceneRef: { current: S | undefined };
  /// Why there is no picture; empty if there is one.
  problem: string;
}

/// Draws the scene when it asks for it, at most once a frame of the screen, and follows the size of `frame` and the
/// theme. Returns what ends all that.
export function attachScene(scene: SceneLike, frame: HTMLElement): () => void {
  const render = (): void => scene.render();
  let takeBack = (): void => undefined;
  scene.onChange = () => {
    takeBack = drawNext(render);
  };
  const dark = darkQuery();
  const useTheme = (): void => scene.setDark(dark.matches);
  dark.addEventListener("change", useTheme);
  useTheme();
  const resize = (): void => scene.resize(frame.clientWidth, frame.clientHeight);
  resize();
  const observer = new ResizeObserver(resize);
  observer.observe(frame);
  return () => {
    observer.disconnect();
    dark.removeEventListener("change", useTheme);
    scene.onChange = () => undefined;
    takeBack();
    scene.dispose();
  };
}

/// `make` makes the scene (it throws where there is no WebGL), `use` connects it to signals and may return what ends
/// that; `fail` hears that there is no picture. All are called once.
export function useSceneView<S extends SceneLike>(
  make: (canvas: HTMLCanvasElement) => S,
  use: (scene: S) => (() => void) | void,
  fail: () => void = () => undefined,
): SceneView<S> {
  const frameRef = useRef<HTMLDivElement>(null);
  const canvasRef = useRef<HTMLCanvasElement>(null);
  const sceneRef = useRef<S | undefined>(undefined);
  const [problem, setProblem] = useState("");
  useEffect(() => {
    const canvas = canvasRef.current;
    const frame = frameRef.current;
    if (canvas === null || frame === null) return;
    let scene: S;
    try {
      scene = make(canvas);
    } catch (error) {
      setProblem(error instanceof Error ? error.message : String(error));
      fail();
      return;
    }
    sceneRef.current = scene;
    const detach = attachScene(scene, frame);
    const end = use(scene);
    return () => {
      end?.();
      detach();
      sceneRef.current = undefined;
    };
  }, []);
  return { frameRef, canvasRef, sceneRef, problem };
}
