/// Left side: branches, what is fired and when, preparation, storeys; edits start here.
import { useState } from "preact/hooks";
import { Sign } from "./signs";
import type { SteerState } from "./steer_state";
import type { Branch, Charge, Stage } from "./steer_wire";
import { formatNumber, formatTime, prettify } from "./units";

function BranchRows(props: { s: SteerState; parent: number | null; depth: number }) {
  const { s } = props;
  const ids = new Set(s.branches.value.map((b) => b.id));
  const here = s.branches.value.filter((b) => (b.parent === null || !ids.has(b.parent) ? null : b.parent) === props.parent);
  return (
    <>
      {here.map((b) => (
        <>
          <li class={`branch-row ${b.id === s.active.value ? "active" : ""}`} style={{ paddingLeft: `${12 * props.depth}px` }}>
            <button type="button" class="plain grow" aria-current={b.id === s.active.value} data-test="branch" title={b.notes.map(prettify).join("\n")} onClick={() => void s.switchTo(b.id)}>
              {props.depth > 0 && <span aria-hidden="true">└ </span>}
              <strong>{b.name}</strong>
              <span class="quiet">{b.parent === null ? "" : ` from ${formatTime(b.time)}`}{b.sample !== undefined && b.sample !== null ? `, ${b.sample}` : ""}</span>
            </button>
            {s.branches.value.length > 1 && b.id !== s.active.value && (
              <button type="button" class="small" title={`Compare with ${s.branch.value?.name ?? "the active branch"}`} data-test="compare" onClick={() => void s.compare(s.active.value, b.id)}>
                Compare
              </button>
            )}
            <button type="button" class="small" aria-label={`Rename ${b.name}`} title="Rename" onClick={() => (s.dialog.value = { kind: "rename", branch: b.id, name: b.name })}>
              ✎
            </button>
          </li>
          <BranchRows s={s} parent={b.id} depth={props.depth + 1} />
        </>
      ))}
    </>
  );
}

const stateOfCharge = (c: Charge): string => (c.removed ? "taken out" : c.fails ? "will fail" : c.fired ? "fired" : formatTime(c.time));

function StageRows(props: { s: SteerState; stage: Stage; charges: Charge[] }) {
  const { s, stage, charges } = props;
  const [open, setOpen] = useState(false);
  const waiting = charges.filter((c) => !c.fired && !c.removed);
  return (
    <li>
      <div class="stage-row">
        <button type="button" class="plain grow" aria-expanded={open} onClick={() => setOpen(!open)}>
          <span aria-hidden="true">{open ? "▾" : "▸"} </span>
          <strong>{stage.name}</strong>
          <span class="quiet"> {charges.length} {charges.length === 1 ? "charge" : "charges"}{waiting.length < charges.length ? `, ${charges.length - waiting.length} done` : ""}</span>
        </button>
        <span class="number">{formatTime(stage.time)}</span>
        {waiting.length > 0 && (
          <button type="button" class="small" data-test={`delay-stage-${stage.index}`}
            onClick={() => (s.dialog.value = { kind: "delay", stage: stage.index, time: stage.time, title: `When ${stage.name} fires` })}>
            Edit
          </button>
        )}
      </div>
      {open && (
        <ul class="charge-list">
          {charges.map((c) => (
            <li class="stage-row">
              <button type="button" class="plain grow" onClick={() => (s.selected.value = s.view.value?.run.bodies.findIndex((b) => b.name === c.member) ?? -1)}>
                <Sign shape="star" colour={c.fired || c.removed ? "var(--text-quiet)" : "#e0218a"} /> {c.member}
              </button>
              <span class="number quiet">{stateOfCharge(c)}</span>
              {!c.fired && !c.removed && (
                <span class="small-group">
                  <button type="button" class="small" title="Change when it fires" onClick={() => (s.dialog.value = { kind: "delay", charge: c.index, time: c.time, title: `When the charge in ${c.member} fires` })}>Edit</button>
                  <button type="button" class="small" title="Fire now" data-test="fire" onClick={() => void s.edit("fire", { charge: c.index })}>Fire</button>
                  <button type="button" class="small" title="Take this charge out" data-test="remove-charge" onClick={() => void s.edit("remove_charge", { charge: c.index })} aria-label={`Take out the charge in ${c.member}`}>×</button>
                </span>
              )}
            </li>
          ))}
        </ul>
      )}
    </li>
  );
}

function Charges(props: { s: SteerState; branch: Branch }) {
  const { s, branch } = props;
  const charges = s.charges.value;
  const rest = charges.filter((c) => !branch.stages.some((st) => st.index === c.stage));
  return (
    <details open>
      <summary>Charges</summary>
      <ul class="plain-list">
        {branch.stages.map((stage) => (
          <StageRows s={s} stage={stage} charges={charges.filter((c) => c.stage === stage.index)} />
        ))}
        {rest.length > 0 && <StageRows s={s} stage={{ index: -1, name: "Added", time: rest[0]?.time ?? 0 }} charges={rest} />}
      </ul>
      {charges.length === 0 && <p class="quiet">None: nothing removes a support.</p>}
      <button type="button" class="small" data-test="add-charge" onClick={() => (s.dialog.value = { kind: "charge", member: selectedMember(s) })}>Add a charge…</button>
    </details>
  );
}

