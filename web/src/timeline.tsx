import { useMemo, useState } from "preact/hooks";
import type { RunEvent } from "./data";
import { EventSign } from "./signs";
import { speeds, type State } from "./state";
import { say } from "./translate";
import { formatTime } from "./units";
import { wordsOfEvent } from "./vocabulary";

interface Marker {
  at: number; // 0..1
  lane: 0 | 1;
  kind: string;
  events: RunEvent[];
}

/// Events so near to each other that their signs would touch share one.
function makeMarkers(state: State): Marker[] {
  const span = state.span.value - state.begin;
  const markers: Marker[] = [];
  for (const event of state.shownEvents.value) {
    if (event.time < state.begin || event.time > state.span.value) continue;
    const at = span > 0 ? (event.time - state.begin) / span : 0;
    const lane = wordsOfEvent(event.kind).small ? 1 : 0;
    const near = markers.find((m) => m.lane === lane && m.kind === event.kind && at - m.at < 0.012);
    if (near !== undefined) near.events.push(event);
    else markers.push({ at, lane, kind: event.kind, events: [event] });
  }
  return markers;
}

function describe(marker: Marker): string[] {
  const lines = marker.events.slice(0, 8).map((e) => `${formatTime(e.time)}  ${e.text || wordsOfEvent(e.kind).word}`);
  if (marker.events.length > 8) lines.push(say(`and ${marker.events.length - 8} more`));
  return lines;
}

export function Markers(props: { state: State; onSeek: (time: number) => void }) {
  const { state } = props;
  const [open, setOpen] = useState<Marker>();
  const events = state.shownEvents.value;
  const span = state.span.value;
  const markers = useMemo(() => makeMarkers(state), [events, span]);
  return (
    <div class="markers">
      {markers.map((marker) => (
        <button
          type="button"
          class={`marker lane-${marker.lane}`}
          style={{ left: `${100 * marker.at}%` }}
          aria-label={describe(marker).join("; ")}
          onClick={() => props.onSeek(marker.events[0]?.time ?? state.begin)}
          onPointerEnter={() => setOpen(marker)}
          onPointerLeave={() => setOpen(undefined)}
          onFocus={() => setOpen(marker)}
          onBlur={() => setOpen(undefined)}
        >
          <EventSign kind={marker.kind} size={marker.lane === 0 ? 14 : 9} />
        </button>
      ))}
      {open !== undefined && (
        <div class={`tooltip ${open.at > 0.5 ? "left" : ""}`} role="tooltip" style={{ left: `${100 * open.at}%` }}>
          {describe(open).map((line) => (
            <p>{line}</p>
          ))}
        </div>
      )}
    </div>
  );
}

const icons = {
  live: "M8 3a5 5 0 1 0 .01 0z",
  record: "M8 3a5 5 0 1 0 .01 0z",
  begin: "M3 2h2v12H3zM14 2v12L5.5 8z",
  eventBack: "M8 2v12L1 8zM15 2v12L8 8z",
  stepBack: "M11 2v12L3 8zM12 2h1.6v12H12z",
  play: "M3.5 1.5v13L14 8z",
  pause: "M3 2h3.6v12H3zM9.4 2H13v12H9.4z",
  step: "M5 2v12l8-6zM2.4 2H4v12H2.4z",
  event: "M8 2v12l7-6zM1 2v12l7-6z",
  end: "M11 2h2v12h-2zM2 2v12l8.5-6z",
};

export function IconButton(props: { icon: keyof typeof icons; label: string; keys: string; main?: boolean; test?: string; onClick: () => void }) {
  return (
    <button
      type="button"
      class={props.main === true ? "icon main" : "icon"}
      aria-label={props.label}
      title={`${props.label} (${props.keys})`}
      data-test={props.test}
      onClick={props.onClick}
    >
      <svg width="14" height="14" viewBox="0 0 16 16" aria-hidden="true">
        <path d={icons[props.icon]} fill="currentColor" />
      </svg>
    </button>
  );
}

// Slider and clock follow the time on their own and slowly, so that the rest stands still while playing.
export function Slider(props: { state: State; onSeek: (time: number) => void }) {
  const { state } = props;
  return (
    <input
      type="range"
      data-test="slider"
      aria-label="Time"
      aria-valuetext={formatTime(state.timeSlowly.value)}
      min={state.begin}
      max={state.span.value}
      step="any"
      value={state.timeSlowly.value}
      disabled={state.run.time.length < 2}
      onInput={(e) => props.onSeek(e.currentTarget.valueAsNumber)}
    />
  );
}

export function Clock(props: { state: State }) {
  const { state } = props;
  void state.grownSlowly.value;
  const frames = state.run.time.length;
  return (
    <span class="clock">
      <strong data-test="time">{formatTime(state.timeSlowly.value)}</strong> of {formatTime(state.end.peek())}
      <span class="quiet">
        {" "}
        · frame {frames === 0 ? 0 : state.frame.value + 1} of {frames}
      </span>
    </span>
  );
}

export function Timeline(props: { state: State }) {
  const { state } = props;
  const playing = state.playing.value;
  return (
    <section class="panel timeline" aria-label="Timeline">
      <div class="track">
        <Markers state={state} onSeek={state.pauseAt} />
        <Slider state={state} onSeek={state.pauseAt} />
      </div>
      <div class="transport">
        <IconButton icon="begin" label="To the beginning" keys="Home" onClick={() => state.pauseAt(state.begin)} />
        <IconButton icon="eventBack" label="Event before" keys="Shift+←" onClick={() => state.stepEvent(-1)} />
        <IconButton icon="stepBack" label="Frame before" keys="←" onClick={() => state.stepFrame(-1)} />
        <IconButton
          icon={playing ? "pause" : "play"}
          label={playing ? "Pause" : "Play"}
          keys="Space"
          main
          test="play"
          onClick={() => state.togglePlay()}
        />
        <IconButton icon="step" label="Next frame" keys="→" onClick={() => state.stepFrame(1)} />
        <IconButton icon="event" label="Next event" keys="Shift+→" onClick={() => state.stepEvent(1)} />
        <IconButton icon="end" label="To the end" keys="End" onClick={() => state.pauseAt(state.end.value)} />
        <label>
          Speed{" "}
          <select value={String(state.speed.value)} onChange={(e) => (state.speed.value = Number(e.currentTarget.value))}>
            {speeds.map((speed) => (
              <option value={String(speed)}>{`${speed}×`}</option>
            ))}
          </select>
        </label>
        <span class="spring" />
        <Clock state={state} />
        <button type="button" class="icon" aria-label="Keys" title="Keys (?)" onClick={() => (state.helpOpen.value = true)}>
          ?
        </button>
      </div>
    </section>
  );
}
