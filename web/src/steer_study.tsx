/// Fuzzy studies from the page: membership functions and fans that grow, runs in parallel coordinates, one to play.
import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { EditList, useBranchPlan } from "./steer_plan";
import type { SteerState } from "./steer_state";
import type { Bounds, Sample, Study } from "./steer_wire";
import { atLeast, atMost, formatDuration, formatNumber, formatTime, prettify, toReadable } from "./units";
import { seriesColours } from "./vocabulary";

/// One fuzzy output so far: membership over the value.
function Membership(props: { bounds: Bounds; unit: string }) {
  const { bounds } = props;
  const { unit, factor } = toReadable(props.unit);
  const width = 230, height = 96, left = 8, bottom = 18;
  const points: [number, number][] = [];
  const order = bounds.alpha.map((alpha, k) => ({ alpha, low: bounds.low[k], high: bounds.high[k] })).sort((a, b) => a.alpha - b.alpha);
  for (const o of order) if (o.low !== null && o.low !== undefined) points.push([o.low * factor, o.alpha]);
  for (const o of [...order].reverse()) if (o.high !== null && o.high !== undefined) points.push([o.high * factor, o.alpha]);
  const least = Math.min(...points.map((p) => p[0])), most = Math.max(...points.map((p) => p[0]));
  const margin = most > least ? 0.05 * (most - least) : Math.abs(most) * 0.05 + 1e-9;
  const x = (v: number): number => left + ((v - least + margin) / (most - least + 2 * margin)) * (width - 2 * left);
  const y = (alpha: number): number => 6 + (1 - alpha) * (height - bottom - 6);
  return (
    <figure class="membership">
      <figcaption>{prettify(bounds.output)}{unit === "" ? "" : ` [${unit}]`}</figcaption>
      {points.length < 2 ? (
        <p class="quiet">Nothing yet.</p>
      ) : (
        <svg viewBox={`0 0 ${width} ${height}`} role="img" aria-label={`${bounds.output}: from ${formatNumber(least)} to ${formatNumber(most)} ${unit}`}>
          <line x1={left} x2={width - left} y1={y(0)} y2={y(0)} stroke="var(--line)" />
          <polygon points={points.map(([v, a]) => `${x(v).toFixed(1)},${y(a).toFixed(1)}`).join(" ")} fill="var(--accent-faint)" stroke="var(--series-0)" stroke-width="1.6" />
          {most > least ? (
            <>
              <text x={x(least)} y={height - 5} text-anchor="start">{formatNumber(least, 3)}</text>
              <text x={x(most)} y={height - 5} text-anchor="end">{formatNumber(most, 3)}</text>
            </>
          ) : (
            <text x={x(least)} y={height - 5} text-anchor="middle">{formatNumber(least, 3)}</text>
          )}
        </svg>
      )}
    </figure>
  );
}

/// An alpha-cut fan of an angle over time.
function Fan(props: { fans: NonNullable<Study["fans"]> }) {
  const { fans } = props;
  const width = 520, height = 170, left = 44, bottom = 22;
  const all = [...fans.low, ...fans.high].flat().filter((v): v is number => v !== null);
  if (all.length === 0 || fans.time.length < 2) return null;
  const turn = 180 / Math.PI;
  const least = Math.min(0, ...all) * turn, most = Math.max(0, ...all) * turn;
  const t0 = fans.time[0] as number, t1 = fans.time[fans.time.length - 1] as number;
  const x = (t: number): number => left + ((t - t0) / (t1 - t0)) * (width - left - 8);
  const y = (v: number): number => 6 + ((most - v) / Math.max(1e-9, most - least)) * (height - bottom - 6);
  const band = (k: number): string => {
    const up: string[] = [], down: string[] = [];
    fans.time.forEach((t, i) => {
      const low = fans.low[k]?.[i], high = fans.high[k]?.[i];
      if (low === null || low === undefined || high === null || high === undefined) return;
      up.push(`${x(t).toFixed(1)},${y(high * turn).toFixed(1)}`);
      down.unshift(`${x(t).toFixed(1)},${y(low * turn).toFixed(1)}`);
    });
    return [...up, ...down].join(" ");
  };
  const order = fans.alpha.map((alpha, k) => ({ alpha, k })).sort((a, b) => a.alpha - b.alpha);
  return (
    <figure class="fan">
      <figcaption>Tilt angle θ(t) [°] after the last stage: bands of the levels {order.map((o) => formatNumber(o.alpha, 2)).join(", ")}</figcaption>
      <svg viewBox={`0 0 ${width} ${height}`} role="img" aria-label="Fan of the tilt angle over time">
        {order.map(({ alpha, k }) => <polygon points={band(k)} fill="var(--series-0)" fill-opacity={0.18 + 0.2 * alpha} stroke="var(--series-0)" stroke-width="0.8" />)}
        <line x1={left} x2={left} y1="6" y2={height - bottom} stroke="var(--line)" />
        <line x1={left} x2={width - 8} y1={y(0)} y2={y(0)} stroke="var(--line)" />
        <text x={left - 5} y={y(most) + 9} text-anchor="end">{formatNumber(most, 3)}</text>
        <text x={left - 5} y={y(least)} text-anchor="end">{formatNumber(least, 3)}</text>
        <text x={left} y={height - 6}>{formatNumber(t0, 3)} s</text>
        <text x={width - 8} y={height - 6} text-anchor="end">{formatNumber(t1, 3)} s</text>
      </svg>
    </figure>
  );
}

