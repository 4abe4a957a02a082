// A made-up run for the tests of the page: a frame of seven storeys on four rows that tilts over its last row.
// It imitates the shape and size of a real record, not its physics. Names and texts are hostile on purpose.
import { readFile, writeFile } from "node:fs/promises";

export const hostile = `</script><script>document.title="broken out"</script><img src=x onerror=alert(1)><!-- &amp;`;

const rows = [0, 3, 5.5, 12];
const frames = [0, 5.5, 11, 16.5, 22];
const storeys = 7;
const storeyHeight = 3.14;
const rowNames = ["A", "B", "C", "D"];
const rear = rows[3];

function base64OfFloats(values) {
  const bytes = Buffer.alloc(values.length * 4);
  values.forEach((value, i) => bytes.writeFloatLE(value, 4 * i));
  return bytes.toString("base64");
}

/// A repeatable number from 0 to 1.
function noise(seed) {
  const x = Math.sin(seed * 12.9898) * 43758.5453;
  return x - Math.floor(x);
}

function makeBodies() {
  const bodies = [];
  const add = (name, kind, storey, centre, half, material = "concrete") =>
    bodies.push({
      name, kind, storey, mass: 8 * half[0] * half[1] * half[2] * 2400, fixed: false, start: centre,
      shapes: [{ centre: [0, 0, 0], orientation: [1, 0, 0, 0], half, material }],
    });
  for (let s = 0; s < storeys; ++s) {
    const z = s * storeyHeight;
    rows.forEach((x, r) =>
      frames.forEach((y, f) => {
        const b = s === 0 ? 0.25 : 0.2;
        add(`C-${rowNames[r]}${f + 1}-${s}`, "column", s, [x, y, z + 1.22], [b, b, 1.22]);
      }),
    );
    for (let r = 0; r < 3; ++r)
      frames.forEach((y, f) =>
        add(`B-${rowNames[r]}${f + 1}${rowNames[r + 1]}${f + 1}-${s}`, "beam", s,
          [(rows[r] + rows[r + 1]) / 2, y, z + 2.72], [(rows[r + 1] - rows[r]) / 2 - 0.21, 0.2, 0.28]),
      );
    for (let f = 0; f < 2; ++f)
      add(`S-A${2 * f + 1}D${2 * f + 3}-${s}`, "slab", s, [6, 5.5 + 11 * f, z + 3.07], [6.2, 5.45, 0.08]);
    if (s > 0 && s % 2 === 0) add(`W-A1D1-${s}`, "wall", s, [8.75, 0, z + 1.22], [3, 0.08, 1.2]);
    if (s === 0) add(`W-D1D2-0`, "wall", s, [12, 2.75, 1.22], [0.12, 2.5, 1.2], "masonry");
  }
  bodies[3].name = hostile;
  return bodies;
}

