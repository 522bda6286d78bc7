// Functions with the same bits in every browser, unlike those of Math: additions, multiplications and divisions only.

/** Hyperbolic tangent: Lambert's continued fraction at a sixteenth of the argument, and four doublings. */
export function tanh(x: number): number {
  const part = Math.min(Math.max(x, -20), 20) / 16;
  let fraction = 15;
  for (let k = 13; k > 0; k -= 2) fraction = k + (part * part) / fraction;
  let y = part / fraction;
  for (let i = 0; i < 4; i++) y = (2 * y) / (1 + y * y);
  return y;
}

/** Sine of an angle [rad]: the power series within half a turn. */
export function sin(x: number): number {
  const turn = 2 * Math.PI;
  const angle = x - turn * Math.round(x / turn);
  let [term, sum] = [angle, angle];
  for (let k = 2; k < 30; k += 2) {
    term *= (-angle * angle) / (k * (k + 1));
    sum += term;
  }
  return sum;
}
