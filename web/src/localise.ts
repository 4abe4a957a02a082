/// Data of pages in the reader's language: what the program wrote in sentences. Names that people gave stay.
import type { Run } from "./data";
import { titleOf, type Study } from "./study/data";
import { language, say, settle } from "./translate";
import { prettify } from "./units";

/// Said once: a name within it, in German or not, is not looked at again.
function tell(text: string): string {
  const said = say(text);
  settle(said, prettify(said));
  return said;
}

export function localiseRun(run: Run): Run {
  if (language === "en") return run;
  const names = new Set([...run.neighbours.map((n) => n.name)]);
  for (const f of run.findings) {
    f.heading = tell(f.heading);
    if (!names.has(f.title)) f.title = tell(f.title);
    f.text = tell(f.text);
  }
  for (const e of run.events) e.text = tell(e.text);
  for (const s of run.series) s.title = tell(s.title);
  for (const v of run.plan_values) {
    if (v.group !== "Sections") v.key = tell(v.key);
    v.group = tell(v.group), v.value = tell(v.value);
  }
  for (const z of run.zones) z.subsystem = tell(z.subsystem);
  run.not_modelled = run.not_modelled.map(say);
  run.ending.text = tell(run.ending.text);
  for (const s of run.study?.verdict ?? []) s.text = tell(s.text);
  for (const o of run.study?.outcomes ?? []) o.name = tell(o.name);
  for (const o of run.others ?? []) o.engine = tell(o.engine), o.sentences = o.sentences.map(say);
  return run;
}

export function localiseStudy(study: Study): Study {
  if (language === "en") return study;
  // names are those of samples.csv and trajectories.csv
  for (const q of [...study.inputs, ...study.derived, ...study.outputs, ...study.curves]) settle(q.name, titleOf(q));
  for (const q of study.inputs) settle(q.label, titleOf({ name: q.label, unit: q.unit }));
  for (const sentence of study.verdict) sentence.text = tell(sentence.text);
  for (const run of study.notable) run.why = tell(run.why);
  for (const box of study.boxes?.list ?? []) box.guarantee = tell(box.guarantee);
  for (const curve of study.curves) curve.over = tell(curve.over);
  study.ending = tell(study.ending);
  study.drivers.from = tell(study.drivers.from);
  study.not_modelled = study.not_modelled.map(say);
  study.failures = study.failures.map(say);
  return study;
}
