// The parts of the page that need no browser.
import assert from "node:assert/strict";
import { describe, it } from "node:test";
import * as THREE from "three";
import { load } from "./load.mjs";
import { makeSynthetic } from "./synthetic.mjs";

const { decodeFloats, findFrame, slerp, readRun, calcPose } = await load("data.ts");
const { atLeast, atMost, dropRoundOff, findLargest, formatNumber, formatValue, toReadable, formatDuration, formatDate, formatMass, prettify, describeValues } = await load("units.ts");
const { findCoherent } = await load("plots.tsx");
const { chooseAxes } = await load("steer_study.tsx");
const { listConditions } = await load("handover.tsx");
const { chooseMoments } = await load("stills.tsx");
const { findZonesOfBodies, findBody, partOfShape } = await load("zones.ts");
const { colourOfUtilisation, wordsOfEvent, zoneStates } = await load("vocabulary.ts");
const { BranchRun } = await load("steer_branch.ts");
const { makeLook } = await load("state.ts");
const { toScreen, linear } = await load("colour.ts");

describe("axes of parallel coordinates", () => {
  it("always have room for outputs, and say what is left", () => {
    const make = (count, word) => Array.from({ length: count }, (_, k) => ({ name: `${word} ${k}` }));
    assert.equal(chooseAxes(make(3, "in"), make(4, "out")).axes.length, 7);
    const { axes, left } = chooseAxes(make(20, "in"), make(5, "out"));
    assert.equal(axes.length, 14);
    assert.equal(axes.filter((a) => a.name.startsWith("out")).length, 5);
    assert.equal(left.length, 11);
    assert.equal(chooseAxes(make(3, "in"), make(20, "out")).left.length, 9);
  });
});

describe("data", () => {
  it("reads little-endian floats", () => {
    // 1.0 is 00 00 80 3f, -2.5 is 00 00 20 c0.
    assert.deepEqual([...decodeFloats(Buffer.from("0000803f000020c0", "hex").toString("base64"))], [1, -2.5]);
  });

  it("finds the frame at or before a time", () => {
    const time = [0, 1, 3, 4];
    assert.deepEqual(findFrame(time, -1), { frame: 0, fraction: 0 });
    assert.deepEqual(findFrame(time, 0), { frame: 0, fraction: 0 });
    assert.deepEqual(findFrame(time, 1), { frame: 1, fraction: 0 });
    assert.deepEqual(findFrame(time, 2.5), { frame: 1, fraction: 0.75 });
    assert.deepEqual(findFrame(time, 9), { frame: 3, fraction: 0 });
    assert.deepEqual(findFrame([], 1), { frame: 0, fraction: 0 });
    assert.deepEqual(findFrame([2], 5), { frame: 0, fraction: 0 });
  });

  it("turns at constant speed on the short way", () => {
    const turn = (angle, sign = 1) => [sign * Math.cos(angle / 2), 0, sign * Math.sin(angle / 2), 0];
    for (const sign of [1, -1]) {
      const q = new Float32Array([...turn(0.2), ...turn(1.8, sign)]);
      const out = [1, 0, 0, 0];
      slerp(q, 0, q, 4, 0.25, out);
      // Float32 quaternions: 1e-6 is ten times their round-off.
      turn(0.6).forEach((value, k) => assert.ok(Math.abs(out[k] - value) < 1e-6));
    }
  });

  it("interpolates a pose between frames", () => {
    const run = readRun(JSON.stringify(makeSynthetic(10)));
    const p = [0, 0, 0], q = [1, 0, 0, 0];
    assert.ok(calcPose(run, 20, 6, 0.5, p, q));
    const a = run.frames[6].pose[7 * 20], b = run.frames[7].pose[7 * 20];
    assert.ok(Math.abs(p[0] - (a + b) / 2) < 1e-9);
    assert.ok(Math.abs(Math.hypot(...q) - 1) < 1e-12);
  });

  it("refuses what is not a run", () => {
    assert.throws(() => readRun("null"), /does not hold/);
    const data = makeSynthetic(2);
    assert.throws(() => readRun(JSON.stringify({ ...data, version: 2 })), /version 2/);
    assert.throws(() => readRun(JSON.stringify({ ...data, zone_state: "" })), /zone_state/);
  });
});

