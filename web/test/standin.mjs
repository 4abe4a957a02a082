// Stands in for `topple steer`: speaks docs/protocol.md over made-up runs, so that every state of the page can be had.
import { createHash } from "node:crypto";
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { WebSocketServer } from "ws";
import { keep } from "./harness.mjs";
import { makeSynthetic } from "./synthetic.mjs";

const frameCount = 270; // of the made-up run
const token = "0123456789abcdef0123456789abcdef";
export const planText = `# A made-up plan
title = "Storehouse of seven storeys"

[site]
friction = 0.6

[[stage]]
name = "Rows A and B"
time = "500 ms"

[[stage]]
name = "Row C"
time = "4 s"
`;
const hash = (text) => createHash("sha256").update(text).digest("hex");
const problem = (code, message, more = {}) => Object.assign(new Error(message), { code, ...more });

/// The run that a branch would have if it were computed to its end.
const courses = new Map();
let makeData = (second) => makeSynthetic(frameCount, second);
/// Another building for all servers of this process; `make` gives report data of 270 frames.
export function useData(make) {
  makeData = make;
  courses.clear();
}
function makeCourse(second) {
  let course = courses.get(second);
  if (course !== undefined) return course;
  const data = makeData(second);
  const floats = (text) => {
    const bytes = Buffer.from(text, "base64");
    return new Float32Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
  };
  const B = data.bodies.length, Z = data.zones.length, V = data.series.length;
  const position = floats(data.position), orientation = floats(data.orientation), utilisation = floats(data.zone_utilisation);
  const state = Buffer.from(data.zone_state, "base64");
  const frame = (row) => {
    const out = Buffer.alloc(48 + 28 * B + 4 * V + 5 * Z);
    out.write("TPLF", 0, "latin1");
    out.writeUInt16LE(1, 4);
    out.writeUInt32LE(row, 20);
    out.writeDoubleLE(data.time[row], 24);
    out.writeUInt32LE(B, 32);
    out.writeUInt32LE(Z, 36);
    out.writeUInt32LE(V, 40);
    const values = new Float32Array(out.buffer, out.byteOffset + 48, 7 * B + V + Z);
    for (let b = 0; b < B; ++b) {
      for (let k = 0; k < 3; ++k) values[7 * b + k] = position[3 * (row * B + b) + k];
      for (let k = 0; k < 4; ++k) values[7 * b + 3 + k] = orientation[4 * (row * B + b) + k];
    }
    data.series.forEach((series, k) => (values[7 * B + k] = series.value[row] ?? NaN));
    values.set(utilisation.subarray(row * Z, (row + 1) * Z), 7 * B + V);
    state.copy(out, 48 + 4 * values.length, row * Z, (row + 1) * Z);
    return out;
  };
  const scene = {
    ...data, time: [data.time[0]], position: Buffer.from(data.position, "base64").subarray(0, 12 * B).toString("base64"),
    orientation: Buffer.from(data.orientation, "base64").subarray(0, 16 * B).toString("base64"),
    zone_state: state.subarray(0, Z).toString("base64"),
    zone_utilisation: Buffer.from(data.zone_utilisation, "base64").subarray(0, 4 * Z).toString("base64"),
    series: data.series.map((s) => ({ ...s, value: s.value.slice(0, 1) })), events: [], findings: [],
  };
  course = { data, frame, scene };
  courses.set(second, course);
  return course;
}

class Session {
  constructor(server, id, text, path) {
    Object.assign(this, { server, id, path, disk: text, text, phase: "paused", seq: 0, log: [], branches: [], cursor: null, speed: null, studies: [], zone: null, broken: [], earlier: null, toldAt: 0, reads: 0 });
    this.title = /title = "(.*)"/.exec(text)?.[1] ?? "untitled";
    this.fuzzy = !text.includes("crisp");
    this.active = this.addBranch("main", null, 0, 4).id;
  }

