// Numbers as texts: one rule for fields, one for people.

/** A duration in us as people say it. */
export function duration_text(us: number): string {
  const size = Math.abs(us);
  return size < 1000 ? `${number_text(us)} µs` : size < 1e6 ? `${number_text(us / 1000)} ms` : `${number_text(us / 1e6)} s`;
}

/** Six digits that matter, as fields and files have them: with an exponent alone where zeros would be counted. */
export function field_text(value: number): string {
  const rounded = Number(value.toPrecision(6)), size = Math.abs(rounded);
  return size !== 0 && (size >= 1e6 || size < 1e-4) ? rounded.toExponential().replace("e+", "e") : String(rounded);
}

/** An instant, s, with all digits that tell it from others a step before and after it. */
export function time_text(time: number, step: number): string {
  return time.toFixed(digits_of(step));
}
/** After the point, which numbers that are `step` apart have. */
function digits_of(step: number): number {
  let digits = 0;
  while (digits < 9 && Math.abs(step - Number(step.toFixed(digits))) > step * 1e-6) ++digits;
  return digits;
}

/** The numbers at the ticks of an axis, which are `step` apart: with as many digits as tell them from each other. */
export function tick_texts(values: number[], step: number): string[] {
  const size = Math.max(...values.map(Math.abs)), exponent = size > 0 && (size >= 1e5 || size < 1e-3) ? Math.floor(Math.log10(size) + 1e-9) : 0;
  const digits = digits_of(step / 10 ** exponent);
  return values.map((value) => {
    const text = (value / 10 ** exponent).toFixed(digits), is_zero = Number(text) === 0;
    return is_zero ? "0" : (text + (exponent === 0 ? "" : `e${exponent}`)).replace(/-/g, "−");
  });
}

/** Four digits that matter, without noise. */
export const number_text = (value: number): string => text_of(value, 4);
/** Where there is little room. */
export const short_text = (value: number): string => text_of(value, 3);
function text_of(value: number, digits: number): string {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? "NaN" : value > 0 ? "∞" : "−∞";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) return value.toExponential(2).replace("e+", "e").replace(/-/g, "−");
  return String(Number(value.toPrecision(digits))).replace("-", "−");
}
