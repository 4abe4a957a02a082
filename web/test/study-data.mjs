// Made-up studies for the tests of the study page. Names and texts are hostile on purpose.
import { readFile, writeFile } from "node:fs/promises";
import { hostile } from "./synthetic.mjs";

const alphas = [0, 0.5, 1];

function base64OfFloats(values) {
  const bytes = Buffer.alloc(values.length * 4);
  values.forEach((value, i) => bytes.writeFloatLE(value, 4 * i));
  return bytes.toString("base64");
}

const round = (v) => Number(v.toPrecision(7));

/// A study of `count` runs over two inputs; the outcome jumps where fc is low, and the last run failed.
export function makeStudy(count = 60) {
  const inputs = [
    { name: "fc", label: "fc", unit: "N/mm2", cuts: [[0, 10, 45], [1, 25, 25]] },
    { name: hostile, label: hostile, unit: "", cuts: [[0, 0, 2], [1, 1, 1]] },
  ];
  const times = Array.from({ length: 11 }, (_, k) => 0.17 * k);
  const rows = Array.from({ length: count }, (_, r) => {
    const fc = 10 + (35 * ((r * 7) % count)) / count, x = (2 * ((r * 11) % count)) / count;
    const failed = r === count - 1, vertical = fc < 18;
    const tilt = failed ? null : vertical ? -5 + x : 10 + fc / 5;
    return {
      fc, x, tilt, failed, outcome: failed ? 0 : vertical ? 2 : 1,
      membership: Math.min(fc < 25 ? (fc - 10) / 15 : (45 - fc) / 20, 1 - Math.abs(x - 1)),
      curve: times.map((t) => (failed ? NaN : (tilt * t) / 1.7)),
    };
  });
  const level = (alpha, lower, upper) => ({ alpha, lower, upper, samples: [0, 1], converged: [true, alpha > 0] });
  const tilt = { name: "tilt_1.7", unit: "deg", levels: [level(0, -5, 19), level(0.5, 2, 16), level(1, 15, 15)], centroid: 9.5, robustness: 0.4 };
  const reach = { name: "reach", unit: "m", levels: [level(0, 3, 12), level(0.5, 5, 9), level(1, 7, 7)], centroid: 7.2, robustness: null };
  const partOf = (lower, upper) => [
    { name: "tilt_1.7", unit: "deg", levels: [level(0, lower, upper), level(0.5, lower + 1, upper - 1), level(1, null, null)] },
    { name: "reach", unit: "m", levels: alphas.map((a) => level(a, 3 + a, 12 - a)) },
  ];
  const square = (r) => [[-r, -r], [12 + r, -r], [12 + r, 22 + r], [-r, 22 + r]];
  const driver = (first, first_error, places, total = null) => ({ first, first_error, total, total_error: total === null ? null : 0.1, places });
  const fan = (outcome, is_all, low, high) => ({
    curve: "tilt", is_all, outcome,
    levels: alphas.map((alpha) => ({ alpha, runs: 10, lower: times.map((t) => low * t * (1 - alpha / 2)), upper: times.map((t) => high * t * (1 - alpha / 2)) })),
  });
  return {
    format: "topple-study", version: 1, title: "Storehouse, fuzzy (synthetic)", state: "finished", ending: "complete", asked: "topple",
    verdict: [
      { id: "verdict", status: "warning", text: "With the core values the outcome is \"topple\", as planned. It is not certain: another outcome is possible (possibility at least 0.47), so its necessity is at most 0.53." },
      { id: "requirement", status: "warning", text: "The core values keep the requirement topple, reach <= 10. Breaking it is possible: possibility at least 0.47, so the necessity of keeping it is at most 0.53. No search has ended there, so it may be higher. It takes no more than fc 18 N/mm2 (core 25)." },
      { id: "outcome.vertical", status: "warning", text: `"vertical" is possible: possibility at least 0.47, necessity at most 0.00. It takes no more than ${hostile} 18 N/mm2 (core 25).` },
      { id: "failed", status: "warning", text: `1 of ${count} runs failed; they are an outcome of their own, possible to at least 0.20. What would have happened there is not known.` },
    ],
    runs: count, failed: 1, seed: 1, inputs, derived: [{ name: "fct", unit: "N/mm2" }], outputs: [tilt, reach],
    outcomes: [
      { name: "failed", is_failure: true, runs: 1, possibility: 0.2, necessity: 0, sample: count - 1, outputs: [] },
      { name: "topple", is_failure: false, runs: count - 15, possibility: 1, necessity: 0.53, sample: 0, outputs: partOf(12, 19) },
      { name: "vertical", is_failure: false, runs: 14, possibility: 0.47, necessity: 0, sample: 3, outputs: partOf(-5, -3) },
    ],
    not_met: ["partial", "stands"],
    requirement: {
      text: "topple, reach <= 10",
      classes: [
        { name: "kept", runs: 40, possibility: 1, necessity: 0.53, necessity_converged: false, sample: 0, resolution: 0, converged: true, runs_above: 0 },
        { name: "broken", runs: 19, possibility: 0.47, necessity: 0, necessity_converged: true, sample: 3, resolution: 1e-4, converged: false, runs_above: 9 },
        { name: "failed", runs: 1, possibility: 0.2, necessity: 0, necessity_converged: true, sample: count - 1, resolution: 0.1, converged: false, runs_above: 20 },
      ],
    },
    coverage: alphas.map((alpha) => ({ alpha, samples: 30, spread: 10 })), failures: [`1 x ${hostile}`],
    notable: [{ sample: 3, why: "most possible run with the outcome vertical (0.47)" }, { sample: 3, why: "most possible run that breaks the requirement (0.47)" }, { sample: count - 1, why: "failed" }],
    drivers: {
      from: "spread runs", runs: 40,
      outputs: [{ name: "tilt_1.7", inputs: [driver(0.83, 0.06, [1, 1], 0.9), driver(0.02, 0.09, [2, 2], 0.1)] }],
      outcomes: [
        { name: "topple", share: 0.7, inputs: [driver(0.7, 0.1, [1, 1]), driver(0.1, 0.05, [2, 2])] },
        { name: "vertical", share: 0.3, inputs: [driver(0.7, 0.1, [1, 1]), driver(0.1, 0.05, [2, 2])] },
      ],
    },
    known: [{ input: "fc", outcomes: [{ name: "failed", possibility: 0.2 }, { name: "topple", possibility: 1 }, { name: "vertical", possibility: 0 }] }],
    boxes: {
      requirement: "topple, reach <= 10", permissible_part: 0.62, permissible_part_error: 0.05, permissible_part_points: 60, permissible_runs: 40, forbidden_runs: 19, failed_runs: 1, ending: "complete",
      list: [
        { kept: true, guarantee: "No run violated the requirement in 25 inside, 20 of them at fresh random points: with a confidence of 95 % at most 14.0 % of the box violates it. It is not proven, and smaller islands may exist.", inputs: [{ name: "fc", lower: 20, upper: 40, core: 28 }, { name: hostile, lower: 0.3, upper: 1.7, core: 1 }], volume: 0.4, runs: 25, fresh: 20, tries: 1, violating: 0.14, distance: 0.1, robustness: 1.2, outputs: [] },
        { kept: false, guarantee: "This box was dropped: what violates the requirement leaves too little room around these runs (below a thousandth of the support; of more than three inputs, below a tenth of its width in the mean).", inputs: [{ name: "fc", lower: 20, upper: 21, core: null }, { name: hostile, lower: 0.3, upper: 0.4, core: null }], volume: 0.001, runs: 2, fresh: 0, tries: 0, violating: null, distance: 0, robustness: null, outputs: [] },
      ],
    },
    confirmation: {
      limit: 4, tolerance: 0.05,
      runs: [
        { sample: 0, membership: 1, outcome: "topple", whole_outcome: "topple", values: [], whole_values: [] },
        { sample: 1, membership: 0.4, outcome: "vertical", whole_outcome: "topple", values: [], whole_values: [] },
        { sample: 2, membership: 0, outcome: "topple", whole_outcome: null, values: [], whole_values: [] },
      ],
      bounds: [
        { output: "tilt_1.7", alpha: 0, side: "lower", condensed: -3, whole: -3.1, state: "confirmed" },
        { output: "tilt_1.7", alpha: 0, side: "upper", condensed: 12, whole: 14, state: "exceeded" },
        { output: hostile, alpha: 1, side: "upper", condensed: 4, whole: null, state: "not run" },
      ],
      outcomes: [{ outcome: "topple", sample: 0, whole: "topple", state: "confirmed" }, { outcome: "vertical", sample: 1, whole: "topple", state: "not reached" }],
    },
    curves: [
      { name: "tilt", unit: "deg", over: "time after the last stage", over_unit: "s", at: times, is_outline: false },
      { name: "outline", unit: "m", over: "direction", over_unit: "deg", at: [0, 90, 180, 270], is_outline: true },
    ],
    fans: [fan("", true, -3, 12), fan("topple", false, 7, 12), fan("vertical", false, -3, -1)],
    debris: [
      { is_all: true, outcome: "", levels: alphas.map((alpha) => ({ alpha, runs: 10, corners: square(9 - 4 * alpha) })) },
      { is_all: false, outcome: "vertical", levels: alphas.map((alpha) => ({ alpha, runs: alpha < 1 ? 4 : 0, corners: alpha < 1 ? square(3) : [] })) },
    ],
    run_table: {
      sample: rows.map((_, r) => r), inputs: rows.map((r) => [round(r.fc), round(r.x)]), derived: rows.map((r) => [r.fc > 8 ? round(1.4 * ((r.fc - 8) / 10) ** (2 / 3)) : null]),
      outputs: rows.map((r) => [r.tilt === null ? null : round(r.tilt), r.failed ? null : round(3 + r.x)]), membership: rows.map((r) => round(Math.max(0, r.membership))),
      outcome: rows.map((r) => r.outcome), failure: { [String(count - 1)]: hostile }, points: times.length, trajectories: base64OfFloats(rows.flatMap((r) => r.curve)),
    },
    site: { footprint: [[0, 0], [12, 0], [12, 22], [0, 22]], neighbours: [{ name: hostile, footprint: [[-30, 0], [-24, 0], [-24, 8], [-30, 8]], is_utility: false }] },
    not_modelled: ["dust", hostile],
    origin: { program_version: "0.1.0", created: "2026-01-01T12:00:00Z", model: "9f86d081884c7d65", kind: "plan", source_name: "plan.toml", source: `# ${hostile}\n` },
  };
}