describe("units", () => {
  it("turns SI into what people read", () => {
    assert.equal(formatValue(Math.PI * toReadable("rad").factor, toReadable("rad").unit), "180.0°");
    assert.equal(formatValue(18.64e6 * toReadable("N").factor, toReadable("N").unit), "18.64 MN");
    assert.equal(formatValue(-45e6 * toReadable("J").factor, toReadable("J").unit), "−45.00 MJ");
    assert.equal(formatValue(1, "furlong"), "1.000 furlong");
  });

  it("keeps four digits from small to large", () => {
    assert.deepEqual([0, 0.00123456, 12.3456, 98765.4, 1.23456e9, null, NaN].map((v) => formatNumber(v)),
      ["0", "0.001235", "12.35", "98765", "1.235 × 10⁹", "–", "–"]);
  });

  it("rounds degrees so that at least and at most stay true", () => {
    assert.deepEqual([0.456598936, 0.9999, 0.0012349, 0.29, 0.57, 0.5, 1, 0, null].map((v) => atLeast(v, 3)),
      ["≥ 0.456", "≥ 0.999", "≥ 0.00123", "≥ 0.290", "≥ 0.570", "≥ 0.500", "1", "≥ 0", "–"]);
    assert.deepEqual([1 - 0.456598936, 0.9999, 0.0012341, 0.29, 0.57, 0.5, 1, 0, null].map((v) => atMost(v, 3)),
      ["≤ 0.544", "≤ 1.00", "≤ 0.00124", "≤ 0.290", "≤ 0.570", "≤ 0.500", "≤ 1.00", "0", "–"]);
  });

  it("shows no round-off of what cancels", () => {
    const largest = findLargest([[200, null, -3], [], [-1.8e-16, 1e-9]]);
    assert.equal(largest, 200);
    assert.deepEqual([-1.8e-16, 1e-9, -3, null, undefined].map((v) => dropRoundOff(v, largest)), [0, 1e-9, -3, null, undefined]);
    assert.equal(dropRoundOff(1e-30, 0), 1e-30);
  });

  it("writes durations, dates and masses", () => {
    assert.deepEqual([0.84, 192, 7384, null].map(formatDuration), ["0.840 s", "3 min 12 s", "2 h 3 min", "–"]);
    assert.equal(formatDate("2026-01-01T12:34:56Z"), "2026-01-01 12:34 UTC");
    assert.equal(formatDate("yesterday"), "yesterday");
    assert.equal(formatMass(1.9e6), "1\u202f900 t");
    assert.equal(formatMass(1464), "1.46 t");
  });
});

describe("what is shown", () => {
  it("chooses six moments from the first frame to the last", () => {
    const moments = chooseMoments(readRun(JSON.stringify(makeSynthetic(60))));
    assert.equal(moments.length, 6);
    const times = moments.map((m) => m.time);
    assert.deepEqual(times, [...times].sort((a, b) => a - b));
    assert.equal(times[0], 0);
    assert.equal(times[5], 9);
    assert.deepEqual(moments.filter((m) => m.caption !== "").map((m) => m.caption),
      ["before the first charge", "before Stage 2", "first touchdown", "end"]);
  });

  it("finds the zones of a member and the member of a zone", () => {
    const run = readRun(JSON.stringify(makeSynthetic(2)));
    const zones = findZonesOfBodies(run);
    const column = run.bodies.findIndex((b) => b.name === "C-D1-0");
    assert.deepEqual(zones[column].map((z) => run.zones[z].name), ["C-D1-0/foot", "C-D1-0/head"]);
    assert.equal(findBody(run, "C-D1-0/foot"), column);
    assert.equal(findBody(run, "C-D1-0"), column);
    assert.equal(findBody(run, "nobody"), -1);
  });

  it("keeps the ends of the colour ramp", () => {
    assert.equal(colourOfUtilisation(0), "rgb(251, 248, 234)");
    assert.equal(colourOfUtilisation(7), "rgb(92, 31, 5)");
  });
});

