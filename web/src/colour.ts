/// Colours of the picture. They go to the screen as they are written: no shader converts them, which a software renderer
/// would pay for at each pixel. Light is computed where it adds up, in linear values.
import * as THREE from "three";

THREE.ColorManagement.enabled = false;
export const screenSpace = THREE.LinearSRGBColorSpace; // what three writes unchanged

/// Red, green, blue of a colour, linear, 0..1.
export function linear(css: string): [number, number, number] {
  const c = new THREE.Color(css).convertSRGBToLinear();
  return [c.r, c.g, c.b];
}

const steps = 4096;
const shown = Uint16Array.from({ length: steps + 1 }, (_, i) => {
  const v = i / steps;
  return Math.round(65535 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055));
});
/// What the screen is to be given for a linear value, 0..65535.
export const toScreen = (value: number): number => shown[Math.min(steps, Math.max(0, Math.round(steps * value)))] as number;
