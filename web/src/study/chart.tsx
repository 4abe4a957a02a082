/// Plots as SVG: axes with round numbers, a place for marks, and a table of the values beside them.
import type { ComponentChildren } from "preact";
import { useEffect, useState } from "preact/hooks";
import { formatNumber } from "../units";

export interface Scale {
  low: number;
  high: number;
  to: (value: number) => number; // picture
}

export function makeScale(low: number, high: number, from: number, until: number): Scale {
  const width = high - low || 1;
  return { low, high, to: (v) => from + ((v - low) / width) * (until - from) };
}

/// Round numbers, about `count` of them.
export function makeTicks(low: number, high: number, count = 5): number[] {
  const width = high - low;
  if (!(width > 0) || !Number.isFinite(width)) return [low];
  const raw = width / count;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = ([1, 2, 2.5, 5, 10].find((s) => s * power >= raw * 0.999) ?? 10) * power;
  const ticks: number[] = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * width; ++k) ticks.push(k * step || 0);
  return ticks;
}

export const tickText = (v: number): string => String(Number(v.toPrecision(12))).replace("-", "−");

/// The range of values with a margin; never empty.
export function findRange(values: Iterable<number | null | undefined>, withZero = false): [number, number] {
  let low = withZero ? 0 : Infinity, high = withZero ? 0 : -Infinity;
  for (const v of values) if (v !== null && v !== undefined && Number.isFinite(v)) (low = Math.min(low, v)), (high = Math.max(high, v));
  if (!(low <= high)) return [0, 1];
  if (low === high) return [low - 0.5 * (Math.abs(low) || 1), high + 0.5 * (Math.abs(high) || 1)];
  const margin = 0.03 * (high - low);
  return [low - margin, high + margin];
}

const narrowQuery = "(max-width: 560px)";
const phoneWidth = 360;

/// The units that a picture has from left to right: fewer in a narrow window, so that its texts stay as large as they are.
export function useChartWidth(wide: number): number {
  const [narrow, setNarrow] = useState(() => matchMedia(narrowQuery).matches);
  useEffect(() => {
    const query = matchMedia(narrowQuery);
    const follow = (): void => setNarrow(query.matches);
    follow();
    query.addEventListener("change", follow);
    return () => query.removeEventListener("change", follow);
  }, []);
  return narrow ? Math.min(wide, phoneWidth) : wide;
}

interface ChartProps {
  label: string;
  x: [number, number];
  y: [number, number];
  xTitle: string;
  yTitle: string;
  width?: number;
  height?: number;
  children: (x: Scale, y: Scale) => ComponentChildren;
}

export function Chart(props: ChartProps) {
  const wide = props.width ?? 560;
  const width = useChartWidth(wide);
  const height = width < wide ? Math.min(props.height ?? 260, 0.8 * width) : (props.height ?? 260);
  const left = 52, right = 14, top = 10, bottom = 42;
  const x = makeScale(props.x[0], props.x[1], left, width - right);
  const y = makeScale(props.y[0], props.y[1], height - bottom, top);
  return (
    <svg class="chart" viewBox={`0 0 ${width} ${height}`} role="img" aria-label={props.label}>
      <g class="grid">
        {makeTicks(x.low, x.high, width / 90).map((t) => (
          <>
            <line x1={x.to(t)} x2={x.to(t)} y1={top} y2={height - bottom} />
            <text x={x.to(t)} y={height - bottom + 16} text-anchor="middle">{tickText(t)}</text>
          </>
        ))}
        {makeTicks(y.low, y.high, height / 50).map((t) => (
          <>
            <line x1={left} x2={width - right} y1={y.to(t)} y2={y.to(t)} />
            <text x={left - 6} y={y.to(t) + 4} text-anchor="end">{tickText(t)}</text>
          </>
        ))}
        <text class="axis-title" x={(left + width - right) / 2} y={height - 6} text-anchor="middle">{props.xTitle}</text>
        <text class="axis-title" x={14} y={(top + height - bottom) / 2} text-anchor="middle" transform={`rotate(-90 14 ${(top + height - bottom) / 2})`}>{props.yTitle}</text>
      </g>
      {props.children(x, y)}
    </svg>
  );
}

/// A path through points; gaps where a value is missing.
export function makePath(points: readonly (readonly [number, number | null | undefined])[], x: Scale, y: Scale): string {
  let path = "";
  let isDown = false;
  for (const [a, b] of points) {
    if (b === null || b === undefined || !Number.isFinite(b)) {
      isDown = false;
      continue;
    }
    path += `${isDown ? "L" : "M"}${x.to(a).toFixed(1)} ${y.to(b).toFixed(1)}`;
    isDown = true;
  }
  return path;
}

type Cell = string | number | null | undefined;

/// Rows that are made when the reader asks for them.
export function ValueTable(props: { label: string; head: string[]; rows: () => Cell[][] }) {
  const [open, setOpen] = useState(false);
  return (
    <details class="data-table" onToggle={(e) => setOpen(e.currentTarget.open)}>
      <summary>Table of values</summary>
      {open && (
        <div class="scroller" tabIndex={0} role="region" aria-label={`Values of ${props.label}`}>
          <table>
            <thead>
              <tr>{props.head.map((h) => <th scope="col">{h}</th>)}</tr>
            </thead>
            <tbody>
              {props.rows().map((row) => (
                <tr>{row.map((c) => <td>{typeof c === "string" ? c : formatNumber(c)}</td>)}</tr>
              ))}
            </tbody>
          </table>
        </div>
      )}
    </details>
  );
}
