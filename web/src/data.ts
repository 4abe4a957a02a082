/// The run as the page reads it: docs/report-data.md. SI throughout. S frames, B bodies, Z zones.

export type Point = [number, number];
export type Triple = [number, number, number];
export type Quadruple = [number, number, number, number];
export type Status = "info" | "good" | "warning" | "bad" | "not_judged";

export interface Shape {
  centre: Triple; // in the body's frame [m]
  orientation: Quadruple; // w x y z
  half: Triple; // half edges [m]
  material: string;
  part?: string; // what it is of a body that carries slabs and walls; empty or none: not known
}
export interface Body {
  name: string;
  kind: string;
  storey: number;
  mass: number | null; // [kg]
  fixed: boolean;
  shapes: Shape[];
}
export interface Zone {
  name: string;
  member: string;
  subsystem: string;
  body_a: number; // -1: the ground
  body_b: number;
  place: Triple; // at the start [m]
}
export interface RunEvent {
  time: number;
  kind: string;
  subject: string;
  text: string;
}
export interface Series {
  id: string;
  title: string;
  unit: string;
  group: string;
  value: (number | null)[]; // (S)
}
export interface Finding {
  id: string;
  heading: string;
  title: string;
  text: string;
  value: number | null;
  unit: string;
  status: Status;
}
export interface Neighbour {
  name: string;
  footprint: Point[];
  is_utility: boolean;
}
export interface Provenance {
  title: string;
  plan_path: string;
  plan_text: string;
  plan_sha256: string;
  program_version: string;
  engine: string;
  machine: string;
  created: string;
  seed: string;
  step: number | null;
  wall_time: number | null;
  threads: number;
}
export interface Run {
  provenance: Provenance;
  ending: { kind: string; text: string };
  counts: {
    bodies: number;
    revolute_joints: number;
    rigid_joints: number;
    force_elements: number;
    cables: number;
    mass: number | null;
  };
  findings: Finding[];
  not_modelled: string[];
  plan_values: { group: string; key: string; value: string }[];
  events: RunEvent[];
  neighbours: Neighbour[];
  building_outline: Point[]; // convex
  building_plan?: Point[][]; // of its parts, as they are; none in pages of earlier versions
  bodies: Body[];
  zones: Zone[];
  time: number[]; // (S)
  series: Series[];
  frames: Frame[]; // (S)
  study?: StudySummary; // of the same building
  others?: { engine: string; title: string; sentences: string[] }[]; // other computations of it; A is this run
}

function calcArea(corners: readonly Point[]): number {
  return corners.reduce((sum, [x, y], i) => {
    const [nx, ny] = corners[(i + 1) % corners.length] as Point;
    return sum + (x * ny - nx * y) / 2;
  }, 0);
}

/// The lines of the building on the ground: its parts as they are, and the convex outline from which reaches count
/// where that is another one; empty where it is not.
export function findBuildingLines(run: Pick<Run, "building_outline" | "building_plan">): { plans: Point[][]; hull: Point[] } {
  const plans = (run.building_plan ?? []).filter((p) => p.length > 2);
  const hull = run.building_outline, area = calcArea(hull);
  const isSame = plans.some((p) => Math.abs(calcArea(p) - area) <= 0.02 * area);
  return { plans, hull: hull.length > 1 && !isSame ? hull : [] };
}

/// What a fuzzy study found, as its results.json says it.
export interface StudySummary {
  title: string;
  runs: number;
  failed: number;
  verdict: { id: string; status: Finding["status"]; text: string }[];
  outcomes: { name: string; is_failure: boolean; runs: number; possibility: number; necessity: number }[];
  outputs: { name: string; unit: string; levels: { alpha: number; lower: number | null; upper: number | null }[] }[];
}

/// By how much an end of a box has receded because its member is crushed.
export interface Crushed {
  body: number;
  shape: number; // of the body
  axis: number; // of the box: 0, 1, 2
  side: number; // 1 or -1
  length: number; // [m]
}

/// What is kept of one moment.
export interface Frame {
  pose: Float32Array; // (B x 7): position x y z [m], orientation w x y z
  utilisation: Float32Array; // (Z)
  state: Uint8Array; // (Z)
  crushed: Crushed[]; // ends that have receded
}

export function decodeBytes(text: string): Uint8Array {
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; ++i) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

/// Little-endian whatever the machine.
export function decodeFloats(text: string): Float32Array {
  const bytes = decodeBytes(text);
  const view = new DataView(bytes.buffer);
  const values = new Float32Array(bytes.length >> 2);
  for (let i = 0; i < values.length; ++i) values[i] = view.getFloat32(4 * i, true);
  return values;
}

/// Throws an Error with a sentence for people if the text is not the data of a run.
export function readRun(text: string): Run {
  return makeRun(JSON.parse(text));
}

