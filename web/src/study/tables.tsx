import { digitsWithin, formatDate, formatNumber, prettify } from "../units";
import { isKnown, titleOf, type Driver, type Study } from "./data";
import { isClassed, type State } from "./state";
import { OutcomeName } from "./verdict";
import { say } from "../translate";

const distributions: Record<string, string> = {
  normal: "random: normal distribution", lognormal: "random: lognormal distribution", gumbel: "random: gumbel distribution", weibull: "random: weibull distribution", uniform: "random: uniform distribution",
};
const parameters: Record<string, (value: string) => string> = {
  mean: (value) => `mean = ${value}`, "standard deviation": (value) => `standard deviation = ${value}`, scale: (value) => `scale = ${value}`,
  shape: (value) => `shape = ${value}`, "lower end": (value) => `lower end = ${value}`, "upper end": (value) => `upper end = ${value}`,
};

function Share(props: { driver: Driver | undefined }) {
  const d = props.driver;
  if (d === undefined || d.first === null || d.first_error === null) return <td class="share"><span class="quiet">unknown</span></td>;
  const most = Math.max(0.005, Math.max(0, d.first) + 2 * d.first_error); // what two digits tell from nothing
  if (!isKnown(d)) return <td class="share"><span class="quiet">{`unknown, below ${formatNumber(most, 2)}`}</span></td>;
  const percent = (v: number): string => `${Math.min(100, Math.max(0, 100 * v))}%`;
  return (
    <td class="share">
      <span class="degree" aria-hidden="true"><i style={{ width: percent(d.first) }} /></span>
      <span class="number">{d.first.toFixed(2)} ± {d.first_error.toFixed(2)}</span>
      {d.total !== null && <span class="quiet">{` with others ${d.total.toFixed(2)} ± ${(d.total_error ?? 0).toFixed(2)}`}</span>}
      <span class="quiet"> {d.places[0] === d.places[1] ? `place ${d.places[0]}` : `place ${d.places[0]} to ${d.places[1]}`}</span>
    </td>
  );
}

export function Drivers(props: { state: State }) {
  const { study } = props.state;
  const { drivers } = study;
  const rows = [
    ...(drivers.outcomes.length > 1 ? drivers.outcomes.map((o) => ({ name: `outcome ${o.name}`, isName: false, inputs: o.inputs })) : []),
    ...drivers.outputs.map((o) => ({ name: o.name, isName: true, inputs: o.inputs })), // names of outputs are those of the other tables
  ];
  return (
    <section class="panel" aria-label="Drivers" data-test="drivers">
      <h2>What drives what</h2>
      {rows.length === 0 ? (
        <p class="quiet">{drivers.from === "not asked for" ? "Not asked for." : "Not known: there are too few spread runs."}</p>
      ) : (
        <>
          <p class="quiet">
            Part of the variance over the whole support that an input explains alone, with its standard error
            {drivers.outputs.some((o) => o.inputs.some((d) => d.total !== null)) && ", and together with others"}
            {`. From ${drivers.runs} runs (${drivers.from}). A share below its error is unknown.`}
          </p>
          <div class="scroller free" tabIndex={0} role="region" aria-label="Table of drivers">
            <table class="drivers">
              <thead>
                <tr><th scope="col" />{study.inputs.map((q) => <th scope="col" title={q.name}>{q.label}</th>)}</tr>
              </thead>
              <tbody>
                {rows.map((row) => (
                  <tr><th scope="row" {...(row.isName ? { "data-name": row.name } : {})}>{row.name}</th>{study.inputs.map((_, k) => <Share driver={row.inputs[k]} />)}</tr>
                ))}
              </tbody>
            </table>
          </div>
        </>
      )}
      {study.known.length > 0 && isClassed(study) && (
        <>
          <h3>If one input were known</h3>
          <p class="quiet">Possibility of each outcome with all inputs fuzzy, and with one of them fixed at the middle of its core. At least so much was found.</p>
          <table>
            <thead>
              <tr><th scope="col">known</th>{study.outcomes.map((o, i) => <th scope="col"><OutcomeName study={study} index={i} /><span hidden>{o.name}</span></th>)}</tr>
            </thead>
            <tbody>
              <tr><th scope="row">nothing</th>{study.outcomes.map((o) => <td>{formatNumber(o.possibility, 3) + (o.converged === false ? "*" : "")}</td>)}</tr>
              {study.known.map((k) => (
                <tr><th scope="row">{k.input}</th>{study.outcomes.map((o) => {
                  const c = k.outcomes.find((other) => other.name === o.name);
                  return <td>{formatNumber(c?.possibility ?? 0, 3) + (c?.converged === false ? "*" : "")}</td>;
                })}</tr>
              ))}
            </tbody>
          </table>
          {study.known.some((k) => k.outcomes.some((c) => c.converged === false)) && <p class="quiet">* No search has ended there: it may be higher.</p>}
        </>
      )}
    </section>
  );
}

