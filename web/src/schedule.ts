/// What is to be done before the next picture of the screen, in one go: first what changes, then what draws the change.
/// A drawing that a change asks for is in the same picture; one of its own frame each would show it a picture later.

const changes = new Set<(now: number) => void>();
const drawings = new Set<(now: number) => void>();
let due = false;
let asked = 0;
let shown = 0; // what is drawn now was asked for then

/// When the first of what is being done was asked for [ms].
export const askedAt = (): number => shown;

function ask(): void {
  if (due) return;
  due = true;
  asked = performance.now();
  requestAnimationFrame((now) => {
    shown = asked;
    try {
      take(changes, now);
    } finally {
      due = false; // what a drawing asks for is of the next picture
      if (changes.size > 0) ask(); // and so is what a change asks to change
      take(drawings, now);
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