  addBranch(name, parent, row, second) {
    const { data } = makeCourse(second);
    const charged = data.bodies.filter((b) => b.kind === "column" && b.storey === 0 && /^C-[ABC]/.test(b.name));
    const info = {
      id: this.branches.length + 1, name, parent: parent?.id ?? null, time: data.time[row], first_frame: row, starts: 0, duration: 12, ending: null,
      charges: parent?.charges.map((c) => ({ ...c, fired: !c.removed && c.time <= data.time[row] })) ?? charged.map((b, index) => ({
        index, stage: b.name[2] === "C" ? 1 : 0, member: b.name, position: 1.1, destroyed_length: 1.5, residual_bars: 0.1,
        time: b.name[2] === "C" ? 4 : 0.5, fired: false, fails: false, removed: false })),
      stages: parent?.stages.map((s) => ({ ...s })) ?? [{ index: 0, name: "Rows A and B", time: 0.5 }, { index: 1, name: "Row C", time: 4 }],
      cables: parent?.cables.map((c) => ({ ...c })) ?? [], friction: { ...(parent?.friction ?? { ground: 0.6, bodies: 0.6 }) },
      edits: [...(parent?.edits ?? [])], notes: [], snapshots: [0], bodies: data.bodies.length, zones: data.zones.length, plan_sha256: hash(this.text), sample: null,
    };
    const hidden = { second, row, happened: 0 };
    Object.defineProperty(info, "own", { value: hidden, enumerable: false });
    this.branches.push(info);
    return info;
  }
  branch(id = this.active) {
    const found = this.branches.find((b) => b.id === id);
    if (found === undefined) throw problem("E920", `There is no branch ${id}.`);
    return found;
  }
  describeBranch(b) {
    return { ...b, frontier: makeCourse(b.own.second).data.time[b.own.row], frames: b.own.row + 1 };
  }
  describe() {
    const { id, title, path, active, cursor, speed, phase, fuzzy, earlier } = this;
    const isBuilt = phase !== "building" && this.broken.length === 0;
    return { id, title, path, active: isBuilt ? active : null, cursor, speed, phase, branches: isBuilt ? this.branches.map((b) => this.describeBranch(b)) : [], fuzzy, earlier, diagnostics: this.broken };
  }
  tell(type, keys) {
    this.seq += 1;
    const message = { type, session: this.id, seq: this.seq, ...keys };
    for (const client of this.server.clients) if (client.session === this) client.send(message);
  }
  tellState() {
    this.toldAt = performance.now();
    const b = this.branch();
    const { time } = makeCourse(b.own.second).data;
    this.tell("state", {
      phase: this.phase, branch: b.id, time: time[b.own.row], frames: b.own.row + 1, cursor: this.cursor, speed: this.speed,
      real_time_factor: this.phase === "running" ? 1.7 : null, duration: 12, eta: this.phase === "running" ? (time[this.server.frames - 1] - time[b.own.row]) / 1.7 : null, ending: b.ending, progress: null,
    });
  }
  advance(rows) {
    const b = this.branch();
    const course = makeCourse(b.own.second);
    const last = Math.min(this.server.frames - 1, b.own.row + rows);
    while (b.own.row < last) {
      b.own.row += 1;
      this.sendFrame(b, b.own.row, 1);
    }
    const now = course.data.time[b.own.row];
    for (const c of b.charges) c.fired = !c.removed && c.time <= now;
    const events = course.data.events.filter((e) => e.time <= now);
    if (events.length > b.own.happened) this.tell("happenings", { branch: b.id, events: events.slice(b.own.happened) });
    b.own.happened = events.length;
    if (this.zone !== null) this.tell("zone", { branch: b.id, zone: this.zone, points: [this.zonePoint(now)] });
    if (b.own.row === this.server.frames - 1) {
      this.phase = "finished";
      b.ending = { kind: this.server.endingKind, text: this.server.endingKind === "at_rest" ? "All parts are at rest at 9.00 s." : "The plan's duration of 9 s is over; 14 parts are still moving." };
      this.tell("branch", { branch: this.describeBranch(b) });
    } else if (performance.now() - this.toldAt < 100) return; // as the server, ten times a second
    this.tellState();
  }
  zonePoint(t) {
    const r = 0.02 * Math.max(0, t - 4) ** 2;
    return [t, -8e5 + 4e4 * Math.sin(t), 3e5 * Math.tanh(200 * r), 2e4 * Math.sin(3 * t), r, 1e-4 * Math.sin(3 * t), Math.min(1.3, 150 * r), r > 0.01 ? 1 : 0];
  }
  sendFrame(b, row, flags, to) {
    const bytes = makeCourse(b.own.second).frame(row);
    bytes.writeUInt16LE(flags, 6);
    bytes.writeUInt32LE(this.id, 8);
    bytes.writeUInt32LE(b.id, 12);
    const targets = to === undefined ? [...this.server.clients].filter((c) => c.session === this) : [to];
    for (const client of targets) {
      client.sequence += 1;
      // some are dropped, as for a slow reader
      if (to === undefined && this.server.dropEvery > 0 && client.sequence % this.server.dropEvery === 0) continue;
      bytes.writeUInt32LE(client.sequence, 16);
      client.socket.send(Buffer.from(bytes));
    }
  }
  tick() {
    if (this.phase !== "running") return;
    const rows = this.speed === null ? this.server.rate : Math.max(1, Math.round(this.speed));
    this.advance(Math.max(0, Math.min(rows, this.server.barrier - this.branch().own.row)));
  }
  findings(b) {
    const { data } = makeCourse(b.own.second);
    const now = data.time[b.own.row];
    const fell = now > 6;
    return {
      branch: b.id, time: now, ending: b.ending ?? { kind: "under_way", text: "" }, events: data.events.filter((e) => e.time <= now), not_modelled: data.not_modelled, notes: b.notes,
      findings: fell ? data.findings : [{ id: "mechanism", heading: "Mechanism", title: "Mechanism", text: now < 4 ? "The building stands." : "The building leans by 3 deg and goes on.", value: null, unit: "", status: "info" }, data.findings[1]],
    };
  }
  record(action, b, command, made) {
    const entry = { seq: this.log.length + 1, action, branch: b.id, step: b.own.row * 330, time: makeCourse(b.own.second).data.time[b.own.row], ...(made === undefined ? {} : { made: made.id }), command };
    this.log.push(entry);
    this.tell("log", { entry });
  }
  rowAt(b, time) {
    const { time: times } = makeCourse(b.own.second).data;
    let row = 0;
    while (row < b.own.row && times[row + 1] <= time + 1e-9) row += 1;
    return row;
  }
  /// Gives the branch that an edit acts on: a new one from the cursor unless nothing was computed on this one yet.
  edit(kind, text, command, change) {
    const from = this.branch();
    const row = this.cursor === null ? from.own.row : this.rowAt(from, this.cursor);
    const time = makeCourse(from.own.second).data.time[row];
    const own = from.own.row === from.first_frame && row === from.own.row;
    const b = own ? from : this.addBranch(command.name ?? `what-if ${this.branches.length}`, from, row, from.own.second);
    change(b, time);
    b.edits.push({ kind, time, text, command });
    this.active = b.id;
    this.cursor = null;
    if (this.phase === "finished") this.phase = "paused";
    this.record(kind, from, command, own ? undefined : b);
    this.tell("branch", { branch: this.describeBranch(b) });
    this.tellState();
    return { branch: b.id, edit: { kind, time, text } };
  }
}