describe("signs", () => {
  const events = ["stage", "charge", "yield", "softening", "crushing", "rupture", "release", "touchdown", "contact", "rest", "cable", "edit", "failure"];
  const signOf = ({ shape, colour, variable }) => `${shape} ${variable === undefined ? colour : `var(${variable})`}`;
  it("have one meaning each, in the picture and among events", () => {
    const states = new Map(zoneStates.map((z) => [signOf(z), z.word]));
    const alike = { yield: "yielded", softening: "softening", rupture: "broken", crushing: "crushed stub", charge: "fired" };
    const signs = events.map((kind) => signOf(wordsOfEvent(kind)));
    assert.equal(new Set(signs).size, events.length);
    events.forEach((kind, i) => assert.equal(states.get(signs[i]), alike[kind], kind));
  });
});

describe("words", () => {
  it("tells the values of actions with their units", () => {
    assert.equal(describeValues({ member: "C-A1-0", position: 1.1, anchor: [-40, 10, 0], stiffness: 1e6, pretension: 50000, residual_bars: 0.07, name: "soon", in_place: true }),
      'member "C-A1-0", position 1.1 m, anchor (-40, 10, 0) m, stiffness 1 MN/m, pretension 50 kN, residual bars 7 %, name "soon", in place true');
  });
  it("writes degrees, powers and signs as people do", () => {
    assert.equal(prettify("leans by 9.1 deg, 180 deg +- 15 deg"), "leans by 9.1°, 180° ± 15°");
    assert.equal(prettify("1435 m2. 2470 m3; 25 N/mm2, 64 cm2, 1800 kg/m3"), "1435\u00a0m². 2470\u00a0m³; 25\u00a0N/mm², 64\u00a0cm², 1800 kg/m³");
    assert.equal(prettify("20.7 m towards -x, 5.2e-10 of it, 2.1 x 3"), "20.7\u00a0m towards −x, 5.2·10⁻¹⁰ of it, 2.1 × 3");
  });
  it("leaves names alone", () => {
    for (const name of ["W-C5D5-6/head", "C-A1-0", "N-A2-0 touches", "Rows A and B", "mm2x"]) assert.equal(prettify(name), name);
  });
});

describe("parts", () => {
  const shape = (half, orientation = [1, 0, 0, 0]) => ({ centre: [0, 0, 0], orientation, half, material: "" });
  it("tells panels from the members that carry them", () => {
    const beam = { kind: "beam" };
    assert.equal(partOfShape(beam, shape([1.3, 0.2, 0.35])), "beam");
    assert.equal(partOfShape(beam, shape([1.3, 1.4, 0.075])), "slab");
    assert.equal(partOfShape({ kind: "column" }, shape([0.05, 0.9, 0.4])), "wall");
    // a quarter turn about y lays the thin direction of a standing panel upright
    assert.equal(partOfShape(beam, shape([0.05, 0.9, 0.4], [Math.SQRT1_2, 0, Math.SQRT1_2, 0])), "slab");
    // a record that says so: walls along y belong to joints, and may be thick
    assert.equal(partOfShape({ kind: "node" }, { ...shape([0.12, 0.9, 0.4]), part: "wall" }), "wall");
    assert.equal(partOfShape({ kind: "column" }, { ...shape([0.09, 0.09, 1.2]), part: "column" }), "column", "a slender one");
    assert.equal(partOfShape({ kind: "column" }, { ...shape([0.05, 0.9, 0.4]), part: "" }), "wall", "not known");
    assert.equal(partOfShape({ kind: "debris" }, shape([0.05, 0.9, 0.4])), "debris");
  });
});

describe("angles", () => {
  it("end when less than half of the block is connected", () => {
    const run = (value) => ({ series: [{ id: "connected_share", value }] });
    assert.equal(findCoherent(run([1, 0.7, 0.5, 0.4, 0.6])), 3);
    assert.equal(findCoherent(run([1, 0.7])), undefined);
    assert.equal(findCoherent({ series: [] }), undefined);
  });
});

