import { useLayoutEffect, useRef } from "preact/hooks";
import type { State } from "./state";

const keys: [string, string][] = [
  ["Space", "play, pause"],
  ["← →", "frame before, next frame"],
  ["Shift + ← →", "event before, next event"],
  ["Home, End", "to the beginning, to the end"],
  ["F", "fit the picture to the window"],
  ["Esc", "close this list or the member"],
  ["?", "this list"],
];

/// `find` gives what a key does, undefined if nothing.
export function listen(find: (event: KeyboardEvent) => (() => void) | undefined): void {
  addEventListener("keydown", (event) => {
    if (event.altKey || event.metaKey) return;
    const target = event.target instanceof HTMLElement ? event.target : document.body;
    const isSlider = target instanceof HTMLInputElement && target.type === "range";
    if (!isSlider && event.key !== "Escape" && target.matches("input, select, textarea")) return;
    // What the keyboard has reached keeps its own keys.
    if (event.key === " " && target.matches("button:focus-visible, summary, .scroller")) return;
    if (target.matches(".scroller, pre") && ["Home", "End", "ArrowLeft", "ArrowRight"].includes(event.key)) return;
    const action = find(event);
    if (action === undefined) return;
    event.preventDefault();
    action();
  });
}

export function listenToKeys(state: State, fit: () => void): void {
  const actions: Record<string, (event: KeyboardEvent) => void> = {
    " ": () => state.togglePlay(),
    ArrowLeft: (event) => (event.shiftKey ? state.stepEvent(-1) : state.stepFrame(-1)),
    ArrowRight: (event) => (event.shiftKey ? state.stepEvent(1) : state.stepFrame(1)),
    Home: () => state.pauseAt(state.begin),
    End: () => state.pauseAt(state.end.value),
    f: fit,
    F: fit,
    "?": () => (state.helpOpen.value = !state.helpOpen.value),
    Escape: () => {
      if (state.helpOpen.value) state.helpOpen.value = false;
      else state.selected.value = -1;
    },
  };
  listen((event) => {
    const action = event.ctrlKey ? undefined : actions[event.key];
    return action === undefined ? undefined : () => action(event);
  });
}

export function Help(props: { state: Pick<State, "helpOpen">; keys?: [string, string][]; text?: string }) {
  const { state } = props;
  const dialog = useRef<HTMLDialogElement>(null);
  const open = state.helpOpen.value;
  useLayoutEffect(() => {
    const element = dialog.current;
    if (element === null || element.open === open) return;
    if (open) element.showModal();
    else element.close();
  }, [open]);
  return (
    <dialog ref={dialog} class="help" aria-label="Keys" onClose={() => (state.helpOpen.value = false)}>
      <h2>Keys</h2>
      <table class="pairs">
        <tbody>
          {(props.keys ?? keys).map(([key, meaning]) => (
            <tr>
              <th scope="row"><kbd>{key}</kbd></th>
              <td>{meaning}</td>
            </tr>
          ))}
        </tbody>
      </table>
      {props.text !== undefined && <p>{props.text}</p>}
      <p>Mouse: drag turns, right drag (or Shift + drag) moves, wheel zooms, click picks a member. Click or drag in a plot
        sets the time. Where the system asks for reduced motion, playback goes on in still pictures, four a second.</p>
      <button type="button" onClick={() => (state.helpOpen.value = false)}>Close</button>
    </dialog>
  );
}
