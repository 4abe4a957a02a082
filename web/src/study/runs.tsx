/// All runs at once: parallel coordinates with brushes, the runs inside them as a table, one run with its values.
import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { digitsWithin, formatNumber } from "../units";
import { say } from "../translate";
import { makePath, makeScale, makeTicks, tickText } from "./chart";
import { titleOf, type Maybe } from "./data";
import { height as titleHeight, layTitles } from "./labels";
import { isClassed, lookOf, nameOf, type Axis, type State } from "./state";
import { OutcomeName } from "./verdict";

const high = 272, bottom = 24, side = 60; // of the lines, below them, beside them
const paper = 700; // width of A4
const pixels = makeScale(0, 1, 0, 1);
const prints = ["beforeprint", "afterprint"];
const mostRows = 200;

/// The colour behind a look, for a canvas.
function colourOf(element: Element, colour: string): string {
  const name = /^var\((--[\w-]+)\)$/.exec(colour)?.[1];
  return name === undefined ? colour : getComputedStyle(element).getPropertyValue(name).trim();
}

function Coordinates(props: { state: State }) {
  const { state } = props;
  const { study } = state;
  const table = study.run_table;
  const holder = useRef<HTMLDivElement>(null);
  const canvas = useRef<HTMLCanvasElement>(null);
  const [measured, setWidth] = useState(1000);
  const [printed, setPrinted] = useState(false);
  const width = printed ? paper : measured;
  const [dark, setDark] = useState(0); // counts changes of the colour scheme
  const axes = state.axes.filter((a) => state.shownAxes.value.has(a.id));
  const gap = axes.length > 1 ? (width - 2 * side) / (axes.length - 1) : 0;
  const placeOf = (k: number): number => (axes.length > 1 ? side + k * gap : width / 2);
  const titles = layTitles(axes.map((a) => say(a.title)), axes.map((_, k) => placeOf(k)), width);
  const top = 6 + titleHeight * (1 + titles.reduce((most, t) => Math.max(most, t.row), 0)), height = top + high + bottom;
  const scaleOf = (a: Axis) => makeScale(a.low, a.high, height - bottom, top);
  const inside = state.inside.value;
  const selected = state.selected.value;
  const pathOf = (r: number): string => makePath(axes.map((a, k) => [placeOf(k), typeof a.value[r] === "number" ? scaleOf(a).to(a.value[r]) : null]), pixels, pixels);
  const opacity = Math.min(0.8, Math.max(0.12, 60 / Math.max(1, inside.length)));
  const dashOf = (dash: number[]): number[] => (inside.length > 300 ? [] : dash);

  useEffect(() => {
    const element = holder.current;
    if (element === null) return;
    const measure = (): void => setWidth(Math.max(320, element.clientWidth));
    measure();
    const observer = new ResizeObserver(measure);
    observer.observe(element);
    const scheme = matchMedia("(prefers-color-scheme: dark)");
    const change = (): void => setDark((n) => n + 1);
    scheme.addEventListener("change", change);
    const print = (event: Event): void => setPrinted(event.type === "beforeprint");
    for (const type of prints) addEventListener(type, print);
    return () => {
      observer.disconnect();
      for (const type of prints) removeEventListener(type, print);
      scheme.removeEventListener("change", change);
    };
  }, []);

  useEffect(() => {
    const element = canvas.current;
    const context = element?.getContext("2d");
    if (element === null || !context) return;
    const ratio = Math.min(3, devicePixelRatio || 1) * 1.5; // also sharp on paper
    element.width = width * ratio;
    element.height = height * ratio;
    context.scale(ratio, ratio);
    context.clearRect(0, 0, width, height);
    const line = (r: number): void => context.stroke(new Path2D(pathOf(r)));
    const isInside = new Set(inside);
    context.lineWidth = 1;
    context.globalAlpha = 0.25;
    context.strokeStyle = colourOf(element, "var(--line)");
    if (isInside.size < table.sample.length) table.sample.forEach((_, r) => isInside.has(r) || line(r));
    context.globalAlpha = opacity;
    for (const r of inside) {
      const look = lookOf(study.outcomes, table.outcome[r] as number);
      context.strokeStyle = colourOf(element, look.colour);
      context.setLineDash(dashOf(look.dash));
      line(r);
    }
    if (selected >= 0) {
      context.globalAlpha = 1;
      context.setLineDash([]);
      context.lineWidth = 3;
      context.strokeStyle = colourOf(element, "var(--selection)");
      line(selected);
    }
  }, [width, height, dark, axes.map((a) => a.id).join(), inside, selected]);

  /// The run whose line passes nearest to a place.
  const pick = (px: number, py: number): void => {
    let best = -1, least = 12;
    for (const r of inside)
      for (let k = 0; k + 1 < axes.length; ++k) {
        const x0 = placeOf(k), x1 = placeOf(k + 1);
        if (px < x0 - 6 || px > x1 + 6) continue;
        const a = axes[k]?.value[r], b = axes[k + 1]?.value[r];
        if (typeof a !== "number" || typeof b !== "number") continue;
        const s = Math.min(1, Math.max(0, (px - x0) / (x1 - x0)));
        const y = (1 - s) * scaleOf(axes[k] as Axis).to(a) + s * scaleOf(axes[k + 1] as Axis).to(b);
        if (Math.abs(y - py) < least) (least = Math.abs(y - py)), (best = r);
      }
    state.selected.value = best;
  };

  const drag = useRef<{ axis: Axis; from: number } | undefined>(undefined);
  const valueAt = (a: Axis, py: number): number => a.low + ((height - bottom - Math.min(height - bottom, Math.max(top, py))) / (height - bottom - top)) * (a.high - a.low);
  const placeIn = (event: PointerEvent): [number, number] => {
    const box = (holder.current as HTMLDivElement).getBoundingClientRect();
    const scale = width / box.width;
    return [scale * (event.clientX - box.left), scale * (event.clientY - box.top)];
  };
  return (
    <div ref={holder} class="coordinates" data-test="coordinates">
      <canvas ref={canvas} aria-hidden="true" hidden={printed} />
      <svg
        viewBox={`0 0 ${width} ${height}`} role="img" aria-label="Parallel coordinates of all runs; the limits below do the same as brushes, the table shows the runs"
        onClick={(e) => {
          const [px, py] = placeIn(e as unknown as PointerEvent);
          if (!axes.some((_, k) => Math.abs(px - placeOf(k)) < 10)) pick(px, py);
        }}
      >
        {printed && inside.map((r) => {
          const look = lookOf(study.outcomes, table.outcome[r] as number);
          return <path class="run-line" d={pathOf(r)} style={{ stroke: look.colour, strokeOpacity: opacity }} stroke-dasharray={dashOf(look.dash).join(" ")} />;
        })}
        {printed && selected >= 0 && <path class="chosen-line" d={pathOf(selected)} />}
        {axes.map((a, k) => {
          const s = scaleOf(a);
          const range = state.brushes.value.get(a.id);
          const title = titles[k] as (typeof titles)[number];
          const titleAt = top - 8 - titleHeight * title.row;
          return (
            <g class="axis" data-axis={a.id} key={a.id}>
              <line x1={placeOf(k)} x2={placeOf(k)} y1={top} y2={height - bottom} />
              {makeTicks(a.low, a.high, 5).map((t) => <text x={placeOf(k) + 5} y={s.to(t) + 4}>{tickText(t)}</text>)}
              {title.row > 0 && <line class="lead" x1={placeOf(k)} x2={placeOf(k)} y1={top} y2={titleAt + 3} />}
              <text class="axis-title" x={title.x} y={titleAt} text-anchor="middle" data-name>{title.text}</text>
              {range !== undefined && <rect class="brush" x={placeOf(k) - 8} width={16} y={s.to(range[1])} height={Math.max(2, s.to(range[0]) - s.to(range[1]))} />}
              <rect
                class="grip" x={placeOf(k) - 10} width={20} y={top} height={height - bottom - top}
                onPointerDown={(e) => {
                  e.currentTarget.setPointerCapture(e.pointerId);
                  drag.current = { axis: a, from: valueAt(a, placeIn(e)[1]) };
                }}
                onPointerMove={(e) => {
                  const d = drag.current;
                  if (d !== undefined) state.brush(d.axis.id, [d.from, valueAt(d.axis, placeIn(e)[1])]);
                }}
                onPointerUp={(e) => {
                  const d = drag.current;
                  drag.current = undefined;
                  if (d !== undefined && Math.abs(valueAt(d.axis, placeIn(e)[1]) - d.from) < 0.01 * (a.high - a.low)) state.brush(a.id, undefined);
                }}
                onPointerCancel={() => (drag.current = undefined)}
              />
            </g>
          );
        })}
      </svg>
    </div>
  );
}