describe("heights of debris", () => {
  it("find the line at one height", async () => {
    const { findContour, closeGaps } = await load("steer_layers.ts");
    // a block of 3 x 2 cells, 2 m high, in a grid of 1 m: its line at 1 m lies half a cell outside the cells' middles
    const grid = { x0: 0, y0: 0, nx: 8, ny: 7, height: new Float32Array(56) };
    for (let j = 2; j < 4; ++j) for (let i = 2; i < 5; ++i) grid.height[8 * j + i] = 2;
    const line = findContour(grid, 1, 1);
    const xs = line.filter((_, k) => k % 2 === 0), ys = line.filter((_, k) => k % 2 === 1);
    assert.deepEqual([Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)], [1.5, 4.5, 1.5, 3.5]);
    // its length: four sides without the corners' halves, and four cut corners
    let length = 0;
    for (let k = 0; k < line.length; k += 4) length += Math.hypot(line[k] - line[k + 2], line[k + 1] - line[k + 3]);
    assert.ok(Math.abs(length - (2 * (2 + 1) + 4 * Math.SQRT1_2)) < 1e-6);
    assert.deepEqual(findContour(grid, 1, 3), []);
    // a gap of one cell is filled, and nothing grows outwards
    const gap = { nx: 9, ny: 9, height: new Float32Array(81) };
    for (const i of [3, 5]) gap.height[9 * 4 + i] = 1;
    closeGaps(gap, 1);
    assert.deepEqual([...gap.height].map((v, k) => (v > 0 ? k - 36 : 0)).filter((k) => k !== 0), [3, 4, 5]);
  });
});

describe("crushed ends", () => {
  it("are read, recede evenly from frame to frame and shorten their box", async () => {
    const { readRun, calcCrushed, shorten } = await load("data.ts");
    const data = makeSynthetic(3);
    const length = Buffer.alloc(12);
    [0, 0.5, 1].forEach((v, k) => length.writeFloatLE(v, 4 * k));
    data.crushed_ends = [{ body: 4, shape: 0, axis: 2, side: -1, length: length.toString("base64") }];
    const run = readRun(JSON.stringify(data));
    assert.deepEqual(run.frames.map((f) => f.crushed.length), [0, 1, 1]);
    assert.deepEqual(calcCrushed(run, 0, 0), []);
    assert.deepEqual(calcCrushed(run, 0, 0.5), [{ body: 4, shape: 0, axis: 2, side: -1, length: 0.25 }]);
    assert.equal(calcCrushed(run, 1, 0.5)[0].length, 0.75);
    const box = { centre: [0, 0, 1], orientation: [Math.SQRT1_2, 0, Math.SQRT1_2, 0], half: [0.2, 0.3, 1], material: "concrete" };
    const short = shorten(box, calcCrushed(run, 2, 0));
    assert.deepEqual(short.half, [0.2, 0.3, 0.5]);
    // z of the box lies along x
    [0.5, 0, 1].forEach((v, k) => assert.ok(Math.abs(short.centre[k] - v) < 1e-12));
    data.crushed_ends[0].length = length.subarray(0, 8).toString("base64");
    assert.throws(() => readRun(JSON.stringify(data)), /crushed_ends/);
  });
});

describe("frames of the steering protocol", () => {
  it("are read as they are written, and refused otherwise", async () => {
    const { decodeFrame } = await load("steer_wire.ts");
    const B = 2, Z = 3, V = 1, C = 1;
    const bytes = Buffer.alloc(48 + 28 * B + 4 * V + 5 * Z + 12 * C);
    bytes.write("TPLF");
    bytes.writeUInt16LE(1, 4);
    bytes.writeUInt16LE(2, 6);
    [7, 8, 9, 10].forEach((v, k) => bytes.writeUInt32LE(v, 8 + 4 * k));
    bytes.writeDoubleLE(1.25, 24);
    [B, Z, V, C].forEach((v, k) => bytes.writeUInt32LE(v, 32 + 4 * k));
    for (let k = 0; k < 7 * B + V + Z; ++k) bytes.writeFloatLE(k + 0.5, 48 + 4 * k);
    const end = 48 + 4 * (7 * B + V + Z);
    bytes.writeUInt32LE(1, end);
    bytes.writeUInt16LE(300, end + 4);
    bytes.set([2, 0], end + 6);
    bytes.writeFloatLE(0.75, end + 8);
    bytes.set([0, 3, 4], end + 12);
    const view = (b) => b.buffer.slice(b.byteOffset, b.byteOffset + b.length);
    const f = decodeFrame(view(bytes));
    assert.deepEqual([f.session, f.branch, f.sequence, f.row, f.time, f.asked], [7, 8, 9, 10, 1.25, true]);
    assert.deepEqual([[...f.pose].length, f.pose[13], [...f.series], [...f.utilisation], [...f.state]], [14, 13.5, [14.5], [15.5, 16.5, 17.5], [0, 3, 4]]);
    assert.deepEqual(f.crushed, [{ body: 1, shape: 300, axis: 2, side: -1, length: 0.75 }]);
    assert.throws(() => decodeFrame(view(bytes.subarray(0, 60))), /length/);
    assert.throws(() => decodeFrame(new ArrayBuffer(8)), /not a frame/);
    bytes.writeUInt16LE(2, 4);
    assert.throws(() => decodeFrame(view(bytes)), /version 2/);
  });
});

