/** How well the cameras constrain the joints of the selected person. */

/**
 * @typedef {import("./protocol.js").DofObservability} DofObservability
 * @typedef {DofObservability["level"]} Level
 */

const ORDER = /** @type {Level[]} */ (["known", "weak", "unknown"]);

/**
 * Observability of a degree of freedom of the shown pose; null while it is not shown or not known.
 *
 * @param {import("./store.js").Facts} facts
 * @param {number} dof
 */
export function ofDof({ layers, observability, state }, dof) {
  if (!layers.shown.observability || !observability || !state) return null;
  if (observability.person !== state.person || observability.frame !== state.frame) return null;
  return observability.dofs[dof] ?? null;
}

/**
 * Observability of a joint: that of its worst degree of freedom; null for a point without any.
 *
 * @param {import("./store.js").Facts} facts
 * @param {{person: number, point: string}} joint
 */
export function ofJoint(facts, { person, point }) {
  const { session, state } = facts;
  if (person !== state?.person) return null;
  /** @type {DofObservability | null} */
  let worst = null;
  session?.people[person].dofs.forEach(({ joint }, dof) => {
    const found = joint === point ? ofDof(facts, dof) : null;
    if (found && (!worst || ORDER.indexOf(found.level) > ORDER.indexOf(worst.level))) worst = found;
  });
  return /** @type {DofObservability | null} */ (worst);
}
