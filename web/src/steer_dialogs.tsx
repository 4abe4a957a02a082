/// Forms for what can be changed. Values carry their unit here and are SI on the wire.
import { useLayoutEffect, useRef, useState } from "preact/hooks";
import type { ComponentChildren } from "preact";
import { CommandError } from "./steer_connection";
import type { Dialog, SteerState } from "./steer_state";
import { formatTime } from "./units";
import { OpenPlan } from "./steer_welcome";

interface Field {
  key: string;
  label: string;
  unit?: string;
  factor?: number; // SI of one of `unit`
  value: string;
  member?: boolean;
  optional?: boolean;
  help?: string;
}

interface FormProps {
  s: SteerState;
  title: string;
  note?: ComponentChildren;
  fields: Field[];
  action: string;
  /// What it throws is shown in the form.
  onDone: (values: Record<string, number | string | undefined>) => Promise<unknown>;
}

/// The form that closes has done its work: then the picture takes the keyboard, not the button that opened it.
let isDone = false;

function Form(props: FormProps) {
  const { s } = props;
  const [values, setValues] = useState<Record<string, string>>(Object.fromEntries(props.fields.map((f) => [f.key, f.value])));
  const [problem, setProblem] = useState("");
  const [busy, setBusy] = useState(false);
  const submit = async (): Promise<void> => {
    const out: Record<string, number | string | undefined> = {};
    for (const f of props.fields) {
      const text = (values[f.key] ?? "").trim();
      if (f.unit === undefined) {
        if (text === "" && f.optional !== true) return setProblem(`${f.label} is missing.`);
        out[f.key] = text;
        continue;
      }
      if (text === "" && f.optional === true) continue;
      const number = Number(text.replace(",", "."));
      if (text === "" || !Number.isFinite(number)) return setProblem(`${f.label}: “${text}” is not a number.`);
      out[f.key] = number * (f.factor ?? 1);
    }
    setProblem("");
    setBusy(true);
    try {
      await props.onDone(out);
      isDone = true;
      s.dialog.value = null;
    } catch (error) {
      setProblem(error instanceof CommandError ? `${error.error.message} ${error.error.help ?? ""}` : String(error));
    }
    setBusy(false);
  };
  return (
    <form
      onSubmit={(e) => {
        e.preventDefault();
        void submit();
      }}
    >
      <h2>{props.title}</h2>
      {props.note}
      {props.fields.map((f) => (
        <label class="field">
          <span>{f.label}</span>
          <span>
            <input
              name={f.key} value={values[f.key]} autocomplete="off" list={f.member === true ? "member-names" : undefined}
              inputMode={f.unit === undefined ? "text" : "decimal"}
              onInput={(e) => setValues({ ...values, [f.key]: e.currentTarget.value })}
            />{" "}
            {f.unit}
          </span>
          {f.help !== undefined && <span class="quiet field-help">{f.help}</span>}
        </label>
      ))}
      {problem !== "" && <p class="problem" role="alert">{problem}</p>}
      <div class="dialog-buttons">
        <button type="submit" class="main-button" disabled={busy} data-test="submit">{props.action}</button>
        <button type="button" onClick={() => (s.dialog.value = null)}>Cancel</button>
      </div>
    </form>
  );
}

function Where(props: { s: SteerState }) {
  const { s } = props;
  return (
    <p class="quiet">
      Acts at {formatTime(s.editTime.value)}{s.following.value ? ", the frontier of the run" : ", where you look"}. What is computed stays as it is: if
      there is something after that moment, a new branch is made.
    </p>
  );
}

const memberField = (value: string): Field => ({ key: "member", label: "Member", value, member: true });

