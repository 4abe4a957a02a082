/// The run of one branch as this page has it: frames arrive in any order, some are never sent.
import { findFrame, makeRun, type Run, type RunEvent } from "./data";
import { chooseHiddenKinds, makeState, runClock, type Look, type State } from "./state";
import type { WireFrame } from "./steer_wire";

const keyOf = (e: RunEvent): string => `${e.time} ${e.kind} ${e.subject}`;
const apart = 8; // frames between two holes of one stretch
const memory = 256e6; // of frames, then every second one is enough, ... [bytes]

export class BranchRun {
  readonly run: Run;
  readonly state: State;
  /// Row in the server's record of each frame here. Rising.
  readonly rows: number[] = [];
  private onlyScene: boolean;
  private dirty = false;
  private hasNews = false; // events
  private readonly known = new Set<string>(); // events that are there
  private readonly decided = new Set<string>();

  /// A branch that parts from another one and has the same bodies and zones.
  static part(id: number, parent: BranchRun, look: Look): BranchRun {
    const { run } = parent;
    return new BranchRun(id, { ...run, time: [], frames: [], events: [], findings: [], series: run.series.map((series) => ({ ...series, value: [] })) }, look, true);
  }

  /// `scene` is report data with one frame, or a run without one.
  constructor(readonly id: number, scene: unknown, look: Look, isRun = false) {
    this.run = isRun ? (scene as Run) : makeRun(scene);
    this.onlyScene = this.run.time.length > 0;
    if (this.onlyScene) this.rows.push(-1);
    for (const event of this.run.events) this.known.add(keyOf(event));
    this.state = makeState(this.run, look, 0);
    runClock(this.state);
  }

  /// Bytes of one frame of the wire.
  get frameSize(): number {
    return 28 * this.run.bodies.length + 5 * this.run.zones.length + 4 * this.run.series.length;
  }

  /// Whether a frame is of this model. An added charge brings debris, so a branch may get another one.
  fits(frame: WireFrame): boolean {
    return frame.pose.length === 7 * this.run.bodies.length && frame.state.length === this.run.zones.length;
  }

  add(frame: WireFrame): void {
    const { run, rows } = this;
    if (!this.fits(frame)) return;
    if (this.onlyScene) {
      // The one frame of the scene stood in for the first real one.
      this.onlyScene = false;
      rows.length = run.time.length = run.frames.length = 0;
      for (const series of run.series) series.value.length = 0;
    }
    let at = rows.length;
    while (at > 0 && (rows[at - 1] as number) > frame.row) --at;
    if (at > 0 && rows[at - 1] === frame.row) return;
    // Times rise strictly, also where a branch computes a moment again.
    if ((at > 0 && (run.time[at - 1] as number) >= frame.time) || (at < rows.length && (run.time[at] as number) <= frame.time)) return;
    rows.splice(at, 0, frame.row);
    run.time.splice(at, 0, frame.time);
    run.frames.splice(at, 0, frame);
    run.series.forEach((series, k) => {
      const value = frame.series[k] as number;
      series.value.splice(at, 0, Number.isFinite(value) ? value : null);
    });
    this.dirty = true;
  }

  /// Takes over what a branch had before this one parted from it.
  share(parent: BranchRun, firstRow: number): void {
    if (parent.run.bodies.length !== this.run.bodies.length || parent.run.zones.length !== this.run.zones.length) return;
    parent.rows.forEach((row, k) => {
      if (row < 0 || row >= firstRow) return;
      const frame = parent.run.frames[k] as WireFrame;
      if ("row" in frame) this.add(frame);
    });
  }

  /// Shows what was added. Returns whether there was anything.
  flush(): boolean {
    if (!this.dirty) return false;
    this.dirty = false;
    if (this.hasNews) this.hideMany();
    this.hasNews = false;
    this.state.grown.value += 1;
    return true;
  }

  addEvents(events: readonly RunEvent[]): void {
    for (const event of events) {
      const key = keyOf(event);
      if (this.known.has(key)) continue;
      this.known.add(key);
      this.run.events.push(event);
      this.dirty = this.hasNews = true;
    }
  }

  /// Kinds of events that have become many are left out of the list, once: who asks for them again keeps them.
  private hideMany(): void {
    const many = [...chooseHiddenKinds(this.run)].filter((kind) => !this.decided.has(kind));
    if (many.length === 0) return;
    for (const kind of many) this.decided.add(kind);
    this.state.hiddenKinds.value = new Set([...this.state.hiddenKinds.value, ...many]);
  }

  /// The first stretch of frames that this page should have and has not, of the `count` the server holds. Holes near to
  /// each other are one stretch: to have a few frames twice costs less than to ask for each.
  findMissing(count: number): { from: number; count: number; stride: number } | undefined {
    const stride = Math.max(1, Math.ceil((count * this.frameSize) / memory));
    const have = new Set(this.rows);
    for (let from = 0; from < count; from += stride) {
      if (have.has(from)) continue;
      let last = from;
      for (let to = from + stride; to < count && to - from < 200 * stride && to - last <= apart * stride; to += stride) if (!have.has(to)) last = to;
      return { from, count: (last - from) / stride + 1, stride };
    }
    return undefined;
  }

  /// Time of the last frame here.
  get last(): number {
    return this.run.time[this.run.time.length - 1] ?? 0;
  }
  timeOfRow(row: number): number | undefined {
    const at = this.rows.indexOf(row);
    return at < 0 ? undefined : this.run.time[at];
  }
  frameAt(time: number): number {
    return findFrame(this.run.time, time).frame;
  }
}