/// The same limits as brushes, for the keyboard; and which axes are there.
function Limits(props: { state: State }) {
  const { state } = props;
  const toggle = (id: string): void => {
    const next = new Set(state.shownAxes.value);
    if (!next.delete(id)) next.add(id);
    else state.brush(id, undefined);
    state.shownAxes.value = next;
  };
  return (
    <details class="limits">
      <summary>Axes and limits</summary>
      <table>
        <thead>
          <tr><th scope="col">axis</th><th scope="col">shown</th><th scope="col">from</th><th scope="col">to</th></tr>
        </thead>
        <tbody>
          {state.axes.map((a) => {
            const range = state.brushes.value.get(a.id) ?? [a.low, a.high];
            const set = (k: 0 | 1, text: string): void => {
              const next: [number, number] = [range[0], range[1]];
              const value = Number(text);
              if (text.trim() === "" || !Number.isFinite(value)) return;
              next[k] = value;
              state.brush(a.id, next);
            };
            const shown = state.shownAxes.value.has(a.id);
            return (
              <tr>
                <th scope="row">{a.title}</th>
                <td><input type="checkbox" checked={shown} aria-label={`${a.title} shown`} onChange={() => toggle(a.id)} /></td>
                {([0, 1] as const).map((k) => (
                  <td><input type="text" inputMode="decimal" size={9} disabled={!shown} aria-label={`${a.title} ${k === 0 ? "from" : "to"}`} value={String(Number((range[k] as number).toPrecision(digitsWithin(range[0], range[1], 6))))} onChange={(e) => set(k, e.currentTarget.value)} /></td>
                ))}
              </tr>
            );
          })}
        </tbody>
      </table>
    </details>
  );
}

