/// Right side: the chosen member with its zones and the path of one of them on its curves; below it the verdict.
import { useEffect, useRef, useState } from "preact/hooks";
import uPlot from "uplot";
import { findHeadline, findStatusOfLimits, findVerdict, openStatuses } from "./findings";
import { Inspector } from "./inspector";
import { axis, cssColour, namePlot, niceRange } from "./plots";
import { StatusSign, StatusWord } from "./signs";
import { MemberFacts } from "./steer_member";
import type { SteerState } from "./steer_state";
import type { LawFamily, ZoneWatch } from "./steer_wire";
import { endingWord, zoneStates } from "./vocabulary";
import { formatNumber, formatTime, prettify } from "./units";
import { findZonesOfBodies } from "./zones";

type Axis = "y" | "z";

/// Curves of the family and the path, as columns that uPlot can draw: rotation [°], moment [kNm].
function makeCurves(law: LawFamily | undefined, path: (number | null)[][], which: Axis): { data: uPlot.AlignedData; names: string[] } {
  const tracks: { name: string; points: [number, number][] }[] = [];
  const turn = 180 / Math.PI;
  law?.normal_force.forEach((force, row) => {
    const points: [number, number][] = [];
    const rotations = law.plastic_rotation;
    for (let k = rotations.length - 1; k >= 0; --k) {
      const m = law.negative[row]?.[k];
      // A negative branch may be given as sizes.
      // Both signs begin at 0: a hair apart, so that a curve rises there instead of leaning.
      if (m !== null && m !== undefined) points.push([-(rotations[k] as number) * turn - 1e-9, -Math.abs(m) / 1000]);
    }
    rotations.forEach((r, k) => {
      const m = law.positive[row]?.[k];
      if (m !== null && m !== undefined) points.push([r * turn, m / 1000]);
    });
    tracks.push({ name: `N = ${formatNumber(force / 1000, 3)} kN`, points });
  });
  const column = which === "y" ? 2 : 3;
  const way: [number, number][] = [];
  for (const p of path) {
    const r = p[column + 2], m = p[column];
    if (r !== null && r !== undefined && m !== null && m !== undefined) way.push([r * turn, m / 1000]);
  }
  // uPlot wants rising abscissae: the path is drawn by hand from the last column on.
  const xs = [...new Set(tracks.flatMap((t) => t.points.map((p) => p[0])))].sort((a, b) => a - b);
  if (xs.length === 0) xs.push(...[...new Set(way.map((p) => p[0]))].sort((a, b) => a - b));
  const ys = tracks.map((t) => {
    const at = new Map(t.points);
    return xs.map((x) => at.get(x) ?? null);
  });
  return { data: [xs, ...ys], names: tracks.map((t) => t.name) };
}

