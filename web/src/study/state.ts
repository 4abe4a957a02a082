/// What the reader of a study looks at. The study itself never changes.
import { computed, signal } from "@preact/signals";
import { dashOfSeries, seriesColours } from "../vocabulary";
import { titleOf, type Maybe, type Outcome, type Study } from "./data";

/// Colour, dash and sign of an outcome: three ways to tell it from the others.
export interface Look {
  colour: string;
  dash: number[];
  shape: string;
}
const shapes = ["circle", "triangle", "diamond", "square", "star", "down"];
export function lookOf(outcomes: readonly Outcome[], index: number): Look {
  if (outcomes[index]?.is_failure) return { colour: "var(--broken)", dash: [1, 3], shape: "cross" };
  const i = outcomes.slice(0, index).filter((o) => !o.is_failure).length;
  return { colour: `var(--series-${i % seriesColours.length})`, dash: dashOfSeries(i), shape: shapes[i % shapes.length] as string };
}
export const nameOf = (outcome: Outcome): string => outcome.name || "(no name)";
/// Whether runs fall into outcomes: a model that names none has one for all of them, which tells nothing.
export const isClassed = (study: Study): boolean => study.outcomes.some((o) => o.name !== "");

export interface Axis {
  id: string;
  title: string;
  value: Maybe[]; // (R)
  low: number;
  high: number;
}

function makeAxis(id: string, title: string, value: Maybe[]): Axis {
  let low = Infinity, high = -Infinity;
  for (const v of value) if (v !== null) (low = Math.min(low, v)), (high = Math.max(high, v));
  if (!(low <= high)) (low = 0), (high = 1);
  if (low === high) (low -= 0.5 * (Math.abs(low) || 1)), (high += 0.5 * (Math.abs(high) || 1));
  return { id, title, value, low, high };
}

export function makeState(study: Study) {
  const table = study.run_table;
  const column = (rows: Maybe[][], k: number): Maybe[] => rows.map((row) => row[k] ?? null);
  const axes = [
    ...study.inputs.map((q, k) => makeAxis(`input.${k}`, titleOf({ name: q.label, unit: q.unit }), column(table.inputs, k))),
    ...study.outputs.map((q, k) => makeAxis(`output.${k}`, titleOf(q), column(table.outputs, k))),
    makeAxis("membership", "possibility of the inputs", table.membership),
  ];
  const shownAxes = signal<ReadonlySet<string>>(
    new Set(axes.filter((a) => !a.id.startsWith("output.") || Number(a.id.slice(7)) < 4).map((a) => a.id)),
  );
  const brushes = signal<ReadonlyMap<string, [number, number]>>(new Map());
  const hiddenOutcomes = signal<ReadonlySet<number>>(new Set());
  /// Runs inside all brushes.
  const inside = computed(() => {
    const limits = [...brushes.value].flatMap(([id, range]) => {
      const axis = axes.find((a) => a.id === id);
      return axis === undefined ? [] : [{ value: axis.value, range }];
    });
    const out: number[] = [];
    for (let r = 0; r < table.sample.length; ++r) {
      if (hiddenOutcomes.value.has(table.outcome[r] as number)) continue;
      const isIn = limits.every(({ value, range }) => {
        const v = value[r];
        return v !== null && v !== undefined && v >= range[0] && v <= range[1];
      });
      if (isIn) out.push(r);
    }
    return out;
  });
  return {
    study,
    axes,
    shownAxes,
    brushes,
    hiddenOutcomes,
    inside,
    selected: signal(-1), // row of the run table
    /// undefined takes a limit away.
    brush(id: string, range: [number, number] | undefined): void {
      const next = new Map(brushes.value);
      if (range === undefined) next.delete(id);
      else next.set(id, [Math.min(...range), Math.max(...range)]);
      brushes.value = next;
    },
    /// Chooses a run by its number in the study.
    select(sample: number): void {
      this.selected.value = table.sample.indexOf(sample);
      document.getElementById("run")?.scrollIntoView({ block: "nearest" });
    },
  };
}
export type State = ReturnType<typeof makeState>;
