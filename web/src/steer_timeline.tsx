/// The two clocks: how far the run is, and what the viewer looks at. Events and branches on one axis.
import type { SteerState } from "./steer_state";
import { Clock, IconButton, Markers, Slider } from "./timeline";
import { speeds } from "./state";
import { formatTime } from "./units";
import type { BranchRun } from "./steer_branch";

const solverSpeeds: [string, string][] = [["", "as fast as it can"], ["0.1", "0.1× real time"], ["0.25", "0.25×"], ["0.5", "0.5×"], ["1", "1×"], ["2", "2×"]];

/// Where branches part, and how far each has come.
function BranchLane(props: { s: SteerState }) {
  const { s } = props;
  const at = (t: number): string => `${Math.min(100, (100 * t) / s.span.value)}%`;
  if (s.branches.value.length < 2) return null;
  return (
    <div class="branch-lane">
      {s.branches.value.map((b) => (
        <button
          type="button"
          class={`branch-bar ${b.id === s.active.value ? "active" : ""}`}
          style={{ marginLeft: at(b.parent === null ? 0 : b.time), width: at(Math.max(0, (b.id === s.active.value ? s.frontier.value : b.frontier) - (b.parent === null ? 0 : b.time))) }}
          title={`${b.name}${b.parent === null ? "" : `, from ${formatTime(b.time)}`}: computed to ${formatTime(b.frontier)}`}
          onClick={() => void s.switchTo(b.id)}
        >
          <span>{b.name}</span>
        </button>
      ))}
    </div>
  );
}

export function SolverClock(props: { s: SteerState }) {
  const { s } = props;
  return (
    <span class="solver-clock">
      <span class="quiet">computed</span> <strong class="number" data-test="frontier">{formatTime(s.frontier.value)}</strong>
    </span>
  );
}

export function SteerTimeline(props: { s: SteerState; view: BranchRun }) {
  const { s } = props;
  const { state } = props.view;
  const phase = s.phase.value;
  const running = phase === "running";
  const following = s.following.value;
  const canRun = phase === "paused" || running;
  return (
    <section class="timeline steer-timeline" aria-label="Timeline">
      <div class="track">
        <Markers state={state} onSeek={s.look} />
        <Slider state={state} onSeek={s.look} />
        <div class="computed" aria-hidden="true"><i style={{ width: `${Math.min(100, (100 * s.frontier.value) / s.span.value)}%` }} /></div>
        <BranchLane s={s} />
      </div>
      <div class="transport">
        <span class="group-word">Run</span>
        <button type="button" class="main-button" disabled={!canRun} data-test="run" title={following ? "Space" : undefined} onClick={() => void s.runOrPause()}>
          {running ? "Pause" : "Run"}
        </button>
        <button type="button" disabled={phase !== "paused"} title="Compute one frame (→ at the frontier)" data-test="step" onClick={() => ((s.following.value = true), void s.ask("step", { frames: 1 }))}>
          Step
        </button>
        <label>
          <span class="quiet">at</span>{" "}
          <select data-test="solver-speed" aria-label="Speed of the run" value={s.progress.value?.speed === null || s.progress.value === null ? "" : String(s.progress.value.speed)}
            onChange={(e) => void s.ask("speed", { factor: e.currentTarget.value === "" ? null : Number(e.currentTarget.value) })}>
            {solverSpeeds.map(([value, word]) => <option value={value}>{word}</option>)}
          </select>
        </label>
        <SolverClock s={s} />
        <span class="divider" />
        <span class="group-word">View</span>
        <IconButton icon="begin" label="To the beginning" keys="Home" onClick={() => s.look(state.begin)} />
        <IconButton icon="eventBack" label="Event before" keys="Shift+←" onClick={() => s.stepEvent(-1)} />
        <IconButton icon="stepBack" label="Frame before" keys="←" onClick={() => s.stepFrame(-1)} />
        <IconButton
          icon={state.playing.value ? "pause" : "play"}
          label={state.playing.value ? "Stop playback" : "Play what is computed"}
          keys="Space in the past"
          test="play"
          onClick={() => {
            if (following) state.seek(state.begin);
            s.following.value = false;
            state.togglePlay();
          }}
        />
        <IconButton icon="step" label="Next frame" keys="→" onClick={() => s.stepFrame(1)} />
        <IconButton icon="event" label="Next event" keys="Shift+→" onClick={() => s.stepEvent(1)} />
        <IconButton icon="end" label="To the end" keys="End" onClick={() => s.look(Infinity)} />
        <select aria-label="Speed of the playback" value={String(state.speed.value)} onChange={(e) => (state.speed.value = Number(e.currentTarget.value))}>
          {speeds.map((speed) => <option value={String(speed)}>{speed}×</option>)}
        </select>
        <button type="button" class={`live ${following ? "on" : ""}`} aria-pressed={following} data-test="live" title="Follow the run (L)" onClick={() => s.goLive()}>
          <span aria-hidden="true">●</span> LIVE
        </button>
        <span class="spring" />
        <Clock state={state} />
        <button type="button" class="icon" aria-label="Keys" title="Keys (?)" onClick={() => (s.helpOpen.value = true)}>?</button>
      </div>
    </section>
  );
}
