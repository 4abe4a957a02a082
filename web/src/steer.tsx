/// The steering page: docs/steer.md for those who use it, docs/protocol.md for what it says to the server.
import "uplot/dist/uPlot.min.css";
import "./style.css";
import "./steer.css";
import { render } from "preact";
import { Findings, NotModelled } from "./findings";
import { Help, listen } from "./keys";
import { Plots } from "./plots";
import { Compare } from "./steer_compare";
import { Dialogs, Notices } from "./steer_dialogs";
import { recording, savePng, saveWebm } from "./steer_export";
import { countOf, PlanEditor } from "./steer_plan";
import { Side } from "./steer_side";
import { makeSteerState, type SteerState, type Tab } from "./steer_state";
import { StudyPanel } from "./steer_study";
import { SteerTimeline } from "./steer_timeline";
import { Tree } from "./steer_tree";
import { SteerView, picture } from "./steer_view";
import { OpenPlan } from "./steer_welcome";
import { Events } from "./tables";
import { describeValues, formatDate, formatDuration, formatTime, prettify } from "./units";
import { endingWord } from "./vocabulary";

const phaseWord: Record<string, string> = {
  building: "Building", equilibrium: "Finding rest under its own weight", paused: "Paused", running: "Running", finished: "Finished", failed: "Diverged",
};
const phaseSign: Record<string, string> = { building: "…", equilibrium: "…", paused: "‖", running: "▶", finished: "■", failed: "✖" };

function Header(props: { s: SteerState }) {
  const { s } = props;
  const session = s.session.value;
  const p = s.progress.value;
  const phase = s.phase.value;
  const check = s.planCheck.value;
  const isBuilt = s.view.value !== null;
  const base = session === null ? "" : `api/sessions/${session.id}/branches/${s.active.value}/`;
  return (
    <header class="steer-header">
      <label class="session-choice">
        <span class="visually-hidden">Session</span>
        <select data-test="sessions" value={String(session?.id ?? "")}
          onChange={(e) => {
            const { value } = e.currentTarget;
            if (value === "open") {
              e.currentTarget.value = String(session?.id ?? "");
              s.dialog.value = { kind: "open" };
            } else void s.ask("session.attach", { session: Number(value) });
          }}>
          {s.sessions.value.map((one) => <option value={String(one.id)}>{one.title || one.path || `Session ${one.id}`}</option>)}
          <option value="open">Open another plan…</option>
        </select>
      </label>
      <h1 class="visually-hidden">{session?.title || session?.path || "topple"}</h1>
      <span class={`phase ${phase}`} data-test="phase"><span aria-hidden="true">{phaseSign[phase]} </span>{phase === "failed" && !isBuilt ? "Cannot be run" : phaseWord[phase]}</span>
      <span class="number" data-test="header-time">{formatTime(s.frontier.value)}</span>
      {phase === "running" && p?.real_time_factor !== null && p !== null && <span class="number quiet">{p.real_time_factor.toFixed(2)}× real time{p.eta === null ? "" : `, ${formatDuration(Math.ceil(p.eta))} to go`}</span>}
      {p !== null && (phase === "building" || phase === "equilibrium") && <progress max={1} {...(typeof p.progress === "number" ? { value: p.progress } : {})} aria-label="Progress" />}
      <span>Branch <strong data-test="active-branch">{s.branch.value?.name ?? "–"}</strong></span>
      <span class="spring" />
      <button type="button" data-test="check" title="The plan's text and what is wrong with it" onClick={() => ((s.tab.value = "plan"), (s.tall.value = true))}>
        Check <span class={countOf(check, "error") > 0 ? "bad-word" : ""}>{countOf(check, "error")} ✖</span> <span class={countOf(check, "warning") > 0 ? "warning-word" : ""}>{countOf(check, "warning")} ⚠</span>
      </button>
      {isBuilt && <>
      <a class="button" href={`${base}report.html`} target="_blank" rel="noopener" data-test="report" title="The report of this branch so far, one file">Report</a>
      <a class="button" href={`${base}record.h5`} download data-test="record" title="The record of this branch so far">Record</a>
      <button type="button" data-test="png" title="The picture as a file" onClick={() => savePng(s)}>PNG</button>
      <button type="button" data-test="webm" aria-pressed={recording.value} title="Plays the branch and records the picture" onClick={() => void saveWebm(s)}>{recording.value ? "Stop recording" : "Video"}</button>
      </>}
      {session !== null && s.sessions.value.length > 1 && (
        <button type="button" title="Close this session; its log stays on the disk" onClick={() => void s.ask("session.close", { session: session.id })}>Close</button>
      )}
    </header>
  );
}