export function selectedMember(s: SteerState): string {
  return s.view.value?.run.bodies[s.selected.value]?.name ?? "";
}

/// Of a branch: its own pre-cuts, and those that the branches it comes from had when it left them.
export function listCuts(branches: Branch[], branch: Branch): Branch["edits"] {
  const own = branch.edits.filter((e) => e.kind.includes("cut"));
  const parent = branches.find((b) => b.id === branch.parent);
  return parent === undefined ? own : [...listCuts(branches, parent).filter((e) => e.time <= branch.time), ...own];
}

function Preparation(props: { s: SteerState; branch: Branch }) {
  const { s, branch } = props;
  const cuts = listCuts(s.branches.value, branch);
  return (
    <>
      <details open>
        <summary>Cables, pre-cuts, friction</summary>
        <ul class="plain-list">
          {branch.cables.map((c) => (
            <li class="stage-row">
              <span class="grow">{c.name}{c.body === "" ? "" : ` to ${typeof c.body === "number" ? (s.view.value?.run.bodies[c.body]?.name ?? c.body) : c.body}`}</span>
              <span class="number quiet">{`${formatNumber((c.force ?? c.pretension ?? NaN) / 1000, 3)} kN`}</span>
              {c.let_go ? <span class="quiet">let go</span> : <button type="button" class="small" aria-label={`Let ${c.name} go`} title="Let it go" data-test="remove-cable" onClick={() => void s.edit("remove_cable", { cable: c.name })}>×</button>}
            </li>
          ))}
          {cuts.map((e) => <li>{prettify(e.text)}</li>)}
          <li class="stage-row">
            <span class="grow">Friction</span>
            <span class="number quiet" title="on the ground / between bodies">{formatNumber(branch.friction.ground, 2)} / {formatNumber(branch.friction.bodies, 2)}</span>
            <button type="button" class="small" data-test="friction" onClick={() => (s.dialog.value = { kind: "friction" })}>Edit</button>
          </li>
        </ul>
        <span class="small-group">
          <button type="button" class="small" data-test="add-cable" onClick={() => (s.dialog.value = { kind: "cable", member: selectedMember(s) })}>Add a cable…</button>
          <button type="button" class="small" data-test="add-cut" onClick={() => (s.dialog.value = { kind: "pre_cut", member: selectedMember(s) })}>Cut a member…</button>
        </span>
      </details>
      {branch.edits.length > 0 && (
        <details open>
          <summary>Edits of this branch</summary>
          <ul class="plain-list" data-test="edits">
            {branch.edits.map((e) => <li><span class="number quiet">{formatTime(e.time)}</span> {prettify(e.text)}</li>)}
          </ul>
        </details>
      )}
    </>
  );
}

function Storeys(props: { s: SteerState }) {
  const { s } = props;
  const run = s.view.value?.run;
  if (run === undefined) return null;
  const storeys = [...new Set(run.bodies.map((b) => b.storey))].sort((a, b) => b - a);
  const hidden = s.hiddenStoreys.value;
  const toggle = (storey: number): void => {
    const next = new Set(hidden);
    if (!next.delete(storey)) next.add(storey);
    s.hiddenStoreys.value = next;
  };
  return (
    <details open>
      <summary>Storeys</summary>
      <div class="storeys" role="group" aria-label="Storeys shown">
        {storeys.map((storey) => (
          <label class="check">
            <input type="checkbox" checked={!hidden.has(storey)} onChange={() => toggle(storey)} /> {storey}
          </label>
        ))}
        {hidden.size > 0 && <button type="button" class="small" onClick={() => (s.hiddenStoreys.value = new Set())}>All</button>}
      </div>
    </details>
  );
}

export function Tree(props: { s: SteerState }) {
  const { s } = props;
  const branch = s.branch.value;
  const holding = s.holding.value;
  const run = s.view.value?.run;
  return (
    <nav class="tree" aria-label="Model and plan">
      <details open>
        <summary>Branches</summary>
        <ul class="plain-list">
          <BranchRows s={s} parent={null} depth={0} />
        </ul>
        <span class="small-group">
          <button type="button" class="small" title="Branch at the view (B)" data-test="new-branch" onClick={() => (s.dialog.value = { kind: "branch" })}>Branch here…</button>
          <button type="button" class="small" title="Take back the last edit (Ctrl+Z)" data-test="undo" onClick={() => void s.undo()}>Undo</button>
        </span>
      </details>
      {holding !== undefined && <Charges s={s} branch={holding} />}
      {branch !== undefined && <Preparation s={s} branch={branch} />}
      <Storeys s={s} />
      {run !== undefined && (
        <details>
          <summary>Model</summary>
          <dl class="pairs-list">
            <dt>Bodies</dt><dd>{run.bodies.length}</dd>
            <dt>Zones</dt><dd>{run.zones.length}</dd>
            <dt>Joints</dt><dd>{run.counts.revolute_joints + run.counts.rigid_joints}</dd>
            <dt>Force elements</dt><dd>{run.counts.force_elements}</dd>
          </dl>
        </details>
      )}
    </nav>
  );
}
