import { effect } from "@preact/signals";
import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import uPlot from "uplot";
import type { Run, Series } from "./data";
import type { State } from "./state";
import { say } from "./translate";
import { calcTimeRange, dropRoundOff, findLargest, formatNumber, formatTime, formatValue, toReadable } from "./units";
import { dashOfSeries, groupOrder, groupWord, seriesColours } from "./vocabulary";

interface Group {
  id: string;
  title: string;
  unit: string;
  factor: number;
  series: Series[];
}

/// Series of one group and one unit share a plot. `titles` go before the usual headings of groups.
export function makeGroups(series: readonly Series[], titles: Record<string, string> = {}): Group[] {
  const groups: Group[] = [];
  for (const s of series) {
    const found = groups.find((g) => g.id === s.group && g.series[0]?.unit === s.unit);
    if (found !== undefined) found.series.push(s);
    else {
      const { unit, factor } = toReadable(s.unit);
      groups.push({ id: s.group, title: titles[s.group] ?? groupWord[s.group] ?? s.title, unit, factor, series: [s] });
    }
  }
  const rank = (g: Group): number => (groupOrder.includes(g.id) ? groupOrder.indexOf(g.id) : groupOrder.length);
  return groups.map((g, i) => ({ g, i })).sort((a, b) => rank(a.g) - rank(b.g) || a.i - b.i).map(({ g }) => g);
}

/// First moment at which less than half of the upper block holds together: from there on its angle means nothing.
export function findBreakUp(connectedShare: readonly (number | null)[] | undefined): number | undefined {
  const first = connectedShare?.findIndex((v) => v !== null && v < 0.5) ?? -1;
  return first < 0 ? undefined : first;
}
export const findCoherent = (run: Run): number | undefined => findBreakUp(run.series.find((s) => s.id === "connected_share")?.value);

/// The series until there.
export const cutAt = (values: readonly (number | null)[], end: number | undefined): (number | null)[] =>
  values.map((v, i) => (i >= (end ?? Infinity) ? null : v));

export const cssColour = (name: string): string => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/// What a plot is, for those who do not see it.
export function namePlot(plot: uPlot, title: string): void {
  plot.ctx.canvas.setAttribute("role", "img");
  plot.ctx.canvas.setAttribute("aria-label", `${say(title)}: ${say("the table of values says the same")}`);
}

export function axis(label: string, isTime: boolean): uPlot.Axis {
  return {
    stroke: () => cssColour("--text-quiet"),
    grid: { stroke: () => cssColour("--line-faint"), width: 1 },
    ticks: { stroke: () => cssColour("--line-faint"), width: 1, size: 4 },
    font: "12px system-ui, sans-serif",
    labelFont: "12px system-ui, sans-serif",
    label: say(label),
    labelSize: isTime ? 18 : 20,
    labelGap: 0,
    size: isTime ? 28 : 50,
    gap: 4,
    values: (_, splits) => splits.map((v) => String(Number(v.toPrecision(6))).replace("-", "−")).map(say),
  };
}

/// In the group's readable unit; an angle ends when its block falls apart.
function calcValues(run: Run, group: Group): (number | null)[][] {
  const coherent = group.id === "angle" ? findCoherent(run) : undefined;
  return group.series.map((s) => s.value.map((v, i) => (v === null || i >= (coherent ?? Infinity) ? null : v * group.factor)));
}