/// One line across the page for what the whole page stands under.
function Banner(props: { s: SteerState }) {
  const { s } = props;
  const p = s.progress.value;
  const ending = p?.ending ?? s.branch.value?.ending ?? null;
  const again = <>Start <code>topple steer</code> again and open the address that it prints: it offers to go on where the log ends. What is shown here is the last state.</>;
  if (s.status.value === "lost" && s.connection.unanswered.value)
    return <div class="banner bad" role="alert" data-test="banner"><strong>No answer from the server.</strong> If it has ended: {again} This page still tries to reconnect.</div>;
  if (s.status.value === "gone") return <div class="banner bad" role="alert" data-test="banner"><strong>This server is gone;</strong> another one has its address. {again}</div>;
  if (s.status.value === "lost")
    return <div class="banner warning" role="status" data-test="banner"><strong>No connection.</strong> The run goes on without this page; reconnecting…</div>;
  if (s.status.value === "ended") return <div class="banner bad" role="alert" data-test="banner"><strong>The server has ended.</strong> {again}</div>;
  if (s.phase.value === "failed" && ending?.code === "E940")
    return (
      <div class="banner bad" role="alert" data-test="banner">
        <strong>This session cannot go on.</strong> {prettify(ending.text)} {s.view.value === null ? "“Run as a new branch” below tries again." : "You see the last state."}
      </div>
    );
  if (s.phase.value === "failed" && s.view.value === null)
    return <div class="banner bad" role="alert" data-test="banner"><strong>This plan cannot be run as it is.</strong> {prettify(ending?.text ?? "")} Mend the text below; “Run as a new branch” tries again.</div>;
  if (s.phase.value === "failed") {
    const marked = /([A-Z]-[A-Z0-9]+-\d+(?:\/\w+)?)/.exec(ending?.text ?? "")?.[1];
    return (
      <div class="banner bad" role="alert" data-test="banner">
        <strong>The calculation diverged.</strong> {prettify(ending?.text ?? "")} You see the last good state.{" "}
        {marked !== undefined && <button type="button" class="small" onClick={() => (s.selected.value = s.view.value?.run.bodies.findIndex((b) => b.name === marked.split("/")[0]) ?? -1)}>Show {marked}</button>}{" "}
        Go back and change something, or take a smaller step in the plan.
      </div>
    );
  }
  if (s.phase.value === "finished" && ending !== null) {
    const limit = ending.kind === "time_limit";
    return (
      <div class={`banner ${limit ? "warning" : "good"}`} role="status" data-test="banner">
        <strong>{endingWord[ending.kind] ?? ending.kind}.</strong> {prettify(ending.text)}{limit ? " Parts may still have been moving: a longer duration in the plan shows how it ends." : ""}
      </div>
    );
  }
  if (s.planCheck.value?.removes_support === false && s.editedText.value === null)
    return <div class="banner warning" role="status" data-test="banner"><strong>Nothing removes a support; the building will stand.</strong> Add charges, or see the plan's text.</div>;
  if (s.planCheck.value !== null && countOf(s.planCheck.value, "error") > 0)
    return (
      <div class="banner bad" role="alert" data-test="banner">
        <strong>The plan's text has {countOf(s.planCheck.value, "error")} {countOf(s.planCheck.value, "error") === 1 ? "error" : "errors"}.</strong>{" "}
        <button type="button" class="small" onClick={() => ((s.tab.value = "plan"), (s.tall.value = true))}>Show</button>
      </div>
    );
  return null;
}