/// Digits with which each column tells its runs apart.
function findDigits(columns: Maybe[][]): number[] {
  return (columns[0] ?? []).map((_, k) => {
    let low = Infinity, high = -Infinity;
    for (const row of columns) {
      const v = row[k];
      if (typeof v === "number") (low = Math.min(low, v)), (high = Math.max(high, v));
    }
    return digitsWithin(low, high);
  });
}

interface Digits {
  inputs: number[];
  derived: number[];
  outputs: number[];
}

function OneRun(props: { state: State; digits: Digits }) {
  const { state, digits } = props;
  const { study } = state;
  const table = study.run_table;
  const r = state.selected.value;
  if (r < 0) return <p class="quiet hint" id="run">Click a line, or a number in the table, to see a run with all its values.</p>;
  const sample = table.sample[r] as number;
  const failure = table.failure[String(sample)];
  const pairs: [string, string][] = [
    ...study.inputs.map((q, k): [string, string] => [titleOf(q), formatNumber(table.inputs[r]?.[k], digits.inputs[k])]),
    ...study.derived.map((q, k): [string, string] => [titleOf(q), formatNumber(table.derived[r]?.[k], digits.derived[k])]),
    ["possibility of the inputs", formatNumber(table.membership[r])],
    ...study.outputs.map((q, k): [string, string] => [titleOf(q), formatNumber(table.outputs[r]?.[k], digits.outputs[k])]),
  ];
  return (
    <div class="one-run" id="run" data-test="run">
      <h3>Run {sample}{isClassed(study) && <>: <OutcomeName study={study} index={table.outcome[r] as number} /></>}</h3>
      {failure !== undefined && <p>{failure}</p>}
      <table class="pairs">
        <tbody>{pairs.map(([key, value]) => <tr><th scope="row">{key}</th><td>{value}</td></tr>)}</tbody>
      </table>
    </div>
  );
}

