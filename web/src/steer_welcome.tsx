/// Nothing open yet, or another plan to open beside: plans of the folder, templates, a text from elsewhere.
import { useEffect, useState } from "preact/hooks";
import { CommandError, type ErrorObject } from "./steer_connection";
import { Diagnostics } from "./steer_plan";
import type { SteerState } from "./steer_state";

interface Template {
  name: string;
  title: string;
  description?: string;
  text: string;
}

export function OpenPlan(props: { s: SteerState; onCancel?: () => void }) {
  const { s } = props;
  const [plans, setPlans] = useState<{ folder: string; plans: { path: string; title: string }[] }>();
  const [templates, setTemplates] = useState<Template[]>();
  const [demo, setDemo] = useState<{ title: string } | null>(null);
  const [problem, setProblem] = useState<ErrorObject>();
  const [busy, setBusy] = useState(false);
  useEffect(() => {
    const read = async <T,>(path: string, use: (value: T) => void): Promise<void> => {
      const response = await fetch(path);
      if (response.ok) use((await response.json()) as T);
      else throw new Error(`${path}: ${response.status}`);
    };
    read("api/plans", setPlans).catch(s.complain);
    read<{ templates: Template[]; demo?: { title: string } | null }>("api/templates", (r) => {
      setTemplates(r.templates);
      setDemo(r.demo ?? null);
    }).catch(s.complain);
  }, []);
  const open = async (keys: Record<string, unknown>): Promise<void> => {
    setBusy(true);
    setProblem(await s.openSession(keys));
    setBusy(false);
  };
  const take = async (file: File | undefined): Promise<void> => {
    if (file === undefined) return;
    setProblem(undefined);
    if (!/\.ifc$/i.test(file.name)) return open({ text: await file.text(), title: file.name });
    setBusy(true);
    try {
      await open({ text: await s.importFile(file), title: file.name });
    } catch (error) {
      if (!(error instanceof CommandError)) throw error;
      setProblem(error.error);
    }
    setBusy(false);
  };
  return (
    <div class="open-plan" data-test="open-plan">
      <h2>{props.onCancel === undefined ? "Open a plan" : "Open another plan"}</h2>
      {problem !== undefined && (
        <div class="problem" role="alert">
          <p>{problem.message}</p>
          {problem.help !== undefined && <p>{problem.help}</p>}
          <Diagnostics list={problem.diagnostics ?? []} />
        </div>
      )}
      <div class="open-columns">
        <section>
          <h3>In this folder</h3>
          {plans?.plans.map((p) => (
            <button type="button" class="choice" disabled={busy} data-test="open-path" onClick={() => void open({ path: p.path })}>
              <strong>{p.title || p.path}</strong>
              <span class="quiet">{p.path}</span>
            </button>
          ))}
          {plans?.plans.length === 0 && <p class="quiet">No plan (*.toml) here.</p>}
        </section>
        <section>
          <h3>Templates</h3>
          {templates?.map((t) => (
            <button type="button" class="choice" disabled={busy} data-test="open-template" onClick={() => void open({ template: t.name })}>
              <strong>{t.title || t.name}</strong>
              <span class="quiet">{t.description ?? t.name}</span>
            </button>
          ))}
          {templates?.length === 0 && <p class="quiet">None.</p>}
        </section>
        <section>
          <h3>From elsewhere</h3>
          <label class="choice">
            <strong>Import a plan</strong>
            <span class="quiet">A .toml file from this computer, or a building as .ifc, whose gaps are then to be filled; it is read, not moved</span>
            <input type="file" accept=".toml,.ifc,text/plain" disabled={busy} data-test="import" onChange={(e) => void take(e.currentTarget.files?.[0])} />
          </label>
          {demo !== null && (
            <button type="button" class="choice" disabled={busy} data-test="open-demo" onClick={() => void open({ demo: true })}>
              <strong>Demo: {demo.title}</strong>
              <span class="quiet">A real building, ready to run: press Run, and change what you like</span>
            </button>
          )}
        </section>
      </div>
      {busy && <p role="status">Building…</p>}
      {props.onCancel !== undefined && <div class="dialog-buttons"><button type="button" onClick={props.onCancel}>Cancel</button></div>}
    </div>
  );
}