describe("plan text", () => {
  it("finds the place of a complaint", async () => {
    const { findOffset } = await load("steer_plan.tsx");
    assert.deepEqual([[1, 1], [2, 3], [3, 1], [9, 9]].map(([l, c]) => findOffset("ab\ncdef\ng", l, c)), [0, 5, 8, 9]);
  });
});

describe("what came of a branch", () => {
  const frame = (row, time) => ({ session: 1, branch: 1, sequence: row, row, time, asked: false, pose: new Float32Array(0), series: new Float32Array(0), utilisation: new Float32Array(0), state: new Uint8Array(0), crushed: [] });
  const make = () => new BranchRun(1, { ...readRun(JSON.stringify({ ...makeSynthetic(2) })), bodies: [], zones: [], series: [], time: [], frames: [], events: [] }, makeLook(), true);

  it("asks for near holes together, and for far ones apart", () => {
    const run = make();
    for (let row = 0; row < 300; ++row) if (row % 3 !== 2 && (row < 60 || row > 200)) run.add(frame(row, row / 60));
    for (let row = 60; row <= 200; ++row) run.add(frame(row, row / 60));
    assert.deepEqual(run.findMissing(300), { from: 2, count: 58, stride: 1 }); // rows 2, 5, ... 59
    for (let row = 0; row < 60; ++row) run.add(frame(row, row / 60));
    assert.deepEqual(run.findMissing(300), { from: 203, count: 97, stride: 1 }); // 203, 206, ... 299
    for (let row = 203; row < 300; ++row) run.add(frame(row, row / 60));
    assert.equal(run.findMissing(300), undefined);
    assert.equal(run.rows.length, 300);
  });

  it("takes an event once, however often it is told", () => {
    const run = make();
    const event = (time, subject) => ({ time, kind: "yield", subject, text: "" });
    run.addEvents([event(1, "a"), event(1, "b")]);
    run.addEvents([event(1, "a"), event(2, "a")]);
    assert.deepEqual(run.run.events.map((e) => `${e.time}${e.subject}`), ["1a", "1b", "2a"]);
  });
});

describe("colours of the picture", () => {
  it("go to the screen as they are written", () => {
    // the table has 4096 steps: half a step is at most 0.4 of 255 where the curve is steepest
    for (const css of ["#000000", "#1f4e79", "#808080", "#d55e00", "#ffffff"])
      linear(css).forEach((value, k) => assert.ok(Math.abs((toScreen(value) / 65535) * 255 - parseInt(css.slice(1 + 2 * k, 3 + 2 * k), 16)) < 0.5, css));
  });
});

