/// Labels of a plan: none covers another one, and one that belongs to a line stands where others are far.
import type { Point } from "../data";

export interface Label {
  text: string;
  /// Where its middle may be, the best first.
  places: readonly Point[];
  /// What it should not stand on.
  avoid?: readonly Point[];
}

export const height = 14;
const letter = 6.7; // of text of 12 px
const far = 12; // from what is to be avoided, as if the label were as high as wide; farther is no better

export const calcWidth = (text: string): number => letter * [...text].length + 4;

/// Points along a closed line, its corners among them, at most `step` apart.
export function walk(corners: readonly Point[], step: number): Point[] {
  return corners.flatMap((a, i) => {
    const b = corners[(i + 1) % corners.length] as Point;
    const count = Math.max(1, Math.ceil(Math.hypot(b[0] - a[0], b[1] - a[1]) / step));
    return Array.from({ length: count }, (_, k): Point => [a[0] + ((b[0] - a[0]) * k) / count, a[1] + ((b[1] - a[1]) * k) / count]);
  });
}

/// The middle of each label within a frame; undefined of one that fits nowhere.
export function placeLabels(labels: readonly Label[], frame: { left: number; right: number; top: number; foot: number }): (Point | undefined)[] {
  const taken: { x: number; y: number; width: number }[] = [];
  return labels.map(({ text, places, avoid = [] }) => {
    const width = calcWidth(text);
    let best: Point | undefined;
    let most = -Infinity;
    for (const place of places) {
      const [x, y] = place;
      if (x - width / 2 < frame.left || x + width / 2 > frame.right || y - height / 2 < frame.top || y + height / 2 > frame.foot) continue;
      if (taken.some((t) => Math.abs(t.x - x) < (t.width + width) / 2 && Math.abs(t.y - y) < height)) continue;
      const clear = avoid.reduce((least, [ax, ay]) => Math.min(least, Math.hypot(((ax - x) * height) / width, ay - y)), far);
      if (clear <= most) continue;
      most = clear;
      best = place;
      if (most === far) break;
    }
    if (best !== undefined) taken.push({ x: best[0], y: best[1], width });
    return best;
  });
}

/// Titles of axes at `places` in as few rows as they take, row 0 nearest to the lines; one that is wider than all of it is cut.
export function layTitles(titles: readonly string[], places: readonly number[], width: number): { text: string; x: number; row: number }[] {
  const edge = 4, ends: number[] = []; // of what each row holds
  return titles.map((title, k) => {
    const most = Math.floor((width - 2 * edge) / calcWidth("x".repeat(10)) * 10);
    const text = title.length > most ? `${title.slice(0, Math.max(1, most - 1))}…` : title;
    const half = calcWidth(text) / 2;
    const x = Math.max(edge + half, Math.min(width - edge - half, places[k] as number));
    let at = ends.findIndex((end) => end <= x - half);
    if (at < 0) at = ends.length;
    ends[at] = x + half;
    return { text, x, row: at };
  });
}
