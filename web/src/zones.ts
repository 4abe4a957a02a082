/// Which zones speak for a body: those of its member, or those that touch it if its member has none.
import type { Run } from "./data";

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