export function ZonePlot(props: { s: SteerState; zone: ZoneWatch }) {
  const { s, zone } = props;
  const holder = useRef<HTMLDivElement>(null);
  const [chosen, setWhich] = useState<{ zone: string; axis: Axis } | null>(null);
  const isHinge = zone.path.length > 0 && zone.path.every((p) => p[2] === null);  // it turns about its z alone
  const largest = (column: number) => zone.path.reduce((most, p) => Math.max(most, Math.abs(p[column] ?? 0)), 0);
  const own = chosen !== null && chosen.zone === zone.zone ? chosen.axis : null;
  const which: Axis = isHinge ? "z" : own ?? (largest(3) > largest(2) ? "z" : "y");
  const [table, setTable] = useState(false);
  const law = zone.law === null ? undefined : which === "y" ? zone.law.moment_y : zone.law.moment_z;
  const latest = useRef(zone.path);
  latest.current = zone.path;
  const plotRef = useRef<uPlot | undefined>(undefined);
  const column = which === "y" ? 2 : 3;

  useEffect(() => {
    const element = holder.current;
    if (element === null) return;
    const { data, names } = makeCurves(law, latest.current, which);
    const turn = 180 / Math.PI;
    const visible = (): [number, number][] => {
      const t = s.view.peek()?.state.timeSlowly.peek() ?? Infinity;
      const out: [number, number][] = [];
      for (const p of latest.current) {
        const r = p[column + 2], m = p[column];
        if ((p[0] as number) <= t + 1e-9 && r !== null && r !== undefined && m !== null && m !== undefined) out.push([r * turn, m / 1000]);
      }
      return out;
    };
    // The curve for the normal force that is nearest to the present one stands out.
    const nearest = (): number => {
      const t = s.view.peek()?.state.timeSlowly.peek() ?? Infinity;
      const now = [...latest.current].reverse().find((p) => (p[0] as number) <= t + 1e-9)?.[1];
      if (now === null || now === undefined || law === undefined) return -1;
      return law.normal_force.reduce((best, f, k) => (Math.abs(f - now) < Math.abs((law.normal_force[best] as number) - now) ? k : best), 0);
    };
    const plot = new uPlot(
      {
        width: Math.max(200, element.clientWidth), height: 190, padding: [8, 10, 0, 0],
        legend: { show: false }, cursor: { show: false },
        scales: {
          x: { time: false, range: () => {
            const way = visible();
            const reach = Math.max(0.2, ...way.map((p) => Math.abs(p[0]) * 1.3));
            const all = Math.max(0, ...(data[0] as number[]).map(Math.abs));
            const most = all > 0 ? Math.min(Math.max(reach, all * 0.05), Math.max(all, reach)) : reach;
            return [-most, most];
          } },
          y: { range: (_, low, high) => {
            const way = visible().map((p) => p[1]);
            return niceRange(Math.min(low ?? 0, ...way), Math.max(high ?? 0, ...way));
          } },
        },
        axes: [axis("rotation [°]", true), axis("[kNm]", false)],
        series: [{}, ...names.map((label, k) => ({ label, stroke: () => cssColour(k === nearest() ? "--series-0" : "--line"), width: 1.2, spanGaps: true, points: { show: false } }))],
        hooks: {
          draw: [
            (u) => {
              const way = visible();
              if (way.length === 0) return;
              const { ctx } = u;
              ctx.save();
              ctx.beginPath();
              ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
              ctx.clip();
              ctx.strokeStyle = cssColour("--series-1");
              ctx.lineWidth = 2;
              ctx.beginPath();
              for (const [x, y] of way) ctx.lineTo(u.valToPos(x, "x", true), u.valToPos(y, "y", true));
              ctx.stroke();
              const [x, y] = way[way.length - 1] as [number, number];
              ctx.fillStyle = cssColour("--series-1");
              ctx.beginPath();
              ctx.arc(u.valToPos(x, "x", true), u.valToPos(y, "y", true), 5, 0, 7);
              ctx.fill();
              ctx.restore();
            },
          ],
        },
      },
      data.length > 1 ? data : [data[0] as number[]],
      element,
    );
    namePlot(plot, `Bending moment over rotation of ${zone.zone}`);
    plotRef.current = plot;
    const observer = new ResizeObserver(() => plot.setSize({ width: Math.max(200, element.clientWidth), height: 190 }));
    observer.observe(element);
    return () => {
      observer.disconnect();
      plot.destroy();
      plotRef.current = undefined;
    };
  }, [zone.zone, law, which, s.colouring.value]);

  const time = s.view.value?.state.timeSlowly.value;
  void s.view.value?.state.grownSlowly.value;
  useEffect(() => {
    plotRef.current?.redraw(true, true);
  }, [time, zone.path]);

  const now = [...zone.path].reverse().find((p) => (p[0] as number) <= (time ?? Infinity) + 1e-9);
  return (
    <section class="zone-plot" aria-label={`Path of ${zone.zone}`} data-test="zone-plot">
      <div class="inspector-head">
        <h3>{zone.zone}</h3>
        <span class="small-group" role="group" aria-label="Axis of bending">
          {(isHinge ? ["z"] as const : ["y", "z"] as const).map((a) => <button type="button" class="small" aria-pressed={which === a} onClick={() => setWhich({ zone: zone.zone, axis: a })}>M{a}</button>)}
          <button type="button" class="small" aria-label="Stop watching this zone" onClick={() => void s.watchZone(null)}>×</button>
        </span>
      </div>
      <div ref={holder} />
      <p class="quiet">
        <i class="line-swatch" style={{ background: "var(--series-1)" }} /> path so far
        {law !== undefined && <>, over the whole rotation · <i class="line-swatch" style={{ background: "var(--line)" }} /> {law.normal_force.length} curves over the plastic one, for N from {formatNumber(Math.min(...law.normal_force) / 1000, 3)} to {formatNumber(Math.max(...law.normal_force) / 1000, 3)} kN (tension positive) · <i class="line-swatch" style={{ background: "var(--series-0)" }} /> that nearest to the present N</>}
        {zone.law === null && " · this zone has no curves of its own"}
      </p>
      {now !== undefined && (
        <p class="number">N {formatNumber((now[1] ?? NaN) / 1000, 3)} kN, M{which} {formatNumber((now[column] ?? NaN) / 1000, 3)} kNm, {zoneStates[now[7] ?? 0]?.word}</p>
      )}
      <details class="data-table" onToggle={(e) => setTable(e.currentTarget.open)}>
        <summary>Table of values</summary>
        {table && (
          <div class="scroller" tabIndex={0} role="region" aria-label={`Path of ${zone.zone}`}>
            <table>
              <thead><tr>{["time [s]", "N [kN]", "My [kNm]", "Mz [kNm]", "ry [°]", "rz [°]"].map((h) => <th scope="col">{h}</th>)}</tr></thead>
              <tbody>
                {zone.path.slice(-500).map((p) => (
                  <tr>
                    <td>{(p[0] as number).toFixed(3)}</td>
                    {[1, 2, 3].map((k) => <td>{formatNumber(p[k] === null ? null : (p[k] as number) / 1000)}</td>)}
                    {[4, 5].map((k) => <td>{formatNumber(p[k] === null ? null : ((p[k] as number) * 180) / Math.PI)}</td>)}
                  </tr>
                ))}
              </tbody>
            </table>
          </div>
        )}
      </details>
    </section>
  );
}