/// Nothing has been run yet.
export function makeEmptyStudy() {
  const study = makeStudy(2);
  return {
    ...study, title: "", state: "open", ending: "cancelled", asked: "", verdict: [{ id: "verdict", status: "info", text: "Nothing has been run so far." }], runs: 0, failed: 0,
    outputs: [], outcomes: [], coverage: [], failures: [], notable: [], drivers: { from: "nothing", runs: 0, outputs: [], outcomes: [] }, known: [], boxes: null, requirement: null,
    curves: [], fans: [], debris: [], site: { footprint: [], neighbours: [] }, not_modelled: [],
    run_table: { sample: [], inputs: [], derived: [], outputs: [], membership: [], outcome: [], failure: {}, points: 0, trajectories: "" },
  };
}

/// A model that tells one outcome without a name, and nothing else but one number.
export function makePlainStudy() {
  const study = makeStudy(20);
  const count = study.run_table.sample.length;
  return {
    ...study, not_met: [], asked: "", failed: 0, outcomes: [{ ...study.outcomes[1], name: "", runs: count, possibility: 1, necessity: 1 }], failures: [], notable: [], known: [], boxes: null, requirement: null,
    drivers: { ...study.drivers, outcomes: [] }, curves: [], fans: [], debris: [], site: { footprint: [], neighbours: [] }, not_modelled: [],
    run_table: { ...study.run_table, outcome: study.run_table.outcome.map(() => 0), failure: {}, points: 0, trajectories: "" },
  };
}

export function makeFailedStudy() {
  const study = makeEmptyStudy();
  const count = 5;
  const row = [12, 1];
  return {
    ...study, state: "finished", ending: "complete", verdict: [{ id: "verdict", status: "bad", text: "All 5 runs failed: nothing is known of this model." }], runs: count, failed: count,
    outcomes: [{ name: "failed", is_failure: true, runs: count, possibility: 1, necessity: 1, sample: 0, outputs: [] }], failures: [`5 x ${hostile}`],
    run_table: { ...study.run_table, sample: [0, 1, 2, 3, 4], inputs: Array(count).fill(row), derived: Array(count).fill([null]), outputs: Array(count).fill([]), membership: Array(count).fill(0.2), outcome: Array(count).fill(0), failure: { 0: hostile } },
  };
}

/// Writes a page with these data in it, as write_page does.
export async function writeStudy(data, path) {
  const page = await readFile(new URL("../dist/study.html", import.meta.url), "utf8");
  const script = `<script type="application/json" id="topple-data">${JSON.stringify(data).replace(/</g, "\\u003c")}</script>`;
  await writeFile(path, page.replace("<!--TOPPLE-DATA-->", () => script));
}
