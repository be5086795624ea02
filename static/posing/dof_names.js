/** Names of the degrees of freedom, and what they mean: the terms are those of Gavrila & Davis 1996 and of biomechanics. */

/** Short forms, for rows of fields that are too narrow for whole words. */
/** @type {Record<string, string>} */
const SHORT = { abduction: "abd.", elevation: "elev.", extension: "ext.", flexion: "flex.", protraction: "protr.", deviation: "dev.", inversion: "inv." };

/** Joints whose angles move the trunk or the head, not a limb. */
const TRUNK = new Set(["torso", "spine", "waist", "neck", "upper_neck"]);

/** @type {Record<string, string>} */
const OF_LIMBS = {
  abduction: "moves the limb sideways, away from the body",
  elevation: "moves the limb forward and up",
  flexion: "moves the leg forward and up",
  extension: "bends the joint; 0 is straight",
  twist: "turns the limb about its own axis",
  deviation: "bends the hand towards the thumb or the little finger",
  inversion: "turns the sole inwards or outwards",
};
/** @type {Record<string, string>} */
const OF_WRIST = {
  twist: "turns the palm up or down",
  flexion: "bends the hand towards the palm or the back",
};
/** @type {Record<string, string>} */
const OF_ANKLE = { flexion: "lifts or lowers the toes", twist: "turns the toes inwards or outwards" };
/** @type {Record<string, string>} */
const OF_TRUNK = {
  abduction: "leans sideways",
  elevation: "leans forward or backward",
  twist: "turns left or right about its own axis",
};
/** @type {Record<string, string>} */
const OF_COLLARBONE = {
  elevation: "raises the shoulder",
  protraction: "moves the shoulder forward",
  roll: "turns the collarbone about its own axis",
};

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
  if (joint.endsWith("wrist") && name in OF_WRIST) return OF_WRIST[name];
  if (joint.endsWith("ankle") && name in OF_ANKLE) return OF_ANKLE[name];
  return (TRUNK.has(joint) ? OF_TRUNK : OF_LIMBS)[name] ?? "";
}
