import { findFrame, type Run } from "./data";
import { showStage, type State } from "./state";
import { formatTime } from "./units";

export interface Still {
  time: number;
  caption: string;
  picture: string;
}

/// Moments that tell the story: before anything, what each stage left when the next one fires, the first touchdown, the
/// end, and what lies between.
export function chooseMoments(run: Run, count = 6): { time: number; caption: string }[] {
  const begin = run.time[0];
  const end = run.time[run.time.length - 1];
  if (begin === undefined || end === undefined) return [];
  const moments: { time: number; caption: string; rank: number }[] = [{ time: begin, caption: "before the first charge", rank: 0 }];
  if (end > begin) {
    moments.push({ time: end, caption: "end", rank: 0 });
    const least = (end - begin) / 60;
    const add = (time: number, caption: string, rank: number): void => {
      if (time > begin && time < end && moments.every((m) => Math.abs(m.time - time) > least)) moments.push({ time, caption, rank });
    };
    const stages = run.events.filter((e) => e.kind === "stage");
    for (const e of stages.slice(1).slice(-2)) add(e.time, `before ${e.subject || "the next stage"}`, 1);
    const block = run.findings.find((f) => f.id === "touchdown.first")?.value ?? undefined;
    const touchdown = block ?? run.events.find((e) => e.kind === "touchdown")?.time;
    if (touchdown !== undefined) add(touchdown, block === undefined ? "first touchdown" : "upper block touches down", 1);
    const lastStage = Math.max(begin, ...stages.map((e) => e.time));
    // How far the collapse has come: by the height of the mass centre, else by the time since the last stage.
    const height = run.series.find((s) => s.id === "mass_centre_height")?.value;
    const progress = run.time.map((t, i) => {
      const fallen = (height?.[0] ?? 0) - (height?.[i] ?? height?.[0] ?? 0);
      return height === undefined ? Math.max(0, t - lastStage) : fallen;
    });
    const progressAt = (t: number): number => progress[findFrame(run.time, t).frame] ?? 0;
    while (moments.length < count) {
      moments.sort((a, b) => a.time - b.time);
      let best = -1;
      let gap = 0;
      for (let i = 0; i + 1 < moments.length; ++i) {
        const from = moments[i]?.time ?? 0, to = moments[i + 1]?.time ?? 0;
        const width = progressAt(to) - progressAt(from);
        if (width > gap && to - from > 2.2 * least) {
          gap = width;
          best = i;
        }
      }
      if (best < 0) break;
      const from = moments[best]?.time ?? 0, to = moments[best + 1]?.time ?? 0;
      const middle = progressAt(from) + gap / 2;
      const frame = run.time.findIndex((t, i) => t > from && (progress[i] as number) >= middle);
      const before = moments.length;
      add(run.time[frame] ?? from, "", 2);
      if (moments.length === before) add((from + to) / 2, "", 2);
      if (moments.length === before) break;
    }
  }
  return moments
    .sort((a, b) => a.rank - b.rank)
    .slice(0, count)
    .sort((a, b) => a.time - b.time);
}

export function Stills(props: { state: State; stills: Still[] }) {
  if (props.stills.length === 0) return null;
  return (
    <section class="panel stills" aria-label="Sequence">
      <h2>Sequence</h2>
      <div class="still-row">
        {props.stills.map((still) => (
          <button type="button" title="Go to this time" onClick={() => (props.state.pauseAt(still.time), showStage())}>
            <img src={still.picture} alt={`The building at ${formatTime(still.time)}${still.caption === "" ? "" : `, ${still.caption}`}`} />
            <span><strong>{formatTime(still.time)}</strong>{still.caption === "" ? "" : ` ${still.caption}`}</span>
          </button>
        ))}
      </div>
    </section>
  );
}
