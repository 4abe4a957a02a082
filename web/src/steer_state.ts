/// What the steering page knows, and what it can ask for. Two clocks: the solver's frontier (`progress`) and the viewer's
/// cursor (`view.state.time`); only run, pause and step move the first, nothing of the viewer does.
import { batch, computed, effect, signal } from "@preact/signals";
import type { Finding, RunEvent } from "./data";
import { BranchRun } from "./steer_branch";
import { CommandError, Connection, type ErrorObject, type Message } from "./steer_connection";
import { decodeFrame } from "./steer_wire";
import type { Branch, Comparison, FindingsSoFar, ImportedPlan, LogEntry, PlanCheck, Sample, Session, StateEvent, Study, ZoneWatch } from "./steer_wire";
import { changeNext } from "./schedule";
import { makeLook } from "./state";
import { formatTime } from "./units";

export type Tab = "plots" | "events" | "findings" | "compare" | "study" | "plan" | "log";
export type Dialog =
  | { kind: "delay"; charge?: number; stage?: number; time: number; title: string }
  | { kind: "charge" | "pre_cut" | "cable"; member: string }
  | { kind: "friction" }
  | { kind: "branch" }
  | { kind: "rename"; branch: number; name: string }
  | { kind: "open" }
  | { kind: "save"; text: string }
  | { kind: "conflict"; text: string; disk: string; sha256: string };
export interface Notice {
  id: number;
  status: "info" | "good" | "bad";
  text: string;
  help?: string;
}

/// Points of a zone behind those before them; what is told twice stands once.
export const joinPath = (path: (number | null)[][], points: (number | null)[][]): (number | null)[][] => {
  const first = points[0]?.[0];
  return first === undefined || first === null ? path : [...path.filter((p) => (p[0] ?? 0) < first), ...points];
};

