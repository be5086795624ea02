/** Names of the degrees of freedom, and what they mean: the terms are those of Gavrila & Davis 1996 and of biomechanics. */

/** Short forms, for rows of fields that are too narrow for whole words. */
/** @type {Record<string, string>} */
const SHORT = { abduction: "abd.", elevation: "elev.", extension: "ext.", flexion: "flex.", protraction: "protr." };

/** Joints whose angles move the trunk or the head, not a limb. */
const TRUNK = new Set(["torso", "spine", "waist", "neck"]);

/** @type {Record<string, string>} */
const OF_LIMBS = {
  abduction: "moves the limb sideways, away from the body",
  elevation: "moves the limb forward and up",
  flexion: "moves the leg forward and up",
  extension: "bends the joint; 0 is straight",
  twist: "turns the limb about its own axis",
};
/** @type {Record<string, string>} */
const OF_TRUNK = {
  abduction: "leans sideways",
  elevation: "leans forward or backward",
  twist: "turns left or right about its own axis",
};
/** @type {Record<string, string>} */
const OF_COLLARBONE = { elevation: "raises the shoulder", protraction: "moves the shoulder forward" };

/** @param {string} name of a degree of freedom within its joint */
export function shortName(name) {
  return SHORT[name] ?? name;
}

/**
 * Say in a few words what a degree of freedom does; empty for an unknown name.
 *
 * @param {{joint: string, name: string}} dof
 */
export function meaning({ joint, name }) {
  if (["x", "y", "z"].includes(name)) return `position along the ${name} axis of the calibration`;
  if (joint.endsWith("collarbone")) return OF_COLLARBONE[name] ?? "";
  return (TRUNK.has(joint) ? OF_TRUNK : OF_LIMBS)[name] ?? "";
}
