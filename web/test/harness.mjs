// describe, before, after and it of node:test for tests that open browsers and servers. They cannot hang: what a test
// opened is registered by keep() and closed when the last test of the file is over, also when a test or a before()
// failed; every test has a limit of its own; and a watchdog ends the file after TOPPLE_WEB_LIMIT seconds.
// TOPPLE_WEB_LIMIT must lie below the TIMEOUT that tests/web.cmake gives.
import * as node from "node:test";

const fileLimit = 1000 * Number(process.env.TOPPLE_WEB_LIMIT ?? 240);
const closeLimit = 10000;
const kept = new Set();
const running = new Set();
let current; // the suite whose body is read
let left = 0; // tests of the file that are not over

/// Registers something to close. Returns a function that closes it, once however often it is called.
export function keep(close) {
  let closing;
  const once = () => {
    kept.delete(once);
    closing ??= Promise.resolve().then(close);
    return closing;
  };
  kept.add(once);
  return once;
}

function limit(promise, milliseconds, words) {
  let timer;
  const late = new Promise((_, reject) => {
    timer = setTimeout(() => reject(new Error(words)), milliseconds);
  });
  return Promise.race([promise, late]).finally(() => clearTimeout(timer));
}

/// Closes what is still open. Never throws, never takes longer than closeLimit.
export async function closeAll() {
  const all = [...kept].map((close) => close().catch((error) => console.error(`closing: ${error}`)));
  await limit(Promise.all(all), closeLimit, "closing took too long").catch((error) => console.error(String(error)));
}

/// Ends the file at once, with a reason.
async function giveUp(words) {
  console.error(words);
  await closeAll();
  process.exit(1); // what closing could not end (playwright's browsers) ends with this process
}

setTimeout(() => {
  const names = [...running].join(", ");
  void giveUp(`The tests took longer than ${fileLimit / 1000} s${names === "" ? "" : `; running: ${names}`}. Ended by the watchdog.`);
}, fileLimit).unref();
for (const signal of ["SIGINT", "SIGTERM", "SIGHUP"]) process.once(signal, () => void giveUp(`Ended by ${signal}.`));

/// As that of node:test. Option: timeout [ms] of a single test.
export function describe(name, ...rest) {
  const body = rest.pop();
  const suite = { name, before: [], after: [], tests: [], timeout: rest[0]?.timeout ?? 120000, ready: undefined };
  if (current !== undefined) throw new Error("suites inside suites are not supported");
  current = suite;
  body();
  current = undefined;
  left += suite.tests.length;
  let open = suite.tests.length;

  const prepare = async () => {
    for (const hook of suite.before) await hook();
  };
  const finish = async () => {
    for (const hook of suite.after) await limit(Promise.resolve().then(hook), closeLimit, `${name}: after() took too long`);
  };
  node.describe(name, () => {
    for (const test of suite.tests)
      node.it(test.name, async () => {
        const what = `${name} > ${test.name}`;
        running.add(what);
        try {
          suite.ready ??= prepare();
          const run = suite.ready.then(() => test.body());
          await limit(run, test.timeout ?? suite.timeout, `took longer than ${(test.timeout ?? suite.timeout) / 1000} s`);
        } finally {
          running.delete(what);
          try {
            if (--open === 0) await finish();
          } finally {
            if (--left === 0) await closeAll();
          }
        }
      });
  });
}

/// Before the first test of the suite; if it throws, every test of the suite fails with its error.
export const before = (hook) => current.before.push(hook);
/// After the last test of the suite, whatever happened before.
export const after = (hook) => current.after.push(hook);
export const it = (name, ...rest) => {
  const body = rest.pop();
  current.tests.push({ name, body, timeout: rest[0]?.timeout });
};
