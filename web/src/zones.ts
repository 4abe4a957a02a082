/// Which zones speak for a body: those of its member, or those that touch it if its member has none.
import type { Body, Run, Shape } from "./data";

export type ZonesOfBody = number[][];

export function findZonesOfBodies(run: Run): ZonesOfBody {
  const ofMember = new Map<string, number[]>();
  const touching: number[][] = run.bodies.map(() => []);
  run.zones.forEach((zone, z) => {
    const list = ofMember.get(zone.member);
    if (list === undefined) ofMember.set(zone.member, [z]);
    else list.push(z);
    for (const body of new Set([zone.body_a, zone.body_b])) touching[body]?.push(z);
  });
  return run.bodies.map((body, b) => ofMember.get(body.name) ?? touching[b] ?? []);
}

/// The body that carries a name of a member or a zone, -1 if none does.
export function findBody(run: Run, subject: string): number {
  const exact = run.bodies.findIndex((b) => b.name === subject);
  if (exact >= 0 || subject === "") return exact;
  const zone = run.zones.find((z) => z.name === subject);
  if (zone === undefined) return -1;
  const member = run.bodies.findIndex((b) => b.name === zone.member);
  return member >= 0 ? member : Math.max(zone.body_a, zone.body_b);
}

/// What a shape of a column or beam is: members carry the panels that are cast to them. Where the record does not say, a
/// shape of at most 20 cm is a slab if it lies and a wall if it stands.
export function partOfShape(body: Body, shape: Shape): string {
  if (shape.part !== undefined && shape.part !== "") return shape.part;
  if (body.kind !== "column" && body.kind !== "beam" && body.kind !== "node") return body.kind;
  const least = Math.min(...shape.half);
  if (!(2 * least <= 0.2001)) return body.kind;
  const axis = shape.half.indexOf(least);
  const [w, x, y, z] = shape.orientation;
  // how upright the thin direction is
  const up = [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)][axis] as number;
  return Math.abs(up) > 0.7 ? "slab" : "wall";
}

/// The kinds of parts of a run, in the order of their first shape.
export function findParts(run: Run): string[] {
  const found = new Set<string>();
  for (const body of run.bodies) for (const shape of body.shapes) found.add(partOfShape(body, shape));
  const order = ["column", "beam", "slab", "wall", "node", "stump", "debris"];
  const rank = (kind: string): number => (order.includes(kind) ? order.indexOf(kind) : order.length);
  return [...found].sort((a, b) => rank(a) - rank(b));
}

/// The materials of the shapes of a run, in the order of their first shape.
export function findMaterials(run: Run): string[] {
  const found = new Set<string>();
  for (const body of run.bodies) for (const shape of body.shapes) found.add(shape.material);
  return [...found];
}
