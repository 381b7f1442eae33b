// Maps values to positions in a figure, and series to colours.

/** Minimum and maximum of values; there may be too many of them for arguments of a function. */
export function extremes(values) {
  return values.reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [Infinity, -Infinity]);
}

/** A whole number from 0 to n - 1. */
export function clamp(value, n) {
  return Math.max(0, Math.min(n - 1, value));
}

/** Round numbers within a range, about `n` of them. */
export function ticks(low, high, n) {
  const raw = (high - low) / n || 1;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((candidate) => candidate >= raw);
  const first = Math.ceil(low / step);
  return Array.from({ length: Math.floor(high / step) - first + 1 }, (_, i) => (first + i) * step);
}

/** At most a few hundred points of a curve, so that ten thousand generations draw at once: the
 *  first, smallest and largest value of each piece. */
export function thinned(points, n) {
  if (points.length <= 3 * n) return points;
  const piece = Math.ceil(points.length / n);
  const kept = [];
  for (let i = 0; i < points.length; i += piece) {
    const part = points.slice(i, i + piece);
    const least = part.reduce((a, b) => (b[1] < a[1] ? b : a));
    const greatest = part.reduce((a, b) => (b[1] > a[1] ? b : a));
    kept.push(...[...new Set([part[0], least, greatest])].sort((a, b) => a[0] - b[0]));
  }
  return kept;
}

/** A quantile of sorted values, interpolated between two of them. */
export function quantile(sorted, share) {
  const at = share * (sorted.length - 1);
  const low = Math.floor(at);
  return sorted[low] + (sorted[Math.min(low + 1, sorted.length - 1)] - sorted[low]) * (at - low);
}

/** Colours from bad to good, distinguishable for colour-blind people and in grey. */
export const STOPS = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];

/** Red, green and blue of a share from 0 to 1. */
export function rampColor(share) {
  const at = Math.max(0, Math.min(1, share)) * (STOPS.length - 1);
  const low = Math.min(Math.floor(at), STOPS.length - 2);
  return STOPS[low].map((from, i) => Math.round(from + (STOPS[low + 1][i] - from) * (at - low)));
}

/** Colours that are distinguishable on light and dark, also for most colour-blind people. */
const FEW = ["#4269d0", "#e0571c", "#2f9a44", "#a463f2", "#b98a00", "#0a9396", "#e0559a", "#9c6b4e", "#6d8fd6", "#7d828c"];
const DASHES = ["", "7 4", "2 3"];
const LIGHTNESS = [0.42, 0.58, 0.5];

/** Colour and dashes of series `i` of `n`: no two of hundreds of series are alike. */
export function seriesStyle(i, n) {
  if (n <= FEW.length) return { color: FEW[i], dash: "" };
  // Neighbours rarely share a hue, and then have different dashes.
  const n_hues = Math.ceil(n / DASHES.length);
  const turn = Math.floor(i / n_hues);
  return { color: hex(((i % n_hues) + turn / DASHES.length) / n_hues, 0.62, LIGHTNESS[turn]), dash: DASHES[turn] };
}

/** Hue, saturation and lightness, each from 0 to 1, in a format that drawing programs read. */
function hex(hue, saturation, lightness) {
  const part = (n) => {
    const k = (n + hue * 12) % 12;
    const value = lightness - saturation * Math.min(lightness, 1 - lightness) * Math.max(-1, Math.min(k - 3, 9 - k, 1));
    return Math.round(255 * value).toString(16).padStart(2, "0");
  };
  return `#${part(0)}${part(8)}${part(4)}`;
}
