/// Files made of the picture: PNG of what it shows, WebM of the run played from its beginning.
import { signal } from "@preact/signals";
import { picture } from "./steer_view";
import type { SteerState } from "./steer_state";

export const recording = signal(false);

function offer(data: Blob, name: string): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(data);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}

const fileName = (s: SteerState, ending: string): string => {
  const plain = (text: string): string => text.replace(/[^\p{L}\p{N}.-]+/gu, "-").slice(0, 60);
  return `${plain(s.session.value?.title || "topple")}-${plain(s.branch.value?.name ?? "")}.${ending}`;
};

export function savePng(s: SteerState): void {
  const { scene } = picture;
  if (scene === undefined) return s.notify("bad", "There is no picture: this browser offers no WebGL.");
  // In the same task as the drawing, while the picture is still there.
  const canvas = scene.stage.drawFull();
  canvas.toBlob((blob) => (blob === null ? s.notify("bad", "The browser made no PNG.") : offer(blob, fileName(s, "png"))), "image/png");
}

/// Plays what is computed of the branch and records the picture. Called again it stops early.
export async function saveWebm(s: SteerState): Promise<void> {
  if (recording.value) {
    s.view.value?.state.pauseAt(s.view.value.state.time.value);
    return;
  }
  const { scene } = picture;
  const state = s.view.value?.state;
  if (scene === undefined || state === undefined || state.run.time.length < 2) return s.notify("bad", "There is nothing to record yet.");
  const type = ["video/webm;codecs=vp8", "video/webm"].find((t) => typeof MediaRecorder !== "undefined" && MediaRecorder.isTypeSupported(t));
  if (type === undefined) return s.notify("bad", "This browser cannot record WebM.");
  const canvas = scene.stage.renderer.domElement;
  const recorder = new MediaRecorder(canvas.captureStream(30), { mimeType: type, videoBitsPerSecond: 6e6 });
  const parts: Blob[] = [];
  recorder.ondataavailable = (event) => parts.push(event.data);
  const stopped = new Promise<void>((done) => (recorder.onstop = () => done()));
  const release = scene.stage.holdRatio(1);
  recording.value = true;
  s.look(state.begin);
  recorder.start(500);
  state.playing.value = true;
  await new Promise<void>((done) => {
    const stop = state.playing.subscribe((playing) => {
      if (!playing) queueMicrotask(() => (stop(), done()));
    });
  });
  setTimeout(() => recorder.stop(), 200);
  await stopped;
  release();
  recording.value = false;
  const video = new Blob(parts, { type: "video/webm" });
  if (video.size === 0) s.notify("bad", "The browser recorded nothing.");
  else offer(video, fileName(s, "webm"));
}