function check(text) {
  const at = text.indexOf("dealy");
  const diagnostics = [];
  if (at >= 0) {
    const before = text.slice(0, at).split("\n");
    diagnostics.push({ severity: "error", code: "E203", line: before.length, column: before[before.length - 1].length + 1, width: 5, message: 'unknown key "dealy"', help: 'did you mean "delay"?' });
  }
  if (text.includes("= \"?\"")) diagnostics.push({ severity: "error", code: "E211", line: 2, column: 9, width: 3, message: "title: a gap", help: "fill it in" });
  if (text.includes("title = \"\"")) diagnostics.push({ severity: "warning", code: "W101", line: 2, column: 1, width: 5, message: "the title is empty", help: "" });
  return { diagnostics, title: /title = "(.*)"/.exec(text)?.[1] ?? "", notes: [], removes_support: text.includes("[[stage]]") };
}

class Study {
  constructor(session, id, limit) {
    Object.assign(this, { session, id, limit, state: "running", samples: [], watchers: new Set(), begun: Date.now() });
    this.timer = setInterval(() => this.advance(), 60);
  }
  advance() {
    const k = this.samples.length;
    if (k >= this.session.server.studyBarrier) return;
    const a = ((k * 0.618034) % 1), b = ((k * 0.414214) % 1), reach = 18 + 10 * a + 3 * b;
    this.samples.push({ index: k, inputs: [10e6 + 35e6 * a, 380e6 + 80e6 * b, 0.4 + 0.4 * ((k * 0.732) % 1)], outputs: [reach, 3.14 + 0.2 * (a - 0.5), 4e6 + 3e6 * b], outcome: reach > 28 ? "partial" : "topple", ok: true });
    if (this.samples.length >= this.limit) this.stop("finished");
    for (const client of this.watchers) client.send({ type: "study", session: this.session.id, seq: ++this.session.seq, study: this.describe(), samples: this.samples.slice(k) });
  }
  stop(state) {
    clearInterval(this.timer);
    if (this.state === "running") this.state = state;
  }
  describe() {
    const alpha = [0, 0.5, 1];
    const names = [["reach", "m"], ["azimuth", "rad"], ["ground force", "N"]];
    const bounds = names.map(([output], k) => {
      const values = this.samples.map((s) => s.outputs[k]);
      const low = Math.min(...values), high = Math.max(...values), middle = (low + high) / 2;
      return { output, alpha, low: alpha.map((a) => low + a * (middle - low)), high: alpha.map((a) => high - a * (high - middle)) };
    });
    const time = Array.from({ length: 60 }, (_, i) => i * 0.15);
    const angle = (t, d) => -Math.min(1.5, 0.02 * (Math.cosh(1.72 * Math.max(0, t - 4 - d)) - 1));
    const spread = Math.min(1, this.samples.length / 20);
    return {
      id: this.id, state: this.state, done: this.samples.length, failed: 0, limit: this.limit, seconds: (Date.now() - this.begun) / 1000,
      eta: this.state === "running" ? (this.limit - this.samples.length) * 0.06 : null,
      inputs: [{ name: "fc", unit: "Pa" }, { name: "fy", unit: "Pa" }, { name: "friction", unit: "" }], outputs: names.map(([name, unit]) => ({ name, unit })),
      outcomes: ["topple", "partial"], bounds: this.samples.length > 0 ? bounds : [],
      possibilities: [{ outcome: "topple", possibility: 1, necessity: 0.72 }, { outcome: "partial", possibility: 0.28, necessity: 0 }],
      fans: { time, alpha, low: alpha.map((a) => time.map((t) => angle(t, -0.6 * spread * (1 - a)))), high: alpha.map((a) => time.map((t) => angle(t, 0.6 * spread * (1 - a)))) },
      text: "",
    };
  }
}