export function PlotPanel(props: { state: State; group: Group; note?: string | undefined; onSeek?: (time: number) => void; height?: number }) {
  const { state, group } = props;
  const { run } = state;
  const holder = useRef<HTMLDivElement>(null);
  const height = props.height ?? 220;
  void state.grownSlowly.value; // drawn again when frames were added
  const coherent = group.id === "angle" ? findCoherent(run) : undefined;
  const values = calcValues(run, group);

  useEffect(() => {
    const element = holder.current;
    if (element === null) return;
    const cursorLine = document.createElement("div");
    cursorLine.className = "time-line";
    const placeLine = (u: uPlot): void => {
      cursorLine.style.transform = `translateX(${u.valToPos(state.timeSlowly.value, "x") || 0}px)`;
    };
    const plot = new uPlot(
      {
        width: Math.max(200, element.clientWidth),
        height,
        padding: [10, 12, 0, 0],
        legend: { show: false },
        cursor: { drag: { x: false, y: false }, y: false, points: { size: 6 } },
        scales: { x: { time: false, range: () => calcTimeRange(run.time, state.limit.value) }, y: { range: (_, low, high) => niceRange(low, high) } },
        axes: [axis("time [s]", true), axis(group.unit === "" ? "" : `[${group.unit}]`, false)],
        series: [
          {},
          ...group.series.map((s, i) => ({
            label: s.title,
            stroke: () => cssColour(`--series-${i % seriesColours.length}`),
            width: 1.8,
            dash: dashOfSeries(i),
            points: { show: () => run.time.length < 2 },
          })),
        ],
        hooks: {
          drawAxes: [
            (u) => {
              const { ctx } = u;
              ctx.save();
              ctx.strokeStyle = cssColour("--text-quiet");
              ctx.setLineDash([3, 3]);
              for (const stage of run.events) {
                if (stage.kind !== "stage") continue;
                const x = Math.round(u.valToPos(stage.time, "x", true)) + 0.5;
                if (x < u.bbox.left || x > u.bbox.left + u.bbox.width) continue;
                ctx.beginPath();
                ctx.moveTo(x, u.bbox.top);
                ctx.lineTo(x, u.bbox.top + u.bbox.height);
                ctx.stroke();
              }
              ctx.restore();
            },
          ],
          draw: [placeLine], // new data and sizes hold from then on, not when they are set
        },
      },
      [run.time, ...calcValues(run, group)],
      element,
    );
    namePlot(plot, group.title);
    plot.over.appendChild(cursorLine);
    const seek = (event: PointerEvent): void => {
      if (event.buttons & 1) (props.onSeek ?? state.pauseAt)(plot.posToVal(event.clientX - plot.over.getBoundingClientRect().left, "x"));
    };
    plot.over.addEventListener("pointerdown", (event) => {
      plot.over.setPointerCapture(event.pointerId);
      seek(event);
    });
    plot.over.addEventListener("pointermove", seek);
    const observer = new ResizeObserver(() => plot.setSize({ width: Math.max(200, element.clientWidth), height }));
    observer.observe(element);
    // Two plots side by side on A4; the paper's layout comes too late for the observer.
    const beforePrint = (): void => plot.setSize({ width: 330, height: 200 });
    const afterPrint = (): void => plot.setSize({ width: Math.max(200, element.clientWidth), height });
    addEventListener("beforeprint", beforePrint);
    addEventListener("afterprint", afterPrint);
    const dark = matchMedia("(prefers-color-scheme: dark)");
    const redraw = (): void => plot.redraw();
    dark.addEventListener("change", redraw);
    const stop = effect(() => placeLine(plot));
    const stopGrowing = state.grownSlowly.subscribe((grown) => {
      if (grown !== 0) plot.setData([run.time, ...calcValues(run, group)]);
    });
    return () => {
      stop();
      stopGrowing();
      observer.disconnect();
      removeEventListener("beforeprint", beforePrint);
      removeEventListener("afterprint", afterPrint);
      dark.removeEventListener("change", redraw);
      plot.destroy();
    };
  }, [state]);

  return (
    <section class="panel plot" aria-label={group.title} data-plot={group.id}>
      <h2>{group.title}</h2>
      <PlotLegend state={state} group={group} values={values} />
      <div ref={holder} class="plot-holder" />
      {coherent !== undefined && (
        <p class="quiet plot-note">
          Ends at {formatTime(run.time[coherent] ?? 0)}, when less than half of the upper block holds together.
        </p>
      )}
      {props.note !== undefined && <p class="quiet plot-note">{props.note}</p>}
      <DataTable state={state} group={group} values={values} />
    </section>
  );
}

export function niceRange(low: number | null, high: number | null): [number, number] {
  if (low === null || high === null || !Number.isFinite(low + high)) return [0, 1];
  const a = Math.min(0, low);
  const b = Math.max(0, high);
  if (a === b) return [0, 1];
  const margin = 0.06 * (b - a);
  return [a < 0 ? a - margin : 0, b > 0 ? b + margin : 0];
}

function PlotLegend(props: { state: State; group: Group; values: (number | null)[][] }) {
  const { state, group, values } = props;
  const frames = values[0]?.length ?? 0;
  const frame = Math.min(state.frame.value, frames - 1); // frames may have come since
  const largest = useMemo(() => findLargest(values), [values, frames]);
  return (
    <ul class="plot-legend">
      {group.series.map((s, i) => (
        <li>
          <svg width="26" height="8" aria-hidden="true">
            <line
              x1="0" y1="4" x2="26" y2="4" stroke-width="2.2"
              style={{ stroke: `var(--series-${i % seriesColours.length})` }}
              stroke-dasharray={dashOfSeries(i).join(" ")}
            />
          </svg>
          {s.title} <span class="number now">{formatValue(dropRoundOff(values[i]?.[frame], largest), group.unit)}</span>
        </li>
      ))}
    </ul>
  );
}

function DataTable(props: { state: State; group: Group; values: (number | null)[][] }) {
  const { state, group, values } = props;
  const [open, setOpen] = useState(false);
  return (
    <details class="data-table" onToggle={(e) => setOpen(e.currentTarget.open)}>
      <summary>Table of values</summary>
      {open && (
        <div class="scroller" tabIndex={0} role="region" aria-label={`Values of ${group.title}`}>
          <table>
            <thead>
              <tr>
                <th scope="col">time [s]</th>
                {group.series.map((s) => (
                  <th scope="col">{s.title}{group.unit === "" ? "" : ` [${group.unit}]`}</th>
                ))}
              </tr>
            </thead>
            <tbody>
              {state.run.time.map((t, frame) => (
                <tr>
                  <td>{t.toFixed(3)}</td>
                  {values.map((v) => (
                    <td>{formatNumber(v[frame])}</td>
                  ))}
                </tr>
              ))}
            </tbody>
          </table>
        </div>
      )}
    </details>
  );
}

export function Plots(props: { state: State; onSeek?: (time: number) => void; height?: number; titles?: Record<string, string>; notes?: Record<string, string> }) {
  const groups = makeGroups(props.state.run.series, props.titles);
  if (groups.length === 0 || props.state.run.time.length === 0)
    return <section class="panel"><h2>Plots</h2><p class="quiet">The record holds no series.</p></section>;
  return (
    <div class={`plots ${groups.length === 1 ? "one" : ""}`}>
      {groups.map((group) => (
        <PlotPanel key={`${group.id} ${group.unit}`} {...props} group={group} note={props.notes?.[group.id]} />
      ))}
    </div>
  );
}
