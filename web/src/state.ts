/// What the viewer looks at. The run itself never changes.
import { computed, signal, type ReadonlySignal } from "@preact/signals";
import type { Run } from "./data";
import { findFrame } from "./data";
import { changeNext } from "./schedule";
import { wordsOfEvent } from "./vocabulary";

export type Colouring = "kind" | "material" | "state" | "utilisation" | "speed";
export type ZoneMarks = "damaged" | "all" | "none";

export const speeds = [0.1, 0.25, 0.5, 1, 2, 4];
export const reducedMotion = (): boolean => matchMedia("(prefers-reduced-motion: reduce)").matches;

/// How the picture looks; the runs of one page share it.
export function makeLook() {
  return {
    selected: signal(-1),
    colouring: signal<Colouring>("kind"),
    zoneMarks: signal<ZoneMarks>("damaged"),
    helpOpen: signal(false),
    speed: signal(1),
  };
}
export type Look = ReturnType<typeof makeLook>;

/// Follows another signal, `wait` [ms] behind it at most; `hurry` brings it there at once.
function followSlowly(from: ReadonlySignal<number>, wait: number): { slow: ReadonlySignal<number>; hurry: () => void } {
  const slow = signal(from.peek());
  let waiting = false;
  const hurry = (): void => {
    slow.value = from.peek();
  };
  from.subscribe((value) => {
    if (waiting || value === slow.peek()) return;
    waiting = true;
    setTimeout(() => {
      waiting = false;
      hurry();
    }, wait);
  });
  return { slow, hurry };
}

/// `begin` is where the time axis begins, also where frames before the first one are still to come.
export function makeState(run: Run, look: Look = makeLook(), begin = run.time[0] ?? 0) {
  /// Rises when frames, events or series have been added to the run.
  const grown = signal(0);
  const end = computed(() => (grown.value, run.time[run.time.length - 1] ?? 0));
  /// The time axis ends here, or at the last frame if that is later.
  const limit = signal(0);
  const span = computed(() => Math.max(limit.value, end.value));
  /// Follows `grown` at most four times a second, for what is slow to draw.
  const grownSlowly = followSlowly(grown, 250).slow;
  const time = signal(begin);
  /// Follows `time` at most ten times a second while it moves by itself: for texts, sliders and lines in plots, each change
  /// of which costs a layout of the page and the drawing of its parts.
  const { slow: timeSlowly, hurry } = followSlowly(time, 100);
  const playing = signal(false);
  playing.subscribe(hurry); // what stands still is exact
  const hiddenKinds = signal<ReadonlySet<string>>(chooseHiddenKinds(run));
  /// Of `timeSlowly`.
  const frame = computed(() => (grown.value, findFrame(run.time, timeSlowly.value).frame));
  const inOrder = computed(() => (grownSlowly.value, [...run.events].sort((a, b) => a.time - b.time)));
  const shownEvents = computed(() => inOrder.value.filter((e) => !hiddenKinds.value.has(e.kind)));

  /// For time that moves by itself.
  const move = (t: number): void => {
    time.value = Math.min(end.peek(), Math.max(begin, t));
  };
  const seek = (t: number): void => {
    move(t);
    hurry();
  };
  const pauseAt = (t: number): void => {
    playing.value = false;
    seek(t);
  };

  return {
    run,
    begin,
    end,
    time,
    timeSlowly,
    frame,
    grown,
    grownSlowly,
    limit,
    span,
    playing,
    ...look,
    hiddenKinds,
    shownEvents,
    move,
    seek,
    pauseAt,
    togglePlay(): void {
      if (run.time.length < 2) return;
      if (!playing.value && time.value >= end.value) seek(begin);
      playing.value = !playing.value;
    },
    stepFrame(direction: 1 | -1): void {
      const { frame: at, fraction } = findFrame(run.time, time.value);
      const target = direction > 0 ? at + 1 : fraction > 0 ? at : at - 1;
      pauseAt(run.time[Math.min(run.time.length - 1, Math.max(0, target))] ?? begin);
    },
    /// To the next moment at which a shown event happens; events of one moment count as one.
    stepEvent(direction: 1 | -1): void {
      const apart = 1e-6;
      const times = shownEvents.value.map((e) => e.time).filter((t) => t >= begin && t <= end.value);
      const t = time.value;
      const ahead = direction > 0 ? times.filter((s) => s > t + apart) : times.filter((s) => s < t - apart);
      if (ahead.length > 0) pauseAt(direction > 0 ? Math.min(...ahead) : Math.max(...ahead));
      else pauseAt(direction > 0 ? end.value : begin);
    },
  };
}
export type State = ReturnType<typeof makeState>;

/// Brings the picture back into view after a jump from further down the page.
export function showStage(): void {
  const stage = document.querySelector(".stage");
  const top = stage?.getBoundingClientRect().top ?? 0;
  if (top < -80) stage?.scrollIntoView({ behavior: reducedMotion() ? "auto" : "smooth", block: "start" });
}

/// A long list starts with what an engineer asks for first; nothing is hidden in a short one.
export function chooseHiddenKinds(run: Run): ReadonlySet<string> {
  if (run.events.length <= 60) return new Set();
  const count = new Map<string, number>();
  for (const event of run.events) count.set(event.kind, (count.get(event.kind) ?? 0) + 1);
  return new Set([...count].filter(([kind, n]) => n > 20 && wordsOfEvent(kind).small).map(([kind]) => kind));
}

/// Advances the time while playing. With reduced motion it goes on in still pictures, four a second.
export function runClock(state: State): void {
  let last = 0;
  let running = false;
  const tick = (now: number): void => {
    if (!state.playing.value) {
      running = false;
      return;
    }
    const wait = reducedMotion() ? 0.25 : 0;
    const passed = Math.max(0, now - last) / 1000;
    if (passed >= wait) {
      last = now;
      // A tab that slept does not leap.
      state.move(state.time.value + Math.min(passed, 0.5) * state.speed.value);
      if (state.time.value >= state.end.value) state.playing.value = false;
    }
    changeNext(tick);
  };
  state.playing.subscribe((playing) => {
    if (!playing || running) return;
    running = true;
    last = performance.now();
    changeNext(tick);
  });
}