describe("events on paper", () => {
  const make = (kind, ...times) => times.map((time) => ({ time, kind, subject: `C-${time}`, text: "" }));

  it("puts events of one kind that follow each other into one line, and stages apart", async () => {
    const { groupEvents } = await load("event_groups.ts");
    const groups = groupEvents([...make("stage", 0, 1), ...make("yield", 0.01, 0.05, 0.98, 1.02, 1.06), ...make("touchdown", 1.03)]);
    assert.deepEqual(groups.map((g) => [g.kind, g.from, g.to, g.events.length]),
      [["stage", 0, 0, 1], ["yield", 0.01, 0.05, 2], ["yield", 0.98, 0.98, 1], ["stage", 1, 1, 1], ["yield", 1.02, 1.06, 2], ["touchdown", 1.03, 1.03, 1]]);
    assert.deepEqual(groupEvents([]), []);
  });

  it("fits on a page however many there are, and loses none", async () => {
    const { groupEvents } = await load("event_groups.ts");
    const events = ["yield", "rupture", "contact"].flatMap((kind) => make(kind, ...Array.from({ length: 500 }, (_, i) => 0.3 * i)));
    const groups = groupEvents(events);
    assert.ok(groups.length <= 36, String(groups.length));
    assert.equal(groups.reduce((sum, g) => sum + g.events.length, 0), events.length);
    // stages are never joined
    assert.equal(groupEvents(make("stage", ...Array.from({ length: 50 }, (_, i) => i))).length, 50);
  });
});

describe("what would make it fail", () => {
  const clearance = (title, value, text, status = "info") => ({ id: `clearance.${title}`, heading: "Clearance", title, text, value, unit: "m", status });
  const mechanism = { id: "mechanism", heading: "Mechanism", title: "Mechanism: topple", text: "", value: 0.2, unit: "rad", status: "good" };
  const tell = (...findings) => listConditions({ findings: [mechanism, ...findings], events: [] }).slice(0, -1);

  it("counts the way to a neighbour up to the limit that the plan sets", () => {
    const hall = clearance("Hall", 9.63, "The nearest part, C-A1-0, comes to 9.6 m at 4.10 s; the limit is 4.0 m.", "good");
    const road = clearance("Road", 7.21, "The nearest part, C-A1-0, comes to 7.2 m at 4.10 s.");
    assert.deepEqual(tell(road, hall), [
      "Hall: parts come 5.6 m farther than in this run; the limit of 4.0 m is then broken.",
      "Road: parts come 7.2 m farther than in this run; they then reach it.",
    ]);
    // a page that is in German already
    assert.deepEqual(tell({ ...hall, text: "Das nächste Teil, C-A1-0, kommt bei 4,10 s auf 9,6 m heran; der Grenzwert ist 4,0 m." }),
      ["Hall: parts come 5.6 m farther than in this run; the limit of 4.0 m is then broken."]);
    // what still moved may break it
    assert.deepEqual(tell({ ...hall, status: "warning", text: `${hall.text} Not judged: chimney/12 still moved at 4.6 m/s when the run ended, and may break this limit.` }),
      ["Hall: parts come 5.6 m farther than in this run; the limit of 4.0 m is then broken."]);
  });

  it("rounds what is left down, with a digit behind the point", () => {
    const fuel = clearance("Fuel", 17.66, "The nearest part, C-A1-0, comes to 17.7 m at 4.10 s; the limit is 4.0 m.", "good");
    const wall = clearance("Wall", 4.098, "The nearest part, C-A1-0, comes to 4.1 m at 4.10 s; the limit is 4.0 m.", "good");
    assert.deepEqual(tell(fuel, wall), [
      "Wall: parts come 0.09 m farther than in this run; the limit of 4.0 m is then broken.",
      "Fuel: parts come 13.6 m farther than in this run; the limit of 4.0 m is then broken.",
    ]);
  });

  it("names no margin where it is used up", () => {
    const pause = (value, text) => ({ id: "stability.stage_1", heading: "Stability", title: "Between A and B", text, value, unit: "1", status: "warning" });
    const zone = "Zone B-1/end is nearest to its resistance and uses 75 % of it (margin 1.34)";
    const used = "Between A and B: zones resist less than the plan says. No margin is left";
    assert.deepEqual(tell(pause(1.34, `${zone}; 39 zones have yielded, none is broken. It still sways.`)), [`${used}: 39 zones have yielded already.`]);
    assert.deepEqual(tell(pause(1.34, `${zone}; 1 zone has yielded, 2 are broken.`)), [`${used}: 2 zones have broken already.`]);
    assert.deepEqual(tell(pause(1.34, "…; 1 Zone fließt, keine ist gebrochen.")), [`${used}: 1 zone has yielded already.`]);
    assert.deepEqual(tell(pause(1, `${zone}; no zone has yielded, none is broken.`)), [`${used}.`]);
    // the least on the way counts, not that of the end; 9.91 % are not 10
    const sways = `${zone}; no zone has yielded, none is broken. This is the margin of one instant: the least in the pause is 1.11, at 0.38 s.`;
    assert.deepEqual(tell(pause(1.34, sways)), ["Between A and B: the most loaded zone resists 9 % less than the plan says."]);
  });

  it("takes spans for margins where they are weaker than zones", () => {
    const start = (text) => ({ id: "stability.start", heading: "Stability", title: "Before the first charge", text, value: 1.56, unit: "1", status: "warning" });
    const zone = "Zone B-1/end is nearest to its resistance and uses 64 % of it (margin 1.56); no zone has yielded, none is broken.";
    const span = (times) => `${zone} With hinges at both ends and in the middle S-A1B2-0 bears ${times} times its dead load at the most`;
    assert.deepEqual(tell(start(`${span("1.06")}.`)), ["Before the first charge: the weakest span bears 5 % less than the plan says."]);
    assert.deepEqual(tell(start(`${span("0.98")}: as described it could not stand.`)), ["Before the first charge: spans bear less than the plan says. No margin is left."]);
    assert.deepEqual(tell(start("Mit Gelenken an beiden Enden und in der Mitte trägt S-A1B2-0 höchstens das 1,06-Fache seiner Eigenlast.")), ["Before the first charge: the weakest span bears 5 % less than the plan says."]);
    assert.deepEqual(tell(start(`${span("3.38")}.`)), ["Before the first charge: the most loaded zone resists 35 % less than the plan says."]);
  });

  it("tells of no way that is left where a limit is broken", () => {
    assert.deepEqual(tell(clearance("Hall", 3.2, "The nearest part, C-A1-0, comes to 3.2 m at 4.10 s; the limit is 4.0 m.", "bad")), ["It fails already: Clearance, Hall."]);
    assert.deepEqual(tell({ id: "mechanism.near", heading: "Mechanism", title: "Near another verdict", text: "", value: null, unit: "", status: "warning" }), [
      "Little is otherwise than planned: the verdict is near another one, as the findings say.",
    ]);
  });
});

