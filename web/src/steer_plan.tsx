/// The plan's text with its complaints beside it; a click on one goes to its place.
import { useEffect, useRef, useState } from "preact/hooks";
import { CommandError } from "./steer_connection";
import type { SteerState } from "./steer_state";
import type { Branch, BranchPlan, Diagnostic, PlanCheck } from "./steer_wire";
import { prettify } from "./units";

const lineHeight = 18;

export function Diagnostics(props: { list: Diagnostic[]; onJump?: (d: Diagnostic) => void }) {
  if (props.list.length === 0) return null;
  return (
    <ul class="diagnostics">
      {props.list.map((d) => (
        <li class={d.severity === "error" ? "bad" : "warning"}>
          <button type="button" class="plain" data-test="diagnostic" disabled={props.onJump === undefined} onClick={() => props.onJump?.(d)}>
            <strong>{d.severity === "error" ? "✖ Error" : "⚠ Warning"} {d.code}</strong> {d.line > 0 ? `line ${d.line}, column ${d.column}: ` : ""}{d.message}
            {d.help !== undefined && d.help !== "" && <span class="quiet"> {d.help}</span>}
          </button>
        </li>
      ))}
    </ul>
  );
}

export const countOf = (check: PlanCheck | null, severity: "error" | "warning"): number =>
  check?.diagnostics.filter((d) => (d.severity === "error") === (severity === "error")).length ?? 0;

/// Where a line and a column (from 1) stand in a text.
export function findOffset(text: string, line: number, column: number): number {
  let at = 0;
  for (let k = 1; k < line; ++k) {
    const next = text.indexOf("\n", at);
    if (next < 0) return text.length;
    at = next + 1;
  }
  return Math.min(text.length, at + Math.max(0, column - 1));
}

/// The active branch's plan with its edits, asked for anew after each action.
export function useBranchPlan(s: SteerState): BranchPlan | null {
  const [plan, setPlan] = useState<BranchPlan | null>(null);
  const branch = s.active.value;
  const actions = s.log.value.filter((e) => e.action !== "reached").length;
  useEffect(() => {
    let over = false;
    if (branch !== 0)
      s.connection.command<BranchPlan>("plan.text", { branch, edits: true }).then((r) => over || setPlan(r)).catch(() => undefined);
    return () => {
      over = true;
    };
  }, [branch, actions]);
  return plan;
}

export function EditList(props: { title: string; list: string[]; test: string }) {
  if (props.list.length === 0) return null;
  return (
    <div data-test={props.test}>
      <p>{props.title}</p>
      <ul>{props.list.map((text) => <li>{prettify(text)}</li>)}</ul>
    </div>
  );
}

/// What became of a file of another program.
function Imported(props: { s: SteerState }) {
  const made = props.s.imported.value;
  if (made === null) return null;
  return (
    <section data-test="imported" aria-label={`From ${made.name}`}>
      <div class="inspector-head"><h2>From {made.name}</h2><button type="button" class="small" aria-label="Put this list away" onClick={() => (props.s.imported.value = null)}>×</button></div>
      <EditList title="Missing: gaps are marked “?”." list={made.missing} test="missing" />
      <EditList title="Guessed; look at it:" list={made.guessed} test="guessed" />
      <EditList title="Taken:" list={made.taken} test="taken" />
    </section>
  );
}

