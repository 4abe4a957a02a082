import { useState } from "preact/hooks";
import { digitsWithin, formatNumber } from "../units";
import type { Point } from "../data";
import { Chart, ValueTable, findRange, makePath, makeScale, makeTicks, tickText, useChartWidth } from "./chart";
import { titleOf, unitWord, type Fan, type Level, type Output, type Study } from "./data";
import { calcWidth, placeLabels, walk, type Label } from "./labels";
import { lookOf, nameOf, type State } from "./state";
import { OutcomeName } from "./verdict";

/// Up the left side and down the right one.
function makeShape(levels: readonly Level[]): [number, number][] {
  const known = levels.filter((l) => l.lower !== null && l.upper !== null);
  return [
    ...known.map((l): [number, number] => [l.lower as number, l.alpha]),
    ...known.reverse().map((l): [number, number] => [l.upper as number, l.alpha]),
  ];
}

function Membership(props: { study: Study; output: Output; index: number }) {
  const { study, output, index } = props;
  const classes = study.outcomes.flatMap((o, i) => {
    const of = o.outputs[index];
    return of === undefined || o.is_failure ? [] : [{ outcome: o, i, output: of }];
  });
  const parts = classes.length > 1 ? classes : [];
  const digits = digitsWithin(output.levels[0]?.lower ?? 0, output.levels[0]?.upper ?? 0);
  const open = output.levels.some((l) => !l.converged[0] || !l.converged[1]);
  const rows = () =>
    [{ name: "all runs", output }, ...parts.map((c) => ({ name: nameOf(c.outcome), output: c.output }))].flatMap(({ name, output: o }) =>
      o.levels.map((l) => [name, l.alpha, formatNumber(l.lower, digits), formatNumber(l.upper, digits), l.converged[0] && l.converged[1] ? "yes" : "no"]),
    );
  return (
    <section class="panel plot" aria-label={`Membership of ${output.name}`} data-membership={output.name}>
      <h3>{titleOf(output)}</h3>
      <Chart
        label={`Membership function of ${output.name}: at degree 0 from ${formatNumber(output.levels[0]?.lower, digits)} to ${formatNumber(output.levels[0]?.upper, digits)}`}
        x={findRange(output.levels.flatMap((l) => [l.lower, l.upper]))} y={[0, 1.04]} xTitle={titleOf(output)} yTitle="degree" width={400} height={210}
      >
        {(x, y) => (
          <>
            <path class="whole" d={`${makePath(makeShape(output.levels), x, y)}Z`} />
            {parts.map((c) => {
              const look = lookOf(study.outcomes, c.i);
              return <path class="part" d={makePath(makeShape(c.output.levels), x, y)} style={{ stroke: look.colour }} stroke-dasharray={look.dash.join(" ")} />;
            })}
          </>
        )}
      </Chart>
      <p class="quiet plot-note">
        centroid {formatNumber(output.centroid, digits)} {unitWord(output.unit)}
        {typeof output.robustness === "number" && ` · robustness ${formatNumber(output.robustness, 3)}`}
        {open && " · searches have not converged at every level: the true shape may be wider"}
      </p>
      <ValueTable label={output.name} head={["runs", "degree", "lower", "upper", "converged"]} rows={rows} />
    </section>
  );
}

export function Legend(props: { study: Study }) {
  const { study } = props;
  const named = study.outcomes.filter((o) => !o.is_failure);
  if (named.length < 2) return null;
  return (
    <ul class="plot-legend">
      <li><span class="swatch whole-swatch" /> all runs</li>
      {study.outcomes.map((o, i) => {
        if (o.is_failure) return null;
        const look = lookOf(study.outcomes, i);
        return (
          <li>
            <svg width="26" height="8" aria-hidden="true">
              <line x1="0" y1="4" x2="26" y2="4" stroke-width="2.2" style={{ stroke: look.colour }} stroke-dasharray={look.dash.join(" ")} />
            </svg>
            <OutcomeName study={study} index={i} />
          </li>
        );
      })}
    </ul>
  );
}

