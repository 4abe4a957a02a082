// The processes that a test has started, such as those of its browser: Linux only.
import { readFileSync, readdirSync } from "node:fs";

/// {id, parent, kind, time}: `kind` is Chromium's ("renderer", "gpu-process", ...; "" of others), `time` that of the processor [ms].
function listProcesses() {
  const list = [];
  for (const id of readdirSync("/proc").filter((name) => /^\d+$/.test(name))) {
    try {
      const fields = readFileSync(`/proc/${id}/stat`, "latin1").split(") ").at(-1).split(" ");
      const kind = /--type=([\w-]+)/.exec(readFileSync(`/proc/${id}/cmdline`, "latin1"))?.[1] ?? "";
      list.push({ id: Number(id), parent: Number(fields[1]), kind, time: 10 * (Number(fields[11]) + Number(fields[12])) });
    } catch {
      continue; // it has ended
    }
  }
  return list;
}

/// Those that this process has started, and theirs.
export function listOwn() {
  const all = listProcesses(), own = new Set([process.pid]);
  for (let before = 0; before !== own.size; ) {
    before = own.size;
    for (const p of all) if (own.has(p.parent)) own.add(p.id);
  }
  return all.filter((p) => own.has(p.id) && p.id !== process.pid);
}

/// Processor time so far of the browser's processes of a kind [ms]. Other work on the machine does not change it much.
export const readTime = (kind) => listOwn().filter((p) => p.kind === kind).reduce((sum, p) => sum + p.time, 0);

/// All that this process has started sleeps, as if the machine did; returns what wakes it.
export function putToSleep(own = listOwn()) {
  for (const p of own) process.kill(p.id, "SIGSTOP");
  return () => {
    for (const p of own) process.kill(p.id, "SIGCONT");
  };
}