interface Axis {
  name: string;
  unit: string;
  factor: number;
  least: number;
  most: number;
  value: (s: Sample) => number | null | undefined;
}

const mostAxes = 14;

/// Those that have room; half of it is kept for outputs.
export function chooseAxes<A extends { name: string }>(inputs: A[], outputs: A[]): { axes: A[]; left: string[] } {
  const taken = Math.min(inputs.length, Math.max(mostAxes / 2, mostAxes - outputs.length));
  const rest = mostAxes - taken;
  return { axes: [...inputs.slice(0, taken), ...outputs.slice(0, rest)], left: [...inputs.slice(taken), ...outputs.slice(rest)].map((a) => a.name) };
}

/// A line for each run through all its inputs and outputs. A click plays the nearest one.
function Parallel(props: { study: Study; samples: Sample[]; chosen: number; onChoose: (index: number) => void; onPlay: (index: number) => void }) {
  const { study, samples } = props;
  const canvas = useRef<HTMLCanvasElement>(null);
  const width = 900, height = 220, top = 34, bottom = 20, side = 50;
  const { axes, left } = useMemo(() => {
    const make = (name: string, unit: string, value: Axis["value"]): Axis => {
      const r = toReadable(unit);
      const values = samples.map(value).filter((v): v is number => v !== null && v !== undefined && Number.isFinite(v));
      return { name, unit: r.unit, factor: r.factor, least: Math.min(...values), most: Math.max(...values), value };
    };
    const spreads = (a: Axis): boolean => Number.isFinite(a.least) && a.most > a.least;
    const inputs = study.inputs.map((one, k) => make(one.name, one.unit, (s) => s.inputs[k])).filter(spreads);
    const outputs = study.outputs.map((one, k) => make(one.name, one.unit, (s) => s.outputs[k])).filter(spreads);
    return chooseAxes(inputs, outputs);
  }, [study.inputs, study.outputs, samples]);
  const x = (k: number): number => side + (k * (width - 2 * side)) / Math.max(1, axes.length - 1);
  const y = (a: Axis, v: number): number => top + (1 - (v - a.least) / (a.most - a.least)) * (height - top - bottom);
  const outcomes = [...new Set(samples.map((s) => s.outcome ?? "failed"))].sort();

  useEffect(() => {
    const ctx = canvas.current?.getContext("2d");
    if (ctx === null || ctx === undefined) return;
    ctx.setTransform(2, 0, 0, 2, 0, 0);
    ctx.clearRect(0, 0, width, height);
    const draw = (s: Sample, strong: boolean): void => {
      const k = outcomes.indexOf(s.outcome ?? "failed");
      ctx.strokeStyle = strong ? getComputedStyle(document.documentElement).getPropertyValue("--selection").trim() : (seriesColours[k % seriesColours.length] as string);
      ctx.globalAlpha = strong ? 1 : Math.min(0.6, Math.max(0.12, 30 / samples.length));
      ctx.lineWidth = strong ? 3 : 1.2;
      ctx.beginPath();
      axes.forEach((a, i) => {
        const v = a.value(s);
        if (v !== null && v !== undefined && Number.isFinite(v)) ctx.lineTo(x(i), y(a, v));
      });
      ctx.stroke();
    };
    for (const s of samples) if (s.index !== props.chosen) draw(s, false);
    const chosen = samples.find((s) => s.index === props.chosen);
    if (chosen !== undefined) draw(chosen, true);
    ctx.globalAlpha = 1;
  });

  const findNearest = (event: MouseEvent & { currentTarget: HTMLCanvasElement }): number => {
    const box = event.currentTarget.getBoundingClientRect();
    const px = ((event.clientX - box.left) / box.width) * width, py = ((event.clientY - box.top) / box.height) * height;
    const k = Math.max(0, Math.min(axes.length - 2, Math.floor(((px - side) / (width - 2 * side)) * (axes.length - 1))));
    const a = axes[k], b = axes[k + 1];
    if (a === undefined || b === undefined) return -1;
    const s = (px - x(k)) / (x(k + 1) - x(k));
    let best = -1, least = Infinity;
    for (const one of samples) {
      const va = a.value(one), vb = b.value(one);
      if (va === null || va === undefined || vb === null || vb === undefined) continue;
      const d = Math.abs(y(a, va) + s * (y(b, vb) - y(a, va)) - py);
      if (d < least) {
        least = d;
        best = one.index;
      }
    }
    return best;
  };
  if (axes.length < 2) return null;
  return (
    <figure class="parallel">
      <figcaption>
        Each line is a run; a click plays that collapse.{left.length > 0 && ` There is room for ${mostAxes} axes; in the table only: ${left.join(", ")}.`}{" "}
        {outcomes.map((o, k) => <span class="with-sign"><i class="line-swatch" style={{ background: seriesColours[k % seriesColours.length] }} /> {prettify(o)}</span>)}
      </figcaption>
      <div class="parallel-frame" style={{ aspectRatio: `${width} / ${height}` }}>
        <canvas ref={canvas} width={2 * width} height={2 * height} data-test="parallel" role="img" aria-label="Parallel coordinates of the runs; the table below has the same runs"
          onMouseMove={(e) => props.onChoose(findNearest(e))}
          onClick={(e) => {
            const index = findNearest(e);
            if (index >= 0) props.onPlay(index);
          }} />
        <svg viewBox={`0 0 ${width} ${height}`} aria-hidden="true">
          {axes.map((a, k) => (
            <g>
              <line x1={x(k)} x2={x(k)} y1={top} y2={height - bottom} stroke="var(--text-quiet)" />
              <text x={k === 0 ? 0 : k === axes.length - 1 ? width : x(k)} y={k % 2 === 0 ? 10 : 21} text-anchor={k === 0 ? "start" : k === axes.length - 1 ? "end" : "middle"}>{a.name.length > 18 ? `${a.name.slice(0, 17)}…` : a.name}{a.unit === "" ? "" : ` [${a.unit}]`}</text>
              <text x={x(k) + 3} y={top - 1}>{formatNumber(a.most * a.factor, 3)}</text>
              <text x={x(k)} y={height - 6} text-anchor="middle">{formatNumber(a.least * a.factor, 3)}</text>
            </g>
          ))}
        </svg>
      </div>
    </figure>
  );
}