export function Boxes(props: { state: State }) {
  const { study } = props.state;
  const { boxes } = study;
  if (boxes === null) return null;
  const width = 320;
  return (
    <section class="panel" aria-label="Permissible values" data-test="boxes">
      <h2>Permissible values</h2>
      <p>
        Asked: <strong>{boxes.requirement}</strong>
        {boxes.permissible_part === null || boxes.permissible_part_error === null
          ? ". No spread run tells on which part of the support it holds."
          : `. It holds on ${formatNumber(100 * boxes.permissible_part, 3)} % of the support (± ${formatNumber(100 * boxes.permissible_part_error, 2)} %, of ${boxes.permissible_part_points} spread runs).`}
      </p>
      {boxes.list.length === 0 && <p class="quiet">No box of inputs was found that keeps it.</p>}
      {boxes.list.map((box, n) => (
        <div class={`box ${box.kept ? "" : "not-kept"}`} data-box={n}>
          <h3>{`${box.kept ? `Box ${n + 1}` : "Dropped box"}: ${formatNumber(100 * box.volume, 2)} % of the support`}</h3>
          <table class="box-table">
            <thead><tr><th scope="col">input</th><th scope="col">inside its support</th><th scope="col">from</th><th scope="col">core</th><th scope="col">to</th></tr></thead>
            <tbody>
              {box.inputs.map((q, k) => {
                const cuts = study.inputs[k]?.cuts ?? [];
                const low = cuts[0]?.[1] ?? q.lower, high = cuts[0]?.[2] ?? q.upper;
                const at = (v: number): number => 6 + ((v - low) / (high - low || 1)) * (width - 12);
                return (
                  <tr>
                    <th scope="row">{titleOf({ name: q.name, unit: study.inputs[k]?.unit ?? "" })}</th>
                    <td>
                      <svg class="range" viewBox={`0 0 ${width} 16`} aria-hidden="true">
                        <line x1={6} x2={width - 6} y1={8} y2={8} />
                        <rect x={at(q.lower)} y={3} width={Math.max(1, at(q.upper) - at(q.lower))} height={10} />
                        {q.core !== null && <line class="core" x1={at(q.core)} x2={at(q.core)} y1={0} y2={16} />}
                      </svg>
                    </td>
                    {[q.lower, q.core, q.upper].map((v) => <td>{formatNumber(v, digitsWithin(low, high))}</td>)}
                  </tr>
                );
              })}
            </tbody>
          </table>
          <p class="quiet">{box.guarantee}{box.kept && box.robustness !== null && box.robustness > 0 && ` Robustness ${formatNumber(box.robustness, 3)}; distance to the limits ${formatNumber(box.distance, 2)} of their range.`}</p>
        </div>
      ))}
    </section>
  );
}

export function Confirmed(props: { state: State }) {
  const { state } = props;
  const { study } = state;
  const c = study.confirmation;
  if (c === undefined) return null;
  const states = [...new Set(["confirmed", "exceeded", "not reached", ...c.bounds.map((b) => b.state)])];
  const alike = c.runs.filter((r) => r.whole_outcome === r.outcome).length, run = c.runs.filter((r) => r.whole_outcome !== null).length;
  return (
    <section class="panel" aria-label="Confirmation by whole runs" data-test="confirmation">
      <h2>Condensed runs beside whole ones</h2>
      <p>
        {`Runs were condensed: like frames of the building moved as one. ${run} of them were run whole beside it; ${alike} had the same outcome.`}
        {` Of ${c.bounds.length} bounds ${states.map((s) => `${c.bounds.filter((b) => b.state === s).length} ${say(s)}`).join(", ")}.`}
      </p>
      <p class="quiet">
        {`Confirmed: whole runs in the cut come within ${formatNumber(100 * c.tolerance, 2)} % of the output's width of the bound. Exceeded: one lies farther out, the bound is too narrow. Not reached: none comes so far, the bound may be too wide. Not run: the limit of ${c.limit} whole runs left it out.`}
      </p>
      <table>
        <thead><tr><th scope="col">outcome</th><th scope="col">most possible run</th><th scope="col">whole</th><th scope="col" /></tr></thead>
        <tbody>
          {c.outcomes.map((o) => (
            <tr>
              <th scope="row">{o.outcome}</th>
              <td><button type="button" class="link" onClick={() => state.select(o.sample)}>{`run ${o.sample}`}</button></td>
              <td>{o.whole ?? "–"}</td><td>{o.state}</td>
            </tr>
          ))}
        </tbody>
      </table>
      <details>
        <summary>Table of bounds</summary>
        <div class="scroller free" tabIndex={0} role="region" aria-label="Table of confirmed bounds">
          <table>
            <thead><tr><th scope="col">output</th><th scope="col">degree</th><th scope="col">bound</th><th scope="col">condensed</th><th scope="col">whole</th><th scope="col" /></tr></thead>
            <tbody>
              {c.bounds.map((b) => (
                <tr>
                  <th scope="row">{titleOf({ name: b.output, unit: study.outputs.find((o) => o.name === b.output)?.unit ?? "" })}</th>
                  <td>{formatNumber(b.alpha)}</td><td>{b.side}</td><td>{formatNumber(b.condensed)}</td>
                  <td>{b.state === "not run" ? "–" : formatNumber(b.whole)}</td><td>{b.state}</td>
                </tr>
              ))}
            </tbody>
          </table>
        </div>
      </details>
    </section>
  );
}

