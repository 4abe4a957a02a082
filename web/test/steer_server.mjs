// The real `topple steer` as a process of a test.
import { spawn } from "node:child_process";
import { keep } from "./harness.mjs";

/// Starts `topple steer` in a folder and waits for its address. A program that ends or says nothing is an error with its output.
export async function startServer(program, plan, folder) {
  const child = spawn(program, ["steer", plan, "--no-open"], { cwd: folder, stdio: ["ignore", "pipe", "pipe"] });
  let output = "";
  let ended = false;
  const end = new Promise((done) => child.on("close", () => ((ended = true), done())));
  const close = keep(async () => {
    child.kill("SIGTERM");
    const hard = setTimeout(() => child.kill("SIGKILL"), 5000);
    await end;
    clearTimeout(hard);
  });
  process.on("exit", () => child.kill("SIGKILL"));
  const url = await new Promise((done, fail) => {
    const timer = setTimeout(() => fail(new Error(`${program} steer printed no address within 60 s:\n${output}`)), 60000);
    const look = (text) => {
      output += text;
      const found = /http:\/\/127\.0\.0\.1:\d+\/[0-9a-f]{32}\//.exec(output)?.[0];
      if (found !== undefined) done((clearTimeout(timer), found));
    };
    child.stdout.on("data", look);
    child.stderr.on("data", look);
    child.on("error", (error) => fail((clearTimeout(timer), new Error(`${program}: ${error.message}`))));
    void end.then(() => fail((clearTimeout(timer), new Error(`${program} steer ended:\n${output}`))));
  });
  return { url, id: child.pid, close, output: () => output, ended: () => ended };
}