/// A session that ended before, maybe not by itself.
function Earlier(props: { s: SteerState }) {
  const { s } = props;
  const earlier = s.earlier.value;
  if (earlier === null) return null;
  return (
    <div class="banner info" role="status" data-test="earlier">
      <strong>There is an earlier session of this plan</strong> ({earlier.log}, {formatDate(earlier.created)}): {earlier.actions} {earlier.actions === 1 ? "action" : "actions"}, {earlier.branches} {earlier.branches === 1 ? "branch" : "branches"}, computed to {formatTime(earlier.time)}.{" "}
      <button type="button" class="small" data-test="continue" onClick={() => void s.ask("session.continue")}>Go on with it</button>{" "}
      or begin anew with Run.
    </div>
  );
}

const tabs: [Tab, string][] = [
  ["plots", "Plots"], ["events", "Events"], ["findings", "Findings"], ["compare", "Compare"], ["study", "Study"], ["plan", "Plan text"], ["log", "Action log"],
];

function Log(props: { s: SteerState }) {
  const { s } = props;
  const nameOf = (id: number): string => s.branches.value.find((b) => b.id === id)?.name ?? String(id);
  return (
    <div class="pad" data-test="log">
      <p class="quiet">
        Everything that changed a run, in order; <code>topple replay</code> does it again with the same bits.{" "}
        <a href={`api/sessions/${s.session.value?.id}/log`} download="actions.jsonl">Save the log</a>
      </p>
      <table class="text-table">
        <thead><tr><th scope="col">No.</th><th scope="col">Branch</th><th scope="col">At</th><th scope="col">Action</th><th scope="col">Values</th></tr></thead>
        <tbody>
          {s.log.value.filter((e, k, all) => e.action !== "reached" || all[k + 1]?.action !== "reached").reverse().map((e) => {
            const { command: _, id: __, session: ___, branch: ____, ...values } = (e.command ?? {}) as Record<string, unknown>;
            return (
              <tr>
                <td>{e.seq}</td><td>{nameOf(e.branch)}{e.made !== undefined ? ` → ${nameOf(e.made)}` : ""}</td><td>{formatTime(e.time)}</td>
                <td>{e.action.replace(/_/g, " ")}</td><td>{describeValues(values)}</td>
              </tr>
            );
          })}
        </tbody>
      </table>
      {s.log.value.length === 0 && <p class="quiet">Nothing yet.</p>}
    </div>
  );
}

function Bottom(props: { s: SteerState }) {
  const { s } = props;
  const view = s.view.value;
  const tab = s.tab.value;
  if (view === null) return null;
  void view.state.grownSlowly.value;
  return (
    <section class="bottom" aria-label="Plots and tables">
      <div class="tabs" role="tablist">
        {tabs.map(([id, word]) => (
          <button type="button" role="tab" id={`tab-${id}`} aria-selected={tab === id} data-test={`tab-${id}`} onClick={() => (s.tab.value = id)}
            onKeyDown={(e) => {
              const to = e.key === "ArrowRight" ? 1 : e.key === "ArrowLeft" ? -1 : 0;
              if (to === 0) return;
              e.stopPropagation();
              const next = tabs[(tabs.findIndex((t) => t[0] === tab) + to + tabs.length) % tabs.length] as [Tab, string];
              s.tab.value = next[0];
              document.getElementById(`tab-${next[0]}`)?.focus();
            }}>
            {word}
          </button>
        ))}
        <span class="spring" />
        <button type="button" aria-pressed={s.tall.value} data-test="tall" onClick={() => (s.tall.value = !s.tall.value)}>{s.tall.value ? "Smaller" : "Larger"}</button>
      </div>
      <div class="tab-body" role="tabpanel" aria-labelledby={`tab-${tab}`}>
        {tab === "plots" && <Plots key={view.id} state={view.state} onSeek={s.look} height={s.tall.value ? 220 : 130} />}
        {tab === "events" && <Events state={view.state} />}
        {tab === "findings" && s.isUnderWay.value && (
          <p class="banner info" data-test="so-far">The run is under way: findings as they stand at {formatTime(s.findings.value?.time ?? s.frontier.value)}. What may still change is not judged.</p>
        )}
        {tab === "findings" && (
          <div class="finding-columns">
            <Findings run={{ ...view.run, findings: s.findings.value?.findings ?? [] }} />
            <NotModelled run={{ ...view.run, not_modelled: s.findings.value?.not_modelled ?? view.run.not_modelled }} />
          </div>
        )}
        {tab === "compare" && <Compare s={s} />}
        {tab === "study" && <StudyPanel s={s} />}
        {tab === "plan" && <PlanEditor s={s} />}
        {tab === "log" && <Log s={s} />}
      </div>
    </section>
  );
}

