/// Two branches: their series in one plot each, where they are farthest apart, what their findings say.
import { useEffect, useRef, useState } from "preact/hooks";
import uPlot from "uplot";
import { axis, cssColour, cutAt, findBreakUp, namePlot, niceRange } from "./plots";
import type { SteerState } from "./steer_state";
import type { Comparison } from "./steer_wire";
import { compareView, type CompareView } from "./steer_view";
import { calcTimeRange, formatNumber, formatTime, prettify, toReadable } from "./units";

const dashOfB = [7, 4];

function Pair(props: { s: SteerState; result: Comparison; series: Comparison["series"][number]; names: [string, string] }) {
  const { s, result, names } = props;
  const shares = props.series.group === "angle" ? result.series.find((x) => x.id === "connected_share") : undefined;
  const ends = [findBreakUp(shares?.a), findBreakUp(shares?.b)];
  const series = { ...props.series, a: cutAt(props.series.a, ends[0]), b: cutAt(props.series.b, ends[1]) };
  const holder = useRef<HTMLDivElement>(null);
  const [open, setOpen] = useState(false);
  const { unit, factor } = toReadable(series.unit);
  const scale = (v: (number | null)[]): (number | null)[] => v.map((x) => (x === null ? null : x * factor));
  useEffect(() => {
    const element = holder.current;
    if (element === null) return;
    const line = (label: string, k: number, dash: number[]): uPlot.Series => ({ label, stroke: () => cssColour(`--series-${k}`), width: 1.8, dash });
    const plot = new uPlot(
      {
        width: Math.max(200, element.clientWidth), height: 150, padding: [8, 10, 0, 0], legend: { show: false },
        cursor: { drag: { x: false, y: false }, y: false },
        scales: { x: { time: false, range: (u) => calcTimeRange(u.data[0], 0) }, y: { range: (_, low, high) => niceRange(low, high) } },
        axes: [axis("time [s]", true), axis(unit === "" ? "" : `[${unit}]`, false)],
        series: [{}, line(names[0], 0, []), line(names[1], 1, dashOfB)],
      },
      [result.time, scale(series.a), scale(series.b)],
      element,
    );
    namePlot(plot, series.title);
    plot.over.addEventListener("pointerdown", (e) => s.look(plot.posToVal(e.clientX - plot.over.getBoundingClientRect().left, "x")));
    const observer = new ResizeObserver(() => plot.setSize({ width: Math.max(200, element.clientWidth), height: 150 }));
    observer.observe(element);
    return () => {
      observer.disconnect();
      plot.destroy();
    };
  }, [result]);
  return (
    <section class="plot panel" aria-label={series.title}>
      <h2>{series.title}</h2>
      <div ref={holder} />
      {ends.map((end, k) => end !== undefined && (
        <p class="quiet plot-note">{names[k]} ends at {formatTime(result.time[end] ?? 0)}, when less than half of the upper block holds together.</p>
      ))}
      <details class="data-table" onToggle={(e) => setOpen(e.currentTarget.open)}>
        <summary>Table of values</summary>
        {open && (
          <div class="scroller" tabIndex={0} role="region" aria-label={`Values of ${series.title}`}>
            <table>
              <thead><tr><th scope="col">time [s]</th><th scope="col">{names[0]} [{unit}]</th><th scope="col">{names[1]} [{unit}]</th></tr></thead>
              <tbody>
                {result.time.map((t, k) => <tr><td>{t.toFixed(3)}</td><td>{formatNumber(scale(series.a)[k])}</td><td>{formatNumber(scale(series.b)[k])}</td></tr>)}
              </tbody>
            </table>
          </div>
        )}
      </details>
    </section>
  );
}