describe("limits of the plan", () => {
  const finding = (id, heading, text, status) => ({ id: `${id}.Main`, heading, title: "Main", text, value: 0, unit: "m", status });
  const lands = finding("clearance", "Clearance", "chimney/8 lands on it at 8.63 s.", "warning");
  const shaken = (status) => finding("vibration", "Ground vibration", "Screening: 28 to 110 mm/s.", status);
  const mechanism = { id: "mechanism", heading: "Mechanism", title: "Mechanism: topple", text: "", value: 0.2, unit: "rad", status: "good" };

  it("are those that the plan sets", async () => {
    const { findLimit } = await load("findings.tsx");
    assert.equal(findLimit(lands), undefined);
    assert.equal(findLimit({ ...lands, text: "chimney/8 lands on it at 8.63 s; the limit is 4.0 m." }), "4.0");
    assert.equal(findLimit({ ...shaken("bad"), text: "; the limit is 4.0 m." }), undefined);
  });

  it("fail where parts lie on a neighbour or the ground shakes too much", async () => {
    const { listConditions } = await load("handover.tsx");
    const tell = (...findings) => listConditions({ findings: [mechanism, ...findings], events: [] }).slice(0, -1);
    assert.deepEqual(tell(lands, shaken("bad")), ["It fails already: Ground vibration, Main.", "Parts are over it already: Main."]);
    assert.deepEqual(tell(shaken("warning")), ["Main: the ground shakes more than the middle of the screening's band, which reaches the limit."]);
    assert.deepEqual(tell(shaken("good")), []);
    // the middle of the band against the limit, in both languages
    const above = ["Main: the middle of the screening's band is above the limit already."];
    const screening = (middle, limit) => tell({ ...shaken("warning"), text: `Screening: 5.4 to 34 mm/s, ${middle} in the middle, around 2.10 s from 3.0 MJ lost. Limit ${limit}: the band reaches it.` });
    assert.deepEqual(screening("13", "of the plan: 5 mm/s"), above);
    assert.equal(screening("4.9", "of the plan: 5 mm/s").length, 1);
    assert.notDeepEqual(screening("4.9", "of the plan: 5 mm/s"), above);
    assert.deepEqual(screening("13", "at the foundation between 2 Hz and 13 Hz: 5 to 5.8 mm/s (DIN 4150-3:1999-02, Table 1; residential buildings)"), above);
    const german = "Abschätzung: 5,4 bis 34 mm/s, 13 in der Mitte, um 2,10 s. Anhaltswert am Fundament zwischen 2 Hz und 13 Hz: 5,5 bis 5,8 mm/s (DIN 4150-3:1999-02, Tabelle 1; Wohngebäude): Das Band erreicht ihn.";
    assert.deepEqual(tell({ ...shaken("warning"), text: german }), above);
  });
});

