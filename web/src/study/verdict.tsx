import { Sign, StatusSign, StatusWord } from "../signs";
import { atLeast, atMost, formatDate, prettify } from "../units";
import type { Study } from "./data";
import { isClassed, lookOf, nameOf, type State } from "./state";

export function Header(props: { study: Study }) {
  const { study } = props;
  const [verdict, ...rest] = study.verdict;
  const level = study.state === "open" ? "under way" : study.ending;
  return (
    <header class="header">
      <div class="title-row">
        {study.title === "" ? <h1>Untitled study</h1> : <h1 data-name>{study.title}</h1>}
        <p class="subtitle">
          fuzzy study · topple {study.origin.program_version} · {formatDate(study.origin.created) || "date unknown"} · <span class="number" data-test="runs">{study.runs}</span> runs, {study.failed} failed, {level}
        </p>
      </div>
      <div class="verdict-row one">
        <section class={`verdict ${verdict?.status ?? "info"}`} aria-label="Verdict">
          <StatusSign status={verdict?.status ?? "info"} size={30} />
          <div>
            <p class="verdict-title">Verdict <StatusWord status={verdict?.status ?? "info"} /></p>
            <p class="verdict-text" data-test="verdict">{verdict !== undefined ? prettify(verdict.text) : study.runs === 0 ? "This study has no runs." : "What the runs say of each output stands below."}</p>
          </div>
        </section>
      </div>
      {rest.length > 0 && (
        <section class="panel sentences" aria-label="What the study says">
          {rest.map((s) => (
            <p data-sentence={s.id}>
              <StatusSign status={s.status} size={15} /> {prettify(s.text)}
            </p>
          ))}
        </section>
      )}
    </header>
  );
}

/// Sign and name of an outcome.
export function OutcomeName(props: { study: Study; index: number }) {
  const outcome = props.study.outcomes[props.index];
  if (outcome === undefined) return null;
  const look = lookOf(props.study.outcomes, props.index);
  return (
    <span class="with-sign">
      <Sign shape={look.shape} colour={look.colour} /> {nameOf(outcome)}
    </span>
  );
}

interface Degrees {
  runs: number;
  possibility: number;
  necessity: number;
  converged?: boolean;
  necessity_converged?: boolean;
}
const isOpen = (d: Degrees): boolean => d.converged === false || d.necessity_converged === false;

function DegreeHead(props: { of: string }) {
  return (
    <thead>
      <tr>
        <th scope="col">{props.of}</th>
        <th scope="col" class="wide">possibility, and as a narrow bar what is necessary</th>
        <th scope="col">possibility</th>
        <th scope="col">necessity</th>
        <th scope="col">runs</th>
      </tr>
    </thead>
  );
}

/// The cells of a row, behind its name.
function DegreeCells(props: { of: Degrees; colour: string }) {
  const { of, colour } = props;
  const wide = (part: number): string => `${(100 * Math.min(1, Math.max(0, part))).toFixed(1)}%`;
  return (
    <>
      <td>
        <span class="degree" aria-hidden="true">
          <i style={{ width: wide(of.possibility), background: colour }} />
          <b style={{ width: wide(of.necessity) }} />
        </span>
      </td>
      <td>{atLeast(of.possibility, 3) + (of.converged === false ? "*" : "")}</td>
      <td>{atMost(of.necessity, 3) + (of.necessity_converged === false ? "*" : "")}</td>
      <td>{of.runs}</td>
    </>
  );
}

function OpenDegrees() {
  return <p class="quiet">* No search has ended there: a possibility may be higher, a necessity lower.</p>;
}

/// How possible it is that the requirement is kept, and that it is broken.
export function Requirement(props: { state: State }) {
  const { requirement } = props.state.study;
  if (requirement === undefined || requirement === null) return null;
  const looks: Record<string, [string, string]> = { kept: ["requirement kept", "var(--good)"], broken: ["requirement broken", "var(--bad)"] };
  return (
    <section class="panel" aria-label="Requirement" data-test="requirement">
      <h2>Requirement</h2>
      <p>Asked: <strong>{requirement.text}</strong></p>
      <table class="outcomes">
        <DegreeHead of="runs" />
        <tbody>
          {requirement.classes.map((c) => (
            <tr data-class={c.name}>
              <th scope="row">{looks[c.name]?.[0] ?? c.name}</th>
              <DegreeCells of={c} colour={looks[c.name]?.[1] ?? "var(--broken)"} />
            </tr>
          ))}
        </tbody>
      </table>
      {requirement.classes.some(isOpen) && <OpenDegrees />}
    </section>
  );
}

/// How possible and how necessary each outcome is.
export function Outcomes(props: { state: State }) {
  const { study } = props.state;
  const unmet = study.not_met ?? [];
  if (!isClassed(study) && unmet.length === 0) return null;
  return (
    <section class="panel" aria-label="Outcomes">
      <h2>Outcomes</h2>
      <table class="outcomes">
        <DegreeHead of="outcome" />
        <tbody>
          {study.outcomes.map((o, i) => (
            <tr data-outcome={o.name}>
              <th scope="row">
                <OutcomeName study={study} index={i} />
                {o.name !== "" && o.name === study.asked && <span class="quiet"> (planned)</span>}
              </th>
              <DegreeCells of={o} colour={lookOf(study.outcomes, i).colour} />
            </tr>
          ))}
          {unmet.map((name) => (
            <tr class="quiet" data-unmet={name}>
              <th scope="row">{name}</th>
              <td>{`not met in ${study.runs} runs`}</td>
              <td>{`${atLeast(0, 3)}*`}</td>
              <td>{atMost(0, 3)}</td>
              <td>0</td>
            </tr>
          ))}
        </tbody>
      </table>
      {(unmet.length > 0 || study.outcomes.some(isOpen)) && <OpenDegrees />}
      <p class="quiet plot-note">
        Possibility is the highest degree at which inputs were found that lead to the outcome; it can only be higher. Necessity is what is left
        for no other outcome. Numbers of runs are no probabilities: runs gather where something was looked for.
      </p>
    </section>
  );
}