/// Of bodies of both branches, the largest distance and when.
function findFarthest(largest: Comparison["largest"]): { time: number; distance: number } | undefined {
  if (largest === null) return undefined;
  const times = [largest.time].flat(), distances = [largest.distance].flat();
  let best = -1;
  distances.forEach((d, k) => {
    if (d !== null && (best < 0 || d > (distances[best] as number))) best = k;
  });
  return best < 0 ? undefined : { time: times[best] as number, distance: distances[best] as number };
}

const modes: [CompareView, string][] = [["off", "one"], ["beside", "side by side"], ["over", "one over the other"]];

export function Compare(props: { s: SteerState }) {
  const { s } = props;
  const c = s.comparison.value;
  const [a, setA] = useState(c?.a ?? s.active.value);
  const [b, setB] = useState(c?.b ?? s.branches.value.find((x) => x.id !== s.active.value)?.id ?? 0);
  const nameOf = (id: number): string => s.branches.value.find((x) => x.id === id)?.name ?? `branch ${id}`;
  useEffect(() => {
    if (c === null) return;
    setA(c.a);
    setB(c.b);
  }, [c]);
  if (s.branches.value.length < 2) return <p class="quiet pad">There is one branch. An edit, or “Branch here”, makes another one to compare with.</p>;
  const apart = findFarthest(c?.result.largest ?? null);
  const choose = (value: number, set: (id: number) => void, label: string) => (
    <label>
      {label}{" "}
      <select value={String(value)} onChange={(e) => set(Number(e.currentTarget.value))}>
        {s.branches.value.map((x) => <option value={String(x.id)}>{x.name}</option>)}
      </select>
    </label>
  );
  return (
    <div class="compare" data-test="compare-panel">
      <div class="editor-bar">
        {choose(a, setA, "Compare")} {choose(b, setB, "with")}
        <button type="button" class="main-button" disabled={a === b || b === 0} data-test="compare-go" onClick={() => void s.compare(a, b)}>{c === null ? "Compare" : "Compare again"}</button>
        <span class="small-group" role="group" aria-label="Picture of the two">
          {modes.map(([mode, word]) => (
            <button type="button" class="small" disabled={c === null} aria-pressed={compareView.value === mode} data-test={`compare-${mode}`} onClick={() => (compareView.value = mode)}>{word}</button>
          ))}
        </span>
        {c !== null && (
          <>
            <span class="with-sign"><i class="line-swatch" style={{ background: "var(--series-0)" }} /> {nameOf(c.a)}</span>
            <span class="with-sign"><i class="line-swatch dashed" style={{ color: "var(--series-1)" }} /> {nameOf(c.b)}</span>
          </>
        )}
      </div>
      {c !== null && (
        <>
          {apart !== undefined && <p class="pad">Farthest apart: {formatNumber(apart.distance, 3)} m at {formatTime(apart.time)}.</p>}
          <div class="plots wide-plots">
            {c.result.series.map((series) => <Pair key={`${c.a} ${c.b} ${series.id}`} s={s} result={c.result} series={series} names={[nameOf(c.a), nameOf(c.b)]} />)}
          </div>
          <div class="compare-tables">
            <table class="text-table">
              <caption>Findings that differ</caption>
              <thead><tr><th scope="col">Finding</th><th scope="col">{nameOf(c.a)}</th><th scope="col">{nameOf(c.b)}</th></tr></thead>
              <tbody>
                {c.result.findings.map((f) => <tr><th scope="row">{f.title}</th><td>{prettify(f.a ?? "–")}</td><td>{prettify(f.b ?? "–")}</td></tr>)}
                {c.result.findings.length === 0 && <tr><td colSpan={3}>None.</td></tr>}
              </tbody>
            </table>
            <table>
              <caption>Bodies farthest apart at the last common moment</caption>
              <thead><tr><th scope="col">Body</th><th scope="col">distance [m]</th></tr></thead>
              <tbody>{c.result.bodies.map((x) => <tr><th scope="row">{x.name}</th><td>{formatNumber(x.distance, 3)}</td></tr>)}</tbody>
            </table>
          </div>
        </>
      )}
    </div>
  );
}