export function makeSteerState(address: string) {
  const look = makeLook();
  const session = signal<Session | null>(null);
  const progress = signal<StateEvent | null>(null);
  const plan = signal({ text: "", path: "", sha256: "" });
  const active = signal(0);
  const view = signal<BranchRun | null>(null);
  const following = signal(true);
  const sessions = signal<Session[]>([]);
  const log = signal<LogEntry[]>([]);
  const findings = signal<FindingsSoFar | null>(null);
  const studies = signal<Study[]>([]);
  const samples = signal<ReadonlyMap<number, Sample[]>>(new Map());
  const watchedStudy = signal(0);
  const zone = signal<ZoneWatch | null>(null);
  const comparison = signal<{ a: number; b: number; result: Comparison } | null>(null);
  const tab = signal<Tab>("plots");
  const tall = signal(false);
  const dialog = signal<Dialog | null>(null);
  const notices = signal<Notice[]>([]);
  const hiddenStoreys = signal<ReadonlySet<number>>(new Set());
  const section = signal<{ on: boolean; low: [number, number, number]; high: [number, number, number] }>({ on: false, low: [0, 0, 0], high: [1, 1, 1] });
  const showDebris = signal(true);
  const planCheck = signal<PlanCheck | null>(null);
  const editedText = signal<string | null>(null); // null: as on the disk
  const imported = signal<(ImportedPlan & { name: string }) | null>(null); // last one
  const welcomed = signal(false); // the server has said what it has
  const draws = signal(0); // rises when frames came in
  const runs = new Map<number, BranchRun>();
  let noticeId = 0;
  let filling = false;

  const notify = (status: Notice["status"], text: string, help?: string): void => {
    const id = ++noticeId;
    const others = notices.value.filter((n) => n.text !== text).slice(-1);
    notices.value = [...others, { id, status, text, ...(help === undefined || help === "" ? {} : { help }) }];
    setTimeout(() => dismiss(id), status === "bad" ? 20000 : 5000);
  };
  const dismiss = (id: number): void => {
    notices.value = notices.value.filter((n) => n.id !== id);
  };
  const complain = (error: unknown): void => {
    if (error instanceof CommandError) notify("bad", error.error.message, error.error.help);
    else notify("bad", error instanceof Error ? error.message : String(error));
  };

  const connection = new Connection(address, { onMessage: receive, onFrame: takeFrame });
  /// Does it and shows what went wrong; undefined then.
  async function ask<R>(command: string, keys: Record<string, unknown> = {}): Promise<R | undefined> {
    try {
      return await connection.command<R>(command, keys);
    } catch (error) {
      complain(error);
      return undefined;
    }
  }

  // What the edited text began from: a change on the disk that the page hears of later is not in it.
  let planBase = "";
  effect(() => {
    if (editedText.value === null) planBase = plan.value.sha256;
  });
  // Text that is not saved outlives a reload.
  const sessionId = computed(() => session.value?.id);
  const draftKey = (): string => `topple draft ${address} ${sessionId.value}`;
  effect(() => {
    const text = editedText.value;
    if (sessionId.value === undefined) return;
    try {
      if (text === null) sessionStorage.removeItem(draftKey());
      else sessionStorage.setItem(draftKey(), JSON.stringify({ text, base: planBase }));
    } catch {
      /* a browser without storage forgets */
    }
  });
  const readDraft = (): { text: string; base: string } | undefined => {
    try {
      return JSON.parse(sessionStorage.getItem(draftKey()) ?? "null") ?? undefined;
    } catch {
      return undefined;
    }
  };

  const branches = computed(() => session.value?.branches ?? []);
  const branch = computed(() => branches.value.find((b) => b.id === active.value));
  const phase = computed(() => progress.value?.phase ?? session.value?.phase ?? "paused");
  const frontier = computed(() => progress.value?.time ?? branch.value?.frontier ?? 0);
  const moment = computed(() => (following.value ? frontier.value : (view.value?.state.timeSlowly.value ?? 0)));
  /// The branch whose plan holds at the view: before its first frame that of the one it parts from, on which an edit there acts.
  const holding = computed(() => {
    const run = view.value;
    let one = branch.value;
    if (following.value || run === null) return one;
    const row = run.rows[run.state.frame.value] ?? -1;
    while (row >= 0 && one !== undefined && row < one.first_frame) {
      const { parent } = one;
      const before = branches.value.find((b) => b.id === parent);
      if (before === undefined) break;
      one = before;
    }
    return one;
  });
  /// Its charges at the view. What fires at the start has not fired at 0, before the first step.
  const lastFiring = computed(() => Math.max(-Infinity, ...(holding.value?.charges ?? []).map((c) => c.time).filter((t) => moment.value > 0 && t <= moment.value)));
  const charges = computed(() => (holding.value?.charges ?? []).map((c) => ({ ...c, fired: !c.removed && !c.fails && c.time <= lastFiring.value })));
  /// The end of the time axis: what the plan asks for, or how far the run came.
  const span = computed(() => Math.max(branch.value?.duration ?? 0, frontier.value, view.value?.state.end.value ?? 0, 1e-3));
  /// Neither at its end nor failed: what is found so far may change.
  const isUnderWay = computed(() => (progress.value?.ending ?? branch.value?.ending ?? null) === null);
  /// An earlier session of this plan, as long as this one has not begun.
  const earlier = computed(() => (frontier.value === 0 && log.value.length === 0 && branches.value.length === 1 && phase.value === "paused" ? (session.value?.earlier ?? null) : null));
  /// Where an edit would act.
  const editTime = computed(() => (following.value ? frontier.value : (view.value?.state.time.value ?? 0)));

  // Each run's time axis goes to the end of its plan.
  effect(() => {
    const run = view.value;
    if (run !== null) run.state.limit.value = branch.value?.duration ?? 0;
  });

  function putBranch(one: Branch): void {
    const now = session.value;
    if (now === null) return;
    const known = now.branches.some((b) => b.id === one.id);
    session.value = { ...now, branches: known ? now.branches.map((b) => (b.id === one.id ? one : b)) : [...now.branches, one] };
  }

  function receive(message: Message): void {
    batch(() => {
      const other = message["session"] !== undefined && typeof message["session"] === "number" && message["session"] !== session.value?.id;
      if (other && message.type !== "sessions") return;
      switch (message.type) {
        case "hello":
          greet(message);
          break;
        case "resumed":
          notify("good", "The connection is back. The run went on meanwhile.");
          catchUp();
          break;
        case "state": {
          const next = message as unknown as StateEvent;
          const before = progress.value;
          progress.value = next;
          if (next.branch !== active.value && branches.value.some((b) => b.id === next.branch)) void show(next.branch);
          if (before !== null && next.phase !== "running" && (before.phase === "running" || before.time !== next.time)) void readFindings();
          break;
        }
        case "happenings":
          runs.get(message["branch"] as number)?.addEvents(message["events"] as RunEvent[]);
          draws.value += 1;
          break;
        case "branch": {
          const made = message["branch"] as Branch;
          const before = branches.value.find((b) => b.id === made.id);
          putBranch(made);
          const run = runs.get(made.id);
          if (before !== undefined && before.starts !== made.starts && run !== undefined) void renew(run);
          if (before !== undefined && before.edits.length !== made.edits.length && made.id === active.value && phase.value !== "running") void readFindings();
          // What parts from the active branch is active from then on: its picture need not wait for the next state.
          if (before === undefined && made.parent === active.value) void show(made.id);
          break;
        }
        case "log":
          if (!log.value.some((e) => e.seq === (message["entry"] as LogEntry).seq)) log.value = [...log.value, message["entry"] as LogEntry];
          break;
        case "zone":
          if (zone.value !== null && zone.value.zone === message["zone"])
            zone.value = { ...zone.value, path: joinPath(zone.value.path, message["points"] as number[][]) };
          break;
        case "study":
          putStudy(message["study"] as Study, (message["samples"] ?? []) as Sample[]);
          break;
        case "sessions":
          sessions.value = message["sessions"] as Session[];
          break;
        case "plan_changed":
          if (saving > 0) told = String(message["sha256"]);
          else if (message["sha256"] !== plan.value.sha256) void readPlan();
          break;
        case "bye":
          notify("bad", message["session"] === undefined ? `The server has ended: ${String(message["reason"])}` : `This session was closed: ${String(message["reason"])}`);
          if (message["session"] !== undefined) leave();
          break;
      }
    });
  }

  /// What is told without a number is not told again: asked for once more.
  function catchUp(): void {
    ask<{ studies: Study[] }>("study.list").then((r) => r?.studies.forEach((s) => putStudy(s, [])));
    if (watchedStudy.value !== 0) void watchStudy(watchedStudy.value);
    if (zone.value !== null) void watchZone(zone.value.zone);
  }

  async function watchStudy(id: number): Promise<void> {
    if (watchedStudy.value !== 0 && watchedStudy.value !== id) void ask("study.unwatch", { study: watchedStudy.value });
    watchedStudy.value = id;
    const result = await ask<{ study: Study; samples: Sample[] }>("study.watch", { study: id });
    if (result !== undefined) putStudy(result.study, result.samples);
  }

  function leave(): void {
    session.value = null;
    view.value = null;
    progress.value = null;
    runs.clear();
    dialog.value = null;
  }

  function greet(message: Message): void {
    welcomed.value = true;
    const next = (message["session"] ?? null) as Session | null;
    if (Array.isArray(message["sessions"])) sessions.value = message["sessions"] as Session[];
    const known = next !== null && session.value?.id === next.id;
    const keep = remembered();
    if (!known && session.value === null && keep !== undefined && next !== null && keep.session !== next.id) {
      // After a reload: the session that was watched before.
      connection.command("session.attach", { session: keep.session }).catch(() => undefined);
    }
    if (!known) runs.clear();
    session.value = next;
    if (next === null) {
      leave();
      return;
    }
    if (!sessions.value.some((s) => s.id === next.id)) sessions.value = [...sessions.value, next];
    progress.value = (message["state"] as StateEvent | null | undefined) ?? null;
    plan.value = message["plan"] as typeof plan.value;
    if (!known) {
      const draft = readDraft();
      editedText.value = draft?.text ?? null;
      if (draft !== undefined) planBase = draft.base;
    }
    if (next.diagnostics !== undefined && editedText.value === null) planCheck.value = { diagnostics: next.diagnostics, title: next.title, notes: [] };
    if (next.active === null || message["scene"] === null || message["scene"] === undefined) {
      // Not built yet, or it cannot be: another hello follows when it is.
      view.value = null;
      active.value = 0;
      return;
    }
    active.value = next.active;
    if (!known) {
      comparison.value = null;
      zone.value = null;
      hiddenStoreys.value = new Set();
      look.selected.value = -1;
    }
    const run = runs.get(next.active) ?? new BranchRun(next.active, message["scene"], look);
    runs.set(next.active, run);
    useRun(run);
    if (!known && keep?.session === next.id) {
      following.value = keep.following;
      if (!keep.following) wanted = keep.time;
      tab.value = keep.tab;
    }
    void readFindings();
    if (zone.value !== null) void watchZone(zone.value.zone);
    ask<{ sessions: Session[] }>("session.list").then((r) => r !== undefined && (sessions.value = r.sessions));
    ask<{ entries: LogEntry[] }>("log").then((r) => r !== undefined && (log.value = r.entries.filter((e) => typeof e.seq === "number")));
    ask<{ studies: Study[] }>("study.list").then((r) => r?.studies.forEach((s) => putStudy(s, [])));
    ask<PlanCheck>("plan.check", { text: plan.value.text }).then((r) => r !== undefined && editedText.value === null && (planCheck.value = r));
    fill();
  }

  /// A place in time to go to when its frames are there.
  let wanted: number | undefined;

  function useRun(run: BranchRun): void {
    const before = view.value;
    if (before === run) return;
    before?.state.pauseAt(before.state.time.value);
    const name = before?.run.bodies[look.selected.value]?.name;
    if (before !== null) look.selected.value = name === undefined ? -1 : run.run.bodies.findIndex((b) => b.name === name);
    view.value = run;
    if (following.value) run.state.seek(Infinity);
  }

  /// The run of a new branch whose picture is that of its parent: most edits move no box. Undefined if that is not known.
  function partFromParent(id: number): BranchRun | undefined {
    const info = branches.value.find((b) => b.id === id);
    const parent = info?.parent === null || info?.parent === undefined ? undefined : runs.get(info.parent);
    if (info === undefined || parent === undefined || info.bodies !== parent.run.bodies.length || info.zones !== parent.run.zones.length) return undefined;
    if (!info.edits.every((e) => ["set_friction", "set_delay", "add_cable", "remove_cable", "add_pre_cut"].includes(e.kind))) return undefined;
    const run = BranchRun.part(id, parent, look);
    run.share(parent, info.first_frame);
    if (run.run.time.length === 0) return undefined;
    run.addEvents(parent.run.events.filter((e) => e.time <= info.time));
    run.flush();
    runs.set(id, run);
    return run;
  }

  /// Shows the branch that the server made active.
  async function show(id: number): Promise<void> {
    if (active.value === id && view.value?.id === id) return;
    active.value = id;
    let run = runs.get(id) ?? partFromParent(id);
    if (run === undefined) {
      const answer = await ask<{ scene: unknown }>("scene", { branch: id });
      if (answer === undefined) return;
      run = runs.get(id) ?? new BranchRun(id, answer.scene, look);
      runs.set(id, run);
      const info = branches.value.find((b) => b.id === id);
      const parent = info?.parent === null || info?.parent === undefined ? undefined : runs.get(info.parent);
      if (parent !== undefined && info !== undefined) {
        run.share(parent, info.first_frame);
        run.flush();
      }
    }
    if (active.value !== id) return;
    const time = view.value?.state.time.value ?? 0;
    useRun(run);
    if (!following.value) run.state.seek(time);
    if (zone.value !== null) void watchZone(zone.value.zone);
    // findings take a processor: first the picture of the branch
    setTimeout(() => void readFindings(), phase.value === "running" ? 500 : 0);
    fill();
  }

  /// The path so far comes as an event, or in the answer.
  async function watchZone(name: string | null): Promise<void> {
    zone.value = name === null ? null : { zone: name, law: null, path: [] };
    const result = await ask<Partial<ZoneWatch>>("zone", { zone: name });
    const now = zone.value;
    if (name === null || now === null || now.zone !== name) return;
    if (result === undefined) zone.value = null;
    else zone.value = { zone: name, law: result.law ?? null, path: result.path ?? now.path };
  }

  function takeFrame(bytes: ArrayBuffer): void {
    try {
      const frame = decodeFrame(bytes);
      if (frame.session !== session.value?.id) return;
      const run = runs.get(frame.branch);
      if (run === undefined) return;
      if (run.fits(frame)) run.add(frame);
      else void renew(run);
      draws.value += 1;
    } catch (error) {
      complain(error);
    }
  }

  /// The branch has another model now: its scene and its frames are read again.
  async function renew(old: BranchRun): Promise<void> {
    if (renewing.has(old.id)) {
      renewing.set(old.id, true);
      return;
    }
    renewing.set(old.id, false);
    const answer = await ask<{ scene: unknown }>("scene", { branch: old.id });
    const isAgain = renewing.get(old.id) === true; // it began anew meanwhile
    renewing.delete(old.id);
    if (answer === undefined || runs.get(old.id) !== old) return;
    const run = new BranchRun(old.id, answer.scene, look);
    run.addEvents(old.run.events);
    runs.set(old.id, run);
    const time = old.state.time.value;
    if (view.value === old) {
      useRun(run);
      if (!following.value) wanted = time;
    }
    if (isAgain) void renew(run);
    fill();
  }
  const renewing = new Map<number, boolean>();

  // While an edit is on its way the processors are for it, not for pictures of what it leaves.
  let editedAt = -Infinity; // [ms]
  const longestHold = 300;
  // Frames come faster than pictures: what came is shown once per picture.
  const showWhatCame = (): void => {
    if (performance.now() - editedAt < longestHold) return;
    for (const run of runs.values()) run.flush();
    const run = view.peek();
    if (run === null) return;
    if (following.peek()) run.state.move(run.last);
    else if (wanted !== undefined && run.last >= wanted) {
      run.state.seek(wanted);
      wanted = undefined;
    }
  };
  effect(() => {
    if (draws.value > 0) changeNext(showWhatCame);
  });
  // Playback that arrives at the end of what there is goes on with the run.
  effect(() => {
    const run = view.value;
    if (run !== null && run.state.playing.value) following.value = false;
  });

  /// Asks for the frames that were dropped or are from before this page came, one stretch at a time.
  function fill(): void {
    if (filling || connection.status.value !== "open" || session.value === null) return;
    const missing: { run: BranchRun; from: number; count: number; stride: number }[] = [];
    for (const run of runs.values()) {
      const info = branches.value.find((b) => b.id === run.id);
      const isActive = run.id === active.value;
      if (!isActive && run.id !== comparison.value?.a && run.id !== comparison.value?.b) continue;
      let count = isActive && progress.value?.branch === run.id ? progress.value.frames : (info?.frames ?? 0);
      // While it runs the last frames may still be on their way.
      if (isActive && phase.value === "running") count -= 30;
      const found = run.findMissing(count);
      if (found !== undefined) missing.push({ run, ...found });
    }
    const next = missing[0];
    if (next === undefined) return;
    filling = true;
    const before = next.run.rows.length;
    connection
      .command("frames", { branch: next.run.id, from: next.from, count: next.count, stride: next.stride })
      .then(() => {
        filling = false;
        next.run.flush();
        if (next.run.rows.length > before) setTimeout(fill, 0);
      })
      .catch((error: unknown) => {
        filling = false;
        if (!(error instanceof CommandError && ["lost", "E920"].includes(error.error.code))) complain(error);
      });
  }
  setInterval(fill, 1000);
  // The verdict so far, while there is news. It takes a processor beside the run: at most a fifth of the time.
  let judgedAt = 0, judging = 0; // [ms]
  setInterval(() => {
    if (phase.value === "running" && connection.status.value === "open" && performance.now() - judgedAt > Math.max(1500, 4 * judging)) void readFindings();
  }, 500);

  let reading = false, readsAgain = false;
  async function readFindings(): Promise<void> {
    const id = active.value;
    if (id === 0) return;
    // what is being read may be of before the end or the pause that is asked for now
    if (reading) {
      readsAgain = true;
      return;
    }
    reading = true;
    readsAgain = false;
    const begin = performance.now();
    const result = await connection.command<FindingsSoFar>("findings", { branch: id }).catch(() => undefined);
    reading = false;
    judgedAt = performance.now();
    judging = judgedAt - begin;
    if (active.value !== id) return readFindings();
    if (readsAgain) void readFindings();
    if (result === undefined) return;
    findings.value = result;
    const run = runs.get(id);
    if (run === undefined) return;
    run.run.findings = result.findings as Finding[];
    run.run.not_modelled = result.not_modelled;
    // A record of a run that goes on ends with the words "so far"; that is no event of it.
    const ended = branches.value.find((b) => b.id === id)?.ending ?? progress.value?.ending ?? null;
    run.addEvents(result.events.filter((e) => ended !== null || e.kind !== "rest"));
    draws.value += 1;
  }

  let saving = 0, told = "";
  /// Saves the plan's text, which is then as it is on the disk: what the server tells of that meanwhile need not be read.
  async function savePlan(what: { text: string; path?: string; base_sha256?: string; force?: boolean }): Promise<void> {
    saving += 1;
    try {
      const r = await connection.command<{ sha256: string; path?: string }>("plan.save", what);
      plan.value = { text: what.text, path: r.path ?? what.path ?? plan.value.path, sha256: r.sha256 };
      editedText.value = null;
    } finally {
      saving -= 1;
      if (saving === 0) {
        if (told !== "" && told !== plan.value.sha256) void readPlan();
        told = "";
      }
    }
  }

  async function readPlan(): Promise<void> {
    const id = session.value?.id;
    const response = await fetch(`api/sessions/${id}/plan`);
    if (!response.ok) return;
    const text = await response.text();
    const bytes = new Uint8Array(await crypto.subtle.digest("SHA-256", new TextEncoder().encode(text)));
    plan.value = { ...plan.value, text, sha256: [...bytes].map((b) => b.toString(16).padStart(2, "0")).join("") };
  }

  function putStudy(study: Study, fresh: Sample[]): void {
    const known = studies.value.some((s) => s.id === study.id);
    studies.value = known ? studies.value.map((s) => (s.id === study.id ? study : s)) : [...studies.value, study];
    if (fresh.length > 0) {
      const all = new Map((samples.value.get(study.id) ?? []).map((s) => [s.index, s]));
      for (const one of fresh) all.set(one.index, one);
      samples.value = new Map(samples.value).set(study.id, [...all.values()].sort((a, b) => a.index - b.index));
    }
  }

  /// Sends an edit to act where the viewer looks. Throws a CommandError if it cannot.
  async function tryEdit(command: string, keys: Record<string, unknown>): Promise<void> {
    const at = following.value ? undefined : view.value?.state.time.value;
    editedAt = performance.now();
    try {
      if (at !== undefined) await connection.command("rewind", { time: at });
      else if (progress.value?.cursor !== null && progress.value?.cursor !== undefined && progress.value.cursor < frontier.value) await connection.command("live");
      const result = await connection.command<{ branch: Branch | number; edit?: { text: string } }>(command, keys);
      await arrive(result.branch, result.edit?.text);
    } finally {
      editedAt = -Infinity;
      draws.value += 1;
    }
  }
  const edit = (command: string, keys: Record<string, unknown>): Promise<void> => tryEdit(command, keys).catch(complain);

  async function arrive(made: Branch | number | undefined, text?: string): Promise<void> {
    const id = typeof made === "object" ? made.id : made;
    if (typeof made === "object") putBranch(made);
    if (id === undefined) return;
    const isNew = id !== active.value;
    following.value = true;
    if (isNew) await show(id);
    const name = branches.value.find((b) => b.id === id)?.name ?? `branch ${id}`;
    notify("good", `${text ?? "Done"}${isNew ? ` Now on branch “${name}”.` : ""}`);
  }

  const remembered = (): { session: number; time: number; following: boolean; tab: Tab } | undefined => {
    try {
      return JSON.parse(sessionStorage.getItem(`topple ${address}`) ?? "null") ?? undefined;
    } catch {
      return undefined;
    }
  };
  const remember = (): void => {
    if (session.value === null) return;
    const keep = { session: session.value.id, time: view.value?.state.time.value ?? 0, following: following.value, tab: tab.value };
    try {
      sessionStorage.setItem(`topple ${address}`, JSON.stringify(keep));
    } catch {
      /* a browser without storage forgets */
    }
  };
  addEventListener("pagehide", remember);

  const runOrPause = async (): Promise<void> => {
    if (phase.value === "running") await ask("pause");
    else if (phase.value === "finished") notify("info", progress.value?.ending?.text ?? "This branch has ended.", "Look at it, or change something at an earlier moment: that makes a new branch.");
    else if (phase.value !== "failed") {
      following.value = true;
      view.value?.state.seek(Infinity);
      await ask("run");
    }
  };

  return {
    ...look,
    connection, status: connection.status, ask, notify, dismiss, notices, welcomed,
    session, sessions, branches, branch, holding, charges, active, view, plan, progress, phase, frontier, span, following, editTime, isUnderWay, earlier, log, findings,
    studies, samples, watchedStudy, zone, comparison, tab, tall, dialog, hiddenStoreys, section, showDebris, planCheck, editedText, imported, draws,
    edit, tryEdit, arrive, show, fill, runs,

    runOrPause,
    /// Space: what the viewer looks at, the run or what is recorded of it.
    toggle(): void {
      if (following.value) void runOrPause();
      else view.value?.state.togglePlay();
    },
    goLive(): void {
      view.value?.state.pauseAt(view.value.last);
      following.value = true;
    },
    /// The viewer's cursor; the run is not touched.
    look(time: number): void {
      following.value = false;
      view.value?.state.pauseAt(time);
    },
    stepFrame(direction: 1 | -1): void {
      const run = view.value;
      if (run === null) return;
      if (following.value && direction > 0) {
        if (phase.value === "paused") void ask("step", { frames: 1 });
        return;
      }
      following.value = false;
      run.state.stepFrame(direction);
    },
    stepEvent(direction: 1 | -1): void {
      following.value = false;
      view.value?.state.stepEvent(direction);
    },
    async makeBranch(name: string): Promise<void> {
      const time = following.value ? undefined : view.value?.state.time.value;
      const result = await connection.command<{ branch: Branch | number }>("branch", { name, ...(time === undefined ? {} : { time }) });
      await arrive(result.branch, `Branched at ${formatTime(time ?? frontier.value)}.`);
    },
    async switchTo(id: number): Promise<void> {
      if (id === active.value) return;
      if ((await ask("switch", { branch: id })) !== undefined) await show(id);
    },
    async undo(): Promise<void> {
      const result = await ask<{ branch: Branch | number }>("undo");
      if (result !== undefined) await arrive(result.branch, "The last edit was taken back.");
    },
    watchZone,
    async compare(a: number, b: number): Promise<void> {
      const result = await ask<Comparison>("compare", { a, b });
      if (result === undefined) return;
      for (const id of [a, b])
        if (!runs.has(id)) {
          const answer = await ask<{ scene: unknown }>("scene", { branch: id });
          if (answer !== undefined) runs.set(id, new BranchRun(id, answer.scene, look));
        }
      comparison.value = { a, b, result };
      tab.value = "compare";
      fill();
    },
    async openSession(keys: Record<string, unknown>): Promise<ErrorObject | undefined> {
      try {
        await connection.command("session.open", keys);
        dialog.value = null;
        return undefined;
      } catch (error) {
        if (error instanceof CommandError) return error.error;
        throw error;
      }
    },
    /// The text that a file of another program (IFC, DXF) gives. Throws a CommandError.
    async importFile(file: File): Promise<string> {
      const made = await connection.command<ImportedPlan>("plan.import", { name: file.name, text: await file.text() });
      imported.value = { ...made, name: file.name };
      return made.text;
    },
    /// Makes the branch of a study's run and lets it fall as soon as it stands.
    async playSample(study: number, sample: number): Promise<void> {
      const result = await ask<{ branch: Branch | number }>("study.play", { study, sample });
      if (result === undefined) return;
      await arrive(result.branch, `Playing sample ${sample}.`);
      const id = active.value;
      let stop = (): void => undefined;
      let over = false;
      stop = effect(() => {
        const waits = active.value === id && (phase.value === "building" || phase.value === "equilibrium");
        if (waits || over) return;
        over = true;
        if (active.value === id && phase.value === "paused") void ask("run");
        queueMicrotask(() => stop());
      });
    },
    watchStudy,
    complain,
    readPlan,
    savePlan,
    planBase: () => planBase,
  };
}
export type SteerState = ReturnType<typeof makeSteerState>;
