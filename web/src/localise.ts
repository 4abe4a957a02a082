/// Data of pages in the reader's language: what the program wrote in sentences. Names that people gave stay.
import type { Run } from "./data";
import type { Study } from "./study/data";
import { language, say } from "./translate";

export function localiseRun(run: Run): Run {
  if (language === "en") return run;
  const names = new Set([...run.neighbours.map((n) => n.name)]);
  for (const f of run.findings) {
    f.heading = say(f.heading);
    if (!names.has(f.title)) f.title = say(f.title);
    f.text = say(f.text);
  }
  for (const e of run.events) e.text = say(e.text);
  for (const s of run.series) s.title = say(s.title);
  for (const v of run.plan_values) {
    if (v.group !== "Sections") v.key = say(v.key);
    v.group = say(v.group), v.value = say(v.value);
  }
  for (const z of run.zones) z.subsystem = say(z.subsystem);
  run.not_modelled = run.not_modelled.map(say);
  run.ending.text = say(run.ending.text);
  for (const s of run.study?.verdict ?? []) s.text = say(s.text);
  for (const o of run.study?.outcomes ?? []) o.name = say(o.name);
  for (const o of run.others ?? []) o.engine = say(o.engine), o.sentences = o.sentences.map(say);
  return run;
}

export function localiseStudy(study: Study): Study {
  if (language === "en") return study;
  for (const sentence of study.verdict) sentence.text = say(sentence.text);
  for (const run of study.notable) run.why = say(run.why);
  for (const box of study.boxes?.list ?? []) box.guarantee = say(box.guarantee);
  for (const curve of study.curves) curve.over = say(curve.over);
  study.ending = say(study.ending);
  study.drivers.from = say(study.drivers.from);
  study.not_modelled = study.not_modelled.map(say);
  study.failures = study.failures.map(say);
  return study;
}