/// The data of a report. `frameCount` frames over nine seconds; the second stage fires at `second`.
export function makeSynthetic(frameCount = 300, second = 4) {
  const late = second - 4;
  const bodies = makeBodies();
  const B = bodies.length;
  const zones = [];
  bodies.forEach((body, b) => {
    if (body.kind !== "column" && body.kind !== "beam") return;
    const along = body.kind === "column" ? 2 : 0;
    for (const [end, sign] of [["foot", -1], ["head", 1]]) {
      const place = [...body.start];
      place[along] += sign * body.shapes[0].half[along];
      zones.push({
        name: `${body.name}/${body.kind === "column" ? end : sign < 0 ? "start" : "end"}`,
        member: body.name,
        subsystem: body.storey === 0 && body.start[0] === rear ? "revolute joint + rotational element" : "six-component element",
        body_a: b, body_b: b > 0 ? b - 1 : -1, place,
      });
    }
  });
  zones.push({ name: "ground", member: "", subsystem: "rigid joint", body_a: -1, body_b: -1, place: [0, 0, 0] });
  const Z = zones.length;

  const end = 9;
  const time = Array.from({ length: frameCount }, (_, i) => (end * i) / (frameCount - 1));
  const position = new Float32Array(frameCount * B * 3);
  const orientation = new Float32Array(frameCount * B * 4);
  const zoneState = new Uint8Array(frameCount * Z);
  const zoneUtilisation = new Float32Array(frameCount * Z);
  const touchdown = 6.6 + late;
  const angleAt = (t) => (t < second ? 0 : Math.min(1.52, 0.02 * (Math.cosh(1.72 * (t - second)) - 1)));
  const fallen = angleAt(touchdown);
  const isCharged = (body) => body.kind === "column" && body.storey === 0 && body.start[0] < rear;
  const fires = (body) => (body.start[0] < 4 ? 0.5 : second);

  time.forEach((t, i) => {
    const angle = Math.min(fallen, angleAt(t)) + (t > touchdown ? (1.52 - fallen) * (1 - Math.exp(-2 * (t - touchdown))) : 0);
    bodies.forEach((body, b) => {
      let [x, y, z] = body.start;
      let turn = 0;
      if (isCharged(body)) {
        const since = Math.max(0, t - fires(body));
        turn = -Math.min(Math.PI / 2, 2.2 * since ** 2);
        z = Math.max(0.25, z - 4.9 * since ** 2 * noise(b));
        x -= Math.min(1.2, since ** 2);
      } else if (body.storey > 0 || body.kind !== "wall") {
        // Turning about the foot of the rear row, towards the front; parts sag apart after the touchdown.
        const dx = x - rear, dz = z;
        const isRear = body.storey === 0 && body.kind === "column";
        const share = isRear ? Math.min(angle, 0.5 * angle) : angle;
        x = rear + dx * Math.cos(share) - dz * Math.sin(share);
        z = -dx * -Math.sin(share) + dz * Math.cos(share);
        turn = -share;
        if (t > touchdown) {
          const s = Math.min(1, (t - touchdown) / 1.2);
          x += s * 2.2 * (noise(b + 7) - 0.6);
          y += s * 1.6 * (noise(b + 3) - 0.5);
          turn += s * 0.7 * (noise(b + 11) - 0.5);
          z -= s * z * 0.55 * noise(b + 5);
        }
        z = Math.max(z, 0.3);
      }
      position.set([x, y, z], 3 * (i * B + b));
      orientation.set([Math.cos(turn / 2), 0, Math.sin(turn / 2), 0], 4 * (i * B + b));
    });
    zones.forEach((zone, k) => {
      const body = bodies[zone.body_a];
      let state = 0;
      let use = 0.3 + 0.2 * noise(k);
      if (body !== undefined) {
        if (isCharged(body)) state = t >= fires(body) ? 4 : 0;
        else if (body.storey === 0) state = t < 4.1 + late ? 0 : t < 5 + late ? 1 : t < 6 + late ? 2 : 3;
        else if (t > touchdown + noise(k)) state = noise(k + 1) < 0.5 ? 3 : 2;
        else if (body.kind === "beam" && t > 0.7 && body.start[0] < rear && noise(k) < 0.15) state = 1;
        use = state === 0 ? use + (t > second ? 0.3 : 0) : 1 + 0.1 * state;
      }
      zoneState[i * Z + k] = state;
      zoneUtilisation[i * Z + k] = zone.member === "" ? NaN : use;
    });
  });

  const weight = 1900e3 * 9.81;
  const tilt = time.map((t) => -Math.min(1.52, angleAt(t)));
  const events = [
    { time: 0.5, kind: "stage", subject: "Stage 1", text: "Stage 1 fires: rows A and B." },
    ...bodies.filter(isCharged).map((b) => ({ time: fires(b), kind: "charge", subject: b.name, text: `The charge in ${b.name} fires.` })),
    { time: second, kind: "stage", subject: "Stage 2", text: "Stage 2 fires: row C." },
    ...zones.filter((z) => z.body_a >= 0 && noise(z.body_a) < 0.3).map((z, i) => ({ time: 4.1 + late + 0.01 * i, kind: "yield", subject: z.name, text: `${z.name} yields.` })),
    { time: 5.9 + late, kind: "rupture", subject: "C-D1-0/foot", text: "The bars of C-D1-0/foot break." },
    { time: touchdown, kind: "touchdown", subject: "C-A1-6", text: "C-A1-6 touches the ground at 14.2 m/s." },
    { time: 6.9 + late, kind: "touchdown", subject: "C-A3-6", text: "C-A3-6 touches the ground at 12.1 m/s." },
    { time: 8.7 + late, kind: "rest", subject: "", text: "Nothing moves faster than 0.1 m/s." },
  ];
  return {
    format: "topple-report",
    version: 1,
    provenance: {
      title: "Storehouse of seven storeys (synthetic)", plan_path: "examples/made-up/plan.toml",
      plan_text: `title = "Storehouse"\n# ${hostile}\n`, plan_sha256: "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08",
      program_version: "0.1.0", engine: "native", machine: "x86-64, 2 cores", created: "2026-01-01T12:00:00Z",
      seed: "1", step: 1e-4, wall_time: 12.4, threads: 2,
    },
    ending: { kind: "at_rest", text: "All parts are at rest at 8.70 s." },
    counts: { bodies: B, revolute_joints: 19, rigid_joints: 43, force_elements: 640, cables: 0, mass: 1.9e6 },
    findings: [
      { id: "mechanism", heading: "Mechanism", title: "Mechanism", text: "The building topples over row D to the front (180°), as planned.", value: 3.14, unit: "rad", status: "good" },
      { id: "stability", heading: "Stability", title: "Before the first charge", text: "Stands; the lowest margin is 2.1 in C-B3-0/foot.", value: 2.1, unit: "", status: "good" },
      { id: "between", heading: "Stability", title: "Between stage 1 and stage 2", text: "Stands for 3.5 s on rows C and D; the lowest margin is 1.08 in B-B3C3-0/end.", value: 1.08, unit: "", status: "warning" },
      { id: "azimuth", heading: "Fall and debris", title: "Direction of fall", text: "181° (asked for: 180° ± 10°).", value: 3.16, unit: "rad", status: "good" },
      { id: "reach", heading: "Fall and debris", title: "Reach beyond the footprint", text: "23.4 m towards the front; hill 4.1 m high, 1 240 m³.", value: 23.4, unit: "m", status: "info" },
      { id: "clearance.7", heading: "Clearances", title: "House no. 7", text: "Debris stops 1.4 m away; asked for are 3.0 m.", value: 1.4, unit: "m", status: "bad" },
      { id: "clearance.gas", heading: "Clearances", title: `Gas main ${hostile}`, text: "Debris stops 6.1 m away; asked for are 5.0 m.", value: 6.1, unit: "m", status: "good" },
      { id: "vibration", heading: "Touchdown and ground", title: "Ground vibration (screening)", text: "4 to 11 mm/s at House no. 7; limit 10 mm/s. The prediction is uncertain.", value: null, unit: "m/s", status: "warning" },
    ],
    not_modelled: ["Flight of charge fragments.", "Air overpressure.", "Dust.", "Damage of neighbours when hit."],
    plan_values: [
      { group: "Building", key: "Height", value: "22 m" }, { group: "Building", key: "Length", value: "22 m" },
      { group: "Building", key: "Mass", value: "1 900 t" }, { group: "Materials", key: "Concrete", value: "C20/25, fc 25 N/mm2" },
      { group: "Materials", key: "Steel", value: "fy 420 N/mm2" }, { group: "Stages", key: "Stage 1", value: "0.5 s, rows A and B" },
      { group: "Stages", key: "Stage 2", value: "4.0 s, row C" }, { group: "Ground", key: "Friction", value: "0.6" },
    ],
    events,
    neighbours: [
      { name: "House no. 7", footprint: [[-32, 2], [-24, 2], [-24, 12], [-32, 12]], is_utility: false },
      { name: `Gas main ${hostile.slice(0, 16)}`, footprint: [[-34, -8], [24, -8], [24, -7.4], [-34, -7.4]], is_utility: true },
    ],
    building_outline: [[-0.25, -0.25], [12.25, -0.25], [12.25, 22.25], [-0.25, 22.25]],
    bodies: bodies.map(({ start, ...body }) => body),
    zones,
    time,
    series: [
      { id: "tilt_angle", title: "Tilt angle", unit: "rad", group: "angle", value: tilt },
      { id: "energy_kinetic", title: "Kinetic", unit: "J", group: "energy", value: tilt.map((a, i) => 55e6 * a * a * (time[i] > touchdown ? Math.exp(-3 * (time[i] - touchdown)) : 1)) },
      { id: "energy_potential", title: "Potential", unit: "J", group: "energy", value: tilt.map((a) => -weight * 9 * (1 - Math.cos(a))) },
      { id: "energy_dissipated", title: "Dissipated", unit: "J", group: "energy", value: tilt.map((a, i) => (i === 0 ? null : 30e6 * Math.abs(a))) },
      { id: "ground_force", title: "Ground force", unit: "N", group: "force", value: time.map((t) => weight * (1 - 0.3 * Math.exp(-((t - 5.6 - late) ** 2) * 3) + 2.5 * Math.exp(-((t - touchdown) ** 2) * 60))) },
      { id: "mass_centre_height", title: "Height of the centre of mass", unit: "m", group: "height", value: tilt.map((a) => 11 - 9 * (1 - Math.cos(a))) },
    ],
    position: base64OfFloats(position),
    orientation: base64OfFloats(orientation),
    zone_state: Buffer.from(zoneState).toString("base64"),
    zone_utilisation: base64OfFloats(zoneUtilisation),
  };
}