function Content(props: { s: SteerState; dialog: Dialog }) {
  const { s, dialog } = props;
  const note = <Where s={s} />;
  switch (dialog.kind) {
    case "delay":
      return (
        <Form s={s} title={dialog.title} note={note} action="Change"
          fields={[{ key: "time", label: "Fires at", unit: "s", value: String(Number(dialog.time.toFixed(6))), help: "time of the simulation" }]}
          onDone={(v) => s.tryEdit("set_delay", { ...(dialog.charge !== undefined ? { charge: dialog.charge } : { stage: dialog.stage }), time: v["time"] })} />
      );
    case "charge":
      return (
        <Form s={s} title="Add a charge" note={note} action="Add"
          fields={[
            memberField(dialog.member),
            { key: "position", label: "Position", unit: "m", value: "1.1", help: "middle of the destroyed length, from the member's start" },
            { key: "destroyed_length", label: "Destroyed length", unit: "m", value: "1.5" },
            { key: "residual_bars", label: "Bars that stay", unit: "%", factor: 0.01, value: "10" },
            { key: "residual_concrete", label: "Concrete that stays", unit: "%", factor: 0.01, value: "0", help: "0: all of it is thrown out" },
            { key: "transition_damage", label: "Damage beside it", unit: "%", factor: 0.01, value: "20" },
            { key: "time", label: "Fires at", unit: "s", value: "", optional: true, help: "empty: now" },
          ]}
          onDone={(v) => s.tryEdit("add_charge", v)} />
      );
    case "pre_cut":
      return (
        <Form s={s} title="Cut a member" note={note} action="Cut"
          fields={[
            memberField(dialog.member),
            { key: "at", label: "At", unit: "m", value: "0", help: "from the member's start" },
            { key: "cut_bars", label: "Bars cut", unit: "%", factor: 0.01, value: "50" },
            { key: "cut_concrete", label: "Section taken out", unit: "%", factor: 0.01, value: "30" },
          ]}
          onDone={(v) => s.tryEdit("add_pre_cut", v)} />
      );
    case "cable":
      return (
        <Form s={s} title="Add a cable" note={note} action="Add"
          fields={[
            memberField(dialog.member),
            { key: "position", label: "Position", unit: "m", value: "2", help: "from the member's start" },
            { key: "x", label: "Anchor x", unit: "m", value: "-40" },
            { key: "y", label: "Anchor y", unit: "m", value: "10" },
            { key: "z", label: "Anchor z", unit: "m", value: "0" },
            { key: "stiffness", label: "Stiffness", unit: "MN/m", factor: 1e6, value: "2" },
            { key: "pretension", label: "Pretension", unit: "kN", factor: 1e3, value: "100" },
            { key: "strength", label: "Strength", unit: "kN", factor: 1e3, value: "", optional: true, help: "empty: it does not break" },
          ]}
          onDone={({ x, y, z, ...v }) => s.tryEdit("add_cable", { ...v, anchor: [x, y, z] })} />
      );
    case "friction": {
      const now = s.branch.value?.friction;
      return (
        <Form s={s} title="Friction" note={note} action="Change"
          fields={[
            { key: "ground", label: "On the ground", unit: " ", value: String(now?.ground ?? 0.6) },
            { key: "bodies", label: "Between bodies", unit: " ", value: String(now?.bodies ?? 0.6) },
          ]}
          onDone={(v) => s.tryEdit("set_friction", v)} />
      );
    }
    case "branch":
      return (
        <Form s={s} title="Branch" action="Make it"
          note={<p class="quiet">A new branch from {formatTime(s.editTime.value)}. The one it parts from stays as it is.</p>}
          fields={[{ key: "name", label: "Name", value: `what-if ${s.branches.value.length}` }]}
          onDone={(v) => s.makeBranch(String(v["name"]))} />
      );
    case "rename":
      return (
        <Form s={s} title="Rename the branch" action="Rename" fields={[{ key: "name", label: "Name", value: dialog.name }]}
          onDone={(v) => s.connection.command("rename", { branch: dialog.branch, name: v["name"] })} />
      );
    case "save":
      return (
        <Form s={s} title="Save the plan" action="Save" note={<p class="quiet">This plan has no file yet. It goes into the folder that the server was started for.</p>}
          fields={[{ key: "path", label: "Name of the file", value: "plan.toml" }]}
          onDone={async (v) => {
            await s.savePlan({ text: dialog.text, path: String(v["path"]) });
            s.notify("good", `Saved ${v["path"]}.`);
          }} />
      );
    case "conflict":
      return (
        <div data-test="conflict">
          <h2>The file has changed on the disk</h2>
          <p>Someone has written {s.plan.value.path || "the plan"} since this text was read. Which one is to stay?</p>
          <div class="dialog-buttons">
            <button type="button" class="main-button" data-test="keep-disk"
              onClick={() => {
                s.plan.value = { ...s.plan.value, text: dialog.disk, sha256: dialog.sha256 };
                s.editedText.value = null;
                s.dialog.value = null;
              }}>
              Take the one on the disk
            </button>
            <button type="button" data-test="overwrite" onClick={() => void s.savePlan({ text: dialog.text, base_sha256: dialog.sha256, force: true }).then(() => {
              s.dialog.value = null;
              s.notify("good", "Saved over the one on the disk.");
            }, s.complain)}>
              Save mine over it
            </button>
            <button type="button" onClick={() => (s.dialog.value = null)}>Neither yet</button>
          </div>
          <details><summary>The one on the disk</summary><pre class="plan-text" tabIndex={0}>{dialog.disk}</pre></details>
        </div>
      );
    case "open":
      return <OpenPlan s={s} onCancel={() => (s.dialog.value = null)} />;
  }
}

export function Dialogs(props: { s: SteerState }) {
  const { s } = props;
  const dialog = s.dialog.value;
  const element = useRef<HTMLDialogElement>(null);
  useLayoutEffect(() => {
    const e = element.current;
    if (e === null) return;
    if (dialog !== null && !e.open) e.showModal();
    if (dialog !== null || !e.open) return;
    e.close();
    if (isDone) document.querySelector<HTMLElement>("[data-test=canvas]")?.focus();
    isDone = false;
  }, [dialog]);
  return (
    <dialog ref={element} class={`help ${dialog?.kind === "open" ? "wide" : ""}`} aria-label="Change" data-test="dialog" onClose={() => (s.dialog.value = null)}>
      {dialog !== null && <Content key={dialog.kind} s={s} dialog={dialog} />}
    </dialog>
  );
}

export function Notices(props: { s: SteerState }) {
  const { s } = props;
  return (
    <div class="notices" role="status" aria-live="polite">
      {s.notices.value.map((n) => (
        <div class={`notice ${n.status}`} data-test="notice">
          <div><p>{n.text}</p>{n.help !== undefined && <p class="quiet">{n.help}</p>}</div>
          <button type="button" class="close" aria-label="Dismiss" onClick={() => s.dismiss(n.id)}>×</button>
        </div>
      ))}
    </div>
  );
}
