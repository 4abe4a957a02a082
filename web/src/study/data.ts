/// The study as its page reads it: docs/study.md. Values are in the units named beside them.
import { decodeFloats, type Point, type Status } from "../data";

export type Maybe = number | null;

export interface Level {
  alpha: number;
  lower: Maybe;
  upper: Maybe;
  converged: [boolean, boolean];
}
export interface Output {
  name: string;
  unit: string;
  levels: Level[];
  centroid?: Maybe;
  robustness?: Maybe;
}
export interface Outcome {
  name: string;
  is_failure: boolean;
  runs: number;
  possibility: number;
  necessity: number;
  converged?: boolean; // the search for its possibility; not known of old studies
  necessity_converged?: boolean;
  outputs: Output[];
}
/// Runs that keep what is asked for, break it, or failed.
export interface RequirementClass {
  name: string; // kept, broken, failed
  runs: number;
  possibility: number;
  necessity: number;
  converged: boolean;
  necessity_converged: boolean;
}
export interface Input {
  name: string;
  label: string; // short name
  unit: string;
  cuts: [number, number, number][]; // alpha, left, right
}
export interface Driver {
  first: Maybe;
  first_error: Maybe;
  total: Maybe;
  total_error: Maybe;
  places: [number, number];
}
export interface Box {
  kept: boolean;
  guarantee: string;
  inputs: { name: string; lower: number; upper: number; core: Maybe }[];
  volume: number;
  runs: number;
  robustness: Maybe;
  distance: number;
  outputs: Output[];
}
export interface Curve {
  name: string;
  unit: string;
  over: string;
  over_unit: string;
  at: number[];
  is_outline: boolean;
}
export interface Fan {
  curve: string;
  is_all: boolean;
  outcome: string;
  levels: { alpha: number; runs: number; lower: Maybe[]; upper: Maybe[] }[];
}
export interface Debris {
  is_all: boolean;
  outcome: string;
  levels: { alpha: number; runs: number; corners: Point[] }[];
}
export interface RunTable {
  sample: number[]; // numbers of the runs that the page holds  (R)
  inputs: Maybe[][]; // (R x inputs)
  derived: Maybe[][];
  outputs: Maybe[][];
  membership: number[];
  outcome: number[]; // index into outcomes
  failure: Record<string, string>;
  points: number; // of the curves that are no outlines, one behind the other
  trajectories: Float64Array; // (R x points)
}
/// What whole runs make of a condensed study's bounds and outcomes.
export interface Confirmation {
  limit: number;
  tolerance: number; // of an output's width
  runs: { sample: number; membership: number; outcome: string; whole_outcome: string | null }[];
  bounds: { output: string; alpha: number; side: "lower" | "upper"; condensed: Maybe; whole: Maybe; state: string }[];
  outcomes: { outcome: string; sample: number; whole: string | null; state: string }[];
}
/// Random inputs, whose values each run takes many of.
export interface Randomness {
  inputs: { name: string; unit: string; distribution: string; parameters: { name: string; input?: string; value?: number }[] }[];
  runs: number;
  seed: number;
  most_failed: number;
}
export interface Study {
  title: string;
  state: "open" | "finished";
  ending: string;
  asked: string;
  verdict: { id: string; status: Status; text: string }[];
  runs: number;
  failed: number;
  seed: number;
  inputs: Input[];
  derived: { name: string; unit: string }[];
  random?: Randomness; // of a study of statistics
  outputs: Output[];
  outcomes: Outcome[];
  not_met?: string[]; // classes that the model knows and no run has had; not known of old studies
  requirement?: { text: string; classes: RequirementClass[] } | null; // not known of old studies
  coverage: { alpha: number; samples: number; spread: number }[];
  failures: string[];
  notable: { sample: number; why: string }[];
  drivers: {
    from: string;
    runs: number;
    outputs: { name: string; inputs: Driver[] }[];
    outcomes: { name: string; share: number; inputs: Driver[] }[];
  };
  known: { input: string; outcomes: { name: string; possibility: number; converged?: boolean }[] }[]; // not known of old studies
  boxes: { requirement: string; permissible_part: number | null; permissible_part_error: number | null; permissible_part_points: number; list: Box[] } | null;
  confirmation?: Confirmation; // of a condensed study
  curves: Curve[];
  fans: Fan[];
  debris: Debris[];
  run_table: RunTable;
  site: { footprint: Point[]; outlines?: Point[][]; neighbours: { name: string; footprint: Point[]; is_utility: boolean }[] };
  not_modelled: string[];
  origin: { program_version: string; created: string; model: string; kind: string; source_name: string; source: string };
}

/// Throws an Error with a sentence for people if the text is not the data of a study.
export function readStudy(text: string): Study {
  // eslint-disable-next-line @typescript-eslint/no-explicit-any -- the one place where untyped data comes in
  const raw = JSON.parse(text) as any;
  if (raw === null || typeof raw !== "object" || raw.format !== "topple-study")
    throw new Error("This file does not hold the data of a study.");
  if (raw.version !== 1) throw new Error(`The data of this page has version ${raw.version}; this page reads version 1.`);
  const table = raw.run_table;
  // over a base for each point, which older pages have not
  const base: Maybe[] = table.trajectory_base ?? [];
  const trajectories = Float64Array.from(decodeFloats(table.trajectories), (y, i) => y + (base.length > 0 ? (base[i % base.length] ?? NaN) : 0));
  const study: Study = { ...raw, run_table: { ...table, trajectories } };
  const expect = (what: string, size: number, expected: number): void => {
    if (size !== expected) throw new Error(`The data of this page is damaged: ${what} has ${size} values, not ${expected}.`);
  };
  const R = study.run_table.sample.length;
  for (const what of ["inputs", "outputs", "membership", "outcome"] as const) expect(what, study.run_table[what].length, R);
  expect("trajectories", study.run_table.trajectories.length, R * study.run_table.points);
  return study;
}

export const titleOf = (q: { name: string; unit: string }): string => (q.unit === "" ? q.name : `${q.name} [${unitWord(q.unit)}]`);

/// Units as they stand in files, for people.
export const unitWord = (unit: string): string =>
  unit === "deg" ? "°" : unit.replace(/(\w)2\b/g, "$1²").replace(/(\w)3\b/g, "$1³").replace("*", "·");

/// A share of a variance is known when it is larger than its standard error.
export const isKnown = (d: Driver): boolean => d.first !== null && d.first_error !== null && d.first > d.first_error;
