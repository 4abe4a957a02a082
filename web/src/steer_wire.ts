/// What the steering protocol sends (docs/protocol.md), as types. SI throughout.
import type { Crushed, Finding, Frame, RunEvent } from "./data";

export type Phase = "building" | "equilibrium" | "paused" | "running" | "finished" | "failed";
export interface Ending {
  kind: string;
  text: string;
  code?: string; // of "plan" and "failed"
}
export interface Charge {
  index: number;
  stage: number;
  member: string;
  position: number;
  destroyed_length: number;
  residual_bars: number;
  residual_concrete: number;
  time: number;
  fired: boolean;
  fails: boolean;
  removed: boolean;
}
export interface Stage {
  index: number;
  name: string;
  time: number;
}
export interface Cable {
  name: string;
  body: string | number;
  anchor: [number, number, number];
  force: number | null;
  pretension?: number;
  let_go: boolean;
}
export interface Edit {
  kind: string;
  time: number;
  text: string;
}
export interface Branch {
  id: number;
  name: string;
  parent: number | null;
  time: number;
  frontier: number;
  frames: number;
  first_frame: number;
  starts: number; // how often its frames began anew
  duration: number;
  ending: Ending | null;
  charges: Charge[];
  stages: Stage[];
  cables: Cable[];
  friction: { ground: number; bodies: number };
  edits: Edit[];
  notes: string[];
  snapshots: number[];
  bodies: number;
  zones: number;
  sample?: string | null; // what was drawn, in words
}
export interface Session {
  id: number;
  title: string;
  path: string;
  active: number | null; // none while it is built
  cursor: number | null;
  speed: number | null;
  phase: Phase;
  branches: Branch[];
  fuzzy: boolean;
  diagnostics?: Diagnostic[];
  /// A session of the same plan that one can go on with.
  earlier?: { log: string; created: string; actions: number; branches: number; time: number } | null;
}
export interface Diagnostic {
  severity: string;
  code: string;
  line: number;
  column: number;
  width?: number;
  message: string;
  help?: string;
}
export interface PlanCheck {
  diagnostics: Diagnostic[];
  title: string;
  notes: string[];
  /// Whether anything in the plan takes away a support; false: a dead plan.
  removes_support?: boolean;
}
/// The plan of a branch as a text, and which of its edits are in it.
export interface BranchPlan {
  text: string;
  taken: string[];
  left_out: string[];
}
/// A plan, or a part of one, out of the file of another program, and what became of that.
export interface ImportedPlan {
  text: string;
  taken: string[];
  guessed: string[];
  missing: string[];
}
export interface MemberSection {
  name: string;
  width: number;
  height: number;
  bars: { y: number; z: number; diameter: number }[];
  cover: number;
  steel_area: number;
  ties: { diameter: number; spacing: number; legs_y: number; legs_z: number } | null;
}
/// A member as the branch's plan has it.
export interface PlanMember {
  name: string;
  kind: string;
  storey: number;
  length: number;
  removed: boolean;
  section?: MemberSection;
  panel?: { name: string; thickness: number; as_top: number; as_bottom: number; cover: number; openings: number };
  shaft?: {
    diameter_foot: number; diameter_top: number; thickness_foot: number; thickness_top: number;
    as_outer: number; as_inner: number; bar_diameter: number; hoop_diameter: number; hoop_spacing: number; cover: number;
  };
  concrete: { name: string; fc: number; fct: number; Ec: number } | null;
  steel: { name: string; fy: number; fu: number } | null;
  masonry: { strength: number; density: number } | null;
  cuts: { at: number; cut_bars: number; cut_concrete: number }[];
}
export interface StateEvent {
  phase: Phase;
  branch: number;
  time: number;
  frames: number;
  cursor: number | null;
  speed: number | null;
  real_time_factor: number | null;
  duration: number;
  eta: number | null;
  ending: Ending | null;
  progress?: number | null;
}
export interface LogEntry {
  seq: number;
  action: string;
  branch: number;
  step?: number;
  time: number;
  made?: number;
  command?: Record<string, unknown>;
}
export interface Sample {
  index: number;
  inputs: (number | null)[];
  outputs: (number | null)[];
  outcome: string | null;
  ok: boolean;
}
export interface Bounds {
  output: string;
  alpha: number[];
  low: (number | null)[];
  high: (number | null)[];
}
export interface Study {
  id: number;
  state: "running" | "finished" | "cancelled" | "failed";
  done: number;
  failed: number;
  limit: number;
  seconds: number;
  eta: number | null;
  inputs: { name: string; unit: string }[];
  outputs: { name: string; unit: string }[];
  outcomes: string[];
  bounds: Bounds[];
  possibilities: { outcome: string; possibility: number | null; necessity: number | null }[];
  fans: { time: number[]; alpha: number[]; low: (number | null)[][]; high: (number | null)[][] } | null;
  text: string;
}
export interface LawFamily {
  normal_force: number[]; // (n) [N]
  plastic_rotation: number[]; // (m) [rad]
  positive: (number | null)[][]; // (n x m) [N·m]
  negative: (number | null)[][];
}
export interface ZoneWatch {
  zone: string;
  law: { moment_y: LawFamily; moment_z: LawFamily } | null;
  /// time, N, My, Mz, ry, rz, utilisation, state
  path: (number | null)[][];
}
/// A list [time, N, My, Mz, ry, rz, utilisation, state] a moment.
export interface Comparison {
  time: number[];
  series: { id: string; title: string; unit: string; group: string; a: (number | null)[]; b: (number | null)[] }[];
  bodies: { name: string; distance: number }[];
  largest: { time: number | number[]; distance: number | (number | null)[] } | null;
  findings: { id: string; title: string; a: string | null; b: string | null }[];
  edits?: unknown;
}
export interface FindingsSoFar {
  branch: number;
  time?: number;
  ending: Ending | null;
  findings: Finding[];
  events: RunEvent[];
  not_modelled: string[];
  notes: string[];
}

