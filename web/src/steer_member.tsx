/// What the chosen member is made of: section or build-up, bars, ties, materials, cuts, as the branch's plan has it.
import { useEffect, useState } from "preact/hooks";
import type { SteerState } from "./steer_state";
import type { MemberSection, PlanMember } from "./steer_wire";
import { formatNumber } from "./units";
import { findZonesOfBodies } from "./zones";

const mm = (metres: number): string => formatNumber(metres * 1000, 3);
const cm = (metres: number): string => formatNumber(metres * 100, 3);
const mpa = (pascal: number): string => formatNumber(pascal / 1e6, 3);
/// Reinforcement of a metre.
const perMetre = (area: number): string => `${formatNumber(area * 1e4, 3)} cm²/m`;

/// "8 × ⌀ 32 mm", thick ones first.
export function describeBars(bars: MemberSection["bars"]): string {
  const counts = new Map<number, number>();
  for (const bar of bars) {
    const diameter = Math.round(bar.diameter * 1e4) / 10;
    counts.set(diameter, (counts.get(diameter) ?? 0) + 1);
  }
  return [...counts].sort((a, b) => b[0] - a[0]).map(([diameter, n]) => `${n} × ⌀ ${diameter} mm`).join(" + ") || "none";
}

/// The section with its ties and bars, y to the right and z up.
function SectionDrawing(props: { section: MemberSection }) {
  const { section } = props;
  const { width, height, cover, ties } = section;
  const tie = ties?.diameter ?? 0, inset = cover + tie / 2, edge = 0.02 * Math.max(width, height);
  return (
    <svg class="section-drawing" role="img" aria-label={`Section ${cm(width)} × ${cm(height)} cm with ${describeBars(section.bars)}`} viewBox={`${-width / 2 - edge} ${-height / 2 - edge} ${width + 2 * edge} ${height + 2 * edge}`}>
      <rect x={-width / 2} y={-height / 2} width={width} height={height} class="section-concrete" stroke-width={edge / 2} />
      {tie > 0 && width > 2 * inset && height > 2 * inset && (
        <rect x={inset - width / 2} y={inset - height / 2} width={width - 2 * inset} height={height - 2 * inset} rx={2 * tie} class="section-tie" stroke-width={Math.max(tie, edge / 3)} />
      )}
      {section.bars.map((b) => <circle cx={b.y} cy={-b.z} r={b.diameter / 2} class="section-bar" />)}
    </svg>
  );
}