function Possibilities(props: { study: Study }) {
  const { study } = props;
  if (study.possibilities.length === 0) return null;
  return (
    <table class="text-table">
      <caption>Outcomes so far</caption>
      <thead><tr><th scope="col">Outcome</th><th scope="col">possibility</th><th scope="col">necessity</th></tr></thead>
      <tbody>
        {study.possibilities.map((p) => (
          <tr>
            <th scope="row">{prettify(p.outcome)}</th>
            <td><span class="possibility"><i style={{ width: `${100 * (p.possibility ?? 0)}%` }} /></span> {atLeast(p.possibility, 3)}</td>
            <td>{atMost(p.necessity, 3)}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}

export function StudyPanel(props: { s: SteerState }) {
  const { s } = props;
  const [count, setCount] = useState("300");
  const [chosen, setChosen] = useState(-1);
  const [table, setTable] = useState(false);
  const branchPlan = useBranchPlan(s);
  const list = s.studies.value;
  const study = list.find((k) => k.id === s.watchedStudy.value);
  const samples = s.samples.value.get(s.watchedStudy.value) ?? [];
  const start = async (): Promise<void> => {
    const r = await s.ask<{ study: number }>("study.start", { samples: Math.max(2, Math.round(Number(count)) || 300) });
    if (r !== undefined) await s.watchStudy(r.study);
  };
  const play = (index: number): Promise<void> => s.playSample(s.watchedStudy.value, index);
  if (s.session.value?.fuzzy !== true)
    return <p class="quiet pad" data-test="no-fuzzy">The plan has no fuzzy values. Write a [fuzzy] table into it, and a study finds what they make possible.</p>;
  return (
    <div class="study" data-test="study-panel">
      <div class="editor-bar">
        <label>Runs at most <input class="count" inputMode="numeric" value={count} onInput={(e) => setCount(e.currentTarget.value)} /></label>
        <button type="button" class="main-button" data-test="study-start" onClick={() => void start()}>Start a study</button>
        {list.map((k) => (
          <button type="button" class="small" aria-pressed={k.id === s.watchedStudy.value} onClick={() => void s.watchStudy(k.id)}>Study {k.id}: {k.done} of {k.limit}</button>
        ))}
        {study !== undefined && (
          <>
            <progress max={study.limit} value={study.done} aria-label="Runs done" />
            <span data-test="study-state">{study.state}, {study.done} of {study.limit} runs{study.failed > 0 ? `, ${study.failed} failed` : ""}</span>
            {study.state === "running" && study.eta !== null && <span class="quiet">{formatDuration(Math.ceil(study.eta))} to go</span>}
            {study.state === "running" && <button type="button" onClick={() => void s.ask("study.cancel", { study: study.id })}>Cancel</button>}
            <a href={`api/studies/${study.id}/study.html`} target="_blank" rel="noopener">Page of the study</a>
          </>
        )}
      </div>
      {branchPlan !== null && branchPlan.taken.length + branchPlan.left_out.length > 0 && (
        <details class="pad" open={branchPlan.left_out.length > 0} data-test="study-edits">
          <summary>A study takes the plan of branch “{s.branch.value?.name}”: {branchPlan.taken.length} of {branchPlan.taken.length + branchPlan.left_out.length} edits are in it</summary>
          <EditList title="In it, from the start:" list={branchPlan.taken} test="taken" />
          <EditList title="Not in it:" list={branchPlan.left_out} test="left-out" />
        </details>
      )}
      {study === undefined ? (
        <p class="quiet pad">A study runs the plan at many points of its fuzzy values and tells what is possible. It goes on while you steer.</p>
      ) : (
        <div class="study-body">
          {study.text !== "" && <p>{prettify(study.text)}</p>}
          <div class="memberships">
            {study.bounds.map((b) => <Membership bounds={b} unit={study.outputs.find((o) => o.name === b.output)?.unit ?? ""} />)}
          </div>
          {study.fans !== null && <Fan fans={study.fans} />}
          <Parallel study={study} samples={samples} chosen={chosen} onChoose={setChosen} onPlay={(i) => void play(i)} />
          <Possibilities study={study} />
          <details class="data-table" onToggle={(e) => setTable(e.currentTarget.open)}>
            <summary>Table of the runs</summary>
            {table && (
              <div class="scroller" tabIndex={0} role="region" aria-label="Runs">
                <table>
                  <thead>
                    <tr><th scope="col">Run</th><th scope="col" />{[...study.inputs, ...study.outputs].map((c) => <th scope="col">{c.name} {toReadable(c.unit).unit === "" ? "" : `[${toReadable(c.unit).unit}]`}</th>)}<th scope="col">outcome</th></tr>
                  </thead>
                  <tbody>
                    {samples.map((one) => (
                      <tr class={one.index === chosen ? "chosen" : ""}>
                        <th scope="row">{one.index}</th>
                        <td><button type="button" class="small" data-test="play-sample" onClick={() => void play(one.index)}>Play</button></td>
                        {study.inputs.map((c, k) => <td>{formatNumber(one.inputs[k] === null || one.inputs[k] === undefined ? null : (one.inputs[k] as number) * toReadable(c.unit).factor)}</td>)}
                        {study.outputs.map((c, k) => <td>{formatNumber(one.outputs[k] === null || one.outputs[k] === undefined ? null : (one.outputs[k] as number) * toReadable(c.unit).factor)}</td>)}
                        <td>{one.outcome ?? "failed"}</td>
                      </tr>
                    ))}
                  </tbody>
                </table>
              </div>
            )}
          </details>
          <p class="quiet">{study.state === "running" ? "Running for" : "It ran for"} {formatTime(study.seconds)}.</p>
        </div>
      )}
    </div>
  );
}