export function Runs(props: { state: State }) {
  const { state } = props;
  const { study } = state;
  const table = study.run_table;
  const inside = [...state.inside.value].sort((a, b) => (table.membership[b] as number) - (table.membership[a] as number));
  const shown = inside.slice(0, mostRows);
  const digits = useMemo(() => ({ inputs: findDigits(table.inputs), derived: findDigits(table.derived), outputs: findDigits(table.outputs) }), [table]);
  const toggle = (i: number): void => {
    const next = new Set(state.hiddenOutcomes.value);
    if (!next.delete(i)) next.add(i);
    state.hiddenOutcomes.value = next;
  };
  return (
    <section class="panel" aria-label="Runs">
      <h2>Runs</h2>
      {study.outcomes.length > 1 && (
        <div class="chips" role="group" aria-label="Outcomes shown">
          {study.outcomes.map((_, i) => (
            <button type="button" class="chip" aria-pressed={!state.hiddenOutcomes.value.has(i)} onClick={() => toggle(i)}>
              <OutcomeName study={study} index={i} />
            </button>
          ))}
          {state.brushes.value.size > 0 && <button type="button" class="chip" data-test="clear" onClick={() => (state.brushes.value = new Map())}>take limits away</button>}
        </div>
      )}
      <Coordinates state={state} />
      <p class="quiet plot-note" data-test="inside">
        {inside.length} of {table.sample.length} runs{table.sample.length < study.runs ? ` (an even choice of ${study.runs}; all are in samples.csv)` : ""} lie inside the limits. <span class="hint">Drag along an axis to set them, click it to take them away.</span>
      </p>
      <Limits state={state} />
      <div class="runs-row">
        <div class="scroller" tabIndex={0} role="region" aria-label="Table of runs">
          <table class="run-table">
            <thead>
              <tr>
                <th scope="col">run</th>
                {isClassed(study) && <th scope="col">outcome</th>}
                <th scope="col">possibility</th>
                {study.inputs.map((q) => <th scope="col">{titleOf({ name: q.label, unit: q.unit })}</th>)}
                {study.outputs.slice(0, 3).map((q) => <th scope="col">{titleOf(q)}</th>)}
              </tr>
            </thead>
            <tbody>
              {shown.map((r) => (
                <tr class={r === state.selected.value ? "selected" : ""}>
                  <td><button type="button" class="link" data-run={table.sample[r]} onClick={() => (state.selected.value = r)}>{table.sample[r]}</button></td>
                  {isClassed(study) && <td class="name">{nameOf(study.outcomes[table.outcome[r] as number] ?? { name: "?", is_failure: false, runs: 0, possibility: 0, necessity: 0, outputs: [] })}</td>}
                  <td>{formatNumber(table.membership[r], 3)}</td>
                  {study.inputs.map((_, k) => <td>{formatNumber(table.inputs[r]?.[k], digits.inputs[k])}</td>)}
                  {study.outputs.slice(0, 3).map((_, k) => <td>{formatNumber(table.outputs[r]?.[k], digits.outputs[k])}</td>)}
                </tr>
              ))}
            </tbody>
          </table>
        </div>
        <OneRun state={state} digits={digits} />
      </div>
      {shown.length < inside.length && <p class="quiet">{`The ${shown.length} most possible of ${inside.length} runs are listed.`}</p>}
    </section>
  );
}
