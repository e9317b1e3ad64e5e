// Colours of values: told apart by readers who see red and green alike.
import type { Measure, Payload } from "./payload";

export type Rgb = [number, number, number];

const LOW: Rgb[] = [[165, 0, 38], [215, 48, 39], [244, 109, 67], [253, 174, 97], [254, 224, 144], [224, 238, 240],
  [171, 210, 230], [116, 173, 209]];
const HIGH: Rgb[] = [[236, 236, 230], [254, 217, 118], [253, 141, 60], [227, 26, 28], [128, 0, 38]];
const VALENCES: Rgb[] = [[33, 102, 172], [67, 147, 195], [146, 197, 222], [228, 228, 226], [244, 165, 130],
  [214, 96, 77], [178, 24, 43], [145, 10, 40], [120, 0, 35], [100, 0, 30]];
export const HIGHLIGHT: Rgb = [214, 0, 190];

export interface Theme {
  plain: Rgb; // what has no value
  inside: Rgb; // cut surfaces without one
  faded: Rgb; // what a filter leaves out
  line: Rgb;
}

export const LIGHT: Theme = {
  plain: [198, 206, 214], inside: [232, 214, 176], faded: [232, 234, 236], line: [20, 24, 32],
};
export const DARK: Theme = {
  plain: [160, 170, 182], inside: [190, 168, 122], faded: [56, 60, 66], line: [245, 245, 245],
};

function between(stops: Rgb[], t: number): Rgb {
  const at = Math.min(Math.max(t, 0), 1) * (stops.length - 1);
  const k = Math.min(Math.floor(at), stops.length - 2);
  return [0, 1, 2].map((c) => stops[k][c] + (at - k) * (stops[k + 1][c] - stops[k][c])) as Rgb;
}

// Of a group without a colour of its own.
export function groupColour(k: number): Rgb {
  const h = (k * 137.508) % 360;
  const channel = (n: number) => {
    const a = (n + h / 30) % 12;
    return 255 * (0.68 - 0.24 * Math.max(-1, Math.min(a - 3, 9 - a, 1)));
  };
  return [channel(0), channel(8), channel(4)];
}

// The colour at a share of a measure's scale.
export function scaleColour(measure: Measure, share: number): Rgb {
  if (measure.worst === "off_six")
    return VALENCES[Math.min(Math.floor(share * measure.bins), measure.bins - 1)];
  // Most distances are far below the largest.
  if (measure.worst === "high") return between(HIGH, Math.sqrt(share));
  return between(LOW, share);
}

// Three bytes for each code of a measure's values; code 0 is for none.
export function colourTable(payload: Payload, measure: Measure, none: Rgb): Uint8Array {
  const steps = measure.bins * payload.header.bin_steps;
  const count = measure.groups ?? steps;
  const given = measure.colours && payload.integers(measure.colours, 3);
  const table = new Uint8Array(3 * (count + 1));
  table.set(none.map(Math.round), 0);
  for (let k = 0; k < count; ++k) {
    if (given) {
      table.set(given.subarray(3 * k, 3 * k + 3), 3 * (k + 1));
    } else {
      const colour = measure.groups ? groupColour(k) : scaleColour(measure, (k + 0.5) / steps);
      table.set(colour.map(Math.round), 3 * (k + 1));
    }
  }
  return table;
}

export const css = (colour: ArrayLike<number>, at = 0) =>
  `rgb(${Math.round(colour[at])} ${Math.round(colour[at + 1])} ${Math.round(colour[at + 2])})`;
