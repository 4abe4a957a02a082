import { useComputed } from "@preact/signals";
import type { Run } from "./data";
import { groupEvents } from "./event_groups";
import { EventSign } from "./signs";
import { showStage, type State } from "./state";
import { formatDate, formatDuration, formatMass, formatNumber, formatTime, prettify } from "./units";
import { wordsOfEvent } from "./vocabulary";
import { findBody } from "./zones";

const mostSubjects = 5; // of a group that are named on paper

/// On paper, instead of the list.
function EventGroups(props: { run: Run }) {
  return (
    <div class="event-groups">
      <table>
        <tbody>
          {groupEvents(props.run.events).map((group) => {
            const first = group.events[0] as Run["events"][number];
            const subjects = [...new Set(group.events.map((e) => e.subject).filter((s) => s !== ""))];
            const others = subjects.length - mostSubjects;
            return (
              <tr>
                <td class="number">{group.from === group.to ? formatTime(group.from) : `${formatTime(group.from)} – ${formatTime(group.to)}`}</td>
                <th scope="row"><EventSign kind={group.kind} /> {wordsOfEvent(group.kind).word}</th>
                <td class="number">{group.events.length > 1 && `${group.events.length} ×`}</td>
                <td>
                  {group.events.length === 1 ? first.text || first.subject : <span data-name>{subjects.slice(0, mostSubjects).join(", ")}</span>}
                  {group.events.length > 1 && others > 0 && ` and ${others} more`}
                </td>
              </tr>
            );
          })}
        </tbody>
      </table>
      <p class="quiet">Events of one kind that follow each other are one line here; the record and events.csv have each with its time.</p>
    </div>
  );
}

export function Events(props: { state: State; isPrinted?: boolean }) {
  const { state } = props;
  const { run } = state;
  const count = new Map<string, number>();
  for (const event of run.events) count.set(event.kind, (count.get(event.kind) ?? 0) + 1);
  const hidden = state.hiddenKinds.value;
  const toggle = (kind: string): void => {
    const next = new Set(hidden);
    if (!next.delete(kind)) next.add(kind);
    state.hiddenKinds.value = next;
  };
  // Changes only when an event passes, not with every frame.
  const past = useComputed(() => state.shownEvents.value.filter((e) => e.time <= state.time.value).length).value;
  return (
    <section class="panel events" aria-label="Events">
      <h2>Events</h2>
      {run.events.length === 0 && <p class="quiet">None.</p>}
      {count.size > 1 && (
        <div class="chips" role="group" aria-label="Kinds of events shown">
          {[...count].map(([kind, n]) => (
            <button type="button" class="chip" aria-pressed={!hidden.has(kind)} onClick={() => toggle(kind)}>
              <EventSign kind={kind} /> {wordsOfEvent(kind).word} <span class="number">{n}</span>
            </button>
          ))}
        </div>
      )}
      {props.isPrinted === true && <EventGroups run={run} />}
      <div class="scroller" tabIndex={0} role="region" aria-label="List of events">
        {state.shownEvents.value.map((event, i) => (
          <button
            type="button"
            class={`event-link ${i < past ? "past" : ""}`}
            data-event-time={event.time}
            onClick={() => {
              state.pauseAt(event.time);
              showStage();
              const body = findBody(run, event.subject);
              if (body >= 0) state.selected.value = body;
            }}
          >
            <EventSign kind={event.kind} />
            <span class="number">{formatTime(event.time)}</span>
            <span>{event.text || `${wordsOfEvent(event.kind).word} ${event.subject}`}</span>
          </button>
        ))}
      </div>
    </section>
  );
}

export function PlanValues(props: { run: Run }) {
  const { plan_values, provenance } = props.run;
  const groups = [...new Set(plan_values.map((v) => v.group))];
  return (
    <section class="panel plan-values" aria-label="The plan">
      <h2>The plan</h2>
      {plan_values.length > 0 && (
        <table class="pairs">
          {groups.map((group) => (
            <tbody>
              {group !== "" && (
                <tr>
                  <th class="group" scope="colgroup" colSpan={2}>{group}</th>
                </tr>
              )}
              {plan_values.filter((v) => v.group === group).map((v) => (
                <tr>
                  <th scope="row" data-name>{v.key}</th>
                  <td>{prettify(v.value)}</td>
                </tr>
              ))}
            </tbody>
          ))}
        </table>
      )}
      {plan_values.length === 0 && <p class="quiet">The record holds no key values.</p>}
      {provenance.plan_text !== "" && (
        <details>
          <summary>Text of {provenance.plan_path || "the plan"}</summary>
          <pre class="plan-text" tabIndex={0}>{provenance.plan_text}</pre>
        </details>
      )}
    </section>
  );
}

export function Details(props: { run: Run }) {
  const { provenance: p, counts, time } = props.run;
  const rows: [string, string][] = [
    ["Bodies", String(counts.bodies)],
    ["Revolute joints", String(counts.revolute_joints)],
    ["Rigid joints", String(counts.rigid_joints)],
    ["Force elements", String(counts.force_elements)],
    ["Cables", String(counts.cables)],
    ["Mass that moves", formatMass(counts.mass)],
  ];
  const origin: [string, string][] = [
    ["Plan", p.plan_path || "–"],
    ["SHA-256 of the plan", p.plan_sha256 || "–"],
    ["Program", `topple ${p.program_version}`],
    ["Engine", p.engine || "–"],
    ["Machine", p.machine || "–"],
    ["Created", formatDate(p.created) || "–"],
    ["Seed", p.seed],
    ["Step", p.step === null ? "–" : `${formatNumber(p.step * 1000, 3)} ms`],
    ["Frames of the record", String(time.length)],
    ["Threads", String(p.threads)],
    ["Computing time", formatDuration(p.wall_time)],
  ];
  const table = (list: [string, string][]) => (
    <table class="pairs">
      <tbody>
        {list.map(([key, value]) => (
          <tr>
            <th scope="row">{key}</th>
            <td>{value}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
  return (
    <section class="panel details" aria-label="The calculation">
      <h2>The model</h2>
      {table(rows)}
      <h2>Where this comes from</h2>
      {table(origin)}
    </section>
  );
}
