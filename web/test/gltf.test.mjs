// What `topple export --gltf` wrote: valid by the Khronos validator, and opened and played by three.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import { test } from "node:test";
import validator from "gltf-validator";
import { AnimationMixer, Box3, Vector3 } from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";

const folder = process.env.TOPPLE_EXPORTS;
const options = { skip: folder === undefined && "TOPPLE_EXPORTS is not set" };
const bytes = folder && (await readFile(join(folder, "record.glb")));
const record = folder && JSON.parse(await readFile(join(folder, "record.json"), "utf8"));

test("the Khronos validator finds nothing to complain of", options, async () => {
  const report = await validator.validateBytes(new Uint8Array(bytes), { maxIssues: 100 });
  const { numErrors, numWarnings } = report.issues;
  assert.deepEqual([numErrors, numWarnings], [0, 0], JSON.stringify(report.issues.messages.slice(0, 5), null, 1));
  assert.equal(report.info.animationCount, 1);
});

test("three plays it: every body is where the record has it, z up turned to y up", options, async () => {
  const gltf = await new GLTFLoader().parseAsync(
    bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength), "");
  const mixer = new AnimationMixer(gltf.scene);
  mixer.clipAction(gltf.animations[0]).play();
  const bodies = record.bodies.map((body) => {
    let found;
    gltf.scene.traverse((o) => (o.userData.name ?? o.name) === body.name && (found = o));
    return found;
  });
  assert.ok(bodies.every((found, b) => found !== undefined || record.bodies[b].shapes.length === 0));
  let farthest = 0;
  for (const frame of [0, Math.floor(record.time.length / 2), record.time.length - 1]) {
    // just before the end: there the animation begins again
    mixer.setTime(Math.min(record.time[frame] - record.time[0], gltf.animations[0].duration - 1e-5));
    gltf.scene.updateMatrixWorld(true);
    const box = new Box3();
    record.bodies.forEach((_, b) => {
      if (bodies[b] === undefined) return;
      const [x, y, z] = record.position[frame][b];
      const at = bodies[b].getWorldPosition(new Vector3());
      // 1e-3 m: parts fall with up to some 20 m/s, and the last frame is asked 1e-5 s early
      farthest = Math.max(farthest, at.distanceTo(new Vector3(x, z, -y)));
      box.expandByObject(bodies[b]);
    });
    assert.ok(Number.isFinite(box.max.y) && box.max.y > 0);
  }
  assert.ok(farthest < 1e-3, `${farthest} m`);
});