export function PlanEditor(props: { s: SteerState }) {
  const { s } = props;
  const area = useRef<HTMLTextAreaElement>(null);
  const gutter = useRef<HTMLPreElement>(null);
  const text = s.editedText.value ?? s.plan.value.text;
  const check = s.planCheck.value;
  const changed = s.editedText.value !== null && s.editedText.value !== s.plan.value.text;
  const branchPlan = useBranchPlan(s);

  useEffect(() => {
    const timer = setTimeout(() => {
      void s.connection.command<PlanCheck>("plan.check", { text }).then((r) => {
        if ((s.editedText.peek() ?? s.plan.peek().text) === text) s.planCheck.value = r;
      }).catch(() => undefined);
    }, 300);
    return () => clearTimeout(timer);
  }, [text]);

  const jump = (d: Diagnostic): void => {
    const e = area.current;
    if (e === null) return;
    const begin = findOffset(text, d.line, d.column);
    e.focus();
    e.setSelectionRange(begin, begin + Math.max(1, d.width ?? 1));
    e.scrollTop = Math.max(0, (d.line - 4) * lineHeight);
  };
  const save = async (): Promise<void> => {
    if (s.plan.value.path === "") {
      s.dialog.value = { kind: "save", text };
      return;
    }
    try {
      await s.savePlan({ text, base_sha256: s.planBase() });
      s.notify("good", `Saved ${s.plan.value.path}.`);
    } catch (error) {
      if (error instanceof CommandError && error.error.code === "E941")
        s.dialog.value = { kind: "conflict", text, disk: String(error.error["text"] ?? ""), sha256: String(error.error["sha256"] ?? "") };
      else s.complain(error);
    }
  };
  const addSite = async (file: File | undefined): Promise<void> => {
    if (file === undefined) return;
    try {
      const more = await s.importFile(file);
      s.editedText.value = `${text}${text.endsWith("\n") ? "" : "\n"}\n${more}`;
    } catch (error) {
      s.complain(error);
    }
  };
  const apply = async (): Promise<void> => {
    try {
      const r = await s.connection.command<{ branch: Branch | number }>("plan.apply", { text, name: `plan ${s.branches.value.length}` });
      await s.arrive(r.branch, "The plan was built.");
    } catch (error) {
      if (error instanceof CommandError && error.error.diagnostics !== undefined)
        s.planCheck.value = { title: "", notes: [], ...check, diagnostics: error.error.diagnostics };
      s.complain(error);
    }
  };

  const errors = countOf(check, "error"), warnings = countOf(check, "warning");
  const lines = text.split("\n").length;
  const bad = new Map(check?.diagnostics.map((d) => [d.line, d.severity]));
  return (
    <div class="plan-editor">
      <div class="editor-bar">
        <span>{s.plan.value.path}{changed ? " · changed" : ""}</span>
        <span class={errors > 0 ? "bad-word" : "quiet"} data-test="check-count">✖ {errors} {errors === 1 ? "error" : "errors"}</span>
        <span class={warnings > 0 ? "warning-word" : "quiet"}>⚠ {warnings} {warnings === 1 ? "warning" : "warnings"}</span>
        <span class="spring" />
        <label class="button file-button" title="Neighbours and utilities out of a drawing, behind the text">
          Add a site (DXF)…
          <input type="file" accept=".dxf" data-test="import-site" onChange={(e) => void addSite(e.currentTarget.files?.[0])} />
        </label>
        {branchPlan !== null && branchPlan.taken.length + branchPlan.left_out.length > 0 && (
          <button type="button" disabled={changed || branchPlan.taken.length === 0} data-test="edits-text" title="Writes the edits of this branch into the text, to be looked at and saved" onClick={() => (s.editedText.value = branchPlan.text)}>
            Edits of the branch as text
          </button>
        )}
        <button type="button" class="main-button" disabled={errors > 0} data-test="apply" title="Builds this text and runs it from time 0, as a branch of its own" onClick={() => void apply()}>Run as a new branch</button>
        <button type="button" disabled={!changed} data-test="save" onClick={() => void save()}>Save to the file</button>
        <button type="button" disabled={!changed} onClick={() => (s.editedText.value = null)}>Discard</button>
      </div>
      {check?.removes_support === false && <p class="problem" data-test="dead-plan">Nothing in this plan removes a support; the building will stand.</p>}
      <div class="editor-body">
        <pre class="gutter" ref={gutter} aria-hidden="true">
          {Array.from({ length: lines }, (_, k) => (
            <span class={bad.has(k + 1) ? (bad.get(k + 1) === "error" ? "bad-line" : "warning-line") : ""}>{k + 1}{"\n"}</span>
          ))}
        </pre>
        <textarea
          ref={area} data-test="plan-text" aria-label="Text of the plan" spellcheck={false} wrap="off" value={text}
          onInput={(e) => (s.editedText.value = e.currentTarget.value)}
          onScroll={(e) => {
            if (gutter.current !== null) gutter.current.scrollTop = e.currentTarget.scrollTop;
          }}
        />
        <div class="editor-side">
          <Imported s={s} />
          <Diagnostics list={check?.diagnostics ?? []} onJump={jump} />
          {check !== null && check.diagnostics.length === 0 && <p class="quiet">No complaints.</p>}
          {check?.notes.map((n) => <p class="quiet">{prettify(n)}</p>)}
          <EditList title="Edits of the branch that no plan can say:" list={branchPlan?.left_out ?? []} test="left-out" />
        </div>
      </div>
    </div>
  );
}