export function Memberships(props: { state: State }) {
  const { study } = props.state;
  if (study.outputs.length === 0) return null;
  return (
    <section class="group" aria-label="Fuzzy results">
      <h2>Fuzzy results</h2>
      <p class="quiet">Each value with the degree to which it is possible; of each outcome by itself too. Between the levels shapes are drawn straight.</p>
      <Legend study={study} />
      <div class="small-plots">
        {study.outputs.map((output, index) => <Membership study={study} output={output} index={index} />)}
      </div>
    </section>
  );
}

function ChooseOutcome(props: { study: Study; names: string[]; chosen: number; onChoose: (i: number) => void }) {
  if (props.names.length < 2) return null;
  return (
    <label class="choose">
      Runs{" "}
      <select value={props.chosen} onChange={(e) => props.onChoose(Number(e.currentTarget.value))}>
        {props.names.map((name, i) => <option value={i}>{name}</option>)}
      </select>
    </label>
  );
}
const wordsOf = (one: { is_all: boolean; outcome: string }): string => (one.is_all ? "all" : `only with the outcome ${one.outcome || "(no name)"}`);

const mostLines = 400;

function FanPlot(props: { study: Study; name: string }) {
  const { study, name } = props;
  const fans = study.fans.filter((f) => f.curve === name);
  const [chosen, setChosen] = useState(0);
  const [lines, setLines] = useState(true);
  const curve = study.curves.find((c) => c.name === name && !c.is_outline);
  const fan = fans[Math.min(chosen, fans.length - 1)] as Fan | undefined;
  if (curve === undefined || fan === undefined) return null;
  const table = study.run_table;
  let begin = 0;
  for (const c of study.curves) {
    if (c === curve) break;
    if (!c.is_outline) begin += c.at.length;
  }
  const all = table.sample.map((_, r) => r).filter((r) => fan.is_all || study.outcomes[table.outcome[r] as number]?.name === fan.outcome);
  const drawn = lines ? all.filter((_, k) => k % Math.ceil(all.length / mostLines) === 0) : [];
  const unit = unitWord(curve.unit);
  return (
    <section class="panel plot" aria-label={`Fan of ${name}`} data-fan={name}>
      <h2>{name} over {curve.over}</h2>
      <div class="tools">
        <ChooseOutcome study={study} names={fans.map(wordsOf)} chosen={chosen} onChoose={setChosen} />
        <label><input type="checkbox" checked={lines} onChange={(e) => setLines(e.currentTarget.checked)} /> single runs</label>
      </div>
      <Legend study={study} />
      <Chart
        label={`Envelopes of ${name} by degree of possibility`} x={[curve.at[0] ?? 0, curve.at[curve.at.length - 1] ?? 1]}
        y={findRange(fans[0]?.levels.flatMap((l) => [...l.lower, ...l.upper]) ?? [], true)}
        xTitle={curve.over_unit === "" ? curve.over : `${curve.over} [${unitWord(curve.over_unit)}]`} yTitle={unit === "" ? name : `${name} [${unit}]`}
        width={680} height={430}
      >
        {(x, y) => (
          <>
            {fan.levels.map((l) => {
              const at = curve.at.slice(0, l.lower.length);
              const up = at.map((t, k): [number, number | null] => [t, l.upper[k] ?? null]).filter((p) => p[1] !== null);
              const down = at.map((t, k): [number, number | null] => [t, l.lower[k] ?? null]).filter((p) => p[1] !== null).reverse();
              return up.length === 0 ? null : <path class="band" d={`${makePath([...up, ...down], x, y)}Z`} />;
            })}
            {drawn.map((r) => {
              const look = lookOf(study.outcomes, table.outcome[r] as number);
              const points = curve.at.map((t, k): [number, number] => [t, table.trajectories[r * table.points + begin + k] as number]);
              return <path class="run-line" d={makePath(points, x, y)} style={{ stroke: look.colour }} />;
            })}
            <line class="zero" x1={x.to(x.low)} x2={x.to(x.high)} y1={y.to(0)} y2={y.to(0)} />
          </>
        )}
      </Chart>
      <p class="quiet plot-note">
        Bands from light to dark: degrees {fan.levels.map((l) => l.alpha).join(", ")}. Envelopes of runs that were made, hence never too wide; no
        single run need follow one. {lines && (drawn.length < all.length ? `${drawn.length} of ${all.length} runs are drawn.` : `All ${all.length} runs are drawn.`)}
      </p>
      <ValueTable
        label={name} head={[curve.over, ...fan.levels.flatMap((l) => [`lower at ${l.alpha}`, `upper at ${l.alpha}`])]}
        rows={() => curve.at.map((t, k) => [String(t), ...fan.levels.flatMap((l) => [l.lower[k], l.upper[k]])])}
      />
    </section>
  );
}

