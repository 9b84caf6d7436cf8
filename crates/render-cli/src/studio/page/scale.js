// From numbers to places on a slider and back.

/** Places of a slider between its ends. */
export const STEPS = 1000;

/**
 * How a parameter lies on its slider: even, or where it spans many powers of ten, by the
 * hyperbolic sine, which is even about 0 and logarithmic beyond the default.
 */
export function scaleOf({ low, high, default: preset = 0, scale }) {
  const inside = (value) => Math.min(high, Math.max(low, value));
  if (scale !== "log") {
    return {
      toPlace: (value) => (STEPS * (value - low)) / (high - low),
      toValue: (place) => inside(tidy(low + ((high - low) * place) / STEPS, high - low)),
    };
  }
  const unit = Math.max(Math.abs(preset), (high - low) * 1e-6) / 4;
  const [from, to] = [low, high].map((value) => Math.asinh(value / unit));
  return {
    toPlace: (value) => (STEPS * (Math.asinh(value / unit) - from)) / (to - from),
    toValue: (place) => {
      const value = unit * Math.sinh(from + ((to - from) * place) / STEPS);
      return inside(Number(value.toPrecision(3)));
    },
  };
}

/** `value` with the digits that a thousandth of `span` needs. */
function tidy(value, span) {
  const digits = Math.max(0, 3 - Math.floor(Math.log10(span)));
  return Number(value.toFixed(Math.min(12, digits)));
}