/// The same from what JSON.parse gave.
// eslint-disable-next-line @typescript-eslint/no-explicit-any -- the one place where untyped data comes in
export function makeRun(raw: any): Run {
  if (raw === null || typeof raw !== "object" || raw.format !== "topple-report")
    throw new Error("This file does not hold the data of a run.");
  if (raw.version !== 1) throw new Error(`The data of this report has version ${raw.version}; this page reads version 1.`);
  const { position, orientation, zone_state, zone_utilisation, crushed_ends, ...rest } = raw;
  const run: Run = { ...rest, frames: [] };
  const S = run.time.length, B = run.bodies.length, Z = run.zones.length;
  const expect = (what: string, size: number, expected: number): void => {
    if (size !== expected) throw new Error(`The data of this report is damaged: ${what} has ${size} values, not ${expected}.`);
  };
  const positions = decodeFloats(position), orientations = decodeFloats(orientation);
  const states = decodeBytes(zone_state), utilisations = decodeFloats(zone_utilisation);
  expect("position", positions.length, S * B * 3);
  expect("orientation", orientations.length, S * B * 4);
  expect("zone_state", states.length, S * Z);
  expect("zone_utilisation", utilisations.length, S * Z);
  const ends: { end: Crushed; length: Float32Array }[] = [];
  for (const { length, ...end } of crushed_ends ?? []) {
    ends.push({ end, length: decodeFloats(length) });
    expect("crushed_ends", ends[ends.length - 1]?.length.length ?? 0, S);
  }
  for (const series of run.series) expect(series.id, series.value.length, S);
  for (let s = 0; s < S; ++s) {
    const pose = new Float32Array(7 * B);
    for (let b = 0; b < B; ++b) {
      const i = s * B + b;
      for (let k = 0; k < 3; ++k) pose[7 * b + k] = positions[3 * i + k] as number;
      for (let k = 0; k < 4; ++k) pose[7 * b + 3 + k] = orientations[4 * i + k] as number;
    }
    run.frames.push({
      pose,
      utilisation: utilisations.subarray(s * Z, (s + 1) * Z),
      state: states.subarray(s * Z, (s + 1) * Z),
      crushed: ends.filter((e) => e.length[s] !== 0).map((e) => ({ ...e.end, length: e.length[s] as number })),
    });
  }
  return run;
}

/// Frame at or before t, and how far t is on the way to the next one (0..1).
export function findFrame(time: readonly number[], t: number): { frame: number; fraction: number } {
  const last = time.length - 1;
  if (last < 1 || !(t > (time[0] as number))) return { frame: 0, fraction: 0 };
  if (t >= (time[last] as number)) return { frame: last, fraction: 0 };
  let low = 0;
  let high = last;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if ((time[middle] as number) <= t) low = middle;
    else high = middle;
  }
  const begin = time[low] as number;
  return { frame: low, fraction: (t - begin) / ((time[high] as number) - begin) };
}

/// A vector turned by a quaternion w x y z.
export function rotate(q: Quadruple, v: Triple): Triple {
  const [w, x, y, z] = q;
  const t: Triple = [2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])];
  return [v[0] + w * t[0] + y * t[2] - z * t[1], v[1] + w * t[1] + z * t[0] - x * t[2], v[2] + w * t[2] + x * t[1] - y * t[0]];
}

/// What is crushed on the way from frame `frame` to the next.
export function calcCrushed(run: Run, frame: number, fraction: number): Crushed[] {
  const now = run.frames[frame]?.crushed ?? [];
  const next = fraction > 0 ? run.frames[frame + 1]?.crushed : undefined;
  if (next === undefined) return now;
  const key = (c: Crushed): string => `${c.body} ${c.shape} ${c.axis} ${c.side}`;
  const begin = new Map(now.map((c) => [key(c), c.length]));
  return next.map((c) => {
    const from = begin.get(key(c)) ?? 0;
    return { ...c, length: from + fraction * (c.length - from) };
  });
}

/// A shape with its ends receded.
export function shorten(shape: Shape, ends: readonly Crushed[]): Shape {
  if (ends.length === 0) return shape;
  const half: Triple = [...shape.half], centre: Triple = [...shape.centre];
  for (const { axis, side, length } of ends) {
    half[axis as 0 | 1 | 2] -= 0.5 * length;
    const along = rotate(shape.orientation, [0, 1, 2].map((k) => (k === axis ? -0.5 * side * length : 0)) as Triple);
    for (const k of [0, 1, 2] as const) centre[k] += along[k];
  }
  return { ...shape, half, centre };
}

/// out = the way from the quaternion at index i of a to that at index j of b, at constant angular speed. w x y z.
export function slerp(a: Float32Array, i: number, b: Float32Array, j: number, s: number, out: Quadruple): void {
  const aw = a[i] as number, ax = a[i + 1] as number, ay = a[i + 2] as number, az = a[i + 3] as number;
  let bw = b[j] as number, bx = b[j + 1] as number, by = b[j + 2] as number, bz = b[j + 3] as number;
  let cosine = aw * bw + ax * bx + ay * by + az * bz;
  if (cosine < 0) {
    cosine = -cosine;
    bw = -bw; bx = -bx; by = -by; bz = -bz;
  }
  let wa = 1 - s;
  let wb = s;
  if (cosine < 0.9995) {
    const angle = Math.acos(cosine);
    wa = Math.sin(wa * angle) / Math.sin(angle);
    wb = Math.sin(wb * angle) / Math.sin(angle);
  }
  const w = wa * aw + wb * bw, x = wa * ax + wb * bx, y = wa * ay + wb * by, z = wa * az + wb * bz;
  const length = Math.hypot(w, x, y, z) || 1;
  out[0] = w / length; out[1] = x / length; out[2] = y / length; out[3] = z / length;
}

/// Pose of one body on the way from frame `frame` to the next; false where the record holds no finite pose.
export function calcPose(run: Run, body: number, frame: number, fraction: number, p: Triple, q: Quadruple): boolean {
  const a = (run.frames[frame] as Frame).pose;
  const b = fraction > 0 ? (run.frames[frame + 1] as Frame).pose : a;
  const i = 7 * body;
  for (let k = 0; k < 3; ++k) {
    const begin = a[i + k] as number;
    p[k] = begin + fraction * ((b[i + k] as number) - begin);
  }
  slerp(a, i + 3, b, i + 3, fraction, q);
  return Number.isFinite(p[0] + p[1] + p[2] + q[0] + q[1] + q[2] + q[3]);
}