export function Notable(props: { state: State }) {
  const { state } = props;
  const { study } = state;
  if (study.notable.length === 0 && study.failures.length === 0) return null;
  return (
    <section class="panel" aria-label="Runs to look at">
      <h2>Runs to look at</h2>
      <ul class="notable">
        {study.notable.map((n) => (
          <li><button type="button" class="link" onClick={() => state.select(n.sample)}>{`run ${n.sample}`}</button> {prettify(n.why)}</li>
        ))}
      </ul>
      {study.failures.length > 0 && (
        <>
          <h3>Failed runs</h3>
          <ul class="notable" data-test="failures">{study.failures.map((text) => <li>{text}</li>)}</ul>
        </>
      )}
    </section>
  );
}

export function Inputs(props: { study: Study }) {
  const { study } = props;
  return (
    <section class="panel" aria-label="Fuzzy inputs">
      <h2>Fuzzy inputs</h2>
      <table>
        <thead><tr><th scope="col">input</th><th scope="col">possible from</th><th scope="col">core</th><th scope="col">to</th></tr></thead>
        <tbody>
          {study.inputs.map((q) => {
            const first = q.cuts[0], last = q.cuts[q.cuts.length - 1];
            return (
              <tr>
                <th scope="row">{titleOf(q)}</th>
                <td>{formatNumber(first?.[1])}</td>
                <td>{last?.[1] === last?.[2] ? formatNumber(last?.[1]) : `${formatNumber(last?.[1])} to ${formatNumber(last?.[2])}`}</td>
                <td>{formatNumber(first?.[2])}</td>
              </tr>
            );
          })}
          {study.derived.map((q) => <tr><th scope="row">{titleOf(q)}</th><td colSpan={3}>follows from others</td></tr>)}
          {(study.random?.inputs ?? []).map((q) => (
            <tr><th scope="row">{titleOf(q)}</th><td colSpan={3}>{[distributions[q.distribution] ?? q.distribution, ...q.parameters.map((x) => parameters[x.name]?.(x.input ?? formatNumber(x.value)) ?? x.name)].map(say).join("; ")}</td></tr>
          ))}
        </tbody>
      </table>
    </section>
  );
}

export function NotModelled(props: { study: Study }) {
  const { study } = props;
  return (
    <section class="panel not-modelled" aria-label="What is not modelled">
      <h2>What is not modelled</h2>
      {study.not_modelled.length === 0 ? <p class="quiet">The model names nothing.</p> : <ul>{study.not_modelled.map((text) => <li>{text}</li>)}</ul>}
      <p class="quiet">Uncertainty of the model itself is none of the fuzzy inputs: bounds hold for this model and these inputs.</p>
    </section>
  );
}

export function Origin(props: { study: Study }) {
  const { study } = props;
  const { origin } = study;
  const pairs: [string, string][] = [
    ["Program", `topple ${origin.program_version}`],
    ["Created", formatDate(origin.created) || "–"],
    ["Model", origin.kind === "plan" ? "a plan" : origin.kind],
    ["Name of the model in the store", origin.model],
    ["File", origin.source_name || "–"],
    ["Seed", String(study.seed)],
    ["Runs", `${study.runs}, ${study.failed} failed`],
    ...(study.random === undefined ? [] : [["Inner runs of each run", String(study.random.runs)] as [string, string]]),
    ...study.coverage.map((c): [string, string] => [`Runs that are possible to ${c.alpha}`, `${c.samples}; the search of bounds spread ${c.spread} of them`]),
  ];
  return (
    <section class="panel details" aria-label="Where this comes from">
      <h2>Where this comes from</h2>
      <table class="pairs"><tbody>{pairs.map(([key, value]) => <tr><th scope="row">{key}</th><td>{value}</td></tr>)}</tbody></table>
      {origin.source !== "" && (
        <details>
          <summary>{origin.source_name === "" ? "Text of the file" : `Text of ${origin.source_name}`}</summary>
          <pre class="plan-text" tabIndex={0}>{origin.source}</pre>
        </details>
      )}
    </section>
  );
}
