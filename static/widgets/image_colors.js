/** Colours of lines over images, from styles/tokens.css. They are the same in both colour schemes. */

/** @type {Map<string, string>} */
const known = new Map();

/** @param {"mark" | "off" | "good" | "warning" | "neutral" | "outline"} name */
export function imageColor(name) {
  const color = known.get(name) ?? getComputedStyle(document.documentElement).getPropertyValue(`--image-${name}`).trim();
  if (color) known.set(name, color);
  return color;
}

/** Dash of lines from where a joint is wanted to where it is: to a pin, or to the pointer out of reach. */
export const OFF_DASH = [3, 3];
