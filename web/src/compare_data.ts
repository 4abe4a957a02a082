/// Two runs and what sets them apart: docs/compare.md. T instants.
import { cutAt, findBreakUp } from "./plots";
import { formatTime } from "./units";
import { makeRun, type Frame, type Run, type Series } from "./data";

export interface ComparedSeries {
  id: string;
  title: string;
  unit: string;
  group: string;
  a: (number | null)[]; // (T)
  b: (number | null)[]; // (T)
}
export interface Comparison {
  names: [string, string];
  note?: string | null; // that the titles differ
  points: string;
  matched: number;
  touchdown: [number | null, number | null]; // [s]
  until: number | null;
  end?: [number | null, number | null]; // of the records [s]
  tilt_difference: number | null; // [rad]
  tilt_time: number | null;
  tilt_share: number | null;
  centre_difference: number | null; // [m]
  fall_azimuth?: [number | null, number | null]; // towards which tilts count positive [rad]
  lean_azimuth?: [number | null, number | null]; // of all bodies compared, at the end [rad]
  time: number[]; // (T)
  series: ComparedSeries[];
  distance: { rms: (number | null)[]; largest: (number | null)[]; farthest: (string | null)[]; centre: (number | null)[]; lean?: (number | null)[] | null };
  touchdowns: { body: string; a: number | null; b: number | null }[];
}
export interface Photo {
  time: number; // [s]
  name: string;
  data: string; // data: address
}
export interface Compared {
  comparison: Comparison;
  a: Run;
  b: Run;
  photos: Photo[];
  /// A run of the common instants with what is plotted, and the headings of its plots.
  plotted: { run: Run; titles: Record<string, string>; notes: Record<string, string> };
}

const asked = ["tilt_angle", "lean_compared", "mass_centre_height", "ground_force"];

/// Throws an Error with a sentence for people if the text is not the data of a comparison.
export function readComparison(text: string): Compared {
  const raw = JSON.parse(text);
  const comparison = raw?.comparison as Comparison & { format?: string; version?: number };
  if (comparison?.format !== "topple-comparison") throw new Error("This file does not hold a comparison.");
  if (comparison.version !== 1) throw new Error(`The comparison has version ${comparison.version}; this page reads version 1.`);
  const a = makeRun(raw.a), b = makeRun(raw.b);
  return { comparison, a, b, photos: raw.photos, plotted: makePlotted(comparison, a) };
}

/// Each quantity of both runs in a plot of its own.
export function makePlotted(comparison: Comparison, a: Run): Compared["plotted"] {
  const titles: Record<string, string> = {}, notes: Record<string, string> = {};
  const shares = comparison.series.find((s) => s.id === "connected_share");
  const ends = [findBreakUp(shares?.a), findBreakUp(shares?.b)];
  const series: Series[] = [];
  const [nameA, nameB] = comparison.names;
  const rank = (id: string): number => (asked.includes(id) ? asked.indexOf(id) : asked.length);
  const wanted = comparison.series.filter((s) => asked.includes(s.id) || s.group === "energy" || s.group === "force");
  for (const s of wanted.sort((x, y) => rank(x.id) - rank(y.id))) {
    titles[s.id] = s.group === "energy" ? `Energy: ${s.title.charAt(0).toLowerCase()}${s.title.slice(1)}` : s.title;
    // the lean is that of all bodies, whether they hang together or not
    const ofBlock = s.group === "angle" && s.id !== "lean_compared";
    series.push({ id: `${s.id} A`, title: `A ${nameA}`, unit: s.unit, group: s.id, value: ofBlock ? cutAt(s.a, ends[0]) : s.a });
    series.push({ id: `${s.id} B`, title: `B ${nameB}`, unit: s.unit, group: s.id, value: ofBlock ? cutAt(s.b, ends[1]) : s.b });
    const words = ends.map((end, k) => (end === undefined ? "" : `${"AB"[k]} ends at ${formatTime(comparison.time[end] ?? 0)}`)).filter((w) => w !== "");
    if (ofBlock && words.length > 0) notes[s.id] = `${words.join(", ")}, when less than half of the upper block holds together.`;
  }
  const { rms, largest, centre } = comparison.distance;
  titles["distance"] = "How far the same parts are apart";
  series.splice(2 * wanted.filter((s) => asked.includes(s.id)).length, 0,
    { id: "rms", title: "root of the mean square by mass", unit: "m", group: "distance", value: rms },
    { id: "largest", title: "largest", unit: "m", group: "distance", value: largest },
    { id: "centre", title: "mass centres", unit: "m", group: "distance", value: centre });
  const none: Frame = { pose: new Float32Array(7 * a.bodies.length), utilisation: new Float32Array(a.zones.length), state: new Uint8Array(a.zones.length), crushed: [] };
  return { run: { ...a, time: comparison.time, series, frames: comparison.time.map(() => none) }, titles, notes };
}
