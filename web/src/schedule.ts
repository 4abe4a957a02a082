/// What is to be done before the next picture of the screen, in one go: first what changes, then what draws the change.
/// A drawing that a change asks for is in the same picture; one of its own frame each would show it a picture later.

const changes = new Set<(now: number) => void>();
const drawings = new Set<(now: number) => void>();
let due = false;
let drawn = -Infinity; // [ms]
let isOffered = true;
let gap = 0;

/// From the last drawing to when the screen would have taken the next picture, whether or not there was one [ms].
export const lastGap = (): number => gap;

function ask(): void {
  if (due) return;
  due = true;
  requestAnimationFrame((now) => {
    const begin = performance.now();
    if (!isOffered) gap = begin - drawn;
    isOffered = true;
    try {
      take(changes, now);
    } finally {
      due = false; // what a drawing asks for is of the next picture
      if (changes.size > 0) ask(); // and so is what a change asks to change
      if (drawings.size > 0) {
        drawn = begin;
        isOffered = false;
        take(drawings, now);
        // to be told when the screen is ready for the next one; behind the messages that wait, which may change it
        setTimeout(ask, 0);
      }
    }
  });
}

function take(calls: Set<(now: number) => void>, now: number): void {
  const list = [...calls];
  calls.clear();
  for (const call of list) call(now);
}

/// Once before the next picture, however often it is asked for. Returns what takes it back.
export function changeNext(call: (now: number) => void): () => void {
  changes.add(call);
  ask();
  return () => changes.delete(call);
}
export function drawNext(call: (now: number) => void): () => void {
  drawings.add(call);
  ask();
  return () => drawings.delete(call);
}