export function Fans(props: { state: State }) {
  const names = props.state.study.curves.filter((c) => !c.is_outline).map((c) => c.name);
  return <>{names.map((name) => <FanPlot study={props.state.study} name={name} />)}</>;
}

const pathOf = (corners: readonly Point[], x: (v: number) => number, y: (v: number) => number): string =>
  corners.length === 0 ? "" : `${corners.map((p, i) => `${i === 0 ? "M" : "L"}${x(p[0]).toFixed(1)} ${y(p[1]).toFixed(1)}`).join("")}Z`;

interface Outline {
  from: number;
  to: number; // degrees
  corners: Point[];
}

/// Of degrees from the lowest on; those that cannot be told apart are one.
function findOutlines(levels: readonly { alpha: number; corners: Point[] }[]): Outline[] {
  const outlines: Outline[] = [];
  for (const { alpha, corners } of levels) {
    const last = outlines[outlines.length - 1];
    const isSame = last?.corners.length === corners.length && last.corners.every(([x, y], k) => Math.hypot(x - (corners[k] as Point)[0], y - (corners[k] as Point)[1]) < 1);
    if (last !== undefined && isSame) last.to = alpha;
    else if (corners.length > 0) outlines.push({ from: alpha, to: alpha, corners });
  }
  return outlines;
}

/// Names above, below or within the neighbours, degrees on their outlines. In units of the picture.
function label(outlines: readonly Outline[], neighbours: readonly { name: string; corners: Point[] }[], buildings: readonly (readonly Point[])[]): Label[] {
  const lines = outlines.map((o) => walk(o.corners, 8));
  const building = buildings.flatMap((b) => walk(b, 8));
  const areas = neighbours.flatMap((n) => walk(n.corners, 8));
  return [
    ...neighbours.map(({ name, corners }): Label => {
      const xs = corners.map((p) => p[0]), ys = corners.map((p) => p[1]), half = calcWidth(name) / 2;
      const west = Math.min(...xs), east = Math.max(...xs), top = Math.min(...ys), foot = Math.max(...ys);
      const places = [top - 9, foot + 9, (top + foot) / 2].flatMap((y) => [(west + east) / 2, west + half, east - half].map((x): Point => [x, y]));
      return { text: name, places, avoid: [...building, ...areas, ...lines.flat()] };
    }),
    ...outlines.map((o, i): Label => ({
      text: o.from === o.to ? String(o.from) : `${o.from}–${o.to}`,
      places: [...(lines[i] as Point[])].sort((a, b) => a[1] - b[1]),
      avoid: [...building, ...areas, ...lines.filter((_, k) => k !== i).flat()],
    })),
  ];
}