function ZoneButtons(props: { s: SteerState }) {
  const { s } = props;
  const run = s.view.value?.run;
  const body = run?.bodies[s.selected.value];
  if (run === undefined || body === undefined) return null;
  const zones = findZonesOfBodies(run)[s.selected.value] ?? [];
  return (
    <div class="zone-buttons">
      {zones.slice(0, 6).map((z) => {
        const name = run.zones[z]?.name ?? "";
        return (
          <button type="button" class="small" aria-pressed={s.zone.value?.zone === name} data-test="watch-zone" onClick={() => void s.watchZone(name)}>
            M–φ of {name.split("/").pop()}
          </button>
        );
      })}
      <button type="button" class="small" onClick={() => (s.dialog.value = { kind: "charge", member: body.name })}>Charge…</button>
      <button type="button" class="small" onClick={() => (s.dialog.value = { kind: "pre_cut", member: body.name })}>Cut…</button>
      <button type="button" class="small" onClick={() => (s.dialog.value = { kind: "cable", member: body.name })}>Cable…</button>
    </div>
  );
}

function Verdict(props: { s: SteerState }) {
  const { s } = props;
  const result = s.findings.value;
  const list = result?.findings ?? [];
  const first = findVerdict({ findings: list });
  const headline = findHeadline(list);
  const ofLimits = findStatusOfLimits(list);
  const others = list.filter((f) => f !== first && (openStatuses.includes(f.status) || f.id.startsWith("clearance.")));
  others.sort((a, b) => Number(b.status === "bad") - Number(a.status === "bad"));
  const ending = s.progress.value?.ending ?? s.branch.value?.ending ?? null;
  // the run may be further on, or at its end, before its findings come
  const isSoFar = result === null ? ending === null : result.ending?.kind === "under_way" || result.branch !== s.active.value;
  const of = result === null || result.branch === s.active.value ? undefined : s.branches.value.find((b) => b.id === result.branch)?.name;
  return (
    <section class="verdict-panel" aria-label="Verdict" data-test="verdict-panel">
      <h2>Verdict {isSoFar && <span class="quiet" data-test="verdict-time">so far{result?.time !== undefined && `, at ${formatTime(result.time)}`}{of !== undefined && ` of “${of}”`}</span>}</h2>
      {first === undefined || (isSoFar && (result?.time ?? 0) < 1e-9) ? (
        <p class="quiet">Nothing yet: findings come as the run goes on.</p>
      ) : (
        <div class={`verdict ${headline}`}>
          <StatusSign status={headline} size={24} />
          <div>
            <p class="verdict-title">
              {first.title} <StatusWord status={first.status} />
              {ofLimits !== undefined && <span class="verdict-limits">Limits <StatusWord status={ofLimits} /></span>}
            </p>
            <p data-test="verdict">{prettify(first.text)}</p>
          </div>
        </div>
      )}
      {others.slice(0, 6).map((f) => (
        <div class="finding">
          <StatusSign status={f.status} size={15} />
          <div><p class="finding-title">{f.title} <StatusWord status={f.status} /></p><p>{prettify(f.text)}</p></div>
        </div>
      ))}
      {ending !== null && <p class="ending-text" data-test="ending"><strong>{endingWord[ending.kind] ?? ending.kind}</strong>: {prettify(ending.text)}</p>}
      {list.length > 0 && <button type="button" class="small" onClick={() => (s.tab.value = "findings")}>All {list.length} findings</button>}
    </section>
  );
}

export function Side(props: { s: SteerState }) {
  const { s } = props;
  const view = s.view.value;
  if (view === null) return null;
  const nobody = view.run.bodies[s.selected.value] === undefined;
  return (
    <aside class="steer-side" aria-label="Member and verdict">
      {nobody && <Verdict s={s} />}
      {nobody && s.zone.value === null && <p class="quiet hint">Click a member in the picture, or name one above it, to see its zones, resistance curves and state.</p>}
      {!nobody && <h2 class="visually-hidden">Member</h2>}
      {!nobody && <ZoneButtons s={s} />}
      {s.zone.value !== null && <ZonePlot s={s} zone={s.zone.value} />}
      {!nobody && <MemberFacts s={s} />}
      {!nobody && <Inspector state={view.state} />}
      {!nobody && <Verdict s={s} />}
    </aside>
  );
}
