/// Words, colours and signs. Colours follow Okabe and Ito, so that they differ for colour-blind readers too; a word or
/// a shape always stands beside them.
import type { Status } from "./data";

export const statusWord: Record<Status, string> = { info: "Note", good: "OK", warning: "Caution", bad: "Problem", not_judged: "Not judged" };

export interface ZoneStateWords {
  word: string;
  colour: string;
  /// Where the colour would drown in a dark ground.
  onDark?: string;
  variable?: string; // of both in style.css
  shape: "circle" | "triangle" | "diamond" | "cross" | "star" | "square";
}
/// Indexed by ZoneState of the record.
export const zoneStates: ZoneStateWords[] = [
  { word: "elastic", colour: "#56b4e9", shape: "circle" },
  { word: "yielded", colour: "#e69f00", shape: "triangle" },
  { word: "softening", colour: "#d55e00", shape: "diamond" },
  { word: "broken", colour: "#7a1f5c", onDark: "#b9a3ff", variable: "--broken", shape: "cross" },
  { word: "fired", colour: "#cc79a7", shape: "star" },
  { word: "crushed stub", colour: "#a50f15", onDark: "#ff8a80", variable: "--crushed", shape: "square" },
];

/// "C-A1-0" says more to its reader with a word in front.
export const kindWord: Record<string, string> = {
  column: "Column",
  beam: "Beam",
  slab: "Slab",
  wall: "Wall",
  node: "Joint block",
  stump: "Stump",
  shaft: "Shaft",
  debris: "Blasted concrete",
};
const kindColours: Record<string, string> = {
  column: "#2f6f9f",
  beam: "#6aaed6",
  slab: "#c9ced3",
  wall: "#d9b98c",
  node: "#8b97a3",
  stump: "#8a5a3c",
  shaft: "#009e73",
  debris: "#c2452d",
};
const spareColours = ["#009e73", "#cc79a7", "#8c6bb1", "#b3a100"];

export function colourOfKind(kind: string, kinds: readonly string[]): string {
  const known = kindColours[kind];
  if (known !== undefined) return known;
  const spare = kinds.filter((k) => kindColours[k] === undefined).indexOf(kind);
  return spareColours[Math.max(0, spare) % spareColours.length] as string;
}

const materialColours: Record<string, string> = { concrete: "#9aa5ae", masonry: "#b5653f", steel: "#3a5f8a", ground: "#8f8570" };
export function colourOfMaterial(material: string, materials: readonly string[]): string {
  const known = materialColours[material];
  if (known !== undefined) return known;
  const spare = materials.filter((m) => materialColours[m] === undefined).indexOf(material);
  return ["#56b4e9", "#e69f00", "#009e73", "#cc79a7", "#f0e442"][Math.max(0, spare) % 5] as string;
}

export function wordOfKind(kind: string): string {
  return kindWord[kind] ?? (kind === "" ? "Part" : kind.charAt(0).toUpperCase() + kind.slice(1));
}

/// End of the ramp of speeds: a fall from 11 m [m/s].
export const highestSpeed = 15;
/// Light to dark, so that it can be read with and without colour vision and in print.
const ramp = ["#fbf8ea", "#fee6a8", "#fec44f", "#fe9929", "#d95f0e", "#993404", "#5c1f05"];
export const rampCss = `linear-gradient(to right, ${ramp.join(", ")})`;
export function colourOfUtilisation(utilisation: number): string {
  const s = Math.min(1, Math.max(0, utilisation)) * (ramp.length - 1);
  const i = Math.min(ramp.length - 2, Math.floor(s));
  const mix = (k: number): number => {
    const a = parseInt((ramp[i] as string).slice(k, k + 2), 16);
    const b = parseInt((ramp[i + 1] as string).slice(k, k + 2), 16);
    return Math.round(a + (s - i) * (b - a));
  };
  return `rgb(${mix(1)}, ${mix(3)}, ${mix(5)})`;
}

export interface EventWords {
  word: string;
  colour: string;
  shape: "circle" | "triangle" | "diamond" | "cross" | "star" | "square" | "down" | "ring";
  /// Many of these belong to one collapse; they are drawn small and can be hidden.
  small: boolean;
}
/// What is a state of zones too has its sign.
const eventWords: Record<string, EventWords> = {
  stage: { word: "Stage", colour: "#0072b2", shape: "circle", small: false },
  charge: { word: "Charge", colour: "#cc79a7", shape: "star", small: true },
  yield: { word: "Yield", colour: "#e69f00", shape: "triangle", small: true },
  softening: { word: "Softening", colour: "#d55e00", shape: "diamond", small: true },
  crushing: { word: "Crushing", colour: "var(--crushed)", shape: "square", small: true },
  rupture: { word: "Rupture", colour: "var(--broken)", shape: "cross", small: true },
  release: { word: "Release", colour: "#8c6bb1", shape: "ring", small: true },
  touchdown: { word: "Touchdown", colour: "var(--touchdown)", shape: "down", small: false },
  contact: { word: "Contact", colour: "#8b97a3", shape: "square", small: true },
  rest: { word: "End", colour: "#009e73", shape: "square", small: false },
  cable: { word: "Cable", colour: "#009e73", shape: "diamond", small: false },
  edit: { word: "Edit", colour: "#0072b2", shape: "diamond", small: false },
  failure: { word: "Failure", colour: "#d55e00", shape: "cross", small: false },
};
export function wordsOfEvent(kind: string): EventWords {
  return eventWords[kind] ?? { word: wordOfKind(kind), colour: "#8b97a3", shape: "circle", small: true };
}

export const endingWord: Record<string, string> = {
  at_rest: "At rest",
  time_limit: "Time limit reached",
  cancelled: "Cancelled",
  failed: "Calculation failed",
  under_way: "Under way",
};

/// Series of one plot.
export const seriesColours = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];
const seriesDashes: number[][] = [[], [8, 4], [2, 3], [10, 3, 2, 3], [5, 2], [1, 2]];

/// The dash changes with the colour, and again when the colours are used up.
export const dashOfSeries = (i: number): number[] =>
  seriesDashes[(i + Math.floor(i / seriesColours.length)) % seriesDashes.length] as number[];

export const groupWord: Record<string, string> = {
  angle: "Tilt angle",
  energy: "Energies",
  force: "Ground force",
  height: "Height of the centre of mass",
  cable: "Pull of cables",
};
export const groupOrder = ["angle", "energy", "force"];
