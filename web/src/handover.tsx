/// What the report hands over beside the findings: when they would not hold, the site from above, assumptions,
/// verification, what fuzzy values do, and the words it uses.
import { calcPose, type Finding, findBuildingLines, type Point, type Quadruple, rotate, type Run, shorten, type StudySummary, type Triple } from "./data";
import { FindingRow, findLimit, findVerdict, isOfPlace } from "./findings";
import { StatusSign } from "./signs";
import { unitWord } from "./study/data";
import { makeScale, makeTicks, tickText, useChartWidth } from "./study/chart";
import { atLeast, atMost, formatNumber, prettify } from "./units";

/// Never more than there is: what is spare is rounded down.
const roundDown = (value: number, decimals: number): string => (Math.floor(value * 10 ** decimals + 1e-6) / 10 ** decimals).toFixed(decimals);

/// What a stability finding says beside the margin at its end, in either language: how many zones have yielded or broken,
/// the least margin on the way, and how many times its dead load the weakest span bears.
function readMargin(f: Finding): { yielded: number; broken: number; least: number; span: number } {
  const numberOf = (pattern: RegExp): number | undefined => {
    const found = pattern.exec(f.text)?.[1];
    return found === undefined ? undefined : Number(found.replace(",", "."));
  };
  return {
    yielded: numberOf(/(\d+) (?:zones? ha(?:s|ve) yielded|Zonen? fließ(?:t|en))/) ?? 0,
    broken: numberOf(/(\d+) (?:(?:is|are) broken|(?:ist|sind) gebrochen)/) ?? 0,
    least: Math.min(f.value ?? Infinity, numberOf(/(?:the least in the pause is|Die kleinste in der Pause ist) (\d+[.,]\d+)/) ?? Infinity),
    span: numberOf(/(?:bears (?=\d+\.\d+ times its dead load)|trägt höchstens das |höchstens das )(\d+[.,]\d+)/) ?? Infinity,
  };
}