const keys: [string, string][] = [
  ["Space", "at LIVE: run, pause; in the past: play, stop"],
  ["← →", "frame before, next frame; at LIVE → computes one frame"],
  ["Shift + ← →", "event before, next event"],
  ["Home, End", "to the beginning, to the last frame"],
  ["L", "LIVE: follow the run again"],
  ["B", "branch here"],
  ["F", "fit the picture to the window"],
  ["S", "section box"],
  ["Ctrl + Z", "take back the last edit"],
  ["Esc", "close this list, or let go of the member"],
  ["?", "this list"],
];

function listenToKeys(s: SteerState): void {
  const actions: Record<string, (event: KeyboardEvent) => void> = {
    " ": () => s.toggle(),
    arrowleft: (event) => (event.shiftKey ? s.stepEvent(-1) : s.stepFrame(-1)),
    arrowright: (event) => (event.shiftKey ? s.stepEvent(1) : s.stepFrame(1)),
    home: () => s.look(-Infinity),
    end: () => s.look(Infinity),
    l: () => s.goLive(),
    b: () => (s.dialog.value = { kind: "branch" }),
    f: () => picture.fit(),
    s: () => (s.section.value = { ...s.section.value, on: !s.section.value.on }),
    "?": () => (s.helpOpen.value = !s.helpOpen.value),
    escape: () => {
      if (s.helpOpen.value) s.helpOpen.value = false;
      else s.selected.value = -1;
    },
  };
  listen((event) => {
    if (s.session.value === null || s.dialog.value !== null) return undefined;
    if (event.ctrlKey) return event.key === "z" ? () => void s.undo() : undefined;
    const action = actions[event.key.toLowerCase()];
    return action === undefined ? undefined : () => action(event);
  });
}

function ready(): void {
  document.documentElement.dataset["ready"] = "yes";
}

function Page(props: { s: SteerState }) {
  const { s } = props;
  const view = s.view.value;
  if (s.session.value !== null && view === null) {
    setTimeout(ready, 0);
    const failed = s.phase.value === "failed";
    return (
      <div class="steer unbuilt">
        <Header s={s} />
        <div class="banners"><Banner s={s} /></div>
        {failed ? (
          <main><PlanEditor s={s} /></main>
        ) : (
          <main class="pad"><p role="status">{phaseWord[s.phase.value]}… <progress max={1} {...(typeof s.progress.value?.progress === "number" ? { value: s.progress.value.progress } : {})} aria-label="Progress" /></p></main>
        )}
        <Notices s={s} />
        <Dialogs s={s} />
      </div>
    );
  }
  if (s.session.value === null || view === null) {
    if (s.welcomed.value) setTimeout(ready, 0);
    return (
      <>
        <Banner s={s} />
        <main class="welcome" data-test="welcome">
          <h1>topple</h1>
          <p>Predicts how a blasted reinforced-concrete building collapses. Open a plan to see it, run it, stop it, change it and go on.</p>
          {s.welcomed.value ? <OpenPlan s={s} /> : <p role="status">Connecting…</p>}
        </main>
        <Notices s={s} />
      </>
    );
  }
  return (
    <div class={`steer ${s.tall.value ? "tall" : ""}`}>
      <Header s={s} />
      <div class="banners"><Banner s={s} /><Earlier s={s} /></div>
      <main class="steer-main">
        <Tree s={s} />
        <SteerView s={s} onReady={ready} />
        <Side s={s} />
      </main>
      <SteerTimeline s={s} view={view} />
      <Bottom s={s} />
      <Notices s={s} />
      <Dialogs s={s} />
      <Help state={s} keys={keys} text="Edits act where you look. The past stays as it is: a change of it makes a new branch." />
    </div>
  );
}

function start(): void {
  const root = document.getElementById("page") as HTMLElement;
  const address = new URL("ws", location.href);
  address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
  const s = makeSteerState(address.href);
  Object.assign(globalThis, { topple: s, toppleView: picture }); // for tests and for those who look into the page
  listenToKeys(s);
  root.textContent = "";
  render(<Page s={s} />, root);
}

start();
