import type { Finding, Run, Status } from "./data";
import { StatusSign, StatusWord } from "./signs";
import { formatDate, formatDuration, prettify } from "./units";
import { endingWord } from "./vocabulary";

/// The finding that says what happens: the mechanism, else the first one.
export function findVerdict(run: { findings: readonly Finding[] }): Finding | undefined {
  return run.findings.find((f) => f.id === "mechanism") ?? run.findings[0];
}

/// The worst of the limits that the plan sets, and of what is bad at neighbours.
export function findStatusOfLimits(findings: readonly Finding[]): Status | undefined {
  const limits = findings.filter((f) => isCriterion(f) || (f.status === "bad" && isOfPlace(f)));
  return openStatuses.find((status) => limits.some((f) => f.status === status));
}

/// The status of the headline: a mechanism as planned is not good where a limit of the plan is broken.
export function findHeadline(findings: readonly Finding[]): Status {
  const own = findVerdict({ findings })?.status ?? "info";
  const limits = findStatusOfLimits(findings);
  return limits === undefined || (openStatuses.includes(own) && openStatuses.indexOf(own) < openStatuses.indexOf(limits)) ? own : limits;
}

export function Header(props: { run: Run }) {
  const { run } = props;
  const verdict = findVerdict(run);
  const headline = findHeadline(run.findings);
  const ofLimits = findStatusOfLimits(run.findings);
  const { provenance, ending } = run;
  return (
    <header class="header">
      <div class="title-row">
        {provenance.title === "" ? <h1>Untitled plan</h1> : <h1 data-name>{provenance.title}</h1>}
        <p class="subtitle">
          {`topple ${provenance.program_version} · `}
          {formatDate(provenance.created) || "date unknown"}
          {provenance.wall_time === null ? "" : ` · computed in ${formatDuration(provenance.wall_time)}`}
        </p>
      </div>
      <div class="verdict-row">
        <section class={`verdict ${headline}`} aria-label="Verdict">
          {verdict === undefined ? (
            <p class="verdict-text">This run has no findings.</p>
          ) : (
            <>
              <StatusSign status={headline} size={30} />
              <div>
                <p class="verdict-title">
                  <span data-name>{verdict.title}</span> <StatusWord status={verdict.status} />
                  {ofLimits !== undefined && <span class="verdict-limits" data-test="verdict-limits">Limits <StatusWord status={ofLimits} /></span>}
                </p>
                <p class="verdict-text" data-test="verdict">{prettify(verdict.text)}</p>
              </div>
            </>
          )}
        </section>
        <section class={`ending ${run.findings.some((f) => f.status === "bad") ? "bad" : ""}`} aria-label="Limits and ending">
          <Summary run={run} />
          <p class="ending-text">
            <strong data-test="ending">{endingWord[ending.kind] ?? (ending.kind || "Unknown")}</strong>: {prettify(ending.text)}
          </p>
        </section>
      </div>
    </header>
  );
}

/// What is worst first.
export const openStatuses: readonly Status[] = ["bad", "not_judged", "warning"];

/// The distance that the plan asks for, as a clearance finding tells it in either language; undefined if it asks for none.
export const findLimit = (f: Finding): string | undefined => (f.id.startsWith("clearance.") ? /; (?:the limit is|der Grenzwert ist) (\d+(?:[.,]\d+)?) m\.(?= |$)/.exec(f.text)?.[1]?.replace(",", ".") : undefined);

/// Whether it is about a limit of the plan.
const isCriterion = (f: Finding): boolean => f.id.startsWith("criterion.") || findLimit(f) !== undefined;

/// Whether its title is the name of a neighbour or a utility, which does not say what of it is told.
export const isOfPlace = (f: Finding): boolean => /^(clearance|vibration)\./.test(f.id);

/// What is not as it should be, each with a way to its finding.
function Summary(props: { run: Run }) {
  const { findings } = props.run;
  const verdict = findVerdict(props.run);
  const criteria = findings.filter(isCriterion);
  const screened = findings.filter((f) => f.id.startsWith("vibration.") && f.status === "bad").length;
  const unjudged = criteria.filter((f) => f.status === "not_judged").length;
  const met = criteria.filter((f) => f.status !== "bad").length - unjudged;
  const open = findings.filter((f) => f !== verdict && openStatuses.includes(f.status));
  open.sort((a, b) => openStatuses.indexOf(a.status) - openStatuses.indexOf(b.status));
  const most = 4;
  return (
    <>
      <p class="verdict-title">
        {props.run.ending.kind === "failed" ? "The limits of the plan were not examined" : criteria.length === 0 ? "The plan sets no limits" : props.run.ending.kind === "under_way" || props.run.ending.kind === "cancelled" ? `${criteria.length - met - unjudged} of ${criteria.length} limits broken so far` : unjudged > 0 ? `${met} of ${criteria.length} limits of the plan kept, ${unjudged} not judged` : met === criteria.length ? (met === 1 ? "The one limit of the plan kept" : `All ${met} limits of the plan kept`) : `${met} of ${criteria.length} limits of the plan kept`}
      </p>
      {screened > 0 && <p class="verdict-title">{screened === 1 ? "The screening of ground vibration lies above one limit" : `The screening of ground vibration lies above ${screened} limits`}</p>}
      {open.slice(0, most).map((f) => (
        <a class="open-finding" href={`#finding-${f.id}`} data-test="open-finding">
          <StatusSign status={f.status} size={14} /> <StatusWord status={f.status} /> <span data-name>{isOfPlace(f) ? `${f.heading}: ${f.title}` : f.title}</span>
        </a>
      ))}
      {open.length > most && <p class="ending-text">{`and ${open.length - most} more below`}</p>}
    </>
  );
}

export function FindingRow(props: { finding: Finding; heading: string }) {
  const { finding } = props;
  return (
    <div class="finding" data-finding={finding.id} id={`finding-${finding.id}`}>
      <StatusSign status={finding.status} />
      <div>
        {finding.title !== props.heading && <p class="finding-title" data-name>{finding.title}</p>}
        <p>{prettify(finding.text)}</p>
      </div>
      <StatusWord status={finding.status} />
    </div>
  );
}

/// The findings in the given order, without those about the calculation itself; neighbours with one heading stand together.
export function Findings(props: { run: Run }) {
  const groups: { heading: string; findings: Finding[] }[] = [];
  for (const finding of props.run.findings) {
    if (finding.id === "not_modelled" && props.run.not_modelled.length > 0) continue; // has a panel of its own
    if (finding.id.startsWith("verification.")) continue; // so has verification
    const last = groups[groups.length - 1];
    if (last !== undefined && last.heading === finding.heading) last.findings.push(finding);
    else groups.push({ heading: finding.heading, findings: [finding] });
  }
  return (
    <section class="panel findings" aria-label="Findings">
      <h2>Findings</h2>
      {groups.length === 0 && <p class="quiet">None.</p>}
      {groups.map((group) => (
        <div class="finding-group">
          <h3>{group.heading}</h3>
          {group.findings.map((finding) => (
            <FindingRow finding={finding} heading={group.heading} />
          ))}
        </div>
      ))}
    </section>
  );
}

export function NotModelled(props: { run: Run }) {
  return (
    <section class="panel not-modelled" aria-label="What is not modelled">
      <h2>What is not modelled</h2>
      {props.run.not_modelled.length === 0 ? (
        <p class="quiet">The run names nothing.</p>
      ) : (
        <ul>
          {props.run.not_modelled.map((text) => (
            <li>{text}</li>
          ))}
        </ul>
      )}
    </section>
  );
}