export interface WireFrame extends Frame {
  session: number;
  branch: number;
  sequence: number;
  row: number; // in the branch's record
  time: number;
  asked: boolean;
  series: Float32Array; // (V)
}

const headerSize = 48;

/// Throws an Error if the bytes are not a frame of this version. The arrays look into `buffer`.
export function decodeFrame(buffer: ArrayBuffer): WireFrame {
  const view = new DataView(buffer);
  if (buffer.byteLength < headerSize || view.getUint32(0, false) !== 0x54504c46) throw new Error("not a frame");
  const version = view.getUint16(4, true);
  if (version !== 1) throw new Error(`a frame of version ${version}`);
  const B = view.getUint32(32, true), Z = view.getUint32(36, true), V = view.getUint32(40, true), C = view.getUint32(44, true);
  if (buffer.byteLength !== headerSize + 28 * B + 4 * V + 5 * Z + 12 * C) throw new Error("a frame of the wrong length");
  let at = headerSize;
  const floats = (count: number): Float32Array => {
    const values = new Float32Array(buffer, at, count); // little-endian, as every browser's machine
    at += 4 * count;
    return values;
  };
  const pose = floats(7 * B);
  const series = floats(V);
  const utilisation = floats(Z);
  const crushed: Crushed[] = [];
  for (let c = 0; c < C; ++c, at += 12)
    crushed.push({
      body: view.getUint32(at, true),
      shape: view.getUint16(at + 4, true),
      axis: view.getUint8(at + 6),
      side: view.getUint8(at + 7) === 1 ? 1 : -1,
      length: view.getFloat32(at + 8, true),
    });
  return {
    session: view.getUint32(8, true),
    branch: view.getUint32(12, true),
    sequence: view.getUint32(16, true),
    row: view.getUint32(20, true),
    time: view.getFloat64(24, true),
    asked: (view.getUint16(6, true) & 2) !== 0,
    pose, series, utilisation, crushed,
    state: new Uint8Array(buffer, at, Z),
  };
}