describe("lines of the building", () => {
  it("are its parts, and the convex outline where that is another one", async () => {
    const { findBuildingLines } = await load("data.ts");
    const hull = [[0, 0], [4, 0], [4, 2], [1, 6], [0, 6]];
    const l = [[0, 0], [4, 0], [4, 2], [1, 2], [1, 6], [0, 6]];
    assert.deepEqual(findBuildingLines({ building_outline: hull, building_plan: [l] }), { plans: [l], hull });
    assert.deepEqual(findBuildingLines({ building_outline: hull, building_plan: [hull] }), { plans: [hull], hull: [] });
    assert.deepEqual(findBuildingLines({ building_outline: hull }), { plans: [], hull }, "a page of an earlier version");
    assert.deepEqual(findBuildingLines({ building_outline: [], building_plan: [] }), { plans: [], hull: [] });
  });
});

describe("axes on the ground", () => {
  it("stand at a corner where the picture shows them whole, and stay there while it does", async () => {
    const { Site } = await load("site.ts");
    // labels are drawn, which nobody looks at here
    const context = { measureText: () => ({ width: 10 }), beginPath() {}, rect() {}, fill() {}, fillText() {} };
    globalThis.document = { createElement: () => ({ getContext: () => context }) };
    const near = new THREE.Box3(new THREE.Vector3(0, 0, 0), new THREE.Vector3(20, 20, 15));
    const area = near.clone().expandByPoint(new THREE.Vector3(-60, -60, 0));
    const site = new Site({ building_outline: [], neighbours: [] }, area, near, 15);
    delete globalThis.document;
    const camera = new THREE.PerspectiveCamera(40, 1.5, 0.1, 1000);
    camera.up.set(0, 0, 1);
    const look = (...eye) => {
      camera.position.set(...eye);
      camera.lookAt(10, 10, 5);
      camera.updateMatrixWorld();
      site.placeLabels(camera, 900, new THREE.Vector3(10, 10, 5));
      return site.axes.position.toArray();
    };
    const isSeen = ([x, y]) => [[0, 0], [1, 0], [0, 1]].every(([dx, dy]) => {
      const p = new THREE.Vector3(x + dx * site.gridStep, y + dy * site.gridStep, 0).project(camera);
      return Math.max(Math.abs(p.x), Math.abs(p.y)) < 1;
    });
    const behind = [25, 25, 0];
    const first = look(-40, -30, 35);
    assert.ok(isSeen(first) && !isSeen([-65, -65, 0]), `${first}`);
    assert.notDeepEqual(first, behind);
    assert.deepEqual(look(-38, -33, 35), first);
    // far enough away all of the area is in the picture; what stands in it stays
    assert.deepEqual(look(-200, -150, 175), first);
    site.resetAxes();
    assert.deepEqual(look(-200, -150, 175), [-65, -65, 0], "a picture that is fitted again has them at home");
    // from the other side that corner is behind the eye
    assert.ok(isSeen(look(60, 55, 35)));
  });
});

describe("axis of time", () => {
  it("is that of the run, and what is asked for before there is more than a frame", async () => {
    const { calcTimeRange } = await load("units.ts");
    assert.deepEqual(calcTimeRange([0.5, 1, 4], 10), [0.5, 4]);
    assert.deepEqual(calcTimeRange([0], 4), [0, 4]);
    assert.deepEqual(calcTimeRange([], 0), [0, 1]);
    assert.deepEqual(calcTimeRange([2], 0), [2, 3]);
  });
});