export class Standin {
  clients = new Set();
  sessions = [];
  studies = [];
  endingKind = "at_rest";
  dropEvery = 0;
  frames = frameCount;
  rate = 4; // frames a tick
  barrier = Infinity; // a run goes no further than this row, but stays a running one
  studyBarrier = Infinity; // and a study no further than so many samples
  refuse = false; // new connections
  isOther = false; // as another server at the same address answers
  resume = new Map();

  constructor() {
    this.page = readFile(new URL("../dist/steer.html", import.meta.url));
    this.http = createServer((request, response) => void this.answer(request, response));
    this.sockets = new WebSocketServer({ noServer: true, perMessageDeflate: false });
    this.http.on("upgrade", (request, socket, head) => {
      if (this.refuse || !request.url.startsWith(`/${token}/ws`)) return socket.destroy();
      this.sockets.handleUpgrade(request, socket, head, (ws) => this.welcome(ws, new URL(request.url, "http://x")));
    });
    this.timer = setInterval(() => this.sessions.forEach((s) => s.tick()), 33);
    this.close = keep(() => this.stop());
  }
  async start({ empty = false, text = planText } = {}) {
    if (!empty) this.open(text, "storehouse.toml");
    await new Promise((done) => this.http.listen(0, "127.0.0.1", done));
    this.url = `http://127.0.0.1:${this.http.address().port}/${token}/`;
    return this;
  }
  open(text, path) {
    const session = new Session(this, this.sessions.length + 1, text, path);
    this.sessions.push(session);
    return session;
  }
  stop() {
    clearInterval(this.timer);
    this.studies.forEach((s) => s.stop("cancelled"));
    for (const client of this.clients) client.socket.terminate();
    return new Promise((done) => {
      this.http.close(done);
      this.http.closeAllConnections?.();
    });
  }
  /// Cuts all connections, as a network does.
  cut() {
    for (const client of [...this.clients]) client.socket.terminate();
  }