/// What would have to be otherwise for the findings not to hold, the nearest first.
export function listConditions(run: Run): string[] {
  const out: string[] = [];
  const verdict = findVerdict(run);
  const broken = run.findings.filter((f) => f.status === "bad" && f !== verdict && /^(criterion|clearance|stability|vibration)\./.test(f.id));
  const name = (f: Finding): string => (isOfPlace(f) ? `${f.heading}, ${f.title}` : f.title);
  for (const f of broken) out.push(`It fails already: ${name(f)}.`);
  for (const f of run.findings.filter((g) => g.id.startsWith("clearance.") && g.status === "warning" && g.value !== null && g.value <= 0)) out.push(`Parts are over it already: ${f.title}.`);
  for (const f of run.findings.filter((g) => g.status === "not_judged" && g !== verdict)) out.push(`What the run did not show is otherwise: ${name(f)}.`);
  if (run.findings.some((f) => f.id === "mechanism.near")) out.push("Little is otherwise than planned: the verdict is near another one, as the findings say.");
  const charges = run.events.filter((e) => e.kind === "charge" && !/does not fire|zündet nicht/.test(e.text)).length;
  if (charges === 1) out.push("The charge does not fire, or not when the plan says.");
  if (charges > 1) out.push(`One of the ${charges} charges does not fire, or not when the plan says.`);
  const standing = run.findings.filter((f) => f.id.startsWith("stability.") && f.value !== null && f.status !== "bad");
  const margins = standing.map((f) => {
    const { yielded, broken, least, span } = readMargin(f);
    const spare = 100 * (1 - 1 / Math.min(least, span)); // [%]
    return { title: f.title, yielded, broken, isSpan: span < least, spare: yielded + broken > 0 || spare < 0.1 ? 0 : spare };
  });
  margins.sort((a, b) => a.spare - b.spare);
  for (const { title, yielded, broken, isSpan, spare } of margins.slice(0, 3)) {
    if (spare > 0 && isSpan) out.push(`${title}: the weakest span bears ${roundDown(spare, spare < 1 ? 1 : 0)} % less than the plan says.`);
    else if (spare > 0) out.push(`${title}: the most loaded zone resists ${roundDown(spare, spare < 1 ? 1 : 0)} % less than the plan says.`);
    else if (broken === 1) out.push(`${title}: zones resist less than the plan says. No margin is left: 1 zone has broken already.`);
    else if (broken > 0) out.push(`${title}: zones resist less than the plan says. No margin is left: ${broken} zones have broken already.`);
    else if (yielded === 1) out.push(`${title}: zones resist less than the plan says. No margin is left: 1 zone has yielded already.`);
    else if (yielded > 0) out.push(`${title}: zones resist less than the plan says. No margin is left: ${yielded} zones have yielded already.`);
    else if (isSpan) out.push(`${title}: spans bear less than the plan says. No margin is left.`);
    else out.push(`${title}: zones resist less than the plan says. No margin is left.`);
  }
  for (const f of run.findings.filter((g) => g.id.startsWith("vibration.") && g.status === "warning")) {
    const read = (found: RegExpExecArray | null): number => Number(found?.slice(1).find((n) => n !== undefined)?.replace(",", "."));
    const middle = read(/, (\S+) in (?:the middle|der Mitte)/.exec(f.text));
    const limit = read(/(?:of the plan|des Plans): (\S+) mm\/s|: (\S+) (?:to|bis) \S+ mm\/s \(/.exec(f.text));
    if (middle > limit) out.push(`${f.title}: the middle of the screening's band is above the limit already.`);
    else out.push(`${f.title}: the ground shakes more than the middle of the screening's band, which reaches the limit.`);
  }
  const near = run.findings.filter((f) => f.id.startsWith("clearance.") && f.value !== null && f.value > 0 && f.status !== "bad");
  const ways = near.map((f) => {
    const limit = findLimit(f);
    return { title: f.title, limit, left: Math.max(0, (f.value as number) - Number(limit ?? 0)) };
  });
  ways.sort((a, b) => a.left - b.left);
  for (const { title, limit, left } of ways.slice(0, 3)) {
    if (limit === undefined) out.push(`${title}: parts come ${roundDown(left, left < 1 ? 2 : 1)} m farther than in this run; they then reach it.`);
    else out.push(`${title}: parts come ${roundDown(left, left < 1 ? 2 : 1)} m farther than in this run; the limit of ${limit} m is then broken.`);
  }
  out.push("Strengths, bars, weights or friction are not those of the plan. What other values do, a fuzzy study of the plan shows.");
  return out;
}

export function Conditions(props: { run: Run }) {
  return (
    <section class="panel conditions" aria-label="When this fails" data-test="conditions">
      <h2>This fails if</h2>
      <ul>{listConditions(props.run).map((text) => <li>{text}</li>)}</ul>
    </section>
  );
}

/// Convex hull, counter-clockwise.
export function calcHull(points: readonly Point[]): Point[] {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const half = (list: readonly Point[]): Point[] => {
    const chain: Point[] = [];
    for (const p of list) {
      for (;;) {
        const a = chain[chain.length - 2], b = chain[chain.length - 1];
        if (a === undefined || b === undefined || (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0) break;
        chain.pop();
      }
      chain.push(p);
    }
    return chain.slice(0, -1);
  };
  return sorted.length < 3 ? sorted : [...half(sorted), ...half(sorted.reverse())];
}

/// Outlines from above of all moving parts at the last frame.
export function findFallenParts(run: Run): Point[][] {
  const out: Point[][] = [];
  const frame = run.time.length - 1;
  if (frame < 0) return out;
  const crushed = run.frames[frame]?.crushed ?? [];
  const p: Triple = [0, 0, 0];
  const q: Quadruple = [1, 0, 0, 0];
  run.bodies.forEach((body, b) => {
    if (body.fixed || !calcPose(run, b, frame, 0, p, q)) return;
    for (const [i, whole] of body.shapes.entries()) {
      const shape = shorten(whole, crushed.filter((c) => c.body === b && c.shape === i));
      const corners: Point[] = [];
      for (let k = 0; k < 8; ++k) {
        const local = rotate(shape.orientation, shape.half.map((h, i) => ((k >> i) & 1 ? h : -h)) as Triple);
        const placed = rotate(q, local.map((v, i) => v + (shape.centre[i] as number)) as Triple);
        corners.push([p[0] + placed[0], p[1] + placed[1]]);
      }
      out.push(calcHull(corners));
    }
  });
  return out;
}

interface Box { lows: readonly [number, number]; highs: readonly [number, number] }

function findBox(list: readonly Point[]): Box | undefined {
  const points = list.filter((p) => Number.isFinite(p[0] + p[1]));
  if (points.length === 0) return undefined;
  const of = (k: number, pick: (a: number, b: number) => number): number => points.reduce((found, p) => pick(found, p[k] as number), (points[0] as Point)[k] as number);
  return { lows: [of(0, Math.min), of(1, Math.min)], highs: [of(0, Math.max), of(1, Math.max)] };
}
const widen = (b: Box, by: number): Box => ({ lows: [b.lows[0] - by, b.lows[1] - by], highs: [b.highs[0] + by, b.highs[1] + by] });

const longestName = 32; // [letters]
const cutName = (name: string): string => ([...name].length > longestName ? `${[...name].slice(0, longestName - 1).join("")}…` : name);

export function SitePlan(props: { run: Run }) {
  const { run } = props;
  const width = useChartWidth(640);
  const parts = findFallenParts(run);
  const { plans, hull } = findBuildingLines(run);
  const own = findBox([...run.building_outline, ...plans.flat(), ...parts.flat()]);
  const areas = run.neighbours.map((n) => findBox(n.footprint));
  const known = own ?? areas.find((a) => a !== undefined);
  if (known === undefined) return null;
  // what is near, and of it what lies within the view: else the building would be a dot
  const view = widen(known, 2 * Math.hypot(known.highs[0] - known.lows[0], known.highs[1] - known.lows[1]));
  const isNear = areas.map((a) => a !== undefined && [0, 1].every((k) => (a.lows[k] as number) <= (view.highs[k] as number) && (a.highs[k] as number) >= (view.lows[k] as number)));
  const near = run.neighbours.filter((_, i) => isNear[i]), far = run.neighbours.filter((_, i) => !isNear[i]);
  const shown = [known, ...areas.filter((_, i) => isNear[i])] as Box[];
  const lows = [0, 1].map((k) => Math.max(view.lows[k] as number, Math.min(...shown.map((b) => b.lows[k] as number)))) as [number, number];
  const highs = [0, 1].map((k) => Math.min(view.highs[k] as number, Math.max(...shown.map((b) => b.highs[k] as number)))) as [number, number];
  const most = 460, margin = 34;
  const spans = [Math.max(1, highs[0] - lows[0]), Math.max(1, highs[1] - lows[1])] as const;
  const factor = Math.min((width - 2 * margin) / spans[0], (most - 2 * margin) / spans[1]);
  const height = factor * spans[1] + 2 * margin;
  const left = (width - factor * spans[0]) / 2;
  const x = makeScale(lows[0], lows[0] + spans[0], left, left + factor * spans[0]).to;
  const y = makeScale(lows[1], lows[1] + spans[1], height - margin, margin).to;
  const path = (corners: readonly Point[]): string => (corners.length < 2 ? "" : `M${corners.map((c) => `${x(c[0]).toFixed(1)} ${y(c[1]).toFixed(1)}`).join("L")}Z`);
  return (
    <section class="panel site-plan-panel" aria-label="Site plan" data-test="site-plan">
      <h2>The site from above</h2>
      <svg class="chart site-plan" viewBox={`0 0 ${width} ${height.toFixed(0)}`} role="img" aria-label="Site plan: building, neighbours, and where all parts lie at the end">
        <g class="grid">
          {makeTicks(lows[0], highs[0], width / 80).map((t) => (
            <>
              <line x1={x(t)} x2={x(t)} y1={margin} y2={height - margin} />
              <text x={x(t)} y={height - margin + 16} text-anchor="middle">{tickText(t)}</text>
            </>
          ))}
          {makeTicks(lows[1], highs[1], 6).map((t) => (
            <>
              <line x1={left} x2={width - left} y1={y(t)} y2={y(t)} />
              <text x={left - 5} y={y(t) + 4} text-anchor="end">{tickText(t)}</text>
            </>
          ))}
          <text class="axis-title" x={width - left} y={height - 3} text-anchor="end">x [m]</text>
          <text class="axis-title" x={left - 28} y={margin - 12}>y [m]</text>
        </g>
        <clipPath id="site-plan-view"><rect x={left} y={margin} width={Math.max(0, width - 2 * left)} height={Math.max(0, height - 2 * margin)} /></clipPath>
        <path class="fallen" d={parts.map(path).join("")} />
        {near.map((n) => (
          <path clip-path="url(#site-plan-view)" class={n.is_utility ? "utility-area" : "neighbour-area"} d={path(n.footprint)}><title data-name>{n.name}</title></path>
        ))}
        {hull.length > 0 && <path class="reach-line" d={path(hull)} />}
        <path class="footprint" d={plans.map(path).join("")} />
        {near.map((n) => {
          const corner = n.footprint[0];
          if (corner === undefined) return null;
          const at = [0, 1].map((k) => Math.min(highs[k] as number, Math.max(lows[k] as number, corner[k] as number))) as [number, number];
          return <text class="level-text" x={x(at[0])} y={y(at[1]) - 4} text-anchor={x(at[0]) > 0.6 * width ? "end" : "start"} data-name>{cutName(n.name)}<title data-name>{n.name}</title></text>;
        })}
      </svg>
      <p class="quiet plot-note">{plans.length > 0 ? "Strong line: the building before the first charge." : ""} {hull.length > 0 ? "Thin line: the convex outline around what charges act on, from which reaches count." : ""} {far.length > 0 ? `Too far away to be drawn: ${far.map((n) => n.name).join(", ")}.` : ""} Grey: all parts at the end of the run. No distance on this plan is a safe distance.</p>
    </section>
  );
}

const assumptions = [
  "The ground is rigid and level; soil and foundations do not give.",
  "Parts between zones are rigid; they bend, crush, shear and tear in their zones, by the curves of their sections.",
  "Concrete, bars and sections are those of the plan; no decay, no changes that it does not name.",
  "A charge destroys its length at once and leaves the share of bars that the plan gives.",
  "The building stands in equilibrium under dead load before the first charge; live load is what the plan gives.",
  "Parts touch each other and the ground with the plan's friction and restitution.",
];

export function Assumptions() {
  return (
    <section class="panel assumptions" aria-label="Assumptions">
      <h2>Assumptions</h2>
      <ul>{assumptions.map((text) => <li>{text}</li>)}</ul>
    </section>
  );
}

export const isVerification = (f: Finding): boolean => f.id.startsWith("verification.");

export function Verification(props: { run: Run }) {
  const findings = props.run.findings.filter(isVerification), others = props.run.others ?? [];
  if (findings.length + others.length === 0) return null;
  return (
    <section class="panel verification" aria-label="Verification">
      <h2>Verification</h2>
      {findings.map((finding) => <FindingRow finding={finding} heading="Verification" />)}
      {others.map((other) => (
        <div data-test="second-opinion">
          <h3>Beside another computation</h3>
          <p class="quiet"><span>A is this run, B is by</span> <span>{other.engine}</span>: <span data-name>{other.title}</span></p>
          <ul>{other.sentences.map((text) => <li>{prettify(text)}</li>)}</ul>
        </div>
      ))}
      <p class="quiet plot-note">Half the step (topple run --check-step), the finite elements (topple fe) and other engines (topple mbs compare) are further checks.</p>
    </section>
  );
}

/// What a study of the building found, or where to look for one.
export function FuzzyResults(props: { study: StudySummary | undefined }) {
  const { study } = props;
  if (study !== undefined) return <StudyResults study={study} />;
  return (
    <section class="panel fuzzy-note" aria-label="Fuzzy results">
      <h2>Fuzzy results</h2>
      <p>This is one run with one value of everything. How possible other outcomes are, and between which bounds each finding lies, is in the
        page of a study (topple study), if there is one.</p>
    </section>
  );
}

const bound = (x: number | null): string => (x === null ? "–" : formatNumber(x, 3));

function StudyResults(props: { study: StudySummary }) {
  const { study } = props;
  const level = (o: StudySummary["outputs"][number], i: number) => o.levels[i < 0 ? o.levels.length - 1 : i];
  return (
    <section class="panel fuzzy-results" aria-label="Fuzzy results" data-test="fuzzy-results">
      <h2>Fuzzy results</h2>
      <p class="quiet"><span data-name>{study.title}</span>: <span class="number">{study.runs}</span> <span>runs</span>, <span class="number">{study.failed}</span> <span>failed</span></p>
      {study.verdict.map((s) => <p data-sentence={s.id}><StatusSign status={s.status} size={15} /> {prettify(s.text)}</p>)}
      <table>
        <thead><tr><th scope="col">Outcome</th><th scope="col" class="number">Possibility</th><th scope="col" class="number">Necessity</th><th scope="col" class="number">Runs</th></tr></thead>
        <tbody>
          {study.outcomes.filter((o) => o.is_failure || o.name !== "").map((o) => (
            <tr><td>{o.is_failure ? "failed" : o.name}</td><td class="number">{atLeast(o.possibility, 3)}</td><td class="number">{atMost(o.necessity, 3)}</td><td class="number">{o.runs}</td></tr>
          ))}
        </tbody>
      </table>
      <table>
        <thead><tr><th scope="col">Result</th><th scope="col" class="number">least possible</th><th scope="col" class="number">greatest possible</th><th scope="col" class="number">most possible</th></tr></thead>
        <tbody>
          {study.outputs.map((o) => {
            const all = level(o, 0), core = level(o, -1);
            if (all === undefined || core === undefined) return null;
            const middle = core.lower === core.upper ? bound(core.lower) : `${bound(core.lower)} … ${bound(core.upper)}`;
            return <tr><td><span data-name>{o.name}</span> {o.unit === "" ? "" : `[${unitWord(o.unit)}]`}</td><td class="number">{bound(all.lower)}</td><td class="number">{bound(all.upper)}</td><td class="number">{middle}</td></tr>;
          })}
        </tbody>
      </table>
    </section>
  );
}

const glossary: [string, string][] = [
  ["Zone", "a short length of a member in which it bends, is crushed, sheared or torn; everything between zones stays rigid"],
  ["Margin", "resistance over demand; 1 means that nothing is left"],
  ["Utilisation", "demand over resistance"],
  ["Yielding", "a zone deforms for good, at nearly constant moment"],
  ["Softening", "a zone loses resistance while it deforms"],
  ["Upper block", "all that stands above the blasted storey"],
  ["Toppling", "the block turns over its front edge and falls to one side"],
  ["Telescoping", "the building comes down vertically into itself"],
  ["Hill", "what all parts lie in at the end; its bulk volume holds the hollows too"],
  ["Screening", "an estimate with the site's own law that shows where to measure; no prediction"],
  ["Rigid body, force element", "what the model is made of: parts that keep their shape, and what resists between them"],
  ["Record", "the file of the run (record.h5), from which this page was made"],
];

export function Glossary() {
  return (
    <section class="panel glossary" aria-label="Glossary">
      <h2>Glossary</h2>
      <dl>{glossary.map(([term, meaning]) => <div><dt>{term}</dt><dd>{meaning}</dd></div>)}</dl>
    </section>
  );
}
