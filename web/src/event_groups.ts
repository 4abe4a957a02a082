/// Events of one kind in one time span, for paper, where a list of hundreds helps nobody.
import type { Run } from "./data";

type Event = Run["events"][number];

export interface EventGroup {
  kind: string;
  from: number;
  to: number;
  events: Event[]; // in order of time
}

const most = 36; // groups: what a page of A4 holds, some in two lines

/// Groups in the order of their beginnings. Events of a kind that follow each other within a gap are one group; the gap begins
/// at a tenth of a second and doubles until there are few enough. What a stage sets off stands apart from what was before it.
export function groupEvents(events: readonly Event[]): EventGroup[] {
  const ordered = [...events].sort((a, b) => a.time - b.time);
  const stages = ordered.filter((e) => e.kind === "stage").map((e) => e.time);
  const spanOf = (time: number): number => stages.filter((t) => t <= time).length;
  const length = (ordered[ordered.length - 1]?.time ?? 0) - (ordered[0]?.time ?? 0);
  for (let gap = 0.1; ; gap *= 2) {
    const groups: EventGroup[] = [];
    const open = new Map<string, EventGroup>();
    for (const e of ordered) {
      const last = open.get(e.kind);
      if (e.kind !== "stage" && last !== undefined && e.time - last.to <= gap && spanOf(e.time) === spanOf(last.to)) {
        last.to = e.time;
        last.events.push(e);
        continue;
      }
      const group = { kind: e.kind, from: e.time, to: e.time, events: [e] };
      open.set(e.kind, group);
      groups.push(group);
    }
    if (groups.length <= most || gap > length) return groups;
  }
}