export function makeEmpty() {
  const data = makeSynthetic(2);
  return {
    ...data, findings: [], not_modelled: [], plan_values: [], events: [], neighbours: [], building_outline: [], bodies: [],
    zones: [], time: [], series: [], position: "", orientation: "", zone_state: "", zone_utilisation: "",
    ending: { kind: "failed", text: "The dead load found no equilibrium." },
    provenance: { ...data.provenance, title: "", plan_text: "", step: null, wall_time: null },
    counts: { ...data.counts, bodies: 0, mass: null },
  };
}

/// Writes a page with these data in it, as write_report does.
export async function writePage(data, path) {
  const page = await readFile(new URL("../dist/report.html", import.meta.url), "utf8");
  const text = JSON.stringify(data).replace(/</g, "\\u003c");
  const script = `<script type="application/json" id="topple-data">${text}</script>`;
  await writeFile(path, page.replace("<!--TOPPLE-DATA-->", () => script));
}

/// The made-up building as often beside itself as it takes, over fewer frames.
export function makeMany(count) {
  const frames = count > 2000 ? 150 : 270;
  const one = makeSynthetic(frames);
  const B = one.bodies.length, copies = Math.max(1, Math.round(count / B));
  const floats = (text) => new Float32Array(Uint8Array.from(Buffer.from(text, "base64")).buffer);
  const p = floats(one.position), q = floats(one.orientation);
  const N = B * copies;
  const position = new Float32Array(frames * N * 3), orientation = new Float32Array(frames * N * 4);
  const side = Math.ceil(Math.sqrt(copies));
  for (let s = 0; s < frames; ++s)
    for (let c = 0; c < copies; ++c)
      for (let b = 0; b < B; ++b) {
        const from = s * B + b, to = s * N + c * B + b;
        for (let k = 0; k < 3; ++k) position[3 * to + k] = p[3 * from + k] + (k === 0 ? 16 * (c % side) : k === 1 ? 26 * Math.floor(c / side) : 0);
        for (let k = 0; k < 4; ++k) orientation[4 * to + k] = q[4 * from + k];
      }
  const text = (values) => Buffer.from(values.buffer).toString("base64");
  return {
    ...one, bodies: Array.from({ length: N }, (_, i) => ({ ...one.bodies[i % B], name: `${one.bodies[i % B].name}-${Math.floor(i / B)}` })),
    position: text(position), orientation: text(orientation),
  };
}