export function DebrisPlan(props: { state: State }) {
  const { study } = props.state;
  const [chosen, setChosen] = useState(0);
  const width = useChartWidth(700);
  const debris = study.debris[Math.min(chosen, study.debris.length - 1)];
  if (debris === undefined) return null;
  // pages of earlier versions have the rectangle around it
  const buildings = study.site.outlines !== undefined && study.site.outlines.length > 0 ? study.site.outlines : [study.site.footprint];
  const points = [...study.site.footprint, ...study.site.neighbours.flatMap((n) => n.footprint), ...study.debris.flatMap((d) => d.levels.flatMap((l) => l.corners))];
  const xs = findRange(points.map((p) => p[0])), ys = findRange(points.map((p) => p[1]));
  const margin = 34;
  const scale = (width - 2 * margin) / (xs[1] - xs[0]);
  const height = Math.min(700, scale * (ys[1] - ys[0]) + 2 * margin);
  const factor = Math.min(scale, (height - 2 * margin) / (ys[1] - ys[0]));
  const middle = (xs[0] + xs[1]) / 2;
  const x = (v: number): number => width / 2 + (v - middle) * factor;
  const y = makeScale(ys[0], ys[1], height - margin, height - margin - factor * (ys[1] - ys[0])).to;
  const toPicture = (corners: readonly Point[]): Point[] => corners.map((p) => [x(p[0]), y(p[1])]);
  // as many as their numbers have room for, in a narrow plan as well
  const countTicks = (range: readonly [number, number]): number => Math.max(1, Math.min(8, Math.floor((factor * (range[1] - range[0])) / 45)));
  const outlines = findOutlines(debris.levels.map((l) => ({ alpha: l.alpha, corners: toPicture(l.corners) })));
  const labels = label(outlines, study.site.neighbours.map((n) => ({ name: n.name, corners: toPicture(n.footprint) })), buildings.map(toPicture));
  const places = placeLabels(labels, { left: margin, right: width, top: 0, foot: height - margin });
  return (
    <section class="panel plot" aria-label="Debris" data-test="debris">
      <h2>Where parts may lie</h2>
      <div class="tools">
        <ChooseOutcome study={study} names={study.debris.map(wordsOf)} chosen={chosen} onChoose={setChosen} />
      </div>
      <svg class="chart site-plan" viewBox={`0 0 ${width} ${height}`} role="img" aria-label="Site plan with the outline of parts by degree of possibility">
        <g class="grid">
          {makeTicks(xs[0], xs[1], countTicks(xs)).map((t) => (
            <>
              <line x1={x(t)} x2={x(t)} y1={margin} y2={height - margin} />
              <text x={x(t)} y={height - margin + 16} text-anchor="middle">{tickText(t)}</text>
            </>
          ))}
          {makeTicks(ys[0], ys[1], countTicks(ys)).map((t) => (
            <>
              <line x1={margin} x2={width - margin} y1={y(t)} y2={y(t)} />
              <text x={margin - 5} y={y(t) + 4} text-anchor="end">{tickText(t)}</text>
            </>
          ))}
          <text class="axis-title" x={width - margin} y={height - 4} text-anchor="end">x [m]</text>
          <text class="axis-title" x={4} y={margin - 12}>y [m]</text>
        </g>
        {study.site.neighbours.map((n) => (
          <path class={n.is_utility ? "utility-area" : "neighbour-area"} d={pathOf(n.footprint, x, y)}><title data-name>{n.name}</title></path>
        ))}
        {debris.levels.map((l) => <path class="debris" d={pathOf(l.corners, x, y)} />)}
        <path class="footprint" d={buildings.map((b) => pathOf(b, x, y)).join("")} />
        {places.map((place, i) => place !== undefined && (
          <text class="level-text" x={place[0]} y={place[1] + 4} text-anchor="middle">{labels[i]?.text}</text>
        ))}
      </svg>
      <p class="quiet plot-note">
        Seen from above; the strong line is the building. Outside the outline of a degree no part of any run that is possible to that degree lay at the end of its
        run. Runs of a plan end at rest or with their time, and parts may still move then: this is no final reach, and no safe distance.
        Fragments of the charges are not modelled.
      </p>
      <ValueTable label="debris" head={["degree", "runs", "from x [m]", "to x [m]", "from y [m]", "to y [m]"]} rows={() =>
        debris.levels.map((l) => [String(l.alpha), l.runs, ...(l.corners.length === 0 ? [null, null, null, null] : [0, 1].flatMap((k) => [Math.min(...l.corners.map((p) => p[k] as number)), Math.max(...l.corners.map((p) => p[k] as number))]))])} />
    </section>
  );
}