function Facts(props: { member: PlanMember }) {
  const { member: m } = props;
  const { section: s, panel: p, shaft, concrete, steel, masonry } = m;
  return (
    <div class="member-facts" data-test="member-facts">
      <h3>{m.kind[0]?.toUpperCase() + m.kind.slice(1)} {m.name}{m.removed && ", taken out beforehand"}</h3>
      {s !== undefined && <SectionDrawing section={s} />}
      <dl>
        {s !== undefined && (
          <>
            <dt>Section</dt><dd>{s.name}, {cm(s.width)} × {cm(s.height)} cm</dd>
            <dt>Bars</dt><dd>{describeBars(s.bars)}, {formatNumber(s.steel_area * 1e4, 3)} cm² ({formatNumber((100 * s.steel_area) / (s.width * s.height), 2)} %)</dd>
            <dt>Ties</dt><dd>{s.ties === null ? "none" : `⌀ ${mm(s.ties.diameter)} mm every ${cm(s.ties.spacing)} cm, ${s.ties.legs_y} legs along y, ${s.ties.legs_z} along z`}</dd>
            <dt>Cover</dt><dd>{mm(s.cover)} mm to the ties</dd>
          </>
        )}
        {p !== undefined && (
          <>
            <dt>Build-up</dt><dd>{p.name}, {cm(p.thickness)} cm{p.openings > 0 && `, ${p.openings} ${p.openings === 1 ? "opening" : "openings"}`}</dd>
            <dt>Bars</dt><dd>{p.as_top > 0 || p.as_bottom > 0 ? `${perMetre(p.as_top)} and ${perMetre(p.as_bottom)} on its faces` : "none"}</dd>
            {(p.as_top > 0 || p.as_bottom > 0) && <><dt>Cover</dt><dd>{mm(p.cover)} mm</dd></>}
          </>
        )}
        {shaft !== undefined && (
          <>
            <dt>Ring</dt><dd>⌀ {formatNumber(shaft.diameter_foot, 3)} m, {cm(shaft.thickness_foot)} cm thick at the foot; ⌀ {formatNumber(shaft.diameter_top, 3)} m, {cm(shaft.thickness_top)} cm at the top</dd>
            <dt>Bars</dt><dd>{shaft.as_outer > 0 || shaft.as_inner > 0 ? `${perMetre(shaft.as_outer)} outside, ${perMetre(shaft.as_inner)} inside, ⌀ ${mm(shaft.bar_diameter)} mm` : "none"}</dd>
            {shaft.hoop_diameter > 0 && <><dt>Hoops</dt><dd>⌀ {mm(shaft.hoop_diameter)} mm every {cm(shaft.hoop_spacing)} cm</dd></>}
            <dt>Cover</dt><dd>{mm(shaft.cover)} mm</dd>
          </>
        )}
        {concrete !== null && <><dt>Concrete</dt><dd>{concrete.name}: f<sub>c</sub> {mpa(concrete.fc)}, f<sub>ct</sub> {mpa(concrete.fct)}, E<sub>c</sub> {mpa(concrete.Ec)} N/mm²</dd></>}
        {steel !== null && <><dt>Steel</dt><dd>{steel.name}: f<sub>y</sub> {mpa(steel.fy)}, f<sub>u</sub> {mpa(steel.fu)} N/mm²</dd></>}
        {masonry !== null && <><dt>Masonry</dt><dd>f {mpa(masonry.strength)} N/mm², {formatNumber(masonry.density, 4)} kg/m³</dd></>}
        {m.cuts.map((c) => <><dt>Cut</dt><dd>at {formatNumber(c.at, 3)} m: {formatNumber(100 * c.cut_bars, 3)} % of the bars, {formatNumber(100 * c.cut_concrete, 3)} % of the concrete</dd></>)}
      </dl>
    </div>
  );
}

/// Of the chosen body: the member of its name, and those that its zones are in.
export function MemberFacts(props: { s: SteerState }) {
  const { s } = props;
  const run = s.view.value?.run;
  const body = run?.bodies[s.selected.value];
  const zones = run === undefined ? [] : (findZonesOfBodies(run)[s.selected.value] ?? []).map((z) => run.zones[z]?.member ?? "");
  const names = body === undefined ? [] : [...new Set([body.name.split("/")[0] as string, ...zones])].filter((n) => n !== "").slice(0, 12);
  const key = names.join(" ");
  const branch = s.active.value, edits = s.branch.value?.edits.length ?? 0;
  const [members, setMembers] = useState<PlanMember[]>([]);
  useEffect(() => {
    let isOld = false;
    void Promise.all(names.map((member) => s.ask<{ member: PlanMember | null }>("member", { member }))).then((answers) => {
      if (!isOld) setMembers(answers.flatMap((a) => (a?.member ? [a.member] : [])));
    });
    return () => {
      isOld = true;
    };
  }, [key, branch, edits]);
  const [first, ...others] = members;
  if (first === undefined || !names.includes(first.name)) return null;
  return (
    <section class="panel member-panel" aria-label="Section and reinforcement" data-test="member-panel">
      <Facts member={first} />
      {others.length > 0 && (
        <details>
          <summary>{others.length} more {others.length === 1 ? "member" : "members"} with zones at this part</summary>
          {others.map((m) => <Facts member={m} />)}
        </details>
      )}
    </section>
  );
}