  async answer(request, response) {
    const path = request.url.replace(`/${token}`, "");
    const send = (type, body) => response.writeHead(200, { "content-type": type }).end(body);
    const json = (value) => send("application/json", JSON.stringify(value));
    const session = this.sessions[Number(/^\/api\/sessions\/(\d+)/.exec(path)?.[1]) - 1];
    if (this.isOther) return response.writeHead(403, { "content-type": "application/json" }).end(JSON.stringify({ error: { code: "E901", message: "wrong token", help: "" } }));
    if (path === "/api/server") return json({ protocol: 1 });
    if (path === "/") return send("text/html; charset=utf-8", await this.page);
    if (path === "/api/templates") return json({ templates: [{ name: "frame", title: "Frame of three storeys", text: planText }, { name: "chimney", title: "Chimney of 40 m", description: "A chimney that falls to one side", text: planText }], demo: { title: "Storehouse in Weida, 1998" } });
    if (path === "/api/plans") return json({ folder: "/plans", plans: [{ path: "storehouse.toml", title: "Storehouse of seven storeys" }, { path: "silo.toml", title: "Silo" }] });
    if (path === "/api/sessions") return json({ sessions: this.sessions.map((s) => s.describe()) });
    if (session !== undefined && path.endsWith("/plan")) {
      session.reads += 1;
      return send("text/plain; charset=utf-8", session.disk);
    }
    if (session !== undefined && path.endsWith("/log")) return send("text/plain", session.log.map((e) => JSON.stringify(e)).join("\n"));
    if (session !== undefined && path.endsWith("/report.html")) return send("text/html; charset=utf-8", "<!DOCTYPE html><title>report</title><h1>Report of the branch</h1>");
    response.writeHead(404, { "content-type": "application/json" }).end(JSON.stringify({ error: { code: "E903", message: `nothing at ${path}`, help: "" } }));
  }

  welcome(socket, url) {
    const client = { socket, session: undefined, sequence: 0, answers: new Map(), send: (message) => socket.readyState === 1 && socket.send(JSON.stringify(message)) };
    this.clients.add(client);
    socket.on("close", () => {
      this.clients.delete(client);
      this.studies.forEach((s) => s.watchers.delete(client));
    });
    socket.on("message", (data) => this.obey(client, JSON.parse(String(data))));
    const old = this.resume.get(url.searchParams.get("resume"));
    if (old !== undefined && this.sessions.includes(old.session)) {
      client.session = old.session;
      client.token = url.searchParams.get("resume");
      client.send({ type: "resumed", session: client.session.id, from: Number(url.searchParams.get("seq")) });
      client.session.tellState();
      return;
    }
    this.attach(client, this.sessions[0]);
  }
  attach(client, session) {
    client.session = session;
    client.token = `resume-${Math.random().toString(36).slice(2)}`;
    this.resume.set(client.token, { session });
    client.send({
      type: "hello", protocol: 1, program: "topple 0.1.0", resume: client.token, seq: session?.seq ?? 0, session: session?.describe() ?? null, sessions: this.sessions.map((s) => s.describe()),
      scene: session === undefined || session.describe().active === null ? null : makeCourse(session.branch().own.second).scene,
      plan: session === undefined ? { text: "", path: "", sha256: "" } : { text: session.disk, path: session.path, sha256: hash(session.disk) }, limits: {},
    });
    if (session?.describe().active !== null) session?.tellState();
  }
  /// As while a plan is built; `end` is called with the complaints when it cannot be, with none when it can.
  startBuilding(session) {
    session.phase = "building";
    return (complaints) => {
      session.broken = complaints;
      session.phase = complaints.length > 0 ? "failed" : "paused";
      for (const client of this.clients) if (client.session === session) this.attach(client, session);
    };
  }

