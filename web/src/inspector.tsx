import { useMemo } from "preact/hooks";
import { calcPose, findFrame, type Quadruple, type Triple } from "./data";
import { EventSign, ZoneStateWord } from "./signs";
import type { State } from "./state";
import { formatMass, formatNumber, formatTime } from "./units";
import { wordOfKind } from "./vocabulary";
import { findZonesOfBodies } from "./zones";

/// How far a body has turned since the first frame [rad].
function calcTurn(a: Quadruple, b: Quadruple): number {
  const cosine = Math.abs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]);
  return 2 * Math.acos(Math.min(1, cosine));
}

export function Inspector(props: { state: State }) {
  const { state } = props;
  const { run } = state;
  const zonesOfBody = useMemo(() => findZonesOfBodies(run), [run]);
  const index = state.selected.value;
  const body = run.bodies[index];
  if (body === undefined) return null;

  const { frame, fraction } = findFrame(run.time, state.timeSlowly.value);
  const p: Triple = [0, 0, 0], p0: Triple = [0, 0, 0];
  const q: Quadruple = [1, 0, 0, 0], q0: Quadruple = [1, 0, 0, 0];
  const placed = run.time.length > 0 && calcPose(run, index, frame, fraction, p, q) && calcPose(run, index, 0, 0, p0, q0);
  const moved = Math.hypot(p[0] - p0[0], p[1] - p0[1], p[2] - p0[2]);
  const zones = zonesOfBody[index] ?? [];
  const names = new Set([body.name, ...zones.map((z) => run.zones[z]?.name ?? "")]);
  const events = run.events.filter((e) => names.has(e.subject)).slice(0, 20);

  return (
    <aside class="panel inspector" aria-label="Member" data-test="inspector">
      <div class="inspector-head">
        <h2 data-test="member-name" data-name>{body.name}</h2>
        <button type="button" class="close" aria-label="Close" title="Close (Esc)" onClick={() => (state.selected.value = -1)}>
          ×
        </button>
      </div>
      <dl>
        <dt>Kind</dt>
        <dd>{wordOfKind(body.kind)}, storey {body.storey}{body.fixed ? ", fixed to the ground" : ""}</dd>
        <dt>Mass</dt>
        <dd>{formatMass(body.mass)}</dd>
        {placed && (
          <>
            <dt>Moved by</dt>
            <dd>{moved < 0.0005 ? "less than 1 mm" : `${formatNumber(moved, 3)} m`}</dd>
            <dt>Turned by</dt>
            <dd>{((calcTurn(q0, q) * 180) / Math.PI).toFixed(1)}°</dd>
          </>
        )}
      </dl>
      <h3>Zones at {formatTime(state.timeSlowly.value)}</h3>
      {zones.length === 0 && <p class="quiet">This part has no zones: it stays rigid.</p>}
      {zones.map((z) => {
        const zone = run.zones[z];
        if (zone === undefined) return null;
        const now = run.frames[frame];
        const utilisation = now?.utilisation[z] ?? NaN;
        return (
          <div class="zone">
            <p class="zone-head">
              <strong data-name>{zone.name}</strong>
              {now !== undefined && <ZoneStateWord state={now.state[z] as number} />}
            </p>
            <p class="quiet">{zone.subsystem}</p>
            <p class="zone-use">
              <span class="bar"><i class={utilisation > 1 ? "over" : ""} style={{ width: `${Math.min(100, Math.max(0, 100 * (utilisation || 0)))}%` }} /></span>
              <span>utilisation {Number.isFinite(utilisation) ? utilisation.toFixed(2) : "–"}</span>
            </p>
          </div>
        );
      })}
      {events.length > 0 && <h3>Events</h3>}
      {events.map((event) => (
        <button type="button" class="event-link" onClick={() => state.pauseAt(event.time)}>
          <EventSign kind={event.kind} /> <span class="number">{formatTime(event.time)}</span> <span>{event.text}</span>
        </button>
      ))}
    </aside>
  );
}