  obey(client, message) {
    try {
      const result = this.do(client, message.command, message);
      client.send({ type: "ack", id: message.id, result: result ?? {} });
    } catch (error) {
      const { code = "E999", message: words, ...more } = error;
      client.send({ type: "error", id: message.id, error: { code, message: error.message ?? words, help: error.help ?? "", ...more } });
    }
  }

  do(client, command, m) {
    const s = client.session;
    switch (command) {
      case "ping": return { time: Date.now() / 1000 };
      case "session.list": return { sessions: this.sessions.map((x) => x.describe()) };
      case "session.open": {
        const text = m.text ?? planText;
        const { diagnostics } = check(text);
        if (text.includes("= \"?\"")) {
          // opened all the same, to be filled
          const session = this.open(text, m.title);
          Object.assign(session, { phase: "failed", broken: diagnostics });
          setTimeout(() => this.attach(client, session), 5);
          return { session: session.id };
        }
        if (diagnostics.some((d) => d.severity === "error")) throw problem("E203", "The plan has 1 error. Nothing was run.", { diagnostics });
        const session = this.open(text, m.path ?? m.title ?? `${m.template}.toml`);
        setTimeout(() => {
          this.attach(client, session);
          for (const c of this.clients) c.send({ type: "sessions", sessions: this.sessions.map((x) => x.describe()) });
        }, 20);
        return { session: session.describe() };
      }
      case "session.attach": {
        const session = this.sessions.find((x) => x.id === m.session);
        if (session === undefined) throw problem("E920", `There is no session ${m.session}.`);
        setTimeout(() => this.attach(client, session), 5);
        return { session: session.describe() };
      }
    }
    if (command === "plan.import")
      return m.name.endsWith(".ifc")
        ? { text: '# from a building\ntitle = "?"\n', taken: ["42 columns, 80 beams"], guessed: ["concrete C25 from its name"], missing: ["bars of all sections"] }
        : { text: '[[site.neighbour]]\nname = "House"\n', taken: ["1 outline"], guessed: [], missing: [] };
    if (s === undefined) throw problem("E920", "No session is open.");
    const b = () => s.branch(m.branch);
    switch (command) {
      case "run":
        if (s.phase !== "paused") throw problem("E930", `Not possible while the run is ${s.phase}.`);
        s.phase = "running";
        s.record("run", b(), {});
        s.tellState();
        return {};
      case "pause":
        if (s.phase === "running") s.phase = "paused";
        s.record("pause", b(), {});
        s.tellState();
        return {};
      case "step": s.advance(m.frames ?? 1); return {};
      case "speed": s.speed = m.factor; s.tellState(); return {};
      case "rewind": {
        const row = s.rowAt(b(), m.time);
        s.cursor = makeCourse(b().own.second).data.time[row];
        s.tellState();
        return { time: s.cursor, frame: row };
      }
      case "live": s.cursor = null; s.tellState(); return {};
      case "fire": {
        const charge = b().charges[m.charge];
        if (charge.fired) throw problem("E931", `The charge in ${charge.member} has fired already.`);
        return s.edit("fire", `The charge in ${charge.member} fires now.`, m, (x, time) => (x.charges[m.charge].time = time));
      }
      case "set_delay":
        return s.edit("set_delay", m.stage !== undefined ? `${b().stages[m.stage].name} fires at ${m.time} s.` : `The charge in ${b().charges[m.charge].member} fires at ${m.time} s.`, m, (x) => {
          if (m.stage !== undefined) x.stages[m.stage].time = m.time;
          for (const c of x.charges) if (c.index === m.charge || c.stage === m.stage) c.time = m.time;
          if (m.stage === 1) x.own.second = m.time;
        });
      case "add_charge":
        if (!makeCourse(4).data.bodies.some((x) => x.name === m.member)) throw problem("E932", `There is no member “${m.member}”.`, { help: "Names are those of the model, such as C-A1-0." });
        return s.edit("add_charge", `A charge in ${m.member}.`, m, (x, time) => x.charges.push({ index: x.charges.length, stage: -1, member: m.member, position: m.position, destroyed_length: m.destroyed_length, residual_bars: m.residual_bars ?? 0, time: m.time ?? time, fired: false, fails: false, removed: false }));
      case "remove_charge": return s.edit("remove_charge", `The charge in ${b().charges[m.charge].member} is taken out.`, m, (x) => (x.charges[m.charge].removed = true));
      case "add_pre_cut": return s.edit("add_pre_cut", `${m.member} is cut: ${Math.round(100 * m.cut_bars)} % of the bars.`, m, () => undefined);
      case "add_cable": return s.edit("add_cable", `A cable to ${m.member}.`, m, (x) => x.cables.push({ name: `cable ${x.cables.length + 1}`, body: m.member, anchor: m.anchor, force: m.pretension }));
      case "remove_cable": return s.edit("remove_cable", `${m.cable} lets go.`, m, (x) => (x.cables = x.cables.filter((c) => c.name !== m.cable)));
      case "set_friction": return s.edit("set_friction", `Friction ${m.ground} on the ground, ${m.bodies} between bodies.`, m, (x) => (x.friction = { ground: m.ground, bodies: m.bodies }));
      case "undo": {
        const now = b();
        if (now.edits.length === 0 || now.parent === null) throw problem("E934", "There is nothing to undo.");
        s.active = now.parent;
        s.record("undo", now, {});
        s.tellState();
        return { branch: s.active };
      }
      case "branch": {
        const from = b();
        const made = s.addBranch(m.name, from, m.time === undefined ? from.own.row : s.rowAt(from, m.time), from.own.second);
        s.active = made.id;
        if (s.phase === "finished") s.phase = "paused";
        s.record("branch", from, m, made);
        s.tell("branch", { branch: s.describeBranch(made) });
        s.tellState();
        return { branch: made.id };
      }
      case "rename": b().name = m.name; s.tell("branch", { branch: s.describeBranch(b()) }); return {};
      case "switch":
        s.active = b().id;
        s.phase = b().ending === null ? "paused" : "finished";
        s.tellState();
        return {};
      case "compare": {
        const one = s.branch(m.a), two = s.branch(m.b);
        const rows = Math.min(one.own.row, two.own.row) + 1;
        const [p, q] = [makeCourse(one.own.second).data, makeCourse(two.own.second).data];
        return {
          time: p.time.slice(0, rows), series: p.series.map((x, k) => ({ id: x.id, title: x.title, unit: x.unit, group: x.group, a: x.value.slice(0, rows), b: q.series[k].value.slice(0, rows) })),
          bodies: p.bodies.slice(0, 10).map((x, k) => ({ name: x.name, distance: 8 - 0.7 * k })), largest: { time: p.time.slice(0, rows), distance: p.time.slice(0, rows).map((t) => (8 * t) / p.time[rows - 1]) },
          findings: [{ id: "reach", title: "Reach beyond the footprint", a: "23.4 m", b: "21.9 m" }], edits: [],
        };
      }
      case "scene": return { scene: makeCourse(b().own.second).scene };
      case "frames": {
        let count = 0;
        for (let row = m.from; row <= b().own.row && count < m.count; row += m.stride ?? 1, ++count) s.sendFrame(b(), row, 2, client);
        return { count };
      }
      case "findings": return { ...s.findings(b()), ...this.judged };
      case "member": {
        const [, name] = /^([CB]-[^/]*)$/.exec(m.member) ?? [];
        if (name === undefined) return { member: null };
        const at = [-0.2, 0, 0.2];
        const bars = at.flatMap((y) => at.map((z) => ({ y, z, diameter: 0.032 }))).filter((b) => b.y !== 0 || b.z !== 0);
        return {
          member: {
            name, kind: name.startsWith("C") ? "column" : "beam", storey: 0, length: 3, removed: false,
            section: { name: "ground-column", width: 0.5, height: 0.5, bars, cover: 0.02, steel_area: 0.0064, ties: { diameter: 0.01, spacing: 0.2, legs_y: 2, legs_z: 2 } },
            concrete: { name: "C25", fc: 25e6, fct: 2e6, Ec: 25e9 }, steel: { name: "old", fy: 420e6, fu: 500e6 }, masonry: null,
            cuts: b().edits.filter((e) => e.kind === "add_pre_cut").map(() => ({ at: 0.5, cut_bars: 0.5, cut_concrete: 0 })),
          },
        };
      }
      case "zone":
        s.zone = m.zone;
        // the path so far comes as the first event
        if (m.zone !== null) setTimeout(() => s.tell("zone", { branch: b().id, zone: m.zone, points: makeCourse(b().own.second).data.time.slice(0, b().own.row + 1).map((t) => s.zonePoint(t)) }), 5);
        return m.zone === null ? { zone: null } : {
          zone: m.zone,
          law: Object.fromEntries(["moment_y", "moment_z"].map((key) => [key, {
            normal_force: [0, -8e5, -1.6e6], plastic_rotation: [0, 0.005, 0.02, 0.05, 0.1],
            positive: [2.2e5, 3e5, 3.4e5].map((x) => [x, 1.1 * x, 1.15 * x, 0.8 * x, 0.1 * x]), negative: [2.2e5, 3e5, 3.4e5].map((x) => [-x, -1.1 * x, -1.15 * x, -0.8 * x, -0.1 * x]),
          }])),
        };
      case "log": return { entries: s.log };
      case "session.continue": {
        const made = s.addBranch("what-if 1", b(), 0, 4);
        made.own.row = s.rowAt({ own: { row: 269, second: 4 } }, s.earlier.time);
        s.active = made.id;
        s.earlier = null;
        setTimeout(() => this.attach(client, s), 5);
        return { branch: made.id, time: 3 };
      }
      case "plan.text": return { text: `${s.text}# edited\n`, sha256: "", path: s.path, taken: ["Row C fires at 5.5 s."], left_out: ["C-D1-0 is cut: acts from a moment of the run on, which no plan can say"] };
      case "plan.check": return check(m.text);
      case "plan.apply": {
        const result = check(m.text);
        if (result.diagnostics.some((d) => d.severity === "error")) throw problem("E203", "The plan has 1 error.", { diagnostics: result.diagnostics });
        s.text = m.text;
        const made = s.addBranch(m.name, null, 0, 4);
        s.active = made.id;
        s.phase = "paused";
        s.record("plan.apply", b(), { name: m.name }, made);
        s.tell("branch", { branch: s.describeBranch(made) });
        s.tellState();
        return { branch: made.id };
      }
      case "plan.save":
        if (m.force !== true && m.base_sha256 !== hash(s.disk)) throw problem("E941", "The file has changed since.", { sha256: hash(s.disk), text: s.disk });
        s.disk = m.text;
        s.tell("plan_changed", { sha256: hash(s.disk) });
        return { sha256: hash(s.disk) };
      case "study.start": {
        const study = new Study(s, this.studies.length + 1, m.samples ?? 300);
        this.studies.push(study);
        s.record("study.start", b(), { samples: m.samples });
        return { study: study.id, state: study.describe() };
      }
      case "study.list": return { studies: this.studies.map((x) => x.describe()) };
      case "study.watch": {
        const study = this.studies[m.study - 1];
        study.watchers.add(client);
        return { study: study.describe(), samples: study.samples };
      }
      case "study.unwatch": this.studies[m.study - 1]?.watchers.delete(client); return {};
      case "study.cancel": this.studies[m.study - 1].stop("cancelled"); return {};
      case "study.play": {
        const made = s.addBranch(`sample ${m.sample}`, null, 0, 3.5 + (m.sample % 5) * 0.25);
        made.sample = m.sample;
        s.active = made.id;
        s.phase = "paused";
        s.tell("branch", { branch: s.describeBranch(made) });
        s.tellState();
        return { branch: made.id };
      }
      default: throw problem("E911", `“${command}” is not a command.`);
    }
  }
}
